//! Forces and matrices of four elements at a time, lane by lane: what the assembly of a step asks of every energy.

use super::stencil::{HessianForm, Stencil};
use crate::math::Vec3;
use crate::math::simd::Lanes;
use crate::math::simd::points::{Point, add, dot, scale, sub};

/// Elements taken at a time.
pub const LANES: usize = 4;

/// A number for each of the elements.
pub(super) type Number = Lanes<LANES>;

/// A vector for each of the elements.
pub(super) type Vector = Point<LANES>;

/// A 3x3 matrix for each of the elements, by rows.
pub type Block = [Vector; 3];

/// Forces, and the blocks of `stiff H + viscous V` with row not below column; those above hold nothing.
#[derive(Clone, Copy)]
pub struct SideBySide<const N: usize> {
    /// `-dE/dx` `[N]`
    pub forces: [Vector; N],
    /// Blocks by row and column.
    pub blocks: [[Block; N]; N],
}

pub(super) const ZERO: Vector = [Lanes([0.0; LANES]); 3];

impl<const N: usize> SideBySide<N> {
    /// Nothing yet.
    pub(super) const EMPTY: SideBySide<N> = SideBySide { forces: [ZERO; N], blocks: [[[ZERO; 3]; N]; N] };

    /// Element by element.
    pub(super) fn one_by_one<S: Stencil<N>>(four: [&S; LANES], x: &[Vector; N], factors: (f64, f64)) -> SideBySide<N> {
        let mut out = SideBySide::EMPTY;
        for lane in 0..LANES {
            let corners: [Vec3; N] = x.map(|p| p.map(|c| c.0[lane]));
            let force = four[lane].force(&corners);
            let hessian = four[lane].hessian(&corners, HessianForm::Projected);
            let viscosity = (factors.1 > 0.0).then(|| four[lane].viscosity(&corners));
            for a in 0..N {
                (0..3).for_each(|c| out.forces[a][c].0[lane] = force[a][c]);
                for (b, r, c) in (0..=a).flat_map(|b| (0..9).map(move |k| (b, k / 3, k % 3))) {
                    let damping = viscosity.as_ref().map_or(0.0, |v| factors.1 * v[a][b][r][c]);
                    out.blocks[a][b][r][c].0[lane] = factors.0 * hessian[a][b][r][c] + damping;
                }
            }
        }
        out
    }

    /// Fills the first row and column from the others: an energy that does not feel a translation of all nodes. Blocks
    /// below and on the diagonal of the others must be there, the last `N - 1` forces too.
    #[inline(always)]
    pub(super) fn complete(&mut self) {
        let mut corner = [ZERO; 3];
        for i in 1..N {
            self.forces[0] = sub(&self.forces[0], &self.forces[i]);
            let mut sum = [ZERO; 3];
            for j in 1..N {
                for r in 0..3 {
                    for c in 0..3 {
                        let value = if j <= i { self.blocks[i][j][r][c] } else { self.blocks[j][i][c][r] };
                        sum[r][c] = sum[r][c] + value;
                    }
                }
            }
            for r in 0..3 {
                self.blocks[i][0][r] = sum[r].map(|v| v.negate());
                corner[r] = add(&corner[r], &sum[r]);
            }
        }
        self.blocks[0][0] = corner;
    }
}

/// A material number of the four elements.
#[inline(always)]
pub(super) fn gather<S>(four: [&S; LANES], number: impl Fn(&S) -> f64) -> Number {
    Lanes(four.map(number))
}

/// `m += s a b^T`
#[inline(always)]
pub(super) fn add_outer(m: &mut Block, s: Number, a: &Vector, b: &Vector) {
    for r in 0..3 {
        let factor = s * a[r];
        for c in 0..3 {
            m[r][c] = m[r][c] + factor * b[c];
        }
    }
}

/// `s` times the identity.
#[inline(always)]
pub(super) fn diagonal(s: Number) -> Block {
    let zero = Lanes::splat(0.0);
    [[s, zero, zero], [zero, s, zero], [zero, zero, s]]
}

/// `a / |a|`, `other` where the length is zero.
#[inline(always)]
pub(super) fn unit_or(a: &Vector, other: &Vector) -> Vector {
    let squared = dot(a, a);
    let unit = scale(Lanes::splat(1.0) / squared.sqrt(), a);
    crate::math::simd::points::if_positive(squared, &unit, other)
}

/// `a - (n · a) n`
#[inline(always)]
pub(super) fn across(n: &Vector, a: &Vector) -> Vector {
    sub(a, &scale(dot(n, a), n))
}

/// The softening of a mode: `softening` where `length` is positive, at most `most`; else `most`.
#[inline(always)]
pub(super) fn projected(numerator: Number, length: Number, most: Number) -> Number {
    length.if_positive((numerator / length).min(most), most)
}
