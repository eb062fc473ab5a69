//! A world from a scene file.

use super::cage::cage;
use super::energy::Energies;
use super::fault::FieldFault;
use super::file::{Contact, KinematicTable, Pin, RigidTable, SceneFile, SheetTable, SolidTable};
use super::mesh_source::{MeshSource, SourceMesh};
use super::motion::{Frames, Twist, moved, shifted};
use super::placement::{Copies, Placement, Sequence};
use crate::energy::{Damping, SheetMaterial, SolidMaterial};
use crate::kinematics::Pose;
use crate::math::{Vec3, add, add_scaled, cross, dot, norm, scale, sub};
use crate::mesh::{MassProperties, Surface, TetMesh};
use crate::model::{CombineRule, HalfSpace, Material};
use crate::world::{
    BodyOptions, KinematicDescription, NodeForces, RigidDescription, SheetDescription, SheetModel, SolidDescription,
    Topology, World, WorldError,
};
use std::path::Path;

/// A body of the scene, as the runner knows it.
pub struct SceneBody {
    pub id: u64,
    /// Name of the table, with a number for copies.
    pub name: String,
    /// Triangles of its surface, for frames.
    pub triangles: Vec<[u32; 3]>,
    pub energies: Energies,
    /// What it has for contact.
    pub options: BodyOptions,
    script: Script,
}

impl SceneBody {
    /// Whether it is a sheet or a solid.
    pub fn deforms(&self) -> bool {
        matches!(self.energies, Energies::Nodes { .. })
    }

    /// Whether all of it moves as prescribed.
    pub fn is_scripted(&self) -> bool {
        matches!(self.energies, Energies::None)
    }
}

/// What drives a body from step to step.
enum Script {
    Free,
    /// Pinned nodes, their start positions, and how they move.
    Pins(Vec<PinGroup>),
    Pose(Pose, Vec<Twist>),
    /// Frames at their placement, carried along by a motion of its start pose.
    Frames {
        frames: Frames,
        placed: Pose,
        centre: Pose,
        motion: Vec<Twist>,
    },
    Plane(HalfSpace, Vec<Twist>),
}

struct PinGroup {
    nodes: Vec<(u32, Vec3)>,
    start: Pose,
    motion: Vec<Twist>,
    follow: Option<Follow>,
}

/// The body that pins follow: its motion as a whole, and the mean way of its vertices near each pin.
struct Follow {
    body: usize,
    /// Of each pin: vertices of the body with their shares.
    near: Vec<Vec<(u32, f64)>>,
}

impl Follow {
    /// Vertices within a distance of each pin at the start, the nearer the more; where there are none, the nearest.
    ///
    /// Errors: there is no such body, or it has no vertices. Cost: pins times vertices.
    fn new(scene: &Scene, name: &str, nodes: &[(u32, Vec3)], within: f64) -> Option<Follow> {
        let body = scene.bodies.iter().position(|body| body.name == name)?;
        let positions = scene.world.positions(scene.bodies[body].id).ok()?;
        let near = |x: Vec3| {
            let distances: Vec<f64> = positions.iter().map(|p| norm(sub(*p, x))).collect();
            let share = |d: f64| (1.0 - (d / within).powi(2)).powi(2);
            let mut near: Vec<(u32, f64)> =
                (0..).zip(&distances).filter(|(_, d)| **d < within).map(|(v, d)| (v, share(*d))).collect();
            let total: f64 = near.iter().map(|(_, share)| share).sum();
            near.iter_mut().for_each(|(_, share)| *share /= total);
            if near.is_empty() {
                let nearest = (0..distances.len()).min_by(|a, b| distances[*a].total_cmp(&distances[*b]))?;
                near.push((nearest as u32, 1.0));
            }
            Some(near)
        };
        Some(Follow { body, near: nodes.iter().map(|(_, x)| near(*x)).collect::<Option<_>>()? })
    }
}

/// A world with its script.
pub struct Scene {
    pub world: World,
    pub bodies: Vec<SceneBody>,
    pub vertices: usize,
    /// Of bodies that are not scripted.
    pub free_vertices: usize,
    pub tetrahedra: usize,
}

