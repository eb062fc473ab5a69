//! Three-vectors of several pairs side by side.

use super::{Lanes, Number};
use crate::math::Vec3;

/// Three coordinates, each for several pairs.
pub type Point<const L: usize, T = f64> = [Lanes<L, T>; 3];

/// `a - b`
#[inline(always)]
pub fn sub<const L: usize, T: Number>(a: &Point<L, T>, b: &Point<L, T>) -> Point<L, T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + b`
#[inline(always)]
pub fn add<const L: usize, T: Number>(a: &Point<L, T>, b: &Point<L, T>) -> Point<L, T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a + s b`
#[inline(always)]
pub fn add_scaled<const L: usize, T: Number>(a: &Point<L, T>, s: Lanes<L, T>, b: &Point<L, T>) -> Point<L, T> {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// `s a`
#[inline(always)]
pub fn scale<const L: usize, T: Number>(s: Lanes<L, T>, a: &Point<L, T>) -> Point<L, T> {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a · b`
#[inline(always)]
pub fn dot<const L: usize, T: Number>(a: &Point<L, T>, b: &Point<L, T>) -> Lanes<L, T> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x b`
#[inline(always)]
pub fn cross<const L: usize, T: Number>(a: &Point<L, T>, b: &Point<L, T>) -> Point<L, T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The largest absolute coordinate; of NaN nothing is promised.
#[inline(always)]
pub fn largest<const L: usize, T: Number>(a: &Point<L, T>) -> Lanes<L, T> {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

/// `a` where `c` is greater than zero, `b` elsewhere.
#[inline(always)]
pub fn if_positive<const L: usize, T: Number>(c: Lanes<L, T>, a: &Point<L, T>, b: &Point<L, T>) -> Point<L, T> {
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

/// [`gather`] of three numbers and a fourth one in single precision: the points, and the fourth numbers.
#[inline(always)]
pub fn gather_quads<const K: usize, const L: usize>(
    x: &[[f32; 4]],
    v: &[[usize; K]; L],
) -> ([Point<L, f32>; K], [Lanes<L, f32>; K]) {
    let mut points = [[Lanes([0.0; L]); 3]; K];
    let mut fourth = [Lanes([0.0; L]); K];
    for k in 0..K {
        for l in 0..L {
            let p = x[v[l][k]];
            points[k][0].0[l] = p[0];
            points[k][1].0[l] = p[1];
            points[k][2].0[l] = p[2];
            fourth[k].0[l] = p[3];
        }
    }
    (points, fourth)
}
