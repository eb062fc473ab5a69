//! From contacts to rows: weights, levers, friction frames, targets.

use super::{Angular, Metric, RowSet};
use crate::contact_search::{Contact, PairKind, distance_along, gather, weighted};
use crate::kinematics::{chord_lever, turn};
use crate::math::{Vec3, add_scaled, cross, dot, norm, scale, sub, tangents, unit};
use crate::model::{Kind, Model, State};

/// The tentative motion that rows are linearised about: exact there, whatever the levers.
pub struct Linearisation<'a> {
    /// State at the start of the segment.
    pub start: &'a State,
    /// Tentative end state, not rounded.
    pub end: &'a State,
    /// Tentative velocity per block.
    pub velocities: &'a [Vec3],
    /// Unconstrained velocity per block.
    pub unconstrained: &'a [Vec3],
    /// Duration `[s]`.
    pub dt: f64,
}

impl Linearisation<'_> {
    /// What contacts changed of a block's velocity.
    fn response(&self, block: usize) -> Vec3 {
        sub(self.velocities[block], self.unconstrained[block])
    }
}

/// Rows of the contacts that something movable feels, and the contact behind each.
#[derive(Clone, Debug, Default)]
pub struct BuiltRows {
    /// The rows.
    pub rows: RowSet,
    /// Index of the contact behind each row.
    pub contact: Vec<u32>,
}

/// Builds the rows about a tentative motion.
///
/// `required_gaps` holds d per contact; `frames` a first tangent per contact to keep while it sticks. Targets follow
/// from the gap at the tentative end: `c = (d - gap(x1))/dt + J dv`, exact at that motion, so that a fixed point of
/// solving and rebuilding satisfies the true gaps of turning bodies [DESIGN: rows are re-linearised]. Cost: linear in
/// contacts.
pub fn build_rows(
    model: &Model,
    metric: &Metric,
    contacts: &[Contact],
    required_gaps: &[f64],
    frames: &[Option<Vec3>],
    about: &Linearisation,
) -> BuiltRows {
    let mut built = BuiltRows::default();
    built.assign(model, metric, contacts, required_gaps, frames, about);
    built
}

impl BuiltRows {
    /// Makes these the rows of [`build_rows`], in the room that there is.
    pub fn assign(
        &mut self,
        model: &Model,
        metric: &Metric,
        contacts: &[Contact],
        required_gaps: &[f64],
        frames: &[Option<Vec3>],
        about: &Linearisation,
    ) {
        let BuiltRows { rows, contact: built } = self;
        rows.begin(contacts.len());
        built.clear();
        built.reserve(contacts.len());
        for (index, contact) in contacts.iter().enumerate() {
            push_entries(model, metric, contact, about, rows);
            let (linear, angular) = (rows.blocks.len(), rows.angular.len());
            let row = built.len();
            if linear == rows.offsets[row] as usize && angular == rows.angular_offsets[row] as usize {
                continue;
            }
            rows.offsets.push(linear as u32);
            rows.angular_offsets.push(angular as u32);
            built.push(index as u32);
            push_targets(model, contact, required_gaps[index], frames[index], about, rows);
        }
    }
}

/// Linear and angular entries of one contact: a rigid body's vertices collapse into one of each.
fn push_entries(model: &Model, metric: &Metric, contact: &Contact, about: &Linearisation, rows: &mut RowSet) {
    let first = rows.blocks.len();
    let mut rigid: [(usize, f64, Vec3); 4] = [(usize::MAX, 0.0, [0.0; 3]); 4];
    for k in 0..4 {
        let weight = contact.weights[k];
        if weight == 0.0 {
            continue;
        }
        let vertex = contact.vertices[k] as usize;
        let index = model.vertex_body[vertex] as usize;
        let body = &model.bodies[index];
        match body.description.kind {
            Kind::Deformable { .. } => {
                for (block, share) in body.carriers(vertex).filter(|(block, _)| !metric.fixed[*block]) {
                    push_linear(rows, first, block as u32, weight * share);
                }
            }
            Kind::Rigid { .. } => {
                let lever = vertex_lever(index, vertex, body.blocks.start + 1, about);
                if let Some(slot) = rigid.iter_mut().find(|slot| slot.0 == index || slot.0 == usize::MAX) {
                    *slot = (index, slot.1 + weight, add_scaled(slot.2, weight, lever));
                }
            }
            Kind::Kinematic { .. } | Kind::HalfSpace(_) => {}
        }
    }
    for (index, weight, lever) in rigid.into_iter().filter(|slot| slot.0 != usize::MAX) {
        let linear = model.bodies[index].blocks.start;
        if !metric.fixed[linear] && weight != 0.0 {
            rows.blocks.push(linear as u32);
            rows.weights.push(weight);
        }
        if !metric.fixed[linear + 1] {
            rows.angular.push(Angular { block: (linear + 1) as u32, lever });
        }
    }
}

