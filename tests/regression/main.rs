//! Recorded contact problems: solved, checked by conditions written down here, and compared with tight solves.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
#[path = "../../benches/support/mod.rs"]
mod support;

mod recorded_problems;
