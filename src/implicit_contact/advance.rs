//! One step of implicit contact, as its list of stages. Numbers as in `docs/method/implicit.md`.

use super::commit::StepAccount;
use super::driven::{Driven, has_own_dynamics};
use super::fall_back::{FallBack, fall_back, witnesses};
use super::manifold_refinement::{Surroundings, lap, refine};
use super::memory::Certified;
use super::{Memory, SolverScratch};
use crate::contact_search::{BodyFilter, CandidateSearch, Hit, Passing, intersections_with};
use crate::fail_safe::parts_of_step;
use crate::math::{Vec3, is_finite};
use crate::model::{
    BuildError, Drives, Kind, Model, Phase, Segment, Settings, StartPolicy, State, StepError, StepReport, StepResult,
    Watch,
};
use crate::parallel::Par;
use std::time::Instant;

/// How often the pairs of a pinch pass one by one before their bodies pass as a whole.
const PASSES_MAX: u32 = 16;

/// Parts of a step, done and still to do, beyond which none is halved: bounds the work whatever `halvings_max`.
const PARTS_MAX: u32 = 256;

/// Coordinates and ways within a step beyond this are refused: products of three would overflow.
const FARTHEST: f64 = 1e100;

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
    driven.assign(&undivided, &memory.accelerations, par)?;
    let filter = BodyFilter::new(model);
    let mut account = StepAccount::new(model, state, driven.drives(drives));
    account.report.times.dynamics += lap(&mut clock);
    // (3) The start state: certified, refused, or tangled.
    watch.ask(Phase::Start, 0.0)?;
    let mut passing = start_state(model, &filter, state, memory, settings, &mut account.report, scratch, par)?;
    account.report.times.certificate += lap(&mut clock);
    // (4) to (7), part by part.
    let around = Surroundings { metric: &driven.metric, filter: &filter, settings, par, watch };
    let pinch = run_parts(&around, &undivided, &driven, memory, &mut passing, scratch, &mut account)?;
    // (8) Commit and report.
    driven.keep_accelerations(&undivided, &mut memory.accelerations);
    scratch.driven = driven;
    commit((&filter, settings, par), model, state, memory, dt, result, &passing, scratch, &mut account);
    let mut report = account.finished_report();
    report.bytes = (memory.bytes() + scratch.candidates.bytes()) as u64;
    report.times.total = lap(&mut whole);
    match pinch {
        None => Ok(report),
        Some(hits) => Err(StepError::Pinched { witnesses: witnesses(model, &hits, state), report: Box::new(report) }),
    }
}

