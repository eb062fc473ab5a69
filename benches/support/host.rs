//! A host: owns elastic bodies, rigid bodies and obstacles, integrates them itself, and asks the library for each step.

use super::clock::thread_seconds;
use super::deformable::{Deformable, LinearStep};
use super::shapes::{Triangles, edges_of};
use signorini::implicit_contact::{Memory, Scratch, advance};
use signorini::kinematics::Pose;
use signorini::math::{Mat3, Vec3, add_scaled, dot, mat_vec, norm, sub};
use signorini::model::{
    BodyDescription, CombineRule, Drives, HalfSpace, Kind, Material, Materials, Model, Precision, Settings, State,
    StepError, StepReport, StepResult, Surface, System, SystemDescription, Watch,
};
use signorini::parallel::Par;
use signorini::step::Step;
use std::sync::Arc;

/// What a world is made of, before it is built. Elastic bodies first, then rigid bodies, then obstacles.
pub struct Plan {
    /// All elastic bodies over one vertex list.
    pub elastic: Deformable,
    /// Start positions of the elastic vertices.
    pub start: Vec<Vec3>,
    /// Elastic vertex range and surface of each elastic body, vertex numbers of the whole list.
    pub elastic_bodies: Vec<(std::ops::Range<usize>, Vec<[u32; 3]>)>,
    /// Vertices that do not move.
    pub pinned: Vec<usize>,
    /// Rigid bodies: surface about the centre of mass, pose, mass, inertia.
    pub rigid: Vec<(Triangles, Pose, f64, Mat3)>,
    /// Scripted surfaces with their pose.
    pub obstacles: Vec<(Triangles, Pose)>,
    /// Fixed half-spaces.
    pub half_spaces: Vec<HalfSpace>,
    /// Friction coefficient.
    pub friction: f64,
    /// Half of the pair thickness `[m]`.
    pub half_thickness: f64,
    /// Step `[s]`.
    pub dt: f64,
    /// Gravity `[m/s^2]`.
    pub gravity: Vec3,
    /// Whether elastic bodies collide with themselves.
    pub self_collision: bool,
}

/// A running world.
pub struct Host {
    pub model: Model,
    pub state: State,
    /// Velocity per block at the start of the next step.
    pub velocities: Vec<Vec3>,
    pub drives: Drives,
    pub memory: Memory,
    pub scratch: Scratch,
    pub result: StepResult,
    pub settings: Settings,
    pub elastic: Deformable,
    pub dt: f64,
    pub gravity: Vec3,
    pinned: Vec<usize>,
    rigid_masses: Vec<(f64, Mat3)>,
}

/// What one step did, with the balances that only the host can draw up.
#[derive(Clone, Debug)]
pub struct Facts {
    pub report: StepReport,
    /// Processor time of the library's step `[s]`.
    pub seconds: f64,
    /// Processor time of the host's own assembly and solve `[s]`.
    pub host_seconds: f64,
    /// `|v|_A^2 / 2` after the step less that of v* `[J]`.
    pub energy_gain: f64,
    /// `|v*|_A^2 / 2` `[J]`.
    pub energy_free: f64,
    /// `|sum m (v - v*) - sum impulses|` over free bodies, relative to the sum of `m |v - v*|` and
    /// a thousandth of that of `m |v|`.
    pub momentum_error: f64,
    /// `|sum impulses + momentum taken by infinite masses|`, relative to the sum of `|impulses|`.
    pub balance_error: f64,
    /// Largest speed `[m/s]`.
    pub speed: f64,
    /// Kinetic energy `[J]`.
    pub kinetic: f64,
}

