//! A stress scene as the library sees it: model, start state, and what drives each step.

use super::stress_parts::{Drive, Part};
use super::support::random::Random;
use signorini::kinematics::Pose;
use signorini::math::{IDENTITY, Mat3, Vec3, add, add_scaled, mat_add, mat_scale, mat_vec, norm, scale, sub, unit};
use signorini::model::{
    BodyDescription, CombineRule, Drives, HalfSpace, Kind, Material, Materials, Model, Precision, Settings, State,
    Surface, System, SystemDescription,
};
use std::sync::Arc;

/// A scene ready to run.
pub struct Scene {
    pub family: &'static str,
    pub model: Model,
    pub state: State,
    pub parts: Vec<Part>,
    pub settings: Settings,
    pub dt: f64,
    pub steps: usize,
    pub length: f64,
    pub gravity: Vec3,
    pub damping: f64,
    pub stiffness: f64,
    pub definite: bool,
    pub seed: u64,
}

fn edges_of(part: &Part) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = part
        .faces
        .iter()
        .flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]])
        .chain(part.edges.iter().copied())
        .map(|e| [e[0].min(e[1]), e[0].max(e[1])])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Builds a scene; lengths times `length`, then moved to `centre`.
#[allow(clippy::too_many_arguments)]
pub fn assemble(
    family: &'static str,
    parts: Vec<Part>,
    frictions: [f64; 2],
    settings: Settings,
    (length, centre, dt): (f64, Vec3, f64),
    (gravity, damping): (Vec3, f64),
    (stiffness, definite): (f64, bool),
    steps: usize,
    seed: u64,
) -> Scene {
    let place = |p: &Part, x: Vec3| add(centre, scale(length, p.pose.transform(x)));
    let rigid = |p: &Part| matches!(p.drive, Drive::Rigid | Drive::Posed);
    let single = |p: &Part, x: Vec3| if p.single { x.map(|c| f64::from(c as f32)) } else { x };
    let mut descriptions = Vec::new();
    for (number, p) in parts.iter().enumerate() {
        let rest: Vec<Vec3> =
            p.points.iter().map(|x| if rigid(p) { scale(length, *x) } else { single(p, place(p, *x)) }).collect();
        let mass: f64 = p.masses.iter().sum();
        let radius = p.points.iter().fold(0.05, |m: f64, x| m.max(norm(*x))) * length;
        let kind = match p.drive {
            Drive::Soft => Kind::Deformable { masses: p.masses.clone(), pinned: p.pinned.clone() },
            Drive::Rigid => Kind::Rigid { mass, inertia: mat_scale(0.4 * mass * radius * radius, &IDENTITY) },
            Drive::Posed => Kind::Kinematic { posed: true },
            Drive::Scripted => Kind::Kinematic { posed: false },
            Drive::Plane => {
                let offset = p.spin[0] * length + signorini::math::dot(p.pose.position, centre);
                Kind::HalfSpace(HalfSpace { normal: p.pose.position, offset })
            }
        };
        descriptions.push(BodyDescription {
            key: 10 + 7 * number as u64,
            surface: Arc::new(Surface {
                rest,
                vertices: (0..p.points.len() as u32).collect(),
                edges: edges_of(p),
                faces: p.faces.clone(),
            }),
            kind,
            half_thickness: Some(p.half_thickness * length),
            material: p.material,
            groups: p.groups,
            mask: p.mask,
            self_collision: p.itself,
            precision: if p.single { Precision::Single } else { Precision::Double },
            embedding: None,
            dynamics: None,
        });
    }
    let list = frictions
        .iter()
        .map(|f| Material { friction_coefficient: *f, combine_rule: CombineRule::default(), restitution: 0.0 })
        .collect();
    let mut systems = Vec::new();
    if stiffness > 0.0 {
        systems.extend(pattern(&descriptions));
    }
    let model = Model::build(descriptions, Materials { list, overrides: vec![] }, systems).unwrap();
    let mut state = model.rest_state();
    for (index, p) in parts.iter().enumerate().filter(|(_, p)| rigid(p)) {
        let position = place(p, [0.0; 3]);
        model.set_pose(&mut state, index, Pose { position, orientation: p.pose.orientation });
    }
    Scene { family, model, state, parts, settings, dt, steps, length, gravity, damping, stiffness, definite, seed }
}

