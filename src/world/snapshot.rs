//! Snapshots: everything that the next steps depend on, as bytes; and the hash of it.
//!
//! Layout, little-endian: the magic number, the format version (`u32`), the length of the rest and its checksum (`u64`
//! each), then the sections: slots and bodies, slots and materials, pair frictions, slots and systems, the method's memory,
//! the contacts of the last step, gravity and wind. What names something names it by key, without the tag of a world.
//!
//! What is not in it: witnesses, buffers, and that the state was certified. The first step after loading certifies its
//! start again, so that not even a forged snapshot makes a step start from an intersection unseen.

use super::archive::{Archive, Count, Hash, Room, Sink, Source, archive_enum, archive_struct};
use super::body::{Body, Certified, check_masses, checked_half_space, symmetric};
use super::ids::{Slots, key};
use super::system::{HostSystem, SymmetrySlack, check_pattern, symmetrise};
use super::{Fault, World, WorldError};
use crate::contact_search::{ContactKey, PairKind};
use crate::implicit_contact::{Memory, RememberedContact, Scratch};
use crate::kinematics::Pose;
use crate::math::{is_finite, norm_squared};
use crate::mesh::Surface;
use crate::model::{
    BodyDescription, CombineRule, ContactRecord, Dynamics, HalfSpace, Kind, Material, Model, Precision, State,
    StepResult,
};
use crate::step::Carried;
use std::sync::Arc;

/// Version of the format that is written, and the only one that is read.
pub const SNAPSHOT_FORMAT: u32 = 3;

const MAGIC: [u8; 8] = *b"SGNSNAP\0";

/// How far the squared length of a quaternion or normal may be from 1, as the step itself demands.
const POSE_SLACK: f64 = 1e-3;
const NORMAL_SLACK: f64 = 1e-6;

/// Magic number, version, length, checksum.
const HEADER: usize = 8 + 4 + 8 + 8;

archive_enum!(PairKind { 0 => PairKind::VertexFace, 1 => PairKind::EdgeEdge, 2 => PairKind::VertexHalfSpace });
archive_enum!(Precision { 0 => Precision::Single, 1 => Precision::Double });
archive_enum!(CombineRule {
    0 => CombineRule::GeometricMean,
    1 => CombineRule::Mean,
    2 => CombineRule::Minimum,
    3 => CombineRule::Maximum,
    4 => CombineRule::Product,
});
archive_struct!(Pose { position, orientation });
archive_struct!(HalfSpace { normal, offset });
archive_struct!(Surface { rest, vertices, edges, faces });
archive_struct!(Material { friction_coefficient, combine_rule, restitution });
archive_struct!(ContactKey { bodies, kind, features, ordinal });
archive_struct!(RememberedContact { key, impulse, tangent });
archive_struct!(ContactRecord { bodies, kind, features, weights, point, normal, distance, impulse, state, key });
archive_struct!(HostSystem { bodies, row_offsets, columns, upper, values });
archive_struct!(Certified { positions, pose, half_space });
archive_struct!(BodyDescription {
    key,
    surface,
    kind,
    half_thickness,
    material,
    groups,
    mask,
    self_collision,
    precision,
    embedding,
    dynamics,
});
archive_struct!(Body {
    description,
    material,
    user_key,
    positions,
    pose,
    half_space,
    stepped,
    certified,
    velocities,
    target_positions,
    target_pose,
    target_half_space,
    attachments,
    attachment_targets,
    result_velocities,
    result_end_velocities,
    result_impulses,
});

impl Archive for Arc<Surface> {
    fn save(&self, out: &mut dyn Sink) {
        self.as_ref().save(out);
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        Surface::load(source).map(Arc::new)
    }
}

