//! Eight single-precision boxes against one, eight numbers against a few, and pairs from a mask of lanes.

/// Operations on eight lanes. Masks have one bit a lane; every implementation gives the same answers.
pub trait Eight: Copy {
    /// Bit `i` is set where box `i` overlaps the query box `(low x y z, high x y z)`: all comparisons `<=`, or all `<`
    /// where `STRICT`. Coordinate `k` of box `i` is `low[k][i]`, `high[k][i]`; a lane of NaN overlaps nothing.
    fn overlaps<const STRICT: bool>(self, low: &[[f32; 8]; 3], high: &[[f32; 8]; 3], query: &[f32; 6]) -> u32;

    /// Bit `i` is set where one of `values[..][i]` equals one of the keys.
    fn any_equal<const N: usize, const M: usize>(self, values: &[[u32; 8]; N], keys: &[u32; M]) -> u32;

    /// Writes `[first, seconds[i]]` for the lanes of the mask, in their order, to the front of `out`, and anything
    /// behind; with `ASCENDING` the smaller number of each pair goes first. Returns the number of lanes.
    fn pairs<const ASCENDING: bool>(self, first: u32, seconds: &[u32; 8], mask: u32, out: &mut [[u32; 2]; 8]) -> usize;
}

/// Something to run with operations on eight lanes; `run`, and what it calls in its inner loops, should be
/// `#[inline(always)]`, so that it is compiled once per implementation.
pub trait EightKernel {
    /// What it gives.
    type Output;
    /// The work.
    fn run<E: Eight>(self, eight: E) -> Self::Output;
}

/// Runs a kernel with AVX2 where the machine has it, and with plain instructions otherwise.
#[inline]
pub fn run_eight<K: EightKernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the feature is present on this machine.
            return unsafe { avx2::run(kernel) };
        }
    }
    kernel.run(Plain)
}

/// Lane after lane.
#[derive(Clone, Copy)]
struct Plain;

impl Eight for Plain {
    #[inline(always)]
    fn overlaps<const STRICT: bool>(self, low: &[[f32; 8]; 3], high: &[[f32; 8]; 3], query: &[f32; 6]) -> u32 {
        let ordered = |a: f32, b: f32| if STRICT { a < b } else { a <= b };
        let mut mask = 0;
        for i in 0..8 {
            let mut hit = true;
            for k in 0..3 {
                hit &= ordered(low[k][i], query[k + 3]) & ordered(query[k], high[k][i]);
            }
            mask |= u32::from(hit) << i;
        }
        mask
    }

    #[inline(always)]
    fn any_equal<const N: usize, const M: usize>(self, values: &[[u32; 8]; N], keys: &[u32; M]) -> u32 {
        let mut mask = 0;
        for (row, key) in values.iter().flat_map(|row| keys.iter().map(move |key| (row, key))) {
            for i in 0..8 {
                mask |= u32::from(row[i] == *key) << i;
            }
        }
        mask
    }

