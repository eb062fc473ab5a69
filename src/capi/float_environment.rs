//! The floating-point environment: the default one while the library computes, the host's own afterwards.

/// Holds the host's environment; dropping it gives that back. Rounding to nearest, no flushing of denormals, no traps
/// while it lives: hosts run with flush-to-zero, and the same inputs must give the same bits.
pub(super) struct DefaultFloatEnvironment {
    #[cfg(target_arch = "x86_64")]
    saved: u32,
    #[cfg(target_arch = "aarch64")]
    saved: u64,
}

/// Round to nearest, all exceptions masked, denormals kept: the state a process starts in.
#[cfg(target_arch = "x86_64")]
const DEFAULT_MXCSR: u32 = 0x1f80;

#[cfg(target_arch = "x86_64")]
fn load(value: u32) {
    // SAFETY: reads four bytes at a valid address into MXCSR; no reserved bit is set in what we load.
    unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &value, options(nostack, readonly)) }
}

impl DefaultFloatEnvironment {
    /// Saves the environment of the calling thread and sets the default one.
    #[cfg(target_arch = "x86_64")]
    pub fn enter() -> DefaultFloatEnvironment {
        let mut saved = 0u32;
        // SAFETY: writes four bytes to a valid address.
        unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut saved, options(nostack)) }
        load(DEFAULT_MXCSR);
        DefaultFloatEnvironment { saved }
    }

    /// Saves the environment of the calling thread and sets the default one.
    #[cfg(target_arch = "aarch64")]
    pub fn enter() -> DefaultFloatEnvironment {
        let saved: u64;
        // SAFETY: reads and writes the floating-point control register only.
        unsafe {
            std::arch::asm!("mrs {}, fpcr", out(reg) saved, options(nomem, nostack));
            std::arch::asm!("msr fpcr, {}", in(reg) 0u64, options(nomem, nostack));
        }
        DefaultFloatEnvironment { saved }
    }

    /// On other processors the environment is left as it is.
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    pub fn enter() -> DefaultFloatEnvironment {
        DefaultFloatEnvironment {}
    }
}

impl Drop for DefaultFloatEnvironment {
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        load(self.saved);
        #[cfg(target_arch = "aarch64")]
        // SAFETY: puts back what was read.
        unsafe {
            std::arch::asm!("msr fpcr, {}", in(reg) self.saved, options(nomem, nostack));
        }
    }
}
