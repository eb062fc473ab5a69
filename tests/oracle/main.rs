//! Kernels against independent oracles.

mod ccd_distance;
mod ccd_separation;
