//! A spring from a node to a point that the host moves.

use super::stencil::{Blocks, HessianForm, Stencil};
use crate::math::{IDENTITY, Vec3, mat_scale, norm_squared, scale, sub};

/// `E = k/2 |x - target|^2`. It pulls from outside: neither net force nor torque vanish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetSpring {
    /// Stiffness k `[N/m]`, not negative.
    pub stiffness: f64,
    /// Where it pulls to `[m]`.
    pub target: Vec3,
}

impl Stencil<1> for TargetSpring {
    fn energy(&self, x: &[Vec3; 1]) -> f64 {
        0.5 * self.stiffness * norm_squared(sub(x[0], self.target))
    }

    fn force(&self, x: &[Vec3; 1]) -> [Vec3; 1] {
        [scale(self.stiffness, sub(self.target, x[0]))]
    }

    /// Both forms are the same.
    fn hessian(&self, _x: &[Vec3; 1], _form: HessianForm) -> Blocks<1> {
        [[mat_scale(self.stiffness, &IDENTITY)]]
    }

    /// Against the target as if it stood still, in every direction.
    fn viscosity(&self, x: &[Vec3; 1]) -> Blocks<1> {
        self.hessian(x, HessianForm::Exact)
    }

    fn stiffness_bound(&self, _x: &[Vec3; 1]) -> f64 {
        self.stiffness
    }
}
