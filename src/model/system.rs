//! A host's implicit matrix over the blocks of one or more bodies.

use crate::math::Mat3;

/// Pattern of a host system, as the host gives it.
///
/// Rows are 3x3 blocks: for each named body in turn, one per vertex of a deformable body, two (linear, angular) for a
/// rigid body. Symmetric positive definite; diagonal blocks present.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SystemDescription {
    /// Keys of the bodies, in row order.
    pub bodies: Vec<u64>,
    /// Start of each block row in `columns`; one more entry than rows.
    pub row_offsets: Vec<usize>,
    /// Block columns, ascending within a row.
    pub columns: Vec<u32>,
    /// Only blocks with `column >= row` are given.
    pub upper: bool,
}

/// A system with its values of this step.
#[derive(Clone, Debug, Default)]
pub struct System {
    /// The pattern.
    pub description: SystemDescription,
    /// One block per entry of `columns`. `[kg]` for linear-linear blocks.
    pub values: Vec<Mat3>,
}
