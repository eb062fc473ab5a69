"""Shared scene, material numbers, inputs and checks for all peer scripts.

Scene "drape": 1 m x 1 m cloth, N x N vertices, starts flat and horizontal,
falls on a fixed sphere (r = 0.25 m, standing on the ground) and pools on the
ground plane z = 0.  Scene "crumple": the same cloth starts vertical, tilted by
10 degrees, 2 cm above the ground, no sphere: it falls edge-on and folds on itself.
Scene "falling_cloth": a strip of 2 m x 0.5 m of as many vertices hangs 2 degrees off
vertical over the ground and comes down in folds, friction 0.1, bending 2e-5 N m.
"""
import argparse, json, os, time
import numpy as np

GRAVITY = 9.81
DENSITY = 0.2        # kg/m^2
SIZE = 1.0           # m
STRETCH = 1.0e3      # N/m, 2D Young modulus E*h
POISSON = 0.3
BEND = 1.0e-5        # N m, plate stiffness
FRICTION = 0.3
THICKNESS = 2.0e-3   # m, distance kept between two layers, where the peer has it
SPHERE_C = np.array([0.02, 0.03, 0.25])   # off centre, so that nothing is symmetric
SPHERE_R = 0.25
START_Z = 0.56


def lame_2d():
    """Plane-stress Lame numbers of a membrane, N/m."""
    return STRETCH * POISSON / (1 - POISSON**2), STRETCH / (2 * (1 + POISSON))


def args(name, steps=1000, **extra):
    p = argparse.ArgumentParser(name)
    p.add_argument("--n", type=int, default=50, help="vertices along one side")
    p.add_argument("--dt", type=float, default=0.004)
    p.add_argument("--steps", type=int, default=steps)
    p.add_argument("--scene", choices=["drape", "crumple", "falling_cloth"], default="drape")
    p.add_argument("--budget", type=float, default=420.0, help="stop after this many processor seconds")
    p.add_argument("--save", default="", help="write the vertices of checked frames to this .npz")
    p.add_argument("--check", type=int, default=10, help="check every this many steps")
    for k, v in extra.items():
        p.add_argument("--" + k.replace("_", "-"), type=type(v), default=v)
    a = p.parse_args()
    if a.scene == "falling_cloth":
        global FRICTION, BEND
        FRICTION, BEND = 0.1, 2.0e-5
        if "bend" in extra and a.bend == extra["bend"] == 1.0e-5:
            a.bend = BEND
    return a


def grid(rows=50, columns=50, length=SIZE, width=SIZE):
    """rows x columns vertices in the z = 0 plane centred on 0, faces with alternating diagonals."""
    x, y = np.meshgrid(np.linspace(-length / 2, length / 2, rows), np.linspace(-width / 2, width / 2, columns), indexing="ij")
    v = np.stack([x.ravel(), y.ravel(), np.zeros(rows * columns)], axis=1)
    f = []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a, b, c, d = i * columns + j, (i + 1) * columns + j, (i + 1) * columns + j + 1, i * columns + j + 1
            f += [[a, b, c], [a, c, d]] if (i + j) % 2 == 0 else [[a, b, d], [b, c, d]]
    return v, np.array(f, dtype=np.int32)


def cloth(scene="drape", n=50):
    """Rest mesh (flat) and start positions of the scene."""
    rest, f = grid(2 * n, n // 2, 2 * SIZE, SIZE / 2) if scene == "falling_cloth" else grid(n, n)
    v = rest.copy()
    if scene == "drape":
        v[:, 2] += START_Z
    elif scene == "falling_cloth":
        a = np.deg2rad(-88.0)
        r = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
        v = v @ r.T
        v[:, 2] += 1.03
    else:
        a = np.deg2rad(80.0)   # 10 degrees off vertical
        r = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        v = v @ r.T
        v[:, 2] += 0.02 - v[:, 2].min()
    return rest, v, f


def edges_of(f):
    e = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1)
    return np.unique(e, axis=0).astype(np.int32)


