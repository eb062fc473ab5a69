//! What was pushed: sizes fit, everything is finite and within range.

use super::whole::Step;
use crate::math::{Vec3, is_finite};
use crate::model::{BuildError, Drives, Kind, Model, State, StepError};

/// Coordinates and ways within a step beyond this are refused: products of three would overflow.
const FARTHEST: f64 = 1e100;

/// What was pushed: sizes fit, everything is finite. Errors: `BadInput`, with body, index and value.
pub(super) fn check_inputs(step: &Step) -> Result<(), StepError> {
    let Step { model, state, drives, settings, dt, .. } = step;
    let dt = *dt;
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
    let filter = settings.filter;
    if !(0.0..=1.0).contains(&filter.restitution) {
        return fail(0, filter.restitution, "restitution is not between 0 and 1");
    }
    if !(filter.repulsion_stiffness.is_finite() && filter.repulsion_stiffness >= 0.0) {
        return fail(0, filter.repulsion_stiffness, "repulsion stiffness is negative or not finite");
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
