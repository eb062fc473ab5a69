//! Newton systems of the augmented Lagrangian, `(A + C^T E C) x = b`, factored where that is cheap: few blocks, as of a
//! stack of rigid bodies, or many that hang together in a narrow band.

use crate::constraint::RowSet;
use crate::linalg::{BlockMatrix, Envelope, EnvelopeCholesky};
use crate::math::{Mat3, Vec3, mat_add, mat_mul, transpose};

use super::problem::ContactProblem;

/// Block products of a factorisation beyond which conjugate gradients are cheaper: about ten milliseconds.
const WORK_MAX: usize = 200_000;

/// A system with its pattern, and the places of what contacts add to it.
pub(super) struct DirectNewton {
    matrix: BlockMatrix,
    /// `A` in the pattern of `matrix`.
    bare: Vec<Mat3>,
    envelope: Envelope,
    fixed: Vec<bool>,
    /// Start of each row's entries in `entries`; one more than rows.
    offsets: Vec<usize>,
    /// Block, and the map from its velocity to the relative velocity of the contact.
    entries: Vec<(u32, Mat3)>,
}

impl DirectNewton {
    /// The pattern over all contacts; `None` where a factor would cost more than it saves. Cost: a sort of the blocks that
    /// contacts join.
    pub fn new(problem: &ContactProblem) -> Option<DirectNewton> {
        let (a, rows) = (problem.matrix, problem.rows);
        let (offsets, entries) = entries_of(rows);
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for row in 0..a.rows() {
            let columns = &a.columns[a.row_offsets[row]..a.row_offsets[row + 1]];
            pairs.extend(columns.iter().map(|column| (row as u32, *column)));
        }
        for range in offsets.windows(2) {
            let own = &entries[range[0]..range[1]];
            pairs.extend(own.iter().flat_map(|(b, _)| own.iter().map(move |(c, _)| (*b, *c))));
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut matrix = BlockMatrix { row_offsets: vec![0; a.rows() + 1], ..BlockMatrix::default() };
        for (row, column) in &pairs {
            if row == column {
                matrix.diagonal.push(matrix.columns.len());
            }
            matrix.columns.push(*column);
            matrix.row_offsets[*row as usize + 1] = matrix.columns.len();
        }
        let envelope = Envelope::new(&matrix);
        if envelope.work() > WORK_MAX {
            return None;
        }
        matrix.values = vec![[[0.0; 3]; 3]; matrix.columns.len()];
        for row in 0..a.rows() {
            for k in a.row_offsets[row]..a.row_offsets[row + 1] {
                let place = place(&matrix, row as u32, a.columns[k]);
                matrix.values[place] = a.values[k];
            }
        }
        let fixed = problem.inverse_diagonal.iter().map(|m| *m == [[0.0; 3]; 3]).collect();
        Some(DirectNewton { bare: matrix.values.clone(), matrix, envelope, fixed, offsets, entries })
    }

    /// `x := (A + C^T E C)^-1 x` with the world stiffness of each row of the row set; whether it is positive definite.
    pub fn solve(&mut self, stiffness: impl Fn(usize) -> Option<Mat3>, x: &mut [Vec3]) -> bool {
        self.matrix.values.copy_from_slice(&self.bare);
        for row in 0..self.offsets.len() - 1 {
            let Some(e) = stiffness(row) else { continue };
            let own = &self.entries[self.offsets[row]..self.offsets[row + 1]];
            for (b, to) in own {
                let pulled = mat_mul(&transpose(to), &e);
                for (c, from) in own {
                    let place = place(&self.matrix, *b, *c);
                    self.matrix.values[place] = mat_add(&self.matrix.values[place], &mat_mul(&pulled, from));
                }
            }
        }
        let Some(factor) = EnvelopeCholesky::new(&self.matrix, &self.envelope, &self.fixed) else { return false };
        for (x, fixed) in x.iter_mut().zip(&self.fixed) {
            if *fixed {
                *x = [0.0; 3];
            }
        }
        factor.solve(&self.envelope, x);
        true
    }
}

fn place(matrix: &BlockMatrix, row: u32, column: u32) -> usize {
    let start = matrix.row_offsets[row as usize];
    let columns = &matrix.columns[start..matrix.row_offsets[row as usize + 1]];
    start + columns.partition_point(|c| *c < column)
}

/// Entries of each row: `u = sum M_k v_k`.
fn entries_of(rows: &RowSet) -> (Vec<usize>, Vec<(u32, Mat3)>) {
    let mut offsets = vec![0];
    let mut entries = Vec::new();
    for i in 0..rows.len() {
        for k in rows.offsets[i] as usize..rows.offsets[i + 1] as usize {
            let w = rows.weights[k];
            entries.push((rows.blocks[k], [[w, 0.0, 0.0], [0.0, w, 0.0], [0.0, 0.0, w]]));
        }
        for a in &rows.angular[rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize] {
            let [x, y, z] = a.lever;
            // omega x lever, as a matrix on omega.
            entries.push((a.block, [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]));
        }
        offsets.push(entries.len());
    }
    (offsets, entries)
}
