//! The stages of a step that every method shares: what is left to a method is the response of one part to its contacts.
//!
//! * `whole`: a step as its list of stages
//! * `inputs`: sizes fit, everything is finite
//! * `driven`: what drives a segment, and its metric
//! * `carried`: what every method carries from step to step, and the check of the start state
//! * `part`: a part of a step as a method finds it, and as it leaves it
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
mod whole;

pub use account::{StepAccount, lap};
pub use carried::{Carried, Certified};
pub use fall_back::momentum_lost;
pub use part::{PartEnd, PartStart, Solved, SolvedContact};
pub use parts::PartMethod;
pub use whole::{Made, Scratch, Step, make_step};
