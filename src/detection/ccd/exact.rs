//! The exact decision for one pair, in integers.
//!
//! Coordinates are doubles, so they become integers when multiplied by a power of two. Contact needs the four points
//! to be coplanar: a cubic in time, whose roots are isolated exactly. At a root the contact test needs signs of
//! polynomials of degree two only: with the points coplanar, the vectors `d x f` that hold the barycentric coordinates
//! are multiples of the normal, so one component of each, chosen where the normal does not vanish, is enough. Signs
//! that floating point is certain of are not asked for again.
//! Collapsed triangles, collapsed and parallel edges are decided on their segments. A pair that stays coplanar for the
//! whole step comes into contact where a vertex meets a segment, so the times at which one does are the candidates.
//!
//! *Work.* At most one cubic or four polynomials of degree two, each with a bounded number of roots; the length of the
//! integers is `53 + (largest exponent - smallest exponent of the 24 coordinates)` bits and products of six.
//! Absurd exponent ranges (1e-300 beside 1e300) are still decided, in milliseconds instead of microseconds.

use super::roots::TIME_TOLERANCE;
use crate::math::{Integer, IntegerPolynomial, Root, Vec3, decompose};
use std::array::from_fn;

/// A coordinate, linear in time: its start and its slope.
type Linear = [Integer; 2];
type Quadratic = [Integer; 3];

/// Which closed primitives the four points form.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in crate::detection) enum Shape {
    VertexFace,
    EdgeEdge,
}

/// What floating point is certain of at a root: a component of the normal and its sign, and which of the four
/// conditions of contact remain open.
pub(super) struct Certain {
    pub axis: usize,
    pub side: i32,
    pub open: [bool; 4],
}

/// The exact earliest contact in `[0, t_max]`, rounded down to a double. Coordinates must be finite.
pub(super) fn time_of_impact(shape: Shape, x0: &[Vec3; 4], x1: &[Vec3; 4], t_max: f64) -> Option<f64> {
    let points = Points::new(x0, x1);
    let frame = points.frame(shape);
    let cubic = frame.coplanarity();
    if cubic.is_zero() {
        return coplanar_time_of_impact(shape, &points, &frame, t_max);
    }
    for mut root in cubic.roots_in_unit_interval() {
        if t_max < 1.0 && root.is_above(t_max) {
            return None;
        }
        if touches(shape, &points, &frame, &mut root) {
            return Some(root.lower_double());
        }
    }
    None
}

/// What happens at one root of the coplanarity cubic.
pub(super) enum AtRoot {
    Apart,
    /// Contact; not later than the root and at most the tolerance of time earlier.
    Touching(f64),
    /// The bracket does not do: the whole step has to be decided.
    Unusable,
}

/// Decides contact at the only root of the cubic in `[l, r]`, simple and enclosed in `(a, b)`.
pub(super) fn at_root(
    shape: Shape,
    x0: &[Vec3; 4],
    x1: &[Vec3; 4],
    part: (f64, f64),
    bracket: (f64, f64),
    certain: Option<Certain>,
) -> AtRoot {
    let points = Points::new(x0, x1);
    let frame = points.frame(shape);
    let Some(mut root) = Root::in_bracket(frame.coplanarity(), part, bracket) else { return AtRoot::Unusable };
    let touching = match certain {
        Some(certain) => frame.conditions_hold(shape, &certain, &mut root),
        None => touches(shape, &points, &frame, &mut root),
    };
    match touching {
        false => AtRoot::Apart,
        true if bracket.1 - bracket.0 < TIME_TOLERANCE => AtRoot::Touching(bracket.0),
        true => AtRoot::Touching(root.lower_double()),
    }
}

/// The four points at both ends, all scaled by one power of two.
struct Points {
    x0: [[Integer; 3]; 4],
    x1: [[Integer; 3]; 4],
}

impl Points {
    fn new(x0: &[Vec3; 4], x1: &[Vec3; 4]) -> Points {
        let least = x0.iter().chain(x1).flatten().filter(|c| **c != 0.0).map(|c| decompose(*c).1).min().unwrap_or(0);
        let integer = |c: f64| {
            let (mantissa, exponent) = decompose(c);
            let magnitude = Integer::from(mantissa).shifted_up((i64::from(exponent) - i64::from(least)).max(0) as u64);
            if c < 0.0 { magnitude.negated() } else { magnitude }
        };
        Points { x0: x0.map(|p| p.map(integer)), x1: x1.map(|p| p.map(integer)) }
    }

    /// From point j to point i.
    fn difference(&self, i: usize, j: usize) -> [Linear; 3] {
        from_fn(|c| {
            let start = self.x0[i][c].minus(&self.x0[j][c]);
            let slope = self.x1[i][c].minus(&self.x1[j][c]).minus(&start);
            [start, slope]
        })
    }

    fn frame(&self, shape: Shape) -> Frame {
        match shape {
            Shape::VertexFace => Frame { e: self.difference(2, 1), f: self.difference(3, 1), g: self.difference(0, 1) },
            Shape::EdgeEdge => Frame { e: self.difference(1, 0), f: self.difference(3, 2), g: self.difference(2, 0) },
        }
    }
}

fn product(a: &Linear, b: &Linear) -> Quadratic {
    [a[0].times(&b[0]), a[0].times(&b[1]).plus(&a[1].times(&b[0])), a[1].times(&b[1])]
}

fn plus(a: &Quadratic, b: &Quadratic) -> Quadratic {
    from_fn(|i| a[i].plus(&b[i]))
}

fn minus(a: &Quadratic, b: &Quadratic) -> Quadratic {
    from_fn(|i| a[i].minus(&b[i]))
}

