//! What a host pulls: end states, results, contacts, witnesses, the hash.

use super::body::Body;
use super::{Fault, World, WorldError};
use crate::contact_search::{BodyFilter, intersections};
use crate::kinematics::Pose;
use crate::math::{Vec3, ZERO};
use crate::model::{ContactRecord, HalfSpace, Kind, Precision, Surface, Witness};
use crate::parallel::Par;
use std::sync::Arc;

/// Kind of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyKind {
    /// Free vertices, driven by the host.
    Deformable,
    /// Rigid, driven by the host.
    Rigid,
    /// Prescribed positions.
    KinematicMesh,
    /// Prescribed poses.
    KinematicPosed,
    /// A half-space.
    HalfSpace,
}

/// What a body consists of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyInfo {
    /// Kind.
    pub kind: BodyKind,
    /// Vertices.
    pub vertices: usize,
    /// Edges, those of triangles included.
    pub edges: usize,
    /// Triangles.
    pub triangles: usize,
    /// Entries that velocities and impulses have: one per node (a vertex, or a node of the tetrahedra that carry the
    /// vertices), or one for a rigid body, or none.
    pub velocities: usize,
    /// Half thickness in use `[m]`.
    pub half_thickness: f64,
    /// The host's own number.
    pub user_key: u64,
}

/// A vector of a step's outcome, per vertex of a deformable body or one for a rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// `(x1 - x0)/dt` `[m/s]`
    Velocity,
    /// Velocity of the last part of a divided step `[m/s]`.
    EndVelocity,
    /// Contact impulse over the whole step `[N s]`.
    Impulse,
}

impl World {
    /// What a body consists of.
    pub fn body_info(&self, id: u64) -> Result<BodyInfo, WorldError> {
        let body = self.bodies.get(id)?;
        let surface = &body.description.surface;
        let (kind, velocities) = match body.description.kind {
            Kind::Deformable { .. } => (BodyKind::Deformable, body.blocks()),
            Kind::Rigid { .. } => (BodyKind::Rigid, 1),
            Kind::Kinematic { posed: true } => (BodyKind::KinematicPosed, 0),
            Kind::Kinematic { posed: false } => (BodyKind::KinematicMesh, 0),
            Kind::HalfSpace(_) => (BodyKind::HalfSpace, 0),
        };
        let default = || crate::model::default_half_thickness(surface);
        Ok(BodyInfo {
            kind,
            vertices: body.vertex_count(),
            edges: surface.edges.len(),
            triangles: surface.faces.len(),
            velocities,
            half_thickness: body.description.half_thickness.unwrap_or_else(default),
            user_key: body.user_key,
        })
    }

    /// Number format in which the host takes the end state of a body.
    pub fn precision(&self, id: u64) -> Result<Precision, WorldError> {
        Ok(self.bodies.get(id)?.description.precision)
    }

    /// Collision surface of a body.
    pub fn surface(&self, id: u64) -> Result<Arc<Surface>, WorldError> {
        Ok(self.bodies.get(id)?.description.surface.clone())
    }

    /// Positions of the vertices: certified after a step, as pushed before it.
    pub fn positions(&self, id: u64) -> Result<&[Vec3], WorldError> {
        let body = self.bodies.get(id)?;
        Ok(&body.positions[..body.vertex_count().min(body.positions.len())])
    }

    /// Positions of the nodes of a deformable body: its vertices, or what carries them.
    pub fn node_positions(&self, id: u64) -> Result<&[Vec3], WorldError> {
        let body = self.bodies.get(id)?;
        match body.description.kind {
            Kind::Deformable { .. } => Ok(&body.positions[body.first_node()..]),
            _ => Err(without("nodes", id)),
        }
    }

    /// Pose of a rigid or posed kinematic body.
    pub fn pose(&self, id: u64) -> Result<Pose, WorldError> {
        let body = self.bodies.get(id)?;
        if body.posed() { Ok(body.pose) } else { Err(without("pose", id)) }
    }

    /// Plane of a half-space.
    pub fn half_space(&self, id: u64) -> Result<HalfSpace, WorldError> {
        let body = self.bodies.get(id)?;
        match body.description.kind {
            Kind::HalfSpace(_) => Ok(body.half_space),
            _ => Err(without("plane", id)),
        }
    }

    /// Outcome of the last step, linear; zero before the first.
    pub fn outcome(&self, id: u64, outcome: Outcome) -> Result<Vec<Vec3>, WorldError> {
        let body = self.bodies.get(id)?;
        let count = self.body_info(id)?.velocities;
        if count == 0 {
            return Err(without("velocities and impulses", id));
        }
        let blocks = body.outcome(outcome);
        Ok(if blocks.is_empty() { vec![ZERO; count] } else { blocks[..count].to_vec() })
    }

    /// Outcome of the last step of a rigid body, angular, about its centre of mass; zero before the first.
    pub fn angular_outcome(&self, id: u64, outcome: Outcome) -> Result<Vec3, WorldError> {
        let body = self.bodies.get(id)?;
        match body.description.kind {
            Kind::Rigid { .. } => Ok(body.outcome(outcome).get(1).copied().unwrap_or(ZERO)),
            _ => Err(without("angular velocity and impulse", id)),
        }
    }

    /// Contacts of the last step in stable order; bodies by key, see [`World::id_of_key`].
    pub fn contacts(&self) -> &[ContactRecord] {
        &self.result.contacts
    }

    /// Witnesses of the last check, or of the last step that was refused or pinched.
    pub fn witnesses(&self) -> &[Witness] {
        &self.witnesses
    }

    /// Number of intersections of the present state, by exact predicates; their witnesses are kept.
    pub fn check(&mut self, par: Par) -> Result<usize, WorldError> {
        self.build_model()?;
        self.gather_state();
        let filter = BodyFilter::new(&self.model);
        self.witnesses = intersections(&self.model, &filter, &self.state, par).witnesses;
        Ok(self.witnesses.len())
    }

    /// Id of the body that a contact or witness names by its key.
    pub fn id_of_key(&self, key: u64) -> u64 {
        self.bodies.id_of_key(key)
    }
}

impl Body {
    fn outcome(&self, outcome: Outcome) -> &[Vec3] {
        match outcome {
            Outcome::Velocity => &self.result_velocities,
            Outcome::EndVelocity => &self.result_end_velocities,
            Outcome::Impulse => &self.result_impulses,
        }
    }
}

fn without(what: &str, id: u64) -> WorldError {
    WorldError::new(Fault::Unsupported, format!("this kind of body has no {what}")).object(id)
}