/// Adds to the entry of a block among those from `first` on: points carried by one element share its nodes.
fn push_linear(rows: &mut RowSet, first: usize, block: u32, weight: f64) {
    match rows.blocks[first..].iter().position(|b| *b == block) {
        Some(k) => rows.weights[first + k] += weight,
        None => {
            rows.blocks.push(block);
            rows.weights.push(weight);
        }
    }
}

/// Lever of a rigid body's vertex for the tentative turn.
fn vertex_lever(body: usize, vertex: usize, angular_block: usize, about: &Linearisation) -> Vec3 {
    let r0 = sub(about.start.positions[vertex], about.start.poses[body].position);
    let r1 = sub(about.end.positions[vertex], about.end.poses[body].position);
    chord_lever(r0, r1, turn(about.velocities[angular_block], about.dt))
}

fn push_targets(
    model: &Model,
    contact: &Contact,
    required_gap: f64,
    kept: Option<Vec3>,
    about: &Linearisation,
    rows: &mut RowSet,
) {
    let row = rows.frames.len();
    let (x0, x1) = (gather(contact.vertices, &about.start.positions), gather(contact.vertices, &about.end.positions));
    let moved = std::array::from_fn(|k| sub(x1[k], x0[k]));
    let displacement = match contact.pair.kind {
        PairKind::VertexHalfSpace => moved[0],
        _ => weighted(&contact.weights, &moved),
    };
    // What the row would see without response: the tentative relative velocity less the response's share.
    let seen = rows.relative_velocity_of(row, |block| about.response(block));
    let relative = sub(scale(1.0 / about.dt, displacement), seen);
    let n = contact.normal;
    let (t1, t2) = friction_frame(n, relative, kept);
    let end_gap = match contact.pair.kind {
        PairKind::VertexHalfSpace => dot(n, x1[0]) - contact.offset,
        _ => distance_along(n, &contact.weights, &x1),
    };
    rows.frames.push([n, t1, t2]);
    rows.normal_targets.push((required_gap - end_gap) / about.dt + dot(n, seen));
    rows.sliding_velocities.push([dot(t1, relative), dot(t2, relative)]);
    rows.friction.push(friction_coefficient(model, contact));
    debug_assert_eq!(rows.frames.len(), row + 1);
}

/// Tangents of a contact: the first one kept from before if given, else along the unconstrained sliding velocity
/// [Otaduy09, §3.4], else a fixed choice per normal.
pub fn friction_frame(n: Vec3, relative: Vec3, kept: Option<Vec3>) -> (Vec3, Vec3) {
    let project = |v: Vec3| add_scaled(v, -dot(n, v), n);
    let sliding = project(relative);
    // Rounding of the projection is no direction.
    let sliding = (norm(sliding) > 1e-9 * norm(relative)).then_some(sliding);
    let along = kept.map(project).and_then(unit).or_else(|| sliding.and_then(unit));
    match along.map(project).and_then(unit) {
        Some(t1) => (t1, cross(n, t1)),
        None => tangents(n),
    }
}

fn friction_coefficient(model: &Model, contact: &Contact) -> f64 {
    let [a, b] = contact.pair.bodies(model).map(|i| model.bodies[i].description.material);
    model.materials.friction_coefficient(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_follow_sliding_are_kept_and_never_vanish() {
        let n = [0.0, 0.0, 1.0];
        let (t1, t2) = friction_frame(n, [3.0, 4.0, -9.0], None);
        assert!(norm(sub(t1, [0.6, 0.8, 0.0])) < 1e-15 && norm(sub(t2, [-0.8, 0.6, 0.0])) < 1e-15);
        let (t1, _) = friction_frame(n, [3.0, 4.0, -9.0], Some([0.0, 1.0, 0.1]));
        assert!(norm(sub(t1, [0.0, 1.0, 0.0])) < 1e-15);
        let (t1, t2) = friction_frame(n, [0.0; 3], None);
        assert!((norm(t1) - 1.0).abs() < 1e-15 && (norm(t2) - 1.0).abs() < 1e-15);
    }
}