/// One system over all soft bodies: every edge couples its ends; bodies tied one to the next.
fn pattern(bodies: &[BodyDescription]) -> Option<SystemDescription> {
    let mut rows: Vec<Vec<u32>> = Vec::new();
    let mut keys = Vec::new();
    for body in bodies {
        let first = rows.len() as u32;
        match body.kind {
            Kind::Deformable { .. } => {
                rows.extend((0..body.surface.rest.len() as u32).map(|v| vec![first + v]));
                for e in &body.surface.edges {
                    rows[(first + e[0]) as usize].push(first + e[1]);
                    rows[(first + e[1]) as usize].push(first + e[0]);
                }
            }
            Kind::Rigid { .. } => rows.extend([vec![first], vec![first + 1]]),
            _ => continue,
        }
        if first > 0 && !rows[first as usize].is_empty() {
            rows[first as usize].push(first - 2);
            rows[first as usize - 2].push(first);
        }
        keys.push(body.key);
    }
    if rows.is_empty() {
        return None;
    }
    let mut system = SystemDescription { bodies: keys, row_offsets: vec![0], columns: vec![], upper: false };
    for mut row in rows {
        row.sort_unstable();
        row.dedup();
        system.columns.extend(row);
        system.row_offsets.push(system.columns.len());
    }
    Some(system)
}

impl Scene {
    /// Values of the system: lumped masses plus springs along edges, stiff along and soft across, plus the ties.
    fn systems(&self, state: &State) -> Vec<System> {
        let Some(description) = self.model.systems.first() else { return Vec::new() };
        let blocks: Vec<usize> = description
            .bodies
            .iter()
            .flat_map(|k| self.model.bodies[self.model.body_index(*k).unwrap()].blocks.clone())
            .collect();
        let lumped = |b: usize| -> Mat3 {
            let body = self.model.bodies.iter().position(|x| x.blocks.contains(&b)).unwrap();
            match &self.model.bodies[body].description.kind {
                Kind::Deformable { masses, .. } => {
                    mat_scale(masses[b - self.model.bodies[body].blocks.start], &IDENTITY)
                }
                Kind::Rigid { mass, inertia } => {
                    if b == self.model.bodies[body].blocks.start {
                        mat_scale(*mass, &IDENTITY)
                    } else {
                        *inertia
                    }
                }
                _ => IDENTITY,
            }
        };
        let mut values: Vec<Mat3> = vec![[[0.0; 3]; 3]; description.columns.len()];
        let centre = |row: usize| {
            let b = blocks[row];
            let body = self.model.bodies.iter().position(|x| x.blocks.contains(&b)).unwrap();
            let body_ref = &self.model.bodies[body];
            match body_ref.description.kind {
                Kind::Deformable { .. } => state.positions[body_ref.vertices.start + b - body_ref.blocks.start],
                _ => state.poses[body].position,
            }
        };
        for row in 0..blocks.len() {
            let range = description.row_offsets[row]..description.row_offsets[row + 1];
            let mut diagonal = lumped(blocks[row]);
            for k in range.clone() {
                let column = description.columns[k] as usize;
                if column == row {
                    continue;
                }
                let along = unit(sub(centre(column), centre(row))).unwrap_or([1.0, 0.0, 0.0]);
                let mass = lumped(blocks[row])[0][0].min(lumped(blocks[column])[0][0]);
                let mut spring = [[0.0; 3]; 3];
                for i in 0..3 {
                    for j in 0..3 {
                        let isotropic = if i == j { 0.01 } else { 0.0 };
                        spring[i][j] = self.stiffness * mass * (along[i] * along[j] + isotropic);
                    }
                }
                values[k] = mat_scale(if self.definite { -1.0 } else { -2.5 }, &spring);
                diagonal = mat_add(&diagonal, &spring);
            }
            for k in range {
                if description.columns[k] as usize == row {
                    values[k] = diagonal;
                }
            }
        }
        vec![System { description: description.clone(), values }]
    }

