//! Version and capabilities.

use super::boundary::call;
use super::context::{SGN_EXECUTOR_POOL, SGN_EXECUTOR_SERIAL};
use super::status::{Failure, SGN_ERROR_UNSUPPORTED, SGN_OK, SgnResult, name};
use super::step::{SGN_METHOD_IMPLICIT, SGN_METHOD_VELOCITY_FILTER};
use super::structs::{self, Growing};
use std::ffi::c_char;

/// Version of the binary interface; passed into `sgn_context_create`. Changes only when it breaks.
pub const SGN_ABI_VERSION: u32 = 1;

/// Version of the library. Fill with `sgn_version_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnVersion {
    /// Set by the init function.
    pub struct_size: u32,
    /// `SGN_ABI_VERSION` of the library.
    pub abi: u32,
    /// Major version.
    pub major: u32,
    /// Minor version.
    pub minor: u32,
    /// Patch version.
    pub patch: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C) without padding; numbers.
unsafe impl Growing for SgnVersion {
    const NAME: &'static str = "SgnVersion";
    const FIRST_SIZE: usize = 24;
    fn defaults() -> Self {
        SgnVersion { struct_size: 0, abi: 0, major: 0, minor: 0, patch: 0, reserved: 0 }
    }
}

/// What `sgn_query` tells.
pub type SgnCapability = i32;
/// Bit `1 << n` for every `SGN_EXECUTOR_` constant `n` on offer.
pub const SGN_CAPABILITY_EXECUTORS: i32 = 1;
/// Bit `1 << n` for every `SGN_METHOD_` constant `n` on offer.
pub const SGN_CAPABILITY_METHODS: i32 = 2;
/// 1: the same inputs give the same bits on any executor.
pub const SGN_CAPABILITY_DETERMINISTIC: i32 = 3;
/// Version of the snapshot format that is written and read.
pub const SGN_CAPABILITY_SNAPSHOT_FORMAT: i32 = 4;
/// Most workers of a pool.
pub const SGN_CAPABILITY_WORKERS_MAX: i32 = 5;

/// Fills `version` with zeros and its size; `size` is `sizeof(SgnVersion)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_version_init(version: *mut SgnVersion, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(version, size) })
}

/// Version of the library that is linked or loaded.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_version(version: *mut SgnVersion) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    call(|| unsafe {
        let size = structs::checked_size(version)?;
        let number = |text: &str| text.parse().unwrap_or(0);
        let answer = SgnVersion {
            struct_size: 0,
            abi: SGN_ABI_VERSION,
            major: number(env!("CARGO_PKG_VERSION_MAJOR")),
            minor: number(env!("CARGO_PKG_VERSION_MINOR")),
            patch: number(env!("CARGO_PKG_VERSION_PATCH")),
            reserved: 0,
        };
        structs::write(version, size, &answer);
        Ok(SGN_OK)
    })
}

/// Tells a capability.
///
/// Thread: any. Errors: NULL_ARGUMENT; UNSUPPORTED for capabilities that this version does not know.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_query(capability: SgnCapability, out: *mut i64) -> SgnResult {
    call(|| {
        let value = match capability {
            SGN_CAPABILITY_EXECUTORS => (1 << SGN_EXECUTOR_SERIAL) | (1 << SGN_EXECUTOR_POOL),
            SGN_CAPABILITY_METHODS => 1 << SGN_METHOD_IMPLICIT | 1 << SGN_METHOD_VELOCITY_FILTER,
            SGN_CAPABILITY_DETERMINISTIC => 1,
            SGN_CAPABILITY_SNAPSHOT_FORMAT => i64::from(crate::world::SNAPSHOT_FORMAT),
            SGN_CAPABILITY_WORKERS_MAX => 1024,
            _ => return Err(Failure::new(SGN_ERROR_UNSUPPORTED, "unknown capability")),
        };
        if out.is_null() {
            return Err(Failure::null("out"));
        }
        // SAFETY: the caller vouches for the pointer.
        unsafe { out.write_unaligned(value) };
        Ok(SGN_OK)
    })
}

/// Name of a result code, as `"SGN_ERROR_BUSY"`.
///
/// Ownership: the text is the library's and stays. Thread: any. Errors: NULL_ARGUMENT; UNSUPPORTED for unknown codes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_result_name(code: SgnResult, out: *mut *const c_char) -> SgnResult {
    call(|| {
        let text = name(code).ok_or_else(|| Failure::new(SGN_ERROR_UNSUPPORTED, "unknown code"))?;
        if out.is_null() {
            return Err(Failure::null("out"));
        }
        // SAFETY: the caller vouches for the pointer.
        unsafe { out.write_unaligned(text.as_ptr()) };
        Ok(SGN_OK)
    })
}
