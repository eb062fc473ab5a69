//! What follows, in this order, when a method's own iterations leave a collision: divide the step, rigid zones, hold,
//! and the last certified share of a pinched step. Every loop is bounded by a counter.
//!
//! * `subdivide`: parts of a step
//! * `nodes`: what moves as one
//! * `sweep`: continuous detection of an end
//! * `rigid_zone`, `hold`, `pinch`: the fail-safes themselves

mod hold;
mod nodes;
mod pinch;
mod rigid_zone;
mod subdivide;
mod sweep;

pub use hold::{HoldOutcome, hold};
pub use nodes::Nodes;
pub use pinch::certified_share;
pub use rigid_zone::{ZoneOutcome, rigid_zones};
pub use subdivide::{Part, parts_of_step};
pub use sweep::Sweep;
