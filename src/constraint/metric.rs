//! The metric A of a step: lumped masses, host systems over one or more bodies, rigid bodies, infinite masses.

use super::Translations;
use crate::kinematics::world_inertia;
use crate::linalg::BlockMatrix;
use crate::math::{
    IDENTITY, Mat3, Vec3, ZERO_MATRIX, add, inverse, is_positive_definite, mat_scale, mat_vec, transpose,
};
use crate::model::{BuildError, Drives, Kind, Model, State, StepError, System, SystemDescription};
use crate::parallel::Par;

/// Relative asymmetry of a host matrix that is taken for rounding in `f32`.
const ASYMMETRY: f64 = 1e-5;

/// A, its inverse diagonal blocks, and the lumped masses that always stand beside it.
#[derive(Clone, Debug, Default)]
pub struct Metric {
    /// A `[kg]`; blocks of infinite mass are coupled to nothing.
    pub matrix: BlockMatrix,
    /// Inverse diagonal blocks; zero for blocks of infinite mass.
    pub inverse_diagonal: Vec<Mat3>,
    /// Lumped mass per block: `m I`, or the world inertia for angular blocks. The identity for infinite masses.
    pub lumped: Vec<Mat3>,
    /// Blocks of infinite mass: pinned vertices, rigid bodies of infinite mass.
    pub fixed: Vec<bool>,
    /// Blocks coupled to no other block of the matrix.
    pub uncoupled: Vec<bool>,
    /// Host system of each block; `u32::MAX` without.
    pub system: Vec<u32>,
    /// Translations of what is coupled.
    pub translations: Translations,
}

impl Metric {
    /// The metric at the start of a step.
    ///
    /// Errors: a host matrix whose diagonal block is not positive definite (system and row), or whose values are not
    /// finite or not symmetric. Cost: linear in blocks, plus a sort within each row of an upper-only system.
    pub fn new(model: &Model, state: &State, drives: &Drives) -> Result<Metric, StepError> {
        let (lumped, fixed) = lumped_blocks(model, state);
        let mut entries: Vec<(u32, u32, Mat3)> = Vec::new();
        let mut system_of = vec![u32::MAX; model.block_count];
        for (index, system) in drives.systems.iter().enumerate() {
            let Some(description) = model.systems.get(index) else { break };
            let blocks = system_blocks(model, description);
            check_values(index, description, system)?;
            blocks.iter().for_each(|b| system_of[*b as usize] = index as u32);
            system_entries(description, &system.values, &blocks, &fixed, &mut entries);
        }
        for (block, mass) in lumped.iter().enumerate() {
            if fixed[block] || system_of[block] == u32::MAX {
                entries.push((block as u32, block as u32, *mass));
            }
        }
        let matrix = by_rows(model.block_count, entries);
        check_symmetry(&matrix)?;
        let inverse_diagonal = inverse_blocks(model, &matrix, &fixed)?;
        let uncoupled = matrix.row_offsets.windows(2).map(|w| w[1] - w[0] == 1).collect();
        let translations = Translations::new(&matrix, &linear_blocks(model));
        Ok(Metric { matrix, inverse_diagonal, lumped, fixed, uncoupled, system: system_of, translations })
    }

    /// Blocks that impulses reach: those with one, and every block of a system that has one.
    pub fn reached(&self, impulses: &[Vec3]) -> Vec<bool> {
        let mut reached: Vec<bool> = impulses.iter().map(|f| *f != [0.0; 3]).collect();
        let systems = self.system.iter().filter(|s| **s != u32::MAX).max().map_or(0, |s| *s as usize + 1);
        let mut touched = vec![false; systems];
        for (block, hit) in reached.iter().enumerate() {
            if *hit && self.system[block] != u32::MAX {
                touched[self.system[block] as usize] = true;
            }
        }
        for (block, hit) in reached.iter_mut().enumerate() {
            *hit |= self.system[block] != u32::MAX && touched[self.system[block] as usize];
            *hit &= !self.fixed[block];
        }
        reached
    }

    /// `sum v_i · (A v)_i`: twice the kinetic energy for lumped masses `[J]`.
    pub fn norm_squared(&self, v: &[Vec3], par: Par) -> f64 {
        par.sum(v.len(), |i| if self.fixed[i] { 0.0 } else { crate::math::dot(v[i], self.matrix.row_product(i, v)) })
    }
}

/// Which blocks are velocities of points: all but the angular ones of rigid bodies.
fn linear_blocks(model: &Model) -> Vec<bool> {
    let mut linear = vec![true; model.block_count];
    for body in model.bodies.iter().filter(|b| matches!(b.description.kind, Kind::Rigid { .. })) {
        linear[body.blocks.start + 1] = false;
    }
    linear
}

fn lumped_blocks(model: &Model, state: &State) -> (Vec<Mat3>, Vec<bool>) {
    let mut lumped = vec![IDENTITY; model.block_count];
    let mut fixed = vec![false; model.block_count];
    for (index, body) in model.bodies.iter().enumerate() {
        let first = body.blocks.start;
        match &body.description.kind {
            Kind::Deformable { masses, pinned } => {
                for (i, (mass, pin)) in masses.iter().zip(pinned).enumerate() {
                    lumped[first + i] = mat_scale(*mass, &IDENTITY);
                    fixed[first + i] = *pin;
                }
            }
            Kind::Rigid { mass, inertia } => {
                let turns_freely = inertia.iter().flatten().all(|v| v.is_finite());
                fixed[first] = mass.is_infinite();
                fixed[first + 1] = !turns_freely;
                if !fixed[first] {
                    lumped[first] = mat_scale(*mass, &IDENTITY);
                }
                if turns_freely {
                    lumped[first + 1] = world_inertia(&state.poses[index], inertia);
                }
            }
            Kind::Kinematic { .. } | Kind::HalfSpace(_) => {}
        }
    }
    (lumped, fixed)
}