impl Archive for Kind {
    fn save(&self, out: &mut dyn Sink) {
        match self {
            Kind::Deformable { masses, pinned } => {
                0u8.save(out);
                masses.save(out);
                pinned.save(out);
            }
            Kind::Rigid { mass, inertia } => {
                1u8.save(out);
                mass.save(out);
                inertia.save(out);
            }
            Kind::Kinematic { posed } => {
                2u8.save(out);
                posed.save(out);
            }
            Kind::HalfSpace(plane) => {
                3u8.save(out);
                plane.save(out);
            }
        }
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        Ok(match u8::load(source)? {
            0 => Kind::Deformable { masses: Archive::load(source)?, pinned: Archive::load(source)? },
            1 => Kind::Rigid { mass: Archive::load(source)?, inertia: Archive::load(source)? },
            2 => Kind::Kinematic { posed: Archive::load(source)? },
            3 => Kind::HalfSpace(Archive::load(source)?),
            other => return Err(source.mismatch("a number names no kind of body", f64::from(other))),
        })
    }
}

impl Archive for Memory {
    fn save(&self, out: &mut dyn Sink) {
        self.contacts.save(out);
        self.dt.save(out);
        self.velocities.save(out);
        self.carried.accelerations.save(out);
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        let (contacts, dt, velocities) = Archive::load(source)?;
        let carried = Carried { accelerations: Archive::load(source)?, certified: None };
        Ok(Memory { contacts, dt, velocities, carried })
    }
}

impl World {
    /// Bytes that a snapshot of the present state takes. Cost: linear.
    pub fn snapshot_size(&self) -> usize {
        let mut count = Count::default();
        self.save_sections(&mut count);
        HEADER + count.0
    }

    /// Writes a snapshot into `room` and returns its length. Errors: `room` is smaller than [`World::snapshot_size`],
    /// with that size; `room` is then as it was. Cost: linear.
    pub fn save_snapshot(&self, room: &mut [u8]) -> Result<usize, WorldError> {
        let size = self.snapshot_size();
        let have = room.len();
        let Some((header, sections)) = room.get_mut(..size).and_then(|room| room.split_at_mut_checked(HEADER)) else {
            let message = format!("the snapshot takes {size} bytes, there is room for {have}");
            return Err(WorldError::new(Fault::BufferLayout, message).value(size as f64));
        };
        self.save_sections(&mut Room { bytes: sections, written: 0 });
        let mut out = Room { bytes: header, written: 0 };
        out.put(&MAGIC);
        SNAPSHOT_FORMAT.save(&mut out);
        sections.len().save(&mut out);
        checksum(sections).save(&mut out);
        Ok(size)
    }

    /// Makes the world what it was when the snapshot was saved, by this or another world of this or another process.
    ///
    /// Ids that were valid then are valid again (with the tag of this world), ids given out since are stale. The same
    /// steps from there on give the same bits. Errors: `SnapshotMismatch` with the place, for bytes that are no
    /// snapshot of this format or hold what no world can; the world is then as it was. Cost: linear, and the next step
    /// certifies its start.
    pub fn load_snapshot(&mut self, bytes: &[u8]) -> Result<(), WorldError> {
        let mut source = Source::new(bytes);
        if source.take(MAGIC.len())? != MAGIC {
            return Err(source.mismatch("these bytes are no snapshot", f64::NAN));
        }
        let format = u32::load(&mut source)?;
        if format != SNAPSHOT_FORMAT {
            let message = format!("the snapshot has format {format}, this library reads {SNAPSHOT_FORMAT}");
            return Err(source.mismatch(&message, f64::from(format)));
        }
        let (length, sum) = (usize::load(&mut source)?, u64::load(&mut source)?);
        if length != source.remaining() {
            let message = format!("the snapshot says {length} bytes, {} follow", source.remaining());
            return Err(source.mismatch(&message, length as f64));
        }
        if checksum(&bytes[HEADER..]) != sum {
            return Err(source.mismatch("the checksum does not agree: the bytes were damaged", f64::NAN));
        }
        let loaded = self.load_sections(&mut source)?;
        loaded.check_loaded()?;
        *self = loaded;
        Ok(())
    }

