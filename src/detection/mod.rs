//! Collision detection: pure geometry on arrays.
//!
//! * `primitives`: the collision primitives of a whole model, and the pairs found among them

pub mod ccd;
mod primitives;
pub use primitives::{Candidates, Primitives};