impl Scene {
    /// Builds the bodies of a file in its order; meshes are sought from `folder`. A jitter seed above 0 moves starts.
    ///
    /// Errors name the field: a mesh that cannot be read or does not fit, what the world refuses.
    pub fn build(file: &SceneFile, folder: &Path, jitter_seed: u64) -> Result<Scene, FieldFault> {
        let mut builder = Builder {
            scene: Scene { world: World::new(), bodies: Vec::new(), vertices: 0, free_vertices: 0, tetrahedra: 0 },
            folder,
            materials: Vec::new(),
            jitter_seed,
            jitter: file.jitter,
        };
        let world = &mut builder.scene.world;
        world.set_gravity(file.gravity).map_err(|e| refused("gravity", &e))?;
        world.set_wind(file.wind).map_err(|e| refused("wind", &e))?;
        // First, because pins follow them.
        for (i, table) in file.kinematic.iter().enumerate() {
            builder.kinematic(table, &format!("kinematic[{i}]"))?;
        }
        for (i, table) in file.sheet.iter().enumerate() {
            for table in table.variants() {
                builder.sheets(&table, &format!("sheet[{i}]"))?;
            }
        }
        for (i, table) in file.solid.iter().enumerate() {
            for table in table.variants() {
                builder.solids(&table, &format!("solid[{i}]"))?;
            }
        }
        for (i, table) in file.rigid.iter().enumerate() {
            for table in table.variants() {
                builder.rigid(&table, &format!("rigid[{i}]"))?;
            }
        }
        for (i, table) in file.half_space.iter().enumerate() {
            let at = format!("half_space[{i}]");
            let options = builder.options(&table.contact(), &at)?;
            let length = norm(table.normal);
            let plane = HalfSpace { normal: scale(1.0 / length, table.normal), offset: table.offset / length };
            let id = builder.scene.world.add_half_space(options, plane).map_err(|e| refused(&at, &e))?;
            let script = Script::Plane(plane, table.motion.clone());
            let body = SceneBody {
                id,
                name: table.name.clone(),
                triangles: Vec::new(),
                energies: Energies::None,
                options,
                script,
            };
            builder.add(body);
        }
        Ok(builder.scene)
    }

    /// Pushes what scripted bodies do from where they stand to time `t`.
    pub fn push_targets(&mut self, t: f64) -> Result<(), WorldError> {
        for body in &self.bodies {
            match &body.script {
                Script::Free => {}
                Script::Pins(groups) => {
                    let mut targets = self.world.node_positions(body.id)?.to_vec();
                    for group in groups {
                        if let Some(follow) = &group.follow {
                            let ways = self.scripted_ways(follow.body, t);
                            let (start, end) = self.scripted_pose(follow.body, t);
                            for ((node, x), near) in group.nodes.iter().zip(&follow.near) {
                                let way = near.iter().map(|(v, share)| (ways.get(*v as usize), share));
                                let way = way.fold([0.0; 3], |sum, (way, share)| {
                                    add_scaled(sum, *share, way.copied().unwrap_or_default())
                                });
                                targets[*node as usize] = end.transform(sub(add(*x, way), start.position));
                            }
                            continue;
                        }
                        let pose = moved(group.start, &group.motion, t);
                        for (node, x) in &group.nodes {
                            targets[*node as usize] =
                                if pose == group.start { *x } else { pose.transform(sub(*x, group.start.position)) };
                        }
                    }
                    self.world.push_target_positions(body.id, targets)?;
                }
                Script::Pose(start, motion) => self.world.push_target_pose(body.id, moved(*start, motion, t))?,
                Script::Frames { frames, placed, centre, motion } => {
                    let pose = moved(*centre, motion, t);
                    let mut targets = frames.at(t, placed);
                    if pose != *centre {
                        targets.iter_mut().for_each(|x| *x = pose.transform(sub(*x, centre.position)));
                    }
                    self.world.push_target_positions(body.id, targets)?;
                }
                Script::Plane(plane, motion) => {
                    let offset = plane.offset + dot(plane.normal, shifted(motion, t));
                    self.world.push_target_half_space(body.id, HalfSpace { offset, ..*plane })?;
                }
            }
        }
        Ok(())
    }
}

