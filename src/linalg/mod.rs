//! Linear algebra on blocks of three.
//!
//! * `block_matrix`: symmetric 3x3 block-sparse matrices by rows
//! * `single_precision`: the same in f32, for increments
//! * `colouring`: groups of items that share no block

mod block_matrix;
mod colouring;
mod single_precision;

pub use block_matrix::BlockMatrix;
pub use colouring::{Colouring, colour};
pub use single_precision::SinglePrecision;
