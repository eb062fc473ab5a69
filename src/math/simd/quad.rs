//! Vectors of three f32 and one of padding in one four-lane register.
//!
//! Written with the instructions that every processor of the target has: left to itself the compiler turns such code
//! into shuffles. The plain path makes the same operations in the same order, so it gives the same bits.

use crate::math::Vec3;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

/// Three numbers, and a lane that is zero unless said otherwise.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Quad(__m128);

/// Three numbers, and a lane that is zero unless said otherwise.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct Quad([f32; 4]);

#[cfg(target_arch = "x86_64")]
impl Quad {
    /// Four lanes.
    #[inline(always)]
    pub fn new(a: [f32; 4]) -> Quad {
        // SAFETY: every x86-64 processor has SSE.
        Quad(unsafe { _mm_set_ps(a[3], a[2], a[1], a[0]) })
    }

    /// The lanes.
    #[inline(always)]
    pub fn lanes(self) -> [f32; 4] {
        let mut a = [0.0; 4];
        // SAFETY: the array holds four numbers, and no alignment is asked for.
        unsafe { _mm_storeu_ps(a.as_mut_ptr(), self.0) };
        a
    }

    /// The same number in every lane, the padding too.
    #[inline(always)]
    pub fn splat(s: f32) -> Quad {
        // SAFETY: every x86-64 processor has SSE.
        Quad(unsafe { _mm_set1_ps(s) })
    }

    /// `x[0] m[0] + x[1] m[1] + x[2] m[2]`: the product of a matrix given by its columns.
    #[inline(always)]
    pub fn combine(m: &[Quad; 3], x: Quad) -> Quad {
        // SAFETY: every x86-64 processor has SSE.
        unsafe {
            let a = _mm_mul_ps(m[0].0, _mm_shuffle_ps::<0x00>(x.0, x.0));
            let b = _mm_mul_ps(m[1].0, _mm_shuffle_ps::<0x55>(x.0, x.0));
            let c = _mm_mul_ps(m[2].0, _mm_shuffle_ps::<0xAA>(x.0, x.0));
            Quad(_mm_add_ps(_mm_add_ps(a, b), c))
        }
    }

    /// [`Self::combine`] of a matrix packed by columns; the fourth lane is not zero.
    #[inline(always)]
    pub fn combine_packed(m: &[f32; 9], x: Quad) -> Quad {
        // SAFETY: four numbers from 0, 3 and 5 on lie within the nine.
        let columns = unsafe {
            let last = _mm_loadu_ps(m.as_ptr().add(5));
            [_mm_loadu_ps(m.as_ptr()), _mm_loadu_ps(m.as_ptr().add(3)), _mm_shuffle_ps::<0xF9>(last, last)]
        };
        let [a, b, c] = columns;
        Quad::combine(&[Quad(a), Quad(b), Quad(c)], x)
    }

    /// The same with the fourth lane zero.
    #[inline(always)]
    pub fn padded(self) -> Quad {
        // SAFETY: every x86-64 processor has SSE2.
        Quad(unsafe { _mm_and_ps(self.0, _mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))) })
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl Quad {
    /// Four lanes.
    #[inline(always)]
    pub fn new(a: [f32; 4]) -> Quad {
        Quad(a)
    }

    /// The lanes.
    #[inline(always)]
    pub fn lanes(self) -> [f32; 4] {
        self.0
    }

    /// The same number in every lane, the padding too.
    #[inline(always)]
    pub fn splat(s: f32) -> Quad {
        Quad([s; 4])
    }

    /// `x[0] m[0] + x[1] m[1] + x[2] m[2]`: the product of a matrix given by its columns.
    #[inline(always)]
    pub fn combine(m: &[Quad; 3], x: Quad) -> Quad {
        (m[0] * Quad::splat(x.0[0]) + m[1] * Quad::splat(x.0[1])) + m[2] * Quad::splat(x.0[2])
    }

    /// [`Self::combine`] of a matrix packed by columns; the fourth lane is not zero.
    #[inline(always)]
    pub fn combine_packed(m: &[f32; 9], x: Quad) -> Quad {
        let columns = [[m[0], m[1], m[2], m[3]], [m[3], m[4], m[5], m[6]], [m[6], m[7], m[8], m[8]]];
        let [a, b, c] = columns;
        Quad::combine(&[Quad(a), Quad(b), Quad(c)], x)
    }

    /// The same with the fourth lane zero.
    #[inline(always)]
    pub fn padded(self) -> Quad {
        Quad([self.0[0], self.0[1], self.0[2], 0.0])
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident, $plain:tt) => {
        impl $trait for Quad {
            type Output = Quad;
            #[cfg(target_arch = "x86_64")]
            #[inline(always)]
            fn $method(self, other: Quad) -> Quad {
                // SAFETY: every x86-64 processor has SSE.
                Quad(unsafe { $instruction(self.0, other.0) })
            }
            #[cfg(not(target_arch = "x86_64"))]
            #[inline(always)]
            fn $method(self, other: Quad) -> Quad {
                Quad([0, 1, 2, 3].map(|i| self.0[i] $plain other.0[i]))
            }
        }
    };
}
operator!(Add, add, _mm_add_ps, +);
operator!(Sub, sub, _mm_sub_ps, -);
operator!(Mul, mul, _mm_mul_ps, *);

