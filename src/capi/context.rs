//! Contexts: log, last error, executor.

use super::boundary::{call, call_in, silence_own_panics};
use super::status::{
    Failure, SGN_ERROR_ABI_MISMATCH, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_OUT_OF_MEMORY, SGN_ERROR_UNSUPPORTED,
    SGN_NOTE_TRUNCATED, SGN_OK, SgnResult, Status,
};
use super::structs::{self, Growing};
use super::version::SGN_ABI_VERSION;
use crate::parallel::{Par, Pool};
use std::ffi::{c_char, c_void};
use std::sync::{Arc, Mutex};
use std::thread::ThreadId;

/// Where work runs.
pub type SgnExecutor = i32;
/// On the calling thread; spawns nothing. The default.
pub const SGN_EXECUTOR_SERIAL: i32 = 0;
/// On a private pool of `workers` threads, joined when the context and its worlds are gone.
pub const SGN_EXECUTOR_POOL: i32 = 1;
/// On the host's own threads. Reserved: `SGN_ERROR_UNSUPPORTED` in this version.
pub const SGN_EXECUTOR_HOST: i32 = 2;

/// Level of a log message; a level includes those below it.
pub type SgnLogLevel = i32;
/// Nothing.
pub const SGN_LOG_OFF: i32 = 0;
/// Calls that failed.
pub const SGN_LOG_ERROR: i32 = 1;
/// Steps that ended with a note.
pub const SGN_LOG_WARNING: i32 = 2;
/// One line per step.
pub const SGN_LOG_INFO: i32 = 3;

/// Receives log messages, on the thread whose call they are about. `message` is UTF-8, `length` bytes, not terminated,
/// and gone after the return. Calls into the world at work return `SGN_ERROR_BUSY`. Must not throw.
pub type SgnLogCallback =
    Option<unsafe extern "C" fn(user: *mut c_void, level: SgnLogLevel, message: *const c_char, length: u64)>;

/// What a context is made of. Fill with `sgn_context_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnContextDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_EXECUTOR_` constant. Default: serial.
    pub executor: SgnExecutor,
    /// Workers of the pool, 1 to 1024. Default: 1.
    pub workers: u32,
    /// The most talkative level to report. Default: `SGN_LOG_WARNING`.
    pub log_level: SgnLogLevel,
    /// Receives log messages; NULL: none. Default: NULL.
    pub log_callback: SgnLogCallback,
    /// Handed to the callback.
    pub log_user: *mut c_void,
    /// Must be 0.
    pub flags: u64,
}

// SAFETY: repr(C) without padding; integers and pointers.
unsafe impl Growing for SgnContextDesc {
    const NAME: &'static str = "SgnContextDesc";
    const FIRST_SIZE: usize = 40;
    fn defaults() -> Self {
        SgnContextDesc {
            struct_size: 0,
            executor: SGN_EXECUTOR_SERIAL,
            workers: 1,
            log_level: SGN_LOG_WARNING,
            log_callback: None,
            log_user: std::ptr::null_mut(),
            flags: 0,
        }
    }
}

/// The last failure of the calling thread. Fill with `sgn_error_info_init`, then set `message` and `message_capacity`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnErrorInfo {
    /// Set by the init function.
    pub struct_size: u32,
    /// The code that was returned; 0: this thread had no failure.
    pub code: SgnResult,
    /// Value of the id at fault, or 0.
    pub object: u64,
    /// Array index at fault, or UINT64_MAX.
    pub index: u64,
    /// Value at fault, or NaN.
    pub value: f64,
    /// In: the caller's buffer, or NULL. Filled with UTF-8, terminated by a zero byte.
    pub message: *mut c_char,
    /// In: bytes of the buffer.
    pub message_capacity: u64,
    /// Out: bytes of the whole message without the zero byte.
    pub message_length: u64,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnErrorInfo {
    const NAME: &'static str = "SgnErrorInfo";
    const FIRST_SIZE: usize = 56;
    fn defaults() -> Self {
        SgnErrorInfo {
            struct_size: 0,
            code: SGN_OK,
            object: 0,
            index: u64::MAX,
            value: f64::NAN,
            message: std::ptr::null_mut(),
            message_capacity: 0,
            message_length: 0,
        }
    }
}

