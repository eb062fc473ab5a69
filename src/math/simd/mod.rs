//! Several numbers at once, with the same answers and the same bits on every processor.
//!
//! * `eight`: eight boxes against one, one bit a lane, and pairs from such bits
//! * `lanes`: a few doubles side by side, and kernels compiled once more for wide instructions

mod eight;
mod lanes;
pub use eight::{Eight, EightKernel, run_eight};
pub use lanes::{Kernel, Lanes, run_wide};
