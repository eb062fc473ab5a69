//! What a body is, who drives it, what it collides with.

use super::{BuildError, HalfSpace, Materials, SystemDescription};
use crate::math::{Mat3, Vec3};
use crate::mesh::Surface;
use std::sync::Arc;

/// What moves a body.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Every vertex is a block, driven by the host's displacement velocities.
    Deformable {
        /// Lumped mass per vertex `[kg]`, positive.
        masses: Vec<f64>,
        /// Vertices that follow their displacement velocity exactly (infinite mass).
        pinned: Vec<bool>,
    },
    /// Two blocks, linear and angular, about the centre of mass.
    Rigid {
        /// Mass `[kg]`.
        mass: f64,
        /// Inertia in the body frame `[kg m^2]`.
        inertia: Mat3,
    },
    /// Prescribed motion, infinite mass; `posed` moves rigidly from pose to pose, otherwise vertices move straight.
    Kinematic {
        /// Driven by a pose.
        posed: bool,
    },
    /// An analytic half-space, prescribed motion.
    HalfSpace(HalfSpace),
}

/// Number format in which the host takes the end state; the state is certified after rounding to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Rounded to `f32`.
    Single,
    /// As computed.
    #[default]
    Double,
}

/// Everything that the model needs to know of a body.
#[derive(Clone, Debug)]
pub struct BodyDescription {
    /// Persistent key, unique, not 0.
    pub key: u64,
    /// Collision surface; empty for a half-space.
    pub surface: Arc<Surface>,
    /// What moves it.
    pub kind: Kind,
    /// Half of the pair thickness `[m]`; `None`: a tenth of the mean edge length is used.
    pub half_thickness: Option<f64>,
    /// Index into the materials.
    pub material: u32,
    /// Groups this body belongs to.
    pub groups: u64,
    /// Groups this body collides with; a pair collides when each is in the other's mask.
    pub mask: u64,
    /// Whether the body collides with itself (deformable bodies only).
    pub self_collision: bool,
    /// Number format of the host.
    pub precision: Precision,
}

/// A contiguous range of blocks, vertices, edges or faces.
pub type BlockRange = std::ops::Range<usize>;

/// A body within a model: its description and where its parts stand in the model's arrays.
#[derive(Clone, Debug)]
pub struct Body {
    /// The description, half thickness resolved.
    pub description: BodyDescription,
    /// Half thickness `[m]`.
    pub half_thickness: f64,
    /// Its vertices in [`super::State::positions`].
    pub vertices: BlockRange,
    /// Its degrees of freedom, in blocks of three.
    pub blocks: BlockRange,
    /// Its edges in [`Model::edges`].
    pub edges: BlockRange,
    /// Its faces in [`Model::faces`].
    pub faces: BlockRange,
}

/// Constant between steps: bodies, topology over all bodies, materials, patterns of host systems.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Bodies, in order of their keys.
    pub bodies: Vec<Body>,
    /// All edges, vertex indices of the whole model.
    pub edges: Vec<[u32; 2]>,
    /// All faces, vertex indices of the whole model.
    pub faces: Vec<[u32; 3]>,
    /// Vertices that take part in contact.
    pub contact_vertices: Vec<u32>,
    /// Body of each vertex.
    pub vertex_body: Vec<u32>,
    /// Rest position of each vertex.
    pub rest: Vec<Vec3>,
    /// Number of blocks.
    pub block_count: usize,
    /// Materials.
    pub materials: Materials,
    /// Patterns of host systems.
    pub systems: Vec<SystemDescription>,
    /// Hash of contact vertices, edges and faces: names the topology that caches were built for.
    pub topology_hash: u64,
}

impl Model {
    /// Builds a model; bodies are sorted by key.
    ///
    /// Errors: a description that does not fit, with key, index and value. Cost: linear, plus the sort.
    pub fn build(
        mut bodies: Vec<BodyDescription>,
        materials: Materials,
        systems: Vec<SystemDescription>,
    ) -> Result<Model, BuildError> {
        bodies.sort_by_key(|body| body.key);
        super::validate::check(&bodies, &materials, &systems)?;
        let mut model = Model { materials, systems, ..Model::default() };
        for description in bodies {
            let first = model.rest.len();
            let surface = description.surface.clone();
            let (first_edge, first_face, body_index) =
                (model.edges.len(), model.faces.len(), model.bodies.len() as u32);
            let offset = first as u32;
            model.rest.extend_from_slice(&surface.rest);
            model.edges.extend(surface.edges.iter().map(|e| e.map(|v| v + offset)));
            model.faces.extend(surface.faces.iter().map(|f| f.map(|v| v + offset)));
            model.contact_vertices.extend(surface.vertices.iter().map(|v| v + offset));
            model.vertex_body.resize(model.rest.len(), body_index);
            let blocks = match &description.kind {
                Kind::Deformable { .. } => surface.rest.len(),
                Kind::Rigid { .. } => 2,
                Kind::Kinematic { .. } | Kind::HalfSpace(_) => 0,
            };
            let half_thickness = description.half_thickness.unwrap_or_else(|| default_half_thickness(&surface));
            model.bodies.push(Body {
                description,
                half_thickness,
                vertices: first..model.rest.len(),
                blocks: model.block_count..model.block_count + blocks,
                edges: first_edge..model.edges.len(),
                faces: first_face..model.faces.len(),
            });
            model.block_count += blocks;
        }
        model.topology_hash = topology_hash(&model);
        Ok(model)
    }

    /// Index of the body with this key.
    pub fn body_index(&self, key: u64) -> Option<usize> {
        self.bodies.binary_search_by_key(&key, |body| body.description.key).ok()
    }
}

/// FNV-1a over all indices, lists separated by their lengths.
fn topology_hash(model: &Model) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut mix = |word: u64| hash = (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
    mix(model.contact_vertices.len() as u64);
    model.contact_vertices.iter().for_each(|v| mix(u64::from(*v)));
    mix(model.edges.len() as u64);
    model.edges.iter().flatten().for_each(|v| mix(u64::from(*v)));
    mix(model.faces.len() as u64);
    model.faces.iter().flatten().for_each(|v| mix(u64::from(*v)));
    mix(model.vertex_body.len() as u64);
    hash
}

/// A tenth of the mean edge length; 0 for surfaces without edges.
pub fn default_half_thickness(surface: &Surface) -> f64 {
    if surface.edges.is_empty() {
        return 0.0;
    }
    let length =
        |e: &[u32; 2]| crate::math::norm(crate::math::sub(surface.rest[e[1] as usize], surface.rest[e[0] as usize]));
    0.1 * surface.edges.iter().map(length).sum::<f64>() / surface.edges.len() as f64
}
