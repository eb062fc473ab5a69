//! One step of the velocity filter. Numbers of stages as in `docs/method/filter.md`.

use super::Memory;
use super::impulse::iterate_impulses;
use super::motion::FilteredMotion;
use super::repulsion::repel;
use super::two_pass::filter_in_two_passes;
use crate::contact_search::{CandidateSearch, Hit};
use crate::model::{Model, Settings, StepError, StepReport};
use crate::step::{PartEnd, PartMethod, PartStart, Scratch, Step, lap, make_step};
use std::time::Instant;

/// Makes a step; the outcome is in its state, its result and the report.
///
/// On an error other than pinched state, memory and result are unchanged. Pinched leaves all three valid at the
/// certified fraction of the step. Cost: a broad phase and a continuous detection, and per pass what has moved.
pub fn advance(mut step: Step, memory: &mut Memory, scratch: &mut Scratch) -> Result<StepReport, StepError> {
    let made = make_step(&mut Filter, &mut step, memory, scratch)?;
    made.answer(&step, memory.bytes(), scratch)
}

/// Stages 3 and 4 of a part. Nothing is kept from part to part, and no part is halved: zones resolve what is left.
struct Filter;

impl PartMethod for Filter {
    fn respond(
        &mut self,
        part: &PartStart,
        search: &mut CandidateSearch,
        report: &mut StepReport,
        end: &mut PartEnd,
    ) -> Result<(), StepError> {
        if part.settings.filter.two_pass {
            *end = filter_in_two_passes(part, search, report)?;
            return Ok(());
        }
        let mut motion = FilteredMotion::new(&part.segment, part.metric);
        let hits = filter_once(part, &mut motion, search, report)?;
        *end = motion.into_part(hits);
        Ok(())
    }

    fn halvings_max(&self, _: &Settings) -> u32 {
        0
    }

    fn has_zones(&self, settings: &Settings) -> bool {
        !settings.filter.two_pass
    }

    fn keep(&mut self, _: &Model, _: &PartEnd, _: f64, _: bool) {}
}

/// Stages 3 and 4 on the pairs that the part's filter allows; what still collides. Errors: cancelled.
pub(super) fn filter_once(
    part: &PartStart,
    motion: &mut FilteredMotion,
    search: &mut CandidateSearch,
    report: &mut StepReport,
) -> Result<Vec<Hit>, StepError> {
    let mut clock = Instant::now();
    // (3) Repulsions.
    let mut near = Vec::new();
    part.sweep().near(&motion.end, 1.0, search, &mut near);
    report.times.search += lap(&mut clock);
    repel(motion, &near, part);
    report.times.solve += lap(&mut clock);
    // (4) Impulses.
    iterate_impulses(part, motion, search, report)
}
