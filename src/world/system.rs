//! Host systems: matrices over the blocks of one or more bodies, pattern once, values per step.

use super::{Fault, World, WorldError, ids};
use crate::math::Mat3;
use crate::model::{Dynamics, Kind, SystemDescription};

/// A system as the world keeps it.
pub(super) struct HostSystem {
    /// Keys of the bodies.
    pub bodies: Vec<u64>,
    pub row_offsets: Vec<usize>,
    pub columns: Vec<u32>,
    pub upper: bool,
    /// Values of the last push; empty before the first.
    pub values: Vec<Mat3>,
}

/// How well the two blocks of a pair must agree, relative to the diagonal entries of their rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SymmetrySlack {
    /// Values came as `f32`.
    Single,
    /// Values came as `f64`.
    Double,
}

impl World {
    /// Adds a system over `bodies`, rows in their order: one per vertex of a deformable body, two per rigid body.
    ///
    /// Errors: a body of prescribed motion, one named twice or by another system, a pattern without a diagonal block,
    /// with columns out of order or range, or, not `upper`, without the mirror of a block.
    pub fn add_system(
        &mut self,
        bodies: Vec<u64>,
        row_offsets: Vec<usize>,
        columns: Vec<u32>,
        upper: bool,
    ) -> Result<u64, WorldError> {
        let mut rows = 0usize;
        for (index, id) in bodies.iter().enumerate() {
            let body = self.bodies.get(*id).map_err(|error| error.index(index))?;
            if !matches!(body.description.kind, Kind::Deformable { .. } | Kind::Rigid { .. }) {
                let message = "a system is over deformable and rigid bodies only";
                return Err(WorldError::new(Fault::InvalidArgument, message).object(*id).index(index));
            }
            if matches!(body.description.dynamics.as_deref(), Some(Dynamics::Deformable { .. })) {
                let message = "a deformable body that the library drives has a matrix of its own";
                return Err(WorldError::new(Fault::InvalidArgument, message).object(*id).index(index));
            }
            if self.in_system(ids::key(*id), None) || bodies[..index].contains(id) {
                let message = "a body is named by two systems, or twice by one";
                return Err(WorldError::new(Fault::InvalidArgument, message).object(*id).index(index));
            }
            rows += body.blocks();
        }
        if rows == 0 {
            return Err(WorldError::new(Fault::InvalidArgument, "a system needs at least one body"));
        }
        check_pattern(rows, &row_offsets, &columns, upper)?;
        let bodies = bodies.into_iter().map(ids::key).collect();
        let system = HostSystem { bodies, row_offsets, columns, upper, values: Vec::new() };
        let id = self.systems.insert_with(|_| Ok(system))?;
        self.model_current = false;
        Ok(id)
    }

    /// Whether a system, other than `except`, names the body with this key.
    pub(super) fn in_system(&self, body: u64, except: Option<u64>) -> bool {
        self.systems.iter().any(|(id, system)| Some(id) != except && system.bodies.contains(&body))
    }

    /// Number of blocks of a system's pattern.
    pub fn system_blocks(&self, id: u64) -> Result<usize, WorldError> {
        Ok(self.systems.get(id)?.columns.len())
    }

    /// Sets the values of a system. Errors: not finite, not symmetric, a diagonal entry that is not positive.
    pub fn push_system(&mut self, id: u64, mut values: Vec<Mat3>, slack: SymmetrySlack) -> Result<(), WorldError> {
        let system = self.systems.get_mut(id)?;
        if values.len() != system.columns.len() {
            let message = format!("{} blocks given, the pattern has {}", values.len(), system.columns.len());
            let error = WorldError::new(Fault::BufferLayout, message);
            return Err(error.object(id).value(values.len() as f64));
        }
        if let Some(index) = values.iter().position(|block| !block.iter().flatten().all(|x| x.is_finite())) {
            let value = values[index].iter().flatten().find(|x| !x.is_finite()).copied().unwrap_or(f64::NAN);
            let message = format!("block {index} is not finite");
            return Err(WorldError::new(Fault::NonFinite, message).object(id).index(index).value(value));
        }
        symmetrise(system, &mut values, slack).map_err(|error| error.object(id))?;
        system.values = values;
        Ok(())
    }

