//! What a step promised, checked by means of its own: brute force over all pairs, orientation signs in exact
//! arithmetic written here, zero-separation chords, balances from the host's side.

use num_bigint::BigInt;
use signorini::detection::ccd::{edge_edge, point_triangle};
use signorini::geometry;
use signorini::math::{Vec3, add, dot, mat_vec, norm, scale, sub};
use signorini::model::{Kind, Model, Precision, State};

/// Two bodies that may touch, by groups, masks and what can move.
pub fn may_touch(model: &Model, a: usize, b: usize) -> bool {
    let (x, y) = (&model.bodies[a].description, &model.bodies[b].description);
    if a == b {
        return x.self_collision && matches!(x.kind, Kind::Deformable { .. });
    }
    x.groups & y.mask != 0 && y.groups & x.mask != 0 && (moves(&x.kind) || moves(&y.kind))
}

fn moves(kind: &Kind) -> bool {
    match kind {
        Kind::Deformable { pinned, .. } => pinned.iter().any(|p| !p),
        Kind::Rigid { mass, .. } => mass.is_finite(),
        _ => false,
    }
}

/// An exact multiple of a common power of two: every double in the model scaled to an integer.
fn integer(x: f64, exponent: i32) -> BigInt {
    if x == 0.0 {
        return BigInt::from(0);
    }
    let bits = x.to_bits();
    let e = ((bits >> 52) & 0x7ff) as i32;
    let m = (bits & ((1 << 52) - 1)) as i64 + if e == 0 { 0 } else { 1 << 52 };
    let power = e.max(1) - 1075 - exponent;
    let value = BigInt::from(if x < 0.0 { -m } else { m });
    value << power as usize
}

/// Sign of the volume of `a b c d`: floating point where it is certain, integers else.
fn orientation(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i32 {
    let (u, v, w) = (sub(a, d), sub(b, d), sub(c, d));
    let terms = [
        u[0] * v[1] * w[2],
        u[1] * v[2] * w[0],
        u[2] * v[0] * w[1],
        -u[2] * v[1] * w[0],
        -u[0] * v[2] * w[1],
        -u[1] * v[0] * w[2],
    ];
    let (sum, size) = terms.iter().fold((0.0, 0.0), |(s, m), t| (s + t, m + f64::abs(*t)));
    if f64::abs(sum) > 1e-14 * size && size > 1e-250 {
        return if sum > 0.0 { 1 } else { -1 };
    }
    let lowest = [a, b, c, d]
        .iter()
        .flatten()
        .filter(|x| **x != 0.0)
        .map(|x| ((x.to_bits() >> 52 & 0x7ff) as i32).max(1) - 1075)
        .min()
        .unwrap_or(0);
    let exact = |p: Vec3| p.map(|x| integer(x, lowest));
    let [a, b, c, d] = [a, b, c, d].map(exact);
    let minus = |p: &[BigInt; 3], q: &[BigInt; 3]| -> [BigInt; 3] { std::array::from_fn(|i| &p[i] - &q[i]) };
    let (u, v, w) = (minus(&a, &d), minus(&b, &d), minus(&c, &d));
    let det: BigInt = &u[0] * (&v[1] * &w[2] - &v[2] * &w[1])
        + &u[1] * (&v[2] * &w[0] - &v[0] * &w[2])
        + &u[2] * (&v[0] * &w[1] - &v[1] * &w[0]);
    let zero = BigInt::from(0);
    if det > zero {
        1
    } else if det < zero {
        -1
    } else {
        0
    }
}

fn boxes_overlap<const N: usize, const M: usize>(a: &[Vec3; N], b: &[Vec3; M]) -> bool {
    (0..3).all(|k| {
        let range =
            |v: &[Vec3]| v.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        let (p, q) = (range(a), range(b));
        p.0 <= q.1 && q.0 <= p.1
    })
}

/// Whether an edge properly crosses the inside of a face: all five signs strict.
fn pierces(e: &[Vec3; 2], f: &[Vec3; 3]) -> bool {
    if !boxes_overlap(e, f) {
        return false;
    }
    let (s0, s1) = (orientation(f[0], f[1], f[2], e[0]), orientation(f[0], f[1], f[2], e[1]));
    if s0 * s1 >= 0 {
        return false;
    }
    let t = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| orientation(e[0], e[1], f[i], f[j]));
    t.iter().all(|s| *s > 0) || t.iter().all(|s| *s < 0)
}

