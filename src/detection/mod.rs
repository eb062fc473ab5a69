//! Collision detection: pure geometry on arrays.
//!
//! * `primitives`: the collision primitives of a whole model, their motion, and the pairs found among them
//! * `brute_force`: every pair tested; the oracle of the other structures
//! * `ownership`, `bvh`, `leaf_blocks`, `leaf_pairs`, `pair_lists`, `broad_phase`: the same candidates by a tree of boxes
//! * `proximity`: near pairs at a state, with weights, normals and distances
//! * `screening`, `directions`: candidates that a separating direction rules out, several at once
//! * `intersection`, `stars`: the certificate, edges against faces by exact predicates
//! * `ccd`: continuous detection of one pair

mod broad_phase;
pub mod brute_force;
mod bvh;
pub mod ccd;
mod directions;
pub mod intersection;
mod leaf_blocks;
mod leaf_pairs;
mod ownership;
mod pair_lists;
mod primitives;
pub mod proximity;
pub mod screening;
mod stars;

pub use broad_phase::{BroadPhase, Screen};
pub use primitives::{Candidates, Filter, Motion, Primitives};
pub use stars::Stars;
