//! The velocity filter alone: positions before and after in, positions without collisions out.

use super::boundary::{call, call_in};
use super::context::{ContextShared, SGN_LOG_INFO, SGN_LOG_WARNING, SgnContext, with_context};
use super::description::{SGN_BODY_NO_SELF_COLLISION, SgnBodyOptions, SgnMesh, SgnPrecision};
use super::query::{
    SGN_WITNESS_BODIES, SGN_WITNESS_KIND, SGN_WITNESS_POINT, SgnWitnessAttribute, Table, hand_over, integers, pairs,
    unknown, vectors,
};
use super::status::{
    Failure, SGN_ERROR_BUFFER_LAYOUT, SGN_ERROR_BUSY, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_NULL_ARGUMENT,
    SGN_ERROR_POISONED, SGN_OK, SgnResult, Status,
};
use super::step::{ProgressOfHost, SgnStepDesc, SgnStepReport, summary};
use super::structs::{self, Growing};
use super::views::{self, Column, Output, SgnView, SgnViewMut};
use crate::math::Vec3;
use crate::model::{Precision, StepReport, Watch};
use crate::world::{FilterWitness, Motion, MotionFilter, MotionFilterDescription};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, RwLock, TryLockError};

/// What the two positions of a call to `sgn_filter_run` are.
pub type SgnFilterMode = i32;
/// A motion from `x0` to `x1`; where the last call ended does not count.
pub const SGN_FILTER_MOTION: i32 = 0;
/// Displacement mode, for recorded trajectories: the positions that the last call ended with move by `x1 - x0`, so that
/// what contact changed stays. The first call starts at `x0`.
pub const SGN_FILTER_DISPLACEMENT: i32 = 1;
/// Position mode, for recorded trajectories: the positions that the last call ended with move towards `x1`; `x0` is not
/// read and may be NULL. Needs a call before it that gave a state.
pub const SGN_FILTER_POSITION: i32 = 2;

/// Vertices of the first feature of a witness of a filter, U32X3 or U64X3; shorter features repeat their last vertex.
pub const SGN_WITNESS_FIRST_VERTICES: i32 = 5;
/// Vertices of the second feature, in the same way.
pub const SGN_WITNESS_SECOND_VERTICES: i32 = 6;

/// A mesh whose motion is filtered. Fill with `sgn_filter_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnFilterDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant: positions are certified after rounding to it. Default: F64.
    pub precision: SgnPrecision,
    /// 0 or `SGN_BODY_NO_SELF_COLLISION`: no group collides with itself. Default: 0.
    pub flags: u64,
    /// Half of the thickness of a pair. Negative: a tenth of the mean edge length of each group. Default: -1.
    pub half_thickness: f64,
    /// Friction coefficient of everything, at least 0. Default: 0.
    pub friction: f64,
    /// The mesh at rest: parts of one group that rest closer than their thickness keep a fraction of that distance only.
    pub mesh: SgnMesh,
    /// Masses, F32 or F64, one per vertex; 0 or infinite: scripted, the vertex goes where it is sent.
    pub masses: SgnView,
    /// Group of each vertex, U32 or U64 below 2^32: a body. Empty: all are one. No triangle or edge spans two.
    pub groups: SgnView,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnFilterDesc {
    const NAME: &'static str = "SgnFilterDesc";
    const FIRST_SIZE: usize = 272;
    fn defaults() -> Self {
        SgnFilterDesc {
            struct_size: 0,
            precision: super::description::SGN_PRECISION_F64,
            flags: 0,
            half_thickness: -1.0,
            friction: 0.0,
            mesh: SgnMesh::EMPTY,
            masses: SgnView::EMPTY,
            groups: SgnView::EMPTY,
        }
    }
}

/// A mesh with its search tree and the positions that its last call ended with. Keep it from step to step.
pub struct SgnFilter {
    context: Arc<ContextShared>,
    filter: RwLock<MotionFilter>,
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnFilterDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_filter_desc_init(desc: *mut SgnFilterDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Creates the filter of a mesh, for any simulation: it needs no world.
///
/// Ownership: the caller destroys `*out` with `sgn_filter_destroy`; the filter keeps what it needs of the context.
/// Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT,
/// BAD_TOPOLOGY, BUFFER_LAYOUT, OUT_OF_MEMORY, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_filter_create(
    context: *mut SgnContext,
    desc: *const SgnFilterDesc,
    out: *mut *mut SgnFilter,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        with_context(context, "sgn_filter_create", |context| {
            let description = description(&structs::read(desc)?)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let filter = RwLock::new(MotionFilter::new(description)?);
            out.write_unaligned(Box::into_raw(Box::new(SgnFilter { context: context.clone(), filter })));
            Ok(SGN_OK)
        })
    }
}

