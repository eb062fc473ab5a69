//! The velocity filter alone: positions before and after in, positions without collisions out.

use super::step::StepFailure;
use super::surface::{Topology, surface};
use super::{Fault, WorldError};
use crate::math::{Vec3, add, is_finite, scale, sub};
use crate::model::{
    BodyDescription, Drives, FilterSettings, Kind, Material, Materials, Model, Precision, Settings, State, StepError,
    StepReport, StepResult, Surface, Watch, Witness,
};
use crate::parallel::Par;
use crate::step::Step;
use crate::velocity_filter;
use std::ops::Range;
use std::sync::Arc;

/// What a filter is made for; constant over its calls.
#[derive(Clone, Debug, Default)]
pub struct MotionFilterDescription {
    /// Rest position of every vertex `[m]`: parts of one group that rest closer than their thickness keep a fraction of
    /// that distance only.
    pub rest: Vec<Vec3>,
    /// Triangles, edges, points; all empty: every vertex is a point. Each within one group.
    pub topology: Topology,
    /// Mass of every vertex `[kg]`; 0 or infinite: scripted, it goes where it is sent.
    pub masses: Vec<f64>,
    /// Group of every vertex, a body; empty: all are one.
    pub groups: Vec<u32>,
    /// Half of the thickness of a pair `[m]`; `None`: a tenth of the mean edge length of each group.
    pub half_thickness: Option<f64>,
    /// Coulomb friction coefficient of everything.
    pub friction_coefficient: f64,
    /// Whether groups collide with themselves.
    pub self_collision: bool,
    /// Number format of the host: positions are certified after rounding to it.
    pub precision: Precision,
}

/// A motion to be filtered; positions in the host's order `[m]`.
#[derive(Clone, Copy, Debug)]
pub enum Motion<'a> {
    /// From these positions to those: the filter's own state does not count.
    Between(&'a [Vec3], &'a [Vec3]),
    /// The filter's own state moves by the displacement between these two: a recorded trajectory whose filtered copy keeps
    /// what contact changed. The first call starts at the first positions.
    Displacement(&'a [Vec3], &'a [Vec3]),
    /// The filter's own state moves towards these: a recorded trajectory that is followed as closely as contact lets. Every
    /// call projects at once, without springs and passes of impulses: these push and never take back, and what they push
    /// too far would be wished back the faster in the next call. Errors: no call before that gave a state.
    Towards(&'a [Vec3]),
}

/// Two features that intersect or leave no room, in the host's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterWitness {
    /// [`Witness::VERTEX_FACE`] and the others.
    pub kind: u32,
    /// Groups of the two features.
    pub groups: [u32; 2],
    /// Vertices of the two features; shorter ones repeat their last vertex.
    pub vertices: [[u32; 3]; 2],
    /// A point of the intersection, or between the features `[m]`.
    pub point: Vec3,
}

/// A filter with its model, its tree and its state: keep it from step to step of one mesh.
pub struct MotionFilter {
    model: Model,
    /// Host's vertex of each vertex of the model.
    host: Vec<u32>,
    /// Group of each body.
    groups: Vec<u32>,
    state: State,
    /// Whether `state` is that of a call.
    started: bool,
    velocities: Vec<Vec3>,
    drives: Drives,
    memory: velocity_filter::Memory,
    scratch: velocity_filter::Scratch,
    result: StepResult,
    witnesses: Vec<FilterWitness>,
}

