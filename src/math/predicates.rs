//! Signs of determinants, exact for all finite doubles.
//!
//! Adaptive expansions (`robust`) where no product can overflow or vanish: every coordinate zero or of magnitude
//! `2^-250` to `2^300` (about `5e-76` to `2e90`). Outside that range, integer arithmetic without limits: same answers,
//! some microseconds each.

use super::{Integer, Vec3, decompose};
use robust::{Coord, Coord3D};

const SMALL: f64 = 5.527_147_875_260_445e-76;
const LARGE: f64 = 2.037_035_976_334_486e90;

fn in_range(coordinates: &[f64]) -> bool {
    coordinates.iter().all(|x| *x == 0.0 || (SMALL..=LARGE).contains(&x.abs()))
}

/// The number `integer * 2^exponent`.
#[derive(Clone)]
struct Dyadic {
    integer: Integer,
    exponent: i64,
}

impl Dyadic {
    fn new(x: f64) -> Dyadic {
        let (mantissa, exponent) = decompose(x.abs());
        let integer = Integer::from(mantissa);
        Dyadic { integer: if x < 0.0 { integer.negated() } else { integer }, exponent: i64::from(exponent) }
    }

    fn plus(&self, other: &Dyadic, sign: i32) -> Dyadic {
        let exponent = self.exponent.min(other.exponent);
        let a = self.integer.shifted_up((self.exponent - exponent) as u64);
        let b = other.integer.shifted_up((other.exponent - exponent) as u64);
        Dyadic { integer: if sign < 0 { a.minus(&b) } else { a.plus(&b) }, exponent }
    }

    fn times(&self, other: &Dyadic) -> Dyadic {
        Dyadic { integer: self.integer.times(&other.integer), exponent: self.exponent + other.exponent }
    }

    fn sign(&self) -> i32 {
        self.integer.sign()
    }
}

fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

/// `a0 b1 - a1 b0` of the differences `a - c`, `b - c`.
fn determinant_2(a: [Dyadic; 2], b: [Dyadic; 2]) -> Dyadic {
    a[0].times(&b[1]).plus(&a[1].times(&b[0]), -1)
}

/// Side of the line `a b` on which `c` lies, in the plane: 1 left (`a b c` counterclockwise), -1 right, 0 on it.
pub fn orient2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i32 {
    if in_range(&[a[0], a[1], b[0], b[1], c[0], c[1]]) {
        let p = |v: [f64; 2]| Coord { x: v[0], y: v[1] };
        return sign(robust::orient2d(p(a), p(b), p(c)));
    }
    let difference = |p: [f64; 2]| [0, 1].map(|k| Dyadic::new(p[k]).plus(&Dyadic::new(c[k]), -1));
    determinant_2(difference(a), difference(b)).sign()
}

/// Side of the plane `a b c` on which `d` lies: the sign of `((b - a) x (c - a)) · (d - a)`; 0 on the plane, or where
/// `a b c` lie on a line.
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i32 {
    if in_range(&a) && in_range(&b) && in_range(&c) && in_range(&d) {
        let p = |v: Vec3| Coord3D { x: v[0], y: v[1], z: v[2] };
        // Theirs is positive on the other side.
        return -sign(robust::orient3d(p(a), p(b), p(c), p(d)));
    }
    let difference = |p: Vec3| [0, 1, 2].map(|k| Dyadic::new(p[k]).plus(&Dyadic::new(a[k]), -1));
    let (u, v, w) = (difference(b), difference(c), difference(d));
    let minor = |i: usize, j: usize| determinant_2([u[i].clone(), u[j].clone()], [v[i].clone(), v[j].clone()]);
    let sum = minor(1, 2).times(&w[0]).plus(&minor(2, 0).times(&w[1]), 1);
    sum.plus(&minor(0, 1).times(&w[2]), 1).sign()
}

