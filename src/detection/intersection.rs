//! The certificate: which edges and faces of a state share a point, decided exactly.
//!
//! Primitives are closed: touching (distance zero) counts as intersecting. Pairs that share a vertex meet there by
//! construction and are not tested; where a fold makes two neighbouring faces cross, an edge of the one that shares
//! no vertex pierces the other, and is found. What is not seen: a vertex that touches a face exactly without any edge
//! of its own that keeps clear of the face's vertices (an isolated point, or two faces folded flat onto each other
//! about their common edge), and wires that touch wires. A state does not tell whether these have passed through
//! something; continuous detection does.

use super::primitives::{Filter, Primitives};
use super::screening::{COARSE_ERROR, Coarse};
use super::{BroadPhase, Motion, Stars, brute_force};
use crate::geometry::{edge_edge, point_triangle};
use crate::math::predicates::{plane_side, segment_meets_triangle};
use crate::math::simd::points::{self, Point, gather, gather_quads, largest};
use crate::math::simd::{Kernel, Lanes, Number, run_wide};
use crate::math::{Vec3, add_scaled, cross, dot, lerp, sub};
use crate::parallel::Par;

/// Pairs side by side in double precision.
const WIDTH: usize = 4;

/// Pairs side by side in single precision.
const COARSE_WIDTH: usize = 8;

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
    find_with((&mut BroadPhase::build(primitives), &Stars::build(primitives)), primitives, x, filter, par)
}

/// [`find`] with a tree and stars that were built from the same primitives; the tree is refitted to `x`.
pub fn find_with(
    (broad_phase, stars): (&mut BroadPhase, &Stars),
    primitives: &Primitives,
    x: &[Vec3],
    filter: &Filter,
    par: Par,
) -> Vec<Intersection> {
    let mut coarse = Coarse::default();
    coarse.assign(x, None, &[], par);
    let x0 = &coarse.x0;
    let apart = |pairs: &mut [[u32; 2]]| run_wide(RuleOutFaces { primitives, coarse: x0, pairs });
    let rule_out = |pairs: &mut [[u32; 2]]| run_wide(RuleOut { primitives, x, coarse: x0, pairs });
    let clear = stars.clear(x0, par);
    let open = broad_phase.edge_face_candidates(x, &clear, filter, [&apart, &rule_out], par);
    par.filter_indexed(open.len(), |i| decide(primitives, open[i], x))
}

/// [`find`] over all pairs, each decided exactly without a filter: its oracle. Cost: quadratic.
pub fn find_brute_force(primitives: &Primitives, x: &[Vec3], filter: &Filter) -> Vec<Intersection> {
    let motion = Motion { x0: x, x1: x, radius: &[] };
    let candidates = brute_force::edge_face_candidates(primitives, &motion, filter);
    candidates.edge_face.iter().filter_map(|pair| decide(primitives, *pair, x)).collect()
}

/// Moves the edge-face pairs that may share a point to the front of a list; how many they are. Single precision rules out
/// most of the others, double precision what is too close for it.
struct RuleOut<'a> {
    primitives: &'a Primitives<'a>,
    x: &'a [Vec3],
    /// Moved and scaled to the unit cube, see [`Coarse`].
    coarse: &'a [[f32; 4]],
    pairs: &'a mut [[u32; 2]],
}

impl Kernel for RuleOut<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let (x, coarse) = (self.x, self.coarse);
        let corners = |pair| vertices(self.primitives, pair);
        let coarsely = |v: &[[usize; 5]; COARSE_WIDTH]| margin(&gather_quads(coarse, v).0, &SINGLE).0;
        let open = compact(self.pairs, corners, coarsely);
        compact(&mut self.pairs[..open], corners, |v: &[[usize; 5]; WIDTH]| margin(&gather(x, v), &DOUBLE).0)
    }
}

/// The same for pairs of faces, in single precision alone.
struct RuleOutFaces<'a> {
    primitives: &'a Primitives<'a>,
    coarse: &'a [[f32; 4]],
    pairs: &'a mut [[u32; 2]],
}

impl Kernel for RuleOutFaces<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        let faces = self.primitives.faces;
        let corners = |[first, second]: [u32; 2]| {
            let ([a, b, c], [p, q, r]) = (faces[first as usize], faces[second as usize]);
            [a, b, c, p, q, r].map(|v| v as usize)
        };
        let margin = |v: &[[usize; 6]; COARSE_WIDTH]| {
            let [a, b, c, p, q, r] = gather_quads(self.coarse, v).0;
            face_margin(&[p, q, r], &[a, b, c], &SINGLE).0
        };
        let open = compact(self.pairs, corners, margin);
        // The directions of the other face, where those of the one did not do.
        compact(&mut self.pairs[..open], |[a, b]| corners([b, a]), margin)
    }
}

/// Moves the pairs whose margin is not greater than zero, `L` side by side, to the front; how many they are.
#[inline(always)]
fn compact<const L: usize, const K: usize, T: Number>(
    pairs: &mut [[u32; 2]],
    corners: impl Fn([u32; 2]) -> [usize; K],
    margin: impl Fn(&[[usize; K]; L]) -> [T; L],
) -> usize {
    let (mut start, mut filled) = (0, 0);
    while start < pairs.len() {
        let width = L.min(pairs.len() - start);
        // Lanes beyond the last pair repeat it.
        let mut group = [pairs[start]; L];
        let mut v = [[0; K]; L];
        for l in 0..L {
            group[l] = pairs[start + l.min(width - 1)];
            v[l] = corners(group[l]);
        }
        let margin = margin(&v);
        for l in 0..width {
            // What is not a number stays open.
            let apart = margin[l] > T::ZERO;
            pairs[filled] = group[l];
            filled += 1 - usize::from(apart);
        }
        start += width;
    }
    filled
}

