//! The coplanarity cubic of a pair in Bernstein form with a rounding bound, for several pairs side by side.
//!
//! With e, f the vectors that span the plane and g the one that must lie in it, all linear in time,
//! `c(t) = (e x f)·g` is a cubic. Its four Bernstein coefficients bound it on the step: when all have one sign beyond
//! the rounding error, the four points are never coplanar and there is no contact.

use super::exact::Shape;
use crate::math::simd::Lanes;
pub(super) use crate::math::simd::points::{Point, cross};
use crate::math::simd::points::{add, dot, largest as largest_at, sub};

/// Rounding error of a Bernstein coefficient, and of the cubic evaluated from them anywhere in [0, 1], relative to the
/// product of the largest components of e, f and g.
///
/// Each coefficient is a mean of six monomials `e_i f_j g_k`. A monomial carries three rounded differences, two
/// products, and at most six sums and the division by three: 12 u. Evaluation by three convex combinations adds
/// `3 x 3 u` of the largest coefficient, at most six monomials: `6 (12 + 9) u = 126 u`. The rest is for the rounding of
/// the bound itself and of what is subtracted from the coefficients.
pub(super) const CUBIC_ERROR: f64 = 144.0 * super::motion::UNIT_ROUNDOFF;

#[inline(always)]
fn largest<const L: usize>([a, b]: &[Point<L>; 2]) -> Lanes<L> {
    largest_at(a).max(largest_at(b))
}

/// From point j to point i at both ends.
#[inline(always)]
fn between<const L: usize>(x0: &[Point<L>; 4], x1: &[Point<L>; 4], i: usize, j: usize) -> [Point<L>; 2] {
    [sub(&x0[i], &x0[j]), sub(&x1[i], &x1[j])]
}

/// The smallest of four.
#[inline(always)]
fn least<const L: usize>(b: &[Lanes<L>; 4]) -> Lanes<L> {
    b[0].min(b[1]).min(b[2].min(b[3]))
}

/// A pair's spanning vectors e, f and the vector g at both ends of the step.
pub(super) struct Frame<const L: usize> {
    pub e: [Point<L>; 2],
    pub f: [Point<L>; 2],
    pub g: [Point<L>; 2],
}

impl<const L: usize> Frame<L> {
    /// From the four points at both ends.
    #[inline(always)]
    pub fn new(shape: Shape, x0: &[Point<L>; 4], x1: &[Point<L>; 4]) -> Self {
        match shape {
            Shape::VertexFace => Frame { e: between(x0, x1, 2, 1), f: between(x0, x1, 3, 1), g: between(x0, x1, 0, 1) },
            Shape::EdgeEdge => Frame { e: between(x0, x1, 1, 0), f: between(x0, x1, 3, 2), g: between(x0, x1, 2, 0) },
        }
    }

    /// Largest absolute components of e, f, g over both ends.
    #[inline(always)]
    pub fn sizes(&self) -> [Lanes<L>; 3] {
        [largest(&self.e), largest(&self.f), largest(&self.g)]
    }

    /// The normals `e x f` in Bernstein form: the values at both ends and twice the middle control vector.
    #[inline(always)]
    pub fn normals(&self) -> [Point<L>; 3] {
        let (e, f) = (&self.e, &self.f);
        [cross(&e[0], &f[0]), add(&cross(&e[0], &f[1]), &cross(&e[1], &f[0])), cross(&e[1], &f[1])]
    }

    /// Three times the Bernstein coefficients of the cubic.
    #[inline(always)]
    pub fn cubic_times_three(&self, n: &[Point<L>; 3]) -> [Lanes<L>; 4] {
        let (g0, g1) = (&self.g[0], &self.g[1]);
        let three = Lanes::splat(3.0);
        [
            three * dot(&n[0], g0),
            dot(&n[1], g0) + dot(&n[0], g1),
            dot(&n[2], g0) + dot(&n[1], g1),
            three * dot(&n[2], g1),
        ]
    }
}

