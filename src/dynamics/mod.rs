//! Dynamics of the bodies that the library drives itself: one linearised backward Euler step [Otaduy09, §3.1].
//!
//! * `assembly`: `A = M - dt dF/dv - dt^2 dF/dx` and `b` of a deformable body
//! * `rigid_body`: free rigid motion that keeps angular momentum
//! * `backward_euler`: unconstrained velocities `v*` with `A v* = b`, for all bodies of a model

mod assembly;
mod backward_euler;
mod rigid_body;

pub use assembly::{Assembled, Surroundings, assemble};
pub use backward_euler::{Accelerations, FreeSolver, TOLERANCE, Unconstrained};
pub use rigid_body::free_angular_velocity;
