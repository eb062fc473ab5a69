//! Integers of any length; short ones, which nearly all are, live without the heap.
//!
//! Schoolbook multiplication: the lengths met here are a few to a few dozen words.

use std::cmp::Ordering;

/// Words held in place: 640 bits hold everything that the cubic of an ordinary pair asks for.
const SHORT: usize = 10;

/// The magnitude, least significant word first, without leading zeros; on the heap only where it does not fit.
#[derive(Clone, Debug)]
enum Words {
    Short([u64; SHORT], usize),
    Long(Vec<u64>),
}

impl Words {
    fn zeros(len: usize) -> Words {
        if len <= SHORT { Words::Short([0; SHORT], len) } else { Words::Long(vec![0; len]) }
    }

    #[inline(always)]
    fn get(&self) -> &[u64] {
        match self {
            Words::Short(words, len) => &words[..*len],
            Words::Long(words) => words,
        }
    }

    #[inline(always)]
    fn get_mut(&mut self) -> &mut [u64] {
        match self {
            Words::Short(words, len) => &mut words[..*len],
            Words::Long(words) => words,
        }
    }

    /// Without leading zeros.
    #[inline(always)]
    fn trimmed(mut self) -> Words {
        let mut kept = self.get().len();
        while kept > 0 && self.get()[kept - 1] == 0 {
            kept -= 1;
        }
        match &mut self {
            Words::Short(_, len) => *len = kept,
            Words::Long(words) if kept > SHORT => words.truncate(kept),
            Words::Long(words) => {
                let mut short = [0; SHORT];
                short[..kept].copy_from_slice(&words[..kept]);
                return Words::Short(short, kept);
            }
        }
        self
    }
}

/// An integer.
#[derive(Clone, Debug)]
pub struct Integer {
    /// Never set for zero.
    negative: bool,
    words: Words,
}

impl Default for Integer {
    fn default() -> Self {
        Integer::ZERO
    }
}

impl From<u64> for Integer {
    #[inline]
    fn from(a: u64) -> Integer {
        let mut words = [0; SHORT];
        words[0] = a;
        Integer { negative: false, words: Words::Short(words, usize::from(a != 0)) }
    }
}

fn compare(a: &[u64], b: &[u64]) -> Ordering {
    a.len().cmp(&b.len()).then_with(|| a.iter().rev().cmp(b.iter().rev()))
}

impl Integer {
    /// 0
    pub const ZERO: Integer = Integer { negative: false, words: Words::Short([0; SHORT], 0) };

    /// -1, 0 or 1.
    #[inline]
    pub fn sign(&self) -> i32 {
        if self.words.get().is_empty() { 0 } else { 1 - 2 * i32::from(self.negative) }
    }

    /// Whether it is zero.
    #[inline]
    pub fn is_zero(&self) -> bool {
        self.words.get().is_empty()
    }

    /// `-self`
    #[inline]
    pub fn negated(mut self) -> Integer {
        self.negative = !self.negative && !self.is_zero();
        self
    }

    /// `|self|`
    #[inline]
    pub fn magnitude(mut self) -> Integer {
        self.negative = false;
        self
    }

    #[inline]
    fn sum(&self, other: &Integer, other_negative: bool) -> Integer {
        let (mut long, mut short, mut negative) = (self.words.get(), other.words.get(), self.negative);
        if self.negative == other_negative {
            if long.len() < short.len() {
                std::mem::swap(&mut long, &mut short);
            }
            return Integer { negative, words: added(long, short) };
        }
        match compare(long, short) {
            Ordering::Equal => return Integer::ZERO,
            Ordering::Less => {
                std::mem::swap(&mut long, &mut short);
                negative = other_negative;
            }
            Ordering::Greater => {}
        }
        Integer { negative, words: subtracted(long, short) }
    }

    /// `self + other`
    #[inline]
    pub fn plus(&self, other: &Integer) -> Integer {
        self.sum(other, other.negative)
    }

    /// `self - other`
    #[inline]
    pub fn minus(&self, other: &Integer) -> Integer {
        self.sum(other, !other.negative)
    }

    /// `self other`
    #[inline]
    pub fn times(&self, other: &Integer) -> Integer {
        let (a, b) = (self.words.get(), other.words.get());
        if a.is_empty() || b.is_empty() {
            return Integer::ZERO;
        }
        let mut words = Words::zeros(a.len() + b.len());
        let out = words.get_mut();
        for (i, x) in a.iter().enumerate() {
            let mut carry = 0_u128;
            for (o, y) in out[i..].iter_mut().zip(b) {
                let sum = u128::from(*x) * u128::from(*y) + u128::from(*o) + carry;
                *o = sum as u64;
                carry = sum >> 64;
            }
            out[i + b.len()] = carry as u64;
        }
        Integer { negative: self.negative != other.negative, words: words.trimmed() }
    }

    /// `self 2^k`
    pub fn shifted_up(&self, k: u64) -> Integer {
        let a = self.words.get();
        if a.is_empty() || k == 0 {
            return self.clone();
        }
        let (whole, bits) = ((k / 64) as usize, k % 64);
        let mut words = Words::zeros(a.len() + whole + 1);
        let out = &mut words.get_mut()[whole..];
        for (i, x) in a.iter().enumerate() {
            let wide = u128::from(*x) << bits;
            out[i] |= wide as u64;
            out[i + 1] = (wide >> 64) as u64;
        }
        Integer { negative: self.negative, words: words.trimmed() }
    }

