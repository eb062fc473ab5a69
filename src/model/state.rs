//! What a step changes, and what the host drives it with.

use super::System;
use crate::kinematics::Pose;
use crate::math::Vec3;

/// An analytic half-space: points with `normal · x >= offset` are free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, towards the free side.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal `[m]`.
    pub offset: f64,
}

/// State at the start of a step; [`crate::implicit_contact::advance`] leaves the end state in it.
#[derive(Debug, Default)]
pub struct State {
    /// Position of every collision vertex `[m]`. For rigid bodies derived from the pose.
    pub positions: Vec<Vec3>,
    /// Pose per body; the identity for bodies without one.
    pub poses: Vec<Pose>,
    /// Half-space per body; meaningless for other bodies.
    pub half_spaces: Vec<HalfSpace>,
    /// Velocity per block `[m/s]`, angular blocks `[rad/s]`: what MODEL bodies start the next step with. Written for all.
    pub velocities: Vec<Vec3>,
}

impl Clone for State {
    fn clone(&self) -> State {
        let mut state = State::default();
        state.clone_from(self);
        state
    }

    /// Keeps the room that is there.
    fn clone_from(&mut self, from: &State) {
        let State { positions, poses, half_spaces, velocities } = from;
        self.positions.clone_from(positions);
        self.poses.clone_from(poses);
        self.half_spaces.clone_from(half_spaces);
        self.velocities.clone_from(velocities);
    }
}

/// What the host asks for in a step: unconstrained velocities and scripted targets.
#[derive(Clone, Debug, Default)]
pub struct Drives {
    /// Displacement velocity `v* = (x* - x0)/dt` per block `[m/s]`; angular blocks `[rad/s]`, world frame. Not read for
    /// MODEL bodies.
    pub velocities: Vec<Vec3>,
    /// End position per vertex; read for kinematic bodies that are not posed, and for pinned nodes of MODEL bodies.
    pub target_positions: Vec<Vec3>,
    /// End pose per body; read for posed kinematic bodies.
    pub target_poses: Vec<Pose>,
    /// End half-space per body.
    pub target_half_spaces: Vec<HalfSpace>,
    /// Host matrices of this step.
    pub systems: Vec<System>,
    /// Acceleration of gravity on MODEL bodies `[m/s^2]`.
    pub gravity: Vec3,
    /// Velocity of the air around MODEL bodies `[m/s]`.
    pub wind: Vec3,
    /// Targets of springs at the start and the end of the step, by [`super::Body::attachments`] `[m]`.
    pub attachments: Vec<[Vec3; 2]>,
}

/// Vectors per block of a body, by its key: what is carried from step to step.
pub type ByBody = Vec<(u64, Vec<Vec3>)>;

/// Writes lists by body, in the room that there is.
pub fn write_by_body<V: Iterator<Item = Vec3>>(out: &mut ByBody, lists: impl Iterator<Item = (u64, V)>) {
    let mut written = 0;
    for (key, vectors) in lists {
        if out.len() == written {
            out.push((key, Vec::new()));
        }
        let (own, list) = &mut out[written];
        *own = key;
        list.clear();
        list.extend(vectors);
        written += 1;
    }
    out.truncate(written);
}

/// What a step gives back besides the end state.
#[derive(Clone, Debug, Default)]
pub struct StepResult {
    /// `(x1 - x0)/dt` per block, the mean over the parts of a divided step.
    pub velocities: Vec<Vec3>,
    /// Velocity of the last part per block, for the next step's dynamics.
    pub end_velocities: Vec<Vec3>,
    /// Contact impulse over the whole step per block `[N s]`; angular blocks `[N m s]` about the centre of mass.
    pub impulses: Vec<Vec3>,
    /// Contacts of the last part, in stable order.
    pub contacts: Vec<super::ContactRecord>,
}
