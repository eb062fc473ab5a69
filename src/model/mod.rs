//! The constant model, the state that a step changes, settings and reports.
//!
//! * `body`: what a body is, who drives it, what it collides with
//! * `dynamics`: what moves a body that the library drives itself
//! * `material`: friction with its combine rule
//! * `system`: block pattern of a host matrix over one or more bodies
//! * `state`: positions and poses; what the host drives
//! * `motion`: from velocities to end states
//! * `settings`: tolerances and work caps
//! * `validate`: checks of descriptions
//! * `report`: what a step did, and how it can fail
//! * `watch`: what a host is told while a step is made

mod body;
mod dynamics;
mod material;
mod motion;
mod report;
mod settings;
mod state;
mod system;
mod validate;
mod watch;

pub use crate::mesh::Surface;
pub use body::{BlockRange, Body, BodyDescription, Kind, Model, Precision, default_half_thickness};
pub use dynamics::Dynamics;
pub use material::{CombineRule, Material, Materials};
pub use motion::Segment;
pub use report::{BuildError, ContactRecord, StageTimes, StepError, StepReport, Witness};
pub use settings::{
    Ablation, FailSafe, FilterSettings, FrictionCone, Method, Settings, SolverChoice, StartPolicy, ZoneFriction,
};
pub use state::{ByBody, Drives, HalfSpace, State, StepResult, write_by_body};
pub use system::{System, SystemDescription};
pub use watch::{Phase, Told, Watch};
