//! Four single-precision boxes against one, and four numbers against one: one bit a lane.

/// Bit `i` is set where box `i` of four overlaps the query box `(low x y z, high x y z)`: all comparisons `<=`, or all
/// `<` where `STRICT`. Coordinate `k` of box `i` is `low[k][i]`, `high[k][i]`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn overlaps<const STRICT: bool>(low: &[[f32; 4]; 3], high: &[[f32; 4]; 3], query: &[f32; 6]) -> i32 {
    use std::arch::x86_64::{
        __m128, _mm_and_ps, _mm_cmple_ps, _mm_cmplt_ps, _mm_loadu_ps, _mm_movemask_ps, _mm_set1_ps,
    };
    // SAFETY: SSE2 is part of x86_64; each load reads the four numbers of an array.
    unsafe {
        let side = |k: usize| -> __m128 {
            let (l, h) = (_mm_loadu_ps(low[k].as_ptr()), _mm_loadu_ps(high[k].as_ptr()));
            let (query_low, query_high) = (_mm_set1_ps(query[k]), _mm_set1_ps(query[k + 3]));
            if STRICT {
                _mm_and_ps(_mm_cmplt_ps(l, query_high), _mm_cmplt_ps(query_low, h))
            } else {
                _mm_and_ps(_mm_cmple_ps(l, query_high), _mm_cmple_ps(query_low, h))
            }
        };
        _mm_movemask_ps(_mm_and_ps(_mm_and_ps(side(0), side(1)), side(2)))
    }
}

/// Bit `i` is set where `values[i] == key`.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn equals(values: &[u32; 4], key: u32) -> i32 {
    use std::arch::x86_64::{_mm_castsi128_ps, _mm_cmpeq_epi32, _mm_loadu_si128, _mm_movemask_ps, _mm_set1_epi32};
    // SAFETY: SSE2 is part of x86_64; the load reads the four numbers of an array.
    unsafe {
        let values = _mm_loadu_si128(values.as_ptr().cast());
        _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(values, _mm_set1_epi32(key as i32))))
    }
}

/// Bit `i` is set where box `i` of four overlaps the query box `(low x y z, high x y z)`: all comparisons `<=`, or all
/// `<` where `STRICT`. Coordinate `k` of box `i` is `low[k][i]`, `high[k][i]`.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub fn overlaps<const STRICT: bool>(low: &[[f32; 4]; 3], high: &[[f32; 4]; 3], query: &[f32; 6]) -> i32 {
    plain_overlaps::<STRICT>(low, high, query)
}

/// Bit `i` is set where `values[i] == key`.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub fn equals(values: &[u32; 4], key: u32) -> i32 {
    (0..4).map(|i| i32::from(values[i] == key) << i).sum()
}

#[cfg(any(test, not(target_arch = "x86_64")))]
fn plain_overlaps<const STRICT: bool>(low: &[[f32; 4]; 3], high: &[[f32; 4]; 3], query: &[f32; 6]) -> i32 {
    let ordered = |a: f32, b: f32| if STRICT { a < b } else { a <= b };
    let lane = |i: usize| (0..3).all(|k| ordered(low[k][i], query[k + 3]) && ordered(query[k], high[k][i]));
    (0..4).map(|i| i32::from(lane(i)) << i).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_follow_the_lanes() {
        let (low, high) = ([[0.0, 1.0, 2.0, f32::INFINITY]; 3], [[1.0, 2.0, 3.0, f32::NEG_INFINITY]; 3]);
        for (a, b, touching, strict) in [(0.5, 0.7, 1, 1), (1.0, 1.5, 3, 2), (-9.0, 9.0, 7, 7), (4.0, 5.0, 0, 0)] {
            let query = [a, a, a, b, b, b];
            assert_eq!(
                (overlaps::<false>(&low, &high, &query), overlaps::<true>(&low, &high, &query)),
                (touching, strict)
            );
            assert_eq!(plain_overlaps::<false>(&low, &high, &query), touching);
            assert_eq!(plain_overlaps::<true>(&low, &high, &query), strict);
        }
        // One axis apart is enough.
        assert_eq!(overlaps::<false>(&low, &high, &[0.5, 0.5, 4.0, 0.7, 0.7, 5.0]), 0);
        assert_eq!(equals(&[7, u32::MAX, 7, 0], 7), 0b0101);
        assert_eq!(equals(&[7, u32::MAX, 7, 0], u32::MAX), 0b0010);
    }
}
