//! Implicit contact: constraint manifold refinement around iterative constraint anticipation [Otaduy09, §3-5].
//!
//! * `problem`: the contact problem that every solver takes, what it reports, and the choice of the solver
//! * `accelerated_relaxation`: the default solver
//! * `iterative_anticipation`: the solver of the paper
//! * `splitting_start`: a few iterations of operator splitting before it
//! * `augmented_lagrangian`: the fallback where rows conflict
//! * `newton_system`: the contacts that act in its Newton steps, and their linear systems
//! * `direct_newton`: the same systems factored, where they are small
//! * `full_anticipation`: the dense baseline
//! * `block_diagonal`: the solver for lumped masses and rigid bodies alone
//! * `packed_contacts`: contacts laid out for relaxation passes
//! * `incidence`: the contacts of each block
//! * `single_pass`: the relaxation pass in single precision, over the contacts that are near
//! * `single_relaxation`, `double_relaxation`: iterations of the default solver in either precision
//! * `translation_level`: whole components that give way in them
//! * `friction`: the local solve of one contact
//! * `residuals`: natural map, dynamics residual
//! * `velocity_error`: the estimate that decides when to stop
//! * `constraint_set`: the contacts of a segment, which grow from round to round
//! * `manifold_refinement`: rounds of solving and continuous detection
//! * `memory`: warm starts by key
//! * `stop_test`: when a solver ends
//! * `advance`: the step as a list of stages

mod accelerated_relaxation;
mod advance;
mod augmented_lagrangian;
mod block_diagonal;
mod constraint_set;
mod direct_newton;
mod double_relaxation;
mod friction;
mod full_anticipation;
mod incidence;
mod iterative_anticipation;
mod manifold_refinement;
mod memory;
mod newton_system;
mod packed_contacts;
mod problem;
mod residuals;
mod single_pass;
mod single_relaxation;
mod splitting_start;
mod stop_test;
mod translation_level;
mod velocity_error;

pub use advance::{Scratch, advance};
pub use memory::{Memory, RememberedContact};
pub use problem::{ContactProblem, SolverReport, SolverScratch, solve};
