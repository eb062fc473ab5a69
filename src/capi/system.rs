//! Systems: implicit matrices of the host, pattern once, values per step.

use super::boundary::{call, change};
use super::status::{Failure, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_OUT_OF_MEMORY, SGN_OK, SgnResult};
use super::structs::{self, Growing};
use super::views::{self, SgnView};
use super::world::{SgnBodyId, SgnSystemId, SgnWorld};
use crate::world::SymmetrySlack;

/// Flag of a system: only blocks on and above the diagonal are given.
pub const SGN_SYSTEM_UPPER: u64 = 1;

/// Pattern of a system. Fill with `sgn_system_desc_init`.
///
/// Rows are 3x3 blocks: for each body in turn one per vertex of a deformable body, two (linear, then angular about the
/// centre of mass in world axes) for a rigid body. Symmetric positive definite. Rows and columns of pinned vertices must
/// be present and are not used.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnSystemDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// Must be 0.
    pub reserved: u32,
    /// `SGN_SYSTEM_` flags. Default: 0, full rows.
    pub flags: u64,
    /// Bodies in the order of rows, each in no other system.
    pub bodies: *const SgnBodyId,
    /// Number of bodies.
    pub body_count: u64,
    /// Start of each block row in `columns`, U32 or U64; one more than rows.
    pub row_offsets: SgnView,
    /// Block columns, U32 or U64, ascending within a row, the diagonal present.
    pub columns: SgnView,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnSystemDesc {
    const NAME: &'static str = "SgnSystemDesc";
    const FIRST_SIZE: usize = 112;
    fn defaults() -> Self {
        SgnSystemDesc {
            struct_size: 0,
            reserved: 0,
            flags: 0,
            bodies: std::ptr::null(),
            body_count: 0,
            row_offsets: SgnView::EMPTY,
            columns: SgnView::EMPTY,
        }
    }
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnSystemDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_system_desc_init(desc: *mut SgnSystemDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

unsafe fn body_list(desc: &SgnSystemDesc) -> Result<Vec<u64>, Failure> {
    if desc.bodies.is_null() {
        return Err(Failure::null("bodies"));
    }
    let too_many = || Failure::new(SGN_ERROR_OUT_OF_MEMORY, "body_count is too large").value(desc.body_count as f64);
    let count = usize::try_from(desc.body_count).map_err(|_| too_many())?;
    if count > isize::MAX as usize / size_of::<SgnBodyId>() {
        return Err(too_many());
    }
    let mut list = Vec::new();
    list.try_reserve_exact(count).map_err(|_| too_many())?;
    // SAFETY: the caller vouches for `count` ids.
    list.extend((0..count).map(|index| unsafe { desc.bodies.add(index).read_unaligned() }.value));
    Ok(list)
}

/// Adds a system over one or more bodies; its values are pushed with `sgn_system_push`, before the next step.
///
/// Ownership: everything is copied. Thread: exclusive. Errors (the world is then as it was): NULL_ARGUMENT, BAD_STRUCT,
/// UNSUPPORTED_STRUCT, INVALID_ARGUMENT, INVALID_ID, STALE_ID, BUFFER_LAYOUT, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_system_create(
    world: *mut SgnWorld,
    desc: *const SgnSystemDesc,
    out: *mut SgnSystemId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and views.
    unsafe {
        change(world, "sgn_system_create", |world, _| {
            let desc = structs::read(desc)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            if desc.flags & !SGN_SYSTEM_UPPER != 0 || desc.reserved != 0 {
                return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, "flags or reserved out of range"));
            }
            let bodies = body_list(&desc)?;
            let offsets = views::indices::<1>(&desc.row_offsets, "row_offsets")?;
            let offsets = offsets.into_iter().map(|[offset]| offset as usize).collect();
            let columns = views::indices::<1>(&desc.columns, "columns")?;
            let columns = columns.into_iter().flatten().collect();
            let value = world.add_system(bodies, offsets, columns, desc.flags & SGN_SYSTEM_UPPER != 0)?;
            out.write_unaligned(SgnSystemId { value });
            Ok(SGN_OK)
        })
    }
}

/// Sets the values of a system: one 3x3 block per entry of its columns. They stay until the next push.
///
/// Symmetry is checked: the two blocks of a pair may differ by 1e-10 (doubles) or 1e-5 (floats) of the larger diagonal
/// entry, and their mean is used.
/// Ownership: copied. Thread: exclusive. Errors (the old values then stay): NULL_ARGUMENT, INVALID_ID, STALE_ID,
/// INVALID_ARGUMENT, BUFFER_LAYOUT, NON_FINITE_INPUT, SINGULAR_SYSTEM, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_system_push(
    world: *mut SgnWorld,
    system: SgnSystemId,
    blocks: *const SgnView,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and the view.
    unsafe {
        change(world, "sgn_system_push", |world, _| {
            let view = views::given(blocks, "blocks")?;
            let slack = if views::is_single(view.format) { SymmetrySlack::Single } else { SymmetrySlack::Double };
            world.system_blocks(system.value)?;
            world.push_system(system.value, views::blocks(&view, "blocks")?, slack)?;
            Ok(SGN_OK)
        })
    }
}

/// Removes a system; its bodies have their lumped masses from then on.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_system_destroy(world: *mut SgnWorld, system: SgnSystemId) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    unsafe {
        change(world, "sgn_system_destroy", |world, _| {
            world.remove_system(system.value)?;
            Ok(SGN_OK)
        })
    }
}
