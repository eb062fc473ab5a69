//! A few numbers side by side, and running one kernel with the widest instructions the machine has.
//!
//! The operations are the same ones in the same order on every path and there is no fused multiply-add, so a kernel
//! gives the same bits on every machine.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What a lane holds: single or double precision.
pub trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
}

impl Number for f64 {
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
}

impl Number for f32 {
    const ZERO: f32 = 0.0;
    const ONE: f32 = 1.0;
    #[inline(always)]
    fn abs(self) -> f32 {
        f32::abs(self)
    }
    #[inline(always)]
    fn sqrt(self) -> f32 {
        f32::sqrt(self)
    }
}

/// `N` independent numbers, doubles unless said otherwise; all operations go lane by lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<const N: usize, T = f64>(pub [T; N]);

impl<const N: usize, T: Number> Lanes<N, T> {
    /// The same value in every lane.
    #[inline(always)]
    pub fn splat(a: T) -> Self {
        Lanes([a; N])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = self.0;
        for i in 0..N {
            out[i] = f(out[i], other.0[i]);
        }
        Lanes(out)
    }

    // Loops by index: adapters of the standard library are not always inlined, and then lose the wide instructions.
    #[inline(always)]
    fn map(self, f: impl Fn(T) -> T) -> Self {
        let mut out = self.0;
        for i in 0..N {
            out[i] = f(out[i]);
        }
        Lanes(out)
    }

    /// The smaller of two, lane by lane; the second where one is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    /// The greater of two, lane by lane; the second where one is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(T::abs)
    }

    /// Square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(T::sqrt)
    }

    /// `a` where this is greater than zero, `b` elsewhere, also where it is NaN.
    #[inline(always)]
    pub fn if_positive(self, a: Self, b: Self) -> Self {
        let mut out = b.0;
        for i in 0..N {
            out[i] = if self.0[i] > T::ZERO { a.0[i] } else { out[i] };
        }
        Lanes(out)
    }

    /// Negated values.
    #[inline(always)]
    pub fn negate(self) -> Self {
        self.map(|a| -a)
    }
}

impl<const N: usize, T: Number> Add for Lanes<N, T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const N: usize, T: Number> Sub for Lanes<N, T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const N: usize, T: Number> Mul for Lanes<N, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const N: usize, T: Number> Div for Lanes<N, T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}

/// Something to run with wide instructions; `run` should be `#[inline(always)]`, so that it is compiled once per path.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// The work.
    fn run(self) -> Self::Output;
}

/// Runs a kernel compiled for AVX2 where the machine has it, and for the build's target otherwise.
#[inline]
pub fn run_wide<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the feature is present on this machine.
            return unsafe { run_avx2(kernel) };
        }
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sums<'a>(&'a [Lanes<4>]);

    impl Kernel for Sums<'_> {
        type Output = Lanes<4>;
        #[inline(always)]
        fn run(self) -> Lanes<4> {
            self.0.iter().fold(Lanes::splat(0.0), |s, a| s + *a * *a - a.abs().sqrt().min(s.max(*a)))
        }
    }

    #[test]
    fn wide_and_plain_paths_give_the_same_bits() {
        let data: Vec<Lanes<4>> =
            (0..1000).map(|i| Lanes([0, 1, 2, 3].map(|l| f64::sin((4 * i + l) as f64)))).collect();
        let (wide, plain) = (run_wide(Sums(&data)), Sums(&data).run());
        assert_eq!(wide.0.map(f64::to_bits), plain.0.map(f64::to_bits));
    }
}
