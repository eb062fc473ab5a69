//! Powers of two that bring a query to unit size, so that no product overflows or vanishes.

use crate::math::Vec3;

/// Largest absolute component of the vectors.
#[inline(always)]
pub(super) fn extent<const N: usize>(vectors: &[Vec3; N]) -> f64 {
    vectors.iter().fold(0.0, |m: f64, v| m.max(v[0].abs()).max(v[1].abs()).max(v[2].abs()))
}

/// The power of two by which a query of this extent is multiplied; 1 where products of four factors are harmless.
#[inline(always)]
pub(super) fn factor(extent: f64) -> f64 {
    // 2^-200 and 2^200: fourth powers stay within the normal range with room for small primitives in large queries.
    const SMALL: f64 = 6.223_015_277_861_142e-61;
    const LARGE: f64 = 1.606_938_044_258_99e60;
    if (SMALL..=LARGE).contains(&extent) || extent == 0.0 || !extent.is_finite() {
        return 1.0;
    }
    let exponent = ((extent.to_bits() >> 52) as i64 - 1023).clamp(-1022, 1022);
    f64::from_bits(((1023 - exponent) as u64) << 52)
}
