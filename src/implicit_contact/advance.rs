//! One step of implicit contact. Numbers of stages as in `docs/method/implicit.md`.

use super::Memory;
use super::manifold_refinement::{RefinementBuffers, refine};
use crate::contact_search::CandidateSearch;
use crate::model::{Model, Settings, StepError, StepReport};
use crate::step::{self, PartEnd, PartMethod, PartStart, Step, make_step};

/// Buffers: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct Scratch {
    /// What a part starts from.
    warm: Memory,
    /// Buffers of the refinement.
    refinement: RefinementBuffers,
    /// Those of the stages that every method shares.
    shared: step::Scratch,
}

/// Makes a step; the outcome is in its state, its result and the report.
///
/// On an error other than pinched state, memory and result are unchanged. Pinched leaves all three valid at the
/// certified fraction of the step. Cost: per round linear in vertices, candidates and contacts, plus the broad phase.
pub fn advance(mut step: Step, memory: &mut Memory, scratch: &mut Scratch) -> Result<StepReport, StepError> {
    let Scratch { warm, refinement: buffers, shared } = scratch;
    warm.warm_from(memory);
    let mut refinement = Refinement { warm, buffers };
    let made = make_step(&mut refinement, &mut step, &mut memory.carried, shared)?;
    let account = &made.account;
    if account.last_dt > 0.0 {
        memory.keep_contacts(step.model, &account.last.contacts, account.last_dt);
    }
    memory.keep_velocities(step.model, &step.result.end_velocities);
    made.answer(&step, memory.bytes(), shared)
}

/// Stages 4 to 6 over the parts of a step, each warm-started by the one before.
struct Refinement<'a> {
    warm: &'a mut Memory,
    buffers: &'a mut RefinementBuffers,
}

impl PartMethod for Refinement<'_> {
    fn respond(
        &mut self,
        part: &PartStart,
        search: &mut CandidateSearch,
        report: &mut StepReport,
        end: &mut PartEnd,
    ) -> Result<(), StepError> {
        refine(part, self.warm, self.buffers, search, report, end)
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
