//! Processor time of the calling thread: what a measurement on a busy machine can go by.

/// Seconds of processor time that the calling thread has used.
pub fn thread_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // The call only writes to `time`.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(status, 0, "a thread clock");
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
