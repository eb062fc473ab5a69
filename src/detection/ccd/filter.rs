//! Continuous detection with zero separation.

use super::exact::{self, Shape};
use super::motion::Kind;
use super::separation;
use crate::math::{Vec3, is_finite};

/// Exact first contact; see the two kernels.
pub(super) fn time_of_impact<const N: usize, K: Kind<N>>(
    shape: Shape,
    x0: &[Vec3; 4],
    x1: &[Vec3; 4],
    t_max: f64,
) -> Option<f64> {
    if !x0.iter().chain(x1).all(|p| is_finite(*p)) {
        return Some(0.0);
    }
    separation::time_of_impact::<N, K>(x0, x1, 0.0, t_max)?;
    exact::time_of_impact(shape, x0, x1, if t_max < 1.0 { t_max.max(0.0) } else { 1.0 })
}
