//! Comparisons of four single-precision numbers at once, one bit a lane; the same answer on every processor.

/// Bit `k` is set where `a[k] <= b[k]`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn at_most(a: &[f32; 4], b: &[f32; 4]) -> i32 {
    use std::arch::x86_64::{_mm_cmple_ps, _mm_loadu_ps, _mm_movemask_ps};
    // SAFETY: SSE2 is part of x86_64; each load reads the four numbers of an array.
    unsafe { _mm_movemask_ps(_mm_cmple_ps(_mm_loadu_ps(a.as_ptr()), _mm_loadu_ps(b.as_ptr()))) }
}

/// Bit `k` is set where `a[k] < b[k]`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn below(a: &[f32; 4], b: &[f32; 4]) -> i32 {
    use std::arch::x86_64::{_mm_cmplt_ps, _mm_loadu_ps, _mm_movemask_ps};
    // SAFETY: SSE2 is part of x86_64; each load reads the four numbers of an array.
    unsafe { _mm_movemask_ps(_mm_cmplt_ps(_mm_loadu_ps(a.as_ptr()), _mm_loadu_ps(b.as_ptr()))) }
}

/// Bit `k` is set where `a[k] <= b[k]`.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub fn at_most(a: &[f32; 4], b: &[f32; 4]) -> i32 {
    (0..4).map(|k| i32::from(a[k] <= b[k]) << k).sum()
}

/// Bit `k` is set where `a[k] < b[k]`.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub fn below(a: &[f32; 4], b: &[f32; 4]) -> i32 {
    (0..4).map(|k| i32::from(a[k] < b[k]) << k).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_follow_the_lanes() {
        let (a, b) = ([1.0, 2.0, f32::NAN, f32::NEG_INFINITY], [1.0, 3.0, 0.0, f32::INFINITY]);
        assert_eq!((at_most(&a, &b), below(&a, &b)), (0b1011, 0b1010));
        assert_eq!((at_most(&b, &a), below(&b, &a)), (0b0001, 0b0000));
    }
}
