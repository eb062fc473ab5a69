//! The parts of a step, one after the other, each clean before the next.

use super::account::{StepAccount, lap};
use super::driven::{Driven, has_own_dynamics};
use super::fall_back::{FallBack, fall_back};
use super::part::{PartEnd, PartStart};
use super::whole::Step;
use crate::contact_search::{BodyFilter, CandidateSearch, Hit, Passing};
use crate::dynamics::Accelerations;
use crate::fail_safe::{Part, parts_of_step};
use crate::model::{Model, Phase, Segment, Settings, StartPolicy, State, StepError, StepReport};
use std::time::Instant;

/// How often the pairs of a pinch pass one by one before their bodies pass as a whole.
const PASSES_MAX: u32 = 16;

/// Parts of a step, done and still to do, beyond which none is halved: bounds the work whatever a method asks for.
const PARTS_MAX: u32 = 256;

/// What a method does with one part of a step.
pub trait PartMethod {
    /// Responds to the contacts of a part; the end, written over, is clean unless the method could not make it so. Counts,
    /// residuals and times are added to the report. Errors: cancelled.
    fn respond(
        &mut self,
        part: &PartStart,
        search: &mut CandidateSearch,
        report: &mut StepReport,
        end: &mut PartEnd,
    ) -> Result<(), StepError>;

    /// Halvings of a part that did not come clean, before the fail-safes.
    fn halvings_max(&self, settings: &Settings) -> u32;

    /// Whether zones are tried on what did not come clean.
    fn has_zones(&self, _: &Settings) -> bool {
        true
    }

    /// Takes over what the next part starts from; `by_itself` unless fail-safes made the end.
    fn keep(&mut self, model: &Model, part: &PartEnd, dt: f64, by_itself: bool);
}

/// Buffers over the parts of a step: capacity only.
#[derive(Default)]
pub(super) struct PartBuffers {
    /// Parts still to do, the next one last.
    left: Vec<Part>,
    /// Where the present part starts.
    here: State,
    /// Where it ends.
    end: PartEnd,
}

/// Makes all parts of a step; the pairs that leave no room if it was pinched. Errors: cancelled, and what the dynamics
/// of a part refuse.
pub(super) fn run_parts(
    method: &mut dyn PartMethod,
    step: &Step,
    filter: &BodyFilter,
    driven: &Driven,
    accelerations: &Accelerations,
    passing: &mut Passing,
    search: &mut CandidateSearch,
    buffers: &mut PartBuffers,
    account: &mut StepAccount,
) -> Result<Option<Vec<Hit>>, StepError> {
    let Step { model, settings, par, watch, .. } = *step;
    let undivided = step.segment();
    let PartBuffers { left: parts, here, end } = buffers;
    parts_of_step(model, step.state, driven.drives(step.drives), settings, step.dt, parts);
    let (mut passes, mut again) = (0, Driven::default());
    // An undivided step needs the room of one end alone.
    std::mem::swap(end, &mut account.last);
    account.last.clear();
    while let Some(part) = parts.pop() {
        let share = part.to - part.from;
        here.clone_from(&account.state);
        let dt = share * step.dt;
        let pushed = Segment { start: here, from: part.from, to: part.to, dt, ..undivided };
        // MODEL bodies are assembled again for a part of the step, HOST bodies go a part of their path.
        let mut clock = Instant::now();
        let anew = share < 1.0 && has_own_dynamics(model);
        if anew {
            again.assign(&pushed, accelerations, par)?;
        }
        let driven = if anew { &again } else { driven };
        let segment = Segment { drives: driven.drives(step.drives), ..pushed };
        let start = PartStart { segment, metric: &driven.metric, filter, passing, settings, par, watch };
        account.report.not_converged |= !driven.converged();
        account.report.times.dynamics += lap(&mut clock);
        method.respond(&start, search, &mut account.report, end)?;
        if end.hits.is_empty() {
            method.keep(model, end, dt, true);
            account.add_part(model, start.metric, end, share, dt);
            continue;
        }
        // Fail-safes: divide, zones, hold, pinched.
        let halvings_max = method.halvings_max(settings);
        if part.depth < halvings_max && account.report.parts + (parts.len() as u32) < PARTS_MAX {
            let [first, second] = part.halves();
            parts.extend([second, first]);
            continue;
        }
        clock = Instant::now();
        watch.ask(Phase::FailSafe, part.from)?;
        let outcome = fall_back(&start, std::mem::take(end), method.has_zones(settings), search);
        account.report.times.fail_safe += lap(&mut clock);
        match outcome {
            FallBack::Resolved { part: mut end, projected, rigid, held_vertices, momentum_taken } => {
                method.keep(model, &end, dt, false);
                account.add_fail_safe([projected, rigid, held_vertices], share, momentum_taken);
                account.add_part(model, start.metric, &mut end, share, dt);
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
