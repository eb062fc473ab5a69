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
//! *Work.* Parts 1 to 3 are bounded by [`MAX_PARTS`] parts and `roots::MAX_ITERATIONS` evaluations for each root, part 4 by
//! [`SEPARATION_INTERVALS`], part 5 as stated there.

use super::coplanarity::{Frame, axis_gap, plane_gap};
use super::exact::{self, AtRoot, Certain, Shape};
use super::motion::Kind;
use super::roots::{Cubic, TIME_TOLERANCE, contact};
use super::separation;
use crate::math::simd::Lanes;
use crate::math::{Vec3, is_finite};

/// Parts into which the step is divided at most to isolate the roots of the cubic.
pub const MAX_PARTS: usize = 32;

/// Intervals that the separation test may use before the exact decision.
pub const SEPARATION_INTERVALS: usize = 64;

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
    if plane_gap(&frame, 1.0).0[0] > 0.0 {
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

/// Walks the roots of the cubic from the left and tests contact at each.
fn first_root_inside<const N: usize, K: Kind<N>>(x: (&[Vec3; 4], &[Vec3; 4]), frame: &Frame<1>, t_max: f64) -> Verdict {
    let sizes = frame.sizes();
    let product = (sizes[0] * sizes[1] * sizes[2]).0[0];
    if !(1e-250..1e250).contains(&product) {
        return Verdict::Open;
    }
    let cubic = Cubic::new(frame, &sizes);
    let error = cubic.error.0[0];
    // Parts still to be looked at are [left, ends.last()], then on to the one below.
    let mut ends = [t_max; 8];
    let mut count = 1;
    let mut left = 0.0;
    for _ in 0..MAX_PARTS {
        let right = ends[count - 1];
        let b = cubic.part(left, right);
        let signs = b.map(|b| i32::from(b.0[0] > error) - i32::from(b.0[0] < -error));
        match changes(&signs) {
            Changes::None => {}
            Changes::One => match test_root(K::SHAPE, x, frame, &cubic, (left, right), &b, &sizes) {
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
    cubic: &Cubic<1>,
    part: (f64, f64),
    b: &[Lanes<1>; 4],
    sizes: &[Lanes<1>; 3],
) -> Verdict {
    let bracket = cubic.bracket(part.0, part.1, (b[0], b[3]));
    if bracket.certain.0[0] <= 0.0 {
        return Verdict::Open;
    }
    let contact = contact(shape, frame, &bracket, sizes);
    let ends = (bracket.a.0[0], bracket.b.0[0]);
    if contact.outside().0[0] > 0.0 {
        return Verdict::Miss;
    }
    if contact.inside().0[0] > 0.0 && ends.1 - ends.0 < TIME_TOLERANCE {
        return Verdict::Hit(ends.0);
    }
    let certain = (contact.normal.0[0] > 0.0).then(|| Certain {
        axis: contact.axis.0[0] as usize,
        side: contact.side.0[0] as i32,
        open: std::array::from_fn(|k| contact.conditions[k].0[0] <= contact.errors[k].0[0]),
    });
    match exact::at_root(shape, x0, x1, part, ends, certain) {
        AtRoot::Apart => Verdict::Miss,
        AtRoot::Touching(t) => Verdict::Hit(t),
        AtRoot::Unusable => Verdict::Open,
    }
}