/// Sign of `normal · x - offset`.
pub fn plane_side(normal: Vec3, offset: f64, x: Vec3) -> i32 {
    let products = [normal[0] * x[0], normal[1] * x[1], normal[2] * x[2]];
    let value = products[0] + products[1] + products[2] - offset;
    let size = products[0].abs() + products[1].abs() + products[2].abs() + offset.abs();
    // Seven roundings at most, each below eps/2 of a partial sum; tiny sizes may have lost whole products.
    if value.is_finite() && size > 1e-290 && value.abs() > 4.0 * f64::EPSILON * size {
        return sign(value);
    }
    let product = |k: usize| Dyadic::new(normal[k]).times(&Dyadic::new(x[k]));
    product(0).plus(&product(1), 1).plus(&product(2), 1).plus(&Dyadic::new(offset), -1).sign()
}

/// The two other axes when axis `k` is dropped.
fn flat(v: Vec3, k: usize) -> [f64; 2] {
    [v[(k + 1) % 3], v[(k + 2) % 3]]
}

/// An axis along which the projection of the triangle keeps an area, or `None` where its corners lie on a line.
fn projection(a: Vec3, b: Vec3, c: Vec3) -> Option<usize> {
    (0..3).find(|k| orient2d(flat(a, *k), flat(b, *k), flat(c, *k)) != 0)
}

/// Whether the three points lie on a line (or coincide).
pub fn collinear(a: Vec3, b: Vec3, c: Vec3) -> bool {
    projection(a, b, c).is_none()
}

/// Whether two closed segments in the plane share a point; segments without length are points.
fn segments_meet_2d(p: [f64; 2], q: [f64; 2], a: [f64; 2], b: [f64; 2]) -> bool {
    let within =
        |u: [f64; 2], v: [f64; 2], x: [f64; 2]| (0..2).all(|k| u[k].min(v[k]) <= x[k] && x[k] <= u[k].max(v[k]));
    let (a_side, b_side) = (orient2d(p, q, a), orient2d(p, q, b));
    let (p_side, q_side) = (orient2d(a, b, p), orient2d(a, b, q));
    a_side * b_side < 0 && p_side * q_side < 0
        || a_side == 0 && within(p, q, a)
        || b_side == 0 && within(p, q, b)
        || p_side == 0 && within(a, b, p)
        || q_side == 0 && within(a, b, q)
}

/// Whether the closed segments `p q` and `a b` share a point. Exact; segments without length are points.
pub fn segments_meet(p: Vec3, q: Vec3, a: Vec3, b: Vec3) -> bool {
    if orient3d(p, q, a, b) != 0 {
        return false;
    }
    // A projection that is one-to-one on the common plane; if the points lie on a line, on that line.
    let plane = [(p, q, a), (p, q, b), (a, b, p), (a, b, q)].into_iter().find_map(|(x, y, z)| projection(x, y, z));
    match plane {
        Some(k) => segments_meet_2d(flat(p, k), flat(q, k), flat(a, k), flat(b, k)),
        None => (0..3).all(|k| p[k].min(q[k]) <= a[k].max(b[k]) && a[k].min(b[k]) <= p[k].max(q[k])),
    }
}

