//! Whole scenes run through the public Rust API by a small host that owns its dynamics.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code)]
#[path = "../../benches/support/mod.rs"]
mod support;
