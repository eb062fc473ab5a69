//! A small simulation host written against the public API only, used by benches, scene tests and examples.
//!
//! * `shapes`: cloth grids, spheres, boxes of tetrahedra
//! * `membrane`, `bending`, `tetrahedra`: elastic energies with their gradients and stiffness
//! * `deformable`: lumped masses, the implicit matrix A and right-hand side b of one linearised step
//! * `conjugate_gradient`: tight solves, independent of the library's own solvers
//! * `boxes`: soft boxes in a container, heaped up
//! * `nearby`: close pairs by a plain grid search, independent of the library's detection
//! * `host`, `scenes`: a world that asks the library for its steps, and the worlds of the measurements
//! * `clock`: processor time
//! * `random`: numbers with a fixed sequence per seed
//! * `record`: the contact problem a host is about to hand over
//! * `problem`: a contact problem as a value: assembled from a state, written to and read from files

pub mod bending;
pub mod boxes;
pub mod clock;
pub mod conjugate_gradient;
pub mod deformable;
pub mod host;
pub mod membrane;
pub mod nearby;
pub mod problem;
pub mod random;
pub mod record;
pub mod scenes;
pub mod shapes;
pub mod tetrahedra;
