//! Continuous detection of a vertex against a face, vertices in the order `p t0 t1 t2`.

use super::motion::VertexFace;
use super::{filter, separation};
use crate::math::Vec3;

/// First time in `[0, t_max]` at which the distance of the vertex from the triangle falls below `separation` `[m]`,
/// conservative; `None` when it does not.
///
/// The motion is linear from `x0` to `x1`. Returns `Some(0.0)` when the distance is not above the separation at the
/// start, or when the input is not finite. Never later than the true time. False alarms, the bound on the work and the
/// method: [`super::separation`].
pub fn time_of_impact_with_separation(x0: &[Vec3; 4], x1: &[Vec3; 4], separation: f64, t_max: f64) -> Option<f64> {
    separation::first_approach::<3, VertexFace>(x0, x1, separation, t_max, separation::MAX_INTERVALS)
}

/// First time in `[0, t_max]` at which the vertex is on the closed triangle; `None` when it never is. Exact: no miss
/// and no false alarm, collapsed triangles and motions that stay coplanar included.
///
/// The motion is linear from `x0` to `x1`. The result is never later than the exact time and at most 1e-6 earlier;
/// `Some(0.0)` when touching at the start, or when the input is not finite. Method: [`super::filter`].
pub fn time_of_impact(x0: &[Vec3; 4], x1: &[Vec3; 4], t_max: f64) -> Option<f64> {
    filter::time_of_impact::<3, VertexFace>(x0, x1, t_max)
}
