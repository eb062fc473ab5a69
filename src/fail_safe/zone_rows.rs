//! Gradients of a zone's collisions, in coordinates in which the metric of the lumped masses is the identity.

use crate::constraint::{Metric, RowSet};
use crate::math::{Mat3, Vec3, add_scaled, cross, dot, mat_transpose_vec, mat_vec, scale, symmetric_eigenvectors};

/// A sparse matrix `A = S J L` over the blocks that a zone moves: J the gradients along given directions, `L L^T` the
/// inverse masses, S what makes every row a unit vector. With `dv = L y`, `|y|²` is twice the kinetic energy of `dv`.
#[derive(Clone, Debug, Default)]
pub(super) struct ZoneRows {
    offsets: Vec<usize>,
    columns: Vec<usize>,
    entries: Vec<Vec3>,
    /// S: the inverse length of each row; zero where a gradient vanishes.
    pub scales: Vec<f64>,
    /// Number of blocks.
    pub width: usize,
}

/// The blocks that a zone moves, and the factors L of their inverse masses.
#[derive(Clone, Debug, Default)]
pub(super) struct ZoneBlocks {
    /// Blocks of the model, ascending.
    pub blocks: Vec<usize>,
    factors: Vec<Mat3>,
}

impl ZoneBlocks {
    /// The blocks that some rows touch.
    pub fn new(rows: &RowSet, of: &[usize], metric: &Metric) -> ZoneBlocks {
        let mut blocks = Vec::new();
        for row in of {
            blocks.extend(rows.blocks[linear(rows, *row)].iter().map(|b| *b as usize));
            blocks.extend(rows.angular[angular(rows, *row)].iter().map(|a| a.block as usize));
        }
        blocks.sort_unstable();
        blocks.dedup();
        let factors = blocks.iter().map(|b| inverse_factor(&metric.lumped[*b])).collect();
        ZoneBlocks { blocks, factors }
    }

    /// Adds `L y` to the velocities of the model.
    pub fn add_to(&self, y: &[Vec3], velocities: &mut [Vec3]) {
        for ((block, factor), y) in self.blocks.iter().zip(&self.factors).zip(y) {
            velocities[*block] = add_scaled(velocities[*block], 1.0, mat_vec(factor, *y));
        }
    }
}

fn linear(rows: &RowSet, row: usize) -> std::ops::Range<usize> {
    rows.offsets[row] as usize..rows.offsets[row + 1] as usize
}

fn angular(rows: &RowSet, row: usize) -> std::ops::Range<usize> {
    rows.angular_offsets[row] as usize..rows.angular_offsets[row + 1] as usize
}

/// L with `L L^T` the inverse of a mass or inertia.
fn inverse_factor(mass: &Mat3) -> Mat3 {
    let (values, vectors) = symmetric_eigenvectors(mass);
    // Columns of the eigenvectors, each divided by the root of its eigenvalue; rounding leaves none at zero.
    let least = f64::EPSILON * values[0];
    std::array::from_fn(|i| std::array::from_fn(|j| vectors[i][j] / values[j].max(least).sqrt()))
}

impl ZoneRows {
    /// One row per given row of `rows` and per axis of its frame: the normal, or normal and tangents.
    pub fn new(rows: &RowSet, of: &[usize], axes: std::ops::Range<usize>, blocks: &ZoneBlocks) -> ZoneRows {
        let mut out = ZoneRows { offsets: vec![0], width: blocks.blocks.len(), ..ZoneRows::default() };
        for row in of {
            for axis in axes.clone() {
                let direction = rows.frames[*row][axis];
                let first = out.entries.len();
                for k in linear(rows, *row) {
                    out.push(blocks, rows.blocks[k] as usize, scale(rows.weights[k], direction));
                }
                for a in &rows.angular[angular(rows, *row)] {
                    out.push(blocks, a.block as usize, cross(a.lever, direction));
                }
                let length = out.entries[first..].iter().map(|e| dot(*e, *e)).sum::<f64>().sqrt();
                let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
                out.entries[first..].iter_mut().for_each(|e| *e = scale(inverse, *e));
                out.scales.push(inverse);
                out.offsets.push(out.entries.len());
            }
        }
        out
    }

    fn push(&mut self, blocks: &ZoneBlocks, block: usize, gradient: Vec3) {
        if let Ok(column) = blocks.blocks.binary_search(&block) {
            self.columns.push(column);
            self.entries.push(mat_transpose_vec(&blocks.factors[column], gradient));
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.scales.len()
    }

    /// `(A y)_i`
    #[inline]
    pub fn product(&self, i: usize, y: &[Vec3]) -> f64 {
        (self.offsets[i]..self.offsets[i + 1]).map(|k| dot(self.entries[k], y[self.columns[k]])).sum()
    }

    /// Columns and entries of a row.
    #[inline]
    pub fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (usize, Vec3)> + '_ {
        (self.offsets[i]..self.offsets[i + 1]).map(|k| (self.columns[k], self.entries[k]))
    }

    /// Number of entries of all rows.
    pub fn entry_count(&self) -> usize {
        self.entries.len()
    }

    /// `y += factor A_i`
    #[inline]
    pub fn add_row(&self, i: usize, factor: f64, y: &mut [Vec3]) {
        for k in self.offsets[i]..self.offsets[i + 1] {
            let column = self.columns[k];
            y[column] = add_scaled(y[column], factor, self.entries[k]);
        }
    }

    /// `A^T lambda`
    pub fn transposed_product(&self, lambda: &[f64]) -> Vec<Vec3> {
        let mut y = vec![[0.0; 3]; self.width];
        for (i, l) in lambda.iter().enumerate().filter(|(_, l)| **l != 0.0) {
            self.add_row(i, *l, &mut y);
        }
        y
    }

    /// `A_i · A_j`
    pub fn inner_product(&self, i: usize, j: usize) -> f64 {
        let mut sum = 0.0;
        for k in self.offsets[i]..self.offsets[i + 1] {
            for l in self.offsets[j]..self.offsets[j + 1] {
                if self.columns[k] == self.columns[l] {
                    sum += dot(self.entries[k], self.entries[l]);
                }
            }
        }
        sum
    }
}

/// `sum y_b · z_b`
pub(super) fn inner(y: &[Vec3], z: &[Vec3]) -> f64 {
    y.iter().zip(z).map(|(a, b)| dot(*a, *b)).sum()
}
