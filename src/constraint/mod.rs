//! Contacts as rows over the degrees of freedom, with friction frames and effective masses.
//!
//! * `rows`: the sparse rows C = (J; H) shared by anticipation, zones and projections

mod rows;
pub use rows::{Angular, RowSet};
