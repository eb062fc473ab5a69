//! The coplanarity cubic of a pair in Bernstein form with a rounding bound, for several pairs side by side.
//!
//! With e, f the vectors that span the plane and g the one that must lie in it, all linear in time,
//! `c(t) = (e x f)·g` is a cubic. Its four Bernstein coefficients bound it on the step: when all have one sign beyond
//! the rounding error, the four points are never coplanar and there is no contact.

use super::exact::Shape;
use crate::math::simd::Lanes;

/// Rounding error of a Bernstein coefficient, and of the cubic evaluated from them anywhere in [0, 1], relative to the
/// product of the largest components of e, f and g.
///
/// Each coefficient is a mean of six monomials `e_i f_j g_k`. A monomial carries three rounded differences, two
/// products, and at most six sums and the division by three: 12 u. Evaluation by three convex combinations adds
/// `3 x 3 u` of the largest coefficient, at most six monomials. `6 (12 + 9) u = 126 u`.
pub(super) const CUBIC_ERROR: f64 = 128.0 * super::motion::UNIT_ROUNDOFF;

/// Three coordinates, each for several pairs.
pub(super) type Point<const L: usize> = [Lanes<L>; 3];

#[inline(always)]
fn sub<const L: usize>(a: &Point<L>, b: &Point<L>) -> Point<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn add<const L: usize>(a: &Point<L>, b: &Point<L>) -> Point<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn dot<const L: usize>(a: &Point<L>, b: &Point<L>) -> Lanes<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<const L: usize>(a: &Point<L>, b: &Point<L>) -> Point<L> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn largest<const L: usize>(a: &Point<L>, b: &Point<L>) -> Lanes<L> {
    let m = |p: &Point<L>| p[0].abs().max(p[1].abs()).max(p[2].abs());
    m(a).max(m(b))
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
        let pick = |i: usize, j: usize| [sub(&x0[i], &x0[j]), sub(&x1[i], &x1[j])];
        match shape {
            Shape::VertexFace => Frame { e: pick(2, 1), f: pick(3, 1), g: pick(0, 1) },
            Shape::EdgeEdge => Frame { e: pick(1, 0), f: pick(3, 2), g: pick(2, 0) },
        }
    }

    /// Largest absolute components of e, f, g over both ends.
    #[inline(always)]
    pub fn sizes(&self) -> [Lanes<L>; 3] {
        [&self.e, &self.f, &self.g].map(|v| largest(&v[0], &v[1]))
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

/// Greater than zero where one of the three axes keeps the pair apart by more than `separation` for the whole step.
///
/// Exact for zero separation: a difference of doubles has the sign of the exact one, and coordinates linear in time
/// that are ordered at both ends are ordered in between.
#[inline(always)]
pub(super) fn axis_gap<const L: usize>(shape: Shape, x0: &[Point<L>; 4], x1: &[Point<L>; 4]) -> Lanes<L> {
    let mut best = Lanes::splat(f64::NEG_INFINITY);
    for c in 0..3 {
        let (mut above, mut below) = (Lanes::splat(f64::INFINITY), Lanes::splat(f64::INFINITY));
        for x in [x0, x1] {
            let (low_a, high_a, low_b, high_b) = match shape {
                Shape::VertexFace => {
                    (x[0][c], x[0][c], x[1][c].min(x[2][c]).min(x[3][c]), x[1][c].max(x[2][c]).max(x[3][c]))
                }
                Shape::EdgeEdge => {
                    (x[0][c].min(x[1][c]), x[0][c].max(x[1][c]), x[2][c].min(x[3][c]), x[2][c].max(x[3][c]))
                }
            };
            above = above.min(low_a - high_b);
            below = below.min(low_b - high_a);
        }
        best = best.max(above).max(below);
    }
    best
}

/// Greater than zero where the plane keeps the pair apart by more than `separation` for the whole step: the cubic's
/// coefficients exceed those of `separation |e x f|`, bounded by the norms of its control vectors, by the rounding
/// error.
#[inline(always)]
pub(super) fn plane_gap<const L: usize>(frame: &Frame<L>, separation: Option<Lanes<L>>) -> Lanes<L> {
    let n = frame.normals();
    let c = frame.cubic_times_three(&n);
    let [me, mf, mg] = frame.sizes();
    let product = me * mf * mg;
    let mut bound = [Lanes::splat(3.0 * CUBIC_ERROR) * product; 4];
    if let Some(separation) = separation {
        // The computed vectors are off by 18 u (36 u the middle one) of the product of sizes, their norms and the sums
        // below by less than 100 u more.
        let size = |v: &Point<L>| dot(v, v).sqrt();
        let (n0, n1, n2) = (size(&n[0]), size(&n[1]), size(&n[2]));
        let slack = Lanes::splat(2.0 * CUBIC_ERROR) * me * mf;
        let three = Lanes::splat(3.0);
        let elevated = [three * n0, n0 + n1, n1 + n2, three * n2];
        for (b, n) in bound.iter_mut().zip(elevated) {
            *b = *b + separation * (n + slack);
        }
    }
    let (mut above, mut below) = (c[0] - bound[0], c[0].negate() - bound[0]);
    for i in 1..4 {
        above = above.min(c[i] - bound[i]);
        below = below.min(c[i].negate() - bound[i]);
    }
    // Sizes whose products leave the range of doubles decide nothing.
    let in_range = (product - Lanes::splat(1e-250)).min(Lanes::splat(1e250) - product);
    above.max(below).min(in_range)
}