impl MotionFilter {
    /// Builds the filter of a mesh.
    ///
    /// Errors: counts that differ, positions or masses that are not finite (masses may be infinite), indices out of
    /// range, an element that spans groups, numbers out of range. Cost: a sort of edges and groups.
    pub fn new(description: MotionFilterDescription) -> Result<MotionFilter, WorldError> {
        let count = description.rest.len();
        if description.masses.len() != count {
            let message = "one mass per vertex is needed";
            return Err(WorldError::new(Fault::BufferLayout, message).value(description.masses.len() as f64));
        }
        if !description.groups.is_empty() && description.groups.len() != count {
            let message = "one group per vertex is needed, or none at all";
            return Err(WorldError::new(Fault::BufferLayout, message).value(description.groups.len() as f64));
        }
        if let Some(index) = description.masses.iter().position(|m| m.is_nan() || *m < 0.0) {
            let value = description.masses[index];
            return Err(WorldError::new(Fault::InvalidArgument, "a mass is negative or none")
                .index(index)
                .value(value));
        }
        let whole = surface(description.rest.clone(), description.topology.clone())?;
        let group_of = |v: u32| description.groups.get(v as usize).copied().unwrap_or(0);
        let mut groups: Vec<u32> = (0..count as u32).map(group_of).collect();
        groups.sort_unstable();
        groups.dedup();
        let body_of = |v: u32| groups.partition_point(|g| *g < group_of(v));
        if let Some(index) = whole.faces.iter().position(|f| f.iter().any(|v| body_of(*v) != body_of(f[0]))) {
            return Err(WorldError::new(Fault::BadTopology, "a triangle spans groups").index(index));
        }
        if let Some(edge) = whole.edges.iter().find(|e| body_of(e[0]) != body_of(e[1])) {
            return Err(WorldError::new(Fault::BadTopology, "an edge spans groups").index(edge[0] as usize));
        }
        let mut host: Vec<u32> = (0..count as u32).collect();
        // Stable: within a group the host's order stays.
        host.sort_by_key(|v| body_of(*v));
        let mut local = vec![0u32; count];
        let mut parts: Vec<Part> = groups.iter().map(|_| Part::default()).collect();
        for v in &host {
            let part = &mut parts[body_of(*v)];
            local[*v as usize] = part.rest.len() as u32;
            part.rest.push(description.rest[*v as usize]);
            part.masses.push(description.masses[*v as usize]);
        }
        let named = |v: u32| local[v as usize];
        whole.faces.iter().for_each(|f| parts[body_of(f[0])].topology.triangles.push(f.map(named)));
        whole.edges.iter().for_each(|e| parts[body_of(e[0])].topology.edges.push(e.map(named)));
        whole.vertices.iter().for_each(|v| parts[body_of(*v)].topology.points.push(named(*v)));
        let bodies: Result<Vec<BodyDescription>, WorldError> =
            parts.into_iter().enumerate().map(|(index, part)| part.body(index, &description)).collect();
        let material = Material {
            friction_coefficient: description.friction_coefficient,
            combine_rule: Default::default(),
            restitution: 0.0,
        };
        let materials = Materials { list: vec![material], overrides: Vec::new() };
        let model = Model::build(bodies?, materials, Vec::new()).map_err(|error| {
            WorldError::new(Fault::InvalidArgument, error.message).index(error.index).value(error.value)
        })?;
        let state = model.rest_state();
        let drives = model.idle_drives(&state);
        Ok(MotionFilter {
            velocities: vec![[0.0; 3]; count],
            model,
            host,
            groups,
            state,
            started: false,
            drives,
            memory: Default::default(),
            scratch: Default::default(),
            result: Default::default(),
            witnesses: Vec::new(),
        })
    }

    /// Number format that positions are certified in.
    pub fn precision(&self) -> Precision {
        self.model.bodies.first().map_or(Precision::Double, |body| body.description.precision)
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.host.len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.host.is_empty()
    }

