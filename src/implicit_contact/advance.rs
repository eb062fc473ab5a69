//! One step of implicit contact, as its list of stages.

use super::SolverScratch;
use crate::model::{Drives, Model, Settings, State, StepError, StepReport, StepResult};
use crate::parallel::Par;

/// What the method remembers from step to step: warm starts by persistent key. Part of a snapshot.
#[derive(Clone, Debug, Default)]
pub struct Memory {}

/// Buffers: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct Scratch {
    /// Buffers of the contact solver.
    pub solver: SolverScratch,
}

/// Advances `state` by `dt`, driven by `drives`; the outcome is in `state`, `result` and the report.
///
/// On an error other than pinched `state`, `memory` and `result` are unchanged.
pub fn advance(
    _model: &Model,
    _state: &mut State,
    _drives: &Drives,
    _memory: &mut Memory,
    _settings: &Settings,
    _dt: f64,
    _result: &mut StepResult,
    _scratch: &mut Scratch,
    _par: Par,
) -> Result<StepReport, StepError> {
    Ok(StepReport::default())
}
