//! What a host is told while a step is made, and how it stops one.

use super::StepError;

/// A phase of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Unconstrained dynamics of bodies that the library drives.
    Dynamics,
    /// The start state is checked.
    Start,
    /// A round: contacts, constrained dynamics, continuous detection.
    Round,
    /// Zones and held vertices.
    FailSafe,
}

/// Told before each phase, with the fraction of the step that is done; its answer says whether to go on.
pub type Told<'a> = dyn Fn(Phase, f64) -> bool + Sync + 'a;

/// Who watches a step. It is asked on the calling thread, between phases only; what it answers changes no bit of a step
/// that goes on.
#[derive(Clone, Copy, Default)]
pub struct Watch<'a> {
    /// Nobody, or whom to ask.
    pub told: Option<&'a Told<'a>>,
}

impl Watch<'_> {
    /// Errors: `Cancelled`, if the answer is no.
    pub fn ask(&self, phase: Phase, fraction: f64) -> Result<(), StepError> {
        match self.told {
            Some(told) if !told(phase, fraction) => Err(StepError::Cancelled),
            _ => Ok(()),
        }
    }
}
