//! The certificate: which edges and faces of a state share a point, decided exactly.
//!
//! Primitives are closed: touching (distance zero) counts as intersecting. Pairs that share a vertex meet there by
//! construction and are not tested; where a fold makes two neighbouring faces cross, an edge of the one that shares
//! no vertex pierces the other, and is found. What is not seen: a vertex that touches a face exactly without any edge
//! of its own that keeps clear of the face's vertices (an isolated point, or two faces folded flat onto each other
//! about their common edge), and wires that touch wires. A state does not tell whether these have passed through
//! something; continuous detection does.

use super::primitives::{Candidates, Filter, Primitives};
use super::{BroadPhase, Motion, brute_force};
use crate::geometry::{edge_edge, point_triangle};
use crate::math::predicates::{plane_side, segment_meets_triangle};
use crate::math::{Vec3, add_scaled, cross, dot, lerp, sub};
use crate::parallel::Par;

/// An edge and a face that share a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection {
    /// Edge number.
    pub edge: u32,
    /// Face number.
    pub face: u32,
    /// A point of the intersection, to rounding `[m]`.
    pub point: Vec3,
}

/// All edge-face pairs that share a point at `x`, sorted by edge and face.
///
/// Exact for all finite positions ([`crate::math::predicates`]); pairs that share a vertex and pairs that the filter
/// does not let pass are left out. Cost: `n log n` plus the pairs whose boxes overlap.
pub fn find(primitives: &Primitives, x: &[Vec3], filter: &Filter, par: Par) -> Vec<Intersection> {
    find_with(&mut BroadPhase::build(primitives), primitives, x, filter, par)
}

/// [`find`] with a tree that was built from the same primitives; it is refitted to `x`.
pub fn find_with(
    broad_phase: &mut BroadPhase,
    primitives: &Primitives,
    x: &[Vec3],
    filter: &Filter,
    par: Par,
) -> Vec<Intersection> {
    broad_phase.refit(x, x, &[], par);
    let mut candidates = Candidates::default();
    broad_phase.edge_face_candidates(filter, &mut candidates, par);
    among(primitives, &candidates.edge_face, x, par)
}

/// [`find`] over all pairs: its oracle. Cost: quadratic.
pub fn find_brute_force(primitives: &Primitives, x: &[Vec3], filter: &Filter) -> Vec<Intersection> {
    let motion = Motion { x0: x, x1: x, radius: &[] };
    let candidates = brute_force::edge_face_candidates(primitives, &motion, filter);
    among(primitives, &candidates.edge_face, x, Par::Serial)
}

fn among(primitives: &Primitives, pairs: &[[u32; 2]], x: &[Vec3], par: Par) -> Vec<Intersection> {
    let test = |i: usize| {
        let [edge, face] = pairs[i];
        let [p, q] = primitives.edges[edge as usize].map(|v| x[v as usize]);
        let [a, b, c] = primitives.faces[face as usize].map(|v| x[v as usize]);
        segment_meets_triangle(p, q, a, b, c).then(|| Intersection { edge, face, point: common_point(p, q, a, b, c) })
    };
    par.map_indexed(pairs.len(), test).into_iter().flatten().collect()
}

/// A point of the segment that is nearest to the triangle they meet in, to rounding.
fn common_point(p: Vec3, q: Vec3, a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    let all = [sub(p, a), sub(q, a), sub(b, a), sub(c, a)];
    // About `a` and of unit size, so that no product overflows or vanishes.
    let extent = all.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    if extent == 0.0 {
        return a;
    }
    let ([p, q, b, c], origin) = (all.map(|d| d.map(|x| x / extent)), [0.0; 3]);
    let normal = cross(b, c);
    let (from, to) = (dot(normal, p), dot(normal, q));
    let t = from / (from - to);
    let mut best = (f64::INFINITY, p);
    let mut offer = |x: Vec3, distance_squared: f64| {
        if distance_squared < best.0 {
            best = (distance_squared, x);
        }
    };
    let crossing = if t.is_finite() { lerp(p, q, t.clamp(0.0, 1.0)) } else { p };
    for x in [crossing, p, q] {
        offer(x, point_triangle::distance_squared(x, origin, b, c));
    }
    for (u, v) in [(origin, b), (b, c), (c, origin)] {
        let found = edge_edge::closest_points(p, q, u, v);
        offer(found.closest_a, found.distance_squared);
    }
    add_scaled(a, extent, best.1)
}

/// The vertices strictly below the half-space `normal · x >= offset`, decided exactly, with their points on the plane.
///
/// Vertices exactly on the plane are free. Sorted as given.
pub fn below_half_space(vertices: &[u32], x: &[Vec3], normal: Vec3, offset: f64) -> Vec<(u32, Vec3)> {
    let below = vertices.iter().filter(|v| plane_side(normal, offset, x[**v as usize]) < 0);
    below
        .map(|v| {
            let at = x[*v as usize];
            (*v, add_scaled(at, offset - dot(normal, at), normal))
        })
        .collect()
}
