//! Continuous detection with a minimum separation: certified separating directions over intervals of time.
//!
//! Time is walked from 0 upwards. An interval is passed only when one polynomial direction is proven to keep every
//! vertex pair apart by the separation on all of it, rounding included, so nothing is missed. The first interval that
//! cannot be passed ends the walk at its left end, which is the reported time.
//!
//! * A fixed direction (that of the closest points at the left end) is tried first: every `n·D_k` is linear in time, so
//!   two evaluations decide, and where it fails, the time up to which it holds is the next left end.
//! * Then a direction that moves with the pair: the quadratic through the directions at the ends and the middle, scaled
//!   so that it is exactly the face normal, the edge cross product or the vertex difference where the closest features
//!   stay the same. Rigid rotation at a tiny gap is passed in a few intervals.
//! * Otherwise the interval is halved.
//!
//! *False alarms.* An alarm is raised at a time where the distance is at most `separation (1 + 2^-10) + 128 u M`, u
//! the unit roundoff, M the largest coordinate difference between the two primitives at both ends, or when the work
//! bound is met.
//! *Work.* At most [`MAX_INTERVALS`] intervals (fewer on request).

use super::motion::{
    DIRECTION_ERROR, Direction, Kind, differences_at, fixed_direction_separates, largest_component,
    moving_direction_separates, separating_direction, support,
};
use crate::math::{Vec3, add, add_scaled, dot, scale};

/// Intervals examined per query at most; beyond, the left end of the current one is reported.
pub const MAX_INTERVALS: usize = 2048;

/// Alarms are raised at distances up to `separation * (1 + ALARM_TOLERANCE)`, apart from rounding.
pub const ALARM_TOLERANCE: f64 = 1.0 / 1024.0;

/// Depth of halving: 2^-60 of the step is below the resolution of time near 1.
const MAX_DEPTH: usize = 64;

/// The differences of a pair at one time, and the direction that separates it best there.
#[derive(Clone, Copy)]
struct Sample<const N: usize> {
    t: f64,
    d: [Vec3; N],
    direction: Direction,
}

/// The two distances that steer the walk: what a certificate must show, and below what a pair counts as reached.
#[derive(Clone, Copy)]
struct Levels {
    required: f64,
    alarm: f64,
}

/// First time in `[0, t_max]` at which the distance falls below `separation`, conservative; see the module's notes.
pub(super) fn first_approach<const N: usize, K: Kind<N>>(
    x0: &[Vec3; 4],
    x1: &[Vec3; 4],
    separation: f64,
    t_max: f64,
    intervals: usize,
) -> Option<f64> {
    let (mut d0, mut d1) = (K::differences(x0), K::differences(x1));
    let (largest0, largest1) = (largest_component(&d0), largest_component(&d1));
    if !(largest0 + largest1 + separation).is_finite() {
        // Overflow of a difference, or input that is not finite: nothing can be certified.
        return Some(0.0);
    }
    let mut largest = largest0.max(largest1);
    let mut separation = separation.max(0.0);
    if !(1e-60..1e60).contains(&largest) {
        // Powers of two bring the pair to unit size without rounding, so that products neither vanish nor overflow.
        let factor = f64::MIN_POSITIVE.max(power_of_two_near_inverse(largest));
        for d in d0.iter_mut().chain(d1.iter_mut()) {
            *d = scale(factor, *d);
        }
        largest *= factor;
        separation *= factor;
    }
    let error = DIRECTION_ERROR * largest;
    let required = separation + separation * (4.0 * f64::EPSILON) + error;
    if required > 4.0 * largest {
        return Some(0.0);
    }
    let levels = Levels { required, alarm: separation * (1.0 + ALARM_TOLERANCE) + 4.0 * error };
    walk::<N, K>(&d0, &d1, levels, t_max.clamp(0.0, 1.0), intervals)
}

/// How far from the time `from` towards the time `to` the direction between the closest points at `from`, held fixed,
/// keeps the pair apart; `to` itself where it reaches that far. `None` where it shows nothing.
pub(super) fn held_direction<const N: usize, K: Kind<N>>(
    x0: &[Vec3; 4],
    x1: &[Vec3; 4],
    from: f64,
    to: f64,
) -> Option<f64> {
    let (d0, d1) = (K::differences(x0), K::differences(x1));
    let largest = largest_component(&d0).max(largest_component(&d1));
    if !(1e-60..1e60).contains(&largest) {
        return None;
    }
    let required = DIRECTION_ERROR * largest;
    let (near, far) = (sample::<N, K>(&d0, &d1, from)?, differences_at(&d0, &d1, to));
    let n = near.direction.unit;
    if near.direction.gap < required {
        return None;
    }
    if fixed_direction_separates(n, &near.d, &far, required) {
        return Some(to);
    }
    // Half the way to where the gap closes leaves room for rounding, and for the signs that are asked for there.
    let mut fraction = 1.0_f64;
    for (d_near, d_far) in near.d.iter().zip(&far) {
        let (a, b) = (dot(n, *d_near), dot(n, *d_far));
        if b < required {
            fraction = fraction.min(0.5 * a / (a - b));
        }
    }
    let t = from + fraction * (to - from);
    (t != from && support(n, &differences_at(&d0, &d1, t)) >= required).then_some(t)
}

/// A power of two within a factor two of `1 / a`; 1 for zero.
fn power_of_two_near_inverse(a: f64) -> f64 {
    if a == 0.0 {
        return 1.0;
    }
    // 2^1022 is the largest power whose inverse is normal; subnormal sizes are brought up as far as it goes.
    2.0_f64.powi((-a.log2().floor()).clamp(-1022.0, 1022.0) as i32)
}

