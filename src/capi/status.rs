//! Result codes, and failures on their way to one.

use crate::world::{Fault, WorldError};

/// Result of every function: 0 is success, positive a success with a note, negative an error. Numbers are never reused.
pub type SgnResult = i32;

/// Done.
pub const SGN_OK: i32 = 0;

/// Note: a solve stopped at its work cap; the end state is valid, residuals are in the report.
pub const SGN_NOTE_NOT_CONVERGED: i32 = 1;
/// Note: the step was divided.
pub const SGN_NOTE_SUBDIVIDED: i32 = 2;
/// Note: zones were projected or moved as rigid bodies, or vertices held.
pub const SGN_NOTE_FAIL_SAFE_USED: i32 = 3;
/// Note: pairs of a tangled component passed through each other.
pub const SGN_NOTE_TANGLED_PAIRS: i32 = 4;
/// Note: the buffer was too small; as much as fits was written.
pub const SGN_NOTE_TRUNCATED: i32 = 5;

/// A pointer that must not be NULL is NULL.
pub const SGN_ERROR_NULL_ARGUMENT: i32 = -1;
/// A value out of its range.
pub const SGN_ERROR_INVALID_ARGUMENT: i32 = -2;
/// A null, foreign or garbage id.
pub const SGN_ERROR_INVALID_ID: i32 = -3;
/// An id of something that has been removed.
pub const SGN_ERROR_STALE_ID: i32 = -4;
/// A struct whose `struct_size` is none that a version of it ever had: call its init function.
pub const SGN_ERROR_BAD_STRUCT: i32 = -5;
/// A struct of a newer version with something set that this library does not know.
pub const SGN_ERROR_UNSUPPORTED_STRUCT: i32 = -6;
/// Not offered: by this version, or for this kind of body.
pub const SGN_ERROR_UNSUPPORTED: i32 = -7;
/// A view whose format, count, stride or extent does not fit.
pub const SGN_ERROR_BUFFER_LAYOUT: i32 = -8;
/// NaN or infinity.
pub const SGN_ERROR_NON_FINITE_INPUT: i32 = -9;
/// Triangles, edges or points that do not fit.
pub const SGN_ERROR_BAD_TOPOLOGY: i32 = -10;
/// The start state intersects, or was swept through something since the last step; witnesses can be pulled.
pub const SGN_ERROR_INTERSECTING_START: i32 = -11;
/// Scripted geometry leaves no room. The one error that carries a state: everything stands at the certified fraction
/// of the step, valid for the next call; report and witnesses are written.
pub const SGN_ERROR_PINCHED: i32 = -12;
/// A system matrix that is not symmetric positive definite.
pub const SGN_ERROR_SINGULAR_SYSTEM: i32 = -13;
/// A size that the host drives does not fit into memory.
pub const SGN_ERROR_OUT_OF_MEMORY: i32 = -14;
/// The byte budget does not allow it. Reserved: this version has no budget.
pub const SGN_ERROR_BUDGET_EXCEEDED: i32 = -15;
/// The step was cancelled by the host; the world is as it was before it.
pub const SGN_ERROR_CANCELLED: i32 = -16;
/// The world is in use: by a step on another thread, or by the call that this callback comes from.
pub const SGN_ERROR_BUSY: i32 = -17;
/// The world is poisoned by an earlier `SGN_ERROR_PANIC`: it can be destroyed, or made sound by loading a snapshot.
pub const SGN_ERROR_POISONED: i32 = -18;
/// Bytes that are no snapshot of this library's format, are damaged, or hold what no world can.
pub const SGN_ERROR_SNAPSHOT_MISMATCH: i32 = -19;
/// The header and the library do not belong together.
pub const SGN_ERROR_ABI_MISMATCH: i32 = -20;
/// A defect of the library; the world, if any, is poisoned. Please report it.
pub const SGN_ERROR_PANIC: i32 = -21;

