//! The boundary that every export runs behind: panics, null, busy and poisoned worlds, the last error.

use super::context::{ContextShared, SGN_LOG_ERROR};
use super::float_environment::DefaultFloatEnvironment;
use super::status::{
    Failure, SGN_ERROR_BUSY, SGN_ERROR_NULL_ARGUMENT, SGN_ERROR_PANIC, SGN_ERROR_POISONED, SgnResult, Status,
};
use super::world::SgnWorld;
use crate::world::World;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, TryLockError};

/// Runs the body of an export that has no context to report to.
pub(super) fn call(body: impl FnOnce() -> Status) -> SgnResult {
    match caught(body) {
        Ok(code) => code,
        Err(failure) => failure.code,
    }
}

/// Runs the body of an export; a failure becomes the context's last error, under the name of the function.
pub(super) fn call_in(context: &Arc<ContextShared>, function: &str, body: impl FnOnce() -> Status) -> SgnResult {
    // Kept alive by us: a log callback may destroy the host's handle meanwhile.
    let context = context.clone();
    match caught(body) {
        Ok(code) => code,
        Err(mut failure) => {
            failure.message.insert_str(0, ": ");
            failure.message.insert_str(0, function);
            let code = failure.code;
            // The callback is the host's; what panics on the way to it is caught like everything else.
            let _ = caught(|| {
                context.log(SGN_LOG_ERROR, || failure.message.clone());
                context.set_last_error(failure);
                Ok(code)
            });
            code
        }
    }
}

/// Sets the floating-point environment and turns a panic into a failure.
fn caught(body: impl FnOnce() -> Status) -> Status {
    let _environment = DefaultFloatEnvironment::enter();
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(status) => status,
        Err(payload) => {
            let text = if let Some(text) = payload.downcast_ref::<&str>() {
                (*text).to_string()
            } else if let Some(text) = payload.downcast_ref::<String>() {
                text.clone()
            } else {
                "of unknown kind".to_string()
            };
            // Dropping what was thrown could throw again.
            std::mem::forget(payload);
            Err(Failure::new(SGN_ERROR_PANIC, format!("panic: {text}")))
        }
    }
}

fn busy() -> Failure {
    Failure::new(SGN_ERROR_BUSY, "the world is in use by another call")
}

fn poisoned() -> Failure {
    Failure::new(SGN_ERROR_POISONED, "the world is poisoned by an earlier panic: destroy it, or load a snapshot")
}

/// A panic while the guard lives poisons the world, whichever lock it holds.
struct PoisonOnPanic<'a>(&'a SgnWorld);

impl Drop for PoisonOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.poisoned.store(true, Ordering::Release);
        }
    }
}

/// Runs the body of an export that changes a world.
///
/// # Safety
/// `world` is NULL or a live world.
pub(super) unsafe fn change(
    world: *mut SgnWorld,
    function: &str,
    body: impl FnOnce(&mut World, &Arc<ContextShared>) -> Status,
) -> SgnResult {
    // SAFETY: passed on.
    let Some(handle) = (unsafe { world.as_ref() }) else { return SGN_ERROR_NULL_ARGUMENT };
    call_in(&handle.context, function, || {
        let mut world = match handle.world.try_write() {
            Ok(world) => world,
            Err(TryLockError::WouldBlock) => return Err(busy()),
            Err(TryLockError::Poisoned(_)) => return Err(poisoned()),
        };
        if handle.poisoned.load(Ordering::Acquire) {
            return Err(poisoned());
        }
        let _guard = PoisonOnPanic(handle);
        body(&mut world, &handle.context)
    })
}

/// Runs the body of an export that replaces all of a world; one that was poisoned is sound after a success.
///
/// # Safety
/// `world` is NULL or a live world.
pub(super) unsafe fn replace(
    world: *mut SgnWorld,
    function: &str,
    body: impl FnOnce(&mut World) -> Status,
) -> SgnResult {
    // SAFETY: passed on.
    let Some(handle) = (unsafe { world.as_ref() }) else { return SGN_ERROR_NULL_ARGUMENT };
    call_in(&handle.context, function, || {
        let mut world = match handle.world.try_write() {
            Ok(world) => world,
            Err(TryLockError::WouldBlock) => return Err(busy()),
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
        };
        let _guard = PoisonOnPanic(handle);
        let code = body(&mut world)?;
        handle.world.clear_poison();
        handle.poisoned.store(false, Ordering::Release);
        Ok(code)
    })
}

