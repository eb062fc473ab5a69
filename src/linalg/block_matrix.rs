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

    /// A matrix of zeros whose pattern holds the diagonal and the given places, which hold the mirror of each.
    ///
    /// Cost: a sort of the pairs.
    pub fn from_places(rows: usize, mut places: Vec<(u32, u32)>) -> BlockMatrix {
        let mut matrix = BlockMatrix::default();
        matrix.assign_places(rows, &mut places);
        matrix
    }

    /// Makes this the matrix of [`BlockMatrix::from_places`], in the memory that it has; leaves the places of its pattern.
    pub fn assign_places(&mut self, rows: usize, places: &mut Vec<(u32, u32)>) {
        places.extend((0..rows as u32).map(|i| (i, i)));
        places.sort_unstable();
        places.dedup();
        self.row_offsets.clear();
        self.row_offsets.resize(rows + 1, 0);
        self.columns.clear();
        self.diagonal.clear();
        for (row, column) in places {
            if row == column {
                self.diagonal.push(self.columns.len());
            }
            self.columns.push(*column);
            self.row_offsets[*row as usize + 1] = self.columns.len();
        }
        self.values.clear();
        self.values.resize(self.columns.len(), [[0.0; 3]; 3]);
    }

    /// Where block `(row, column)`, which the pattern holds, stands in `values`. Cost: logarithmic in the row.
    #[inline]
    pub fn place(&self, row: u32, column: u32) -> usize {
        let start = self.row_offsets[row as usize];
        let columns = &self.columns[start..self.row_offsets[row as usize + 1]];
        start + columns.partition_point(|c| *c < column)
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
