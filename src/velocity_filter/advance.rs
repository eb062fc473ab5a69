//! One step of the velocity filter, as its list of stages. Numbers as in `docs/method/filter.md`.

use super::Memory;
use super::impulse::iterate_impulses;
use super::motion::FilteredMotion;
use super::repulsion::repel;
use super::two_pass::filter_in_two_passes;
use crate::contact_search::{BodyFilter, CandidateSearch, Hit, Passing, near_contacts};
use crate::model::{Drives, Model, Phase, Segment, Settings, State, StepError, StepReport, StepResult, Watch};
use crate::parallel::Par;
use crate::step::{
    Driven, PartEnd, PartMethod, StepAccount, Surroundings, answer, check_inputs, commit, lap, run_parts, start_state,
};
use std::time::Instant;

/// Buffers: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct Scratch {
    /// Broad phase and candidates.
    pub candidates: CandidateSearch,
    /// Dynamics and metric; taken out while a step runs.
    driven: Driven,
}

/// Advances `state` by `dt`, driven by `drives`; the outcome is in `state`, `result` and the report.
///
/// On an error other than pinched `state`, `memory` and `result` are unchanged. Pinched leaves all three valid at the
/// certified fraction of the step. Cost: a broad phase and a continuous detection, and per pass what has moved.
pub fn advance(
    model: &Model,
    state: &mut State,
    drives: &Drives,
    memory: &mut Memory,
    settings: &Settings,
    dt: f64,
    result: &mut StepResult,
    scratch: &mut Scratch,
    par: Par,
) -> Result<StepReport, StepError> {
    advance_watched(model, state, drives, memory, settings, dt, result, scratch, (par, Watch::default()))
}

/// [`advance`] with somebody who is told how far it has come and may stop it between phases: `Cancelled`.
pub fn advance_watched(
    model: &Model,
    state: &mut State,
    drives: &Drives,
    memory: &mut Memory,
    settings: &Settings,
    dt: f64,
    result: &mut StepResult,
    scratch: &mut Scratch,
    (par, watch): (Par, Watch),
) -> Result<StepReport, StepError> {
    let (mut whole, mut clock) = (Instant::now(), Instant::now());
    // (1) What was pushed; the start state: certified, refused, or tangled.
    check_inputs(model, state, drives, settings, dt)?;
    watch.ask(Phase::Start, 0.0)?;
    let filter = BodyFilter::new(model);
    let (search, mut started) = (&mut scratch.candidates, StepReport::default());
    let mut passing = start_state(model, &filter, state, memory, settings, &mut started, search, par)?;
    started.times.certificate += lap(&mut clock);
    // (2) Unconstrained velocities of MODEL bodies, HOST bodies bring theirs; masses.
    watch.ask(Phase::Dynamics, 0.0)?;
    let undivided = Segment { model, drives, step_start: state, start: state, from: 0.0, to: 1.0, dt };
    let mut driven = std::mem::take(&mut scratch.driven);
    driven.assign(&undivided, &memory.accelerations, par)?;
    let mut account = StepAccount::new(model, state, driven.drives(drives), started);
    account.report.times.dynamics += lap(&mut clock);
    // (3) Repulsions, (4) impulses with continuous detection, (5) zones, (6) rigid zones and hold: part by part.
    let around = Surroundings { metric: &driven.metric, filter: &filter, settings, par, watch };
    let accelerations = &memory.accelerations;
    let pinch =
        run_parts(&mut Filter, &around, &undivided, &driven, accelerations, &mut passing, search, &mut account)?;
    // (7) Commit and report.
    driven.keep_accelerations(&undivided, &mut memory.accelerations);
    scratch.driven = driven;
    commit((&filter, settings, par), model, state, memory, dt, result, &passing, search, &mut account);
    let mut report = account.finished_report();
    report.bytes = (memory.bytes() + scratch.candidates.bytes()) as u64;
    report.times.total = lap(&mut whole);
    answer(model, state, pinch, report)
}

/// Stages 3 and 4 of a part. Nothing is kept from part to part, and no part is halved: zones resolve what is left.
struct Filter;

impl PartMethod for Filter {
    fn respond(
        &mut self,
        around: &Surroundings,
        segment: &Segment,
        passing: &Passing,
        search: &mut CandidateSearch,
        report: &mut StepReport,
    ) -> Result<PartEnd, StepError> {
        if around.settings.filter.two_pass {
            return filter_in_two_passes(around, segment, passing, search, report);
        }
        let mut motion = FilteredMotion::new(segment, around.metric);
        let hits = filter_once(around, segment, passing, &mut motion, search, report)?;
        Ok(motion.into_part(hits))
    }

    fn halvings_max(&self, _: &Settings) -> u32 {
        0
    }

    fn has_zones(&self, settings: &Settings) -> bool {
        !settings.filter.two_pass
    }

    fn keep(&mut self, _: &Model, _: &PartEnd, _: f64, _: bool) {}
}

/// Stages 3 and 4 on the pairs that the filter of the surroundings allows; what still collides. Errors: cancelled.
pub(super) fn filter_once(
    around: &Surroundings,
    segment: &Segment,
    passing: &Passing,
    motion: &mut FilteredMotion,
    search: &mut CandidateSearch,
    report: &mut StepReport,
) -> Result<Vec<Hit>, StepError> {
    let settings = around.settings;
    let mut clock = Instant::now();
    // (3) Repulsions.
    let (start, par) = (segment.start, around.par);
    let factor = settings.proximity_factor.max(1.0);
    let x1 = &motion.end.positions;
    let candidates = search.update(segment.model, around.filter, &start.positions, x1, factor, par);
    let near = near_contacts(segment.model, around.filter, passing, candidates, start, &motion.end, 1.0, par);
    report.times.search += lap(&mut clock);
    let stiffness = settings.filter.repulsion_stiffness;
    repel(motion, &near, stiffness, settings.recovery_fraction, (around.metric, segment.dt, par));
    report.times.solve += lap(&mut clock);
    // (4) Impulses.
    iterate_impulses(around, segment, passing, motion, search, report)
}