/// Greater than zero where one of the three axes keeps the pair apart by more than `separation` on `[0, t_max]`.
///
/// Exact for zero separation and the whole step: a difference of doubles has the sign of the exact one, and coordinates
/// linear in time that are ordered at both ends are ordered in between.
#[inline(always)]
pub(super) fn axis_gap<const L: usize>(
    shape: Shape,
    x0: &[Point<L>; 4],
    x1: &[Point<L>; 4],
    separation: Lanes<L>,
    t_max: f64,
) -> Lanes<L> {
    let mut best = Lanes::splat(f64::NEG_INFINITY);
    for c in 0..3 {
        let (above0, below0) = axis_gaps_at(shape, x0, c);
        let (above1, below1) = axis_gaps_at(shape, x1, c);
        best = best.max(least_gap(above0, above1, t_max)).max(least_gap(below0, below1, t_max));
    }
    best - separation * Lanes::splat(1.0 + 4.0 * f64::EPSILON)
}

/// How far the first primitive lies above the second along an axis at one end of the step, and how far below.
#[inline(always)]
fn axis_gaps_at<const L: usize>(shape: Shape, x: &[Point<L>; 4], c: usize) -> (Lanes<L>, Lanes<L>) {
    let (low_a, high_a, low_b, high_b) = match shape {
        Shape::VertexFace => (x[0][c], x[0][c], x[1][c].min(x[2][c]).min(x[3][c]), x[1][c].max(x[2][c]).max(x[3][c])),
        Shape::EdgeEdge => (x[0][c].min(x[1][c]), x[0][c].max(x[1][c]), x[2][c].min(x[3][c]), x[2][c].max(x[3][c])),
    };
    (low_a - high_b, low_b - high_a)
}

/// The least gap on `[0, t_max]`: gaps are minima of functions linear in time, so they are concave and least at an end,
/// and at `t_max` at least what interpolation gives.
#[inline(always)]
fn least_gap<const L: usize>(gap0: Lanes<L>, gap1: Lanes<L>, t_max: f64) -> Lanes<L> {
    if t_max == 1.0 {
        return gap0.min(gap1);
    }
    let (s, t) = (Lanes::splat(1.0 - t_max), Lanes::splat(t_max));
    let rounding = (gap0.abs() + gap1.abs()) * Lanes::splat(8.0 * super::motion::UNIT_ROUNDOFF);
    gap0.min(s * gap0 + t * gap1 - rounding)
}

/// Greater than zero where the four points are certainly not coplanar on `[0, t_max]`: the cubic's coefficients exceed
/// the rounding error and have one sign.
#[inline(always)]
pub(super) fn plane_gap<const L: usize>(frame: &Frame<L>, t_max: f64) -> Lanes<L> {
    let mut above = frame.cubic_times_three(&frame.normals());
    let [me, mf, mg] = frame.sizes();
    if t_max < 1.0 {
        above = up_to(&above, t_max);
    }
    let below = [above[0].negate(), above[1].negate(), above[2].negate(), above[3].negate()];
    let product = me * mf * mg;
    let gap = least(&above).max(least(&below)) - Lanes::splat(3.0 * CUBIC_ERROR) * product;
    // Sizes whose products leave the range of doubles decide nothing.
    let in_range = (product - Lanes::splat(1e-250)).min(Lanes::splat(1e250) - product);
    gap.min(in_range)
}

/// Bernstein coefficients on `[0, t]` from those on [0, 1].
#[inline(always)]
fn up_to<const L: usize>(b: &[Lanes<L>; 4], t: f64) -> [Lanes<L>; 4] {
    let lerp = |a: Lanes<L>, b: Lanes<L>| Lanes::splat(1.0 - t) * a + Lanes::splat(t) * b;
    let (p, q, r) = (lerp(b[0], b[1]), lerp(b[1], b[2]), lerp(b[2], b[3]));
    let (v, w) = (lerp(p, q), lerp(q, r));
    [b[0], p, v, lerp(v, w)]
}
