//! Accounts of a step: what its parts add up to, and the result that the host pulls.

use super::part::{PartEnd, SolvedContact};
use crate::constraint::Metric;
use crate::contact_search::{Contact, PairKind};
use crate::math::{Vec3, add_scaled, cross, dot, norm, scale, sub};
use crate::model::{Body, ContactRecord, Drives, Kind, Model, State, StepReport, StepResult};
use std::time::Instant;

/// Microseconds since `from`, which is set to now.
pub fn lap(from: &mut Instant) -> f64 {
    let now = Instant::now();
    let microseconds = now.duration_since(*from).as_secs_f64() * 1e6;
    *from = now;
    microseconds
}

/// Sums over the parts of a step. Its room is used again for the next one.
#[derive(Default)]
pub struct StepAccount {
    /// State reached.
    pub state: State,
    /// Mean impulse per block so far, weighted by duration `[N s]`.
    pub impulses: Vec<Vec3>,
    /// Velocities of the last part.
    pub end_velocities: Vec<Vec3>,
    /// The last part.
    pub last: PartEnd,
    /// Duration of the last part `[s]`.
    pub last_dt: f64,
    /// What is reported.
    pub report: StepReport,
}

impl StepAccount {
    /// No part done yet, from `state`.
    pub fn begin(&mut self, model: &Model, state: &State, drives: &Drives) {
        self.state.clone_from(state);
        self.impulses.clear();
        self.impulses.resize(model.block_count, [0.0; 3]);
        self.end_velocities.clone_from(&drives.velocities);
        self.last_dt = 0.0;
        self.report = StepReport { certified_fraction: 1.0, ..StepReport::default() };
    }

    /// Takes over a clean part that lasts `share` of the step, and leaves the one before in its place.
    pub fn add_part(&mut self, model: &Model, metric: &Metric, part: &mut PartEnd, share: f64, dt: f64) {
        // A HOST body's parts are shares of one path, those of a MODEL body are steps of their own.
        let weight = |body: &Body| if body.description.dynamics.is_some() { 1.0 } else { share };
        for body in &model.bodies {
            for block in body.blocks.clone() {
                self.impulses[block] = add_scaled(self.impulses[block], weight(body), part.block_impulses[block]);
            }
        }
        let report = &mut self.report;
        report.parts += 1;
        let mut angular_error = [0.0; 3];
        for SolvedContact { contact, required_gap, solved, .. } in part.contacts.iter().filter(|c| c.is_row) {
            let f = solved.impulse;
            let share = contact.pair.bodies(model).into_iter().map(|b| weight(&model.bodies[b])).fold(share, f64::max);
            let on_fixed = fixed_share(model, metric, contact);
            report.momentum_taken = add_scaled(report.momentum_taken, share * on_fixed, f);
            let regained = (required_gap - contact.start_gap).max(0.0);
            report.recovery_work += share * dot(contact.normal, f) * regained / dt;
            if contact.pair.kind != PairKind::VertexHalfSpace && on_fixed == 0.0 {
                let arm = start_separation(contact, &self.state.positions);
                angular_error = add_scaled(angular_error, share, cross(arm, f));
            }
        }
        report.angular_momentum_error += norm(angular_error);
        self.state.clone_from(&part.end);
        self.end_velocities.clone_from(&part.velocities);
        std::mem::swap(&mut self.last, part);
        self.last_dt = dt;
    }

    /// Books the zones projected, the rigid ones and the vertices held in a part that lasts `share` of the step.
    pub fn add_fail_safe(&mut self, [projected, rigid, held]: [u32; 3], share: f64, momentum_taken: Vec3) {
        self.report.projected_zones += projected;
        self.report.rigid_zones += rigid;
        self.report.held_vertices += held;
        self.report.momentum_taken = add_scaled(self.report.momentum_taken, share, momentum_taken);
    }

