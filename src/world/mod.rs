//! Worlds: bodies by id, what the host drives them with, the step, queries.
//!
//! * `ids`: value ids with generations
//! * `error`: how a call can fail
//! * `surface`: collision surfaces from lists of triangles, edges and points
//! * `body`: bodies and their descriptions
//! * `material`: materials and pair overrides
//! * `model_body`, `model_archive`: bodies that the library drives, and bodies of tetrahedra; their snapshots
//! * `system`: host matrices
//! * `drive`: what is pushed before a step
//! * `step`: the step
//! * `query`: what is pulled after it; check
//! * `motion_filter`: the velocity filter alone, over positions before and after
//! * `archive`: values as bytes
//! * `snapshot`: the whole world as bytes, and its hash

mod archive;
mod body;
mod drive;
mod error;
mod ids;
mod material;
mod model_archive;
mod model_body;
mod motion_filter;
mod query;
mod snapshot;
mod step;
mod surface;
mod system;

pub use body::{BodyOptions, DeformableDescription, KinematicDescription, RigidDescription};
pub use error::{Fault, WorldError};
pub use model_body::{NodeForces, SheetDescription, SheetModel, SolidDescription};
pub use motion_filter::{FilterWitness, Motion, MotionFilter, MotionFilterDescription};
pub use query::{BodyInfo, BodyKind, Outcome};
pub use snapshot::SNAPSHOT_FORMAT;
pub use step::StepFailure;
pub use surface::Topology;
pub use system::SymmetrySlack;

use crate::implicit_contact::{Memory, Scratch};
use crate::math::Vec3;
use crate::model::{Drives, Material, Model, State, StepResult, Witness};
use crate::velocity_filter;
use ids::{IdKind, Slots};

/// Bodies, materials, systems and filters of a host, and what the method remembers.
pub struct World {
    bodies: Slots<body::Body>,
    materials: Slots<Material>,
    systems: Slots<system::HostSystem>,
    /// `(material, material, friction coefficient)` by id, smaller first, sorted.
    overrides: Vec<(u64, u64, f64)>,
    model: Model,
    model_current: bool,
    gravity: Vec3,
    wind: Vec3,
    state: State,
    drives: Drives,
    result: StepResult,
    memory: Memory,
    scratch: Scratch,
    filter_scratch: velocity_filter::Scratch,
    witnesses: Vec<Witness>,
}

impl Default for World {
    fn default() -> Self {
        World::new()
    }
}

impl World {
    /// An empty world.
    pub fn new() -> World {
        let tag = ids::new_world_tag();
        World {
            bodies: Slots::new(tag, IdKind::Body),
            materials: Slots::new(tag, IdKind::Material),
            systems: Slots::new(tag, IdKind::System),
            overrides: Vec::new(),
            model: Model::default(),
            model_current: false,
            gravity: [0.0; 3],
            wind: [0.0; 3],
            state: State::default(),
            drives: Drives::default(),
            result: StepResult::default(),
            memory: Memory::default(),
            scratch: Scratch::default(),
            filter_scratch: velocity_filter::Scratch::default(),
            witnesses: Vec::new(),
        }
    }
}
