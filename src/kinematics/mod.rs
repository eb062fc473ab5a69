//! Poses of rigid bodies and the map from degrees of freedom to collision vertices.
//!
//! * `pose`: position and orientation, exponential-map update

mod pose;
pub use pose::Pose;
