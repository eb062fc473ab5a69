//! Triangle meshes, shapes and their validation.
//!
//! * `surface`: a collision surface built from a host's arrays and checked
//! * `adjacency`: what shares a vertex, which edges are open
//! * `mass_properties`: mass, centre of mass and inertia of a closed mesh
//! * `hinge`: pairs of triangles that share an edge
//! * `tet_mesh`: tetrahedra, their surface and masses
//! * `embedding`: points carried along by tetrahedra
//! * `shape`: spheres, boxes, capsules and others as meshes, to a stated tolerance

mod adjacency;
mod embedding;
mod hinge;
mod mass_properties;
mod shape;
mod surface;
mod tet_mesh;

pub use adjacency::{Incidence, open_half_edges, share_vertex};
pub use embedding::Embedding;
pub use hinge::hinges;
pub use mass_properties::MassProperties;
pub use shape::Shape;
pub use surface::{MeshError, Surface};
pub use tet_mesh::TetMesh;
