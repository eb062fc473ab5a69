"""Writes the frames that a run saved (`--save RUN.npz`) as OBJ files, with what the cloth falls on: frames.py RUN.npz OUT SCENE"""
import pathlib
import sys

import numpy as np

import peers_common as pc


def sphere(centre, radius, refinements=4):
    """Vertices on the sphere and faces of an icosahedron whose triangles are cut into four again and again."""
    g = (1 + 5**0.5) / 2
    v = [[0, a, b * g] for a in (-1, 1) for b in (-1, 1)]
    v = np.array(v + [[x[2], x[0], x[1]] for x in v] + [[x[1], x[2], x[0]] for x in v])
    near = [[(a, b, c) for a in range(12) for b in range(a) for c in range(b)
             if max(np.linalg.norm(v[i] - v[j]) for i, j in ((a, b), (b, c), (c, a))) < 2.1]]
    f, v = near[0], [x / np.linalg.norm(x) for x in v]
    f = [t if np.linalg.det([v[i] for i in t]) > 0 else t[::-1] for t in f]
    for _ in range(refinements):
        middle, finer = {}, []

        def half(i, j):
            key = (min(i, j), max(i, j))
            if key not in middle:
                middle[key] = len(v)
                v.append((v[i] + v[j]) / np.linalg.norm(v[i] + v[j]))
            return middle[key]

        for a, b, c in f:
            ab, bc, ca = half(a, b), half(b, c), half(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        f = finer
    return centre + radius * np.array(v), np.array(f)


run, out, scene = np.load(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
out.mkdir(parents=True, exist_ok=True)
r = 5.0
parts = [("ground", np.array([[-r, -r, 0], [r, -r, 0], [r, r, 0], [-r, r, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))]
if scene == "drape":
    # It stands on the ground; one that reaches into it would intersect it.
    parts.append(("sphere", *sphere(pc.SPHERE_C + [0, 0, 1e-4], pc.SPHERE_R)))
for k, x in enumerate(run["frames"]):
    lines, first = [], 1
    for name, v, f in [("cloth", x, run["faces"]), *parts]:
        lines.append(f"o {name}")
        lines += [f"v {a!s} {b!s} {c!s}" for a, b, c in v]
        lines += [f"f {a} {b} {c}" for a, b, c in f + first]
        first += len(v)
    (out / f"frame_{k:04}.obj").write_text("\n".join(lines) + "\n")