/// All codes with their names.
const NAMES: [(SgnResult, &std::ffi::CStr); 27] = [
    (SGN_OK, c"SGN_OK"),
    (SGN_NOTE_NOT_CONVERGED, c"SGN_NOTE_NOT_CONVERGED"),
    (SGN_NOTE_SUBDIVIDED, c"SGN_NOTE_SUBDIVIDED"),
    (SGN_NOTE_FAIL_SAFE_USED, c"SGN_NOTE_FAIL_SAFE_USED"),
    (SGN_NOTE_TANGLED_PAIRS, c"SGN_NOTE_TANGLED_PAIRS"),
    (SGN_NOTE_TRUNCATED, c"SGN_NOTE_TRUNCATED"),
    (SGN_ERROR_NULL_ARGUMENT, c"SGN_ERROR_NULL_ARGUMENT"),
    (SGN_ERROR_INVALID_ARGUMENT, c"SGN_ERROR_INVALID_ARGUMENT"),
    (SGN_ERROR_INVALID_ID, c"SGN_ERROR_INVALID_ID"),
    (SGN_ERROR_STALE_ID, c"SGN_ERROR_STALE_ID"),
    (SGN_ERROR_BAD_STRUCT, c"SGN_ERROR_BAD_STRUCT"),
    (SGN_ERROR_UNSUPPORTED_STRUCT, c"SGN_ERROR_UNSUPPORTED_STRUCT"),
    (SGN_ERROR_UNSUPPORTED, c"SGN_ERROR_UNSUPPORTED"),
    (SGN_ERROR_BUFFER_LAYOUT, c"SGN_ERROR_BUFFER_LAYOUT"),
    (SGN_ERROR_NON_FINITE_INPUT, c"SGN_ERROR_NON_FINITE_INPUT"),
    (SGN_ERROR_BAD_TOPOLOGY, c"SGN_ERROR_BAD_TOPOLOGY"),
    (SGN_ERROR_INTERSECTING_START, c"SGN_ERROR_INTERSECTING_START"),
    (SGN_ERROR_PINCHED, c"SGN_ERROR_PINCHED"),
    (SGN_ERROR_SINGULAR_SYSTEM, c"SGN_ERROR_SINGULAR_SYSTEM"),
    (SGN_ERROR_OUT_OF_MEMORY, c"SGN_ERROR_OUT_OF_MEMORY"),
    (SGN_ERROR_BUDGET_EXCEEDED, c"SGN_ERROR_BUDGET_EXCEEDED"),
    (SGN_ERROR_CANCELLED, c"SGN_ERROR_CANCELLED"),
    (SGN_ERROR_BUSY, c"SGN_ERROR_BUSY"),
    (SGN_ERROR_POISONED, c"SGN_ERROR_POISONED"),
    (SGN_ERROR_SNAPSHOT_MISMATCH, c"SGN_ERROR_SNAPSHOT_MISMATCH"),
    (SGN_ERROR_ABI_MISMATCH, c"SGN_ERROR_ABI_MISMATCH"),
    (SGN_ERROR_PANIC, c"SGN_ERROR_PANIC"),
];

/// Name of a code.
pub(super) fn name(code: SgnResult) -> Option<&'static std::ffi::CStr> {
    NAMES.iter().find(|(known, _)| *known == code).map(|(_, name)| *name)
}

/// A failure on its way to the last error and the returned code.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    pub code: SgnResult,
    pub object: u64,
    pub index: u64,
    pub value: f64,
    pub message: String,
}

impl Failure {
    pub fn new(code: SgnResult, message: impl Into<String>) -> Failure {
        Failure { code, object: 0, index: u64::MAX, value: f64::NAN, message: message.into() }
    }

    pub fn null(what: &str) -> Failure {
        Failure::new(SGN_ERROR_NULL_ARGUMENT, format!("{what} is NULL"))
    }

    pub fn index(mut self, index: usize) -> Failure {
        self.index = index as u64;
        self
    }

    pub fn value(mut self, value: f64) -> Failure {
        self.value = value;
        self
    }

    pub fn object(mut self, id: u64) -> Failure {
        self.object = id;
        self
    }
}

impl From<WorldError> for Failure {
    fn from(error: WorldError) -> Failure {
        let code = match error.fault {
            Fault::InvalidArgument => SGN_ERROR_INVALID_ARGUMENT,
            Fault::InvalidId => SGN_ERROR_INVALID_ID,
            Fault::StaleId => SGN_ERROR_STALE_ID,
            Fault::NonFinite => SGN_ERROR_NON_FINITE_INPUT,
            Fault::BadTopology => SGN_ERROR_BAD_TOPOLOGY,
            Fault::BufferLayout => SGN_ERROR_BUFFER_LAYOUT,
            Fault::SingularSystem => SGN_ERROR_SINGULAR_SYSTEM,
            Fault::IntersectingStart => SGN_ERROR_INTERSECTING_START,
            Fault::Pinched => SGN_ERROR_PINCHED,
            Fault::OutOfMemory => SGN_ERROR_OUT_OF_MEMORY,
            Fault::Cancelled => SGN_ERROR_CANCELLED,
            Fault::SnapshotMismatch => SGN_ERROR_SNAPSHOT_MISMATCH,
            Fault::Unsupported => SGN_ERROR_UNSUPPORTED,
        };
        Failure { code, object: error.object, index: error.index, value: error.value, message: error.message }
    }
}

/// What the body of an export returns.
pub(super) type Status = Result<SgnResult, Failure>;
