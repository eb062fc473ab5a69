//! Contacts, the check, witnesses.

use super::boundary::{call, change, look};
use super::status::{Failure, SGN_ERROR_INVALID_ARGUMENT, SGN_NOTE_TRUNCATED, SGN_OK, SgnResult, Status};
use super::structs::{self, Growing};
use super::views::{self, Column, Output, SgnViewMut};
use super::world::SgnWorld;
use crate::math::Vec3;
use crate::world::World;

/// Kind of a pair of features.
pub type SgnPairKind = i32;
/// A vertex and a triangle.
pub const SGN_PAIR_VERTEX_FACE: i32 = 0;
/// Two edges.
pub const SGN_PAIR_EDGE_EDGE: i32 = 1;
/// A vertex and a half-space.
pub const SGN_PAIR_VERTEX_HALF_SPACE: i32 = 2;
/// An edge and a triangle: of intersections, not of contacts.
pub const SGN_PAIR_EDGE_FACE: i32 = 3;

/// State of a contact.
pub type SgnContactState = i32;
/// No impulse.
pub const SGN_STATE_SEPARATED: i32 = 0;
/// Held by friction.
pub const SGN_STATE_STICKING: i32 = 1;
/// At the friction limit.
pub const SGN_STATE_SLIPPING: i32 = 2;

/// What of the contacts of the last step is pulled. All attributes have the same order, which does not depend on the
/// executor.
pub type SgnContactAttribute = i32;
/// Values of the ids of the two bodies `a` and `b`, U64X2. `b` is that with the face or the half-space.
pub const SGN_CONTACT_BODIES: i32 = 1;
/// Kind, U32 or U64: an `SGN_PAIR_` constant.
pub const SGN_CONTACT_KIND: i32 = 2;
/// Feature of each body, U32X2 or U64X2: vertex and triangle, or edge and edge (as in the slot EDGES), or vertex and 0.
pub const SGN_CONTACT_FEATURES: i32 = 3;
/// The four signed weights of the stencil, F32X4 or F64X4: of the vertex and the triangle's three, or of the edges' ends.
pub const SGN_CONTACT_WEIGHTS: i32 = 4;
/// Contact point on the side of `b`, F32X3 or F64X3.
pub const SGN_CONTACT_POINT: i32 = 5;
/// Unit normal from `b` to `a`, F32X3 or F64X3.
pub const SGN_CONTACT_NORMAL: i32 = 6;
/// Distance at the end of the step, F32 or F64.
pub const SGN_CONTACT_DISTANCE: i32 = 7;
/// Impulse on `a` over the step, F32X3 or F64X3; on `b` it is the opposite.
pub const SGN_CONTACT_IMPULSE: i32 = 8;
/// State, U32 or U64: an `SGN_STATE_` constant.
pub const SGN_CONTACT_STATE: i32 = 9;
/// Persistent key, U64: the same pair of features keeps it from step to step.
pub const SGN_CONTACT_KEY: i32 = 10;

/// What of the witnesses is pulled: two features that intersect, that leave no room, or that a pushed start was swept
/// through.
pub type SgnWitnessAttribute = i32;
/// Values of the ids of the two bodies, U64X2, in the order of the kind's name.
pub const SGN_WITNESS_BODIES: i32 = 1;
/// Feature of each body, U32X2 or U64X2: number of vertex, edge or triangle; 0 for a half-space.
pub const SGN_WITNESS_FEATURES: i32 = 2;
/// A point of the intersection, or between the features, F32X3 or F64X3.
pub const SGN_WITNESS_POINT: i32 = 3;

/// Kind, U32 or U64: an `SGN_PAIR_` constant.
pub const SGN_WITNESS_KIND: i32 = 4;

/// Outcome of a check. Fill with `sgn_check_report_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnCheckReport {
    /// Set by the init function.
    pub struct_size: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Pairs of features that intersect; their witnesses can be pulled.
    pub intersections: u64,
}

// SAFETY: repr(C) without padding; numbers.
unsafe impl Growing for SgnCheckReport {
    const NAME: &'static str = "SgnCheckReport";
    const FIRST_SIZE: usize = 16;
    fn defaults() -> Self {
        SgnCheckReport { struct_size: 0, reserved: 0, intersections: 0 }
    }
}

pub(super) enum Table {
    Floats(usize, Vec<f64>),
    Integers(usize, Vec<u64>),
}

pub(super) fn vectors<T>(list: &[T], get: impl Fn(&T) -> Vec3) -> Table {
    Table::Floats(3, list.iter().flat_map(get).collect())
}

pub(super) fn integers<T>(list: &[T], get: impl Fn(&T) -> u64) -> Table {
    Table::Integers(1, list.iter().map(get).collect())
}

pub(super) fn pairs<T>(list: &[T], get: impl Fn(&T) -> [u64; 2]) -> Table {
    Table::Integers(2, list.iter().flat_map(get).collect())
}

