//! Small worlds, stepped by hand.

use crate::support::shapes::{Triangles, cloth_grid, edges_of, sphere};
use signorini::implicit_contact::{Memory, Scratch, advance};
use signorini::kinematics::Pose;
use signorini::math::{Mat3, Vec3, add, add_scaled, mat_vec};
use signorini::model::*;
use signorini::parallel::Par;
use signorini::step::Step;
use signorini::velocity_filter;
use std::sync::Arc;

pub const HALF_THICKNESS: f64 = 1e-3;

/// Numbers in -1..1 from a seed; seed 0 gives zeros, so that the first variant is the plain scene.
pub struct Jitter(pub u64);

impl Jitter {
    pub fn next(&mut self) -> f64 {
        if self.0 == 0 {
            return 0.0;
        }
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self, amount: f64) -> Vec3 {
        [self.next() * amount, self.next() * amount, self.next() * amount]
    }
}

pub fn surface(mesh: &Triangles) -> Arc<Surface> {
    let edges = edges_of(&mesh.faces);
    let vertices = (0..mesh.positions.len() as u32).collect();
    Arc::new(Surface { rest: mesh.positions.clone(), vertices, edges, faces: mesh.faces.clone() })
}

pub fn diagonal(v: f64) -> Mat3 {
    [[v, 0.0, 0.0], [0.0, v, 0.0], [0.0, 0.0, v]]
}

pub fn at(position: Vec3) -> Pose {
    Pose { position, ..Pose::IDENTITY }
}

/// A box about the origin with two triangles a side.
pub fn block(sides: Vec3) -> Triangles {
    let mut mesh = crate::support::scenes::cube(1.0);
    mesh.positions.iter_mut().for_each(|p| *p = [p[0] * sides[0], p[1] * sides[1], p[2] * sides[2]]);
    mesh
}

pub fn ball(radius: f64) -> Triangles {
    sphere([0.0; 3], radius, 2)
}

pub fn sheet(n: usize, size: f64) -> Triangles {
    cloth_grid(n, size)
}

/// Bodies before the world is built.
#[derive(Clone, Default)]
pub struct Plan {
    bodies: Vec<BodyDescription>,
    placed: Vec<(u64, Option<Pose>, Option<Vec<Vec3>>)>,
    velocities: Vec<(u64, Vec<Vec3>)>,
    friction: f64,
}

impl Plan {
    /// No bodies yet, everything with this friction coefficient.
    pub fn rubbing(friction: f64) -> Plan {
        Plan { friction, ..Plan::default() }
    }

    fn push(&mut self, surface: Arc<Surface>, kind: Kind) -> u64 {
        let key = self.bodies.len() as u64 + 1;
        self.bodies.push(BodyDescription {
            key,
            surface,
            kind,
            half_thickness: Some(HALF_THICKNESS),
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: false,
            precision: Precision::Double,
            embedding: None,
            dynamics: None,
        });
        key
    }

    pub fn last(&mut self) -> &mut BodyDescription {
        self.bodies.last_mut().unwrap()
    }

    pub fn cloth(&mut self, mesh: &Triangles, start: Vec<Vec3>, mass: f64, pinned: &[usize], v: Vec3) -> u64 {
        let count = mesh.positions.len();
        let pins = (0..count).map(|i| pinned.contains(&i)).collect();
        let key = self.push(surface(mesh), Kind::Deformable { masses: vec![mass / count as f64; count], pinned: pins });
        let speed = (0..count).map(|i| if pinned.contains(&i) { [0.0; 3] } else { v }).collect();
        self.placed.push((key, None, Some(start)));
        self.velocities.push((key, speed));
        key
    }

    pub fn rigid(&mut self, mesh: &Triangles, pose: Pose, mass: f64, inertia: Mat3, v: Vec3, w: Vec3) -> u64 {
        let key = self.push(surface(mesh), Kind::Rigid { mass, inertia });
        self.placed.push((key, Some(pose), None));
        self.velocities.push((key, vec![v, w]));
        key
    }

    pub fn scripted(&mut self, mesh: &Triangles, pose: Pose) -> u64 {
        let key = self.push(surface(mesh), Kind::Kinematic { posed: true });
        self.placed.push((key, Some(pose), None));
        key
    }

    pub fn half_space(&mut self, normal: Vec3, offset: f64) -> u64 {
        self.push(Arc::default(), Kind::HalfSpace(HalfSpace { normal, offset }))
    }

    pub fn build(self) -> World {
        let material =
            Material { friction_coefficient: self.friction, combine_rule: CombineRule::default(), restitution: 0.0 };
        let materials = Materials { list: vec![material], overrides: Vec::new() };
        let model = Model::build(self.bodies, materials, Vec::new()).expect("a valid model");
        let mut state = model.rest_state();
        for (key, pose, positions) in self.placed {
            let index = model.body_index(key).unwrap();
            if let Some(pose) = pose {
                model.set_pose(&mut state, index, pose);
            }
            if let Some(positions) = positions {
                state.positions[model.bodies[index].vertices.clone()].copy_from_slice(&positions);
            }
        }
        let mut velocities = vec![[0.0; 3]; model.block_count];
        for (key, v) in self.velocities {
            velocities[model.bodies[model.body_index(key).unwrap()].blocks.clone()].copy_from_slice(&v);
        }
        World {
            drives: model.idle_drives(&state),
            state,
            velocities,
            memory: Memory::default(),
            scratch: Scratch::default(),
            filter_scratch: velocity_filter::Scratch::default(),
            result: StepResult::default(),
            settings: Settings { certify: true, ..Settings::default() },
            gravity: [0.0; 3],
            dt: 0.01,
            model,
        }
    }
}