/// Global blocks of a system, in its row order.
fn system_blocks(model: &Model, description: &SystemDescription) -> Vec<u32> {
    let bodies = description.bodies.iter().filter_map(|key| model.body_index(*key));
    bodies.flat_map(|b| model.bodies[b].blocks.clone()).map(|b| b as u32).collect()
}

fn check_values(index: usize, description: &SystemDescription, system: &System) -> Result<(), StepError> {
    let bad = |at, value, message| Err(StepError::BadInput(BuildError { body: 0, index: at, value, message }));
    if system.values.len() != description.columns.len() {
        return bad(index, system.values.len() as f64, "system values do not fit the pattern");
    }
    match system.values.iter().position(|m| m.iter().flatten().any(|v| !v.is_finite())) {
        Some(i) => bad(i, f64::NAN, "system value is not finite"),
        None => Ok(()),
    }
}

fn system_entries(
    description: &SystemDescription,
    values: &[Mat3],
    blocks: &[u32],
    fixed: &[bool],
    entries: &mut Vec<(u32, u32, Mat3)>,
) {
    for (row, a) in blocks.iter().enumerate() {
        let slots = description.row_offsets[row]..description.row_offsets[row + 1];
        for (column, value) in description.columns[slots.clone()].iter().zip(&values[slots]) {
            let column = *column as usize;
            let b = blocks[column];
            if fixed[*a as usize] || fixed[b as usize] {
                continue;
            }
            entries.push((*a, b, *value));
            if description.upper && row != column {
                entries.push((b, *a, transpose(value)));
            }
        }
    }
}

/// Counting sort by row, then by column within each row.
fn by_rows(rows: usize, entries: Vec<(u32, u32, Mat3)>) -> BlockMatrix {
    let mut row_offsets = vec![0; rows + 1];
    entries.iter().for_each(|e| row_offsets[e.0 as usize + 1] += 1);
    for i in 0..rows {
        row_offsets[i + 1] += row_offsets[i];
    }
    let mut next = row_offsets.clone();
    let mut order = vec![0_usize; entries.len()];
    for (i, e) in entries.iter().enumerate() {
        order[next[e.0 as usize]] = i;
        next[e.0 as usize] += 1;
    }
    let mut matrix = BlockMatrix {
        columns: Vec::with_capacity(entries.len()),
        values: Vec::with_capacity(entries.len()),
        diagonal: vec![0; rows],
        row_offsets,
    };
    for row in 0..rows {
        let slots = &mut order[matrix.row_offsets[row]..matrix.row_offsets[row + 1]];
        slots.sort_unstable_by_key(|i| entries[*i].1);
        for i in slots {
            if entries[*i].1 as usize == row {
                matrix.diagonal[row] = matrix.values.len();
            }
            matrix.columns.push(entries[*i].1);
            matrix.values.push(entries[*i].2);
        }
    }
    matrix
}

fn check_symmetry(matrix: &BlockMatrix) -> Result<(), StepError> {
    let scale_of = |row: usize| largest(&matrix.values[matrix.diagonal[row]]);
    // In each row, the first entry whose column has not been passed: rows come in ascending order.
    let mut next = matrix.row_offsets.clone();
    for row in 0..matrix.rows() {
        for k in matrix.row_offsets[row]..matrix.row_offsets[row + 1] {
            let column = matrix.columns[k] as usize;
            let (slot, end) = (&mut next[column], matrix.row_offsets[column + 1]);
            while *slot < end && (matrix.columns[*slot] as usize) < row {
                *slot += 1;
            }
            let present = *slot < end && matrix.columns[*slot] as usize == row;
            let mirrored = if present { transpose(&matrix.values[*slot]) } else { ZERO_MATRIX };
            let difference = largest(&crate::math::mat_add(&matrix.values[k], &mat_scale(-1.0, &mirrored)));
            if difference > ASYMMETRY * scale_of(row).max(scale_of(column)) {
                let message = "host matrix is not symmetric";
                return Err(StepError::BadInput(BuildError { body: 0, index: row, value: difference, message }));
            }
        }
    }
    Ok(())
}

fn largest(m: &Mat3) -> f64 {
    m.iter().flatten().fold(0.0, |a, v| a.max(v.abs()))
}

fn inverse_blocks(model: &Model, matrix: &BlockMatrix, fixed: &[bool]) -> Result<Vec<Mat3>, StepError> {
    let mut inverses = vec![ZERO_MATRIX; matrix.rows()];
    for block in (0..matrix.rows()).filter(|b| !fixed[*b]) {
        let diagonal = &matrix.values[matrix.diagonal[block]];
        match inverse(diagonal).filter(|_| is_positive_definite(diagonal)) {
            Some(inverse) => inverses[block] = inverse,
            None => return Err(singular(model, block)),
        }
    }
    Ok(inverses)
}

/// Names the system and its row that own a block.
fn singular(model: &Model, block: usize) -> StepError {
    for (system, description) in model.systems.iter().enumerate() {
        if let Some(row) = system_blocks(model, description).iter().position(|b| *b as usize == block) {
            return StepError::SingularSystem { system, row };
        }
    }
    StepError::SingularSystem { system: usize::MAX, row: block }
}

/// `sum of lumped mass times velocity` over the blocks named, for momentum accounts `[N s]`.
pub fn momentum(lumped: &[Mat3], blocks: impl Iterator<Item = usize>, v: &[Vec3]) -> Vec3 {
    blocks.fold([0.0; 3], |sum, b| add(sum, mat_vec(&lumped[b], v[b])))
}