struct Log {
    level: SgnLogLevel,
    callback: unsafe extern "C" fn(*mut c_void, SgnLogLevel, *const c_char, u64),
    user: *mut c_void,
}

/// What a context and its worlds share.
pub(super) struct ContextShared {
    log: Option<Log>,
    pool: Option<Pool>,
    errors: Mutex<Vec<(ThreadId, Failure)>>,
}

// SAFETY: the callback and its user pointer are the host's, who is told that worlds may be used from any thread.
unsafe impl Send for ContextShared {}
// SAFETY: as above; everything else is locked or constant.
unsafe impl Sync for ContextShared {}

/// Threads whose last error is kept; the one that failed longest ago is forgotten first.
const ERRORS_KEPT: usize = 64;

impl ContextShared {
    /// Hands a message to the host's callback.
    pub fn log(&self, level: SgnLogLevel, message: impl FnOnce() -> String) {
        if let Some(log) = &self.log
            && level <= log.level
        {
            let message = message();
            // SAFETY: the host gave the callback for this use; the message outlives the call.
            unsafe { (log.callback)(log.user, level, message.as_ptr().cast(), message.len() as u64) }
        }
    }

    /// Keeps the failure as the last error of this thread.
    pub fn set_last_error(&self, failure: Failure) {
        let thread = std::thread::current().id();
        if let Ok(mut errors) = self.errors.lock() {
            errors.retain(|(known, _)| *known != thread);
            if errors.len() == ERRORS_KEPT {
                errors.remove(0);
            }
            errors.push((thread, failure));
        }
    }

    fn last_error(&self) -> Option<Failure> {
        let thread = std::thread::current().id();
        let errors = self.errors.lock().ok()?;
        errors.iter().find(|(known, _)| *known == thread).map(|(_, failure)| failure.clone())
    }

    /// Where the work of this context runs.
    pub fn par(&self) -> Par<'_> {
        match &self.pool {
            Some(pool) => Par::Pool(pool),
            None => Par::Serial,
        }
    }
}

