//! Poses of rigid bodies and the map from degrees of freedom to collision vertices.
//!
//! * `pose`: position and orientation, exponential-map update
//! * `rigid_motion`: vertices placed by a pose, interpolated poses, chord levers, rigid fits

mod pose;
mod rigid_motion;

pub use pose::Pose;
pub use rigid_motion::{
    MassElement, RigidMotion, chord_lever, displacement_fit, momentum_fit, place_vertices, rounded_to_single, turn,
    world_inertia,
};