/// `p q a b c` of an edge and a face.
#[inline(always)]
fn vertices(primitives: &Primitives, [edge, face]: [u32; 2]) -> [usize; 5] {
    let ([p, q], [a, b, c]) = (primitives.edges[edge as usize], primitives.faces[face as usize]);
    [p as usize, q as usize, a as usize, b as usize, c as usize]
}

/// The exact decision on one pair.
#[inline(never)]
fn decide(primitives: &Primitives, pair: [u32; 2], x: &[Vec3]) -> Option<Intersection> {
    let [p, q, a, b, c] = vertices(primitives, pair).map(|v| x[v]);
    let [edge, face] = pair;
    segment_meets_triangle(p, q, a, b, c).then(|| Intersection { edge, face, point: common_point(p, q, a, b, c) })
}

/// How far a computed `n·x` may be off, for two that are compared: by `(absolute + relative M) |n|_1`, M the extent.
pub(super) struct Rounding<T> {
    pub absolute: T,
    pub relative: T,
    /// Sizes of `|n|_1 M` whose products stay clear of the ends of the number format; others decide nothing.
    pub sizes: [T; 2],
}

/// Positions are the doubles given: each `n·x` is off by less than `5 u |n|_1 M` with u the unit roundoff.
const DOUBLE: Rounding<f64> = Rounding { absolute: 0.0, relative: 8.0 * f64::EPSILON, sizes: [1e-250, 1e250] };

/// Positions are within the unit cube, each coordinate off by u at most, differences of them by 2 u and one rounding
/// more: each `n·x` by less than `(2 u + 6 u M) |n|_1`.
pub(super) const SINGLE: Rounding<f32> =
    Rounding { absolute: COARSE_ERROR, relative: 8.0 * f32::EPSILON, sizes: [1e-30, 1e30] };

/// Greater than zero where a direction certainly separates the segment `p q` from the triangle `a b c`: those of
/// [`face_margin`], and the normal of the segment in the triangle's plane.
#[inline(always)]
fn margin<const L: usize, T: Number>([p, q, a, b, c]: &[Point<L, T>; 5], rounding: &Rounding<T>) -> Lanes<L, T> {
    let pair = Differences::new(&[*p, *q], &[*a, *b, *c], rounding);
    let across = points::cross(&pair.normal(), &points::sub(q, p));
    pair.face_margin().max(pair.separation(&across))
}

/// Greater than zero where a direction certainly separates some points from the triangle `a b c`: the normal of its plane,
/// and in that plane those of its edges.
#[inline(always)]
fn face_margin<const L: usize, const M: usize, T: Number>(
    others: &[Point<L, T>; M],
    face: &[Point<L, T>; 3],
    rounding: &Rounding<T>,
) -> Lanes<L, T> {
    Differences::new(others, face, rounding).face_margin()
}

/// Some points and a triangle, relative to its first corner.
struct Differences<const L: usize, const M: usize, T> {
    others: [Point<L, T>; M],
    b: Point<L, T>,
    c: Point<L, T>,
    extent: Lanes<L, T>,
    /// That of a [`Rounding`] for each unit of `|n|_1`.
    error: Lanes<L, T>,
    sizes: [T; 2],
}

impl<const L: usize, const M: usize, T: Number> Differences<L, M, T> {
    #[inline(always)]
    fn new(others: &[Point<L, T>; M], [a, b, c]: &[Point<L, T>; 3], rounding: &Rounding<T>) -> Self {
        let (b, c) = (points::sub(b, a), points::sub(c, a));
        let mut extent = largest(&b).max(largest(&c));
        let mut from_a = *others;
        for point in &mut from_a {
            *point = points::sub(point, a);
            extent = extent.max(largest(point));
        }
        let error = Lanes::splat(rounding.absolute) + Lanes::splat(rounding.relative) * extent;
        Differences { others: from_a, b, c, extent, error, sizes: rounding.sizes }
    }

    #[inline(always)]
    fn normal(&self) -> Point<L, T> {
        points::cross(&self.b, &self.c)
    }

    #[inline(always)]
    fn face_margin(&self) -> Lanes<L, T> {
        let normal = self.normal();
        let mut best = self.separation(&normal);
        for along in [self.b, self.c, points::sub(&self.c, &self.b)] {
            best = best.max(self.separation(&points::cross(&normal, &along)));
        }
        best
    }

    /// Greater than zero where the direction n, whatever it is, certainly has the points on one side of the triangle's
    /// corners.
    #[inline(always)]
    fn separation(&self, n: &Point<L, T>) -> Lanes<L, T> {
        let (zero, length) = (Lanes::splat(T::ZERO), n[0].abs() + n[1].abs() + n[2].abs());
        let (nb, nc) = (points::dot(n, &self.b), points::dot(n, &self.c));
        let mut lowest = points::dot(n, &self.others[0]);
        let mut highest = lowest;
        for point in &self.others[1..] {
            let along = points::dot(n, point);
            (lowest, highest) = (lowest.min(along), highest.max(along));
        }
        let above = lowest - zero.max(nb).max(nc);
        let below = zero.min(nb).min(nc) - highest;
        let (size, [smallest, greatest]) = (length * self.extent, self.sizes);
        let in_range = (size - Lanes::splat(smallest)).min(Lanes::splat(greatest) - size);
        // NaN last: the smaller of two is the second where one is not a number.
        in_range.min(above.max(below) - length * self.error)
    }
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
