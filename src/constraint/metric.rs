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
    /// Where the blocks of `matrix` come from.
    sources: Sources,
}

impl Metric {
    /// The metric at the start of a step.
    ///
    /// Errors: a host matrix whose diagonal block is not positive definite (system and row), or whose values are not
    /// finite or not symmetric. Cost: linear in blocks, plus a sort within each row of an upper-only system.
    pub fn new(model: &Model, state: &State, drives: &Drives) -> Result<Metric, StepError> {
        let mut metric = Metric::default();
        metric.assign(model, state, drives).map(|()| metric)
    }

    /// Makes this the metric at the start of a step, in the memory that it has. What follows from patterns alone is
    /// kept while these and the infinite masses are the same. On an error it is of no use, until it is assigned again.
    pub fn assign(&mut self, model: &Model, state: &State, drives: &Drives) -> Result<(), StepError> {
        lumped_blocks(model, state, &mut self.lumped, &mut self.fixed);
        let systems = drives.systems.len().min(model.systems.len());
        for (index, system) in drives.systems[..systems].iter().enumerate() {
            check_values(index, &model.systems[index], system)?;
        }
        if !self.sources.fit(model, systems, &self.fixed) {
            let Metric { matrix, system, .. } = self;
            self.sources = Sources::new(model, systems, &self.fixed, matrix, system);
            self.uncoupled.clear();
            self.uncoupled.extend(matrix.row_offsets.windows(2).map(|w| w[1] - w[0] == 1));
            self.translations = Translations::new(&self.matrix, &linear_blocks(model));
        }
        self.sources.fill(drives, &self.lumped, &mut self.matrix);
        // What the library assembled is symmetric.
        check_symmetry(&self.matrix, &self.sources.mirror, |row| (self.system[row] as usize) < model.host_systems)?;
        self.translations.update(&self.matrix);
        inverse_blocks(model, &self.matrix, &self.fixed, &mut self.inverse_diagonal)
    }

    /// Finds the blocks that impulses reach: those with one, and every block of a system that has one.
    pub fn reached(&self, impulses: &[Vec3], out: &mut Reached) {
        let Reached { blocks, systems } = out;
        blocks.clear();
        blocks.extend(impulses.iter().map(|f| *f != [0.0; 3]));
        systems.clear();
        systems.resize(self.system.iter().filter(|s| **s != u32::MAX).max().map_or(0, |s| *s as usize + 1), false);
        for (block, hit) in blocks.iter().enumerate() {
            if *hit && self.system[block] != u32::MAX {
                systems[self.system[block] as usize] = true;
            }
        }
        for (block, hit) in blocks.iter_mut().enumerate() {
            *hit |= self.system[block] != u32::MAX && systems[self.system[block] as usize];
            *hit &= !self.fixed[block];
        }
    }

    /// `sum v_i · (A v)_i`: twice the kinetic energy for lumped masses `[J]`.
    pub fn norm_squared(&self, v: &[Vec3], par: Par) -> f64 {
        par.sum(v.len(), |i| if self.fixed[i] { 0.0 } else { crate::math::dot(v[i], self.matrix.row_product(i, v)) })
    }
}

/// What impulses reach.
#[derive(Clone, Debug, Default)]
pub struct Reached {
    /// Blocks.
    pub blocks: Vec<bool>,
    /// Systems with an impulse.
    systems: Vec<bool>,
}

/// Which blocks are velocities of points: all but the angular ones of rigid bodies.
fn linear_blocks(model: &Model) -> Vec<bool> {
    let mut linear = vec![true; model.block_count];
    rigid_blocks(model).for_each(|first| linear[first + 1] = false);
    linear
}

/// First blocks of the rigid bodies.
fn rigid_blocks(model: &Model) -> impl Iterator<Item = usize> + '_ {
    let rigid = model.bodies.iter().filter(|b| matches!(b.description.kind, Kind::Rigid { .. }));
    rigid.map(|b| b.blocks.start)
}

fn lumped_blocks(model: &Model, state: &State, lumped: &mut Vec<Mat3>, fixed: &mut Vec<bool>) {
    lumped.clear();
    lumped.resize(model.block_count, IDENTITY);
    fixed.clear();
    fixed.resize(model.block_count, false);
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
}

