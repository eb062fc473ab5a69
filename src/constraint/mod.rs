//! Contacts as rows over the degrees of freedom, with friction frames and effective masses.
//!
//! * `metric`: the metric A, its inverse diagonal, lumped and infinite masses
//! * `translation`: the rigid translations of what the metric couples
//! * `rows`: the sparse rows C = (J; H) shared by anticipation, zones and projections
//! * `build`: from contacts to rows about a tentative motion

mod build;
mod metric;
mod rows;
mod translation;

pub use build::{BuiltRows, Linearisation, build_rows, friction_frame};
pub use metric::{Metric, Reached, momentum};
pub use rows::{Angular, RowSet};
pub use translation::Translations;
