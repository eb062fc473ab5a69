//! Triangle meshes, shapes and their validation.
//!
//! * `surface`: a collision surface built from a host's arrays and checked
//! * `adjacency`: what shares a vertex, which edges are open
//! * `mass_properties`: mass, centre of mass and inertia of a closed mesh
//! * `shape`: spheres, boxes, capsules and others as meshes, to a stated tolerance

mod adjacency;
mod mass_properties;
mod shape;
mod surface;

pub use adjacency::{Incidence, open_half_edges, share_vertex};
pub use mass_properties::MassProperties;
pub use shape::Shape;
pub use surface::{MeshError, Surface};
