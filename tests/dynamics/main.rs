//! Bodies that the library drives, against closed forms and other integrators; and together with what hosts drive.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod closed_forms;
mod contact;
mod free_flight;
mod local_response;
#[allow(dead_code)]
#[path = "../../benches/support/random.rs"]
mod random;
mod scenes;
mod unconstrained;
