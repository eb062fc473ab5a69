//! Three-vectors of several pairs side by side.

use super::Lanes;
use crate::math::Vec3;

/// Three coordinates, each for several pairs.
pub type Point<const L: usize> = [Lanes<L>; 3];

/// `a - b`
#[inline(always)]
pub fn sub<const L: usize>(a: &Point<L>, b: &Point<L>) -> Point<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + b`
#[inline(always)]
pub fn add<const L: usize>(a: &Point<L>, b: &Point<L>) -> Point<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `s a`
#[inline(always)]
pub fn scale<const L: usize>(s: Lanes<L>, a: &Point<L>) -> Point<L> {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a · b`
#[inline(always)]
pub fn dot<const L: usize>(a: &Point<L>, b: &Point<L>) -> Lanes<L> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x b`
#[inline(always)]
pub fn cross<const L: usize>(a: &Point<L>, b: &Point<L>) -> Point<L> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The largest absolute coordinate; of NaN nothing is promised.
#[inline(always)]
pub fn largest<const L: usize>(a: &Point<L>) -> Lanes<L> {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

/// `a` where `c` is greater than zero, `b` elsewhere.
#[inline(always)]
pub fn if_positive<const L: usize>(c: Lanes<L>, a: &Point<L>, b: &Point<L>) -> Point<L> {
    [c.if_positive(a[0], b[0]), c.if_positive(a[1], b[1]), c.if_positive(a[2], b[2])]
}

/// The `K` points of `L` pairs, `v[l][k]` their indices, coordinate by coordinate.
#[inline(always)]
pub fn gather<const K: usize, const L: usize>(x: &[Vec3], v: &[[usize; K]; L]) -> [Point<L>; K] {
    let mut points = [[Lanes([0.0; L]); 3]; K];
    for k in 0..K {
        let mut p = [[0.0; 3]; L];
        for l in 0..L {
            p[l] = x[v[l][k]];
        }
        for c in 0..3 {
            for l in 0..L {
                points[k][c].0[l] = p[l][c];
            }
        }
    }
    points
}