pub(super) fn unknown(attribute: i32) -> Failure {
    let message = format!("attribute {attribute} is out of range");
    Failure::new(SGN_ERROR_INVALID_ARGUMENT, message).value(f64::from(attribute))
}

fn contact_table(world: &World, attribute: SgnContactAttribute) -> Result<Table, Failure> {
    let contacts = world.contacts();
    Ok(match attribute {
        SGN_CONTACT_BODIES => pairs(contacts, |c| c.bodies.map(|key| world.id_of_key(key))),
        SGN_CONTACT_KIND => integers(contacts, |c| u64::from(c.kind)),
        SGN_CONTACT_FEATURES => pairs(contacts, |c| c.features.map(u64::from)),
        SGN_CONTACT_WEIGHTS => Table::Floats(4, contacts.iter().flat_map(|c| c.weights).collect()),
        SGN_CONTACT_POINT => vectors(contacts, |c| c.point),
        SGN_CONTACT_NORMAL => vectors(contacts, |c| c.normal),
        SGN_CONTACT_DISTANCE => Table::Floats(1, contacts.iter().map(|c| c.distance).collect()),
        SGN_CONTACT_IMPULSE => vectors(contacts, |c| c.impulse),
        SGN_CONTACT_STATE => integers(contacts, |c| u64::from(c.state)),
        SGN_CONTACT_KEY => integers(contacts, |c| c.key),
        _ => return Err(unknown(attribute)),
    })
}

fn witness_table(world: &World, attribute: SgnWitnessAttribute) -> Result<Table, Failure> {
    let witnesses = world.witnesses();
    Ok(match attribute {
        SGN_WITNESS_BODIES => pairs(witnesses, |w| w.bodies.map(|key| world.id_of_key(key))),
        SGN_WITNESS_FEATURES => pairs(witnesses, |w| w.features.map(u64::from)),
        SGN_WITNESS_POINT => vectors(witnesses, |w| w.point),
        SGN_WITNESS_KIND => integers(witnesses, |w| u64::from(w.kind)),
        _ => return Err(unknown(attribute)),
    })
}

/// Writes a table into a view that may be NULL, and the number of rows that there are.
pub(super) unsafe fn hand_over(table: &Table, view: *const SgnViewMut, count: *mut u64) -> Status {
    let column = match table {
        Table::Floats(lanes, data) => Column::Floats(*lanes, data),
        Table::Integers(lanes, data) => Column::Integers(*lanes, data),
    };
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe {
        if view.is_null() {
            if count.is_null() {
                return Err(Failure::null("count"));
            }
            count.write_unaligned(column.len() as u64);
            return Ok(SGN_OK);
        }
        let output = Output::new(&views::given_mut(view, "view")?, "view", &column)?;
        output.write(&column);
        if !count.is_null() {
            count.write_unaligned(column.len() as u64);
        }
        Ok(if output.count() < column.len() { SGN_NOTE_TRUNCATED } else { SGN_OK })
    }
}

/// Pulls an attribute of the contacts of the last step. With `view` NULL only their number is written, for the caller to
/// allocate; with a view that is too small the first ones are written, with the note TRUNCATED; elements beyond the last
/// contact are left as they are. `count` (may be NULL with a view) takes the number of contacts.
///
/// Thread: concurrent; the view's memory is exclusive. Errors (nothing is then written): NULL_ARGUMENT,
/// INVALID_ARGUMENT, BUFFER_LAYOUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_pull_contacts(
    world: *const SgnWorld,
    attribute: SgnContactAttribute,
    view: *const SgnViewMut,
    count: *mut u64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe { look(world, "sgn_world_pull_contacts", |world| hand_over(&contact_table(world, attribute)?, view, count)) }
}

/// Fills `report` with zeros and its size; `size` is `sizeof(SgnCheckReport)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_check_report_init(report: *mut SgnCheckReport, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(report, size) })
}

/// Looks for intersections of the present state (pushed starts included) by exact predicates; usable without any step.
/// Groups and masks count. Witnesses can be pulled until the next check or step.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_check(world: *mut SgnWorld, report: *mut SgnCheckReport) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        change(world, "sgn_world_check", |world, context| {
            let size = structs::checked_size(report)?;
            let intersections = world.check(context.par())? as u64;
            structs::write(report, size, &SgnCheckReport { struct_size: 0, reserved: 0, intersections });
            Ok(SGN_OK)
        })
    }
}

/// Pulls an attribute of the witnesses of the last check, or of the last step that was refused or pinched; `view` and
/// `count` as in sgn_world_pull_contacts.
///
/// Thread: concurrent; the view's memory is exclusive. Errors (nothing is then written): NULL_ARGUMENT,
/// INVALID_ARGUMENT, BUFFER_LAYOUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_pull_witnesses(
    world: *const SgnWorld,
    attribute: SgnWitnessAttribute,
    view: *const SgnViewMut,
    count: *mut u64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe {
        look(world, "sgn_world_pull_witnesses", |world| hand_over(&witness_table(world, attribute)?, view, count))
    }
}
