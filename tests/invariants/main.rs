//! What must hold in every step: balances of momentum and energy, friction limits, no intersection, fail-safes in order,
//! the same bits on any number of threads, errors that change nothing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
#[path = "../../benches/support/mod.rs"]
mod support;

mod world;

mod coupling;
mod division;
mod energy;
mod fail_safes;
mod filter;
mod filter_examples;
mod friction;
mod inputs;
mod momentum;
mod motion_filter;
mod pinch;
mod resting;
mod rows;
mod search;
mod spinning;
mod tangled;
mod thickness;
mod threads;
mod tunnelling;
