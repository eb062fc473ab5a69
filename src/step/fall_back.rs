//! The fail-safes of a part that a method left with collisions, in their order.

use super::part::{PartEnd, PartStart};
use crate::constraint::Metric;
use crate::contact_search::{CandidateSearch, Hit};
use crate::fail_safe::{Nodes, ZoneOutcome, ZoneResponse, certified_share, hold, resolve_zones};
use crate::math::{Vec3, add, mat_vec, sub};
use crate::model::{Body, Kind, Model, State, Witness};

/// What the fail-safes led to.
pub(super) enum FallBack {
    /// The segment is clean with these velocities and this end.
    Resolved {
        /// The part with velocities, impulses and end replaced.
        part: Box<PartEnd>,
        /// Zones whose velocities were projected.
        projected: u32,
        /// Zones that moved as rigid bodies.
        rigid: u32,
        /// Vertices held, those of rigid bodies too.
        held_vertices: u32,
        /// Momentum that held nodes, and zones with scripted members, lost `[N s]`.
        momentum_taken: Vec3,
    },
    /// Scripted motion leaves no room beyond this share of the segment.
    Pinched {
        /// Last certified share.
        share: f64,
        /// The state there.
        state: Box<State>,
        /// Pairs that leave no room.
        hits: Vec<Hit>,
    },
}

/// Zones, projected or rigid, unless the method has had its own; then hold, then the last certified share.
pub(super) fn fall_back(
    start: &PartStart,
    part: PartEnd,
    has_zones: bool,
    candidates: &mut CandidateSearch,
) -> FallBack {
    let (sweep, model, metric, settings) = (start.sweep(), start.segment.model, start.metric, start.settings);
    let response = ZoneResponse { fail_safe: settings.fail_safe, friction: settings.zone_friction };
    let zones = if has_zones {
        resolve_zones(&sweep, metric, &part.velocities, &part.hits, candidates, &response)
    } else {
        let (velocities, hits) = (part.velocities.clone(), part.hits.clone());
        ZoneOutcome { velocities, hits, ..ZoneOutcome::default() }
    };
    let (projected, rigid) = (zones.projected, zones.rigid);
    if zones.hits.is_empty() {
        let momentum_taken = momentum_lost(model, metric, &part.velocities, &zones.velocities);
        let part = Box::new(replaced(metric, part, zones.velocities, zones.end));
        return FallBack::Resolved { part, projected, rigid, held_vertices: 0, momentum_taken };
    }
    // From what zones left: those that are clean stay resolved.
    let holding = hold(&sweep, metric, &zones.velocities, &zones.hits, candidates);
    if holding.hits.is_empty() {
        let nodes = Nodes::new(model, metric);
        let momentum_taken = momentum_lost(model, metric, &part.velocities, &holding.velocities);
        let mut held_vertices = 0;
        for node in &holding.held {
            held_vertices += nodes.body(*node).map_or(1, |body| model.bodies[body].vertices.len() as u32);
        }
        let part = Box::new(replaced(metric, part, holding.velocities, holding.end));
        return FallBack::Resolved { part, projected, rigid, held_vertices, momentum_taken };
    }
    let (share, state) = certified_share(&sweep, &holding.velocities, &holding.hits, candidates);
    FallBack::Pinched { share, state: Box::new(state), hits: holding.hits }
}

/// Linear momentum that movable blocks lose from `old` to `new` velocities, lumped `[N s]`: free zones keep theirs, held
/// nodes and zones with scripted members do not.
pub fn momentum_lost(model: &Model, metric: &Metric, old: &[Vec3], new: &[Vec3]) -> Vec3 {
    let angular = |body: &Body| matches!(body.description.kind, Kind::Rigid { .. });
    let linear = model.bodies.iter().flat_map(|b| b.blocks.clone().take(if angular(b) { 1 } else { usize::MAX }));
    linear
        .filter(|block| !metric.fixed[*block])
        .fold([0.0; 3], |sum, block| add(sum, mat_vec(&metric.lumped[block], sub(old[block], new[block]))))
}

/// The part with other velocities; what the fail-safe changed is booked as impulse over lumped masses.
fn replaced(metric: &Metric, mut part: PartEnd, velocities: Vec<Vec3>, end: State) -> PartEnd {
    for (block, (new, old)) in velocities.iter().zip(&part.velocities).enumerate() {
        if !metric.fixed[block] {
            let change = mat_vec(&metric.lumped[block], sub(*new, *old));
            part.block_impulses[block] = add(part.block_impulses[block], change);
        }
    }
    part.velocities = velocities;
    part.end = end;
    part.hits.clear();
    part
}

/// Witnesses of pairs that leave no room, at the state that was reached.
pub(super) fn witnesses(model: &Model, hits: &[Hit], state: &State) -> Vec<Witness> {
    hits.iter().map(|hit| hit.witness(model, &state.positions)).collect()
}
