//! What a host pushes before a step: start states, displacement velocities, targets.

use super::body::{Body, Certified, check_masses, checked_half_space, checked_pose, round_all};
use super::model_body::with_points;
use super::{Fault, World, WorldError};
use crate::kinematics::Pose;
use crate::math::Vec3;
use crate::model::{HalfSpace, Kind};

impl World {
    /// Sets the start positions of a deformable body, or of a kinematic body without a pose.
    ///
    /// Positions that differ from the state in which the last step ended are swept-checked by the next step, unless
    /// `teleport` says that the body jumps.
    pub fn push_positions(&mut self, id: u64, positions: Vec<Vec3>, teleport: bool) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if body.posed() || matches!(body.description.kind, Kind::HalfSpace(_)) {
            return Err(unsupported("this kind of body has no start positions: push its pose or plane").object(id));
        }
        if body.description.embedding.is_some() {
            return Err(unsupported("the vertices of this body are carried by its nodes: push those").object(id));
        }
        self.push_node_positions(id, positions, teleport)
    }

    /// Sets the start positions of the nodes of a deformable body: of its vertices, or of what carries them. As positions.
    pub fn push_node_positions(&mut self, id: u64, mut positions: Vec<Vec3>, teleport: bool) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if body.posed() || matches!(body.description.kind, Kind::HalfSpace(_)) {
            return Err(unsupported("this kind of body has no nodes").object(id));
        }
        let count = body.positions.len() - body.first_node();
        check_count(positions.len(), count, "positions").map_err(|e| e.object(id))?;
        round_all(&mut positions, body.description.precision, "position").map_err(|e| e.object(id))?;
        let positions = with_points(body.description.embedding.as_deref(), positions, body.description.precision);
        body.before_push(teleport, body.positions == positions);
        body.positions = positions;
        Ok(())
    }

    /// Sets the start pose of a rigid or posed kinematic body; `teleport` as for positions.
    pub fn push_pose(&mut self, id: u64, pose: Pose, teleport: bool) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if !body.posed() {
            return Err(unsupported("this kind of body has no pose").object(id));
        }
        let pose = checked_pose(pose, body.description.precision).map_err(|e| e.object(id))?;
        if pose == body.pose {
            body.before_push(teleport, true);
            return Ok(());
        }
        let positions = body.posed_vertices(&pose).map_err(|e| e.object(id))?;
        body.before_push(teleport, false);
        body.positions = positions;
        body.pose = pose;
        Ok(())
    }

    /// Sets the start plane of a half-space; `teleport` as for positions.
    pub fn push_half_space(&mut self, id: u64, plane: HalfSpace, teleport: bool) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if !matches!(body.description.kind, Kind::HalfSpace(_)) {
            return Err(unsupported("the body is not a half-space").object(id));
        }
        let plane = checked_half_space(plane).map_err(|e| e.object(id))?;
        body.before_push(teleport, plane == body.half_space);
        body.half_space = plane;
        Ok(())
    }

    /// Sets displacement velocities `v* = (x* - x0)/dt`: one per vertex of a deformable body, one for a rigid body.
    pub fn push_velocities(&mut self, id: u64, velocities: Vec<Vec3>) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        check_finite(&velocities, "velocity").map_err(|e| e.object(id))?;
        match body.description.kind {
            Kind::Deformable { .. } => {
                check_count(velocities.len(), body.velocities.len(), "velocities").map_err(|e| e.object(id))?;
                body.velocities = velocities;
            }
            Kind::Rigid { .. } => {
                check_count(velocities.len(), 1, "velocities").map_err(|e| e.object(id))?;
                body.velocities[0] = velocities[0];
            }
            _ => return Err(unsupported("a kinematic body takes targets, not velocities").object(id)),
        }
        Ok(())
    }

    /// Sets the angular displacement velocity of a rigid body, world axes.
    pub fn push_angular_velocity(&mut self, id: u64, velocity: Vec3) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        check_finite(&[velocity], "angular velocity").map_err(|e| e.object(id))?;
        if !matches!(body.description.kind, Kind::Rigid { .. }) {
            return Err(unsupported("only rigid bodies have an angular velocity").object(id));
        }
        body.velocities[1] = velocity;
        Ok(())
    }

    /// Sets the end positions of the next step of a kinematic body without a pose.
    pub fn push_target_positions(&mut self, id: u64, mut targets: Vec<Vec3>) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        let own = body.description.dynamics.is_some() && matches!(body.description.kind, Kind::Deformable { .. });
        if !own && !matches!(body.description.kind, Kind::Kinematic { posed: false }) {
            let message = "only kinematic bodies without a pose, and nodes of MODEL bodies, have target positions";
            return Err(unsupported(message).object(id));
        }
        let count = body.positions.len() - body.first_node();
        check_count(targets.len(), count, "target positions").map_err(|e| e.object(id))?;
        round_all(&mut targets, body.description.precision, "target position").map_err(|e| e.object(id))?;
        body.target_positions = Some(targets);
        Ok(())
    }

    /// Sets where the springs to targets of a MODEL body pull at the end of the next step; between, the way is straight.
    pub fn push_attachment_targets(&mut self, id: u64, targets: Vec<Vec3>) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if body.attachments.is_empty() {
            return Err(unsupported("the body has no springs to targets").object(id));
        }
        check_count(targets.len(), body.attachments.len(), "spring targets").map_err(|e| e.object(id))?;
        check_finite(&targets, "spring target").map_err(|e| e.object(id))?;
        body.attachment_targets = Some(targets);
        Ok(())
    }

    /// Sets the end pose of the next step of a posed kinematic body.
    pub fn push_target_pose(&mut self, id: u64, pose: Pose) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if !matches!(body.description.kind, Kind::Kinematic { posed: true }) {
            return Err(unsupported("only posed kinematic bodies have a target pose").object(id));
        }
        let pose = checked_pose(pose, body.description.precision).map_err(|e| e.object(id))?;
        body.posed_vertices(&pose).map_err(|e| e.object(id))?;
        body.target_pose = Some(pose);
        Ok(())
    }

    /// Sets the plane of a half-space at the end of the next step.
    pub fn push_target_half_space(&mut self, id: u64, plane: HalfSpace) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        if !matches!(body.description.kind, Kind::HalfSpace(_)) {
            return Err(unsupported("the body is not a half-space").object(id));
        }
        body.target_half_space = Some(checked_half_space(plane).map_err(|e| e.object(id))?);
        Ok(())
    }

    /// Sets the lumped masses of a deformable body, or the mass of a rigid one.
    pub fn push_masses(&mut self, id: u64, values: Vec<f64>) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        match &mut body.description.kind {
            Kind::Deformable { masses, .. } => {
                check_count(values.len(), masses.len(), "masses").map_err(|e| e.object(id))?;
                check_masses(&values).map_err(|e| e.object(id))?;
                *masses = values;
            }
            Kind::Rigid { mass, .. } => {
                check_count(values.len(), 1, "masses").map_err(|e| e.object(id))?;
                check_masses(&values).map_err(|e| e.object(id))?;
                *mass = values[0];
            }
            _ => return Err(unsupported("a kinematic body has no mass").object(id)),
        }
        self.model_current = false;
        Ok(())
    }

    /// Sets which vertices of a deformable body follow their displacement velocity exactly.
    pub fn push_pinned(&mut self, id: u64, flags: Vec<bool>) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        let Kind::Deformable { pinned, .. } = &mut body.description.kind else {
            return Err(unsupported("only deformable bodies have pinned vertices").object(id));
        };
        check_count(flags.len(), pinned.len(), "pin flags").map_err(|e| e.object(id))?;
        *pinned = flags;
        self.model_current = false;
        Ok(())
    }
}

impl Body {
    /// Keeps or forgets the certified state ahead of a push of another start state.
    fn before_push(&mut self, teleport: bool, same: bool) {
        if teleport {
            self.certified = None;
            self.stepped &= same;
        } else if !same && self.stepped && self.certified.is_none() {
            self.certified =
                Some(Certified { positions: self.positions.clone(), pose: self.pose, half_space: self.half_space });
        }
    }
}

fn unsupported(message: &str) -> WorldError {
    WorldError::new(Fault::Unsupported, message)
}

fn check_count(given: usize, wanted: usize, what: &str) -> Result<(), WorldError> {
    if given == wanted {
        return Ok(());
    }
    let message = format!("{given} {what} given, {wanted} needed");
    Err(WorldError::new(Fault::BufferLayout, message).value(given as f64))
}

fn check_finite(vectors: &[Vec3], what: &str) -> Result<(), WorldError> {
    for (index, vector) in vectors.iter().enumerate() {
        if let Some(value) = vector.iter().find(|value| !value.is_finite()) {
            let message = format!("{what} {index} is not finite");
            return Err(WorldError::new(Fault::NonFinite, message).index(index).value(*value));
        }
    }
    Ok(())
}