fn sample<const N: usize, K: Kind<N>>(d0: &[Vec3; N], d1: &[Vec3; N], t: f64) -> Option<Sample<N>> {
    let d = differences_at(d0, d1, t);
    let direction = separating_direction::<N, K>(&d)?;
    Some(Sample { t, d, direction })
}

fn walk<const N: usize, K: Kind<N>>(
    d0: &[Vec3; N],
    d1: &[Vec3; N],
    levels: Levels,
    t_max: f64,
    intervals: usize,
) -> Option<f64> {
    let Some(mut left) = sample::<N, K>(d0, d1, 0.0) else { return Some(0.0) };
    if left.direction.gap < levels.required {
        return Some(0.0);
    }
    let end = differences_at(d0, d1, t_max);
    // The common case: one direction for the whole step, no second sample needed.
    if fixed_direction_separates(left.direction.unit, &left.d, &end, levels.required) {
        return None;
    }
    let Some(last) = sample::<N, K>(d0, d1, t_max) else { return Some(0.0) };
    if fixed_direction_separates(last.direction.unit, &left.d, &last.d, levels.required) {
        return None;
    }
    // Times still to be reached, the nearest on top, and the sample there.
    let mut ends = [t_max; MAX_DEPTH];
    let mut count = 1;
    let mut right = last;
    // Whether the farthest end in the list is a time at which the pair is too close.
    let mut blocked = right.direction.gap < levels.required;
    let mut stalled = false;
    for _ in 0..intervals {
        if count == 0 {
            return if blocked { Some(left.t) } else { None };
        }
        if right.t != ends[count - 1] {
            let Some(next) = sample::<N, K>(d0, d1, ends[count - 1]) else { return Some(left.t) };
            right = next;
        }
        if fixed_direction_separates(left.direction.unit, &left.d, &right.d, levels.required)
            || linear_direction_separates(&left, &right, levels.required)
        {
            left = right;
            count -= 1;
            continue;
        }
        if left.direction.gap <= levels.alarm {
            return Some(left.t);
        }
        if !stalled && let Some((t, fraction)) = advance(d0, d1, &left, &right, levels) {
            let Some(advanced) = sample::<N, K>(d0, d1, t) else { return Some(left.t) };
            // Approaching contact, the excess shrinks quickly; a pair that slides or turns at its distance keeps it, and
            // gets on faster with a moving direction.
            let excess = |s: &Sample<N>| s.direction.gap - levels.required;
            stalled = fraction < 0.25 && excess(&advanced) > 0.5 * excess(&left);
            left = advanced;
            continue;
        }
        stalled = false;
        let t = left.t + 0.5 * (right.t - left.t);
        let Some(middle) = sample::<N, K>(d0, d1, t) else { return Some(left.t) };
        if quadratic_direction_separates(&left, &middle, &right, levels.required) {
            left = right;
            count -= 1;
            continue;
        }
        if count == MAX_DEPTH || t <= left.t || t >= right.t {
            return Some(left.t);
        }
        if middle.direction.gap < levels.required {
            // Something lies in the way before this time: what comes after does not matter.
            count = 0;
            blocked = true;
        }
        ends[count] = middle.t;
        right = middle;
        count += 1;
    }
    Some(left.t)
}

/// The time inside the interval up to which the left direction, held fixed, certifies the pair, and the fraction of the
/// interval that is. `None` when it is not inside.
fn advance<const N: usize>(
    d0: &[Vec3; N],
    d1: &[Vec3; N],
    left: &Sample<N>,
    right: &Sample<N>,
    levels: Levels,
) -> Option<(f64, f64)> {
    let n = left.direction.unit;
    // Aim between what must be shown and the alarm level, so that the result is certified and counts as reached.
    let aim = 0.5 * (levels.required + levels.alarm);
    let mut fraction = 1.0_f64;
    for k in 0..N {
        let (a, b) = (dot(n, left.d[k]), dot(n, right.d[k]));
        if b < aim {
            fraction = fraction.min((a - aim) / (a - b));
        }
    }
    let t = left.t + fraction * (right.t - left.t);
    (t > left.t && t < right.t && support(n, &differences_at(d0, d1, t)) >= levels.required).then_some((t, fraction))
}

/// The direction interpolated linearly between unit directions at both ends: never longer than 1.
fn linear_direction_separates<const N: usize>(left: &Sample<N>, right: &Sample<N>, required: f64) -> bool {
    let (na, nb) = (left.direction.unit, right.direction.unit);
    (0..N).all(|k| {
        dot(na, left.d[k]) >= required
            && dot(nb, right.d[k]) >= required
            && dot(na, right.d[k]) + dot(nb, left.d[k]) >= 2.0 * required
    })
}

/// The quadratic through the directions at the ends and in the middle.
fn quadratic_direction_separates<const N: usize>(
    left: &Sample<N>,
    middle: &Sample<N>,
    right: &Sample<N>,
    required: f64,
) -> bool {
    let (a, m, b) = (&left.direction, &middle.direction, &right.direction);
    let one_feature = a.feature == m.feature && b.feature == m.feature;
    let vector = |d: &Direction| if one_feature { scale(d.weight, d.unit) } else { d.unit };
    let (na, nm, nb) = (vector(a), vector(m), vector(b));
    let control = add_scaled(scale(2.0, nm), -0.5, add(na, nb));
    moving_direction_separates(&[na, control, nb], &left.d, &right.d, required)
}
