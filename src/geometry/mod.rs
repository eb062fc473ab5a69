//! Closest points and bounding volumes.
//!
//! * `point_edge`, `point_triangle`, `edge_edge`: closest points and squared distances of primitive pairs
//! * `wide_closest_points`: the same of several pairs side by side
//! * `aabb`: axis-aligned boxes, rounded outward where a thickness is added
//!
//! # Accuracy
//! Let `L` be the largest absolute coordinate difference between the points of a query. Distances and separation
//! vectors are within `16 eps L` of the exact ones, `eps = 2^-52`, however degenerate the primitives are, however far
//! they stand from the origin, and for `L` from `1e-150` to `1e150`. Weights are non-negative and sum to one within
//! `2 eps`; where the closest points are not unique, they name one of the pairs. A squared distance below `1e-308`
//! is rounded to a multiple of `5e-324`.

mod aabb;
pub mod edge_edge;
pub mod point_edge;
pub mod point_triangle;
mod scaling;
pub mod wide_closest_points;

pub use aabb::Aabb;
