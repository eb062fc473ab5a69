"""ipctk's collision-free step size, one share for all vertices, against the velocity filter on the same motions: step_size.py DIR

DIR holds folders that `cargo bench --bench filter -- write=DIR` wrote: start.obj, wish.obj, end.obj (what the filter made of
it) and its milliseconds. Processor milliseconds, one thread, the best of a few calls; "kept" is the part of the motion along
the wish, in the norm of the masses: 1 is all of it."""
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


def kept(m, start, wish, end):
    """Part of a motion along the wish."""
    way = m[:, None] * (wish - start)
    return (way * (end - start)).sum() / (way * (wish - start)).sum()


def step_size(f, start, wish, calls=1):
    """Largest share that lets no vertex meet anything, and milliseconds of the best call, which has to build its tree."""
    start, wish = np.asfortranarray(start), np.asfortranarray(wish)
    mesh = ipctk.CollisionMesh(start, ipctk.edges(f), f)
    best = np.inf
    for _ in range(calls):
        clock = time.process_time()
        t = ipctk.compute_collision_free_stepsize(mesh, start, wish, 0.0, ipctk.LBVH(), ipctk.AdditiveCCD())
        best = min(best, time.process_time() - clock)
    return t, 1e3 * best


if __name__ == "__main__":
    ipctk.set_num_threads(1)
    print("| motion | vertices | kept by ipctk | by the filter | ms, ipctk | filter | ipctk finds at the filter's end |\n|---|---|---|---|---|---|---|")
    for folder in sorted(p for p in pathlib.Path(sys.argv[1]).iterdir() if (p / "end.obj").exists()):
        (start, f, free), (wish, _, _), (end, _, _) = [read(folder / f"{name}.obj") for name in ("start", "wish", "end")]
        t, ms = step_size(f, start, wish, 5)
        m, ours = masses(start, f, free), float((folder / "milliseconds").read_text())
        crossing = ipctk.has_intersections(ipctk.CollisionMesh(np.asfortranarray(end), ipctk.edges(f), f), np.asfortranarray(end))
        print(f"| {folder.name} | {len(start)} | {t:.3f} | {kept(m, start, wish, end):.3f} | {ms:.1f} | {ours:.1f} |"
              f" {'crossings' if crossing else 'no crossing'} |", flush=True)
