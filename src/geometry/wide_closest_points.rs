//! Closest points of several pairs side by side: the same bits as one by one.
//!
//! Branches are taken on all sides and what counts is selected; `if_positive` of a difference is a comparison without
//! rounding.

use crate::math::simd::Lanes;
use crate::math::simd::points::{Point, add_scaled, cross, dot, if_positive, sub};

/// Closest points of pairs as stencils: `separation = sum weights_k x_k`, from the second primitive to the first.
#[derive(Clone, Copy, Debug)]
pub struct WideClosestPoints<const L: usize> {
    /// Signed weights of the four vertices.
    pub weights: [Lanes<L>; 4],
    /// From the closest point of the second primitive to that of the first `[m]`.
    pub separation: Point<L>,
    /// Squared distance `[m^2]`.
    pub distance_squared: Lanes<L>,
    /// Whether a pair has a size at which no product leaves the range of doubles: others are left to
    /// [`super::edge_edge`] and [`super::point_triangle`].
    pub in_range: [bool; L],
}

/// A sum of 18 absolute differences within these is a query that is not scaled.
const SUMS: (f64, f64) = (1.2e-59, 1.6e60);

/// Vectors whose sizes say whether a query is scaled.
fn in_range<const L: usize>(vectors: &[Point<L>; 6]) -> [bool; L] {
    let mut sum = Lanes::splat(0.0);
    for v in vectors {
        sum = sum + v[0].abs() + v[1].abs() + v[2].abs();
    }
    sum.0.map(|s| s > SUMS.0 && s < SUMS.1)
}

/// `s` within `[0, 1]`, also its zero with its sign.
#[inline(always)]
fn clamped<const L: usize>(s: Lanes<L>) -> Lanes<L> {
    let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
    let s = (zero - s).if_positive(zero, s);
    (s - one).if_positive(one, s)
}

/// `-a`
#[inline(always)]
fn negate<const L: usize>(a: &Point<L>) -> Point<L> {
    [a[0].negate(), a[1].negate(), a[2].negate()]
}

/// As `point_edge::closest_to_origin`.
#[inline(always)]
fn closest_to_origin<const L: usize>(a: &Point<L>, b: &Point<L>, d: &Point<L>) -> (Lanes<L>, Point<L>) {
    let length_squared = dot(d, d);
    let t = length_squared.if_positive(clamped(dot(a, d).negate() / length_squared), Lanes::splat(0.0));
    let beyond = t - Lanes::splat(0.5);
    let from = if_positive(beyond, b, a);
    let closest = add_scaled(&from, beyond.if_positive(t - Lanes::splat(1.0), t), d);
    (t, negate(&closest))
}

/// The closest so far of pairs of points.
#[derive(Clone, Copy)]
struct Best<const L: usize> {
    distance_squared: Lanes<L>,
    s: Lanes<L>,
    t: Lanes<L>,
    separation: Point<L>,
}

impl<const L: usize> Best<L> {
    #[inline(always)]
    fn new() -> Best<L> {
        let zero = Lanes::splat(0.0);
        Best { distance_squared: Lanes::splat(f64::INFINITY), s: zero, t: zero, separation: [zero; 3] }
    }

    /// Takes what is closer.
    #[inline(always)]
    fn offer(&mut self, distance_squared: Lanes<L>, s: Lanes<L>, t: Lanes<L>, separation: &Point<L>) {
        let closer = self.distance_squared - distance_squared;
        self.distance_squared = closer.if_positive(distance_squared, self.distance_squared);
        self.s = closer.if_positive(s, self.s);
        self.t = closer.if_positive(t, self.t);
        self.separation = if_positive(closer, separation, &self.separation);
    }
}

/// Closest points of the edges `x0 x1` and `x2 x3`, as [`super::edge_edge::closest_points`].
#[inline(always)]
pub fn edge_edge<const L: usize>(x: &[Point<L>; 4]) -> WideClosestPoints<L> {
    let [ea0, ea1, eb0, eb1] = x;
    let between = [[sub(eb0, ea0), sub(eb1, ea0)], [sub(eb0, ea1), sub(eb1, ea1)]];
    let (a, b) = (sub(ea1, ea0), sub(eb1, eb0));
    let in_range = in_range(&[between[0][0], between[0][1], between[1][0], between[1][1], a, b]);
    let mut best = Best::new();
    let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
    for (ends, s) in between.iter().zip([zero, one]) {
        let (t, separation) = closest_to_origin(&ends[0], &ends[1], &b);
        best.offer(dot(&separation, &separation), s, t, &separation);
    }
    let back = negate(&a);
    for (j, t) in [zero, one].into_iter().enumerate() {
        let (s, separation) = closest_to_origin(&between[0][j], &between[1][j], &back);
        best.offer(dot(&separation, &separation), s, t, &separation);
    }
    inside(&between, &a, &b, &mut best);
    let Best { s, t, separation, .. } = best;
    WideClosestPoints {
        weights: [one - s, s, t - one, t.negate()],
        separation,
        distance_squared: dot(&separation, &separation),
        in_range,
    }
}

