//! A block matrix rounded to f32, for products with *increments*: half the memory traffic of the f64 product, and an
//! error relative to the increment, not to the solution.

use super::BlockMatrix;
use crate::math::simd::{Kernel, Quad, Width, packed_row, run_wide};
use crate::math::{Mat3, Vec3};
use crate::parallel::Par;

/// A rounded copy of a block matrix: blocks by columns.
#[derive(Clone, Debug, Default)]
pub struct SinglePrecision {
    row_offsets: Vec<u32>,
    columns: Vec<u32>,
    diagonal: Vec<u32>,
    /// Blocks by columns.
    values: Vec<[f32; 9]>,
    /// [`unit_of`], so that no unit of mass leaves the range of f32.
    scale: f64,
    width: Width,
}

/// A rounded vector and the power of two that it was divided by.
#[derive(Clone, Debug, Default)]
pub struct Rounded {
    lanes: Vec<Quad>,
    scale: f64,
}

/// The power of two below `x`, or 1 for zero and what is not finite.
pub fn power_of_two(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() && x.is_normal() { f64::from_bits(x.to_bits() & 0x7FF0_0000_0000_0000) } else { 1.0 }
}

/// The power of two that brings the largest entry of the diagonal blocks near 1.
pub(super) fn unit_of(matrix: &BlockMatrix) -> f64 {
    let of = |d: &usize| matrix.values[*d].iter().map(largest).fold(0.0, f64::max);
    power_of_two(matrix.diagonal.iter().map(of).fold(0.0, f64::max))
}

fn largest(v: &Vec3) -> f64 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

impl SinglePrecision {
    /// Rounds `matrix`. Cost: one pass over the blocks.
    pub fn new(matrix: &BlockMatrix) -> SinglePrecision {
        let mut out = SinglePrecision::default();
        out.assign(matrix);
        out
    }

    /// Rounds `matrix` into the memory of this one.
    pub fn assign(&mut self, matrix: &BlockMatrix) {
        self.scale = unit_of(matrix);
        self.width = Width::detect();
        self.row_offsets.clear();
        self.row_offsets.extend(matrix.row_offsets.iter().map(|o| *o as u32));
        self.diagonal.clear();
        self.diagonal.extend(matrix.diagonal.iter().map(|d| *d as u32));
        self.columns.clone_from(&matrix.columns);
        self.values.resize(matrix.values.len(), [0.0; 9]);
        run_wide(RoundBlocks { values: &mut self.values, blocks: &matrix.values, factor: 1.0 / self.scale });
    }

    /// Rounds the vector `f`, relative to its largest entry: increments may be far below the range of f32.
    pub fn round(&self, count: usize, f: impl Fn(usize) -> Vec3 + Sync, par: Par) -> Rounded {
        // The largest of a thousand is found block by block; maxima do not depend on order.
        let v = par.map_indexed(count, f);
        let scale = power_of_two(v.iter().map(largest).fold(0.0, f64::max));
        let r = 1.0 / scale;
        let lanes = v.iter().map(|v| Quad::round(*v, r)).collect();
        Rounded { lanes, scale }
    }

    /// Row `i` of `A x`.
    #[inline]
    pub fn row_product(&self, i: usize, x: &Rounded) -> Vec3 {
        let sums = self.rounded_row_product(i, &x.lanes);
        sums.widen(self.scale * x.scale)
    }

    /// Row `i` of `A x` in units of [`Self::unit`].
    #[inline(always)]
    pub fn rounded_row_product(&self, i: usize, x: &[Quad]) -> Quad {
        let range = self.row_offsets[i] as usize..self.row_offsets[i + 1] as usize;
        packed_row(self.width, &self.values[range.clone()], &self.columns[range], x).padded()
    }

    /// `D x` for the diagonal block D of row `i`, in units of [`Self::unit`].
    #[inline(always)]
    pub fn diagonal_product(&self, i: usize, x: Quad) -> Quad {
        Quad::combine_packed(&self.values[self.diagonal[i] as usize], x).padded()
    }

    /// The mass, a power of two, that the rounded entries are relative to.
    pub fn unit(&self) -> f64 {
        self.scale
    }
}

struct RoundBlocks<'a> {
    values: &'a mut [[f32; 9]],
    blocks: &'a [Mat3],
    factor: f64,
}

impl Kernel for RoundBlocks<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (out, m) in self.values.iter_mut().zip(self.blocks) {
            for (i, entry) in out.iter_mut().enumerate() {
                *entry = (self.factor * m[i % 3][i / 3]) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{mat_vec, sub};

    #[test]
    fn products_agree_with_double_precision_to_single_precision_at_any_scale() {
        for (mass, velocity) in [(1.0, 1.0), (1e-60, 1e50), (1e200, 1e-200)] {
            let mut matrix =
                BlockMatrix::from_diagonal(&[[[mass, 0.0, 0.0], [0.0, 2.0 * mass, 0.0], [0.0, 0.1 * mass, mass]]; 5]);
            matrix.values[3][0][2] = 0.7 * mass;
            let x: Vec<Vec3> = (0..5).map(|i| [velocity, -0.3 * velocity * f64::from(i), 0.1 * velocity]).collect();
            let single = SinglePrecision::new(&matrix);
            let rounded = single.round(x.len(), |i| x[i], Par::Serial);
            for (i, x) in x.iter().enumerate() {
                let (a, b) = (single.row_product(i, &rounded), mat_vec(&matrix.values[i], *x));
                assert!(largest(&sub(a, b)) <= 1e-6 * largest(&b), "{a:?} {b:?}");
            }
        }
    }
}
