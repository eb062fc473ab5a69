//! Forces and Hessians of every energy against finite differences, and what physics asks of them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod checks;
mod configurations;
#[allow(dead_code)]
#[path = "../../benches/support/random.rs"]
mod random;
mod stencils;
