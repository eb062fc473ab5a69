//! Stages 1 and 2 of a segment: what drives it, and the metric.

use super::inputs::is_within_range;
use crate::constraint::Metric;
use crate::dynamics::{Accelerations, Unconstrained};
use crate::model::{BuildError, Drives, Model, Segment, StepError};
use crate::parallel::Par;

/// What drives a segment, and the metric that it makes; reused from step to step.
#[derive(Default)]
pub struct Driven {
    /// Unconstrained velocities and matrices of the bodies that the library drives.
    own: Unconstrained,
    /// Whether there are any.
    has_own: bool,
    /// The metric.
    pub metric: Metric,
}

impl Driven {
    /// Assembles and solves MODEL bodies over the segment, whose drives are the host's; HOST bodies bring their own.
    pub fn assign(&mut self, segment: &Segment, remembered: &Accelerations, par: Par) -> Result<(), StepError> {
        self.has_own = has_own_dynamics(segment.model);
        if self.has_own {
            self.own.assign(segment, remembered, par);
            check_range(segment, &self.own.drives)?;
        }
        let drives = if self.has_own { &self.own.drives } else { segment.drives };
        self.metric.assign(segment.model, segment.start, drives)
    }

    /// The host's drives, with unconstrained velocities and matrices of the bodies that the library drives.
    pub fn drives<'a>(&'a self, host: &'a Drives) -> &'a Drives {
        if self.has_own { &self.own.drives } else { host }
    }

    /// Whether every unconstrained solve met its tolerance.
    pub fn converged(&self) -> bool {
        !self.has_own || self.own.converged
    }

    /// What the next step's unconstrained solves start from.
    pub fn keep_accelerations(&self, segment: &Segment, out: &mut Accelerations) {
        if self.has_own {
            self.own.keep_accelerations(segment, out);
        } else {
            out.clear();
        }
    }
}

/// Numbers that leave the range of what a step can take are refused, with body, node and value.
fn check_range(segment: &Segment, drives: &Drives) -> Result<(), StepError> {
    for body in &segment.model.bodies {
        let velocities = &drives.velocities[body.blocks.clone()];
        if let Some(index) = velocities.iter().position(|v| !is_within_range(*v, segment.dt)) {
            let value = velocities[index].iter().copied().find(|c| !c.is_finite()).unwrap_or(velocities[index][0]);
            let message = "the unconstrained velocity of a node is not finite, or its way in this step out of range";
            return Err(StepError::BadInput(BuildError { body: body.description.key, index, value, message }));
        }
    }
    Ok(())
}

/// Whether the library drives a body of the model: its step is re-assembled when it is divided.
pub(super) fn has_own_dynamics(model: &Model) -> bool {
    model.bodies.iter().any(|body| body.description.dynamics.is_some())
}