    /// `self / 2^k`, rounded towards zero.
    pub fn shifted_down(&self, k: u64) -> Integer {
        let a = self.words.get();
        let (whole, bits) = ((k / 64) as usize, k % 64);
        if k == 0 || whole >= a.len() {
            return if k == 0 { self.clone() } else { Integer::ZERO };
        }
        let mut words = Words::zeros(a.len() - whole);
        for (i, o) in words.get_mut().iter_mut().enumerate() {
            let high = a.get(whole + i + 1).copied().unwrap_or(0);
            *o = ((u128::from(high) << 64 | u128::from(a[whole + i])) >> bits) as u64;
        }
        let words = words.trimmed();
        Integer { negative: self.negative && !words.get().is_empty(), words }
    }

    /// Bits of the magnitude; 0 for zero.
    pub fn bits(&self) -> u64 {
        let a = self.words.get();
        a.last().map_or(0, |top| 64 * a.len() as u64 - u64::from(top.leading_zeros()))
    }

    /// Which power of two divides it; `None` for zero.
    pub fn trailing_zeros(&self) -> Option<u64> {
        let a = self.words.get();
        a.iter().position(|x| *x != 0).map(|i| 64 * i as u64 + u64::from(a[i].trailing_zeros()))
    }

    /// The least significant word of the magnitude.
    pub fn low_word(&self) -> u64 {
        self.words.get().first().copied().unwrap_or(0)
    }

    /// Order of the magnitudes.
    pub fn compare_magnitudes(&self, other: &Integer) -> Ordering {
        compare(self.words.get(), other.words.get())
    }
}

/// `long + short`, given at least as many words in `long`.
#[inline(always)]
fn added(long: &[u64], short: &[u64]) -> Words {
    let mut words = Words::zeros(long.len() + 1);
    let out = words.get_mut();
    let mut carry = false;
    for (i, x) in long.iter().enumerate() {
        let (sum, over) = x.overflowing_add(short.get(i).copied().unwrap_or(0));
        let (sum, again) = sum.overflowing_add(u64::from(carry));
        out[i] = sum;
        carry = over | again;
    }
    out[long.len()] = u64::from(carry);
    words.trimmed()
}

/// `long - short`, given that it is not negative.
#[inline(always)]
fn subtracted(long: &[u64], short: &[u64]) -> Words {
    let mut words = Words::zeros(long.len());
    let mut borrow = false;
    for (i, o) in words.get_mut().iter_mut().enumerate() {
        let (rest, under) = long[i].overflowing_sub(short.get(i).copied().unwrap_or(0));
        let (rest, again) = rest.overflowing_sub(u64::from(borrow));
        *o = rest;
        borrow = under | again;
    }
    words.trimmed()
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::{BigInt, Sign};

    fn oracle(a: &Integer) -> BigInt {
        let digits: Vec<u32> = a.words.get().iter().flat_map(|w| [*w as u32, (*w >> 32) as u32]).collect();
        BigInt::new(if a.negative { Sign::Minus } else { Sign::Plus }, digits)
    }

    /// Lengths from none to beyond what is held in place, words of all ones and zeros among them.
    fn samples() -> Vec<Integer> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut word = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            match state >> 61 {
                0 => 0,
                1 => u64::MAX,
                _ => state,
            }
        };
        let mut samples = vec![Integer::ZERO, Integer::from(1), Integer::from(u64::MAX)];
        for len in [1, 2, 3, 4, 7, 9, 10, 11, 12, 20] {
            for _ in 0..3 {
                let mut a = Integer::ZERO;
                for _ in 0..len {
                    a = a.shifted_up(64).plus(&Integer::from(word()));
                }
                samples.push(a.clone().negated());
                samples.push(a);
            }
        }
        samples
    }

    #[test]
    fn arithmetic_agrees_with_an_independent_library() {
        let samples = samples();
        for a in &samples {
            let x = oracle(a);
            assert!(matches!(a.words, Words::Short(..)) || a.words.get().len() > SHORT);
            assert!(a.words.get().last() != Some(&0));
            assert_eq!((a.bits(), a.trailing_zeros()), (x.bits(), x.trailing_zeros()));
            for k in [0_u64, 1, 63, 64, 65, 130, 700] {
                assert_eq!(oracle(&a.shifted_up(k)), &x << k);
                let down = a.shifted_down(k);
                assert_eq!(oracle(&down), x.clone() / (BigInt::from(1) << k));
                assert_eq!(down.sign(), oracle(&down).cmp(&BigInt::ZERO) as i32);
            }
            for b in &samples {
                let y = oracle(b);
                assert_eq!(oracle(&a.plus(b)), &x + &y);
                assert_eq!(oracle(&a.minus(b)), &x - &y);
                assert_eq!(oracle(&a.times(b)), &x * &y);
                assert_eq!(a.minus(b).sign(), x.cmp(&y) as i32);
                assert_eq!(a.compare_magnitudes(b), x.magnitude().cmp(y.magnitude()));
            }
        }
    }
}