/// # Safety
/// The views are readable.
unsafe fn description(desc: &SgnFilterDesc) -> Result<MotionFilterDescription, Failure> {
    let options = SgnBodyOptions { flags: desc.flags, half_thickness: desc.half_thickness, ..SgnBodyOptions::DEFAULT };
    let options = options.checked(desc.precision, SGN_BODY_NO_SELF_COLLISION)?;
    // SAFETY: the caller vouches for the views.
    let (rest, topology, masses, groups) = unsafe {
        let (rest, topology) = desc.mesh.read()?;
        let groups = match desc.groups.is_absent() {
            true => Vec::new(),
            false => views::indices::<1>(&desc.groups, "groups")?.into_iter().flatten().collect(),
        };
        (rest, topology, views::masses(&desc.masses, "masses")?, groups)
    };
    Ok(MotionFilterDescription {
        rest,
        topology,
        masses,
        groups,
        half_thickness: options.half_thickness,
        friction_coefficient: desc.friction,
        self_collision: options.self_collision,
        precision: options.precision,
    })
}

/// Destroys a filter; NULL is allowed.
///
/// Thread: exclusive. Errors: BUSY while another call is in the filter (it then lives on).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_filter_destroy(filter: *mut SgnFilter) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    let Some(handle) = (unsafe { filter.as_ref() }) else { return SGN_OK };
    let context = handle.context.clone();
    call_in(&context, "sgn_filter_destroy", || {
        if let Err(TryLockError::WouldBlock) = handle.filter.try_write() {
            return Err(busy());
        }
        // SAFETY: made by sgn_filter_create, free, and the caller's to give up.
        drop(unsafe { Box::from_raw(filter) });
        Ok(SGN_OK)
    })
}

fn busy() -> Failure {
    Failure::new(SGN_ERROR_BUSY, "the filter is in use by another call")
}

/// Filters a motion: positions at the end without any collision, and their mean velocities. What collides with nothing
/// arrives at `x1`, to rounding. The start is checked first, unless it is where the last call ended; `desc` is that of a
/// step, of which `method`, `solver` and what belongs to the implicit method are not read. With `SGN_STEP_CERTIFY` the
/// end is certified by exact predicates. PINCHED carries a state, too: the outputs are then written.
///
/// `x0`, `x1`: F32X3 or F64X3, one per vertex. `positions`, `velocities` (NULL: not wanted) take as many; velocities are
/// `(positions - start)/dt`. Positions in F32X3 need the precision F32. `report` may be NULL.
///
/// Thread: exclusive. Notes: TANGLED_PAIRS, FAIL_SAFE_USED. Errors (nothing is written and the state stays, PINCHED
/// excepted): NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT, BUFFER_LAYOUT,
/// INTERSECTING_START, PINCHED, OUT_OF_MEMORY, CANCELLED, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_filter_run(
    filter: *mut SgnFilter,
    mode: SgnFilterMode,
    x0: *const SgnView,
    x1: *const SgnView,
    desc: *const SgnStepDesc,
    positions: *const SgnViewMut,
    velocities: *const SgnViewMut,
    report: *mut SgnStepReport,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the views.
    unsafe {
        change(filter, "sgn_filter_run", |filter, context| {
            let desc = structs::read(desc)?;
            let settings = desc.settings()?;
            let size = if report.is_null() { 0 } else { structs::checked_size(report)? };
            let read = |view: *const SgnView, what: &str| views::floats::<3>(&views::given(view, what)?, what);
            let from = if mode == SGN_FILTER_POSITION { Vec::new() } else { read(x0, "x0")? };
            let to = read(x1, "x1")?;
            let motion = match mode {
                SGN_FILTER_MOTION => Motion::Between(&from, &to),
                SGN_FILTER_DISPLACEMENT => Motion::Displacement(&from, &to),
                SGN_FILTER_POSITION => Motion::Towards(&to),
                other => {
                    let message = format!("mode {other} is out of range");
                    return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message).value(f64::from(other)));
                }
            };
            if !positions.is_null() && views::is_single(views::given_mut(positions, "positions")?.format) {
                let wanted =
                    "positions: the filter certifies doubles, which a float does not hold: ask for F32 precision";
                if filter.precision() == Precision::Double {
                    return Err(Failure::new(SGN_ERROR_BUFFER_LAYOUT, wanted));
                }
            }
            let outputs = [
                Target::new(positions, "positions", filter.len())?,
                Target::new(velocities, "velocities", filter.len())?,
            ];
            let never = AtomicBool::new(false);
            let host = ProgressOfHost { callback: desc.progress_callback, user: desc.progress_user, cancelled: &never };
            let told = |phase, fraction| host.goes_on(phase, fraction);
            let outcome = filter.run(motion, &settings, desc.dt, context.par(), Watch { told: Some(&told) });
            let hand_over = |given: &StepReport| {
                let answer = SgnStepReport::of(given);
                if size > 0 {
                    structs::write(report, size, &answer);
                }
                outputs[0].write(&filter.positions());
                outputs[1].write(filter.velocities());
                answer
            };
            match outcome {
                Ok(given) => {
                    let answer = hand_over(&given);
                    let level = if answer.notes == 0 { SGN_LOG_INFO } else { SGN_LOG_WARNING };
                    context.log(level, || summary("sgn_filter_run", &answer));
                    Ok(answer.note())
                }
                Err(failure) => {
                    if let Some(given) = &failure.report {
                        hand_over(given);
                    }
                    Err(failure.error.into())
                }
            }
        })
    }
}

