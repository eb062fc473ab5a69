//! Snapshots of a world.

use super::boundary::{look, replace};
use super::status::{Failure, SGN_ERROR_BUFFER_LAYOUT, SGN_OK, SgnResult};
use super::world::SgnWorld;
use std::ffi::c_void;

/// Bytes that a snapshot of the world's present state takes.
///
/// Thread: concurrent. Errors: NULL_ARGUMENT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_snapshot_size(world: *const SgnWorld, out: *mut u64) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        look(world, "sgn_world_snapshot_size", |world| {
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            out.write_unaligned(world.snapshot_size() as u64);
            Ok(SGN_OK)
        })
    }
}

/// Saves everything that the next steps depend on - bodies, materials, systems, filters, what was pushed, what the method
/// remembers - into `buffer`, and the bytes written into `written` (may be NULL). The bytes depend on no machine.
///
/// Thread: concurrent. Errors: NULL_ARGUMENT, BUFFER_LAYOUT (a `capacity` below `sgn_world_snapshot_size`; nothing is
/// written, the value at fault is that size), BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_snapshot_save(
    world: *const SgnWorld,
    buffer: *mut c_void,
    capacity: u64,
    written: *mut u64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and for `capacity` bytes.
    unsafe {
        look(world, "sgn_world_snapshot_save", |world| {
            if buffer.is_null() {
                return Err(Failure::null("buffer"));
            }
            let size = world.snapshot_size();
            if capacity < size as u64 {
                let message = format!("the snapshot takes {size} bytes, the buffer has {capacity}");
                return Err(Failure::new(SGN_ERROR_BUFFER_LAYOUT, message).value(size as f64));
            }
            let room = std::slice::from_raw_parts_mut(buffer.cast::<u8>(), size);
            // The host's bytes need not be initialised.
            room.fill(0);
            let size = world.save_snapshot(room)?;
            if !written.is_null() {
                written.write_unaligned(size as u64);
            }
            Ok(SGN_OK)
        })
    }
}

/// Makes the world what it was when the snapshot was saved, by this or another world of this or another process. Ids that
/// were valid then are valid again (another world that was built by the same calls keeps its own ids), ids given out since
/// are stale. The same calls from there on give the same bits on one build of the library. Works on a poisoned
/// world, which is sound afterwards. The bytes may come from anywhere: nothing in them is trusted.
///
/// Thread: exclusive. Errors (the world is then as it was): NULL_ARGUMENT, SNAPSHOT_MISMATCH (the index at fault is the
/// byte), OUT_OF_MEMORY, BUSY, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_snapshot_load(world: *mut SgnWorld, buffer: *const c_void, size: u64) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and for `size` bytes.
    unsafe {
        replace(world, "sgn_world_snapshot_load", |world| {
            if buffer.is_null() {
                return Err(Failure::null("buffer"));
            }
            let size = usize::try_from(size).ok().filter(|size| *size <= isize::MAX as usize);
            let size = size.ok_or_else(|| Failure::new(SGN_ERROR_BUFFER_LAYOUT, "no buffer has that size"))?;
            world.load_snapshot(std::slice::from_raw_parts(buffer.cast::<u8>(), size))?;
            Ok(SGN_OK)
        })
    }
}
