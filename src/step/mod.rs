//! The stages of a step that every method shares: what is left to a method is the response of one part to its contacts.
//!
//! * `inputs`: sizes fit, everything is finite
//! * `driven`: what drives a segment, and its metric
//! * `carried`: what every method carries from step to step, and the check of the start state
//! * `part`: a part of a step as a method leaves it
//! * `parts`: the parts of a step, one after the other, each clean before the next
//! * `fall_back`: the fail-safes of a part in their order
//! * `account`: what the parts add up to
//! * `commit`: state, memory and result, all at once

mod account;
mod carried;
mod commit;
mod driven;
mod fall_back;
mod inputs;
mod part;
mod parts;

pub use account::{StepAccount, lap};
pub use carried::{Carried, Certified, start_state};
pub use commit::{answer, commit};
pub use driven::Driven;
pub use fall_back::momentum_lost;
pub use inputs::check_inputs;
pub use part::{PartEnd, Solved, SolvedContact};
pub use parts::{PartMethod, Surroundings, run_parts};
