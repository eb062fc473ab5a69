//! The exact decision for one pair, in integers.
//!
//! Coordinates are doubles, so they become integers when multiplied by a power of two. Contact needs the four points
//! to be coplanar: a cubic in time, whose roots are isolated exactly. At a root the contact test needs signs of
//! polynomials of degree two only: with the points coplanar, the vectors `d x f` that hold the barycentric coordinates
//! are multiples of the normal, so one component of each, chosen where the normal does not vanish, is enough.
//! Collapsed triangles, collapsed and parallel edges are decided on their segments. A pair that stays coplanar for the
//! whole step can come into contact only where a vertex meets a segment, so the roots of those conditions are the
//! candidate times.
//!
//! *Work.* At most one cubic or thirty-seven polynomials of degree two, each with a bounded number of roots; the length
//! of the integers is `53 + (largest exponent - smallest exponent of the 24 coordinates)` bits and products of six.
//! Absurd exponent ranges (1e-300 beside 1e300) are still decided, in milliseconds instead of tens of microseconds.

use crate::math::{IntegerPolynomial, Root, Vec3, decompose};
use num_bigint::BigInt;

type Linear = [IntegerPolynomial; 3];

/// Which closed primitives the four points form.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    VertexFace,
    EdgeEdge,
}

/// The exact earliest contact in `[0, t_max]`, rounded down to a double. Coordinates must be finite.
pub(super) fn time_of_impact(shape: Shape, x0: &[Vec3; 4], x1: &[Vec3; 4], t_max: f64) -> Option<f64> {
    let points = trajectories(x0, x1);
    let cubic = coplanarity(shape, &points);
    let last = Root::from_double(t_max.min(1.0))?;
    let mut candidates =
        if cubic.is_zero() { coplanar_candidates(shape, &points) } else { cubic.roots_in_unit_interval() };
    if cubic.is_zero() {
        for root in &mut candidates {
            root.refine(64);
        }
        candidates.push(Root::rational(BigInt::ZERO, 0));
        candidates.push(last);
        // Roots whose intervals share a lower end give the same double, so their order does not matter.
        candidates.sort_by(Root::order_of_lower_ends);
    }
    for mut root in candidates {
        if t_max < 1.0 && root.is_above(t_max) {
            continue;
        }
        if touches(shape, &points, &mut root) {
            return Some(root.lower_double());
        }
    }
    None
}

/// What happens at one root of the coplanarity cubic.
pub(super) enum AtRoot {
    Apart,
    /// Contact; the root rounded down.
    Touching(f64),
    /// The bracket does not do: the whole step has to be decided.
    Unusable,
}

/// Decides contact at the only root of the cubic in `[l, r]`, simple and enclosed in `(a, b)`.
pub(super) fn at_root(shape: Shape, x0: &[Vec3; 4], x1: &[Vec3; 4], part: (f64, f64), bracket: (f64, f64)) -> AtRoot {
    let points = trajectories(x0, x1);
    let Some(mut root) = Root::in_bracket(coplanarity(shape, &points), part, bracket) else { return AtRoot::Unusable };
    if touches(shape, &points, &mut root) { AtRoot::Touching(root.lower_double()) } else { AtRoot::Apart }
}

/// The four points as integer linear polynomials, all scaled by one power of two.
fn trajectories(x0: &[Vec3; 4], x1: &[Vec3; 4]) -> [Linear; 4] {
    let least = x0.iter().chain(x1).flatten().filter(|c| **c != 0.0).map(|c| decompose(*c).1).min().unwrap_or(0);
    let integer = |c: f64| {
        let (mantissa, exponent) = decompose(c);
        let magnitude = BigInt::from(mantissa) << (i64::from(exponent) - i64::from(least)).max(0);
        if c < 0.0 { -magnitude } else { magnitude }
    };
    // Relative to the first point's start: shorter integers far from the origin.
    let origin = x0[0].map(integer);
    std::array::from_fn(|i| {
        std::array::from_fn(|c| {
            IntegerPolynomial::linear(integer(x0[i][c]) - &origin[c], integer(x1[i][c]) - &origin[c])
        })
    })
}

fn difference(a: &Linear, b: &Linear) -> Linear {
    std::array::from_fn(|c| a[c].sub(&b[c]))
}

