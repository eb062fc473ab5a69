//! Continuous collision detection of one pair moving on straight lines.
//!
//! * `point_triangle`, `edge_edge`: the two kernels
//! * `separation`: minimum separation, by certified separating directions
//! * `motion`: a pair in relative coordinates and its separating directions

pub mod edge_edge;
mod motion;
pub mod point_triangle;
pub mod separation;
