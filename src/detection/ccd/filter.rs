//! Continuous detection with zero separation: floating-point filters with proven error bounds, then the exact decision.
//!
//! 1. *Axes* (exact): coordinates ordered alike at both ends along x, y or z rule contact out.
//! 2. *Plane*: the Bernstein coefficients of the coplanarity cubic, all of one sign, rule contact out.
//! 3. *Roots*: the step is divided until every part has at most one change of sign among its coefficients, so exactly
//!    one root or none. Each root is enclosed in a short bracket, at whose ends the sign of the cubic is certain, and
//!    the barycentric coordinates are tested over the bracket. Inside: a hit, reported at the left end of the bracket.
//!    Outside: no contact at this root. Left open by rounding: `exact` decides at this root.
//! 4. *Separation*: [`super::separation`] with separation zero rules out what never comes close.
//! 5. *Integers*: `exact` decides what is left: grazing contact, contact at an end of the step, pairs that stay
//!    coplanar.
//!
//! *Work.* Parts 1 to 3 are bounded by [`MAX_PARTS`] parts and [`MAX_ITERATIONS`] evaluations for each root, part 4 by
//! [`SEPARATION_INTERVALS`], part 5 as stated there.

use super::coplanarity::{CUBIC_ERROR, Frame, axis_gap, plane_gap};
use super::exact::{self, AtRoot, Shape};
use super::motion::{Kind, UNIT_ROUNDOFF};
use super::separation;
use crate::math::simd::Lanes;
use crate::math::{Vec3, is_finite};

/// Parts into which the step is divided at most to isolate the roots of the cubic.
pub const MAX_PARTS: usize = 32;

/// Evaluations of the cubic per root at most.
pub const MAX_ITERATIONS: usize = 40;

/// Intervals that the separation test may use before the exact decision.
pub const SEPARATION_INTERVALS: usize = 64;

/// The reported time may be this much earlier than the exact one.
const TIME_TOLERANCE: f64 = 1e-6;

/// What floating point can say about a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    Miss,
    /// Contact, first at this time or at most the tolerance later.
    Hit(f64),
    Open,
}

/// Exact first contact; see the two kernels.
pub(super) fn time_of_impact<const N: usize, K: Kind<N>>(x0: &[Vec3; 4], x1: &[Vec3; 4], t_max: f64) -> Option<f64> {
    if !x0.iter().chain(x1).all(|p| is_finite(*p)) {
        return Some(0.0);
    }
    let (y0, y1) = (single(x0), single(x1));
    if axis_gap(K::SHAPE, &y0, &y1, Lanes([0.0]), 1.0).0[0] > 0.0 {
        return None;
    }
    let frame = Frame::new(K::SHAPE, &y0, &y1);
    if plane_gap(&frame, None, 1.0).0[0] > 0.0 {
        return None;
    }
    after_plane_test::<N, K>(x0, x1, &frame, t_max)
}

/// What follows the tests that run on several pairs at once. Coordinates finite.
pub(super) fn after_plane_test<const N: usize, K: Kind<N>>(
    x0: &[Vec3; 4],
    x1: &[Vec3; 4],
    frame: &Frame<1>,
    t_max: f64,
) -> Option<f64> {
    let t_max = if t_max < 1.0 { t_max.max(0.0) } else { 1.0 };
    match first_root_inside::<N, K>((x0, x1), frame, t_max) {
        Verdict::Miss => None,
        Verdict::Hit(t) => Some(t),
        Verdict::Open => {
            separation::first_approach::<N, K>(x0, x1, 0.0, t_max, SEPARATION_INTERVALS)?;
            exact::time_of_impact(K::SHAPE, x0, x1, t_max)
        }
    }
}

/// One pair as lanes of width one.
pub(super) fn single(x: &[Vec3; 4]) -> [[Lanes<1>; 3]; 4] {
    x.map(|p| p.map(|c| Lanes([c])))
}

/// A cubic in Bernstein form on [0, 1] with the rounding bound of its values.
struct Cubic {
    b: [f64; 4],
    error: f64,
}

#[inline(always)]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    (1.0 - t) * a + t * b
}

impl Cubic {
    /// The blossom: with all arguments t the value, with l's and r's mixed the coefficients on [l, r].
    #[inline(always)]
    fn blossom(&self, s: f64, t: f64, u: f64) -> f64 {
        let b = &self.b;
        let (p, q, r) = (lerp(b[0], b[1], s), lerp(b[1], b[2], s), lerp(b[2], b[3], s));
        lerp(lerp(p, q, t), lerp(q, r, t), u)
    }

