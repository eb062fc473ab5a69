//! A spring between two nodes: stretch, shear and bend springs of cloth alike [Provot95; Bridson02].

use super::stencil::{Blocks, HessianForm, Stencil, zero_blocks};
use crate::math::{IDENTITY, Mat3, Vec3, ZERO_MATRIX, mat_add, mat_scale, norm, outer, scale, sub, unit};

/// `E = k/2 (|x1 - x0| - L)^2`.
///
/// Where both nodes coincide a spring has no direction: force and second derivatives are zero there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Stiffness k `[N/m]`, not negative.
    pub stiffness: f64,
    /// Rest length L `[m]`, not negative.
    pub rest_length: f64,
}

impl Spring {
    /// Blocks `[[m, -m], [-m, m]]`.
    fn opposed(m: &Mat3) -> Blocks<2> {
        let negative = mat_scale(-1.0, m);
        [[*m, negative], [negative, *m]]
    }
}

impl Stencil<2> for Spring {
    fn energy(&self, x: &[Vec3; 2]) -> f64 {
        let stretch = norm(sub(x[1], x[0])) - self.rest_length;
        0.5 * self.stiffness * stretch * stretch
    }

    fn force(&self, x: &[Vec3; 2]) -> [Vec3; 2] {
        let along = sub(x[1], x[0]);
        let Some(direction) = unit(along) else { return [[0.0; 3]; 2] };
        let f = scale(self.stiffness * (norm(along) - self.rest_length), direction);
        [f, scale(-1.0, f)]
    }

    /// Projected: the part across the spring, negative under compression, is left out there [Choi02, compression].
    fn hessian(&self, x: &[Vec3; 2], form: HessianForm) -> Blocks<2> {
        let along = sub(x[1], x[0]);
        let Some(direction) = unit(along) else { return zero_blocks() };
        let mut across = 1.0 - self.rest_length / norm(along);
        if form == HessianForm::Projected {
            across = across.max(0.0);
        }
        let projector = outer(direction, direction);
        let m = mat_add(&mat_scale(across, &IDENTITY), &mat_scale(1.0 - across, &projector));
        Spring::opposed(&mat_scale(self.stiffness, &m))
    }

    fn viscosity(&self, x: &[Vec3; 2]) -> Blocks<2> {
        let m = unit(sub(x[1], x[0])).map_or(ZERO_MATRIX, |d| mat_scale(self.stiffness, &outer(d, d)));
        Spring::opposed(&m)
    }

    fn stiffness_bound(&self, _x: &[Vec3; 2]) -> f64 {
        2.0 * self.stiffness
    }
}
