//! Drag of moving air on a face.

use super::stencil::Blocks;
use crate::math::{Vec3, add, cross, dot, mat_scale, norm, outer, scale, sub, unit};

/// Pressure drag of one triangle: `F = -c A |u · n| (u · n) n`, a third of it on each vertex, with `u` the mean velocity
/// of the face relative to the air. Both sides count alike; `c = density of air x drag coefficient / 2` `[kg/m^3]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceDrag {
    /// `c` `[kg/m^3]`, not negative.
    pub coefficient: f64,
}

impl FaceDrag {
    /// Force on each vertex `[N]`. A face without area feels none.
    pub fn force(&self, x: &[Vec3; 3], v: &[Vec3; 3], wind: Vec3) -> [Vec3; 3] {
        let Some((normal, area)) = face(x) else { return [[0.0; 3]; 3] };
        let through = through(v, wind, normal);
        [scale(-self.coefficient * area * through.abs() * through / 3.0, normal); 3]
    }

    /// `D` in the drag `-D (v - wind)` with `|u · n|` taken at `v` `[kg/s]`: the force at `v` itself, and half of the
    /// force's exact derivative, which keeps the implicit step stable and exact where the speed is steady.
    pub fn secant(&self, x: &[Vec3; 3], v: &[Vec3; 3], wind: Vec3) -> Blocks<3> {
        let Some((normal, area)) = face(x) else { return super::stencil::zero_blocks() };
        let factor = self.coefficient * area * through(v, wind, normal).abs() / 9.0;
        [[mat_scale(factor, &outer(normal, normal)); 3]; 3]
    }
}

fn face(x: &[Vec3; 3]) -> Option<(Vec3, f64)> {
    let area = cross(sub(x[1], x[0]), sub(x[2], x[0]));
    unit(area).map(|normal| (normal, 0.5 * norm(area)))
}

/// `u · n` of the mean vertex velocity.
fn through(v: &[Vec3; 3], wind: Vec3, normal: Vec3) -> f64 {
    let mean = scale(1.0 / 3.0, add(add(v[0], v[1]), v[2]));
    dot(sub(mean, wind), normal)
}