/// Whether this machine has AVX2, found out once.
#[derive(Clone, Copy, Debug, Default)]
pub struct Width(bool);

impl Width {
    /// That of this machine.
    pub fn detect() -> Width {
        #[cfg(target_arch = "x86_64")]
        return Width(std::arch::is_x86_feature_detected!("avx2"));
        #[cfg(not(target_arch = "x86_64"))]
        Width(false)
    }
}

/// `sum_k m_k x[columns[k]]` for matrices packed by columns, even and odd places summed apart; the fourth lane is not zero.
///
/// The same bits for any width: with AVX2 the two sums are the halves of one register.
#[inline(always)]
pub fn packed_row(width: Width, m: &[[f32; 9]], columns: &[u32], x: &[Quad]) -> Quad {
    #[cfg(target_arch = "x86_64")]
    if width.0 {
        // SAFETY: the machine has AVX2.
        return unsafe { packed_row_avx2(m, columns, x) };
    }
    let _ = width;
    packed_row_plain(m, columns, x)
}

#[inline(always)]
fn packed_row_plain(m: &[[f32; 9]], columns: &[u32], x: &[Quad]) -> Quad {
    let mut sums = [Quad::default(); 2];
    for (k, (m, column)) in m.iter().zip(columns).enumerate() {
        sums[k & 1] = sums[k & 1] + Quad::combine_packed(m, x[*column as usize]);
    }
    sums[0] + sums[1]
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
unsafe fn packed_row_avx2(m: &[[f32; 9]], columns: &[u32], x: &[Quad]) -> Quad {
    let mut both = _mm256_setzero_ps();
    let (pairs, last) = m.as_chunks::<2>();
    let (column_pairs, last_column) = columns.as_chunks::<2>();
    for (m, columns) in pairs.iter().zip(column_pairs) {
        let (v, w) = (x[columns[0] as usize].0, x[columns[1] as usize].0);
        let join = |a: __m128, b: __m128| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(a), b);
        // SAFETY: four numbers from 0, 3 and 5 on lie within each nine.
        let (a, b, c) = unsafe {
            let load = |at: usize| join(_mm_loadu_ps(m[0].as_ptr().add(at)), _mm_loadu_ps(m[1].as_ptr().add(at)));
            (load(0), load(3), load(5))
        };
        let (c, x) = (_mm256_permute_ps::<0xF9>(c), join(v, w));
        let a = _mm256_mul_ps(a, _mm256_permute_ps::<0x00>(x));
        let b = _mm256_mul_ps(b, _mm256_permute_ps::<0x55>(x));
        let c = _mm256_mul_ps(c, _mm256_permute_ps::<0xAA>(x));
        both = _mm256_add_ps(both, _mm256_add_ps(_mm256_add_ps(a, b), c));
    }
    let (mut even, odd) = (Quad(_mm256_castps256_ps128(both)), Quad(_mm256_extractf128_ps::<1>(both)));
    if let ([m], [column]) = (last, last_column) {
        even = even + Quad::combine_packed(m, x[*column as usize]);
    }
    even + odd
}

