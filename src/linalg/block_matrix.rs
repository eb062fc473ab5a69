//! 3x3 block-sparse matrices by rows.

use crate::math::{Mat3, Vec3, add, mat_vec};
use crate::parallel::Par;

/// A symmetric block matrix by rows: full rows, columns ascending, the diagonal block present in each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockMatrix {
    /// Start of each row in `columns` and `values`; one more entry than rows.
    pub row_offsets: Vec<usize>,
    /// Block columns.
    pub columns: Vec<u32>,
    /// Blocks.
    pub values: Vec<Mat3>,
    /// Position of each row's diagonal block in `values`.
    pub diagonal: Vec<usize>,
}

impl BlockMatrix {
    /// A block-diagonal matrix.
    pub fn from_diagonal(blocks: &[Mat3]) -> BlockMatrix {
        BlockMatrix {
            row_offsets: (0..=blocks.len()).collect(),
            columns: (0..blocks.len() as u32).collect(),
            values: blocks.to_vec(),
            diagonal: (0..blocks.len()).collect(),
        }
    }

    /// Number of block rows.
    pub fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// Diagonal block of row `i`.
    #[inline]
    pub fn diagonal_block(&self, i: usize) -> &Mat3 {
        &self.values[self.diagonal[i]]
    }

    /// Row `i` of `A x`.
    #[inline]
    pub fn row_product(&self, i: usize, x: &[Vec3]) -> Vec3 {
        let mut y = [0.0; 3];
        for k in self.row_offsets[i]..self.row_offsets[i + 1] {
            y = add(y, mat_vec(&self.values[k], x[self.columns[k] as usize]));
        }
        y
    }

    /// `out = A x`. Cost: one pass over the blocks.
    pub fn product(&self, x: &[Vec3], out: &mut [Vec3], par: Par) {
        par.map_into(out, |i| self.row_product(i, x));
    }
}