/// Offers what is closest inside both edges, refined as one by one.
#[inline(always)]
fn inside<const L: usize>(between: &[[Point<L>; 2]; 2], a: &Point<L>, b: &Point<L>, best: &mut Best<L>) {
    let (zero, half, one) = (Lanes::splat(0.0), Lanes::splat(0.5), Lanes::splat(1.0));
    let n = cross(a, b);
    let n_squared = dot(&n, &n);
    let to_s = cross(b, &n);
    let b_squared = dot(b, b);
    let sine_squared = n_squared / (dot(a, a) * b_squared);
    let (mut s, mut t, mut r) = (zero, zero, between[0][0]);
    for enough in [None, Some(0.25), Some(1e-12)] {
        // Greater than zero where the rounds before were enough.
        let done = enough.map(|enough| sine_squared - Lanes::splat(enough));
        if done.is_some_and(|done| done.0.iter().all(|d| *d > 0.0)) {
            break;
        }
        let next_s = s + dot(&r, &to_s) / n_squared;
        let beyond = next_s - half;
        let first = if_positive(beyond, &between[1][0], &between[0][0]);
        let second = if_positive(beyond, &between[1][1], &between[0][1]);
        let ds = beyond.if_positive(next_s - one, next_s);
        let next_t = dot(&add_scaled(&negate(&first), ds, a), b) / b_squared;
        let beyond = next_t - half;
        let from = if_positive(beyond, &second, &first);
        let along_b = add_scaled(&from, beyond.if_positive(next_t - one, next_t), b);
        let next_r = add_scaled(&along_b, ds.negate(), a);
        match done {
            Some(done) => {
                (s, t, r) = (done.if_positive(s, next_s), done.if_positive(t, next_t), if_positive(done, &r, &next_r));
            }
            None => (s, t, r) = (next_s, next_t, next_r),
        }
    }
    let none = Lanes::splat(f64::INFINITY);
    let mut distance_squared = dot(&r, &r);
    for inner in [s, one - s, t, one - t, n_squared] {
        distance_squared = inner.if_positive(distance_squared, none);
    }
    best.offer(distance_squared, s, t, &negate(&r));
}

/// Closest points of the vertices `x0` and the triangles `x1 x2 x3`, as [`super::point_triangle::closest_points`].
#[inline(always)]
pub fn point_triangle<const L: usize>(x: &[Point<L>; 4]) -> WideClosestPoints<L> {
    let [p, t @ ..] = x;
    let corners = [sub(&t[0], p), sub(&t[1], p), sub(&t[2], p)];
    let edges = [sub(&t[1], &t[0]), sub(&t[2], &t[1]), sub(&t[0], &t[2])];
    let in_range = in_range(&[corners[0], corners[1], corners[2], edges[0], edges[1], edges[2]]);
    let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
    let mut bound = Lanes::splat(f64::INFINITY);
    let (mut weights, mut separation) = ([zero; 3], [zero; 3]);
    for k in 0..3 {
        let (s, from_edge) = closest_to_origin(&corners[k], &corners[(k + 1) % 3], &edges[k]);
        let distance_squared = dot(&from_edge, &from_edge);
        let mut own = [zero; 3];
        (own[k], own[(k + 1) % 3]) = (one - s, s);
        let closer = bound - distance_squared;
        bound = closer.if_positive(distance_squared, bound);
        weights = if_positive(closer, &own, &weights);
        separation = if_positive(closer, &from_edge, &separation);
    }
    let (inner, across, distance_squared) = interior(&corners, &edges);
    let closer = bound - distance_squared;
    weights = if_positive(closer, &inner, &weights);
    separation = if_positive(closer, &across, &separation);
    WideClosestPoints {
        weights: [one, weights[0].negate(), weights[1].negate(), weights[2].negate()],
        separation,
        distance_squared: dot(&separation, &separation),
        in_range,
    }
}

