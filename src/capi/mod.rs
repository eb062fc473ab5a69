//! The C ABI: what `include/signorini.h` declares.
//!
//! * `status`: result codes, and failures on their way to one
//! * `boundary`: panics, null, busy and poisoned worlds, the last error
//! * `float_environment`: the floating-point environment, set and given back
//! * `structs`: structs that grow, by their size
//! * `views`: strided host memory, read and written element by element
//! * `version`, `api`: version, capabilities, the table for hosts that load the library themselves
//! * `context`, `world`, `material`, `description`, `body`, `model`, `shape`, `drive`, `system`, `step`, `query`,
//!   `snapshot`, `filter`: the functions, by noun
//!
//! Every export returns a status, runs behind a panic boundary and writes its outputs only when it succeeds. The
//! header is generated from these files by `tests/capi`, comments included.

// The rules that make the exports safe to call stand once, at the top of the header and in docs/capi.md.
#![allow(clippy::missing_safety_doc)]

mod api;
mod body;
mod boundary;
mod context;
mod description;
mod drive;
mod filter;
mod float_environment;
mod material;
mod model;
mod query;
mod shape;
mod snapshot;
mod status;
mod step;
mod structs;
mod system;
mod version;
mod views;
mod world;

pub use api::*;
pub use body::*;
pub use context::*;
pub use description::*;
pub use drive::*;
pub use filter::*;
pub use material::*;
pub use model::*;
pub use query::*;
pub use shape::*;
pub use snapshot::*;
pub use status::*;
pub use step::*;
pub use system::*;
pub use version::*;
pub use views::*;
pub use world::*;
