//! Weight in a uniform field.

use super::stencil::{Blocks, HessianForm, Stencil, zero_blocks};
use crate::math::{Vec3, dot, scale};

/// `E = -m g · x` of one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gravity {
    /// Mass m `[kg]`.
    pub mass: f64,
    /// Acceleration g `[m/s^2]`.
    pub acceleration: Vec3,
}

impl Stencil<1> for Gravity {
    fn energy(&self, x: &[Vec3; 1]) -> f64 {
        -self.mass * dot(self.acceleration, x[0])
    }

    fn force(&self, _x: &[Vec3; 1]) -> [Vec3; 1] {
        [scale(self.mass, self.acceleration)]
    }

    fn hessian(&self, _x: &[Vec3; 1], _form: HessianForm) -> Blocks<1> {
        zero_blocks()
    }

    fn viscosity(&self, _x: &[Vec3; 1]) -> Blocks<1> {
        zero_blocks()
    }

    fn stiffness_bound(&self, _x: &[Vec3; 1]) -> f64 {
        0.0
    }
}