    /// The report, contacts counted.
    pub fn finished_report(&mut self) -> StepReport {
        let (report, contacts) = (&mut self.report, &self.last.contacts);
        report.contacts = contacts.iter().filter(|c| c.is_row).count() as u32;
        report.active_contacts = contacts.iter().filter(|c| norm(c.solved.impulse) > 0.0).count() as u32;
        report.clone()
    }

    /// Writes what the host pulls besides the end state.
    ///
    /// A pinched step ends in no part's velocity: its mean stands for it, so that no host goes on at the unconstrained one.
    pub fn write_result(&mut self, model: &Model, start: &State, dt: f64, result: &mut StepResult) {
        let StepResult { velocities, end_velocities, impulses, contacts } = result;
        mean_velocities(model, start, &self.state, dt, velocities);
        if self.report.certified_fraction < 1.0 {
            self.end_velocities.clone_from(velocities);
            self.state.velocities.clone_from(velocities);
        }
        end_velocities.clone_from(&self.end_velocities);
        std::mem::swap(impulses, &mut self.impulses);
        contact_records(model, &self.last, &self.state, contacts);
    }
}

/// Share of a contact's impulse that its second and first primitive pass on to infinite masses, signed as on the
/// first: `- sum of the weights that rows feel`.
fn fixed_share(model: &Model, metric: &Metric, contact: &Contact) -> f64 {
    let mut felt = 0.0;
    for k in 0..4 {
        let vertex = contact.vertices[k] as usize;
        let body = &model.bodies[model.vertex_body[vertex] as usize];
        let fixed = &metric.fixed;
        felt += contact.weights[k]
            * match body.description.kind {
                Kind::Deformable { .. } => body.carriers(vertex).filter(|(b, _)| !fixed[*b]).map(|(_, w)| w).sum(),
                Kind::Rigid { .. } if !fixed[body.blocks.start] => 1.0,
                _ => 0.0,
            };
    }
    // Weights sum to zero up to rounding where everything moves.
    if felt.abs() <= 64.0 * f64::EPSILON { 0.0 } else { -felt }
}

fn start_separation(contact: &Contact, x0: &[Vec3]) -> Vec3 {
    crate::contact_search::weighted(&contact.weights, &crate::contact_search::gather(contact.vertices, x0))
}

/// `(x1 - x0)/dt` per block; angular blocks the mean angular velocity.
fn mean_velocities(model: &Model, start: &State, end: &State, dt: f64, velocities: &mut Vec<Vec3>) {
    velocities.clear();
    velocities.resize(model.block_count, [0.0; 3]);
    for (index, body) in model.bodies.iter().enumerate() {
        match body.description.kind {
            Kind::Deformable { .. } => {
                for (vertex, block) in body.nodes().zip(body.blocks.clone()) {
                    velocities[block] = scale(1.0 / dt, sub(end.positions[vertex], start.positions[vertex]));
                }
            }
            Kind::Rigid { .. } => {
                let (linear, angular) = start.poses[index].velocity_to(&end.poses[index], dt);
                velocities[body.blocks.start] = linear;
                velocities[body.blocks.start + 1] = angular;
            }
            Kind::Kinematic { .. } | Kind::HalfSpace(_) => {}
        }
    }
}

fn contact_records(model: &Model, last: &PartEnd, end: &State, records: &mut Vec<ContactRecord>) {
    let record = |SolvedContact { contact, solved, .. }: &SolvedContact| ContactRecord {
        bodies: contact.pair.bodies(model).map(|b| model.bodies[b].description.key),
        kind: contact.pair.kind as u32,
        features: contact.pair.local_features(model),
        weights: contact.weights,
        point: contact.point(&end.positions),
        normal: contact.normal,
        distance: contact.gap(&end.positions),
        impulse: solved.impulse,
        state: match (norm(solved.impulse) > 0.0, solved.sticks) {
            (false, _) => 0,
            (true, true) => 1,
            (true, false) => 2,
        },
        key: contact.pair.key(model, contact.ordinal).number(),
    };
    records.clear();
    records.extend(last.contacts.iter().map(record));
}
