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
use crate::math::simd::points::{self, Point, gather, largest};
use crate::math::simd::{Kernel, Lanes, run_wide};
use crate::math::{Vec3, add_scaled, cross, dot, lerp, sub};
use crate::parallel::Par;

/// Pairs per task.
const TASK: usize = 4096;

/// Pairs side by side.
const WIDTH: usize = 4;

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

/// [`find`] over all pairs, each decided exactly without a filter: its oracle. Cost: quadratic.
pub fn find_brute_force(primitives: &Primitives, x: &[Vec3], filter: &Filter) -> Vec<Intersection> {
    let motion = Motion { x0: x, x1: x, radius: &[] };
    let candidates = brute_force::edge_face_candidates(primitives, &motion, filter);
    let decide = |pair: &[u32; 2]| intersection(*pair, &vertices(primitives, *pair).map(|v| x[v]));
    candidates.edge_face.iter().filter_map(decide).collect()
}

/// Those of the edge-face pairs that share a point at `x`, in their order. Exact; cost: linear.
pub fn among(primitives: &Primitives, pairs: &[[u32; 2]], x: &[Vec3], par: Par) -> Vec<Intersection> {
    let mut tasks: Vec<(&[[u32; 2]], Vec<Intersection>)> = pairs.chunks(TASK).map(|p| (p, Vec::new())).collect();
    par.for_each_task(&mut tasks, |(pairs, found)| run_wide(Task { primitives, pairs, x, found }));
    tasks.into_iter().flat_map(|(_, found)| found).collect()
}

/// Some of the edge-face pairs.
struct Task<'a> {
    primitives: &'a Primitives<'a>,
    pairs: &'a [[u32; 2]],
    x: &'a [Vec3],
    found: &'a mut Vec<Intersection>,
}

impl Kernel for Task<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for chunk in self.pairs.chunks(WIDTH) {
            // Lanes beyond the last pair repeat the first one.
            let mut corners = [vertices(self.primitives, chunk[0]); WIDTH];
            for (v, pair) in corners.iter_mut().zip(chunk) {
                *v = vertices(self.primitives, *pair);
            }
            let margin = margin(&gather(self.x, &corners));
            for (l, pair) in chunk.iter().enumerate() {
                let apart = margin.0[l] > 0.0;
                if !apart {
                    self.found.extend(intersection(*pair, &corners[l].map(|v| self.x[v])));
                }
            }
        }
    }
}

/// `p q a b c` of an edge and a face.
#[inline(always)]
fn vertices(primitives: &Primitives, [edge, face]: [u32; 2]) -> [usize; 5] {
    let ([p, q], [a, b, c]) = (primitives.edges[edge as usize], primitives.faces[face as usize]);
    [p, q, a, b, c].map(|v| v as usize)
}

/// The exact decision on one pair.
#[inline(never)]
fn intersection([edge, face]: [u32; 2], [p, q, a, b, c]: &[Vec3; 5]) -> Option<Intersection> {
    let (p, q, a, b, c) = (*p, *q, *a, *b, *c);
    segment_meets_triangle(p, q, a, b, c).then(|| Intersection { edge, face, point: common_point(p, q, a, b, c) })
}

/// Greater than zero where a direction certainly separates the segment `p q` from the triangle `a b c`: the normal of
/// the triangle's plane, and in that plane those of the triangle's edges and of the segment.
#[inline(always)]
fn margin<const L: usize>([p, q, a, b, c]: &[Point<L>; 5]) -> Lanes<L> {
    let all = [points::sub(p, a), points::sub(q, a), points::sub(b, a), points::sub(c, a)];
    let [p, q, b, c] = &all;
    let extent = largest(p).max(largest(q)).max(largest(b).max(largest(c)));
    let normal = points::cross(b, c);
    let mut best = separation(&normal, &all, extent);
    for along in [*b, *c, points::sub(c, b), points::sub(q, p)] {
        best = best.max(separation(&points::cross(&normal, &along), &all, extent));
    }
    best
}

/// Greater than zero where the direction n, whatever it is, certainly has the segment's ends `p q` on one side of the
/// triangle's corners: 0, b and c.
///
/// With u the unit roundoff and M the extent, each `n·x` is off by less than `5 u |n|_1 M`, of which two are compared.
#[inline(always)]
fn separation<const L: usize>(n: &Point<L>, [p, q, b, c]: &[Point<L>; 4], extent: Lanes<L>) -> Lanes<L> {
    let (zero, size) = (Lanes::splat(0.0), (n[0].abs() + n[1].abs() + n[2].abs()) * extent);
    let (np, nq, nb, nc) = (points::dot(n, p), points::dot(n, q), points::dot(n, b), points::dot(n, c));
    let above = np.min(nq) - zero.max(nb).max(nc);
    let below = zero.min(nb).min(nc) - np.max(nq);
    // Sizes whose products leave the range of doubles decide nothing.
    let in_range = (size - Lanes::splat(1e-250)).min(Lanes::splat(1e250) - size);
    (above.max(below) - size * Lanes::splat(8.0 * f64::EPSILON)).min(in_range)
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