pub struct World {
    pub model: Model,
    pub state: State,
    pub velocities: Vec<Vec3>,
    pub drives: Drives,
    pub memory: Memory,
    pub scratch: Scratch,
    pub filter_scratch: velocity_filter::Scratch,
    pub result: StepResult,
    pub settings: Settings,
    pub gravity: Vec3,
    pub dt: f64,
}

impl World {
    /// Unconstrained velocities: those at the start plus gravity; scripted bodies stay unless told otherwise later.
    pub fn prepare(&mut self) {
        self.drives = self.model.idle_drives(&self.state);
        self.drives.velocities.clone_from(&self.velocities);
        for body in &self.model.bodies {
            match &body.description.kind {
                Kind::Deformable { pinned, .. } => {
                    for (block, pin) in body.blocks.clone().zip(pinned) {
                        let v = &mut self.drives.velocities[block];
                        *v = if *pin { [0.0; 3] } else { add_scaled(*v, self.dt, self.gravity) };
                    }
                }
                Kind::Rigid { .. } => {
                    let v = &mut self.drives.velocities[body.blocks.start];
                    *v = add_scaled(*v, self.dt, self.gravity);
                }
                _ => {}
            }
        }
    }

    /// One step with the drives as they are.
    pub fn advance(&mut self, par: Par) -> Result<StepReport, StepError> {
        let World { model, state, drives, memory, settings, dt, result, scratch, filter_scratch, .. } = self;
        let step = Step { model, state, drives, settings, dt: *dt, result, par, watch: Watch::default() };
        let report = match settings.method {
            Method::ImplicitContact => advance(step, memory, scratch),
            Method::VelocityFilter => velocity_filter::advance(step, &mut memory.carried, filter_scratch),
        };
        self.velocities.clone_from(&self.result.end_velocities);
        report
    }

    /// Prepares and advances; every step is certified.
    pub fn step(&mut self) -> StepReport {
        self.prepare();
        let report = self.advance(Par::Serial).expect("a step");
        assert_eq!(report.intersections, Some(0), "the certificate holds");
        report
    }

    pub fn pose(&self, key: u64) -> Pose {
        self.state.poses[self.model.body_index(key).unwrap()]
    }

    pub fn body(&self, key: u64) -> &Body {
        &self.model.bodies[self.model.body_index(key).unwrap()]
    }

    /// Mass and world inertia of every block; infinite masses as zero.
    pub fn masses(&self) -> Vec<Mat3> {
        let mut masses = vec![diagonal(0.0); self.model.block_count];
        for (index, body) in self.model.bodies.iter().enumerate() {
            match &body.description.kind {
                Kind::Deformable { masses: m, pinned } => {
                    for (i, block) in body.blocks.clone().enumerate() {
                        masses[block] = diagonal(if pinned[i] { 0.0 } else { m[i] });
                    }
                }
                Kind::Rigid { mass, inertia } => {
                    masses[body.blocks.start] = diagonal(*mass);
                    masses[body.blocks.start + 1] =
                        signorini::kinematics::world_inertia(&self.state.poses[index], inertia);
                }
                _ => {}
            }
        }
        masses
    }

    pub fn script(&mut self, key: u64, pose: Pose) {
        let index = self.model.body_index(key).unwrap();
        self.drives.target_poses[index] = pose;
    }

    pub fn hash(&self) -> u64 {
        let mut h = 0xcbf2_9ce4_8422_2325_u64;
        let all = self.state.positions.iter().chain(&self.result.velocities).chain(&self.result.impulses);
        for value in all.flatten() {
            h = (h ^ value.to_bits()).wrapping_mul(0x0000_0100_0000_01b3);
        }
        h
    }
}

/// `sum v_i · (M v)_i / 2`
pub fn kinetic(masses: &[Mat3], v: &[Vec3]) -> f64 {
    masses.iter().zip(v).map(|(m, v)| 0.5 * signorini::math::dot(mat_vec(m, *v), *v)).sum()
}

/// Linear momentum of deformable vertices and centres of mass, given the blocks that are linear.
pub fn momentum(world: &World, v: &[Vec3]) -> Vec3 {
    let masses = world.masses();
    let mut sum = [0.0; 3];
    for body in &world.model.bodies {
        let linear = match body.description.kind {
            Kind::Rigid { .. } => body.blocks.start..body.blocks.start + 1,
            _ => body.blocks.clone(),
        };
        for block in linear {
            sum = add(sum, mat_vec(&masses[block], v[block]));
        }
    }
    sum
}

pub fn moved(mesh: &Triangles, by: Vec3, jitter: &mut Jitter, amount: f64) -> Vec<Vec3> {
    mesh.positions.iter().map(|p| add(add(*p, by), jitter.vector(amount))).collect()
}
