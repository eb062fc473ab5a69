//! What moves a body that the library drives itself (MODEL): constant between steps.

use crate::energy::{Forces, Pattern};

/// Dynamics of a MODEL body.
#[derive(Clone, Debug, PartialEq)]
// Held behind a pointer, one per body.
#[allow(clippy::large_enum_variant)]
pub enum Dynamics {
    /// Nodes with masses, and the energies over them.
    Deformable {
        /// The energies.
        forces: Forces,
        /// The blocks of the matrix that they fill.
        pattern: Pattern,
    },
    /// Free rigid motion.
    Rigid {
        /// Rate at which the velocity of the centre of mass decays `[1/s]`.
        linear_damping: f64,
        /// Rate at which the angular velocity decays `[1/s]`.
        angular_damping: f64,
    },
}

impl Dynamics {
    /// Dynamics of `count` nodes. Errors: an energy that does not fit, with what, place and value.
    pub fn deformable(forces: Forces, count: usize) -> Result<Dynamics, crate::energy::ForcesFault> {
        match forces.fault(count) {
            Some(fault) => Err(fault),
            None => {
                let pattern = Pattern::new(&forces, count);
                Ok(Dynamics::Deformable { forces, pattern })
            }
        }
    }

    /// Number of springs to targets.
    pub fn attachments(&self) -> usize {
        match self {
            Dynamics::Deformable { forces, .. } => forces.attachments.len(),
            Dynamics::Rigid { .. } => 0,
        }
    }
}
