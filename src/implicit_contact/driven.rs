//! Stages 1 and 2 of a segment: what drives it, and the metric.

use super::advance::is_within_range;
use crate::constraint::Metric;
use crate::dynamics::unconstrained;
use crate::model::{BuildError, Drives, Model, Segment, StepError};
use crate::parallel::Par;
use std::borrow::Cow;

/// The host's drives, with unconstrained velocities and matrices of the bodies that the library drives.
pub(super) struct Driven<'a> {
    /// Unconstrained velocities and matrices of all bodies.
    pub drives: Cow<'a, Drives>,
    /// The metric that they make.
    pub metric: Metric,
    /// Whether every unconstrained solve met its tolerance.
    pub converged: bool,
}

impl<'a> Driven<'a> {
    /// Assembles and solves MODEL bodies over the segment, whose drives are the host's; HOST bodies bring their own.
    pub fn new(segment: &Segment<'a>, par: Par) -> Result<Driven<'a>, StepError> {
        let (drives, converged) = if has_own_dynamics(segment.model) {
            let own = unconstrained(segment, par);
            check_range(segment, &own.drives)?;
            (Cow::Owned(own.drives), own.converged)
        } else {
            (Cow::Borrowed(segment.drives), true)
        };
        let metric = Metric::new(segment.model, segment.start, &drives)?;
        Ok(Driven { drives, metric, converged })
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
