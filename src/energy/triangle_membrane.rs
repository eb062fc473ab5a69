//! Constant-strain triangles in their plane: membranes of cloth and shells.

use super::damping::excess_stretch;
use super::side_by_side::{LANES, SideBySide};
use super::stencil::{Blocks, HessianForm, Stencil, zero_blocks};
use crate::math::simd::points::Point;
use crate::math::{
    IDENTITY, Mat3, Vec3, add_scaled, cross, dot, mat_add, mat_scale, norm, norm_squared, outer, scale, sub, tangents,
    transpose, unit,
};

/// A singular value below this share of the larger one has no direction of its own.
const DEGENERATE: f64 = 1e-10;

/// `E = A h (mu |F - R|^2 + lambda/2 tr(R^T F - I)^2)` with the 3x2 deformation gradient F of the triangle, the
/// orthonormal R closest to it, and Lamé's coefficients of plane stress: co-rotational linear elasticity.
///
/// A triangle pressed to a line or a point is a named case: the directions it has lost are a fixed choice, and force
/// and projected Hessian stay finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleMembrane {
    /// Rest volume `A h` `[m^3]`.
    pub(crate) volume: f64,
    /// `F = sum x_i b_i^T`: gradients of the shape functions in the plane at rest `[1/m]`.
    pub(crate) gradients: [[f64; 2]; 3],
    /// Lamé's lambda of plane stress `[Pa]`.
    pub(crate) lambda: f64,
    /// Lamé's mu `[Pa]`.
    pub(crate) mu: f64,
}

/// Deformation gradient split into what its energy needs.
struct Deformation {
    /// Columns of F.
    f: [Vec3; 2],
    /// Singular values, descending, not negative.
    sigma: [f64; 2],
    /// Right singular vectors.
    v: [[f64; 2]; 2],
    /// Left singular vectors and the normal.
    u: [Vec3; 3],
    /// `tr(S) - 2`
    dilation: f64,
}

