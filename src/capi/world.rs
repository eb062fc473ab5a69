//! Worlds: creation, destruction, hash; the ids of what they hold.

use super::boundary::{call, call_in, look};
use super::context::{ContextShared, SgnContext, with_context};
use super::status::{Failure, SGN_ERROR_BUSY, SGN_ERROR_INVALID_ARGUMENT, SGN_OK, SgnResult};
use super::structs::{self, Growing};
use crate::world::World;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, RwLock, TryLockError};

/// Id of a body. All zero is null. Ids of removed bodies, of other worlds and garbage give a status, nothing worse.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SgnBodyId {
    /// Opaque.
    pub value: u64,
}

/// Id of a material. All zero: the frictionless material that bodies have by default.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SgnMaterialId {
    /// Opaque.
    pub value: u64,
}

/// Id of a system.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SgnSystemId {
    /// Opaque.
    pub value: u64,
}

/// What a world is made of. Fill with `sgn_world_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnWorldDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Must be 0.
    pub flags: u64,
}

// SAFETY: repr(C) without padding; integers.
unsafe impl Growing for SgnWorldDesc {
    const NAME: &'static str = "SgnWorldDesc";
    const FIRST_SIZE: usize = 16;
    fn defaults() -> Self {
        SgnWorldDesc { struct_size: 0, reserved: 0, flags: 0 }
    }
}

/// Bodies, materials, systems and filters of a host, and what the contact method remembers of them.
pub struct SgnWorld {
    pub(super) context: Arc<ContextShared>,
    pub(super) world: RwLock<World>,
    pub(super) poisoned: AtomicBool,
    /// Set by `sgn_world_cancel`, cleared when a step begins.
    pub(super) cancelled: AtomicBool,
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnWorldDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_desc_init(desc: *mut SgnWorldDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Creates an empty world; `desc` may be NULL for the defaults.
///
/// Ownership: the caller destroys `*out` with `sgn_world_destroy`; the world keeps what it needs of the context.
/// Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_create(
    context: *mut SgnContext,
    desc: *const SgnWorldDesc,
    out: *mut *mut SgnWorld,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        with_context(context, "sgn_world_create", |context| {
            if !desc.is_null() {
                let desc = structs::read(desc)?;
                if desc.flags != 0 || desc.reserved != 0 {
                    return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, "flags and reserved must be 0"));
                }
            }
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let world = SgnWorld {
                context: context.clone(),
                world: RwLock::new(World::new()),
                poisoned: AtomicBool::new(false),
                cancelled: AtomicBool::new(false),
            };
            out.write_unaligned(Box::into_raw(Box::new(world)));
            Ok(SGN_OK)
        })
    }
}

/// Destroys a world and all that is in it; NULL is allowed. Poisoned worlds too.
///
/// Thread: exclusive. Errors: BUSY while another call is in the world (it then lives on).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_destroy(world: *mut SgnWorld) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    let Some(handle) = (unsafe { world.as_ref() }) else { return SGN_OK };
    let context = handle.context.clone();
    let code = call_in(&context, "sgn_world_destroy", || {
        if let Err(TryLockError::WouldBlock) = handle.world.try_write() {
            return Err(Failure::new(SGN_ERROR_BUSY, "the world is in use by another call"));
        }
        Ok(SGN_OK)
    });
    if code != SGN_OK {
        return code;
    }
    call_in(&context, "sgn_world_destroy", || {
        // SAFETY: made by sgn_world_create, free, and the caller's to give up.
        drop(unsafe { Box::from_raw(world) });
        Ok(SGN_OK)
    })
}

/// A 64-bit hash over everything that has been pushed and the last step has left: equal for worlds with the same history
/// on one build of the library, whatever the executor.
///
/// Thread: concurrent. Errors: NULL_ARGUMENT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_state_hash(world: *const SgnWorld, out: *mut u64) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        look(world, "sgn_world_state_hash", |world| {
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            out.write_unaligned(world.state_hash());
            Ok(SGN_OK)
        })
    }
}
