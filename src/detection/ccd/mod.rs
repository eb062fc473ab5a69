//! Continuous collision detection of one pair moving on straight lines.
//!
//! * `point_triangle`, `edge_edge`: the two kernels
//! * `batch`: whole candidate lists, several pairs at once
//! * `separation`: minimum separation, by certified separating directions
//! * `filter`: zero separation, floating-point filters with proven bounds in front of the exact decision
//! * `coplanarity`: the cubic of the four points and the tests that rule contact out, several pairs at once
//! * `roots`: a root of that cubic and contact at it, several pairs at once
//! * `exact`: the decision in integers that the filters leave open
//! * `motion`: a pair in relative coordinates and its separating directions

mod batch;
mod coplanarity;
pub mod edge_edge;
mod exact;
pub mod filter;
mod motion;
pub mod point_triangle;
mod roots;
pub mod separation;

pub(super) use exact::Shape;
pub(super) use motion::DIRECTION_ERROR;

pub use batch::{Hit, Pair, Separation, earliest_time_of_impact, hits};