    fn save_sections(&self, out: &mut dyn Sink) {
        save_slots(&self.bodies, out);
        save_slots(&self.materials, out);
        self.overrides.save(out);
        save_slots(&self.systems, out);
        self.memory.save(out);
        self.result.contacts.save(out);
        self.gravity.save(out);
        self.wind.save(out);
    }

    /// The world of the sections, unchecked.
    fn load_sections(&self, source: &mut Source) -> Result<World, WorldError> {
        let bodies: Slots<Body> = load_slots(&self.bodies, source)?;
        let materials: Slots<Material> = load_slots(&self.materials, source)?;
        let overrides: Vec<(u64, u64, f64)> = Archive::load(source)?;
        let systems: Slots<HostSystem> = load_slots(&self.systems, source)?;
        let memory = Memory::load(source)?;
        let (contacts, gravity, wind) = Archive::load(source)?;
        if source.remaining() > 0 {
            return Err(source.mismatch("bytes follow the last section", source.remaining() as f64));
        }
        Ok(World {
            bodies,
            materials,
            systems,
            overrides,
            model: Model::default(),
            model_current: false,
            state: State::default(),
            drives: Default::default(),
            gravity,
            wind,
            result: StepResult { contacts, ..StepResult::default() },
            memory,
            scratch: Scratch::default(),
            filter_scratch: Default::default(),
            witnesses: Vec::new(),
        })
    }

    /// What the functions that made the bodies, materials and systems would have refused. Errors: `SnapshotMismatch`.
    fn check_loaded(&self) -> Result<(), WorldError> {
        let mismatch = |error: WorldError| WorldError { fault: Fault::SnapshotMismatch, ..error };
        for (id, material) in self.materials.iter() {
            let friction = material.friction_coefficient;
            if !(friction.is_finite() && friction >= 0.0) {
                return Err(damaged("a friction coefficient is out of range").object(id).value(friction));
            }
        }
        let known = |key: u64| key == 0 || self.materials.get(self.materials.id_of_key(key)).is_ok();
        for (i, (a, b, friction)) in self.overrides.iter().enumerate() {
            let sorted = i == 0 || (self.overrides[i - 1].0, self.overrides[i - 1].1) < (*a, *b);
            if !(sorted && a <= b && known(*a) && known(*b) && friction.is_finite() && *friction >= 0.0) {
                return Err(damaged("a pair of materials is out of order or range").index(i).value(*friction));
            }
        }
        for (id, body) in self.bodies.iter() {
            if !known(body.material) || body.description.key != key(id) {
                return Err(damaged("a body has an unknown material, or another key than its slot").object(id));
            }
            body.check_loaded().map_err(|error| mismatch(error).object(id))?;
        }
        for (id, system) in self.systems.iter() {
            self.check_system(id, system).map_err(|error| mismatch(error).object(id))?;
        }
        if !(is_finite(self.gravity) && is_finite(self.wind)) {
            return Err(damaged("gravity or wind is not finite"));
        }
        self.check_memory()
    }

    fn check_system(&self, own: u64, system: &HostSystem) -> Result<(), WorldError> {
        let mut rows = 0;
        for (index, body) in system.bodies.iter().enumerate() {
            let twice = self.in_system(*body, Some(own)) || system.bodies[..index].contains(body);
            let body = self.bodies.get(self.bodies.id_of_key(*body))?;
            let own = matches!(body.description.dynamics.as_deref(), Some(Dynamics::Deformable { .. }));
            if twice || own || body.blocks() == 0 {
                return Err(damaged("a system names a body that has no rows in it, or one that is named twice"));
            }
            rows += body.blocks();
        }
        if rows == 0 {
            return Err(damaged("a system names no body"));
        }
        check_pattern(rows, &system.row_offsets, &system.columns, system.upper)?;
        if system.values.is_empty() {
            return Ok(());
        }
        let finite = system.values.iter().flatten().all(|row| is_finite(*row));
        if system.values.len() != system.columns.len() || !finite {
            return Err(damaged("the values of a system do not fit its pattern, or are not finite"));
        }
        symmetrise(system, &mut system.values.clone(), SymmetrySlack::Double)
    }