fn body_of(model: &Model, v: u32) -> usize {
    model.vertex_body[v as usize] as usize
}

/// Edges that strictly pierce faces, by brute force.
pub fn piercings(model: &Model, x: &[Vec3]) -> Vec<[u32; 2]> {
    let mut found = Vec::new();
    for (i, e) in model.edges.iter().enumerate() {
        for (j, f) in model.faces.iter().enumerate() {
            if e.iter().any(|v| f.contains(v)) || !may_touch(model, body_of(model, e[0]), body_of(model, f[0])) {
                continue;
            }
            if pierces(&e.map(|v| x[v as usize]), &f.map(|v| x[v as usize])) {
                found.push([i as u32, j as u32]);
            }
        }
    }
    found
}

/// A mesh pair: its four vertices, and whether it is vertex against face.
pub type Stencil = ([u32; 4], bool);

/// All vertex-face and edge-edge pairs whose boxes, swept and thickened by `reach`, overlap.
pub fn swept_pairs(model: &Model, x0: &[Vec3], x1: &[Vec3], reach: f64) -> Vec<Stencil> {
    let swept = |vertices: &[u32]| {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for v in vertices {
            for p in [x0[*v as usize], x1[*v as usize]] {
                for k in 0..3 {
                    low[k] = low[k].min(p[k] - reach);
                    high[k] = high[k].max(p[k] + reach);
                }
            }
        }
        (low, high)
    };
    let overlap = |a: &(Vec3, Vec3), b: &(Vec3, Vec3)| (0..3).all(|k| a.0[k] <= b.1[k] && b.0[k] <= a.1[k]);
    let faces: Vec<_> = model.faces.iter().map(|f| swept(f)).collect();
    let edges: Vec<_> = model.edges.iter().map(|e| swept(e)).collect();
    let mut pairs = Vec::new();
    for v in &model.contact_vertices {
        let bounds = swept(&[*v]);
        for (f, other) in model.faces.iter().zip(&faces) {
            if overlap(&bounds, other) && !f.contains(v) && may_touch(model, body_of(model, *v), body_of(model, f[0])) {
                pairs.push(([*v, f[0], f[1], f[2]], true));
            }
        }
    }
    for (i, e) in model.edges.iter().enumerate() {
        for (j, g) in model.edges.iter().enumerate().skip(i + 1) {
            let apart = !e.iter().any(|v| g.contains(v));
            if apart && overlap(&edges[i], &edges[j]) && may_touch(model, body_of(model, e[0]), body_of(model, g[0])) {
                pairs.push(([e[0], e[1], g[0], g[1]], false));
            }
        }
    }
    pairs
}

pub fn at(pair: &Stencil, x: &[Vec3]) -> [Vec3; 4] {
    pair.0.map(|v| x[v as usize])
}

pub fn distance(pair: &Stencil, x: &[Vec3]) -> f64 {
    let [a, b, c, d] = at(pair, x);
    if pair.1 {
        geometry::point_triangle::closest_points(a, b, c, d).distance_squared.sqrt()
    } else {
        geometry::edge_edge::closest_points(a, b, c, d).distance_squared.sqrt()
    }
}

/// Whether the pair meets on straight chords.
pub fn meets(pair: &Stencil, x0: &[Vec3], x1: &[Vec3]) -> bool {
    let (a, b) = (at(pair, x0), at(pair, x1));
    let time =
        if pair.1 { point_triangle::time_of_impact(&a, &b, 1.0) } else { edge_edge::time_of_impact(&a, &b, 1.0) };
    time.is_some()
}

