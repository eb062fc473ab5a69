//! The library against independent answers: exact arithmetic, closed forms, brute force, other algorithms.

mod broad_phase;
mod ccd_batch;
mod ccd_data;
mod ccd_distance;
mod ccd_inclusion;
mod ccd_separation;
mod distance;
mod intersection;
mod proximity;
mod random;
mod scenes;