    fn check_memory(&self) -> Result<(), WorldError> {
        let memory = &self.memory;
        let sorted = memory.contacts.windows(2).all(|pair| pair[0].key < pair[1].key);
        let tangent_finite = |c: &RememberedContact| c.tangent.is_none_or(is_finite);
        let finite = memory.contacts.iter().all(|c| is_finite(c.impulse) && tangent_finite(c));
        if !(sorted && finite && memory.dt.is_finite() && memory.dt >= 0.0) {
            return Err(damaged("the remembered contacts are out of order, or not finite").value(memory.dt));
        }
        for (index, (body, velocities)) in memory.velocities.iter().chain(&memory.carried.accelerations).enumerate() {
            // A body may have been removed since the step; one that is there has all its blocks.
            let fits = self.bodies.get(self.bodies.id_of_key(*body)).map_or(true, |b| b.blocks() == velocities.len());
            if !fits || !velocities.iter().all(|v| is_finite(*v)) {
                return Err(damaged("remembered velocities or accelerations do not fit their body, or are not finite")
                    .index(index));
            }
        }
        Ok(())
    }

    /// A 64-bit hash over everything that the host has pushed, the last step has left and the next ones depend on; equal
    /// bits, equal hash. Ids enter without the world's tag and free slots not at all, so that two worlds with the same
    /// history have the same hash. Cost: linear.
    pub fn state_hash(&self) -> u64 {
        let mut hash = Hash::new();
        hash_values(&self.bodies, &mut hash);
        hash_values(&self.materials, &mut hash);
        self.overrides.save(&mut hash);
        hash_values(&self.systems, &mut hash);
        self.memory.save(&mut hash);
        self.result.contacts.save(&mut hash);
        self.gravity.save(&mut hash);
        self.wind.save(&mut hash);
        hash.value()
    }
}

fn hash_values<T: Archive>(slots: &Slots<T>, hash: &mut Hash) {
    for (id, value) in slots.iter() {
        key(id).save(hash);
        value.save(hash);
    }
}

fn save_slots<T: Archive>(slots: &Slots<T>, out: &mut dyn Sink) {
    slots.table().save(out);
    slots.iter().for_each(|(_, value)| value.save(out));
}

/// The slots of a snapshot with the tag of `now`.
fn load_slots<T: Archive>(now: &Slots<T>, source: &mut Source) -> Result<Slots<T>, WorldError> {
    let (slots, free): (Vec<(u16, bool)>, Vec<u32>) = Archive::load(source)?;
    let mut values = Vec::new();
    for _ in slots.iter().filter(|(_, used)| *used) {
        values.push(T::load(source)?);
    }
    now.restored(&slots, &free, values).map_err(|message| source.mismatch(message, f64::NAN))
}

fn checksum(bytes: &[u8]) -> u64 {
    let mut hash = Hash::new();
    hash.put(bytes);
    hash.value()
}

fn damaged(message: &str) -> WorldError {
    WorldError::new(Fault::SnapshotMismatch, message)
}

