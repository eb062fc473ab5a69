//! Linear algebra on blocks of three.
//!
//! * `block_matrix`: symmetric 3x3 block-sparse matrices by rows
//! * `single_precision`: the same in f32, for increments
//! * `gauss_seidel`: block relaxation
//! * `conjugate_gradient`: preconditioned conjugate gradients
//! * `sweep_gradient`: the same in single precision, with a symmetric sweep as preconditioner
//! * `mixed_gradient`: the same renewed in double precision
//! * `incomplete_cholesky`: a preconditioner
//! * `envelope_cholesky`: a direct factor, for small or narrow matrices
//! * `colouring`: groups of items that share no block

mod block_matrix;
mod colouring;
mod conjugate_gradient;
mod envelope_cholesky;
mod gauss_seidel;
mod incomplete_cholesky;
mod mixed_gradient;
mod single_precision;
mod sweep_gradient;

pub use block_matrix::BlockMatrix;
pub use colouring::Colouring;
pub use conjugate_gradient::{GradientBuffers, GradientEnding, conjugate_gradient};
pub use envelope_cholesky::{Envelope, EnvelopeCholesky};
pub use gauss_seidel::gauss_seidel_sweep;
pub use incomplete_cholesky::IncompleteCholesky;
pub use mixed_gradient::MixedGradient;
pub use single_precision::{Rounded, SinglePrecision, power_of_two};
pub use sweep_gradient::SweepGradient;
