//! Kinetic and elastic energy of the bodies of a scene, and where their centres of mass are.

use crate::energy::Forces;
use crate::kinematics::world_inertia;
use crate::math::{Mat3, Vec3, add_scaled, dot, mat_vec, norm_squared, scale};
use crate::world::{Outcome, World, WorldError};
use std::sync::Arc;

/// What the energies of a body are made of.
pub enum Energies {
    /// Prescribed motion.
    None,
    Nodes {
        masses: Vec<f64>,
        forces: Arc<Forces>,
    },
    Rigid {
        mass: f64,
        inertia: Mat3,
    },
}

/// Where a body is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Centre {
    /// `[m]`
    pub position: Vec3,
    /// `[m/s]`
    pub velocity: Vec3,
}

impl Energies {
    /// `[kg]`
    pub fn mass(&self) -> f64 {
        match self {
            Energies::None => 0.0,
            Energies::Nodes { masses, .. } => masses.iter().sum(),
            Energies::Rigid { mass, .. } => *mass,
        }
    }

    /// Kinetic energy at the end of the last step `[J]`.
    pub fn kinetic(&self, world: &World, id: u64) -> Result<f64, WorldError> {
        Ok(match self {
            Energies::None => 0.0,
            Energies::Nodes { masses, .. } => {
                let velocities = world.outcome(id, Outcome::EndVelocity)?;
                masses.iter().zip(&velocities).map(|(m, v)| 0.5 * m * norm_squared(*v)).sum()
            }
            Energies::Rigid { mass, inertia } => {
                let velocity = world.outcome(id, Outcome::EndVelocity)?[0];
                let angular = world.angular_outcome(id, Outcome::EndVelocity)?;
                let turned = mat_vec(&world_inertia(&world.pose(id)?, inertia), angular);
                0.5 * (mass * norm_squared(velocity) + dot(angular, turned))
            }
        })
    }

    /// Elastic energy `[J]`.
    pub fn elastic(&self, world: &World, id: u64) -> Result<f64, WorldError> {
        match self {
            Energies::Nodes { forces, .. } => Ok(forces.elastic_energy(world.node_positions(id)?)),
            _ => Ok(0.0),
        }
    }

    /// Centre of mass.
    pub fn centre(&self, world: &World, id: u64) -> Result<Centre, WorldError> {
        match self {
            Energies::None => Ok(Centre::default()),
            Energies::Nodes { masses, .. } => {
                let mean = |values: &[Vec3]| {
                    let sum = masses.iter().zip(values).fold([0.0; 3], |sum, (m, x)| add_scaled(sum, *m, *x));
                    scale(1.0 / self.mass(), sum)
                };
                let velocity = mean(&world.outcome(id, Outcome::EndVelocity)?);
                Ok(Centre { position: mean(world.node_positions(id)?), velocity })
            }
            Energies::Rigid { .. } => {
                let velocity = world.outcome(id, Outcome::EndVelocity)?[0];
                Ok(Centre { position: world.pose(id)?.position, velocity })
            }
        }
    }
}
