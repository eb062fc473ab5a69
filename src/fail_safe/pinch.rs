//! Pinched: the last share of a segment at which everything, scripted parts too, is certified.

use super::sweep::Sweep;
use crate::contact_search::{CandidateSearch, Hit};
use crate::math::Vec3;
use crate::model::State;

/// Halvings of the share before the state stays at the start of the segment.
const HALVINGS: usize = 24;

/// The state at the largest certified share tried, and that share; the start of the segment at the worst.
///
/// The first try is just before the earliest hit; poses at a share are not on the chords that were tested, so each
/// share is tested anew and halved when it fails.
pub fn certified_share(
    sweep: &Sweep,
    velocities: &[Vec3],
    hits: &[Hit],
    candidates: &mut CandidateSearch,
) -> (f64, State) {
    let earliest = hits.iter().fold(1.0_f64, |t, hit| t.min(hit.time));
    let mut share = 0.9 * earliest;
    for _ in 0..HALVINGS {
        if share <= 0.0 {
            break;
        }
        let (end, left) = sweep.test(velocities, share, candidates);
        if left.is_empty() {
            return (share, end);
        }
        share *= 0.5;
    }
    (0.0, sweep.segment.start.clone())
}
