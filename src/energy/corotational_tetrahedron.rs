//! Co-rotational linear tetrahedra [Mueller04].

use super::damping::excess_stretch;
use super::side_by_side::{LANES, SideBySide};
use super::stencil::{Blocks, HessianForm, Stencil, zero_blocks};
use crate::math::simd::points::Point;
use crate::math::{
    IDENTITY, Mat3, SignedSingularValues, Vec3, add, add_scaled, dot, inverse, mat_add, mat_mul, mat_scale, mat_vec,
    outer, scale, sub, transpose,
};

/// `E = V (mu |F - R|^2 + lambda/2 tr(R^T F - I)^2)` with the rotation R closest to the deformation gradient F: linear
/// elasticity in the turned frame, its force that of warped stiffness.
///
/// Finite for every configuration: flat and inverted elements have a rotation too, and are pushed back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorotationalTetrahedron {
    /// Rest volume `[m^3]`.
    pub(crate) volume: f64,
    /// `F = sum x_i b_i^T`: gradients of the shape functions at rest `[1/m]`.
    pub(crate) gradients: [Vec3; 4],
    /// Lamé's lambda `[Pa]`.
    pub(crate) lambda: f64,
    /// Lamé's mu `[Pa]`.
    pub(crate) mu: f64,
}

/// Lamé's lambda and mu of Young's modulus `[Pa]` and Poisson's ratio in `[0, 0.5)`.
pub fn lame(young_modulus: f64, poisson_ratio: f64) -> (f64, f64) {
    let mu = young_modulus / (2.0 * (1.0 + poisson_ratio));
    (2.0 * mu * poisson_ratio / (1.0 - 2.0 * poisson_ratio), mu)
}

/// Deformation gradient split into what its energy needs.
struct Deformation {
    f: Mat3,
    parts: SignedSingularValues,
    rotation: Mat3,
    /// `tr(S) - 3`
    dilation: f64,
}

impl CorotationalTetrahedron {
    /// The element that is at rest at `rest`; `None` where that has no positive volume.
    ///
    /// Orientation: vertex 3 on the side that the normal of face 0 1 2 points to.
    pub fn new(rest: &[Vec3; 4], young_modulus: f64, poisson_ratio: f64) -> Option<CorotationalTetrahedron> {
        let edges = transpose(&[sub(rest[1], rest[0]), sub(rest[2], rest[0]), sub(rest[3], rest[0])]);
        let volume = crate::math::determinant(&edges) / 6.0;
        if !(volume > 0.0 && volume.is_finite()) {
            return None;
        }
        let [b1, b2, b3] = inverse(&edges)?;
        let b0 = scale(-1.0, add(add(b1, b2), b3));
        let (lambda, mu) = lame(young_modulus, poisson_ratio);
        Some(CorotationalTetrahedron { volume, gradients: [b0, b1, b2, b3], lambda, mu })
    }

    /// Rest volume `[m^3]`.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    fn gradient(&self, x: &[Vec3; 4]) -> Mat3 {
        // From edges, so that far from the origin no digits are lost.
        (1..4).fold([[0.0; 3]; 3], |f, i| mat_add(&f, &outer(sub(x[i], x[0]), self.gradients[i])))
    }

    fn deformation(&self, x: &[Vec3; 4]) -> Deformation {
        let f = self.gradient(x);
        let parts = SignedSingularValues::new(&f);
        let [a, b, c] = parts.sigma;
        Deformation { f, parts, rotation: parts.rotation(), dilation: a + b + c - 3.0 }
    }

    /// For each twist mode (singular values i, j), what the rotation's derivative takes off the curvature 2 mu.
    fn twist_softening(&self, d: &Deformation, form: HessianForm, i: usize, j: usize) -> f64 {
        let sum = d.parts.sigma[i] + d.parts.sigma[j];
        let softening = (2.0 * self.mu - self.lambda * d.dilation) * 2.0 / sum;
        match form {
            HessianForm::Exact => softening,
            HessianForm::Projected if sum > 0.0 => softening.min(2.0 * self.mu),
            HessianForm::Projected => 2.0 * self.mu,
        }
    }
}

