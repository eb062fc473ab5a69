//! What every energy of a few nodes has in common.

use super::side_by_side::{LANES, SideBySide};
use crate::math::simd::points::Point;
use crate::math::{Mat3, Vec3, ZERO_MATRIX, dot};

/// Blocks of a matrix over the nodes of a stencil.
pub type Blocks<const N: usize> = [[Mat3; N]; N];

/// Which second derivative is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HessianForm {
    /// The second derivative itself, which may be indefinite.
    Exact,
    /// A positive semi-definite stand-in, the same where the energy is convex: each energy says which.
    Projected,
}

/// An energy of `N` nodes at positions `x` `[m]`.
pub trait Stencil<const N: usize> {
    /// Energy `[J]`.
    fn energy(&self, x: &[Vec3; N]) -> f64;

    /// `-dE/dx` `[N]`.
    fn force(&self, x: &[Vec3; N]) -> [Vec3; N];

    /// `d^2 E/dx^2` `[N/m]`, symmetric.
    fn hessian(&self, x: &[Vec3; N], form: HessianForm) -> Blocks<N>;

    /// `V` of the internal damping force `-tau V v`, `[N/m]`: positive semi-definite, zero for every rigid motion of the
    /// nodes, and the Hessian itself at rest.
    fn viscosity(&self, x: &[Vec3; N]) -> Blocks<N>;

    /// Forces, and `stiff` times the projected Hessian plus `viscous` times V, of four elements side by side: what the
    /// assembly of a step asks for. The same as element by element up to rounding.
    #[inline(always)]
    fn side_by_side(four: [&Self; LANES], x: &[Point<LANES>; N], stiff: f64, viscous: f64) -> SideBySide<N>
    where
        Self: Sized,
    {
        SideBySide::one_by_one(four, x, (stiff, viscous))
    }

    /// An upper bound of the largest eigenvalue of the projected Hessian at `x` `[N/m]`: with the smallest nodal mass `m`,
    /// explicit integration of this energy alone is stable for steps below `2 sqrt(m / bound)`.
    ///
    /// By Gershgorin's circles over the blocks, unless an energy knows better.
    fn stiffness_bound(&self, x: &[Vec3; N]) -> f64 {
        let blocks = self.hessian(x, HessianForm::Projected);
        blocks.iter().map(|row| row.iter().map(frobenius).sum()).fold(0.0, f64::max)
    }
}

/// Frobenius norm.
fn frobenius(m: &Mat3) -> f64 {
    m.iter().map(|row| dot(*row, *row)).sum::<f64>().sqrt()
}

/// Blocks of zeros.
pub(super) fn zero_blocks<const N: usize>() -> Blocks<N> {
    [[ZERO_MATRIX; N]; N]
}
