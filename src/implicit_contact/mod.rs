//! Implicit contact: constraint manifold refinement around iterative constraint anticipation [Otaduy09, §3-5].
//!
//! * `problem`: the contact problem that every solver takes, what it reports, and the choice of the solver
//! * `accelerated_relaxation`: the default solver
//! * `block_diagonal`: the solver for lumped masses and rigid bodies alone
//! * `packed_contacts`: contacts laid out for relaxation passes
//! * `friction`: the local solve of one contact
//! * `residuals`: natural map, dynamics residual, velocity error
//! * `advance`: the step as a list of stages

mod accelerated_relaxation;
mod advance;
mod block_diagonal;
mod friction;
mod packed_contacts;
mod problem;
mod residuals;

pub use advance::{Memory, Scratch, advance};
pub use problem::{ContactProblem, SolverReport, SolverScratch, solve};
