"""What trajectories.sh made of its recordings, as a Markdown table, with a check by ipctk: trajectories.py OUT

The last columns are ipctk's collision-free step size on the same frames: from the recorded positions, where they are
clean, else from where it stands, every frame moves towards the next recorded one by the one share that ipctk's additive
continuous detection allows all vertices together."""
import csv
import pathlib
import sys
import time

import ipctk
import numpy as np


def read(path):
    """Vertices, triangles, and whether a vertex is of the first object."""
    v, f, first, objects = [], [], [], 0
    for line in path.read_text().splitlines():
        words = line.split()
        if line.startswith("o "):
            objects += 1
        elif line.startswith("v "):
            v.append([float(w) for w in words[1:4]])
            first.append(objects == 1)
        elif line.startswith("f "):
            corners = [int(w) - 1 for w in words[1:]]
            f += [[corners[0], a, b] for a, b in zip(corners[1:], corners[2:])]
    return np.array(v), np.array(f, dtype=np.int32), np.array(first)


def masses(v, f, free):
    """Thirds of the areas of the faces around each vertex; what does not move has none."""
    area = 0.5 * np.linalg.norm(np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]), axis=1)
    m = np.zeros(len(v))
    np.add.at(m, f.ravel(), np.repeat(area / 3, 3))
    return np.where(free, m, 0.0)


def norm(m, x):
    return np.sqrt((m[:, None] * x**2).sum())


def step_size(recorded, f, free):
    """Share of each frame's motion that ipctk lets pass: seconds, shares, distance from what was recorded."""
    x, m = recorded[0].copy(), masses(recorded[0], f, free)
    e = ipctk.edges(f)
    mesh = ipctk.CollisionMesh(np.asfortranarray(x), e, f)
    mesh.can_collide = lambda a, b: bool(free[a] or free[b])
    seconds, shares, off = [], [], []
    for target in recorded[1:]:
        start = time.process_time()
        t = ipctk.compute_collision_free_stepsize(mesh, np.asfortranarray(x), np.asfortranarray(target), 0.0, ipctk.LBVH(), ipctk.AdditiveCCD())
        seconds.append(time.process_time() - start)
        shares.append(t)
        # All of it, scripted geometry included: one number for everything.
        x = x + (t if t == 1 else 0.999 * t) * (target - x)
        off.append(norm(m, x - target) / np.sqrt(m.sum()))
    return 1e3 * np.array(seconds), np.array(shares), np.array(off)


def crossing(folder, names):
    """Frames in which ipctk finds intersections."""
    bad = 0
    for name in names:
        v, f, free = read(folder / name)
        mesh = ipctk.CollisionMesh(np.asfortranarray(v), ipctk.edges(f), f)
        mesh.can_collide = lambda a, b: bool(free[a] or free[b])
        bad += ipctk.has_intersections(mesh, np.asfortranarray(v))
    return bad


ipctk.set_num_threads(1)
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
    ms, shares, off = step_size(recorded, f, free)
    stuck = next((i + 1 for i, t in enumerate(shares) if t < 1e-3), None)
    print(f"| {source.name} | {len(names)} | {before} | ipctk, one step size | {len(shares)} | 0 | {np.median(ms):.0f}, {ms.max():.0f} |"
          f" {1e3 * off.max():.0f}; stands still from frame {stuck} on, shares {np.round(shares[:stuck], 3).tolist()[-5:]} |", flush=True)