class Checker:
    """Self-intersections by ipctk, and depth of vertices in the sphere and ground."""

    def __init__(self, rest, f, scene):
        import ipctk
        self.ipc, self.scene = ipctk, scene
        self.f, self.e = np.asfortranarray(f), np.asfortranarray(edges_of(f))
        self.mesh = ipctk.CollisionMesh(np.asfortranarray(rest), self.e, self.f)
        self.bad, self.bad_far, self.checked, self.worst, self.first = 0, 0, 0, 0, None
        self.depth_ground = self.depth_sphere = self.max_speed = self.stretch = 0.0
        self.l0 = np.linalg.norm(rest[self.e[:, 0]] - rest[self.e[:, 1]], axis=1)
        self.exploded, self.prev, self.frames = False, None, []
        self.rest, self.far, self.worst_far = rest, 2.5 * self.l0.min(), 0
        self.near, self.first_near = 0, None

    def pairs(self, x):
        """Number of intersecting edge/face pairs, and of those more than two cells apart in the rest mesh (peers that
        skip close neighbours miss only the others)."""
        bp = self.ipc.LBVH()
        bp.build(x, self.e, self.f)
        n = far = 0
        for c in bp.detect_edge_face_candidates():
            e, t = self.e[c.edge_id], self.f[c.face_id]
            if set(e) & set(t):
                continue
            if self.ipc.is_edge_intersecting_triangle(x[e[0]], x[e[1]], x[t[0]], x[t[1]], x[t[2]]):
                n += 1
                far += np.abs(self.rest[e][:, None] - self.rest[t][None]).max(-1).min() > self.far
        return n, far

    def __call__(self, step, x, dt_frame=None, keep=False):
        x = np.asfortranarray(np.asarray(x, dtype=np.float64))
        self.checked += 1
        if keep:
            self.frames.append(x.astype(np.float32))
        if not np.isfinite(x).all() or np.abs(x).max() > 20:
            self.exploded = True
            return False
        if self.prev is not None and dt_frame:
            self.max_speed = max(self.max_speed, np.linalg.norm(x - self.prev, axis=1).max() / dt_frame)
        self.prev = x
        l = np.linalg.norm(x[self.e[:, 0]] - x[self.e[:, 1]], axis=1)
        self.stretch = max(self.stretch, (l / self.l0).max())
        self.depth_ground = max(self.depth_ground, -x[:, 2].min())
        if self.scene == "drape":
            d = np.linalg.norm(x - SPHERE_C, axis=1) - SPHERE_R
            self.depth_sphere = max(self.depth_sphere, -d.min())
        c = self.ipc.NormalCollisions()      # says whether self-contact was reached at all
        c.build(self.mesh, x, 2 * THICKNESS)
        self.near = max(self.near, len(c))
        if len(c) and self.first_near is None:
            self.first_near = step
        if self.ipc.has_intersections(self.mesh, x):
            self.bad += 1
            n, far = self.pairs(x)
            self.worst, self.worst_far = max(self.worst, n), max(self.worst_far, far)
            self.bad_far += far > 0
            if self.first is None:
                self.first = step
        return True


def report(name, version, a, times, chk, threads, **more):
    """One JSON line. cpu_* is CPU time of the process (all its threads): the figure to trust on a shared machine."""
    t, c = np.array(times).T
    r = lambda x: float(f"{x:.4g}")
    out = dict(name=name, version=version, scene=a.scene, vertices=a.n * a.n, dt=a.dt, steps=len(t) + 1,
               wanted_steps=a.steps,
               s_per_step_median=r(np.median(t)), s_per_step_p95=r(np.percentile(t, 95)),
               cpu_per_step_median=r(np.median(c)),
               cpu_per_step_p95=r(np.percentile(c, 95)), s_total=r(t.sum()), threads=threads, frames_checked=chk.checked,
               frames_intersecting=chk.bad, first_bad_step=chk.first, worst_pairs=int(chk.worst), frames_intersecting_far=int(chk.bad_far),
               worst_pairs_far=int(chk.worst_far), self_pairs_max=int(chk.near), first_self_pair_step=chk.first_near,
               max_stretch=round(chk.stretch, 3), depth_ground_mm=round(1e3 * chk.depth_ground, 3),
               depth_sphere_mm=round(1e3 * chk.depth_sphere, 3), max_speed=round(chk.max_speed, 2),
               exploded=chk.exploded, load=[round(l, 2) for l in os.getloadavg()], **more)
    if a.save:
        np.savez_compressed(a.save, frames=np.array(chk.frames), faces=chk.f)
    print(json.dumps(out), flush=True)


def drive(a, chk, step, positions):
    """Run step() a.steps times, timing each (wall, process CPU); check every a.check steps.
    The first step counts in the simulation but not in the times (compilation)."""
    times, c_start = [], time.process_time()
    chk(0, positions(), keep=bool(a.save))
    for k in range(1, a.steps + 1):
        t0, c0 = time.perf_counter(), time.process_time()
        step()
        times.append((time.perf_counter() - t0, time.process_time() - c0))
        if k % a.check == 0 and not chk(k, positions(), a.check * a.dt, keep=bool(a.save)):
            break
        if time.process_time() - c_start > a.budget:
            break
    return times[1:] if len(times) > 1 else times