/// Log, last error and executor of a host. Any number per process; nothing else is shared between them.
pub struct SgnContext {
    pub(super) shared: Arc<ContextShared>,
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnContextDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_context_desc_init(desc: *mut SgnContextDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `info` with defaults; `size` is `sizeof(SgnErrorInfo)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_error_info_init(info: *mut SgnErrorInfo, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(info, size) })
}

/// Creates a context. Pass `SGN_ABI_VERSION` as `abi`; `desc` may be NULL for the defaults. `message`, if not NULL, takes
/// the reason of a failure, terminated by a zero byte and cut to `message_capacity` bytes: there is no context yet to ask.
///
/// Ownership: the caller destroys `*out` with `sgn_context_destroy`. Thread: any.
/// Errors: ABI_MISMATCH, NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, UNSUPPORTED, OUT_OF_MEMORY.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_context_create(
    abi: u32,
    desc: *const SgnContextDesc,
    message: *mut c_char,
    message_capacity: usize,
    out: *mut *mut SgnContext,
) -> SgnResult {
    call(|| {
        silence_own_panics();
        // SAFETY: the caller vouches for the pointers.
        let made = unsafe { create(abi, desc) }.and_then(|context| {
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            Ok(Box::into_raw(Box::new(context)))
        });
        match made {
            Ok(context) => {
                // SAFETY: checked above.
                unsafe { out.write_unaligned(context) };
                Ok(SGN_OK)
            }
            Err(failure) => {
                // SAFETY: the caller vouches for the buffer.
                unsafe { write_text(&failure.message, message, message_capacity as u64) };
                Err(failure)
            }
        }
    })
}

unsafe fn create(abi: u32, desc: *const SgnContextDesc) -> Result<SgnContext, Failure> {
    if abi != SGN_ABI_VERSION {
        let message = format!("the header has ABI {abi}, the library {SGN_ABI_VERSION}");
        return Err(Failure::new(SGN_ERROR_ABI_MISMATCH, message).value(f64::from(abi)));
    }
    let desc = if desc.is_null() {
        SgnContextDesc::defaults()
    } else {
        // SAFETY: passed on.
        unsafe { structs::read(desc) }?
    };
    let invalid = |what: &str, value: f64| {
        Failure::new(SGN_ERROR_INVALID_ARGUMENT, format!("{what} {value} is out of range")).value(value)
    };
    if desc.flags != 0 {
        return Err(invalid("flags", desc.flags as f64));
    }
    if !(SGN_LOG_OFF..=SGN_LOG_INFO).contains(&desc.log_level) {
        return Err(invalid("log_level", f64::from(desc.log_level)));
    }
    let pool =
        match desc.executor {
            SGN_EXECUTOR_SERIAL => None,
            SGN_EXECUTOR_POOL if !(1..=1024).contains(&desc.workers) => {
                return Err(invalid("workers", f64::from(desc.workers)));
            }
            SGN_EXECUTOR_POOL => Some(Pool::new(desc.workers as usize).map_err(|message| {
                Failure::new(SGN_ERROR_OUT_OF_MEMORY, format!("the pool cannot start: {message}"))
            })?),
            SGN_EXECUTOR_HOST => {
                return Err(Failure::new(SGN_ERROR_UNSUPPORTED, "this version has no host executor"));
            }
            other => return Err(invalid("executor", f64::from(other))),
        };
    let log = desc.log_callback.map(|callback| Log { level: desc.log_level, callback, user: desc.log_user });
    let shared = ContextShared { log, pool, errors: Mutex::new(Vec::new()) };
    Ok(SgnContext { shared: Arc::new(shared) })
}

/// Destroys a context; NULL is allowed. Its worlds stay usable and keep what they need of it; the pool is joined when the
/// last of them is gone.
///
/// Thread: exclusive. Errors: none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_context_destroy(context: *mut SgnContext) -> SgnResult {
    call(|| {
        if !context.is_null() {
            // SAFETY: made by sgn_context_create, and the caller's to give up.
            drop(unsafe { Box::from_raw(context) });
        }
        Ok(SGN_OK)
    })
}

/// The last failure of the calling thread in this context. `info->message` is filled as far as its capacity reaches; a
/// message that does not fit gives the note TRUNCATED.
///
/// Ownership: nothing is kept. Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_context_last_error(context: *const SgnContext, info: *mut SgnErrorInfo) -> SgnResult {
    // SAFETY: the caller vouches for the pointers. Failures here do not replace the error that is asked for.
    call(|| unsafe {
        let context = context.as_ref().ok_or_else(|| Failure::null("context"))?;
        let given = structs::read(info)?;
        let mut answer = SgnErrorInfo {
            message: given.message,
            message_capacity: given.message_capacity,
            ..SgnErrorInfo::defaults()
        };
        let mut text = String::new();
        if let Some(failure) = context.shared.last_error() {
            answer.code = failure.code;
            answer.object = failure.object;
            answer.index = failure.index;
            answer.value = failure.value;
            text = failure.message;
        }
        answer.message_length = text.len() as u64;
        let whole = write_text(&text, given.message, given.message_capacity);
        structs::write(info, given.struct_size as usize, &answer);
        Ok(if whole || given.message.is_null() { SGN_OK } else { SGN_NOTE_TRUNCATED })
    })
}

/// Writes as much of `text` as fits with its zero byte, cut between characters; whether all of it did.
unsafe fn write_text(text: &str, buffer: *mut c_char, capacity: u64) -> bool {
    if buffer.is_null() || capacity == 0 {
        return false;
    }
    let mut length = text.len().min((capacity - 1).min(isize::MAX as u64) as usize);
    while !text.is_char_boundary(length) {
        length -= 1;
    }
    // SAFETY: the caller vouches for `capacity` bytes.
    unsafe {
        std::ptr::copy_nonoverlapping(text.as_ptr(), buffer.cast::<u8>(), length);
        buffer.add(length).write(0);
    }
    length == text.len()
}

/// Runs the body of an export on a context.
pub(super) unsafe fn with_context(
    context: *const SgnContext,
    function: &str,
    body: impl FnOnce(&Arc<ContextShared>) -> Status,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    match unsafe { context.as_ref() } {
        None => super::status::SGN_ERROR_NULL_ARGUMENT,
        Some(context) => {
            let shared = context.shared.clone();
            call_in(&shared, function, || body(&shared))
        }
    }
}