impl Scene {
    /// Where the centre of a scripted body's motion as a whole is at the start, and its pose at time `t`.
    fn scripted_pose(&self, body: usize, t: f64) -> (Pose, Pose) {
        match &self.bodies[body].script {
            Script::Frames { centre, motion, .. } => (*centre, moved(*centre, motion, t)),
            Script::Pose(start, motion) => (*start, moved(*start, motion, t)),
            _ => (Pose::IDENTITY, Pose::IDENTITY),
        }
    }

    /// How far the frames of a scripted body have moved its vertices at time `t`, without its motion as a whole; nothing
    /// for a body without frames.
    fn scripted_ways(&self, body: usize, t: f64) -> Vec<Vec3> {
        let Script::Frames { frames, placed, .. } = &self.bodies[body].script else { return Vec::new() };
        frames.at(t, placed).iter().zip(frames.at(0.0, placed)).map(|(to, from)| sub(*to, from)).collect()
    }
}

struct Builder<'a> {
    scene: Scene,
    folder: &'a Path,
    /// Materials with their ids.
    materials: Vec<(u64, Material)>,
    jitter_seed: u64,
    jitter: Option<f64>,
}

impl Builder<'_> {
    fn sheets(&mut self, table: &SheetTable, at: &str) -> Result<(), FieldFault> {
        let mesh = self.scaled_mesh(&table.mesh, &table.placement, &format!("{at}.mesh"))?;
        if mesh.triangles.is_empty() {
            return Err(FieldFault::new(format!("{at}.mesh"), "a sheet needs triangles"));
        }
        let m = &table.material;
        let damping =
            Damping { mass_rate: m.mass_damping, stretch_time: m.stretch_damping, bending_time: m.bending_damping };
        let material = SheetMaterial {
            density: m.density,
            thickness: m.thickness,
            young_modulus: m.young_modulus,
            poisson_ratio: m.poisson_ratio,
            bending_stiffness: m.bending_stiffness,
            flat: m.flat,
            rest_scale: m.rest_scale,
            damping,
        };
        let of_material =
            |(message, index, value): (&str, usize, f64)| FieldFault::new(at, format!("{message} ({index}, {value})"));
        let masses = material.lumped_masses(&mesh.positions, &mesh.triangles).map_err(of_material)?;
        let (model, forces) = match m.spring_bend_ratio {
            None => (SheetModel::Shell, material.shell(&mesh.positions, &mesh.triangles)),
            Some(bend_ratio) => {
                let made = material.mass_spring(&mesh.positions, &mesh.triangles, bend_ratio);
                (SheetModel::MassSpring { bend_ratio }, made)
            }
        };
        let forces = std::sync::Arc::new(forces.map_err(of_material)?);
        let options = self.options(&table.contact(), at)?;
        for (name, pose) in copies(&table.name, &table.placement, table.copies.as_ref()) {
            let mut positions: Vec<Vec3> = mesh.positions.iter().map(|x| pose.transform(*x)).collect();
            let amount = self.jitter_amount(&mesh.positions, &mesh.triangles);
            let mut random = self.random();
            if let Some(random) = &mut random {
                positions.iter_mut().for_each(|x| *x = add_scaled(*x, amount, random.in_ball()));
            }
            let (node_forces, script) =
                nodes(&self.scene, &positions, &table.pins, [table.velocity, table.angular_velocity], table.drag, at)?;
            let topology = Topology { triangles: mesh.triangles.clone(), ..Topology::default() };
            let description = SheetDescription {
                options,
                positions,
                rest: mesh.positions.clone(),
                topology,
                material,
                model,
                forces: node_forces,
            };
            let id = self.scene.world.add_sheet(description).map_err(|e| refused(at, &e))?;
            let energies = Energies::Nodes { masses: masses.clone(), forces: forces.clone() };
            self.add(SceneBody { id, name, triangles: mesh.triangles.clone(), energies, options, script });
        }
        Ok(())
    }

    fn solids(&mut self, table: &SolidTable, at: &str) -> Result<(), FieldFault> {
        let surface = match &table.surface {
            Some(source) => Some(self.scaled_mesh(source, &table.placement, &format!("{at}.surface"))?),
            None => None,
        };
        let mesh = match (&table.mesh, &surface) {
            (MeshSource::Cage { cell }, Some(surface)) => cage(surface, scale(table.placement.scale, *cell))
                .map_err(|message| FieldFault::new(format!("{at}.mesh.cage"), message))?,
            (source, _) => self.scaled_mesh(source, &table.placement, &format!("{at}.mesh"))?,
        };
        if mesh.tetrahedra.is_empty() {
            let message = "a solid needs tetrahedra: box_tetrahedra, cylinder_tetrahedra, cage or gmsh";
            return Err(FieldFault::new(format!("{at}.mesh"), message));
        }
        let m = &table.material;
        let damping = Damping { mass_rate: m.mass_damping, stretch_time: m.stretch_damping, bending_time: 0.0 };
        let material = SolidMaterial {
            density: m.density,
            young_modulus: m.young_modulus,
            poisson_ratio: m.poisson_ratio,
            rest_scale: m.rest_scale,
            damping,
        };
        let of_mesh = |e: crate::mesh::MeshError| FieldFault::new(format!("{at}.mesh"), e.to_string());
        let tets = TetMesh::new(mesh.positions.clone(), mesh.tetrahedra.clone()).map_err(of_mesh)?;
        let masses = tets.lumped_masses(material.density);
        let forces = material.solid(&tets).map_err(|f| FieldFault::new(at, format!("{} ({}, {})", f.0, f.1, f.2)))?;
        let forces = std::sync::Arc::new(forces);
        let faces = match &surface {
            Some(surface) => surface.triangles.clone(),
            None => tets.boundary().map_err(of_mesh)?,
        };
        let options = self.options(&table.contact(), at)?;
        for (name, pose) in copies(&table.name, &table.placement, table.copies.as_ref()) {
            let amount = self.jitter_amount(&mesh.positions, &mesh.tetrahedra);
            let shift = self.random().map_or([0.0; 3], |mut random| scale(amount, random.in_ball()));
            let positions: Vec<Vec3> = mesh.positions.iter().map(|x| add(pose.transform(*x), shift)).collect();
            let (node_forces, script) =
                nodes(&self.scene, &positions, &table.pins, [table.velocity, table.angular_velocity], table.drag, at)?;
            let embedded = surface.as_ref().map(|surface| {
                let topology = Topology { triangles: surface.triangles.clone(), ..Topology::default() };
                (surface.positions.clone(), topology)
            });
            let description = SolidDescription {
                options,
                positions,
                rest: mesh.positions.clone(),
                tetrahedra: mesh.tetrahedra.clone(),
                embedded,
                material,
                host_driven: false,
                forces: node_forces,
            };
            let id = self.scene.world.add_solid(description).map_err(|e| refused(at, &e))?;
            let energies = Energies::Nodes { masses: masses.clone(), forces: forces.clone() };
            self.scene.tetrahedra += mesh.tetrahedra.len();
            self.add(SceneBody { id, name, triangles: faces.clone(), energies, options, script });
        }
        Ok(())
    }

    fn rigid(&mut self, table: &RigidTable, at: &str) -> Result<(), FieldFault> {
        let mesh = self.scaled_mesh(&table.mesh, &table.placement, &format!("{at}.mesh"))?;
        let of_mesh = |e: crate::mesh::MeshError| FieldFault::new(format!("{at}.mesh"), e.to_string());
        let surface = Surface::from_triangles(mesh.positions.clone(), mesh.triangles.clone()).map_err(of_mesh)?;
        let mass = MassProperties::of_closed_mesh(&surface, table.density).map_err(of_mesh)?;
        let vertices: Vec<Vec3> = mesh.positions.iter().map(|x| sub(*x, mass.centre)).collect();
        let options = self.options(&table.contact(), at)?;
        for (name, pose) in copies(&table.name, &table.placement, table.copies.as_ref()) {
            let amount = self.jitter_amount(&mesh.positions, &mesh.triangles);
            let shift = self.random().map_or([0.0; 3], |mut random| scale(amount, random.in_ball()));
            let description = RigidDescription {
                options,
                vertices: vertices.clone(),
                topology: Topology { triangles: mesh.triangles.clone(), ..Topology::default() },
                mass: mass.mass,
                inertia: mass.inertia,
                inertia_in_world: false,
                pose: Pose { position: add(pose.transform(mass.centre), shift), ..pose },
                velocity: table.velocity,
                angular_velocity: table.angular_velocity,
                own_dynamics: Some([table.linear_damping, table.angular_damping]),
            };
            let id = self.scene.world.add_rigid(description).map_err(|e| refused(at, &e))?;
            let energies = Energies::Rigid { mass: mass.mass, inertia: mass.inertia };
            let triangles = mesh.triangles.clone();
            self.add(SceneBody { id, name, triangles, energies, options, script: Script::Free });
        }
        Ok(())
    }

    fn kinematic(&mut self, table: &KinematicTable, at: &str) -> Result<(), FieldFault> {
        let mesh = self.scaled_mesh(&table.mesh, &table.placement, &format!("{at}.mesh"))?;
        let options = self.options(&table.contact(), at)?;
        let placed = table.placement.pose();
        let topology = Topology { triangles: mesh.triangles.clone(), ..Topology::default() };
        let centre = table.centre.unwrap_or(placed.position);
        let start = Pose { position: centre, ..Pose::IDENTITY };
        let motion = table.motion.clone();
        let (description, script) = if let Some(frames) = &table.frames {
            let frames = Frames::read(frames, self.folder, mesh.positions.len(), &format!("{at}.frames"))?
                .scaled(table.placement.scale);
            let vertices = frames.at(0.0, &placed);
            let description = KinematicDescription { options, vertices, topology, pose: None };
            (description, Script::Frames { frames, placed, centre: start, motion })
        } else {
            // The body frame has its origin at the centre of turns and the axes of the world.
            let vertices = mesh.positions.iter().map(|x| sub(placed.transform(*x), centre)).collect();
            let description = KinematicDescription { options, vertices, topology, pose: Some(start) };
            (description, Script::Pose(start, motion))
        };
        let id = self.scene.world.add_kinematic(description).map_err(|e| refused(at, &e))?;
        let (name, triangles) = (table.name.clone(), mesh.triangles);
        self.add(SceneBody { id, name, triangles, energies: Energies::None, options, script });
        Ok(())
    }

    fn add(&mut self, body: SceneBody) {
        let vertices = self.scene.world.positions(body.id).map_or(0, <[Vec3]>::len);
        self.scene.vertices += vertices;
        self.scene.free_vertices += if body.is_scripted() { 0 } else { vertices };
        self.scene.bodies.push(body);
    }

    fn scaled_mesh(&self, source: &MeshSource, placement: &Placement, at: &str) -> Result<SourceMesh, FieldFault> {
        let mut mesh = source.mesh(self.folder, at)?;
        mesh.positions.iter_mut().for_each(|x| *x = scale(placement.scale, *x));
        Ok(mesh)
    }

    /// One material per pair of coefficients; a pair has the geometric mean of frictions.
    fn options(&mut self, contact: &Contact, at: &str) -> Result<BodyOptions, FieldFault> {
        let (friction_coefficient, restitution) = (contact.friction, contact.restitution);
        let material = Material { friction_coefficient, combine_rule: CombineRule::GeometricMean, restitution };
        let known = self.materials.iter().find(|(_, known)| *known == material).map(|(id, _)| *id);
        let material = match known {
            Some(id) => id,
            None => {
                let id = self.scene.world.add_material(material).map_err(|e| refused(at, &e))?;
                self.materials.push((id, material));
                id
            }
        };
        let bits = |groups: &[u32]| groups.iter().fold(0u64, |bits, group| bits | 1 << group);
        Ok(BodyOptions {
            half_thickness: contact.half_thickness,
            material,
            groups: if contact.groups.is_empty() { 1 } else { bits(&contact.groups) },
            mask: contact.mask.as_ref().map_or(u64::MAX, |mask| bits(mask)),
            self_collision: contact.self_collision,
            ..BodyOptions::default()
        })
    }

    /// Random numbers of the next body; none without a jitter seed.
    fn random(&self) -> Option<Sequence> {
        (self.jitter_seed > 0).then(|| Sequence::new(self.jitter_seed, self.scene.bodies.len() as u64))
    }

    fn jitter_amount<const N: usize>(&self, positions: &[Vec3], elements: &[[u32; N]]) -> f64 {
        self.jitter.unwrap_or_else(|| {
            let length = |e: &[u32; N]| norm(sub(positions[e[1] as usize], positions[e[0] as usize]));
            1e-3 * elements.iter().map(length).sum::<f64>() / elements.len().max(1) as f64
        })
    }
}