    /// Removes a system; its bodies keep their lumped masses.
    pub fn remove_system(&mut self, id: u64) -> Result<(), WorldError> {
        self.systems.remove(id)?;
        self.model_current = false;
        Ok(())
    }

    /// Patterns by model keys, in the order of slots.
    pub(super) fn model_systems(&self) -> Vec<SystemDescription> {
        let describe = |system: &HostSystem| SystemDescription {
            bodies: system.bodies.clone(),
            row_offsets: system.row_offsets.clone(),
            columns: system.columns.clone(),
            upper: system.upper,
        };
        self.systems.iter().map(|(_, system)| describe(system)).collect()
    }
}

fn bad(message: String, index: usize, value: f64) -> WorldError {
    WorldError::new(Fault::InvalidArgument, message).index(index).value(value)
}

pub(super) fn check_pattern(rows: usize, offsets: &[usize], columns: &[u32], upper: bool) -> Result<(), WorldError> {
    if offsets.len() != rows + 1 {
        let message = format!("{} row offsets for {rows} block rows, {} needed", offsets.len(), rows + 1);
        return Err(WorldError::new(Fault::BufferLayout, message).value(offsets.len() as f64));
    }
    if offsets[0] != 0 || offsets[rows] != columns.len() {
        let message =
            format!("row offsets go from {} to {}, columns from 0 to {}", offsets[0], offsets[rows], columns.len());
        return Err(WorldError::new(Fault::BufferLayout, message).value(offsets[rows] as f64));
    }
    if let Some(row) = offsets.windows(2).position(|pair| pair[0] > pair[1]) {
        return Err(bad(
            format!("row offset {} is smaller than the one before", row + 1),
            row + 1,
            offsets[row + 1] as f64,
        ));
    }
    for row in 0..rows {
        let entries = &columns[offsets[row]..offsets[row + 1]];
        let first = offsets[row];
        for (k, column) in entries.iter().enumerate() {
            let place = first + k;
            if *column as usize >= rows {
                return Err(bad(format!("column {column} of row {row} is out of {rows}"), place, *column as f64));
            }
            if k > 0 && entries[k - 1] >= *column {
                return Err(bad(format!("columns of row {row} are not ascending"), place, *column as f64));
            }
            if upper && (*column as usize) < row {
                return Err(bad(format!("row {row} has a block below the diagonal"), place, *column as f64));
            }
        }
        if entries.binary_search(&(row as u32)).is_err() {
            return Err(bad(format!("row {row} has no diagonal block"), row, f64::NAN));
        }
    }
    if !upper {
        for row in 0..rows {
            for place in offsets[row]..offsets[row + 1] {
                if find(offsets, columns, columns[place] as usize, row).is_none() {
                    let message = format!("block ({row}, {}) has no mirror", columns[place]);
                    return Err(bad(message, place, columns[place] as f64));
                }
            }
        }
    }
    Ok(())
}

/// Place of block `(row, column)`.
fn find(offsets: &[usize], columns: &[u32], row: usize, column: usize) -> Option<usize> {
    columns[offsets[row]..offsets[row + 1]].binary_search(&(column as u32)).ok().map(|k| offsets[row] + k)
}

