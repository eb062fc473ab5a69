//! The velocity filter: repulsions, impulses, zones, over the velocities that a step would have without contact
//! [Harmon10, ch. 3; Bridson02].
//!
//! * `advance`: the step as a list of stages
//! * `motion`: velocities with the impulses that made them
//! * `stage_rows`: the rows of a stage while it gives them impulses
//! * `row_response`: the response of one row: normal impulse, friction
//! * `repulsion`: weak springs between what is closer than its thickness
//! * `coupled_springs`: the same where a matrix couples velocities
//! * `two_pass`: the baseline of [Harmon10, §3.8] that answers scripts first
//! * `impulse`: passes of impulses and continuous detection
//!
//! What is left of collisions after that is a matter for the fail-safes, which all methods share.

mod advance;
mod coupled_springs;
mod impulse;
mod motion;
mod repulsion;
mod row_response;
mod stage_rows;
mod two_pass;

pub use crate::step::{Carried as Memory, Scratch};
pub use advance::advance;