    /// Filters a motion over `dt`; [`MotionFilter::positions`] and [`MotionFilter::velocities`] are then its end.
    ///
    /// What collides with nothing arrives where it was sent, to rounding; scripted vertices always do, unless they leave
    /// no room: `Pinched`, the one error that carries a state, at the certified fraction, with witnesses. A start that
    /// intersects is refused with witnesses, or passes, as `settings` say; one that the last call ended with is known to
    /// be clean. Cost: of a step of the velocity filter; the tree is kept from call to call.
    pub fn run(
        &mut self,
        motion: Motion,
        settings: &Settings,
        dt: f64,
        par: Par,
        watch: Watch,
    ) -> Result<StepReport, StepFailure> {
        self.check(&motion, dt)?;
        let start = match motion {
            Motion::Between(from, _) => Some(from),
            Motion::Displacement(from, _) if !self.started => Some(from),
            Motion::Displacement(..) | Motion::Towards(_) => None,
        };
        let mut state = std::mem::take(&mut self.state);
        let kept = state.positions.clone();
        if let Some(from) = start {
            state.positions.iter_mut().zip(&self.host).for_each(|(x, v)| *x = from[*v as usize]);
        }
        for (i, v) in self.host.iter().enumerate() {
            let (x, v) = (state.positions[i], *v as usize);
            self.drives.target_positions[i] = match motion {
                Motion::Between(_, to) | Motion::Towards(to) => to[v],
                // Where both stand at one place the target is the recorded one, to the last bit.
                Motion::Displacement(from, to) if from[v] == x => to[v],
                Motion::Displacement(from, to) => add(x, sub(to[v], from[v])),
            };
        }
        for body in self.model.bodies.iter().filter(|body| !body.blocks.is_empty()) {
            for (vertex, block) in body.nodes().zip(body.blocks.clone()) {
                let way = sub(self.drives.target_positions[vertex], state.positions[vertex]);
                self.drives.velocities[block] = scale(1.0 / dt, way);
            }
        }
        let before = state.positions.clone();
        let mut settings = *settings;
        if matches!(motion, Motion::Towards(_)) {
            settings.filter = FilterSettings { passes_max: 0, repulsion_stiffness: 0.0, ..settings.filter };
        }
        let step = Step {
            model: &self.model,
            state: &mut state,
            drives: &self.drives,
            settings: &settings,
            dt,
            result: &mut self.result,
            par,
            watch,
        };
        let outcome = velocity_filter::advance(step, &mut self.memory, &mut self.scratch);
        self.state = state;
        self.witnesses.clear();
        match outcome {
            Ok(report) => {
                self.keep(&before, dt);
                Ok(report)
            }
            Err(StepError::Pinched { witnesses, report }) => {
                self.keep(&before, dt);
                self.witnesses = witnesses.iter().map(|w| self.named(w)).collect();
                let message = "scripted vertices leave no room; the positions stand at the certified fraction";
                let error = WorldError::new(Fault::Pinched, message).value(report.certified_fraction);
                Err(StepFailure { error, report: Some(report) })
            }
            Err(error) => {
                self.state.positions = kept;
                Err(self.refusal(error).into())
            }
        }
    }

    /// Positions that the last call ended with, in the host's order `[m]`.
    pub fn positions(&self) -> Vec<Vec3> {
        let mut out = vec![[0.0; 3]; self.host.len()];
        self.host.iter().zip(&self.state.positions).for_each(|(v, x)| out[*v as usize] = *x);
        out
    }

