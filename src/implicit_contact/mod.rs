//! Implicit contact: constraint manifold refinement around iterative constraint anticipation [Otaduy09, §3-5].
//!
//! * `problem`: the contact problem that every solver takes, and what it reports
//! * `advance`: the step as a list of stages

mod advance;
mod problem;

pub use advance::{Memory, Scratch, advance};
pub use problem::{ContactProblem, SolverReport, SolverScratch, solve};
