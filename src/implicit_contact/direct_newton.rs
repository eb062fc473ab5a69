//! Newton systems of the augmented Lagrangian, `(A + C^T E C) x = b`, factored where that is cheap: few blocks, as of a
//! stack of rigid bodies, or many that hang together in a narrow band.

use super::problem::ContactProblem;
use crate::constraint::RowSet;
use crate::linalg::{BlockMatrix, Envelope, EnvelopeCholesky};
use crate::math::{IDENTITY, Mat3, Vec3, mat_add, mat_mul, mat_scale, skew, transpose};

/// Block products of a factorisation beyond which conjugate gradients are cheaper: about ten milliseconds.
const WORK_MAX: usize = 200_000;

/// A system with its pattern, and the places of what contacts add to it; capacity is kept from problem to problem.
#[derive(Default)]
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
    /// Pairs of blocks that are joined.
    pairs: Vec<(u32, u32)>,
    factor: EnvelopeCholesky,
    eliminated: Vec<Vec3>,
}

impl DirectNewton {
    /// Takes the pattern over all contacts; `None` where a factor would cost more than it saves. Cost: a sort of the blocks
    /// that contacts join.
    pub fn assign(&mut self, problem: &ContactProblem) -> Option<&mut DirectNewton> {
        let DirectNewton { matrix, bare, envelope, fixed, offsets, entries, pairs, .. } = self;
        let (a, rows) = (problem.matrix, problem.rows);
        envelope.assign(a);
        if envelope.work() > WORK_MAX {
            return None;
        }
        list_entries(rows, offsets, entries);
        pairs.clear();
        for row in 0..a.rows() {
            let columns = &a.columns[a.row_offsets[row]..a.row_offsets[row + 1]];
            pairs.extend(columns.iter().map(|column| (row as u32, *column)));
        }
        for range in offsets.windows(2) {
            let own = &entries[range[0]..range[1]];
            pairs.extend(own.iter().flat_map(|(b, _)| own.iter().map(move |(c, _)| (*b, *c))));
        }
        matrix.assign_places(a.rows(), pairs);
        envelope.assign(matrix);
        if envelope.work() > WORK_MAX {
            return None;
        }
        for row in 0..a.rows() {
            for k in a.row_offsets[row]..a.row_offsets[row + 1] {
                let place = matrix.place(row as u32, a.columns[k]);
                matrix.values[place] = a.values[k];
            }
        }
        bare.clone_from(&matrix.values);
        fixed.clear();
        fixed.extend(problem.inverse_diagonal.iter().map(|m| *m == [[0.0; 3]; 3]));
        Some(self)
    }

    /// Block products of a factorisation.
    pub fn work(&self) -> usize {
        self.envelope.work()
    }

    /// `x := (A + C^T E C)^-1 x` with rows of the row set and their world stiffness; whether it is positive definite.
    pub fn solve(&mut self, stiffness: impl Iterator<Item = (usize, Mat3)>, x: &mut [Vec3]) -> bool {
        self.matrix.values.copy_from_slice(&self.bare);
        for (row, e) in stiffness {
            let own = &self.entries[self.offsets[row]..self.offsets[row + 1]];
            for (b, to) in own {
                let pulled = mat_mul(&transpose(to), &e);
                for (c, from) in own {
                    let place = self.matrix.place(*b, *c);
                    self.matrix.values[place] = mat_add(&self.matrix.values[place], &mat_mul(&pulled, from));
                }
            }
        }
        if !self.factor.assign(&self.matrix, &self.envelope, &self.fixed) {
            return false;
        }
        for (x, fixed) in x.iter_mut().zip(&self.fixed) {
            if *fixed {
                *x = [0.0; 3];
            }
        }
        self.factor.solve(&self.envelope, x, &mut self.eliminated);
        true
    }
}

/// Lists the entries of each row: `u = sum M_k v_k`.
fn list_entries(rows: &RowSet, offsets: &mut Vec<usize>, entries: &mut Vec<(u32, Mat3)>) {
    offsets.clear();
    offsets.push(0);
    entries.clear();
    for i in 0..rows.len() {
        for k in rows.offsets[i] as usize..rows.offsets[i + 1] as usize {
            entries.push((rows.blocks[k], mat_scale(rows.weights[k], &IDENTITY)));
        }
        for a in &rows.angular[rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize] {
            // omega x lever, as a matrix on omega.
            entries.push((a.block, transpose(&skew(a.lever))));
        }
        offsets.push(entries.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Angular;
    use crate::math::{add, mat_vec, norm, sub};
    use crate::parallel::Par;

    /// Two rigid bodies on each other, a vertex of infinite mass, and one that no contact touches.
    fn rows() -> RowSet {
        let angular = |block, lever| Angular { block, lever };
        RowSet {
            offsets: vec![0, 1, 3, 5],
            blocks: vec![0, 0, 2, 2, 4],
            weights: vec![1.0, -1.0, 1.0, 0.5, -0.5],
            angular_offsets: vec![0, 1, 3, 4],
            angular: vec![
                angular(1, [0.5, 0.3, -0.5]),
                angular(1, [-0.4, 0.1, -0.5]),
                angular(3, [0.4, 0.2, -0.6]),
                angular(3, [-0.1, 0.7, 0.2]),
            ],
            frames: vec![[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]; 3],
            normal_targets: vec![0.0; 3],
            sliding_velocities: vec![[0.0; 2]; 3],
            friction: vec![0.0; 3],
        }
    }

    #[test]
    fn the_solution_satisfies_the_system_row_by_row() {
        let rows = rows();
        let diagonal: Vec<Mat3> = (0..6).map(|b| mat_scale(1.0 + 0.3 * f64::from(b), &IDENTITY)).collect();
        let matrix = BlockMatrix::from_diagonal(&diagonal);
        let mut inverse: Vec<Mat3> = (0..6).map(|b| mat_scale(1.0 / (1.0 + 0.3 * f64::from(b)), &IDENTITY)).collect();
        inverse[4] = [[0.0; 3]; 3];
        let problem = ContactProblem {
            matrix: &matrix,
            inverse_diagonal: &inverse,
            rows: &rows,
            translations: None,
            velocity_scale: 1.0,
        };
        let mut direct = DirectNewton::default();
        let direct = direct.assign(&problem).expect("a small system");
        let stiffness = [[[40.0, 3.0, 0.0], [3.0, 70.0, 5.0], [0.0, 5.0, 90.0]]; 3];
        // The second contact is open in the second solve: nothing of the first may be left.
        for open in [3, 1] {
            let of_row = |row: usize| (row != open).then_some(stiffness[row]);
            let right: Vec<Vec3> = (0..6).map(|b| [1.0, -0.5 * f64::from(b), 0.25]).collect();
            let mut x = right.clone();
            assert!(direct.solve((0..3).filter_map(|row| Some((row, of_row(row)?))), &mut x));
            let mut image = vec![[0.0; 3]; 6];
            matrix.product(&x, &mut image, Par::Serial);
            for row in 0..3 {
                if let Some(e) = of_row(row) {
                    let mut pushed = vec![[0.0; 3]; 6];
                    rows.scatter(row, mat_vec(&e, rows.relative_velocity(row, &x)), &mut pushed);
                    image.iter_mut().zip(pushed).for_each(|(y, p)| *y = add(*y, p));
                }
            }
            assert_eq!(x[4], [0.0; 3], "an infinite mass stays");
            for b in [0, 1, 2, 3, 5] {
                assert!(norm(sub(image[b], right[b])) < 1e-12 * 100.0, "block {b}: {:?}", sub(image[b], right[b]));
            }
        }
    }
}
