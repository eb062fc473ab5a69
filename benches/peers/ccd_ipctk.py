"""ipctk's continuous detection on the steps of benches/ccd: one JSON line per figure, CPU seconds, one thread.

Usage: ccd_ipctk.py [--tight] DIR...   (--tight: Tight Inclusion as well, minutes a scene; needs numpy and ipctk; see benches/ccd/main.rs for what a directory holds)
pairs     misses: native loop over the candidates that do not hit (is_step_collision_free stops at the first hit);
          hits: one binding call each, the cost of a call that returns at once subtracted. At most LIMIT candidates.
earliest  compute_collision_free_stepsize over all candidates.
"""
import glob, json, os, sys, time
import numpy as np
import ipctk

LIMIT = 150_000
F = np.asfortranarray


def out(**k):
    print(json.dumps({a: (float(f"{b:.5g}") if isinstance(b, float) else b) for a, b in k.items()}), flush=True)


def cpu(fn, repeat=3):
    best = []
    for _ in range(repeat):
        c = time.thread_time()
        r = fn()
        best.append(time.thread_time() - c)
    return float(np.median(best)), r


def ply(path):
    b = open(path, "rb").read()
    h = b.index(b"end_header\n") + 11
    head = b[:h].decode()
    nv, nf = (int(head.split(f"element {e} ")[1].split()[0]) for e in ("vertex", "face"))
    v = np.frombuffer(b, "<f8", 3 * nv, h).reshape(-1, 3)
    f = np.frombuffer(b, np.dtype([("n", "u1"), ("i", "<i4", 3)]), nf, h + 24 * nv)["i"]
    return v.copy(), f.astype(np.int32)


def steps(folder):
    for p in sorted(glob.glob(f"{folder}/*_t0.npy")):
        n = p[:-7]
        yield os.path.basename(n), np.load(p), np.load(n + "_t1.npy"), np.load(n + "_f.npy")
    for p in sorted(glob.glob(f"{folder}/*-t0.ply")):
        v0, f = ply(p)
        yield os.path.basename(p)[:-7], v0, ply(p[:-7] + "-t1.ply")[0], f


def pairs(scene, name, kind, solver, call, every, mesh, v0, v1, rows_of):
    step = max(1, len(every) // LIMIT)
    sample = every[::step]
    far = [np.array([100.0 * i, 0.3 * i, 0.1 * i * i]) for i in range(4)] * 2
    c = time.thread_time()
    for _ in range(5000):
        call(*far, 0.0, 0.0)
    overhead = (time.thread_time() - c) / 5000
    rows = [rows_of(p) for p in sample]
    arguments = [[x[i] for x in (v0, v1) for i in r] for r in rows]
    hit = np.zeros(len(sample), bool)
    for i, a in enumerate(arguments):
        hit[i] = call(*a)[0]
    hits = [a for a, h in zip(arguments, hit) if h]
    hit_seconds, _ = cpu(lambda: [call(*a) for a in hits]) if hits else (0.0, None)
    c = ipctk.Candidates()
    misses = [p for p, h in zip(sample, hit) if not h]
    setattr(c, "fv_candidates" if kind == "vf" else "ee_candidates", misses)
    miss_seconds, free = cpu(lambda: c.is_step_collision_free(mesh, v0, v1, 0.0, solver))
    net = max(hit_seconds - overhead * len(hits), 1e-12)
    out(part="pairs", scene=scene, kind=kind, method=name, pairs=len(every), sampled=len(sample), hits=len(hits),
        free=bool(free), misses_million_per_second=len(misses) / miss_seconds / 1e6,
        hits_million_per_second=len(hits) / net / 1e6,
        million_per_second=len(sample) / (miss_seconds + net) / 1e6)


def main():
    ipctk.set_num_threads(1)
    solvers = {"additive": ipctk.AdditiveCCD()}
    if "--tight" in sys.argv:
        solvers["tight inclusion"] = ipctk.TightInclusionCCD(max_iterations=10000)
    for folder in [a for a in sys.argv[1:] if a != "--tight"]:
        for scene, v0, v1, f in steps(folder):
            v0, v1, f = F(v0), F(v1), F(f)
            e = F(ipctk.edges(f))
            mesh = ipctk.CollisionMesh(v0, e, f)
            c = ipctk.Candidates()
            c.build(mesh, v0, v1, 0.0, ipctk.LBVH())
            for name, solver in solvers.items():
                seconds, t = cpu(lambda: c.compute_collision_free_stepsize(mesh, v0, v1, 0.0, solver))
                out(part="earliest", scene=scene, method=name, pairs=len(c), milliseconds=seconds * 1e3, time=float(t))
                pairs(scene, name, "vf", solver, solver.point_triangle_ccd, c.fv_candidates, mesh, v0, v1,
                      lambda p: [p.vertex_id, *f[p.face_id]])
                pairs(scene, name, "ee", solver, solver.edge_edge_ccd, c.ee_candidates, mesh, v0, v1,
                      lambda p: [*e[p.edge0_id], *e[p.edge1_id]])


if __name__ == "__main__":
    main()
