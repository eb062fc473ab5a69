//! Whole scenes run through the public Rust API by a small host that owns its dynamics.
//!
//! Every step of every scene is checked: no intersection by exact predicates, no energy from contact, momentum only
//! where impulses say so. Long versions run when `SIGNORINI_ALL=1` is set.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
#[path = "../../benches/support/mod.rs"]
mod support;

mod invariants;

mod cloth;
mod solids;
mod stress;
mod stress_cases;
mod stress_oracle;
mod stress_parts;
mod stress_scenes;
mod stress_world;