/// Names and poses of the copies of a body, or of itself.
fn copies(name: &str, placement: &Placement, copies: Option<&Copies>) -> Vec<(String, Pose)> {
    let pose = placement.pose();
    match copies {
        None => vec![(name.to_string(), pose)],
        Some(copies) => {
            let poses = copies.poses(&pose).into_iter().enumerate();
            poses.map(|(i, pose)| (format!("{name}_{i}"), pose)).collect()
        }
    }
}

/// Start velocities, pins and their script.
fn nodes(
    scene: &Scene,
    positions: &[Vec3],
    pins: &[Pin],
    [velocity, angular]: [Vec3; 2],
    drag: f64,
    at: &str,
) -> Result<(NodeForces, Script), FieldFault> {
    let middle = middle(positions.iter());
    let velocities = match angular == [0.0; 3] {
        true => vec![velocity; positions.len()],
        false => positions.iter().map(|x| add(velocity, cross(angular, sub(*x, middle)))).collect(),
    };
    let mut pinned = vec![false; if pins.is_empty() { 0 } else { positions.len() }];
    let mut groups = Vec::new();
    for (i, pin) in pins.iter().enumerate() {
        let mut found = pin.vertices.clone();
        if let Some(v) = found.iter().find(|v| **v as usize >= positions.len()) {
            let field = format!("{at}.pins[{i}].vertices");
            return Err(FieldFault::new(field, format!("there is no vertex {v} among {}", positions.len())));
        }
        if let Some([low, high]) = pin.within {
            let inside = |x: &Vec3| (0..3).all(|k| low[k] <= x[k] && x[k] <= high[k]);
            found.extend((0..positions.len() as u32).filter(|v| inside(&positions[*v as usize])));
        }
        found.sort_unstable();
        found.dedup();
        if found.is_empty() {
            return Err(FieldFault::new(format!("{at}.pins[{i}].within"), "no vertex lies in the box"));
        }
        let centre = pin.centre.unwrap_or_else(|| self::middle(found.iter().map(|v| &positions[*v as usize])));
        found.iter().for_each(|v| pinned[*v as usize] = true);
        let nodes: Vec<(u32, Vec3)> = found.iter().map(|v| (*v, positions[*v as usize])).collect();
        let follow = match &pin.follow {
            None => None,
            Some(name) => {
                Some(Follow::new(scene, name, &nodes, pin.follow_within.unwrap_or(0.0)).ok_or_else(|| {
                    FieldFault::new(format!("{at}.pins[{i}].follow"), format!("the body '{name}' has no vertices"))
                })?)
            }
        };
        let start = Pose { position: centre, ..Pose::IDENTITY };
        groups.push(PinGroup { nodes, start, motion: pin.motion.clone(), follow });
    }
    let script = if groups.is_empty() { Script::Free } else { Script::Pins(groups) };
    Ok((NodeForces { velocities, pinned, drag, ..NodeForces::default() }, script))
}

fn middle<'a>(points: impl Iterator<Item = &'a Vec3>) -> Vec3 {
    let (sum, count) = points.fold(([0.0; 3], 0usize), |(sum, count), x| (add(sum, *x), count + 1));
    scale(1.0 / count.max(1) as f64, sum)
}

/// What the world says of a body, with the field that described it.
fn refused(at: &str, error: &WorldError) -> FieldFault {
    let mut message = error.message.clone();
    if error.index != u64::MAX {
        message += &format!(" (index {})", error.index);
    }
    if !error.value.is_nan() {
        message += &format!(" (value {})", error.value);
    }
    FieldFault::new(at, message)
}