/// Whether the closed segment `p q` and the closed triangle `a b c` share a point.
///
/// Exact for all finite coordinates. A segment without length is a point; a triangle without area is the union of its
/// edges.
pub fn segment_meets_triangle(p: Vec3, q: Vec3, a: Vec3, b: Vec3, c: Vec3) -> bool {
    let (p_side, q_side) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
    if p_side * q_side > 0 {
        return false;
    }
    if p_side != q_side {
        // The line meets the plane in one point: inside if it passes all edges on the same side.
        let sides = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
        return sides.iter().all(|s| *s >= 0) || sides.iter().all(|s| *s <= 0);
    }
    match projection(a, b, c) {
        Some(k) => {
            let [p, q, a, b, c] = [p, q, a, b, c].map(|v| flat(v, k));
            let sides = [orient2d(a, b, p), orient2d(b, c, p), orient2d(c, a, p)];
            let inside = sides.iter().all(|s| *s >= 0) || sides.iter().all(|s| *s <= 0);
            inside || [(a, b), (b, c), (c, a)].into_iter().any(|(u, v)| segments_meet_2d(p, q, u, v))
        }
        None => [(a, b), (b, c), (c, a)].into_iter().any(|(u, v)| segments_meet(p, q, u, v)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const O: Vec3 = [0.0; 3];
    const X: Vec3 = [1.0, 0.0, 0.0];
    const Y: Vec3 = [0.0, 1.0, 0.0];

    #[test]
    fn sides_have_the_stated_sign() {
        assert_eq!(orient2d([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]), 1);
        for size in [1.0, 1e-120, 1e120, 1e-320] {
            let s = |v: Vec3| v.map(|x| x * size);
            assert_eq!(orient3d(O, s(X), s(Y), s([0.3, 0.3, 1.0])), 1, "{size:e}");
            assert_eq!(orient3d(O, s(X), s(Y), s([0.3, 0.3, -1.0])), -1);
            assert_eq!(orient3d(O, s(X), s(Y), s([5.0, 7.0, 0.0])), 0);
        }
    }

    #[test]
    fn one_bit_beside_a_plane_is_seen() {
        let n: Vec3 = [0.1, 0.7, -0.2];
        let x = [3.0, 1.0 / 3.0, 1.0];
        // Offsets around the rounded product: the exact one lies between two doubles.
        let value = n[0] * x[0] + n[1] * x[1] + n[2] * x[2];
        let signs: Vec<i32> = [value.next_down().next_down(), value, value.next_up().next_up()]
            .into_iter()
            .map(|offset| plane_side(n, offset, x))
            .collect();
        assert_eq!((signs[0], signs[2]), (1, -1));
        assert_eq!(plane_side([0.0, 0.0, 1.0], 0.5, [7.0, 9.0, 0.5]), 0);
        assert_eq!(plane_side([0.0, 0.0, 1.0], 0.5, [7.0, 9.0, 0.5_f64.next_down()]), -1);
        assert_eq!(plane_side([0.0, 1e-200, 0.0], 0.0, [7.0, 1e-200, 0.0]), 1);
    }

    #[test]
    fn touching_counts() {
        let up = [0.25, 0.25, 1.0];
        assert!(segment_meets_triangle([0.25, 0.25, 0.0], up, O, X, Y));
        assert!(!segment_meets_triangle([0.25, 0.25, 5e-324], up, O, X, Y));
        assert!(segment_meets_triangle([0.5, 0.5, -1.0], [0.5, 0.5, 1.0], O, X, Y));
        assert!(!segment_meets_triangle([0.5, 0.5_f64.next_up(), -1.0], [0.5, 0.5_f64.next_up(), 1.0], O, X, Y));
        // In the plane: inside, through, touching a corner, beside.
        assert!(segment_meets_triangle([0.2, 0.2, 0.0], [0.3, 0.2, 0.0], O, X, Y));
        assert!(segment_meets_triangle([-1.0, 0.2, 0.0], [3.0, 0.2, 0.0], O, X, Y));
        assert!(segment_meets_triangle([1.0, -1.0, 0.0], [1.0, 1.0, 0.0], O, X, Y));
        assert!(!segment_meets_triangle([2.0, -1.0, 0.0], [2.0, 1.0, 0.0], O, X, Y));
        // Without area, without length.
        assert!(segment_meets_triangle([0.5, 0.0, -1.0], [0.5, 0.0, 1.0], O, X, O));
        assert!(!segment_meets_triangle([1.5, 0.0, -1.0], [1.5, 0.0, 1.0], O, X, O));
        assert!(segment_meets_triangle(X, X, X, X, X));
        assert!(!segment_meets_triangle(X, X, Y, Y, Y));
    }
}