/// Pair thickness by the documented rule; `None` when the pair touches at rest.
pub fn thickness(model: &Model, pair: &Stencil) -> Option<f64> {
    let (a, b) = (body_of(model, pair.0[0]), body_of(model, pair.0[3]));
    let full = model.bodies[a].half_thickness + model.bodies[b].half_thickness;
    if a != b {
        return Some(full);
    }
    let rest = distance(pair, &model.rest);
    if rest == 0.0 {
        None
    } else if rest < full {
        Some(0.5 * rest)
    } else {
        Some(full)
    }
}

/// Largest coordinate, for rounding bounds.
pub fn extent(x: &[Vec3]) -> f64 {
    x.iter().flatten().fold(0.0, |m, c| f64::max(m, c.abs()))
}

/// Vertices beyond half-spaces.
pub fn below_planes(model: &Model, state: &State) -> usize {
    let mut count = 0;
    for (plane, body) in model.bodies.iter().enumerate() {
        if !matches!(body.description.kind, Kind::HalfSpace(_)) {
            continue;
        }
        let h = &state.half_spaces[plane];
        for v in &model.contact_vertices {
            let x = state.positions[*v as usize];
            let slack = 1e-13 * (norm(x) + h.offset.abs());
            if may_touch(model, body_of(model, *v), plane) && dot(h.normal, x) - h.offset < -slack {
                count += 1;
            }
        }
    }
    count
}

/// Whether positions of rigid and posed bodies follow from their poses, and single-precision bodies are on the grid.
pub fn consistent(model: &Model, state: &State) -> bool {
    model.bodies.iter().enumerate().all(|(index, body)| {
        let posed = matches!(body.description.kind, Kind::Rigid { .. } | Kind::Kinematic { posed: true });
        let single = body.description.precision == Precision::Single;
        body.vertices.clone().all(|v| {
            let x = state.positions[v];
            let on_grid = !single || x.iter().all(|c| f64::from(*c as f32) == *c);
            let mut expected = state.poses[index].transform(model.rest[v]);
            if single {
                expected = expected.map(|c| f64::from(c as f32));
            }
            on_grid && (!posed || norm(sub(expected, x)) <= 1e-12 * (norm(x) + norm(model.rest[v])))
        })
    })
}

/// Sum of `m (v - v*)` over linear blocks that move, its size, and the sum of impulses over the same blocks.
pub fn momentum(model: &Model, v: &[Vec3], free: &[Vec3], impulses: &[Vec3]) -> (Vec3, f64, Vec3) {
    let (mut gained, mut size, mut given) = ([0.0; 3], 0.0, [0.0; 3]);
    for body in &model.bodies {
        match &body.description.kind {
            Kind::Deformable { masses, pinned } => {
                for (i, b) in body.blocks.clone().enumerate() {
                    if !pinned[i] {
                        let change = scale(masses[i], sub(v[b], free[b]));
                        gained = add(gained, change);
                        size += norm(change);
                        given = add(given, impulses[b]);
                    }
                }
            }
            Kind::Rigid { mass, .. } if mass.is_finite() => {
                let b = body.blocks.start;
                let change = scale(*mass, sub(v[b], free[b]));
                gained = add(gained, change);
                size += norm(change);
                given = add(given, impulses[b]);
            }
            _ => {}
        }
    }
    (gained, size, given)
}

/// Twice the kinetic energy with lumped masses; turning parts with the inertia at the start.
pub fn lumped_energy(model: &Model, start: &State, v: &[Vec3]) -> f64 {
    let mut sum = 0.0;
    for (index, body) in model.bodies.iter().enumerate() {
        match &body.description.kind {
            Kind::Deformable { masses, pinned } => {
                for (i, b) in body.blocks.clone().enumerate() {
                    if !pinned[i] {
                        sum += masses[i] * dot(v[b], v[b]);
                    }
                }
            }
            Kind::Rigid { mass, inertia } if mass.is_finite() => {
                let (l, a) = (v[body.blocks.start], v[body.blocks.start + 1]);
                let rotation = start.poses[index].rotation();
                let local = signorini::math::mat_transpose_vec(&rotation, a);
                sum += mass * dot(l, l) + dot(local, mat_vec(inertia, local));
            }
            _ => {}
        }
    }
    sum
}