    #[inline(always)]
    fn pairs<const ASCENDING: bool>(self, first: u32, seconds: &[u32; 8], mask: u32, out: &mut [[u32; 2]; 8]) -> usize {
        let mut count = 0;
        for i in (0..8).filter(|i| mask >> i & 1 == 1) {
            let second = seconds[i];
            out[count] = if ASCENDING && second < first { [second, first] } else { [first, second] };
            count += 1;
        }
        count
    }
}

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Eight, EightKernel};
    use std::arch::x86_64::*;

    /// Exists only inside [`run`], where AVX2 is present.
    #[derive(Clone, Copy)]
    pub(super) struct Avx2(());

    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn run<K: EightKernel>(kernel: K) -> K::Output {
        kernel.run(Avx2(()))
    }

    /// Lanes of each mask, front to back; the rest of a row does not matter.
    static LANES_OF: [[u8; 8]; 256] = {
        let mut table = [[0; 8]; 256];
        let mut mask = 0;
        while mask < 256 {
            let (mut lane, mut count) = (0, 0);
            while lane < 8 {
                if mask >> lane & 1 == 1 {
                    table[mask][count] = lane as u8;
                    count += 1;
                }
                lane += 1;
            }
            mask += 1;
        }
        table
    };

    impl Eight for Avx2 {
        #[inline(always)]
        fn overlaps<const STRICT: bool>(self, low: &[[f32; 8]; 3], high: &[[f32; 8]; 3], query: &[f32; 6]) -> u32 {
            // SAFETY: the token proves AVX2; each load reads the eight numbers of an array.
            unsafe {
                let mut all = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
                for k in 0..3 {
                    let (l, h) = (_mm256_loadu_ps(low[k].as_ptr()), _mm256_loadu_ps(high[k].as_ptr()));
                    let (query_low, query_high) = (_mm256_set1_ps(query[k]), _mm256_set1_ps(query[k + 3]));
                    let (a, b) = if STRICT {
                        (_mm256_cmp_ps::<_CMP_LT_OQ>(l, query_high), _mm256_cmp_ps::<_CMP_LT_OQ>(query_low, h))
                    } else {
                        (_mm256_cmp_ps::<_CMP_LE_OQ>(l, query_high), _mm256_cmp_ps::<_CMP_LE_OQ>(query_low, h))
                    };
                    all = _mm256_and_ps(all, _mm256_and_ps(a, b));
                }
                _mm256_movemask_ps(all) as u32
            }
        }

        #[inline(always)]
        fn any_equal<const N: usize, const M: usize>(self, values: &[[u32; 8]; N], keys: &[u32; M]) -> u32 {
            // SAFETY: as above.
            unsafe {
                let mut any = _mm256_setzero_si256();
                for row in values {
                    let row = _mm256_loadu_si256(row.as_ptr().cast());
                    for key in keys {
                        any = _mm256_or_si256(any, _mm256_cmpeq_epi32(row, _mm256_set1_epi32(*key as i32)));
                    }
                }
                _mm256_movemask_ps(_mm256_castsi256_ps(any)) as u32
            }
        }

        #[inline(always)]
        fn pairs<const ASCENDING: bool>(
            self,
            first: u32,
            seconds: &[u32; 8],
            mask: u32,
            out: &mut [[u32; 2]; 8],
        ) -> usize {
            // SAFETY: as above; the loads read the eight bytes of a row and the eight numbers of an array, the stores
            // write the first and the second half of the 64 bytes of `out`.
            unsafe {
                let row = &LANES_OF[(mask & 0xff) as usize];
                let lanes = _mm256_cvtepu8_epi32(_mm_loadl_epi64(row.as_ptr().cast()));
                let second = _mm256_permutevar8x32_epi32(_mm256_loadu_si256(seconds.as_ptr().cast()), lanes);
                let first = _mm256_set1_epi32(first as i32);
                let (a, b) = if ASCENDING {
                    (_mm256_min_epu32(first, second), _mm256_max_epu32(first, second))
                } else {
                    (first, second)
                };
                // Lanes 0 1 4 5 and 2 3 6 7, then put in order.
                let (even, odd) = (_mm256_unpacklo_epi32(a, b), _mm256_unpackhi_epi32(a, b));
                let halves: *mut __m256i = out.as_mut_ptr().cast();
                _mm256_storeu_si256(halves, _mm256_permute2x128_si256::<0x20>(even, odd));
                _mm256_storeu_si256(halves.add(1), _mm256_permute2x128_si256::<0x31>(even, odd));
            }
            (mask & 0xff).count_ones() as usize
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every mask and pair of one set of eight, by both implementations.
    struct Everything<'a> {
        low: &'a [[f32; 8]; 3],
        high: &'a [[f32; 8]; 3],
        numbers: &'a [u32; 8],
        query: [f32; 6],
        keys: [u32; 2],
    }

    impl EightKernel for Everything<'_> {
        type Output = (u32, u32, u32, Vec<[u32; 2]>);
        #[inline(always)]
        fn run<E: Eight>(self, eight: E) -> Self::Output {
            let mut list = Vec::new();
            for mask in 0..256 {
                let mut out = [[u32::MAX; 2]; 8];
                let count = eight.pairs::<true>(self.keys[0], self.numbers, mask, &mut out);
                list.extend(&out[..count]);
                let count = eight.pairs::<false>(self.keys[0], self.numbers, mask, &mut out);
                list.extend(&out[..count]);
            }
            (
                eight.overlaps::<false>(self.low, self.high, &self.query),
                eight.overlaps::<true>(self.low, self.high, &self.query),
                eight.any_equal(&[*self.numbers, self.numbers.map(|n| n / 2)], &self.keys),
                list,
            )
        }
    }

    #[test]
    fn bits_follow_the_lanes() {
        let row = |by: f32| [0.0, 1.0, 2.0, f32::NAN, -1.0, by, by, 1e30];
        let (low, high) = ([row(-5.0), row(-5.0), row(9.0)], [row(5.0).map(|x| x + 1.0); 3]);
        let numbers = [7, 3, u32::MAX, 0, 7, 8, 9, 1 << 31];
        let case = |a: f32, b: f32| Everything {
            low: &low,
            high: &high,
            numbers: &numbers,
            query: [a, a, a, b, b, b],
            keys: [7, 1 << 30],
        };
        for (a, b, touching, strict) in [(0.5, 0.7, 1, 1), (1.0, 1.5, 3, 2), (-9.0, 8.0, 0x17, 0x17), (1.5, 1.7, 2, 2)]
        {
            let (wide, plain) = (run_eight(case(a, b)), case(a, b).run(Plain));
            assert_eq!(wide, plain);
            assert_eq!((plain.0, plain.1), (touching, strict));
            assert_eq!(plain.2, 0b1001_0001);
        }
        // Lanes 1, 4 and 7 in order; the smaller number first.
        let mut out = [[0; 2]; 8];
        assert_eq!(Plain.pairs::<true>(7, &numbers, 0b1001_0010, &mut out), 3);
        assert_eq!(out[..3], [[3, 7], [7, 7], [7, 1 << 31]]);
        // No lane overlaps what is not a number, and NaN lanes nothing at all.
        assert_eq!(case(f32::NAN, 1.0).run(Plain).0, 0);
        assert_eq!(case(f32::NEG_INFINITY, f32::INFINITY).run(Plain).0 & 8, 0);
    }
}
