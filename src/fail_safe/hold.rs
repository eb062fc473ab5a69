//! Hold: what still collides stays where it started; the held set grows until nothing is hit.

use super::nodes::Nodes;
use super::sweep::Sweep;
use crate::constraint::Metric;
use crate::contact_search::{CandidateSearch, Hit};
use crate::math::Vec3;
use crate::model::State;

/// Rounds of growing before everything is held.
const ROUNDS: usize = 32;

/// What holding led to.
pub struct HoldOutcome {
    /// Velocity per block, held blocks zero.
    pub velocities: Vec<Vec3>,
    /// End state.
    pub end: State,
    /// Hits left; not empty only when scripted motion leaves no room.
    pub hits: Vec<Hit>,
    /// Movable nodes held: deformable vertices and whole rigid bodies.
    pub held: Vec<usize>,
}

/// Holds the movable nodes of hit pairs, and of the pairs that then collide, until nothing is hit.
///
/// Ends with hits only when a scripted part reaches what is held already, or another scripted part. Cost: at most 33
/// rounds of continuous detection.
pub fn hold(
    sweep: &Sweep,
    metric: &Metric,
    tentative: &[Vec3],
    hits: &[Hit],
    candidates: &mut CandidateSearch,
) -> HoldOutcome {
    let nodes = Nodes::new(sweep.segment.model, metric);
    let mut held = vec![false; nodes.len()];
    let mut outcome =
        HoldOutcome { velocities: tentative.to_vec(), end: State::default(), hits: hits.to_vec(), held: Vec::new() };
    for round in 0..=ROUNDS {
        if outcome.hits.iter().any(|hit| nodes.all_within(hit, &held)) {
            break;
        }
        if round == ROUNDS {
            held.iter_mut().enumerate().for_each(|(n, h)| *h = nodes.is_movable(n));
        }
        for hit in &outcome.hits {
            for node in nodes.of_pair(&hit.pair) {
                held[node] |= !nodes.is_scripted(node);
            }
        }
        for node in (0..held.len()).filter(|n| held[*n]) {
            outcome.velocities[nodes.blocks(node)].fill([0.0; 3]);
        }
        (outcome.end, outcome.hits) = sweep.test(&outcome.velocities, 1.0, candidates);
        if outcome.hits.is_empty() {
            break;
        }
    }
    outcome.held = (0..held.len()).filter(|n| held[*n]).collect();
    outcome
}