impl Default for Quad {
    #[inline(always)]
    fn default() -> Quad {
        Quad::splat(0.0)
    }
}

impl Quad {
    /// `s v`, rounded.
    #[inline(always)]
    pub fn round(v: Vec3, s: f64) -> Quad {
        Quad::new([(s * v[0]) as f32, (s * v[1]) as f32, (s * v[2]) as f32, 0.0])
    }

    /// `s` times the three numbers in double precision.
    #[inline(always)]
    pub fn widen(self, s: f64) -> Vec3 {
        let a = self.lanes();
        [s * f64::from(a[0]), s * f64::from(a[1]), s * f64::from(a[2])]
    }

    /// `self + s b`
    #[inline(always)]
    pub fn add_scaled(self, s: f32, b: Quad) -> Quad {
        self + b.scaled(s)
    }

    /// `s self`
    #[inline(always)]
    pub fn scaled(self, s: f32) -> Quad {
        Quad::splat(s) * self
    }

    /// The cross product.
    #[inline(always)]
    pub fn cross(self, other: Quad) -> Quad {
        let (a, b) = (self.lanes(), other.lanes());
        Quad::new([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0])
    }

    /// The sum of the lanes, in double precision.
    #[inline(always)]
    pub fn total(self) -> f64 {
        let a = self.lanes();
        (f64::from(a[0]) + f64::from(a[1])) + (f64::from(a[2]) + f64::from(a[3]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_the_same_bits_at_any_width() {
        let number = |i: usize| (f64::sin(i as f64 * 1.7) * 3.0) as f32;
        let x: Vec<Quad> = (0..9).map(|i| Quad::new([number(i), number(i + 40), number(i + 80), 0.0])).collect();
        for count in 0..9 {
            let m: Vec<[f32; 9]> = (0..count).map(|k| std::array::from_fn(|i| number(100 + 9 * k + i))).collect();
            let columns: Vec<u32> = (0..count as u32).map(|k| (k * 5) % 9).collect();
            let bits = |q: Quad| q.padded().lanes().map(f32::to_bits);
            let plain = packed_row_plain(&m, &columns, &x);
            assert_eq!(bits(packed_row(Width::detect(), &m, &columns, &x)), bits(plain));
            assert_eq!(bits(packed_row(Width(false), &m, &columns, &x)), bits(plain));
            let exact = (0..count).fold([0.0; 3], |s: [f64; 3], k| {
                let (m, v) = (&m[k], x[columns[k] as usize].lanes());
                std::array::from_fn(|r| s[r] + (0..3).map(|c| f64::from(m[3 * c + r]) * f64::from(v[c])).sum::<f64>())
            });
            assert!((0..3).all(|r| (exact[r] - f64::from(plain.lanes()[r])).abs() < 1e-4), "{exact:?}");
        }
    }

    #[test]
    fn products_with_packed_and_padded_matrices_agree_with_plain_arithmetic() {
        let m: [f32; 9] = std::array::from_fn(|i| 0.3 + (i as f32) * 1.7);
        let x = [0.7f32, -1.3, 2.9];
        let columns = [0, 1, 2].map(|c| Quad::new([m[3 * c], m[3 * c + 1], m[3 * c + 2], 0.0]));
        let v = Quad::new([x[0], x[1], x[2], 0.0]);
        let plain: [f32; 3] = std::array::from_fn(|r| (m[r] * x[0] + m[3 + r] * x[1]) + m[6 + r] * x[2]);
        for product in [Quad::combine(&columns, v), Quad::combine_packed(&m, v).padded()] {
            let [a, b, c, padding] = product.lanes();
            assert_eq!([a, b, c], plain);
            assert_eq!(padding, 0.0);
        }
        let cross = v.cross(columns[0]).lanes();
        assert!((cross[0] * x[0] + cross[1] * x[1] + cross[2] * x[2]).abs() < 1e-5);
        assert_eq!(Quad::round(v.widen(2.0), 0.5).lanes(), v.lanes());
        assert_eq!((v + v.scaled(2.0) - v.add_scaled(2.0, v)).total(), 0.0);
    }
}