/// Stages 4 to 7 for each part of the step; the pairs that leave no room if it was pinched.
fn run_parts(
    whole: &Surroundings,
    undivided: &Segment,
    driven: &Driven,
    memory: &Memory,
    passing: &mut Passing,
    scratch: &mut Scratch,
    account: &mut StepAccount,
) -> Result<Option<Vec<Hit>>, StepError> {
    let (settings, model) = (whole.settings, undivided.model);
    let (contacts, velocities) = (memory.contacts.clone(), memory.velocities.clone());
    let mut warm = Memory { contacts, dt: memory.dt, velocities, ..Memory::default() };
    let mut parts = parts_of_step(model, undivided.start, driven.drives(undivided.drives), settings, undivided.dt);
    let (mut passes, mut again) = (0, Driven::default());
    while let Some(part) = parts.pop() {
        let share = part.to - part.from;
        let here = account.state.clone();
        let dt = share * undivided.dt;
        let pushed = Segment { start: &here, from: part.from, to: part.to, dt, ..*undivided };
        // (1) and (2) again for a part of the step: MODEL bodies are re-assembled, HOST bodies go a part of their path.
        let mut clock = Instant::now();
        let anew = share < 1.0 && has_own_dynamics(model);
        if anew {
            again.assign(&pushed, &memory.accelerations, whole.par)?;
        }
        let driven = if anew { &again } else { driven };
        let segment = Segment { drives: driven.drives(undivided.drives), ..pushed };
        let around = &Surroundings { metric: &driven.metric, ..*whole };
        account.rounds.not_converged |= !driven.converged();
        account.report.times.dynamics += lap(&mut clock);
        // (4) to (6) Contacts, rows, anticipation, continuous detection, round by round.
        let refined = refine(around, &segment, passing, &warm, scratch, &mut account.rounds)?;
        if refined.hits.is_empty() {
            account.add_part(model, around, refined, share, segment.dt);
            warm.keep_contacts(model, &account.last.set, segment.dt);
            warm.keep_velocities(model, &account.end_velocities);
            continue;
        }
        // (7) Fail-safes: divide, zones, hold, pinched.
        if part.depth < settings.halvings_max && account.report.parts + (parts.len() as u32) < PARTS_MAX {
            let [first, second] = part.halves();
            parts.extend([second, first]);
            continue;
        }
        let mut clock = Instant::now();
        around.watch.ask(Phase::FailSafe, part.from)?;
        let outcome = fall_back(around, &segment, passing, refined, scratch);
        account.report.times.fail_safe += lap(&mut clock);
        match outcome {
            FallBack::Resolved { refined, projected, rigid, held_vertices, momentum_taken } => {
                account.add_fail_safe([projected, rigid, held_vertices], share, momentum_taken);
                account.add_part(model, around, *refined, share, segment.dt);
                warm.keep_velocities(model, &account.end_velocities);
            }
            FallBack::Pinched { share: within, state: stopped, hits } => {
                let passes_on = settings.start_policy == StartPolicy::Pass;
                if passes_on && let_pass(model, &hits, passes >= PASSES_MAX, passing) {
                    passes += 1;
                    account.report.tangled_pairs += hits.len() as u32;
                    parts.push(part);
                    continue;
                }
                account.report.certified_fraction = part.from + within * share;
                account.state = *stopped;
                return Ok(Some(hits));
            }
        }
    }
    Ok(None)
}

/// The policy PASS: vertices of the pairs that leave no room, or of both their bodies, become tangled. Whether any did.
///
/// Ends: a body that is tangled as a whole is never hit again.
fn let_pass(model: &Model, hits: &[Hit], whole_bodies: bool, passing: &mut Passing) -> bool {
    let before = passing.len();
    for hit in hits {
        if whole_bodies {
            let vertices = hit.pair.bodies(model).into_iter().flat_map(|b| model.bodies[b].vertices.clone());
            vertices.for_each(|v| passing.insert(v as u32, model.rest.len()));
        }
        hit.pair.vertices(model).into_iter().for_each(|v| passing.insert(v, model.rest.len()));
    }
    passing.len() > before
}

/// Stage 8: memory, state and result, all at once.
fn commit(
    (filter, settings, par): (&BodyFilter, &Settings, Par),
    model: &Model,
    state: &mut State,
    memory: &mut Memory,
    dt: f64,
    result: &mut StepResult,
    passing: &Passing,
    scratch: &mut Scratch,
    account: &mut StepAccount,
) {
    let mut clock = Instant::now();
    if account.last_dt > 0.0 {
        memory.keep_contacts(model, &account.last.set, account.last_dt);
    }
    *result = account.result(model, state, dt);
    memory.keep_velocities(model, &account.end_velocities);
    std::mem::swap(state, &mut account.state);
    memory.certified = passing.is_empty().then(|| Certified {
        topology: model.topology_hash,
        filter: filter.fingerprint(),
        positions: state.positions.clone(),
        half_spaces: state.half_spaces.clone(),
    });
    if settings.certify {
        let search = &mut scratch.candidates;
        let found = intersections_with(search, model, filter, state, par).witnesses.len();
        account.report.intersections = Some(found as u32);
        if found > 0 {
            memory.certified = None;
        }
    }
    account.report.times.certificate += lap(&mut clock);
}

/// Stage 3: nothing to do for a state that the last step certified; else an exact search for intersections.
fn start_state(
    model: &Model,
    filter: &BodyFilter,
    state: &State,
    memory: &Memory,
    settings: &Settings,
    report: &mut StepReport,
    scratch: &mut Scratch,
    par: Par,
) -> Result<Passing, StepError> {
    if memory.knows(model, filter, state) {
        return Ok(Passing::default());
    }
    let tangle = intersections_with(&mut scratch.candidates, model, filter, state, par);
    if !tangle.witnesses.is_empty() && settings.start_policy == StartPolicy::Refuse {
        return Err(StepError::IntersectingStart(tangle.witnesses));
    }
    report.tangled_pairs = tangle.witnesses.len() as u32;
    Ok(tangle.passing)
}