    /// Value and derivative.
    #[inline(always)]
    fn at(&self, t: f64) -> (f64, f64) {
        let b = &self.b;
        let (p, q, r) = (lerp(b[0], b[1], t), lerp(b[1], b[2], t), lerp(b[2], b[3], t));
        let (v, w) = (lerp(p, q, t), lerp(q, r, t));
        (lerp(v, w, t), 3.0 * (w - v))
    }

    fn part(&self, l: f64, r: f64) -> [f64; 4] {
        [self.blossom(l, l, l), self.blossom(l, l, r), self.blossom(l, r, r), self.blossom(r, r, r)]
    }

    /// Sign beyond rounding, or 0.
    #[inline(always)]
    fn sign(&self, value: f64) -> i32 {
        i32::from(value > self.error) - i32::from(value < -self.error)
    }

    /// A bracket around the only root in (l, r), where the signs at both ends are certain and different (`sign_left`
    /// on the left); the signs at its ends are certain too.
    fn bracket(&self, l: f64, r: f64, values: (f64, f64), sign_left: i32) -> Option<(f64, f64)> {
        let (mut low, mut high) = (l, r);
        let side = f64::from(sign_left);
        let mut t = (l + (r - l) * (values.0 / (values.0 - values.1))).clamp(l, r);
        for _ in 0..MAX_ITERATIONS {
            let (value, slope) = self.at(t);
            let step = value / slope;
            if value.abs() <= self.error || step.abs() < UNIT_ROUNDOFF {
                return self.close_bracket(low, high, t, slope, side);
            }
            if value * side > 0.0 {
                low = t;
            } else {
                high = t;
            }
            let next = t - step;
            t = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        None
    }

    /// Steps outwards from an approximate root until the signs are certain.
    fn close_bracket(&self, low: f64, high: f64, t: f64, slope: f64, side: f64) -> Option<(f64, f64)> {
        let mut reach = 2.5 * self.error / slope.abs() + 2.0 * UNIT_ROUNDOFF;
        for _ in 0..4 {
            if reach.is_nan() || reach > 0.25 {
                return None;
            }
            let (a, b) = ((t - reach).max(low), (t + reach).min(high));
            if self.at(a).0 * side > self.error && self.at(b).0 * side < -self.error {
                return Some((a, b));
            }
            reach *= 4.0;
        }
        None
    }
}

/// Walks the roots of the cubic from the left and tests contact at each.
fn first_root_inside<const N: usize, K: Kind<N>>(x: (&[Vec3; 4], &[Vec3; 4]), frame: &Frame<1>, t_max: f64) -> Verdict {
    let sizes = frame.sizes().map(|s| s.0[0]);
    let product = sizes[0] * sizes[1] * sizes[2];
    if !(1e-250..1e250).contains(&product) {
        return Verdict::Open;
    }
    let c = frame.cubic_times_three(&frame.normals());
    let cubic = Cubic { b: c.map(|c| c.0[0] * (1.0 / 3.0)), error: CUBIC_ERROR * product };
    // Parts still to be looked at are [left, ends.last()], then on to the one below.
    let mut ends = [t_max; 8];
    let mut count = 1;
    let mut left = 0.0;
    for _ in 0..MAX_PARTS {
        let right = ends[count - 1];
        let b = if left == 0.0 && right == 1.0 { cubic.b } else { cubic.part(left, right) };
        let signs = b.map(|b| cubic.sign(b));
        match changes(&signs) {
            Changes::None => {}
            Changes::One => match test_root(K::SHAPE, x, frame, &cubic, (left, right), (b[0], b[3]), &sizes) {
                Verdict::Miss => {}
                decided => return decided,
            },
            Changes::End => {
                // Coplanar at an end of the step, as parallel edges are: passed with a direction held fixed.
                let pass = |from, to| separation::held_direction::<N, K>(x.0, x.1, from, to);
                if signs[0] == 0 {
                    let Some(t) = pass(left, right) else { return Verdict::Open };
                    left = t;
                } else if count == 1 {
                    let Some(t) = pass(right, left) else { return Verdict::Open };
                    ends[0] = t;
                } else {
                    return Verdict::Open;
                }
                if left < ends[count - 1] {
                    continue;
                }
            }
            Changes::Unclear => {
                if count == ends.len() {
                    return Verdict::Open;
                }
                ends[count] = 0.5 * (left + right);
                count += 1;
                continue;
            }
        }
        left = ends[count - 1];
        count -= 1;
        if count == 0 {
            return Verdict::Miss;
        }
    }
    Verdict::Open
}

/// Changes of sign among Bernstein coefficients.
enum Changes {
    None,
    /// One for certain, whatever the uncertain coefficients in between are.
    One,
    /// The sign at an end is uncertain: division in time does not help.
    End,
    Unclear,
}

fn changes(s: &[i32; 4]) -> Changes {
    if s[0] == 0 || s[3] == 0 {
        return Changes::End;
    }
    if s[0] == s[3] {
        return if s[1] == s[0] && s[2] == s[0] { Changes::None } else { Changes::Unclear };
    }
    // + - + - is the only pattern with three; it is excluded when one inner sign is certain and like its outer one.
    if s[1] == s[0] || s[2] == s[3] { Changes::One } else { Changes::Unclear }
}

/// Contact at the only root in a part: in floating point, and where rounding leaves it open, in integers.
fn test_root(
    shape: Shape,
    (x0, x1): (&[Vec3; 4], &[Vec3; 4]),
    frame: &Frame<1>,
    cubic: &Cubic,
    part: (f64, f64),
    values: (f64, f64),
    sizes: &[f64; 3],
) -> Verdict {
    let sign_left = cubic.sign(values.0);
    let Some((a, b)) = cubic.bracket(part.0, part.1, values, sign_left) else { return Verdict::Open };
    match inside(shape, frame, 0.5 * (a + b), 0.5 * (b - a), sizes) {
        Some(true) if b - a < TIME_TOLERANCE => return Verdict::Hit(a),
        Some(false) => return Verdict::Miss,
        _ => {}
    }
    match exact::at_root(shape, x0, x1, part, (a, b)) {
        AtRoot::Apart => Verdict::Miss,
        AtRoot::Touching(t) => Verdict::Hit(t),
        AtRoot::Unusable => Verdict::Open,
    }
}

/// Whether the primitives touch at the root of the cubic within `reach` of t; `None` when rounding or the width of the
/// bracket leaves it open.
///
/// At the root the points are coplanar, so the cross products that hold the barycentric coordinates are multiples of
/// the normal, and their components along the axis where the normal is largest decide. Such a component is a sum of
/// two products of components linear in time: rounding is at most 20 u of the product of sizes, and over the bracket
/// it changes by at most `8 reach` of it.
fn inside(shape: Shape, frame: &Frame<1>, t: f64, reach: f64, sizes: &[f64; 3]) -> Option<bool> {
    let at = |v: &[[Lanes<1>; 3]; 2]| -> Vec3 { std::array::from_fn(|c| lerp(v[0][c].0[0], v[1][c].0[0], t)) };
    let (e, f, g) = (at(&frame.e), at(&frame.f), at(&frame.g));
    let n = crate::math::cross(e, f);
    let axis = (1..3).fold(0, |m, c| if n[c].abs() > n[m].abs() { c } else { m });
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let component = |a: &Vec3, b: &Vec3| a[i] * b[j] - a[j] * b[i];
    let relative = 32.0 * UNIT_ROUNDOFF + 8.0 * reach;
    let [ef, gf, ge] = [sizes[0] * sizes[1], sizes[2] * sizes[1], sizes[2] * sizes[0]].map(|p| relative * p);
    if n[axis].abs() <= ef {
        return None;
    }
    let side = if n[axis] > 0.0 { 1.0 } else { -1.0 };
    let n = n[axis] * side;
    let u = component(&g, &f) * side;
    let (conditions, errors) = match shape {
        Shape::VertexFace => {
            let v = component(&e, &g) * side;
            ([u, v, n - u - v, n], [gf, ge, ef + gf + ge, ef])
        }
        Shape::EdgeEdge => {
            let r = component(&g, &e) * side;
            ([u, n - u, r, n - r], [gf, ef + gf, ge, ef + ge])
        }
    };
    let mut certain = true;
    for (condition, error) in conditions.iter().zip(errors) {
        if *condition < -error {
            return Some(false);
        }
        certain &= *condition > error;
    }
    certain.then_some(true)
}
