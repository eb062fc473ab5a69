//! The two passes of [Harmon10, §3.8]: collisions with scripts first, all others after that, each with its own zones. A baseline
//! that fails: what the second pass changes is not told to the first.

use super::advance::filter_once;
use super::motion::FilteredMotion;
use crate::contact_search::{BodyFilter, CandidateSearch, Passing};
use crate::fail_safe::{Sweep, ZoneResponse, resolve_zones};
use crate::model::{Segment, StepError, StepReport};
use crate::step::{PartEnd, Surroundings, momentum_lost};

/// Filters a part in two passes; the hits left are of all pairs. Zones are counted and what they take is booked here.
///
/// Cost: three times a search for candidates, since each pass has pairs of its own. Errors: cancelled.
pub fn filter_in_two_passes(
    around: &Surroundings,
    segment: &Segment,
    passing: &Passing,
    search: &mut CandidateSearch,
    report: &mut StepReport,
) -> Result<PartEnd, StepError> {
    let mut motion = FilteredMotion::new(segment, around.metric);
    let (factor, par) = (around.settings.proximity_factor.max(1.0), around.par);
    let response = ZoneResponse { fail_safe: around.settings.fail_safe, friction: around.settings.zone_friction };
    for scripted in [true, false] {
        let filter: BodyFilter = around.filter.of_pairs(segment.model, scripted);
        let hits =
            filter_once(&Surroundings { filter: &filter, ..*around }, segment, passing, &mut motion, search, report)?;
        if hits.is_empty() {
            continue;
        }
        let sweep = Sweep { segment: *segment, filter: &filter, passing, factor, par };
        let zones = resolve_zones(&sweep, around.metric, &motion.velocities, &hits, search, &response);
        report.projected_zones += zones.projected;
        report.rigid_zones += zones.rigid;
        let taken = momentum_lost(segment.model, around, &motion.velocities, &zones.velocities);
        let share = segment.to - segment.from;
        report.momentum_taken = crate::math::add_scaled(report.momentum_taken, share, taken);
        motion.replace(&zones.velocities);
    }
    let all = Sweep { segment: *segment, filter: around.filter, passing, factor, par };
    let (end, hits) = all.test(&motion.velocities, 1.0, search);
    motion.end = end;
    Ok(motion.into_part(hits))
}
