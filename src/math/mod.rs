//! Small numeric kernels that know nothing of meshes or bodies.
//!
//! * `vector`: three-vectors and 3x3 matrices as plain arrays

mod vector;
pub use vector::*;
