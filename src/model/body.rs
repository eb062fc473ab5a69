//! What a body is, who drives it, what it collides with.

use super::{BuildError, Dynamics, HalfSpace, Materials, SystemDescription};
use crate::math::{Mat3, Vec3};
use crate::mesh::{Embedding, Surface};
use std::sync::Arc;

/// What moves a body.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Every node is a block: every vertex, or every node of the tetrahedra that carry the vertices.
    Deformable {
        /// Lumped mass per node `[kg]`, positive.
        masses: Vec<f64>,
        /// Nodes of infinite mass: they follow their displacement velocity, or the script of a MODEL body, exactly.
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
    /// The first vertices of the surface as points carried by nodes, which are the vertices after them; `None`: every
    /// vertex is a node. Deformable bodies only.
    pub embedding: Option<Arc<Embedding>>,
    /// What moves it if the library does (MODEL); `None`: the host drives it.
    pub dynamics: Option<Arc<Dynamics>>,
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
    /// Its springs to targets in [`super::Drives::attachments`].
    pub attachments: BlockRange,
}

impl Body {
    /// Vertices that stand for the nodes of a deformable body, in the order of its blocks.
    pub fn nodes(&self) -> BlockRange {
        self.vertices.end - self.blocks.len()..self.vertices.end
    }

    /// Blocks that carry a vertex of a deformable body, and their weights; those without weight are left out.
    pub fn carriers(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let nodes = self.nodes();
        let (mut blocks, mut weights) = ([0; 4], [0.0; 4]);
        match &self.description.embedding {
            Some(embedding) if vertex < nodes.start => {
                let point = vertex - self.vertices.start;
                blocks = embedding.nodes[point].map(|node| self.blocks.start + node as usize);
                weights = embedding.weights[point];
            }
            _ => (blocks[0], weights[0]) = (self.blocks.start + vertex - nodes.start, 1.0),
        }
        blocks.into_iter().zip(weights).filter(|(_, w)| *w != 0.0)
    }
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
    /// Patterns of host systems, then those of the deformable bodies that the library drives.
    pub systems: Vec<SystemDescription>,
    /// How many of the systems are the host's.
    pub host_systems: usize,
    /// Number of springs to targets.
    pub attachment_count: usize,
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
        let mut model = Model { materials, host_systems: systems.len(), systems, ..Model::default() };
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
                Kind::Deformable { masses, .. } => masses.len(),
                Kind::Rigid { .. } => 2,
                Kind::Kinematic { .. } | Kind::HalfSpace(_) => 0,
            };
            if let Some(Dynamics::Deformable { pattern, .. }) = description.dynamics.as_deref() {
                model.systems.push(SystemDescription {
                    bodies: vec![description.key],
                    row_offsets: pattern.matrix.row_offsets.clone(),
                    columns: pattern.matrix.columns.clone(),
                    upper: false,
                });
            }
            let attachments = description.dynamics.as_ref().map_or(0, |d| d.attachments());
            let half_thickness = description.half_thickness.unwrap_or_else(|| default_half_thickness(&surface));
            model.bodies.push(Body {
                description,
                half_thickness,
                vertices: first..model.rest.len(),
                blocks: model.block_count..model.block_count + blocks,
                edges: first_edge..model.edges.len(),
                faces: first_face..model.faces.len(),
                attachments: model.attachment_count..model.attachment_count + attachments,
            });
            model.block_count += blocks;
            model.attachment_count += attachments;
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