/// Weights and separation where vertices project into triangles, and the squared distance, infinite where they do not.
#[inline(always)]
fn interior<const L: usize>(corners: &[Point<L>; 3], edges: &[Point<L>; 3]) -> (Point<L>, Point<L>, Lanes<L>) {
    let (one, none) = (Lanes::splat(1.0), Lanes::splat(f64::INFINITY));
    let lengths = [0, 1, 2].map(|k| dot(&edges[k], &edges[k]));
    // Greater than zero where the longest edge is not the first, and where it is the last of the others.
    let not_first = (lengths[1] - lengths[0]).max(lengths[2] - lengths[0]);
    let last = lengths[2] - lengths[1];
    let chosen = |of: [&Point<L>; 3]| if_positive(not_first, &if_positive(last, of[2], of[1]), of[0]);
    let base = chosen([&edges[0], &edges[1], &edges[2]]);
    let length_squared = not_first.if_positive(last.if_positive(lengths[2], lengths[1]), lengths[0]);
    let a = chosen([&corners[0], &corners[1], &corners[2]]);
    let to_apex = negate(&chosen([&edges[2], &edges[0], &edges[1]]));
    let apex = dot(&to_apex, &base) / length_squared;
    let height = add_scaled(&to_apex, apex.negate(), &base);
    let height_squared = dot(&height, &height);
    let along = dot(&a, &base).negate() / length_squared;
    let rest = add_scaled(&negate(&a), along.negate(), &base);
    let w2 = dot(&rest, &height) / height_squared;
    let w1 = along - w2 * apex;
    let w0 = one - w1 - w2;
    let across = negate(&add_scaled(&add_scaled(&a, w1, &base), w2, &to_apex));
    let mut distance_squared = dot(&across, &across);
    for positive in [w0, w1, w2, length_squared, height_squared] {
        distance_squared = positive.if_positive(distance_squared, none);
    }
    let weights = if_positive(not_first, &if_positive(last, &[w1, w2, w0], &[w2, w0, w1]), &[w0, w1, w2]);
    (weights, across, distance_squared)
}

#[cfg(test)]
mod tests {
    use super::super::{edge_edge as one_edge_edge, point_triangle as one_point_triangle};
    use super::*;
    use crate::math::Vec3;
    use crate::math::random::Random;
    use crate::math::simd::points::gather;

    /// Points that lie on few coordinates, so that primitives are often parallel, flat, without length or touching; moved
    /// and scaled.
    fn queries() -> Vec<[Vec3; 4]> {
        let mut random = Random(17);
        let mut pick = |n: u64| random.below(n);
        (0..40_000)
            .map(|i| {
                let values = [2, 3, 5, 1000][i % 4];
                let size = [1.0, 1e-3, 1e-70, 1e90, 1e-160][(pick(12) as usize).saturating_sub(7)];
                let nudge = [0.0, 0.0, 1e-9, 1e-4][pick(4) as usize];
                let mut coordinate = || {
                    let fine = pick(1 << 20) as f64 / f64::from(1 << 20) - 0.5;
                    size * (pick(values) as f64 / values as f64 + nudge * fine)
                };
                std::array::from_fn(|_| std::array::from_fn(|_| coordinate()))
            })
            .collect()
    }

    #[test]
    fn pairs_side_by_side_have_the_bits_of_each_alone() {
        let (mut used, mut inner) = ([0; 2], [0; 2]);
        for four in queries().chunks_exact(4) {
            let x: Vec<Vec3> = four.iter().flatten().copied().collect();
            let v: [[usize; 4]; 4] = std::array::from_fn(|l| std::array::from_fn(|k| 4 * l + k));
            let points = gather(&x, &v);
            let wide = [edge_edge(&points), point_triangle(&points)];
            for (l, [a, b, c, d]) in four.iter().enumerate() {
                let e = one_edge_edge::closest_points(*a, *b, *c, *d);
                let f = one_point_triangle::closest_points(*a, *b, *c, *d);
                let [f0, f1, f2] = f.barycentrics;
                let expected = [
                    ([1.0 - e.s, e.s, e.t - 1.0, -e.t], e.separation, e.distance_squared),
                    ([1.0, -f0, -f1, -f2], f.separation, f.distance_squared),
                ];
                for (kind, (weights, separation, square)) in expected.into_iter().enumerate() {
                    let found = &wide[kind];
                    if !found.in_range[l] {
                        continue;
                    }
                    let bits = |numbers: &[f64]| -> Vec<u64> { numbers.iter().map(|n| n.to_bits()).collect() };
                    let name = || format!("{kind} {four:?} {l}");
                    assert_eq!(bits(&found.weights.map(|w| w.0[l])), bits(&weights), "{}", name());
                    assert_eq!(bits(&found.separation.map(|c| c.0[l])), bits(&separation), "{}", name());
                    assert_eq!(found.distance_squared.0[l].to_bits(), square.to_bits(), "{}", name());
                    used[kind] += 1;
                    inner[kind] += usize::from(weights.iter().all(|w| *w != 0.0));
                }
            }
        }
        assert!(used.iter().all(|n| *n > 25_000 && *n < 39_000), "{used:?}");
        assert!(inner.iter().all(|n| *n > 2_000), "{inner:?}");
    }
}