    /// What drives step number `step` from `state`, after the velocities `last`.
    pub fn drives(&self, step: usize, state: &State, last: &[Vec3]) -> Drives {
        let mut r = Random::for_stress(self.seed.wrapping_mul(977).wrapping_add(step as u64));
        let mut drives = self.model.idle_drives(state);
        let per_step = self.length / self.dt;
        for (index, p) in self.parts.iter().enumerate() {
            let body = &self.model.bodies[index];
            let forth = if (step / p.period.max(1)).is_multiple_of(2) { 1.0 } else { -1.0 };
            match p.drive {
                Drive::Soft | Drive::Rigid => {
                    for (i, b) in body.blocks.clone().enumerate() {
                        let angular = p.drive == Drive::Rigid && i == 1;
                        let mut v = scale(self.damping, last[b]);
                        if step.is_multiple_of(5) {
                            v = if angular {
                                scale(1.0 / self.dt, p.spin)
                            } else {
                                scale(per_step, add(p.motion, r.within(p.noise)))
                            };
                        } else if !angular {
                            v = add_scaled(v, per_step, self.gravity);
                        }
                        if p.drive == Drive::Soft && p.pinned[i] {
                            v = scale(if step.is_multiple_of(4) { 0.05 * per_step } else { 0.0 }, r.within(1.0));
                        }
                        drives.velocities[b] = v;
                    }
                }
                Drive::Posed => {
                    let linear = scale(forth * per_step, p.motion);
                    let pose = state.poses[index].advanced(linear, scale(forth / self.dt, p.spin), self.dt);
                    drives.target_poses[index] = if p.single { pose.rounded_to_single() } else { pose };
                }
                Drive::Scripted => {
                    for v in body.vertices.clone() {
                        let shift = scale(self.length, add(scale(forth, p.motion), r.within(p.noise)));
                        let x = add(state.positions[v], shift);
                        drives.target_positions[v] = if p.single { x.map(|c| f64::from(c as f32)) } else { x };
                    }
                }
                Drive::Plane => {
                    let h = state.half_spaces[index];
                    let offset = h.offset + self.length * forth * signorini::math::dot(h.normal, p.motion);
                    drives.target_half_spaces[index] = HalfSpace { offset, ..h };
                }
            }
        }
        drives.systems = self.systems(state);
        drives
    }

    /// Twice the energy in the metric of the step: the system's, where there is one, else lumped.
    pub fn metric_energy(&self, drives: &Drives, start: &State, v: &[Vec3]) -> f64 {
        let Some(system) = drives.systems.first() else {
            return super::stress_oracle::lumped_energy(&self.model, start, v);
        };
        let mut free = vec![true; v.len()];
        for body in &self.model.bodies {
            if let Kind::Deformable { pinned, .. } = &body.description.kind {
                body.blocks.clone().zip(pinned).for_each(|(b, p)| free[b] = !p);
            }
        }
        let d = &system.description;
        let blocks: Vec<usize> = d
            .bodies
            .iter()
            .flat_map(|k| self.model.bodies[self.model.body_index(*k).unwrap()].blocks.clone())
            .collect();
        let mut sum = 0.0;
        for (row, b) in blocks.iter().enumerate().filter(|(_, b)| free[**b]) {
            for k in d.row_offsets[row]..d.row_offsets[row + 1] {
                let c = blocks[d.columns[k] as usize];
                if free[c] {
                    sum += signorini::math::dot(v[*b], mat_vec(&system.values[k], v[c]));
                }
            }
        }
        sum
    }
}