/// Global blocks of a system, in its row order.
fn system_blocks<'a>(model: &'a Model, description: &'a SystemDescription) -> impl Iterator<Item = u32> + 'a {
    let bodies = description.bodies.iter().filter_map(|key| model.body_index(*key));
    bodies.flat_map(|b| model.bodies[b].blocks.clone()).map(|b| b as u32)
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

/// Mark of a lumped block among the systems.
const LUMPED: u32 = u32::MAX;

/// Where a block of the matrix is read from.
#[derive(Clone, Copy, Debug)]
struct Source {
    /// System, or [`LUMPED`].
    system: u32,
    /// Position among the values of the system, or among the lumped blocks.
    position: u32,
    /// Whether the mirrored block was given.
    transposed: bool,
}

/// What the blocks of the matrix are made of, and what that follows from.
#[derive(Clone, Debug, Default)]
struct Sources {
    list: Vec<Source>,
    /// Position of the mirror of each block.
    mirror: Vec<u32>,
    fixed: Vec<bool>,
    /// Global blocks and pattern of each system.
    systems: Vec<(Vec<u32>, SystemDescription)>,
    /// First blocks of the rigid bodies.
    rigid: Vec<usize>,
}

impl Sources {
    /// Whether they are those of the first `systems` of a model with these infinite masses.
    fn fit(&self, model: &Model, systems: usize, fixed: &[bool]) -> bool {
        let same = |(known, given): (&(Vec<u32>, SystemDescription), &SystemDescription)| {
            known.1.upper == given.upper
                && known.1.row_offsets == given.row_offsets
                && known.1.columns == given.columns
                && system_blocks(model, given).eq(known.0.iter().copied())
        };
        !self.list.is_empty()
            && self.fixed == fixed
            && self.systems.len() == systems
            && rigid_blocks(model).eq(self.rigid.iter().copied())
            && self.systems.iter().zip(&model.systems).all(same)
    }

    /// The sources of the first `systems` of a model; writes the pattern of the matrix, and the system of each block.
    fn new(
        model: &Model,
        systems: usize,
        fixed: &[bool],
        matrix: &mut BlockMatrix,
        system_of: &mut Vec<u32>,
    ) -> Sources {
        system_of.clear();
        system_of.resize(model.block_count, u32::MAX);
        let mut entries: Vec<(u32, u32, Source)> = Vec::new();
        let mut out = Sources { fixed: fixed.to_vec(), rigid: rigid_blocks(model).collect(), ..Sources::default() };
        for (index, description) in model.systems[..systems].iter().enumerate() {
            let blocks: Vec<u32> = system_blocks(model, description).collect();
            blocks.iter().for_each(|b| system_of[*b as usize] = index as u32);
            system_entries(index as u32, description, &blocks, fixed, &mut entries);
            out.systems.push((blocks, description.clone()));
        }
        for block in 0..model.block_count as u32 {
            if fixed[block as usize] || system_of[block as usize] == u32::MAX {
                entries.push((block, block, Source { system: LUMPED, position: block, transposed: false }));
            }
        }
        entries.sort_by_key(|(row, column, _)| (*row, *column));
        let pairs: Vec<(u32, u32)> = entries.iter().flat_map(|(r, c, _)| [(*r, *c), (*c, *r)]).collect();
        *matrix = BlockMatrix::from_places(model.block_count, pairs);
        // A mirror that a system does not give is a block of zeros, which the test of symmetry sees.
        let missing = Source { system: LUMPED, position: u32::MAX, transposed: false };
        out.list = vec![missing; matrix.columns.len()];
        for (row, column, source) in entries {
            out.list[matrix.place(row, column)] = source;
        }
        out.mirror = (0..model.block_count as u32)
            .flat_map(|row| {
                let columns = &matrix.columns[matrix.row_offsets[row as usize]..matrix.row_offsets[row as usize + 1]];
                columns.iter().map(move |column| (row, *column))
            })
            .map(|(row, column)| matrix.place(column, row) as u32)
            .collect();
        out
    }

    /// Writes the blocks.
    fn fill(&self, drives: &Drives, lumped: &[Mat3], matrix: &mut BlockMatrix) {
        for (value, source) in matrix.values.iter_mut().zip(&self.list) {
            let position = source.position as usize;
            *value = match (source.system, source.transposed) {
                (LUMPED, _) => lumped.get(position).copied().unwrap_or(ZERO_MATRIX),
                (system, false) => drives.systems[system as usize].values[position],
                (system, true) => transpose(&drives.systems[system as usize].values[position]),
            };
        }
    }
}

fn system_entries(
    system: u32,
    description: &SystemDescription,
    blocks: &[u32],
    fixed: &[bool],
    entries: &mut Vec<(u32, u32, Source)>,
) {
    for (row, a) in blocks.iter().enumerate() {
        for position in description.row_offsets[row]..description.row_offsets[row + 1] {
            let column = description.columns[position] as usize;
            let b = blocks[column];
            if fixed[*a as usize] || fixed[b as usize] {
                continue;
            }
            let position = position as u32;
            entries.push((*a, b, Source { system, position, transposed: false }));
            if description.upper && row != column {
                entries.push((b, *a, Source { system, position, transposed: true }));
            }
        }
    }
}

fn check_symmetry(matrix: &BlockMatrix, mirror: &[u32], checked: impl Fn(usize) -> bool) -> Result<(), StepError> {
    let scale_of = |row: usize| largest(&matrix.values[matrix.diagonal[row]]);
    for row in (0..matrix.rows()).filter(|row| checked(*row)) {
        for k in matrix.row_offsets[row]..matrix.row_offsets[row + 1] {
            let mirrored = transpose(&matrix.values[mirror[k] as usize]);
            let difference = largest(&crate::math::mat_add(&matrix.values[k], &mat_scale(-1.0, &mirrored)));
            if difference > ASYMMETRY * scale_of(row).max(scale_of(matrix.columns[k] as usize)) {
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

fn inverse_blocks(
    model: &Model,
    matrix: &BlockMatrix,
    fixed: &[bool],
    inverses: &mut Vec<Mat3>,
) -> Result<(), StepError> {
    inverses.clear();
    inverses.resize(matrix.rows(), ZERO_MATRIX);
    for block in (0..matrix.rows()).filter(|b| !fixed[*b]) {
        let diagonal = &matrix.values[matrix.diagonal[block]];
        match inverse(diagonal).filter(|_| is_positive_definite(diagonal)) {
            Some(inverse) => inverses[block] = inverse,
            None => return Err(singular(model, block)),
        }
    }
    Ok(())
}

/// Names the system and its row that own a block.
fn singular(model: &Model, block: usize) -> StepError {
    for (system, description) in model.systems.iter().enumerate() {
        if let Some(row) = system_blocks(model, description).position(|b| b as usize == block) {
            return StepError::SingularSystem { system, row };
        }
    }
    StepError::SingularSystem { system: usize::MAX, row: block }
}

/// `sum of lumped mass times velocity` over the blocks named, for momentum accounts `[N s]`.
pub fn momentum(lumped: &[Mat3], blocks: impl Iterator<Item = usize>, v: &[Vec3]) -> Vec3 {
    blocks.fold([0.0; 3], |sum, b| add(sum, mat_vec(&lumped[b], v[b])))
}