    /// `(x1' - x0)/dt` of the last call, in the host's order `[m/s]`.
    pub fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }

    /// Witnesses of the last call, if it was refused or pinched.
    pub fn witnesses(&self) -> &[FilterWitness] {
        &self.witnesses
    }

    /// Forgets the state: the next call starts a trajectory of its own. The tree stays.
    pub fn restart(&mut self) {
        self.started = false;
        self.memory = Default::default();
    }

    fn check(&self, motion: &Motion, dt: f64) -> Result<(), WorldError> {
        let lists: &[&[Vec3]] = match motion {
            Motion::Between(from, to) | Motion::Displacement(from, to) => &[from, to],
            Motion::Towards(to) => &[to],
        };
        for list in lists {
            if list.len() != self.host.len() {
                let message = "as many positions are needed as there are vertices";
                return Err(WorldError::new(Fault::BufferLayout, message).value(list.len() as f64));
            }
            if let Some(index) = list.iter().position(|x| !is_finite(*x)) {
                return Err(WorldError::new(Fault::NonFinite, "a position is not finite").index(index));
            }
        }
        if matches!(motion, Motion::Towards(_)) && !self.started {
            let message = "there is no state yet to move: the first call gives start positions";
            return Err(WorldError::new(Fault::InvalidArgument, message));
        }
        if !(dt.is_finite() && dt > 0.0) {
            return Err(WorldError::new(Fault::InvalidArgument, "dt is not positive and finite").value(dt));
        }
        Ok(())
    }

    fn keep(&mut self, before: &[Vec3], dt: f64) {
        self.started = true;
        for (i, v) in self.host.iter().enumerate() {
            self.velocities[*v as usize] = scale(1.0 / dt, sub(self.state.positions[i], before[i]));
        }
    }

    /// The failure of a call that left everything as it was.
    fn refusal(&mut self, error: StepError) -> WorldError {
        match error {
            StepError::IntersectingStart(witnesses) => {
                self.witnesses = witnesses.iter().map(|w| self.named(w)).collect();
                let message = format!("the start intersects ({} pairs)", witnesses.len());
                let first = self.witnesses.first().map_or(0, |w| w.vertices[0][0]);
                WorldError::new(Fault::IntersectingStart, message).index(first as usize)
            }
            StepError::BadInput(error) => {
                let fault = if error.value.is_finite() { Fault::InvalidArgument } else { Fault::NonFinite };
                WorldError::new(fault, error.message).value(error.value)
            }
            StepError::Cancelled => WorldError::new(Fault::Cancelled, "the call was cancelled"),
            StepError::SingularSystem { row, .. } => {
                WorldError::new(Fault::SingularSystem, "a mass is singular").index(row)
            }
            StepError::Pinched { report, .. } => {
                WorldError::new(Fault::Pinched, "pinched").value(report.certified_fraction)
            }
        }
    }

    /// A witness in the host's numbers.
    fn named(&self, witness: &Witness) -> FilterWitness {
        let body = |side: usize| self.model.body_index(witness.bodies[side]).unwrap_or(0);
        let triple = |side: usize| -> [u32; 3] {
            let own = &self.model.bodies[body(side)];
            let at = |range: &Range<usize>| range.start + witness.features[side] as usize;
            let vertices = match (witness.kind, side) {
                (Witness::VERTEX_FACE | Witness::EDGE_FACE, 1) => self.model.faces[at(&own.faces)],
                (Witness::EDGE_EDGE, _) | (Witness::EDGE_FACE, _) => {
                    let edge = self.model.edges[at(&own.edges)];
                    [edge[0], edge[1], edge[1]]
                }
                _ => [at(&own.vertices) as u32; 3],
            };
            vertices.map(|v| self.host[v as usize])
        };
        let groups = [0, 1].map(|side| self.groups[body(side)]);
        FilterWitness { kind: witness.kind, groups, vertices: [triple(0), triple(1)], point: witness.point }
    }
}

/// What of the mesh is one group.
#[derive(Default)]
struct Part {
    rest: Vec<Vec3>,
    masses: Vec<f64>,
    topology: Topology,
}

impl Part {
    fn body(self, index: usize, description: &MotionFilterDescription) -> Result<BodyDescription, WorldError> {
        let pinned: Vec<bool> = self.masses.iter().map(|m| *m == 0.0 || m.is_infinite()).collect();
        let kind = if pinned.iter().all(|p| *p) {
            Kind::Kinematic { posed: false }
        } else {
            let masses = self.masses.iter().zip(&pinned).map(|(m, pin)| if *pin { 1.0 } else { *m }).collect();
            Kind::Deformable { masses, pinned }
        };
        // Checked as a whole before; a group of vertices that nothing names stays one.
        let Topology { triangles, edges, points } = self.topology;
        let surface = Surface::new(self.rest, triangles, &edges, &points)
            .map_err(|error| WorldError::new(Fault::BadTopology, error.message).index(error.index))?;
        Ok(BodyDescription {
            key: index as u64 + 1,
            surface: Arc::new(surface),
            kind,
            half_thickness: description.half_thickness,
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: description.self_collision,
            precision: description.precision,
            embedding: None,
            dynamics: None,
        })
    }
}
