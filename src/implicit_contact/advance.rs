//! One step of implicit contact, as its list of stages. Numbers as in `docs/method/implicit.md`.

use super::manifold_refinement::refine;
use super::{Memory, SolverScratch};
use crate::contact_search::{BodyFilter, CandidateSearch, Passing};
use crate::model::{Drives, Model, Phase, Segment, Settings, State, StepError, StepReport, StepResult, Watch};
use crate::parallel::Par;
use crate::step::{
    Driven, PartEnd, PartMethod, StepAccount, Surroundings, answer, check_inputs, commit, lap, run_parts, start_state,
};
use std::time::Instant;

/// Buffers: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct Scratch {
    /// Buffers of the contact solver.
    pub solver: SolverScratch,
    /// Broad phase and candidates.
    pub candidates: CandidateSearch,
    /// Dynamics and metric; taken out while a step runs.
    driven: Driven,
}

/// Advances `state` by `dt`, driven by `drives`; the outcome is in `state`, `result` and the report.
///
/// On an error other than pinched `state`, `memory` and `result` are unchanged. Pinched leaves all three valid at the
/// certified fraction of the step. Cost: per round linear in vertices, candidates and contacts, plus the broad phase.
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
    // (1) What was pushed.
    check_inputs(model, state, drives, settings, dt)?;
    // (2) A, b and unconstrained velocities of MODEL bodies, HOST bodies bring theirs; the metric.
    watch.ask(Phase::Dynamics, 0.0)?;
    let undivided = Segment { model, drives, step_start: state, start: state, from: 0.0, to: 1.0, dt };
    let mut driven = std::mem::take(&mut scratch.driven);
    driven.assign(&undivided, &memory.carried.accelerations, par)?;
    let filter = BodyFilter::new(model);
    let mut account = StepAccount::new(model, state, driven.drives(drives), StepReport::default());
    account.report.times.dynamics += lap(&mut clock);
    // (3) The start state: certified, refused, or tangled.
    watch.ask(Phase::Start, 0.0)?;
    let (search, report) = (&mut scratch.candidates, &mut account.report);
    let mut passing = start_state(model, &filter, state, &memory.carried, settings, report, search, par)?;
    report.times.certificate += lap(&mut clock);
    // (4) to (7), part by part: contacts, rows, anticipation, continuous detection; fail-safes.
    let around = Surroundings { metric: &driven.metric, filter: &filter, settings, par, watch };
    let accelerations = &memory.carried.accelerations;
    let mut refinement = Refinement { warm: memory.warm(), solver: &mut scratch.solver };
    let pinch =
        run_parts(&mut refinement, &around, &undivided, &driven, accelerations, &mut passing, search, &mut account)?;
    // (8) Commit and report.
    driven.keep_accelerations(&undivided, &mut memory.carried.accelerations);
    scratch.driven = driven;
    if account.last_dt > 0.0 {
        memory.keep_contacts(model, &account.last.contacts, account.last_dt);
    }
    let carried = &mut memory.carried;
    commit((&filter, settings, par), model, state, carried, dt, result, &passing, search, &mut account);
    memory.keep_velocities(model, &result.end_velocities);
    let mut report = account.finished_report();
    report.bytes = (memory.bytes() + scratch.candidates.bytes()) as u64;
    report.times.total = lap(&mut whole);
    answer(model, state, pinch, report)
}

/// Manifold refinement over the parts of a step, each warm-started by the one before.
struct Refinement<'a> {
    warm: Memory,
    solver: &'a mut SolverScratch,
}

impl PartMethod for Refinement<'_> {
    fn respond(
        &mut self,
        around: &Surroundings,
        segment: &Segment,
        passing: &Passing,
        search: &mut CandidateSearch,
        report: &mut StepReport,
    ) -> Result<PartEnd, StepError> {
        refine(around, segment, passing, &self.warm, self.solver, search, report).map(|refined| refined.part_end())
    }

    fn halvings_max(&self, settings: &Settings) -> u32 {
        settings.halvings_max
    }

    fn keep(&mut self, model: &Model, part: &PartEnd, dt: f64, by_itself: bool) {
        if by_itself {
            self.warm.keep_contacts(model, &part.contacts, dt);
        }
        self.warm.keep_velocities(model, &part.velocities);
    }
}
