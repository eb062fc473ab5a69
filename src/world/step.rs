//! The step of a world: build the model if something changed, gather, advance, scatter.

use super::body::Body;
use super::{Fault, World, WorldError};
use crate::contact_search::{BodyFilter, intersections, swept_free};
use crate::implicit_contact;
use crate::math::ZERO;
use crate::model::{BodyDescription, BuildError, Method, Model, Settings, State, StepError, StepReport, System, Watch};
use crate::parallel::Par;
use crate::step::Step;
use crate::velocity_filter;

/// A step that failed. When pinched, the world stands at the certified fraction and the report says how far.
#[derive(Clone, Debug)]
pub struct StepFailure {
    /// Why.
    pub error: WorldError,
    /// What was done up to the certified fraction; only when pinched.
    pub report: Option<Box<StepReport>>,
}

impl From<WorldError> for StepFailure {
    fn from(error: WorldError) -> Self {
        StepFailure { error, report: None }
    }
}

impl World {
    /// Advances all bodies by `dt` with what has been pushed.
    ///
    /// On every error but `Pinched` bodies, results and contacts are as they were. Witnesses of intersections are kept
    /// for [`World::witnesses`].
    pub fn step(&mut self, settings: &Settings, dt: f64, par: Par) -> Result<StepReport, StepFailure> {
        self.step_watched(settings, dt, par, Watch::default())
    }

    /// [`World::step`] with somebody who is told how far it has come and may stop it between phases: `Cancelled`.
    pub fn step_watched(
        &mut self,
        settings: &Settings,
        dt: f64,
        par: Par,
        watch: Watch,
    ) -> Result<StepReport, StepFailure> {
        if !dt.is_finite() {
            return Err(WorldError::new(Fault::NonFinite, "the time step is not finite").value(dt).into());
        }
        if dt <= 0.0 {
            return Err(WorldError::new(Fault::InvalidArgument, "the time step is not positive").value(dt).into());
        }
        self.build_model()?;
        self.gather()?;
        self.witnesses.clear();
        self.check_pushed_starts(par)?;
        let World { model, state, drives, memory, result, scratch, filter_scratch, .. } = self;
        let step = Step { model, state, drives, settings, dt, result, par, watch };
        let outcome = match settings.method {
            Method::ImplicitContact => implicit_contact::advance(step, memory, scratch),
            Method::VelocityFilter => velocity_filter::advance(step, &mut memory.carried, filter_scratch),
        };
        match outcome {
            Ok(report) => {
                self.scatter();
                Ok(report)
            }
            Err(StepError::Pinched { witnesses, report }) => {
                self.scatter();
                self.witnesses = witnesses;
                let message = "scripted geometry leaves no room; the state stands at the certified fraction";
                let error = self.witnessed(WorldError::new(Fault::Pinched, message)).value(report.certified_fraction);
                Err(StepFailure { error, report: Some(report) })
            }
            Err(error) => Err(self.refusal(error).into()),
        }
    }

    /// Builds the model when bodies, materials, filters or systems have changed.
    pub(super) fn build_model(&mut self) -> Result<(), WorldError> {
        if self.model_current {
            return Ok(());
        }
        let (materials, material_keys) = self.model_materials();
        let describe = |body: &Body| {
            let material = material_keys.iter().position(|key| *key == body.material).unwrap_or(0) as u32;
            BodyDescription { material, ..body.description.clone() }
        };
        let bodies = self.bodies.iter().map(|(_, body)| describe(body)).collect();
        self.model = Model::build(bodies, materials, self.model_systems())
            .map_err(|error| self.build_failure(Fault::InvalidArgument, &error))?;
        self.model_current = true;
        Ok(())
    }

    /// Writes the start state and the drives of every body into the arrays of the model.
    fn gather(&mut self) -> Result<(), WorldError> {
        self.gather_state();
        let drives = &mut self.drives;
        drives.velocities.clear();
        drives.velocities.resize(self.model.block_count, ZERO);
        drives.target_positions.clone_from(&self.state.positions);
        drives.target_poses.clone_from(&self.state.poses);
        drives.target_half_spaces.clone_from(&self.state.half_spaces);
        (drives.gravity, drives.wind) = (self.gravity, self.wind);
        drives.attachments.clear();
        for (index, body) in self.model.bodies.iter().enumerate() {
            let kept = self.bodies.get(self.bodies.id_of_key(body.description.key))?;
            drives.velocities[body.blocks.clone()].copy_from_slice(&kept.velocities);
            if let Some(targets) = &kept.target_positions {
                drives.target_positions[body.vertices.end - targets.len()..body.vertices.end].copy_from_slice(targets);
            }
            let ends = kept.attachment_targets.as_ref().unwrap_or(&kept.attachments);
            drives.attachments.extend(kept.attachments.iter().zip(ends).map(|(start, end)| [*start, *end]));
            if let Some(pose) = kept.target_pose {
                drives.target_poses[index] = pose;
            }
            if let Some(plane) = kept.target_half_space {
                drives.target_half_spaces[index] = plane;
            }
        }
        let patterns = self.model.systems.iter();
        let mut given = 0;
        for ((id, system), description) in self.systems.iter().zip(patterns) {
            if system.values.is_empty() {
                let message = "a system has no values: push them before the step";
                return Err(WorldError::new(Fault::InvalidArgument, message).object(id));
            }
            match drives.systems.get_mut(given).filter(|known| known.description == *description) {
                Some(known) => known.values.clone_from(&system.values),
                None => {
                    drives.systems.truncate(given);
                    drives.systems.push(System { description: description.clone(), values: system.values.clone() });
                }
            }
            given += 1;
        }
        drives.systems.truncate(given);
        Ok(())
    }

