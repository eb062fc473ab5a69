"""What trajectories.sh made of its recordings, as a Markdown table, with a check by ipctk: trajectories.py OUT

Beside it ipctk's collision-free step size: every frame moves towards the next recorded one by the one share that additive
continuous detection allows all vertices together. Then both on the same motions, one by one."""
import csv
import pathlib
import sys

import ipctk
import numpy as np

from step_size import kept, masses, norm, read, step_size

FPS, RETURN = 62.5, 0.2  # as trajectories.sh and ci/clean-trajectory have them

def followed(recorded, f, free):
    """The recording followed by one share of all motion a frame: milliseconds, shares, distance from what was recorded."""
    x, m = recorded[0].copy(), masses(recorded[0], f, free)
    times, shares, off = [], [], []
    for target in recorded[1:]:
        t, ms = step_size(f, x, target)
        times.append(ms)
        shares.append(t)
        x = x + (t if t == 1 else 0.999 * t) * (target - x)
        off.append(norm(m, x - target) / np.sqrt(m.sum()))
    return np.array(times), np.array(shares), np.array(off)


def same_motions(recorded, cleaned, f, free, ours):
    """Every motion that the filter was given in displacement mode, from the same start, by ipctk's step size as well."""
    m, kept_to = masses(recorded[0], f, free), np.exp(-1 / (FPS * RETURN))
    rows = []
    for k in range(1, len(recorded)):
        x = cleaned[k - 1]
        wish = recorded[k] + (kept_to if k > 1 else 0.0) * (x - recorded[k - 1])
        # What is already where it should be has nothing to keep.
        if norm(m, wish - x) > 0:
            t, ms = step_size(f, x, wish)
            rows.append([t, kept(m, x, wish, cleaned[k]), ms, ours[k]])
    return np.array(rows)


def crossing(folder, names):
    """Frames in which ipctk finds intersections."""
    bad = 0
    for name in names:
        v, f, _ = read(folder / name)
        mesh = ipctk.CollisionMesh(np.asfortranarray(v), ipctk.edges(f), f)
        bad += ipctk.has_intersections(mesh, np.asfortranarray(v))
    return bad


ipctk.set_num_threads(1)
compared = []
out = pathlib.Path(sys.argv[1])
print("| recording | frames | crossing, as recorded | mode | frames done | crossing, certified (ipctk) | ms a frame: median, largest | off, mm: root mean square, worst frame; largest |\n|---|---|---|---|---|---|---|---|")
for source in sorted(p for p in out.iterdir() if p.is_dir() and not p.name.endswith(("displacement", "position"))):
    names = sorted(p.name for p in source.glob("frame_*.obj"))
    before = crossing(source, names)
    for mode in ["displacement", "position"]:
        folder = out / f"{source.name}_{mode}"
        rows = list(csv.DictReader(open(f"{folder}.csv")))
        done = [row["frame"] for row in rows]
        certified = sum(int(line.rsplit(", ", 1)[1].split()[0]) > 0 for line in open(f"{folder}.certificate") if " vertices, " in line)
        ms = np.array([float(row["milliseconds"]) for row in rows])
        off = 1e3 * np.array([[float(row["off_mean_square"]), float(row["off_largest"])] for row in rows])
        print(f"| {source.name} | {len(names)} | {before} | {mode} | {len(done)} | {certified} ({crossing(folder, done)}) |"
              f" {np.median(ms):.0f}, {ms.max():.0f} | {off[:, 0].max():.1f}; {off[:, 1].max():.1f} |", flush=True)
    recorded, (_, f, free) = [read(source / name)[0] for name in names], read(source / names[0])
    ms, shares, off = followed(recorded, f, free)
    stuck = next((i + 1 for i, t in enumerate(shares) if t < 1e-3), None)
    print(f"| {source.name} | {len(names)} | {before} | ipctk, one step size | {len(shares) + 1} | 0 | {np.median(ms):.0f}, {ms.max():.0f} |"
          f" {1e3 * off.max():.0f}; stands still from frame {stuck} on |", flush=True)
    folder = out / f"{source.name}_displacement"
    times = [float(row["milliseconds"]) for row in csv.DictReader(open(f"{folder}.csv"))]
    rows = same_motions(recorded, [read(folder / name)[0] for name in names], f, free, times)
    hit = rows[rows[:, 0] < 1]
    compared.append(f"| {source.name} | {len(hit)} of {len(rows)} | {np.median(hit[:, 0]):.3f}, {hit[:, 0].mean():.3f} | {np.median(hit[:, 1]):.3f}, {hit[:, 1].mean():.3f} |"
                    f" {np.median(hit[:, 2]):.0f}, {hit[:, 2].max():.0f} | {np.median(hit[:, 3]):.0f}, {hit[:, 3].max():.0f} |")
print("\n| motions of displacement mode that collide | frames | kept by ipctk: median, mean | by the filter | ms, ipctk: median, largest | filter |\n|---|---|---|---|---|---|")
print("\n".join(compared))
