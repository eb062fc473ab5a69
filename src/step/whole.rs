//! One step of any method, as its list of stages. Numbers as in `docs/method/`.

use super::account::{StepAccount, lap};
use super::carried::{Carried, start_state};
use super::commit::commit;
use super::driven::Driven;
use super::fall_back::witnesses;
use super::inputs::check_inputs;
use super::parts::{PartBuffers, PartMethod, run_parts};
use crate::contact_search::{BodyFilter, CandidateSearch, Hit};
use crate::model::{Drives, Model, Phase, Segment, Settings, State, StepError, StepReport, StepResult, Watch};
use crate::parallel::Par;
use std::time::Instant;

/// A step to make: what it reads, and where it leaves its outcome.
pub struct Step<'a> {
    /// The model.
    pub model: &'a Model,
    /// The start; the end state once the step is made.
    pub state: &'a mut State,
    /// What drives it.
    pub drives: &'a Drives,
    /// Settings.
    pub settings: &'a Settings,
    /// Duration `[s]`.
    pub dt: f64,
    /// What the host pulls besides the end state.
    pub result: &'a mut StepResult,
    /// Where work runs; the bits do not depend on it.
    pub par: Par<'a>,
    /// Who is told how far it has come, and may stop it between phases: `Cancelled`.
    pub watch: Watch<'a>,
}

impl Step<'_> {
    /// The undivided step.
    pub(super) fn segment(&self) -> Segment<'_> {
        let state = &*self.state;
        let (model, drives, dt) = (self.model, self.drives, self.dt);
        Segment { model, drives, step_start: state, start: state, from: 0.0, to: 1.0, dt }
    }
}

/// Buffers of the stages that every method shares: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct Scratch {
    /// Broad phase and candidates.
    candidates: CandidateSearch,
    /// Dynamics and metric.
    driven: Driven,
    /// Which bodies may touch.
    filter: BodyFilter,
    /// Parts of the step.
    parts: PartBuffers,
    /// What they add up to; taken out while a step is made.
    account: StepAccount,
}

/// A step that is made, and committed; pinched or not.
pub struct Made {
    /// What its parts add up to.
    pub account: StepAccount,
    /// Pairs that leave no room.
    pinch: Option<Vec<Hit>>,
    began: Instant,
}

/// Makes a step by the answers of `method` to its parts, commits it, and keeps what every method carries.
///
/// Errors: nothing has changed.
pub fn make_step(
    method: &mut dyn PartMethod,
    step: &mut Step,
    carried: &mut Carried,
    scratch: &mut Scratch,
) -> Result<Made, StepError> {
    let began = Instant::now();
    let mut clock = began;
    // (1) What was pushed.
    check_inputs(step)?;
    // (2) A, b and unconstrained velocities of MODEL bodies, HOST bodies bring theirs; the metric.
    step.watch.ask(Phase::Dynamics, 0.0)?;
    let Scratch { candidates: search, driven, filter, parts, account } = scratch;
    driven.assign(&step.segment(), &carried.accelerations, step.par)?;
    filter.assign(step.model);
    let mut account = std::mem::take(account);
    account.begin(step.model, step.state, driven.drives(step.drives));
    account.report.times.dynamics += lap(&mut clock);
    // (3) The start state: certified, refused, or tangled.
    step.watch.ask(Phase::Start, 0.0)?;
    let mut passing = start_state(step, filter, carried, &mut account.report, search)?;
    account.report.times.certificate += lap(&mut clock);
    // The method's own stages and the fail-safes, part by part.
    let accelerations = &carried.accelerations;
    let pinch = run_parts(method, step, filter, driven, accelerations, &mut passing, search, parts, &mut account)?;
    // Commit.
    driven.keep_accelerations(&step.segment(), &mut carried.accelerations);
    commit(step, filter, carried, &passing, search, &mut account);
    Ok(Made { account, pinch, began })
}

impl Made {
    /// The report, or `Pinched` with witnesses of the pairs that left no room; `held` are the bytes of a method's memory.
    pub fn answer(mut self, step: &Step, held: usize, scratch: &mut Scratch) -> Result<StepReport, StepError> {
        let mut report = self.account.finished_report();
        report.bytes = (held + scratch.candidates.bytes()) as u64;
        report.times.total = lap(&mut self.began);
        scratch.account = self.account;
        match self.pinch {
            None => Ok(report),
            Some(hits) => {
                let witnesses = witnesses(step.model, &hits, step.state);
                Err(StepError::Pinched { witnesses, report: Box::new(report) })
            }
        }
    }
}