fn dot2(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn combine(f: &[Vec3; 2], b: [f64; 2]) -> Vec3 {
    add_scaled(scale(b[0], f[0]), b[1], f[1])
}

impl TriangleMembrane {
    /// The element that is at rest at `rest` times `scale_of_rest` (1 for cloth as cut), of a thickness `[m]`; `None`
    /// where the triangle has no area.
    pub fn new(
        rest: &[Vec3; 3],
        thickness: f64,
        young_modulus: f64,
        poisson_ratio: f64,
        scale_of_rest: f64,
    ) -> Option<TriangleMembrane> {
        let (p, q) = (sub(rest[1], rest[0]), sub(rest[2], rest[0]));
        let along = unit(p)?;
        let normal = unit(cross(p, q))?;
        let (a, b, h) = (norm(p), dot(q, along), dot(q, cross(normal, along)));
        // Columns of the inverse of [[a, b], [0, h]], times the inverse scale of the rest shape.
        let s = 1.0 / scale_of_rest;
        let (b1, b2) = ([s / a, -s * b / (a * h)], [0.0, s / h]);
        let volume = 0.5 * a * h * thickness * scale_of_rest * scale_of_rest;
        let finite = [volume, b1[0], b1[1], b2[1]].iter().all(|x| x.is_finite());
        if !(finite && volume > 0.0) {
            return None;
        }
        let mu = young_modulus / (2.0 * (1.0 + poisson_ratio));
        let lambda = young_modulus * poisson_ratio / (1.0 - poisson_ratio * poisson_ratio);
        let b0 = [-b1[0] - b2[0], -b1[1] - b2[1]];
        Some(TriangleMembrane { volume, gradients: [b0, b1, b2], lambda, mu })
    }

    fn gradient(&self, x: &[Vec3; 3]) -> [Vec3; 2] {
        let (p, q) = (sub(x[1], x[0]), sub(x[2], x[0]));
        let [_, b1, b2] = self.gradients;
        [add_scaled(scale(b1[0], p), b2[0], q), add_scaled(scale(b1[1], p), b2[1], q)]
    }

    fn deformation(&self, x: &[Vec3; 3]) -> Deformation {
        let f = self.gradient(x);
        // Eigenvectors of F^T F, by the angle of its larger axis.
        let (a, b, c) = (norm_squared(f[0]), dot(f[0], f[1]), norm_squared(f[1]));
        let angle = 0.5 * (2.0 * b).atan2(a - c);
        let (sine, cosine) = angle.sin_cos();
        let v = [[cosine, sine], [-sine, cosine]];
        let images = v.map(|v| combine(&f, v));
        let u0 = unit(images[0]).unwrap_or([1.0, 0.0, 0.0]);
        let across = add_scaled(images[1], -dot(u0, images[1]), u0);
        let far = norm_squared(across) > DEGENERATE * DEGENERATE * norm_squared(images[0]);
        let u1 = unit(across).filter(|_| far).unwrap_or_else(|| tangents(u0).0);
        let sigma = [dot(u0, images[0]), dot(u1, images[1]).max(0.0)];
        Deformation { f, sigma, v, u: [u0, u1, cross(u0, u1)], dilation: sigma[0] + sigma[1] - 2.0 }
    }

    /// `R b`.
    fn turned(d: &Deformation, b: [f64; 2]) -> Vec3 {
        add_scaled(scale(dot2(d.v[0], b), d.u[0]), dot2(d.v[1], b), d.u[1])
    }

    /// What the derivative of R takes off the curvature 2 mu of a mode with this length.
    fn softening(&self, d: &Deformation, form: HessianForm, length: f64) -> f64 {
        let softening = (2.0 * self.mu - self.lambda * d.dilation) / length;
        match form {
            HessianForm::Exact => softening,
            HessianForm::Projected if length > 0.0 => softening.min(2.0 * self.mu),
            HessianForm::Projected => 2.0 * self.mu,
        }
    }
}

impl Stencil<3> for TriangleMembrane {
    fn energy(&self, x: &[Vec3; 3]) -> f64 {
        let d = self.deformation(x);
        let strain: f64 = d.sigma.iter().map(|s| (s - 1.0) * (s - 1.0)).sum();
        self.volume * (self.mu * strain + 0.5 * self.lambda * d.dilation * d.dilation)
    }

    fn force(&self, x: &[Vec3; 3]) -> [Vec3; 3] {
        let d = self.deformation(x);
        self.gradients.map(|b| {
            let stress = scale(2.0 * self.mu, combine(&d.f, b));
            let turned = TriangleMembrane::turned(&d, b);
            scale(-self.volume, add_scaled(stress, self.lambda * d.dilation - 2.0 * self.mu, turned))
        })
    }

    /// Exact: the derivative of R included. Projected: the twist in the plane and the two motions out of it, the only
    /// modes that can be negative, are cut at zero.
    fn hessian(&self, x: &[Vec3; 3], form: HessianForm) -> Blocks<3> {
        let d = self.deformation(x);
        let turned = self.gradients.map(|b| TriangleMembrane::turned(&d, b));
        let twist = self.softening(&d, form, 0.5 * (d.sigma[0] + d.sigma[1]));
        let out = d.sigma.map(|s| self.softening(&d, form, s));
        let twisted = self.gradients.map(|b| add_scaled(scale(dot2(d.v[0], b), d.u[1]), -dot2(d.v[1], b), d.u[0]));
        let mut blocks = zero_blocks::<3>();
        for i in 0..3 {
            for j in 0..=i {
                let (bi, bj) = (self.gradients[i], self.gradients[j]);
                let mut block = mat_scale(2.0 * self.mu * dot2(bi, bj), &IDENTITY);
                block = mat_add(&block, &outer(scale(self.lambda, turned[i]), turned[j]));
                block = mat_add(&block, &outer(scale(-0.5 * twist, twisted[i]), twisted[j]));
                let normal: f64 = (0..2).map(|k| out[k] * dot2(d.v[k], bi) * dot2(d.v[k], bj)).sum();
                block = mat_add(&block, &outer(scale(-normal, d.u[2]), d.u[2]));
                blocks[i][j] = mat_scale(self.volume, &block);
                blocks[j][i] = transpose(&blocks[i][j]);
            }
        }
        blocks
    }

    #[inline(always)]
    fn side_by_side(four: [&Self; LANES], x: &[Point<LANES>; 3], stiff: f64, viscous: f64) -> SideBySide<3> {
        super::wide_shell::membranes(four, x, (stiff, viscous))
    }

    /// Kelvin-Voigt: the elastic tensor on the rate of Green's strain, `sym(F^T dF/dt)`, bounded in large stretch.
    fn viscosity(&self, x: &[Vec3; 3]) -> Blocks<3> {
        let f = self.gradient(x);
        let volume = self.volume / excess_stretch(norm_squared(f[0]) + norm_squared(f[1]), 2.0);
        let spread: Mat3 = mat_add(&outer(f[0], f[0]), &outer(f[1], f[1]));
        let carried = self.gradients.map(|b| combine(&f, b));
        let mut blocks = zero_blocks::<3>();
        for i in 0..3 {
            for j in 0..3 {
                let along = mat_scale(self.mu * dot2(self.gradients[i], self.gradients[j]), &spread);
                let crossed = outer(scale(self.mu, carried[j]), carried[i]);
                let dilation = outer(scale(self.lambda, carried[i]), carried[j]);
                blocks[i][j] = mat_scale(volume, &mat_add(&mat_add(&along, &crossed), &dilation));
            }
        }
        blocks
    }
}