fn surface(rest: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Arc<Surface> {
    let edges = edges_of(&faces);
    let mut vertices: Vec<u32> = edges.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    Arc::new(Surface { rest, vertices, edges, faces })
}

impl Plan {
    /// A world of one sheet.
    pub fn sheet(elastic: Deformable, start: Vec<Vec3>, faces: &[[u32; 3]]) -> Plan {
        Plan {
            elastic_bodies: vec![(0..start.len(), faces.to_vec())],
            elastic,
            start,
            pinned: Vec::new(),
            rigid: Vec::new(),
            obstacles: Vec::new(),
            half_spaces: Vec::new(),
            friction: 0.3,
            half_thickness: 1e-3,
            dt: 0.004,
            gravity: [0.0, 0.0, -9.81],
            self_collision: true,
        }
    }

    /// Builds the world; the rest shape of elastic bodies in the library's eyes is `rest`.
    pub fn build(self, rest: &[Vec3]) -> Host {
        let mut bodies = Vec::new();
        let body = |key: u64, surface: Arc<Surface>, kind: Kind| BodyDescription {
            key,
            surface,
            kind,
            half_thickness: Some(self.half_thickness),
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: self.self_collision,
            precision: Precision::Double,
            embedding: None,
            dynamics: None,
        };
        for (number, (range, faces)) in self.elastic_bodies.iter().enumerate() {
            let local = faces.iter().map(|f| f.map(|v| v - range.start as u32)).collect();
            let masses = self.elastic.masses[range.clone()].to_vec();
            let pinned = range.clone().map(|v| self.pinned.contains(&v)).collect();
            let kind = Kind::Deformable { masses, pinned };
            bodies.push(body(1 + number as u64, surface(rest[range.clone()].to_vec(), local), kind));
        }
        let system_bodies: Vec<u64> = bodies.iter().map(|b| b.key).collect();
        let mut poses = Vec::new();
        for (number, (mesh, pose, mass, inertia)) in self.rigid.iter().enumerate() {
            let kind = Kind::Rigid { mass: *mass, inertia: *inertia };
            let key = 10_001 + number as u64;
            bodies.push(body(key, surface(mesh.positions.clone(), mesh.faces.clone()), kind));
            poses.push((key, *pose));
        }
        for (number, (mesh, pose)) in self.obstacles.iter().enumerate() {
            let key = 20_001 + number as u64;
            let kind = Kind::Kinematic { posed: true };
            bodies.push(body(key, surface(mesh.positions.clone(), mesh.faces.clone()), kind));
            poses.push((key, *pose));
        }
        for (number, half_space) in self.half_spaces.iter().enumerate() {
            bodies.push(body(30_001 + number as u64, Arc::default(), Kind::HalfSpace(*half_space)));
        }
        let pattern = self.elastic.stiffness(&self.start);
        let system = SystemDescription {
            bodies: system_bodies,
            row_offsets: pattern.row_offsets,
            columns: pattern.columns,
            upper: false,
        };
        let material =
            Material { friction_coefficient: self.friction, combine_rule: CombineRule::default(), restitution: 0.0 };
        let materials = Materials { list: vec![material], overrides: Vec::new() };
        let model = Model::build(bodies, materials, vec![system]).expect("a valid model");
        let mut state = model.rest_state();
        state.positions[..self.start.len()].copy_from_slice(&self.start);
        for (key, pose) in poses {
            let index = model.body_index(key).expect("a body of this key");
            model.set_pose(&mut state, index, pose);
        }
        let drives = model.idle_drives(&state);
        Host {
            velocities: vec![[0.0; 3]; model.block_count],
            drives,
            state,
            memory: Memory::default(),
            scratch: Scratch::default(),
            result: StepResult::default(),
            settings: Settings { certify: true, ..Settings::default() },
            elastic: self.elastic,
            dt: self.dt,
            gravity: self.gravity,
            pinned: self.pinned,
            rigid_masses: self.rigid.iter().map(|r| (r.2, r.3)).collect(),
            model,
        }
    }
}

/// Value at a fraction of the list, which it sorts; not a number where there is none.
pub fn quantile(values: &mut [f64], fraction: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get((fraction * (values.len() as f64 - 1.0)).round() as usize).copied().unwrap_or(f64::NAN)
}

impl Host {
    /// Number of elastic vertices.
    pub fn elastic_count(&self) -> usize {
        self.elastic.masses.len()
    }

    /// The host's half of a step: matrix and unconstrained velocities into the drives.
    pub fn prepare(&mut self) -> LinearStep {
        let n = self.elastic_count();
        let mut linear = self.elastic.linear_step_with(
            &self.state.positions[..n],
            &self.velocities[..n],
            self.gravity,
            self.dt,
            &self.pinned,
        );
        self.drives = self.model.idle_drives(&self.state);
        self.drives.velocities[..n].copy_from_slice(&linear.velocities);
        for b in (n..self.model.block_count).step_by(2) {
            self.drives.velocities[b] = add_scaled(self.velocities[b], self.dt, self.gravity);
            self.drives.velocities[b + 1] = self.velocities[b + 1];
        }
        let values = std::mem::take(&mut linear.matrix.values);
        self.drives.systems = vec![System { description: self.model.systems[0].clone(), values }];
        linear.matrix.values = self.drives.systems[0].values.clone();
        linear
    }

    /// One step with the drives as they are.
    pub fn advance(&mut self, par: Par) -> Result<StepReport, StepError> {
        let Self { model, state, drives, memory, settings, dt, result, scratch, .. } = self;
        advance(Step { model, state, drives, settings, dt: *dt, result, par, watch: Watch::default() }, memory, scratch)
    }

    /// Advances by one step and draws up the balances.
    pub fn step(&mut self, par: Par) -> Result<Facts, StepError> {
        let start = thread_seconds();
        let linear = self.prepare();
        let prepared = thread_seconds();
        let report = self.advance(par)?;
        let seconds = thread_seconds() - prepared;
        self.velocities.clone_from(&self.result.end_velocities);
        Ok(self.facts(&linear, report, seconds, prepared - start))
    }

    /// The prepared step from the present state with other settings, into `result`; the host stays where it is.
    /// Processor seconds and report.
    pub fn step_of_a_copy(&mut self, settings: &Settings, par: Par) -> Result<(f64, StepReport), StepError> {
        let (mut state, mut memory) = (self.state.clone(), self.memory.clone());
        let clock = thread_seconds();
        let step = Step {
            model: &self.model,
            state: &mut state,
            drives: &self.drives,
            settings,
            dt: self.dt,
            result: &mut self.result,
            par,
            watch: Watch::default(),
        };
        let report = advance(step, &mut memory, &mut self.scratch)?;
        Ok((thread_seconds() - clock, report))
    }

    /// `|v|_A^2 / 2` over all free blocks.
    pub fn metric_energy(&self, linear: &LinearStep, v: &[Vec3]) -> f64 {
        let n = self.elastic_count();
        let mut av = vec![[0.0; 3]; n];
        linear.matrix.product(&v[..n], &mut av, Par::Serial);
        let mut sum: f64 = (0..n).map(|i| dot(av[i], v[i])).sum();
        for (k, (mass, inertia)) in self.rigid_masses.iter().enumerate() {
            let (linear, angular) = (v[n + 2 * k], v[n + 2 * k + 1]);
            // Spheres and cubes only: their inertia does not turn.
            sum += mass * dot(linear, linear) + dot(angular, mat_vec(inertia, angular));
        }
        0.5 * sum
    }

    fn facts(&self, linear: &LinearStep, report: StepReport, seconds: f64, host_seconds: f64) -> Facts {
        let n = self.elastic_count();
        let (v, free) = (&self.result.velocities, &self.drives.velocities);
        let mass = |b: usize| {
            if b < n { self.elastic.masses[b] } else { self.rigid_masses[(b - n) / 2].0 }
        };
        let (mut gained, mut given, mut size, mut total) = ([0.0; 3], [0.0; 3], 0.0, 0.0);
        for b in (0..n).chain((n..self.model.block_count).step_by(2)) {
            let change = sub(v[b], free[b]);
            gained = add_scaled(gained, mass(b), change);
            given = add_scaled(given, 1.0, self.result.impulses[b]);
            total += norm(self.result.impulses[b]);
            // A change of a thousandth of the velocity is within the default contact tolerance.
            size += mass(b) * (norm(change) + 1e-3 * norm(v[b]));
        }
        let energy_free = self.metric_energy(linear, free);
        let kinetic = (0..n).map(|b| 0.5 * mass(b) * dot(self.velocities[b], self.velocities[b])).sum();
        Facts {
            seconds,
            host_seconds,
            energy_gain: self.metric_energy(linear, v) - energy_free,
            energy_free,
            momentum_error: if size > 0.0 { norm(sub(gained, given)) / size } else { 0.0 },
            balance_error: if total > 0.0 { norm(add_scaled(given, 1.0, report.momentum_taken)) / total } else { 0.0 },
            speed: self.velocities.iter().map(|v| norm(*v)).fold(0.0, f64::max),
            kinetic,
            report,
        }
    }

    /// A hash of positions, poses and velocities: equal only for equal bits.
    pub fn hash(&self) -> u64 {
        let mut h = 0xcbf2_9ce4_8422_2325_u64;
        let mut take = |value: f64| {
            for byte in value.to_bits().to_le_bytes() {
                h = (h ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        self.state.positions.iter().flatten().for_each(|v| take(*v));
        self.velocities.iter().flatten().for_each(|v| take(*v));
        for pose in &self.state.poses {
            pose.position.iter().chain(&pose.orientation).for_each(|v| take(*v));
        }
        h
    }
}