/// Checks diagonal entries and symmetry, and replaces the two values of a pair by their mean, so that what the solver
/// gets is symmetric to the last bit.
pub(super) fn symmetrise(system: &HostSystem, values: &mut [Mat3], slack: SymmetrySlack) -> Result<(), WorldError> {
    let slack = match slack {
        SymmetrySlack::Single => 1e-5,
        SymmetrySlack::Double => 1e-10,
    };
    let (offsets, columns) = (&system.row_offsets, &system.columns);
    let rows = offsets.len() - 1;
    let mut scale = Vec::new();
    if scale.try_reserve_exact(rows).is_err() {
        return Err(WorldError::out_of_memory("no memory for the diagonal of the system"));
    }
    for row in 0..rows {
        let Some(place) = find(offsets, columns, row, row) else { continue };
        let block = &values[place];
        if let Some(i) = (0..3).find(|i| block[*i][*i] <= 0.0) {
            let message = format!("diagonal entry {i} of block row {row} is not positive");
            return Err(WorldError::new(Fault::SingularSystem, message).index(row).value(block[i][i]));
        }
        scale.push(block[0][0].max(block[1][1]).max(block[2][2]));
    }
    for row in 0..rows {
        for place in offsets[row]..offsets[row + 1] {
            let column = columns[place] as usize;
            if column < row || (system.upper && column != row) {
                continue;
            }
            let Some(mirror) = find(offsets, columns, column, row) else { continue };
            let bound = slack * scale[row].max(scale[column]);
            let (a, b) = (values[place], values[mirror]);
            for i in 0..3 {
                for j in 0..3 {
                    if (a[i][j] - b[j][i]).abs() > bound {
                        let message =
                            format!("blocks ({row}, {column}) and ({column}, {row}) differ at entry ({i}, {j})");
                        return Err(bad(message, place, a[i][j] - b[j][i]));
                    }
                    let mean = 0.5 * a[i][j] + 0.5 * b[j][i];
                    values[place][i][j] = mean;
                    values[mirror][j][i] = mean;
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATTERN: (&[usize], &[u32]) = (&[0, 2, 4], &[0, 1, 0, 1]);

    fn fault(offsets: &[usize], columns: &[u32], upper: bool) -> Option<(Fault, u64)> {
        check_pattern(2, offsets, columns, upper).err().map(|e| (e.fault, e.index))
    }

    #[test]
    fn patterns_are_checked() {
        assert_eq!(fault(PATTERN.0, PATTERN.1, false), None);
        assert_eq!(fault(&[0, 2, 3], &[0, 1, 1], true), None);
        assert_eq!(fault(PATTERN.0, PATTERN.1, true), Some((Fault::InvalidArgument, 2)), "below the diagonal");
        assert_eq!(fault(&[0, 2, 3], &[0, 1, 1], false), Some((Fault::InvalidArgument, 1)), "no mirror");
        assert_eq!(fault(&[0, 1, 2], &[1, 1], false), Some((Fault::InvalidArgument, 0)), "no diagonal");
        assert_eq!(fault(&[0, 2, 4], &[1, 0, 0, 1], false), Some((Fault::InvalidArgument, 1)), "not ascending");
        assert_eq!(fault(&[0, 2, 4], &[0, 2, 0, 1], false), Some((Fault::InvalidArgument, 1)), "out of range");
        assert_eq!(fault(&[0, 3, 2], &[0, 1], false).map(|f| f.0), Some(Fault::InvalidArgument), "offsets fall");
        assert_eq!(fault(&[0, 2], &[0, 1], false).map(|f| f.0), Some(Fault::BufferLayout), "too few offsets");
        assert_eq!(fault(&[0, 2, 5], &[0, 1, 0, 1], false).map(|f| f.0), Some(Fault::BufferLayout));
    }

    #[test]
    fn values_are_symmetrised_or_refused() {
        let system = HostSystem {
            bodies: vec![],
            row_offsets: PATTERN.0.to_vec(),
            columns: PATTERN.1.to_vec(),
            upper: false,
            values: vec![],
        };
        let d = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
        let off = |x: f64, y: f64| [[x, y, 0.0], [0.0, x, 0.0], [0.0, 0.0, x]];
        let mut values = vec![d, off(-1.0, 0.5), crate::math::transpose(&off(-1.0, 0.5 + 1e-12)), d];
        symmetrise(&system, &mut values, SymmetrySlack::Double).unwrap();
        assert_eq!(values[1][0][1], values[2][1][0]);
        let mut values = vec![d, off(-1.0, 0.5), off(-1.0, 0.5), d];
        let error = symmetrise(&system, &mut values, SymmetrySlack::Double).unwrap_err();
        assert_eq!((error.fault, error.index, error.value), (Fault::InvalidArgument, 1, 0.5));
        let mut values = vec![d, off(-1.0, 0.0), off(-1.0, 0.0), off(0.0, 0.0)];
        let error = symmetrise(&system, &mut values, SymmetrySlack::Double).unwrap_err();
        assert_eq!((error.fault, error.index), (Fault::SingularSystem, 1));
    }
}