/// An output that may be NULL, checked before anything is done.
struct Target(Option<Output>);

impl Target {
    /// # Safety
    /// `view` is NULL or points to a view of writable memory.
    unsafe fn new(view: *const SgnViewMut, what: &str, count: usize) -> Result<Target, Failure> {
        if view.is_null() {
            return Ok(Target(None));
        }
        let wanted = vec![0.0; 3 * count];
        // SAFETY: passed on.
        let view = unsafe { views::given_mut(view, what) }?;
        let output = Output::new(&view, what, &Column::Floats(3, &wanted))?;
        if output.count() != count {
            let message = format!("{what}: {count} elements are needed");
            return Err(Failure::new(SGN_ERROR_BUFFER_LAYOUT, message).value(output.count() as f64));
        }
        Ok(Target(Some(output)))
    }

    /// # Safety
    /// The view's memory is writable.
    unsafe fn write(&self, values: &[Vec3]) {
        if let Some(output) = &self.0 {
            // SAFETY: passed on.
            unsafe { output.write(&Column::Floats(3, values.as_flattened())) };
        }
    }
}

/// Forgets where the last call ended: the next one starts a trajectory of its own. The search tree stays.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_filter_restart(filter: *mut SgnFilter) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    unsafe {
        change(filter, "sgn_filter_restart", |filter, _| {
            filter.restart();
            Ok(SGN_OK)
        })
    }
}

/// Pulls an attribute of the witnesses of the last call, if it was refused or pinched: SGN_WITNESS_BODIES (here groups),
/// SGN_WITNESS_KIND, SGN_WITNESS_POINT, SGN_WITNESS_FIRST_VERTICES, SGN_WITNESS_SECOND_VERTICES. `view` and `count` as in
/// sgn_world_pull_contacts.
///
/// Thread: exclusive; so is the view's memory. Errors (nothing is then written): NULL_ARGUMENT, INVALID_ARGUMENT,
/// BUFFER_LAYOUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_filter_pull_witnesses(
    filter: *mut SgnFilter,
    attribute: SgnWitnessAttribute,
    view: *const SgnViewMut,
    count: *mut u64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe {
        change(filter, "sgn_filter_pull_witnesses", |filter, _| {
            hand_over(&witness_table(filter.witnesses(), attribute)?, view, count)
        })
    }
}

fn witness_table(witnesses: &[FilterWitness], attribute: SgnWitnessAttribute) -> Result<Table, Failure> {
    let triple =
        |side: usize| Table::Integers(3, witnesses.iter().flat_map(|w| w.vertices[side].map(u64::from)).collect());
    Ok(match attribute {
        SGN_WITNESS_BODIES => pairs(witnesses, |w| w.groups.map(u64::from)),
        SGN_WITNESS_KIND => integers(witnesses, |w| u64::from(w.kind)),
        SGN_WITNESS_POINT => vectors(witnesses, |w| w.point),
        SGN_WITNESS_FIRST_VERTICES => triple(0),
        SGN_WITNESS_SECOND_VERTICES => triple(1),
        _ => return Err(unknown(attribute)),
    })
}

/// Runs the body of an export that uses a filter.
///
/// # Safety
/// `filter` is NULL or a live filter.
unsafe fn change(
    filter: *mut SgnFilter,
    function: &str,
    body: impl FnOnce(&mut MotionFilter, &Arc<ContextShared>) -> Status,
) -> SgnResult {
    // SAFETY: passed on.
    let Some(handle) = (unsafe { filter.as_ref() }) else { return SGN_ERROR_NULL_ARGUMENT };
    call_in(&handle.context, function, || {
        // A panic while the lock is held poisons it.
        let mut filter = match handle.filter.try_write() {
            Ok(filter) => filter,
            Err(TryLockError::WouldBlock) => return Err(busy()),
            Err(TryLockError::Poisoned(_)) => {
                let message = "the filter is poisoned by an earlier panic: destroy it";
                return Err(Failure::new(SGN_ERROR_POISONED, message));
            }
        };
        body(&mut filter, &handle.context)
    })
}
