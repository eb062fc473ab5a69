//! A block matrix rounded to f32, for products with *increments*: half the memory traffic of the f64 product, and an
//! error relative to the increment, not to the solution.

use super::BlockMatrix;
use crate::math::Vec3;
use crate::parallel::Par;

/// Three lanes and one of padding, so that four-lane registers apply without any special instruction set.
type Lanes = [f32; 4];

/// A rounded copy of a block matrix: blocks by columns.
#[derive(Clone, Debug, Default)]
pub struct SinglePrecision {
    row_offsets: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<[Lanes; 3]>,
    /// Power of two that brings the largest entry near 1, so that no unit of mass leaves the range of f32.
    scale: f64,
}

/// A rounded vector and the power of two that it was divided by.
#[derive(Clone, Debug, Default)]
pub struct Rounded {
    lanes: Vec<Lanes>,
    scale: f64,
}

/// The power of two below `x`, or 1 for zero and what is not finite.
fn power_of_two(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() && x.is_normal() { f64::from_bits(x.to_bits() & 0x7FF0_0000_0000_0000) } else { 1.0 }
}

fn largest(v: &Vec3) -> f64 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

impl SinglePrecision {
    /// Rounds `matrix`. Cost: one pass over the blocks.
    pub fn new(matrix: &BlockMatrix, par: Par) -> SinglePrecision {
        let scale = power_of_two(
            matrix
                .diagonal
                .iter()
                .map(|d| matrix.values[*d].iter().map(largest).fold(0.0, f64::max))
                .fold(0.0, f64::max),
        );
        let r = 1.0 / scale;
        let values = par.map_indexed(matrix.values.len(), |k| {
            let m = &matrix.values[k];
            let column = |c: usize| [(r * m[0][c]) as f32, (r * m[1][c]) as f32, (r * m[2][c]) as f32, 0.0];
            [column(0), column(1), column(2)]
        });
        let row_offsets = matrix.row_offsets.iter().map(|o| *o as u32).collect();
        SinglePrecision { row_offsets, columns: matrix.columns.clone(), values, scale }
    }

    /// Rounds the vector `f`, relative to its largest entry: increments may be far below the range of f32.
    pub fn round(&self, count: usize, f: impl Fn(usize) -> Vec3 + Sync, par: Par) -> Rounded {
        // The largest of a thousand is found block by block; maxima do not depend on order.
        let v = par.map_indexed(count, f);
        let scale = power_of_two(v.iter().map(largest).fold(0.0, f64::max));
        let r = 1.0 / scale;
        let lanes = v.iter().map(|v| [(r * v[0]) as f32, (r * v[1]) as f32, (r * v[2]) as f32, 0.0]).collect();
        Rounded { lanes, scale }
    }

    /// Row `i` of `A x`.
    #[inline]
    pub fn row_product(&self, i: usize, x: &Rounded) -> Vec3 {
        let mut sums = [0.0f32; 4];
        let range = self.row_offsets[i] as usize..self.row_offsets[i + 1] as usize;
        for (column, m) in self.columns[range.clone()].iter().zip(&self.values[range]) {
            let x = &x.lanes[*column as usize];
            for lane in 0..4 {
                sums[lane] += (m[0][lane] * x[0] + m[1][lane] * x[1]) + m[2][lane] * x[2];
            }
        }
        let s = self.scale * x.scale;
        [s * f64::from(sums[0]), s * f64::from(sums[1]), s * f64::from(sums[2])]
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
            let single = SinglePrecision::new(&matrix, Par::Serial);
            let rounded = single.round(x.len(), |i| x[i], Par::Serial);
            for (i, x) in x.iter().enumerate() {
                let (a, b) = (single.row_product(i, &rounded), mat_vec(&matrix.values[i], *x));
                assert!(largest(&sub(a, b)) <= 1e-6 * largest(&b), "{a:?} {b:?}");
            }
        }
    }
}
