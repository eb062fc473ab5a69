//! Several numbers at once, with the same answers and the same bits on every processor.
//!
//! * `compare`: four boxes against one, one bit a lane
//! * `lanes`: a few doubles side by side, and kernels compiled once more for wide instructions

mod compare;
mod lanes;
pub use compare::{equals, overlaps};
pub use lanes::{Kernel, Lanes, run_wide};