fn cross_component(a: &Linear, b: &Linear, c: usize) -> IntegerPolynomial {
    let (i, j) = ((c + 1) % 3, (c + 2) % 3);
    a[i].mul(&b[j]).sub(&a[j].mul(&b[i]))
}

fn cross(a: &Linear, b: &Linear) -> [IntegerPolynomial; 3] {
    std::array::from_fn(|c| cross_component(a, b, c))
}

fn dot(a: &[IntegerPolynomial; 3], b: &Linear) -> IntegerPolynomial {
    a[0].mul(&b[0]).add(&a[1].mul(&b[1])).add(&a[2].mul(&b[2]))
}

/// The two spanning vectors of the plane, and the vector from it that must lie in it.
fn frame(shape: Shape, [a, b, c, d]: &[Linear; 4]) -> (Linear, Linear, Linear) {
    match shape {
        Shape::VertexFace => (difference(c, b), difference(d, b), difference(a, b)),
        Shape::EdgeEdge => (difference(b, a), difference(d, c), difference(c, a)),
    }
}

fn coplanarity(shape: Shape, points: &[Linear; 4]) -> IntegerPolynomial {
    let (e, f, g) = frame(shape, points);
    dot(&cross(&e, &f), &g)
}

/// The vertex-segment pairs at which contact of coplanar primitives begins, and on which collapsed ones are decided.
fn vertices_and_segments(shape: Shape) -> &'static [[usize; 3]] {
    match shape {
        Shape::VertexFace => &[[0, 1, 2], [0, 2, 3], [0, 3, 1]],
        Shape::EdgeEdge => &[[0, 2, 3], [1, 2, 3], [2, 0, 1], [3, 0, 1]],
    }
}

fn coplanar_candidates(shape: Shape, points: &[Linear; 4]) -> Vec<Root> {
    let mut roots = Vec::new();
    for [p, a, b] in vertices_and_segments(shape) {
        let (to_a, to_b) = (difference(&points[*p], &points[*a]), difference(&points[*p], &points[*b]));
        let along = difference(&points[*b], &points[*a]);
        for g in cross(&to_a, &along).iter().chain([&dot(&to_a, &to_b)]).chain(&to_a).chain(&to_b) {
            roots.extend(g.roots_in_unit_interval());
        }
    }
    roots
}

/// Whether the closed primitives share a point at a time of coplanarity.
fn touches(shape: Shape, points: &[Linear; 4], t: &mut Root) -> bool {
    let (e, f, g) = frame(shape, points);
    let mut normal = (0, 0, IntegerPolynomial::default());
    for c in 0..3 {
        let component = cross_component(&e, &f, c);
        let sign = t.sign_of(&component);
        if sign != 0 {
            normal = (sign, c, component);
            break;
        }
    }
    let (sign, c, n) = normal;
    if sign == 0 {
        return vertices_and_segments(shape)
            .iter()
            .any(|[p, a, b]| on_segment(&points[*p], &points[*a], &points[*b], t));
    }
    let mut not_negative = |p: &IntegerPolynomial| t.sign_of(p) * sign >= 0;
    match shape {
        Shape::VertexFace => {
            // d = u e + v f: d x f = u n, e x d = v n.
            let (u, v) = (cross_component(&g, &f, c), cross_component(&e, &g, c));
            not_negative(&u) && not_negative(&v) && not_negative(&n.sub(&u).sub(&v))
        }
        Shape::EdgeEdge => {
            // g + r f = s e: g x f = s n, g x e = r n.
            let (s, r) = (cross_component(&g, &f, c), cross_component(&g, &e, c));
            not_negative(&s) && not_negative(&n.sub(&s)) && not_negative(&r) && not_negative(&n.sub(&r))
        }
    }
}

fn on_segment(p: &Linear, a: &Linear, b: &Linear, t: &mut Root) -> bool {
    let (to_a, to_b) = (difference(p, a), difference(p, b));
    // With p - a parallel to p - b, p lies between a and b when they point in opposite directions or one vanishes.
    (0..3).all(|c| t.sign_of(&cross_component(&to_a, &to_b, c)) == 0) && t.sign_of(&dot(&to_a, &to_b)) <= 0
}