/// Stage 1: sizes fit, everything is finite.
fn check_inputs(model: &Model, state: &State, drives: &Drives, settings: &Settings, dt: f64) -> Result<(), StepError> {
    let fail = |index: usize, value: f64, message: &'static str| {
        Err(StepError::BadInput(BuildError { body: 0, index, value, message }))
    };
    if !(dt.is_finite() && dt > 0.0) {
        return fail(0, dt, "dt is not positive and finite");
    }
    let (vertices, bodies) = (model.rest.len(), model.bodies.len());
    let fits = state.positions.len() == vertices
        && drives.target_positions.len() == vertices
        && state.poses.len() == bodies
        && drives.target_poses.len() == bodies
        && state.half_spaces.len() == bodies
        && drives.target_half_spaces.len() == bodies
        && drives.velocities.len() == model.block_count
        && state.velocities.len() == model.block_count
        && drives.attachments.len() == model.attachment_count;
    if !fits {
        return fail(0, 0.0, "state or drives do not fit the model");
    }
    if drives.systems.len() != model.host_systems {
        return fail(drives.systems.len(), 0.0, "one set of values per system");
    }
    if let Some(i) = drives.velocities.iter().position(|v| !is_within_range(*v, dt)) {
        return fail(i, largest(drives.velocities[i]), "velocity is not finite, or its way in this step out of range");
    }
    let fields = [drives.gravity, drives.wind];
    let given = state.velocities.iter().chain(&fields).chain(drives.attachments.iter().flatten());
    if let Some((i, v)) = given.enumerate().find(|(_, v)| !is_finite(**v)) {
        return fail(i, largest(*v), "a velocity, gravity, wind or target is not finite");
    }
    let positions = || state.positions.iter().chain(&drives.target_positions);
    if let Some((i, x)) = positions().enumerate().find(|(_, x)| !is_within_range(**x, 1.0)) {
        return fail(i % vertices.max(1), largest(*x), "position is not finite or out of range");
    }
    let tolerances = [settings.contact_tolerance, settings.velocity_tolerance, settings.turn_max];
    if let Some(i) = tolerances.iter().position(|t| !(t.is_finite() && *t > 0.0)) {
        return fail(i, tolerances[i], "tolerance is not positive and finite");
    }
    check_poses(model, state, drives)
}

/// Whether every component times `factor` is finite and not beyond [`FARTHEST`].
pub(super) fn is_within_range(v: Vec3, factor: f64) -> bool {
    v.iter().all(|c| (c * factor).abs() <= FARTHEST)
}

fn largest(v: Vec3) -> f64 {
    v.iter().fold(0.0, |m: f64, c| if c.is_nan() { f64::NAN } else { m.max(c.abs()) })
}

fn check_poses(model: &Model, state: &State, drives: &Drives) -> Result<(), StepError> {
    for (index, body) in model.bodies.iter().enumerate() {
        let fail = |message: &'static str| {
            let key = body.description.key;
            Err(StepError::BadInput(BuildError { body: key, index, value: f64::NAN, message }))
        };
        if let Kind::HalfSpace(_) = body.description.kind {
            for h in [&state.half_spaces[index], &drives.target_half_spaces[index]] {
                let length = crate::math::norm_squared(h.normal);
                if !((length - 1.0).abs() < 1e-6 && h.offset.abs() <= FARTHEST) {
                    return fail("half-space normal is not a unit vector, or its offset not finite");
                }
            }
        }
        if !matches!(body.description.kind, Kind::Rigid { .. } | Kind::Kinematic { posed: true }) {
            continue;
        }
        for pose in [&state.poses[index], &drives.target_poses[index]] {
            let length: f64 = pose.orientation.iter().map(|c| c * c).sum();
            let unit = (length - 1.0).abs() < 1e-3;
            if !is_within_range(pose.position, 1.0) || !unit {
                return fail("pose is not finite, or its quaternion not of unit length");
            }
        }
    }
    Ok(())
}