fn cross_component(a: &[Linear; 3], b: &[Linear; 3], c: usize) -> Quadratic {
    let (i, j) = ((c + 1) % 3, (c + 2) % 3);
    minus(&product(&a[i], &b[j]), &product(&a[j], &b[i]))
}

/// The two spanning vectors of the plane, and the vector from it that must lie in it.
struct Frame {
    e: [Linear; 3],
    f: [Linear; 3],
    g: [Linear; 3],
}

impl Frame {
    fn normal(&self, c: usize) -> Quadratic {
        cross_component(&self.e, &self.f, c)
    }

    /// `(e x f)·g`
    fn coplanarity(&self) -> IntegerPolynomial {
        let mut sum: [Integer; 4] = Default::default();
        for c in 0..3 {
            for (i, n) in self.normal(c).iter().enumerate() {
                for (j, g) in self.g[c].iter().enumerate() {
                    sum[i + j] = sum[i + j].plus(&n.times(g));
                }
            }
        }
        IntegerPolynomial::new(sum)
    }

    /// Whether the open conditions of contact hold at a time of coplanarity; the conditions in the order that the
    /// floating-point test has them in.
    fn conditions_hold(&self, shape: Shape, known: &Certain, t: &mut Root) -> bool {
        let Frame { e, f, g } = self;
        let c = known.axis;
        let n = || self.normal(c);
        // Vertex-face, g = u e + v f: g x f = u n, e x g = v n. Edge-edge, g + r f = s e: g x f = s n, g x e = r n.
        let first = || cross_component(g, f, c);
        let second = || if shape == Shape::VertexFace { cross_component(e, g, c) } else { cross_component(g, e, c) };
        let condition = |k: usize| match (shape, k) {
            (_, 0) => first(),
            (Shape::VertexFace, 1) | (Shape::EdgeEdge, 2) => second(),
            (Shape::VertexFace, 2) => minus(&minus(&n(), &first()), &second()),
            (Shape::VertexFace, _) => n(),
            (Shape::EdgeEdge, 1) => minus(&n(), &first()),
            (Shape::EdgeEdge, _) => minus(&n(), &second()),
        };
        (0..4).filter(|k| known.open[*k]).all(|k| t.sign_of(&IntegerPolynomial::new(condition(k))) * known.side >= 0)
    }
}

/// A vertex and a segment, as `[p, a, b]`: where coplanar primitives begin to touch, and what collapsed ones consist of.
fn vertices_and_segments(shape: Shape) -> &'static [[usize; 3]] {
    match shape {
        Shape::VertexFace => &[[0, 1, 2], [0, 2, 3], [0, 3, 1]],
        Shape::EdgeEdge => &[[0, 2, 3], [1, 2, 3], [2, 0, 1], [3, 0, 1]],
    }
}

/// A vertex p beside a segment a b: `p - a` and `p - b`.
struct Beside {
    to_a: [Linear; 3],
    to_b: [Linear; 3],
}

impl Beside {
    fn new(points: &Points, [p, a, b]: [usize; 3]) -> Beside {
        Beside { to_a: points.difference(p, a), to_b: points.difference(p, b) }
    }

    /// Component c of `(p - a) x (p - b)`: zero on the line.
    fn cross(&self, c: usize) -> IntegerPolynomial {
        IntegerPolynomial::new(cross_component(&self.to_a, &self.to_b, c))
    }

    /// `(p - a)·(p - b)`: on the line, not positive between a and b.
    fn dot(&self) -> IntegerPolynomial {
        let [x, y, z] = from_fn(|c| product(&self.to_a[c], &self.to_b[c]));
        IntegerPolynomial::new(plus(&plus(&x, &y), &z))
    }

    /// Whether the vertex is on the segment. Components left out are known to vanish.
    fn touches(&self, t: &mut Root, left_out: Option<usize>) -> bool {
        t.sign_of(&self.dot()) <= 0 && (0..3).all(|c| left_out == Some(c) || t.sign_of(&self.cross(c)) == 0)
    }
}

/// Contact of a pair that stays coplanar: at the start, or where a vertex first meets a segment.
fn coplanar_time_of_impact(shape: Shape, points: &Points, frame: &Frame, t_max: f64) -> Option<f64> {
    if touches(shape, points, frame, &mut Root::rational(Integer::ZERO, 0)) {
        return Some(0.0);
    }
    let mut earliest: Option<f64> = None;
    for vertices in vertices_and_segments(shape) {
        let beside = Beside::new(points, *vertices);
        // On the line at the roots of any component that does not vanish identically; on the line throughout, it meets
        // the segment at its ends.
        let moving = (0..3).map(|c| (Some(c), beside.cross(c))).find(|(_, polynomial)| !polynomial.is_zero());
        let (component, event) = moving.unwrap_or_else(|| (None, beside.dot()));
        for mut root in event.roots_in_unit_interval() {
            let latest = earliest.unwrap_or(t_max);
            if latest < 1.0 && root.is_above(latest) {
                break;
            }
            if beside.touches(&mut root, component) {
                let time = root.lower_double();
                earliest = Some(earliest.map_or(time, |e| e.min(time)));
                break;
            }
        }
    }
    earliest
}

/// Whether the closed primitives share a point at a time of coplanarity.
fn touches(shape: Shape, points: &Points, frame: &Frame, t: &mut Root) -> bool {
    for axis in 0..3 {
        let side = t.sign_of(&IntegerPolynomial::new(frame.normal(axis)));
        if side != 0 {
            // The last condition of a vertex and a face is the normal itself.
            let open = [true, true, true, shape == Shape::EdgeEdge];
            return frame.conditions_hold(shape, &Certain { axis, side, open }, t);
        }
    }
    vertices_and_segments(shape).iter().any(|vertices| Beside::new(points, *vertices).touches(t, None))
}