    /// Writes the start state of every body into the arrays of the model.
    pub(super) fn gather_state(&mut self) {
        self.model.put_at_rest(&mut self.state);
        for (index, body) in self.model.bodies.iter().enumerate() {
            let id = self.bodies.id_of_key(body.description.key);
            if let Ok(kept) = self.bodies.get(id) {
                place(kept, index, body.vertices.clone(), &mut self.state);
                self.state.velocities[body.blocks.clone()].copy_from_slice(&kept.velocities);
            }
        }
    }

    /// Sweeps bodies from where the last step left them to starts that were pushed without a teleport.
    fn check_pushed_starts(&mut self, par: Par) -> Result<(), WorldError> {
        if self.bodies.iter().all(|(_, body)| body.certified.is_none()) {
            return Ok(());
        }
        let mut before = self.state.clone();
        for (index, body) in self.model.bodies.iter().enumerate() {
            let kept = self.bodies.get(self.bodies.id_of_key(body.description.key))?;
            if let Some(certified) = &kept.certified {
                if !certified.positions.is_empty() {
                    before.positions[body.vertices.clone()].copy_from_slice(&certified.positions);
                }
                before.poses[index] = certified.pose;
                before.half_spaces[index] = certified.half_space;
            }
        }
        let filter = BodyFilter::new(&self.model);
        let mut hits = swept_free(&self.model, &filter, &before, &self.state, par);
        if !hits.is_empty() {
            // What was tangled where the last step ended goes on passing.
            let tangled = intersections(&self.model, &filter, &before, par).passing;
            hits.retain(|hit| !tangled.touches(&hit.pair.vertices(&self.model)));
        }
        if hits.is_empty() {
            return Ok(());
        }
        self.witnesses = hits.iter().map(|hit| hit.witness(&self.model, &before.positions)).collect();
        let message = "a start was pushed that comes too close to something on the way from where the last step ended; push \
                       it as a teleport if it is one";
        Err(self.witnessed(WorldError::new(Fault::IntersectingStart, message)).value(hits[0].time))
    }

    /// Takes the end state and the results back to the bodies.
    fn scatter(&mut self) {
        for (index, body) in self.model.bodies.iter().enumerate() {
            let id = self.bodies.id_of_key(body.description.key);
            let Ok(kept) = self.bodies.get_mut(id) else { continue };
            if !kept.positions.is_empty() {
                kept.positions.copy_from_slice(&self.state.positions[body.vertices.clone()]);
            }
            kept.pose = self.state.poses[index];
            kept.half_space = self.state.half_spaces[index];
            kept.stepped = true;
            kept.certified = None;
            kept.target_positions = None;
            kept.target_pose = None;
            kept.target_half_space = None;
            if let Some(targets) = kept.attachment_targets.take() {
                kept.attachments = targets;
            }
            if kept.description.dynamics.is_some() {
                kept.velocities.copy_from_slice(&self.state.velocities[body.blocks.clone()]);
            }
            for (kept, all) in [
                (&mut kept.result_velocities, &self.result.velocities),
                (&mut kept.result_end_velocities, &self.result.end_velocities),
                (&mut kept.result_impulses, &self.result.impulses),
            ] {
                kept.clear();
                kept.extend_from_slice(all.get(body.blocks.clone()).unwrap_or_default());
            }
        }
    }

    fn build_failure(&self, fault: Fault, error: &BuildError) -> WorldError {
        let object = if error.body == 0 { 0 } else { self.bodies.id_of_key(error.body) };
        WorldError::new(fault, error.message).object(object).index(error.index).value(error.value)
    }

    /// The failure of a step that left everything as it was.
    fn refusal(&mut self, error: StepError) -> WorldError {
        match error {
            StepError::IntersectingStart(witnesses) => {
                self.witnesses = witnesses;
                self.witnessed(WorldError::new(Fault::IntersectingStart, "the start state intersects"))
            }
            StepError::SingularSystem { system, row } => {
                let own = self.model.systems.get(system).and_then(|s| s.bodies.first());
                let own = own.filter(|_| system >= self.model.host_systems).map(|key| self.bodies.id_of_key(*key));
                let id = self.systems.iter().nth(system).map(|(id, _)| id).or(own).unwrap_or(0);
                let message = format!("the matrix is not positive definite at block row {row}");
                WorldError::new(Fault::SingularSystem, message).object(id).index(row)
            }
            StepError::BadInput(error) => self.build_failure(Fault::InvalidArgument, &error),
            StepError::Cancelled => WorldError::new(Fault::Cancelled, "the step was cancelled"),
            StepError::Pinched { report, .. } => {
                WorldError::new(Fault::Pinched, "pinched").value(report.certified_fraction)
            }
        }
    }

    /// Names the first witness in the error.
    pub(super) fn witnessed(&self, mut error: WorldError) -> WorldError {
        if let Some(witness) = self.witnesses.first() {
            let [a, b] = witness.bodies.map(|key| self.bodies.id_of_key(key));
            let [i, j] = witness.features;
            let count = self.witnesses.len();
            error.message +=
                &format!(" ({count} pairs; the first: feature {i} of body {a:#x} and feature {j} of body {b:#x})");
            error = error.object(a).index(i as usize);
        }
        error
    }
}

fn place(kept: &Body, index: usize, vertices: std::ops::Range<usize>, state: &mut State) {
    if !vertices.is_empty() {
        state.positions[vertices].copy_from_slice(&kept.positions);
    }
    state.poses[index] = kept.pose;
    state.half_spaces[index] = kept.half_space;
}
