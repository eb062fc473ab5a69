//! Linear algebra on blocks of three.
//!
//! * `block_matrix`: symmetric 3x3 block-sparse matrices by rows

mod block_matrix;
pub use block_matrix::BlockMatrix;
