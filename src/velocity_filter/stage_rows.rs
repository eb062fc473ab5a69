//! The rows of a stage while it gives them impulses.

use super::row_response::{Entry, EntryMasses, RowResponse, for_each_change};
use crate::constraint::{BuiltRows, Metric};
use crate::math::{Vec3, add, add_scaled};

/// Rows with the impulses given to them, and what these change; each row feels all impulses before.
pub struct StageRows {
    masses: EntryMasses,
    /// The rows, about the motion that the stage found.
    pub built: BuiltRows,
    /// What an impulse does to each.
    pub responses: Vec<RowResponse>,
    /// Impulses `(lambda, gamma1, gamma2)` in the frames of the rows `[N s]`.
    pub impulses: Vec<Vec3>,
    /// Whether friction is within its limit.
    pub sticks: Vec<bool>,
    /// Speed of separation that was asked for along the normal `[m/s]`.
    pub separations: Vec<f64>,
    /// Change of velocity per block.
    change: Vec<Vec3>,
    /// Whether a matrix made it.
    coupled: bool,
}

impl StageRows {
    /// Rows without impulses; their required gaps must be those of the start. Cost: linear in rows and blocks.
    pub fn new(built: BuiltRows, metric: &Metric) -> StageRows {
        let (rows, masses) = (built.rows.len(), EntryMasses::new(&built.rows, metric));
        StageRows {
            responses: (0..rows).map(|row| RowResponse::new(&built.rows, row, &masses)).collect(),
            impulses: vec![[0.0; 3]; rows],
            sticks: vec![false; rows],
            separations: vec![0.0; rows],
            change: vec![[0.0; 3]; metric.lumped.len()],
            coupled: false,
            built,
            masses,
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.impulses.len()
    }

    /// Relative velocity of a row in its frame `[m/s]`, impulses so far included.
    #[inline]
    pub fn velocity(&self, row: usize) -> Vec3 {
        let rows = &self.built.rows;
        // About the motion itself, what a row asks for to keep its start gap is its own approach.
        let [s1, s2] = rows.sliding_velocities[row];
        add([-rows.normal_targets[row], s1, s2], rows.velocity(row, &self.change))
    }

    /// Takes the impulses of all rows, and the change of velocity that they made under a matrix.
    pub fn respond(&mut self, impulses: Vec<Vec3>, sticks: Vec<bool>, change: Vec<Vec3>) {
        (self.impulses, self.sticks, self.change) = (impulses, sticks, change);
        self.coupled = true;
    }

    /// The change of velocity per block, where a matrix made it of the impulses.
    pub fn coupled_change(&self) -> Option<&[Vec3]> {
        self.coupled.then_some(&self.change)
    }

    /// Adds `p` to the impulse of a row.
    #[inline]
    pub fn push(&mut self, row: usize, p: Vec3) {
        if p == [0.0; 3] {
            return;
        }
        self.impulses[row] = add_scaled(self.impulses[row], 1.0, p);
        let (rows, change) = (&self.built.rows, &mut self.change);
        for_each_change(rows, row, &self.masses, rows.impulse(row, p), |entry, more| {
            let (Entry::Linear(_, block) | Entry::Angular(_, block)) = entry;
            change[block] = add(change[block], more);
        });
    }
}
