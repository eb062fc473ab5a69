//! Small numeric kernels that know nothing of meshes or bodies.
//!
//! * `simd`: several numbers at once, with the same bits on every processor
//! * `vector`: three-vectors and 3x3 matrices as plain arrays
//! * `singular_values`: eigenvectors, singular values with rotations
//! * `predicates`: exact signs of determinants
//! * `integer`: integers of any length, short ones without the heap
//! * `integer_polynomial`: exact roots and signs, for the rare cases that floating point leaves open

mod integer;
mod integer_polynomial;
pub mod predicates;
#[cfg(test)]
pub(crate) mod random;
pub mod simd;
mod singular_values;
mod vector;
pub use integer::Integer;
pub(crate) use integer_polynomial::decompose;
pub use integer_polynomial::{IntegerPolynomial, Root};
pub use singular_values::{SignedSingularValues, symmetric_eigenvectors};
pub use vector::*;
