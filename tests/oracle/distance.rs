//! Closest points against exact rational arithmetic.

use crate::random::Random;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};
use signorini::geometry::{edge_edge, point_triangle};
use signorini::math::Vec3;

type Q = BigRational;
type Q3 = [Q; 3];

/// Stated accuracy, in units of the extent.
const TOLERANCE: f64 = 16.0 * f64::EPSILON;

fn exact(v: Vec3) -> Q3 {
    v.map(|x| BigRational::from_float(x).unwrap())
}

fn sub(a: &Q3, b: &Q3) -> Q3 {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

fn dot(a: &Q3, b: &Q3) -> Q {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn along(a: &Q3, t: &Q, d: &Q3) -> Q3 {
    [0, 1, 2].map(|k| &a[k] + t * &d[k])
}

fn distance_squared(a: &Q3, b: &Q3) -> Q {
    let d = sub(a, b);
    dot(&d, &d)
}

/// Smallest squared distance of a point and a segment.
fn point_segment(p: &Q3, a: &Q3, b: &Q3) -> Q {
    let d = sub(b, a);
    let length = dot(&d, &d);
    if length.is_zero() {
        return distance_squared(p, a);
    }
    let t = dot(&sub(p, a), &d) / length;
    let t = if t.is_negative() {
        Q::zero()
    } else if t > Q::one() {
        Q::one()
    } else {
        t
    };
    distance_squared(p, &along(a, &t, &d))
}

/// Smallest squared distance of a point and a triangle: over edges, and inside where the projection falls inside.
fn point_triangle_exact(p: &Q3, t: &[Q3; 3]) -> Q {
    let mut best = (0..3).map(|k| point_segment(p, &t[k], &t[(k + 1) % 3])).min().unwrap();
    let (u, v, w) = (sub(&t[1], &t[0]), sub(&t[2], &t[0]), sub(p, &t[0]));
    let (uu, uv, vv, wu, wv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v), dot(&w, &u), dot(&w, &v));
    let determinant = &uu * &vv - &uv * &uv;
    if !determinant.is_zero() {
        let b1 = (&vv * &wu - &uv * &wv) / &determinant;
        let b2 = (&uu * &wv - &uv * &wu) / &determinant;
        if !b1.is_negative() && !b2.is_negative() && &b1 + &b2 <= Q::one() {
            best = best.min(distance_squared(p, &along(&along(&t[0], &b1, &u), &b2, &v)));
        }
    }
    best
}

/// Smallest squared distance of two segments: over end points, and inside where the lines are closest inside both.
fn edge_edge_exact(e: &[Q3; 4]) -> Q {
    let [a0, a1, b0, b1] = e;
    let mut best = point_segment(a0, b0, b1)
        .min(point_segment(a1, b0, b1))
        .min(point_segment(b0, a0, a1))
        .min(point_segment(b1, a0, a1));
    let (a, b, r) = (sub(a1, a0), sub(b1, b0), sub(b0, a0));
    let (aa, ab, bb, ra, rb) = (dot(&a, &a), dot(&a, &b), dot(&b, &b), dot(&r, &a), dot(&r, &b));
    let determinant = &aa * &bb - &ab * &ab;
    if !determinant.is_zero() {
        let s = (&ra * &bb - &rb * &ab) / &determinant;
        let t = (&ra * &ab - &rb * &aa) / &determinant;
        let inside = |u: &Q| !u.is_negative() && *u <= Q::one();
        if inside(&s) && inside(&t) {
            best = best.min(distance_squared(&along(a0, &s, &a), &along(b0, &t, &b)));
        }
    }
    best
}

/// Distance in units of the extent.
fn relative(distance_squared: &Q, extent: &Q) -> f64 {
    (distance_squared / (extent * extent)).to_f64().unwrap().sqrt()
}

fn extent(x: &[Vec3; 4]) -> Q {
    let mut largest = Q::zero();
    for a in x {
        for b in x {
            for d in sub(&exact(*a), &exact(*b)) {
                largest = largest.max(d.abs());
            }
        }
    }
    largest
}

fn check(x: &[Vec3; 4]) {
    let e = extent(x);
    let q = x.map(exact);
    let found = point_triangle::closest_points(x[0], x[1], x[2], x[3]);
    let w = found.barycentrics;
    assert!(w.iter().all(|w| (0.0..=1.0).contains(w)), "{x:?} {found:?}");
    assert!((w[0] + w[1] + w[2] - 1.0).abs() <= 2.0 * f64::EPSILON);
    assert_eq!(found.distance_squared.to_bits(), point_triangle::distance_squared(x[0], x[1], x[2], x[3]).to_bits());
    let (w1, w2) = (BigRational::from_float(w[1]).unwrap(), BigRational::from_float(w[2]).unwrap());
    let named = along(&along(&q[1], &w1, &sub(&q[2], &q[1])), &w2, &sub(&q[3], &q[1]));
    let truth = point_triangle_exact(&q[0], &[q[1].clone(), q[2].clone(), q[3].clone()]);
    compare(x, &e, &truth, &exact(found.separation), &sub(&q[0], &named), "point-triangle");

    let found = edge_edge::closest_points(x[0], x[1], x[2], x[3]);
    assert!((0.0..=1.0).contains(&found.s) && (0.0..=1.0).contains(&found.t), "{x:?} {found:?}");
    assert_eq!(found.distance_squared.to_bits(), edge_edge::distance_squared(x[0], x[1], x[2], x[3]).to_bits());
    let (s, t) = (BigRational::from_float(found.s).unwrap(), BigRational::from_float(found.t).unwrap());
    let named = sub(&along(&q[0], &s, &sub(&q[1], &q[0])), &along(&q[2], &t, &sub(&q[3], &q[2])));
    let truth = edge_edge_exact(&q);
    compare(x, &e, &truth, &exact(found.separation), &named, "edge-edge");
}

/// The reported separation, and the one between the points that the weights name, both have the exact length.
fn compare(x: &[Vec3; 4], e: &Q, truth: &Q, separation: &Q3, named: &Q3, what: &str) {
    if e.is_zero() {
        assert!(dot(separation, separation).is_zero());
        return;
    }
    let truth = relative(truth, e);
    for found in [separation, named] {
        let error = (relative(&dot(found, found), e) - truth).abs();
        assert!(error <= TOLERANCE, "{what}: error {error:e} of the extent, distance {truth:e}, {x:?}");
    }
}

fn mix(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    signorini::math::add_scaled(a, s, b)
}

#[test]
fn random_and_lattice_points() {
    let mut r = Random::new(1);
    for _ in 0..600 {
        check(&[0; 4].map(|_| r.vector()));
        // On a small lattice most queries are degenerate: coincident points, collinear triangles, parallel edges.
        check(&[0; 4].map(|_| [0; 3].map(|_| r.pick(3) as f64 - 1.0)));
        check(&[0; 4].map(|_| [0; 3].map(|_| r.pick(2) as f64)));
    }
}

#[test]
fn slivers_and_nearly_parallel_edges() {
    let mut r = Random::new(2);
    for _ in 0..800 {
        let (a, d, offset) = (r.vector(), r.vector(), r.vector());
        let (h, gap) = (r.power(-20.0, -2.0), r.power(-20.0, 0.5));
        let along = mix(a, r.unit(), d);
        let apex = mix(along, h, r.vector());
        let near = mix(mix(mix(a, r.unit(), d), r.between(-0.5, 1.5) * h, offset), gap, r.vector());
        check(&[near, a, mix(a, 1.0, d), apex]);
        check(&[apex, mix(a, 1.0, d), a, near]);
        // Edges that cross or nearly cross at a tiny angle.
        let (c, tilt) = (mix(a, r.unit(), d), mix(d, h, r.vector()));
        let (s, g) = (r.unit(), if r.pick(2) == 0 { 0.0 } else { gap });
        let b0 = mix(mix(c, -s, tilt), g, offset);
        check(&[a, mix(a, 1.0, d), b0, mix(b0, 1.0, tilt)]);
    }
}

#[test]
fn coincident_points_zero_lengths_and_collinear_points() {
    let mut r = Random::new(3);
    for _ in 0..200 {
        let (a, b, c) = (r.vector(), r.vector(), r.vector());
        check(&[a; 4]);
        check(&[a, b, b, b]);
        check(&[a, b, b, c]);
        check(&[a, a, b, c]);
        check(&[a, a, b, b]);
        check(&[a, b, a, b]);
        check(&[a, b, b, a]);
        let collinear = [0; 4].map(|_| mix(a, (r.pick(7) as f64 - 3.0) * 0.25, [1.0, -0.5, 2.0]));
        check(&collinear);
    }
}

#[test]
fn far_from_the_origin_and_at_extreme_sizes() {
    let mut r = Random::new(4);
    for _ in 0..25 {
        let far = signorini::math::scale(1e6, r.vector());
        let size = r.power(-12.0, 0.0);
        check(&[0; 4].map(|_| mix(far, size, r.vector())));
        for exponent in [-150.0, -100.0, -61.0, 59.0, 100.0, 150.0] {
            let size = 10_f64.powf(exponent);
            let x = [0; 4].map(|_| signorini::math::scale(size, r.vector()));
            check(&x);
            // A small triangle or edge in a large query.
            let tiny = size * r.power(-150.0, 0.0).max(1e-150 / size);
            check(&[x[0], x[1], mix(x[1], tiny, x[2]), mix(x[1], tiny, x[3])]);
            check(&[x[0], mix(x[0], tiny, x[1]), x[2], mix(x[2], tiny, x[3])]);
            check(&[x[0], mix(x[0], tiny, x[1]), mix(x[0], tiny, x[2]), mix(x[0], tiny, x[3])]);
        }
    }
}

#[test]
fn named_cases() {
    use edge_edge::Feature as E;
    use point_triangle::Feature as F;
    let (o, x, y, z) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let found = point_triangle::closest_points([0.25, 0.25, 2.0], o, x, y);
    assert_eq!((found.feature, found.barycentrics, found.distance_squared), (F::Face, [0.5, 0.25, 0.25], 4.0));
    assert_eq!((found.closest, found.separation), ([0.25, 0.25, 0.0], [0.0, 0.0, 2.0]));
    let found = point_triangle::closest_points([2.0, 2.0, 0.0], o, x, y);
    assert_eq!((found.feature, found.barycentrics), (F::Edge(1), [0.0, 0.5, 0.5]));
    let found = point_triangle::closest_points([-1.0, -3.0, 0.0], o, x, y);
    assert_eq!((found.feature, found.closest), (F::Vertex(0), o));
    let found = edge_edge::closest_points([-1.0, 0.0, 0.0], x, [0.0, -1.0, 1.0], [0.0, 1.0, 1.0]);
    assert_eq!((found.feature, found.s, found.t, found.distance_squared), (E::Edges, 0.5, 0.5, 1.0));
    assert_eq!(found.separation, [0.0, 0.0, -1.0]);
    let found = edge_edge::closest_points(o, x, [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]);
    assert_eq!((found.feature, found.distance_squared), (E::Vertices(1, 0), 1.0));
    let found = edge_edge::closest_points(o, x, [0.5, 1.0, 0.0], mix(z, 2.0, y));
    assert_eq!((found.feature, found.s), (E::EdgeVertex(0), 0.5));
}