impl Body {
    /// Dynamics and embedding that fit the body.
    fn check_dynamics(&self) -> Result<(), WorldError> {
        let d = &self.description;
        if let Some(embedding) = &d.embedding {
            let inside = |nodes: &[u32; 4]| nodes.iter().all(|node| (*node as usize) < self.blocks());
            let finite = embedding.weights.as_flattened().iter().all(|w| w.is_finite());
            let fits = embedding.nodes.len() == embedding.weights.len() && embedding.nodes.iter().all(inside);
            if !(fits && finite && matches!(d.kind, Kind::Deformable { .. })) {
                return Err(damaged("embedded points do not fit their body"));
            }
        }
        let rate = |r: f64| r >= 0.0 && r.is_finite();
        let fits = match (d.dynamics.as_deref(), &d.kind) {
            (None, _) => true,
            (Some(Dynamics::Deformable { pattern, .. }), Kind::Deformable { .. }) => {
                pattern.matrix.rows() == self.blocks()
            }
            (Some(Dynamics::Rigid { linear_damping, angular_damping }), Kind::Rigid { .. }) => {
                rate(*linear_damping) && rate(*angular_damping)
            }
            _ => false,
        };
        if fits { Ok(()) } else { Err(damaged("dynamics do not fit their body")) }
    }

    /// What the function that made the body, and those that pushed to it, would have refused.
    fn check_loaded(&self) -> Result<(), WorldError> {
        let d = &self.description;
        let (count, blocks) = (d.surface.rest.len(), self.blocks());
        let s = &d.surface;
        let in_order =
            Surface::new(s.rest.clone(), s.faces.clone(), &s.edges, &s.vertices).is_ok_and(|again| again == **s);
        if !in_order || (count == 0) != matches!(d.kind, Kind::HalfSpace(_)) {
            return Err(damaged("the collision surface of a body is out of order"));
        }
        if d.half_thickness.is_some_and(|h| !(h.is_finite() && h >= 0.0)) {
            return Err(damaged("a half thickness is out of range"));
        }
        self.check_dynamics()?;
        match &d.kind {
            Kind::Deformable { masses, pinned } => {
                let nodes = count.saturating_sub(self.first_node());
                if masses.len() != nodes || pinned.len() != nodes {
                    return Err(damaged("masses or pin flags do not fit the nodes of a body"));
                }
                check_masses(masses)?;
            }
            Kind::Rigid { mass, inertia } => {
                check_masses(&[*mass])?;
                symmetric(*inertia)?;
            }
            Kind::Kinematic { .. } => {}
            Kind::HalfSpace(plane) => {
                checked_half_space(*plane)?;
            }
        }
        let mut lists = vec![(&self.positions, count), (&self.velocities, blocks)];
        lists.extend(self.target_positions.as_ref().map(|targets| (targets, count.saturating_sub(self.first_node()))));
        lists.push((&self.attachments, d.dynamics.as_ref().map_or(0, |dynamics| dynamics.attachments())));
        lists.extend(self.attachment_targets.as_ref().map(|targets| (targets, self.attachments.len())));
        lists.extend(self.certified.as_ref().map(|certified| (&certified.positions, count)));
        for results in [&self.result_velocities, &self.result_end_velocities, &self.result_impulses] {
            lists.push((results, if results.is_empty() { 0 } else { blocks }));
        }
        if lists.iter().any(|(list, length)| list.len() != *length || !list.iter().all(|x| is_finite(*x))) {
            return Err(damaged("positions or velocities do not fit their body, or are not finite"));
        }
        let certified = self.certified.as_ref();
        let poses = [Some(self.pose), self.target_pose, certified.map(|c| c.pose)];
        let unit = |squares: f64, slack: f64| (squares - 1.0).abs() < slack;
        for pose in poses.into_iter().flatten() {
            let length_squared = pose.orientation.iter().map(|c| c * c).sum();
            if !is_finite(pose.position) || !unit(length_squared, POSE_SLACK) {
                return Err(damaged("a pose is not finite, or its quaternion not of unit length").value(length_squared));
            }
        }
        let planes = [Some(self.half_space), self.target_half_space, certified.map(|c| c.half_space)];
        for plane in planes.into_iter().flatten() {
            let length_squared = norm_squared(plane.normal);
            if !plane.offset.is_finite() || !unit(length_squared, NORMAL_SLACK) {
                return Err(
                    damaged("a half-space is not finite, or its normal not a unit vector").value(length_squared)
                );
            }
        }
        Ok(())
    }
}
