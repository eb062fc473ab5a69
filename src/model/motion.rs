//! From velocities to end states: one segment of a step, of which an undivided step has one.

use super::{Body, Drives, HalfSpace, Kind, Model, Precision, State};
use crate::kinematics::{Pose, place_vertices, rounded_to_single};
use crate::math::{Vec3, add_scaled, lerp, unit};

impl Model {
    /// A state with every vertex at rest, poses the identity, half-spaces as described.
    pub fn rest_state(&self) -> State {
        let mut state = State::default();
        self.put_at_rest(&mut state);
        state
    }

    /// Makes a state that of [`Model::rest_state`], in the room that it has.
    pub fn put_at_rest(&self, state: &mut State) {
        let half_space = |body: &Body| match body.description.kind {
            Kind::HalfSpace(half_space) => half_space,
            _ => HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 },
        };
        let State { positions, poses, half_spaces, velocities } = state;
        positions.clone_from(&self.rest);
        poses.clear();
        poses.resize(self.bodies.len(), Pose::IDENTITY);
        half_spaces.clear();
        half_spaces.extend(self.bodies.iter().map(half_space));
        velocities.clear();
        velocities.resize(self.block_count, [0.0; 3]);
    }

    /// Puts a rigid or posed body at `pose`: pose and vertices, rounded to the body's format.
    pub fn set_pose(&self, state: &mut State, body: usize, pose: Pose) {
        let b = &self.bodies[body];
        let single = b.description.precision == Precision::Single;
        state.poses[body] = if single { pose.rounded_to_single() } else { pose };
        place_vertices(
            &state.poses[body],
            &self.rest[b.vertices.clone()],
            single,
            &mut state.positions[b.vertices.clone()],
        );
    }

    /// Puts the embedded points of a deformable body where its nodes carry them, rounded if `single`.
    pub fn carry_points(&self, state: &mut State, body: usize, single: bool) {
        let b = &self.bodies[body];
        let Some(embedding) = &b.description.embedding else { return };
        let (points, nodes) = state.positions[b.vertices.clone()].split_at_mut(b.vertices.len() - b.blocks.len());
        for (i, x) in points.iter_mut().enumerate() {
            let placed = embedding.place(i, nodes);
            *x = if single { rounded_to_single(placed) } else { placed };
        }
    }

    /// Drives that ask for nothing: zero velocities, scripted bodies stay.
    pub fn idle_drives(&self, state: &State) -> Drives {
        Drives {
            velocities: vec![[0.0; 3]; self.block_count],
            target_positions: state.positions.clone(),
            target_poses: state.poses.clone(),
            target_half_spaces: state.half_spaces.clone(),
            systems: Vec::new(),
            gravity: [0.0; 3],
            wind: [0.0; 3],
            attachments: vec![[[0.0; 3]; 2]; self.attachment_count],
        }
    }
}

/// A part of a step, from fraction `from` to fraction `to` of its scripted motion.
#[derive(Clone, Copy)]
pub struct Segment<'a> {
    /// The model.
    pub model: &'a Model,
    /// What drives the step.
    pub drives: &'a Drives,
    /// State at the start of the whole step, from which scripted paths run.
    pub step_start: &'a State,
    /// State at the start of this segment.
    pub start: &'a State,
    /// Fraction at the start.
    pub from: f64,
    /// Fraction at the end.
    pub to: f64,
    /// Duration of the segment `[s]`.
    pub dt: f64,
}

impl Segment<'_> {
    /// The state after `share` (in 0..=1) of the segment with these block velocities; `rounded` to the host's formats.
    ///
    /// Blocks without velocity keep their bits. Cost: linear in vertices.
    pub fn end_state(&self, velocities: &[Vec3], share: f64, rounded: bool, out: &mut State) {
        out.positions.clone_from(&self.start.positions);
        out.poses.clone_from(&self.start.poses);
        out.half_spaces.clone_from(&self.start.half_spaces);
        out.velocities.clear();
        out.velocities.extend_from_slice(velocities);
        for index in 0..self.model.bodies.len() {
            self.move_body(index, velocities, share, rounded, out);
        }
    }

    fn move_body(&self, index: usize, velocities: &[Vec3], share: f64, rounded: bool, out: &mut State) {
        let body = &self.model.bodies[index];
        let single = rounded && body.description.precision == Precision::Single;
        let dt = self.dt * share;
        let fraction = if share >= 1.0 { self.to } else { self.from + share * (self.to - self.from) };
        match &body.description.kind {
            Kind::Deformable { .. } => {
                for (vertex, block) in body.nodes().zip(body.blocks.clone()) {
                    let x = add_scaled(out.positions[vertex], dt, velocities[block]);
                    out.positions[vertex] = if single { rounded_to_single(x) } else { x };
                }
                self.model.carry_points(out, index, single);
            }
            Kind::Rigid { .. } => {
                let (linear, angular) = (velocities[body.blocks.start], velocities[body.blocks.start + 1]);
                if linear != [0.0; 3] || angular != [0.0; 3] {
                    self.put(index, self.start.poses[index].advanced(linear, angular, dt), single, out);
                }
            }
            Kind::Kinematic { posed: true } => {
                let (start, end) = (&self.step_start.poses[index], &self.drives.target_poses[index]);
                if start != end {
                    self.put(index, start.interpolated(end, fraction), single, out);
                }
            }
            Kind::Kinematic { posed: false } => {
                for vertex in body.vertices.clone() {
                    let x = self.scripted(vertex, fraction);
                    out.positions[vertex] = if single { rounded_to_single(x) } else { x };
                }
            }
            Kind::HalfSpace(_) => {
                let (a, b) = (&self.step_start.half_spaces[index], &self.drives.target_half_spaces[index]);
                out.half_spaces[index] = interpolated_half_space(a, b, fraction);
            }
        }
    }

    /// Where a scripted vertex stands at a fraction of the step.
    pub fn scripted(&self, vertex: usize, fraction: f64) -> Vec3 {
        let (a, b) = (self.step_start.positions[vertex], self.drives.target_positions[vertex]);
        if a == b { a } else { lerp(a, b, fraction) }
    }

    fn put(&self, index: usize, pose: Pose, single: bool, out: &mut State) {
        let body = &self.model.bodies[index];
        out.poses[index] = if single { pose.rounded_to_single() } else { pose };
        let rest = &self.model.rest[body.vertices.clone()];
        place_vertices(&out.poses[index], rest, single, &mut out.positions[body.vertices.clone()]);
    }
}

/// Normal and offset linearly, the normal renormalised; exact at both ends.
fn interpolated_half_space(a: &HalfSpace, b: &HalfSpace, fraction: f64) -> HalfSpace {
    if a == b || fraction <= 0.0 {
        return *a;
    }
    if fraction >= 1.0 {
        return *b;
    }
    let normal =
        if a.normal == b.normal { a.normal } else { unit(lerp(a.normal, b.normal, fraction)).unwrap_or(a.normal) };
    HalfSpace { normal, offset: (1.0 - fraction) * a.offset + fraction * b.offset }
}
