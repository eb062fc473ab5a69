//! Continuous detection of a vertex against a face, vertices in the order `p t0 t1 t2`.

use super::motion::VertexFace;
use super::separation;
use crate::math::Vec3;

/// First time in `[0, t_max]` at which the distance of the vertex from the triangle falls below `separation` `[m]`,
/// conservative; `None` when it does not.
///
/// The motion is linear from `x0` to `x1`. Returns `Some(0.0)` when the distance is not above the separation at the
/// start, or when the input is not finite. Never later than the true time. False alarms, the bound on the work and the
/// method: [`super::separation`].
pub fn time_of_impact_with_separation(x0: &[Vec3; 4], x1: &[Vec3; 4], separation: f64, t_max: f64) -> Option<f64> {
    separation::time_of_impact::<3, VertexFace>(x0, x1, separation, t_max)
}
