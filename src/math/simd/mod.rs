//! Several numbers at once, with the same answers and the same bits on every processor.
//!
//! * `eight`: eight boxes against one, one bit a lane, and pairs from such bits
//! * `quad`: three-vectors in f32
//! * `lanes`: a few numbers side by side, and kernels compiled once more for wide instructions
//! * `points`: three-vectors of such numbers

mod eight;
mod lanes;
pub mod points;
mod quad;
pub use eight::{Eight, EightKernel, run_eight};
pub use lanes::{Kernel, Lanes, Number, run_wide};
pub use quad::{Quad, Width, packed_row};
