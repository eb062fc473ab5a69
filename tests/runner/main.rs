//! The runner, as a person uses it: scene files with faults, snapshots and interrupts, what it writes, and the scenes of
//! `examples/scenes` with their bounds.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod command;

mod faults;
mod filter_scenes;
mod masonry;
mod outputs;
mod resume;
mod scenes;
mod subdivision;