impl Stencil<4> for CorotationalTetrahedron {
    fn energy(&self, x: &[Vec3; 4]) -> f64 {
        let d = self.deformation(x);
        let strain: f64 = d.parts.sigma.iter().map(|s| (s - 1.0) * (s - 1.0)).sum();
        self.volume * (self.mu * strain + 0.5 * self.lambda * d.dilation * d.dilation)
    }

    fn force(&self, x: &[Vec3; 4]) -> [Vec3; 4] {
        let d = self.deformation(x);
        // First Piola-Kirchhoff stress 2 mu (F - R) + lambda tr(S - I) R.
        let turned = mat_scale(self.lambda * d.dilation - 2.0 * self.mu, &d.rotation);
        let stress = mat_add(&mat_scale(2.0 * self.mu, &d.f), &turned);
        self.gradients.map(|b| scale(-self.volume, mat_vec(&stress, b)))
    }

    /// Exact: the derivative of the rotation included; undefined where two singular values cancel (inverted far).
    /// Projected: the three twist modes, the only ones that can be negative, are cut at zero [Smith19, twist modes].
    fn hessian(&self, x: &[Vec3; 4], form: HessianForm) -> Blocks<4> {
        let d = self.deformation(x);
        let (u, v) = (transpose(&d.parts.u), transpose(&d.parts.v));
        let turned = self.gradients.map(|b| mat_vec(&d.rotation, b));
        let mut blocks = zero_blocks::<4>();
        let mut twists = [(0.0, [[0.0; 3]; 4]); 3];
        for (k, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            // T b with the unit matrix T = (u_j v_i^T - u_i v_j^T)/sqrt(2).
            let images = self.gradients.map(|b| add_scaled(scale(dot(v[i], b), u[j]), -dot(v[j], b), u[i]));
            twists[k] = (0.5 * self.twist_softening(&d, form, i, j), images);
        }
        for i in 0..4 {
            for j in 0..=i {
                let along = 2.0 * self.mu * dot(self.gradients[i], self.gradients[j]);
                let mut block = mat_scale(along, &IDENTITY);
                block = mat_add(&block, &outer(scale(self.lambda, turned[i]), turned[j]));
                for (softening, t) in &twists {
                    block = mat_add(&block, &outer(scale(-softening, t[i]), t[j]));
                }
                blocks[i][j] = mat_scale(self.volume, &block);
                blocks[j][i] = transpose(&blocks[i][j]);
            }
        }
        blocks
    }

    #[inline(always)]
    fn side_by_side(four: [&Self; LANES], x: &[Point<LANES>; 4], stiff: f64, viscous: f64) -> SideBySide<4> {
        super::wide_tetrahedron::evaluate(four, x, (stiff, viscous))
    }

    /// Kelvin-Voigt: the elastic tensor on the rate of Green's strain, `sym(F^T dF/dt)`.
    fn viscosity(&self, x: &[Vec3; 4]) -> Blocks<4> {
        let f = self.gradient(x);
        let spread = mat_mul(&f, &transpose(&f));
        let volume = self.volume / excess_stretch((0..3).map(|k| spread[k][k]).sum(), 3.0);
        let carried = self.gradients.map(|b| mat_vec(&f, b));
        let mut blocks = zero_blocks::<4>();
        for i in 0..4 {
            for j in 0..4 {
                let along = mat_scale(self.mu * dot(self.gradients[i], self.gradients[j]), &spread);
                let crossed = outer(scale(self.mu, carried[j]), carried[i]);
                let dilation = outer(scale(self.lambda, carried[i]), carried[j]);
                blocks[i][j] = mat_scale(volume, &mat_add(&mat_add(&along, &crossed), &dilation));
            }
        }
        blocks
    }
}