/// Runs the body of an export that reads a world.
///
/// # Safety
/// `world` is NULL or a live world.
pub(super) unsafe fn look(world: *const SgnWorld, function: &str, body: impl FnOnce(&World) -> Status) -> SgnResult {
    // SAFETY: passed on.
    let Some(handle) = (unsafe { world.as_ref() }) else { return SGN_ERROR_NULL_ARGUMENT };
    call_in(&handle.context, function, || {
        let world = match handle.world.try_read() {
            Ok(world) => world,
            Err(TryLockError::WouldBlock) => return Err(busy()),
            Err(TryLockError::Poisoned(_)) => return Err(poisoned()),
        };
        if handle.poisoned.load(Ordering::Acquire) {
            return Err(poisoned());
        }
        let _guard = PoisonOnPanic(handle);
        body(&world)
    })
}

/// Makes panics silent when this code is `libsignorini` itself: its Rust runtime is then its own, and a host's standard
/// error is not ours to write to. Linked into a Rust program, the program's hook stays.
pub(super) fn silence_own_panics() {
    #[cfg(unix)]
    {
        static ONCE: std::sync::Once = std::sync::Once::new();
        ONCE.call_once(|| {
            // SAFETY: an all-zero Dl_info is valid, and dladdr only fills it.
            let own = unsafe {
                let mut info: libc::Dl_info = std::mem::zeroed();
                let address = silence_own_panics as fn() as *const libc::c_void;
                (libc::dladdr(address, &mut info) != 0 && !info.dli_fname.is_null())
                    .then(|| std::ffi::CStr::from_ptr(info.dli_fname).to_bytes().to_vec())
            };
            let file = own.unwrap_or_default();
            let file = file.rsplit(|byte| *byte == b'/').next().unwrap_or_default();
            if file.starts_with(b"libsignorini.so") || file.starts_with(b"libsignorini.dylib") {
                std::panic::set_hook(Box::new(|_| {}));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use super::*;

    #[test]
    fn a_panic_is_a_status_and_poisons_the_world() {
        std::panic::set_hook(Box::new(|_| {}));
        for reading in [false, true] {
            // SAFETY: pointers come from the functions themselves.
            unsafe {
                let mut context = std::ptr::null_mut();
                let made = sgn_context_create(SGN_ABI_VERSION, std::ptr::null(), std::ptr::null_mut(), 0, &mut context);
                assert_eq!(made, SGN_OK);
                let mut world = std::ptr::null_mut();
                assert_eq!(sgn_world_create(context, std::ptr::null(), &mut world), SGN_OK);
                let code = if reading {
                    look(world, "f", |_| panic!("wanted {}", 1))
                } else {
                    change(world, "f", |_, _| panic!("wanted {}", 1))
                };
                assert_eq!(code, SGN_ERROR_PANIC);
                let mut text = [0u8; 64];
                let mut info = std::mem::zeroed::<SgnErrorInfo>();
                assert_eq!(sgn_error_info_init(&mut info, size_of::<SgnErrorInfo>()), SGN_OK);
                info.message = text.as_mut_ptr().cast();
                info.message_capacity = 64;
                assert_eq!(sgn_context_last_error(context, &mut info), SGN_OK);
                assert_eq!((info.code, &text[..18]), (SGN_ERROR_PANIC, &b"f: panic: wanted 1"[..]));
                let mut hash = 0;
                assert_eq!(sgn_world_state_hash(world, &mut hash), SGN_ERROR_POISONED);
                let mut id = SgnMaterialId { value: 0 };
                let mut desc = std::mem::zeroed::<SgnMaterialDesc>();
                assert_eq!(sgn_material_desc_init(&mut desc, size_of::<SgnMaterialDesc>()), SGN_OK);
                assert_eq!(sgn_material_create(world, &desc, &mut id), SGN_ERROR_POISONED);
                let mut fresh = std::ptr::null_mut();
                assert_eq!(sgn_world_create(context, std::ptr::null(), &mut fresh), SGN_OK);
                let mut room = [0u8; 512];
                let mut size = 0;
                assert_eq!(sgn_world_snapshot_save(fresh, room.as_mut_ptr().cast(), 512, &mut size), SGN_OK);
                assert_eq!(sgn_world_snapshot_load(world, room.as_ptr().cast(), size - 1), SGN_ERROR_SNAPSHOT_MISMATCH);
                assert_eq!(sgn_world_state_hash(world, &mut hash), SGN_ERROR_POISONED);
                assert_eq!(sgn_world_snapshot_load(world, room.as_ptr().cast(), size), SGN_OK);
                assert_eq!(sgn_world_state_hash(world, &mut hash), SGN_OK);
                assert_eq!(sgn_world_destroy(fresh), SGN_OK);
                assert_eq!(sgn_world_destroy(world), SGN_OK);
                assert_eq!(sgn_context_destroy(context), SGN_OK);
            }
        }
        let _ = std::panic::take_hook();
    }
}
