//! What follows, in this order, when a method's own iterations leave a collision: divide the step, project zones, rigid
//! zones, hold, and the last certified share of a pinched step. Every loop is bounded by a counter. One implementation for
//! every method.
//!
//! * `subdivide`: parts of a step
//! * `nodes`: what moves as one
//! * `sweep`: continuous detection of an end
//! * `zones`: collisions that share degrees of freedom, grown and answered together
//! * `zone_projection`: the velocities of a zone projected, with friction
//! * `zone_rows`: gradients of a zone's collisions
//! * `active_set`: the unilateral projection of few unknowns
//! * `zone_factor`: a direct solver in a zone's unknowns
//! * `minimum_norm`: the inelastic projection, equations that may repeat and contradict each other
//! * `unilateral_projection`: the projection whose impulses only push
//! * `zone_friction`: friction per contact and per zone
//! * `rigid_zone`, `hold`, `pinch`: what comes after projections

mod active_set;
mod hold;
mod minimum_norm;
mod nodes;
mod pinch;
mod rigid_zone;
mod subdivide;
mod sweep;
mod unilateral_projection;
mod zone_factor;
mod zone_friction;
mod zone_projection;
mod zone_rows;
mod zones;

pub use hold::{HoldOutcome, hold};
pub use nodes::Nodes;
pub use pinch::certified_share;
pub use subdivide::{Part, parts_of_step};
pub use sweep::Sweep;
pub use zone_projection::{Projection, ZoneResponse, project_zone};
pub use zones::{ZoneOutcome, ZoneReport, resolve_zones};
