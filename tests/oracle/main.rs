//! The library against independent answers: exact arithmetic, closed forms, brute force, other algorithms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod broad_phase;
mod ccd_batch;
mod ccd_data;
mod ccd_distance;
mod ccd_inclusion;
mod ccd_separation;
mod distance;
mod intersection;
#[allow(dead_code, unused_imports)]
#[path = "../../benches/support/mod.rs"]
mod problem_files;
mod projections;
mod proximity;
mod scenes;
mod screening;
mod solver;
mod solver_problems;
mod solver_traps;

use problem_files::random;
