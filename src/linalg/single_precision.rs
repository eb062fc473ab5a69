//! A block matrix rounded to f32, for products with *increments*: half the memory traffic of the f64 product, and an
//! error relative to the increment, not to the solution.

use super::BlockMatrix;
use crate::math::Vec3;
use crate::math::quad::{self, Quad};
use crate::parallel::Par;

/// A rounded copy of a block matrix: blocks by columns.
#[derive(Clone, Debug, Default)]
pub struct SinglePrecision {
    row_offsets: Vec<u32>,
    columns: Vec<u32>,
    diagonal: Vec<u32>,
    /// Nine entries a block, by columns, and three of padding at the end: a column is read with the number behind it.
    values: Vec<f32>,
    /// Power of two that brings the largest entry near 1, so that no unit of mass leaves the range of f32.
    scale: f64,
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

fn largest(v: &Vec3) -> f64 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

impl SinglePrecision {
    /// Rounds `matrix`. Cost: one pass over the blocks.
    pub fn new(matrix: &BlockMatrix) -> SinglePrecision {
        let scale = power_of_two(
            matrix
                .diagonal
                .iter()
                .map(|d| matrix.values[*d].iter().map(largest).fold(0.0, f64::max))
                .fold(0.0, f64::max),
        );
        let r = 1.0 / scale;
        let mut values = vec![0.0; 9 * matrix.values.len() + 3];
        for (out, m) in values.chunks_exact_mut(9).zip(&matrix.values) {
            for (i, entry) in out.iter_mut().enumerate() {
                *entry = (r * m[i % 3][i / 3]) as f32;
            }
        }
        let row_offsets = matrix.row_offsets.iter().map(|o| *o as u32).collect();
        let diagonal = matrix.diagonal.iter().map(|d| *d as u32).collect();
        SinglePrecision { row_offsets, columns: matrix.columns.clone(), diagonal, values, scale }
    }

    /// Rounds the vector `f`, relative to its largest entry: increments may be far below the range of f32.
    pub fn round(&self, count: usize, f: impl Fn(usize) -> Vec3 + Sync, par: Par) -> Rounded {
        // The largest of a thousand is found block by block; maxima do not depend on order.
        let v = par.map_indexed(count, f);
        let scale = power_of_two(v.iter().map(largest).fold(0.0, f64::max));
        let r = 1.0 / scale;
        let lanes = v.iter().map(|v| quad::round(*v, r)).collect();
        Rounded { lanes, scale }
    }

    /// Row `i` of `A x`.
    #[inline]
    pub fn row_product(&self, i: usize, x: &Rounded) -> Vec3 {
        let sums = self.rounded_row_product(i, &x.lanes);
        let s = self.scale * x.scale;
        [s * f64::from(sums[0]), s * f64::from(sums[1]), s * f64::from(sums[2])]
    }

    /// Row `i` of `A x` in units of [`Self::unit`].
    #[inline(always)]
    pub fn rounded_row_product(&self, i: usize, x: &[Quad]) -> Quad {
        let mut sums = Quad::default();
        let range = self.row_offsets[i] as usize..self.row_offsets[i + 1] as usize;
        let values = &self.values[9 * range.start..9 * range.end + 3];
        for (k, column) in self.columns[range].iter().enumerate() {
            sums = quad::add(sums, quad::combine(&block(values, k), x[*column as usize]));
        }
        sums[3] = 0.0;
        sums
    }

    /// `D x` for the diagonal block D of row `i`, in units of [`Self::unit`].
    #[inline(always)]
    pub fn diagonal_product(&self, i: usize, x: Quad) -> Quad {
        let mut y = quad::combine(&block(&self.values, self.diagonal[i] as usize), x);
        y[3] = 0.0;
        y
    }

    /// The mass, a power of two, that the rounded entries are relative to.
    pub fn unit(&self) -> f64 {
        self.scale
    }
}

/// Columns of block `k`; their fourth lanes are not zero.
#[inline(always)]
fn block(values: &[f32], k: usize) -> [Quad; 3] {
    let v = &values[9 * k..9 * k + 12];
    [[v[0], v[1], v[2], v[3]], [v[3], v[4], v[5], v[6]], [v[6], v[7], v[8], v[9]]]
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
