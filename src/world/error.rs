//! How a call on a world can fail.

/// Class of a failure; the C ABI has one status for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A value out of its range.
    InvalidArgument,
    /// A null, foreign or garbage id.
    InvalidId,
    /// An id of something that has been removed.
    StaleId,
    /// NaN or infinity.
    NonFinite,
    /// A triangle, edge or point list that does not fit.
    BadTopology,
    /// Counts that do not agree.
    BufferLayout,
    /// A host matrix that is not symmetric positive definite.
    SingularSystem,
    /// The start state intersects, or was swept through something since the last step.
    IntersectingStart,
    /// Scripted geometry leaves no room; the state stands at the certified fraction.
    Pinched,
    /// A size that the host drives does not fit into memory.
    OutOfMemory,
    /// Cancelled by the host.
    Cancelled,
    /// Bytes that are no snapshot of this format, or hold what no world can.
    SnapshotMismatch,
    /// Not offered for this kind of body.
    Unsupported,
}

/// A failure: what, where, and the value at fault.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldError {
    /// Class.
    pub fault: Fault,
    /// Id at fault, or 0.
    pub object: u64,
    /// Array index at fault, or `u64::MAX`.
    pub index: u64,
    /// Value at fault, or NaN.
    pub value: f64,
    /// What is wrong, in a sentence.
    pub message: String,
}

impl WorldError {
    /// A failure without object, index or value.
    pub fn new(fault: Fault, message: impl Into<String>) -> WorldError {
        WorldError { fault, object: 0, index: u64::MAX, value: f64::NAN, message: message.into() }
    }

    /// A size that does not fit into memory.
    pub fn out_of_memory(message: impl Into<String>) -> WorldError {
        WorldError::new(Fault::OutOfMemory, message)
    }

    /// With the id at fault.
    pub fn object(mut self, id: u64) -> WorldError {
        self.object = id;
        self
    }

    /// With the index at fault.
    pub fn index(mut self, index: usize) -> WorldError {
        self.index = index as u64;
        self
    }

    /// With the value at fault.
    pub fn value(mut self, value: f64) -> WorldError {
        self.value = value;
        self
    }
}
