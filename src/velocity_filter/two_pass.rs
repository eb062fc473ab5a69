//! The two passes of [Harmon10, §3.8]: collisions with scripts first, all others after that, each with its own zones. A
//! baseline that fails: what the second pass changes is not told to the first.

use super::advance::filter_once;
use super::motion::FilteredMotion;
use crate::contact_search::{BodyFilter, CandidateSearch};
use crate::fail_safe::{ZoneResponse, resolve_zones};
use crate::math::add_scaled;
use crate::model::{StepError, StepReport};
use crate::step::{PartEnd, PartStart, momentum_lost};

/// Filters a part in two passes; the hits left are of all pairs. Zones are counted and what they take is booked here.
///
/// Cost: three times a search for candidates, since each pass has pairs of its own. Errors: cancelled.
pub fn filter_in_two_passes(
    part: &PartStart,
    search: &mut CandidateSearch,
    report: &mut StepReport,
) -> Result<PartEnd, StepError> {
    let (segment, metric, settings) = (&part.segment, part.metric, part.settings);
    let mut motion = FilteredMotion::new(segment, metric);
    let response = ZoneResponse { fail_safe: settings.fail_safe, friction: settings.zone_friction };
    for scripted in [true, false] {
        let filter: BodyFilter = part.filter.of_pairs(segment.model, scripted);
        let pass = PartStart { filter: &filter, ..*part };
        let hits = filter_once(&pass, &mut motion, search, report)?;
        if hits.is_empty() {
            continue;
        }
        let zones = resolve_zones(&pass.sweep(), metric, &motion.velocities, &hits, search, &response);
        report.projected_zones += zones.projected;
        report.rigid_zones += zones.rigid;
        let taken = momentum_lost(segment.model, metric, &motion.velocities, &zones.velocities);
        report.momentum_taken = add_scaled(report.momentum_taken, segment.to - segment.from, taken);
        motion.replace(&zones.velocities);
    }
    let hits = part.sweep().hits(&motion.end, search);
    Ok(motion.into_part(hits))
}
