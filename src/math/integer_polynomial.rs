//! Polynomials with integer coefficients: exact isolation of their roots in [0, 1], and exact signs at these roots.
//!
//! Doubles are integers times a power of two, so a question about doubles that is polynomial in time can be decided
//! with these and no rounding. Meant for the rare cases that floating-point filters leave open.

use super::Integer;
use std::cmp::Ordering;

/// Coefficients of a cubic.
const MAX_LEN: usize = 4;

/// A polynomial of degree three at most, coefficients in ascending order, the last one not zero.
#[derive(Clone, Debug, Default)]
pub struct IntegerPolynomial {
    coefficients: [Integer; MAX_LEN],
    /// Degree + 1, or 0 for the zero polynomial; zeros follow.
    len: usize,
}

impl IntegerPolynomial {
    /// From coefficients in ascending order, four at most.
    pub fn new<const N: usize>(coefficients: [Integer; N]) -> IntegerPolynomial {
        const { assert!(N <= MAX_LEN) };
        let mut given = coefficients.into_iter();
        IntegerPolynomial::trimmed(std::array::from_fn(|_| given.next().unwrap_or_default()))
    }

    fn trimmed(coefficients: [Integer; MAX_LEN]) -> IntegerPolynomial {
        let len = coefficients.iter().rposition(|c| !c.is_zero()).map_or(0, |i| i + 1);
        IntegerPolynomial { coefficients, len }
    }

    fn get(&self) -> &[Integer] {
        &self.coefficients[..self.len]
    }

    /// Whether all coefficients are zero.
    pub fn is_zero(&self) -> bool {
        self.len == 0
    }

    fn derivative(&self) -> Self {
        let mut d = IntegerPolynomial::default();
        for (i, c) in self.get().iter().enumerate().skip(1) {
            d.coefficients[i - 1] = c.times(&Integer::from(i as u64));
        }
        d.len = self.len.saturating_sub(1);
        d
    }

    /// Divided by the largest power of two that divides every coefficient: keeps remainder sequences short.
    fn without_powers_of_two(mut self) -> Self {
        let shift = self.get().iter().filter_map(Integer::trailing_zeros).min().unwrap_or(0);
        if shift > 0 {
            for c in &mut self.coefficients[..self.len] {
                *c = c.shifted_down(shift);
            }
        }
        self
    }

    /// A positive multiple of the remainder of `self` by `divisor`, which is not zero, and the same multiple of the
    /// quotient.
    fn pseudo_divide(&self, divisor: &Self) -> (Self, Self) {
        let lead = &divisor.coefficients[divisor.len - 1];
        let negative = lead.sign() < 0;
        let magnitude = lead.clone().magnitude();
        let mut rest = self.clone();
        let mut quotient = IntegerPolynomial::default();
        while rest.len >= divisor.len {
            let shift = rest.len - divisor.len;
            rest.len -= 1;
            let top = std::mem::take(&mut rest.coefficients[rest.len]);
            if top.is_zero() {
                continue;
            }
            let factor = if negative { top.negated() } else { top };
            for c in rest.coefficients[..rest.len].iter_mut().chain(&mut quotient.coefficients) {
                *c = c.times(&magnitude);
            }
            for (i, c) in divisor.coefficients[..divisor.len - 1].iter().enumerate() {
                let r = &mut rest.coefficients[i + shift];
                *r = r.minus(&factor.times(c));
            }
            quotient.coefficients[shift] = quotient.coefficients[shift].plus(&factor);
        }
        (IntegerPolynomial::trimmed(rest.coefficients), IntegerPolynomial::trimmed(quotient.coefficients))
    }

    fn remainder(&self, divisor: &Self) -> Self {
        self.pseudo_divide(divisor).0.without_powers_of_two()
    }

    /// Greatest common divisor up to a constant factor; neither argument zero.
    fn common_divisor(&self, other: &Self) -> Self {
        let (mut a, mut b) = (self.clone(), other.clone());
        while !b.is_zero() {
            let r = a.remainder(&b);
            a = std::mem::replace(&mut b, r);
        }
        a
    }

    /// The polynomial with the same roots, each simple, up to a positive or negative factor; not for zero.
    fn square_free(&self) -> Self {
        let derivative = self.derivative();
        if derivative.is_zero() {
            return self.clone();
        }
        let repeated = self.common_divisor(&derivative);
        if repeated.len == 1 {
            return self.clone();
        }
        self.pseudo_divide(&repeated).1.without_powers_of_two()
    }

    /// `p(n / 2^k) 2^(k degree)`: the value with its sign, as an integer.
    fn value_at(&self, n: &Integer, k: u64) -> Integer {
        let mut coefficients = self.get().iter().rev();
        let Some(mut value) = coefficients.next().cloned() else { return Integer::ZERO };
        for (power, c) in coefficients.enumerate() {
            value = value.times(n).plus(&c.shifted_up(k * (power as u64 + 1)));
        }
        value
    }

    fn sign_at(&self, n: &Integer, k: u64) -> i32 {
        self.value_at(n, k).sign()
    }

    /// Changes of sign among the Bernstein coefficients on [0, 1], and the signs at both ends: no change means no root
    /// inside, one means one root, a simple one.
    fn sign_changes_of_bernstein_form(&self) -> (usize, i32, i32) {
        let c = &self.coefficients;
        let times = |c: &Integer, k: u64| c.times(&Integer::from(k));
        let end = c[0].plus(&c[1]).plus(&c[2]).plus(&c[3]);
        let inner = match self.len {
            4 => {
                let three = times(&c[0], 3);
                [three.plus(&c[1]).sign(), three.plus(&times(&c[1], 2)).plus(&c[2]).sign()]
            }
            3 => [times(&c[0], 2).plus(&c[1]).sign(), 0],
            _ => [0, 0],
        };
        let (low, high) = (c[0].sign(), end.sign());
        let (mut changes, mut last) = (0, low);
        for s in [inner[0], inner[1], high] {
            if s != 0 {
                changes += usize::from(last != 0 && s != last);
                last = s;
            }
        }
        (changes, low, high)
    }

    /// The roots in [0, 1] in ascending order, each once; none for the zero polynomial.
    ///
    /// Cost: Bernstein coefficients; where these leave it open, Sturm's sequence of the square-free part and one
    /// evaluation of it per halving; the number of halvings is bounded by the separation of the roots, a polynomial in
    /// the length of the coefficients.
    pub fn roots_in_unit_interval(&self) -> Vec<Root> {
        let mut roots = Vec::new();
        if self.len < 2 {
            return roots;
        }
        let mut rest = self.clone().without_powers_of_two();
        if rest.coefficients[0].is_zero() {
            roots.push(Root::rational(Integer::ZERO, 0));
            let zeros = rest.get().iter().take_while(|c| c.is_zero()).count();
            rest.coefficients.rotate_left(zeros);
            rest.len -= zeros;
        }
        if rest.len < 2 {
            return roots;
        }
        let (changes, sign_low, sign_high) = rest.sign_changes_of_bernstein_form();
        if changes == 0 && sign_high != 0 {
            return roots;
        }
        if changes == 1 && sign_high != 0 {
            roots.push(Root { n: Integer::ZERO, k: 0, inside: Some((rest, sign_low)) });
            return roots;
        }
        let simple = rest.square_free();
        let sequence = simple.sturm_sequence();
        let zero = Integer::ZERO;
        let ends = (variations(&sequence, &zero, 0), variations(&sequence, &Integer::from(1), 0));
        isolate(&simple, &sequence, zero, 0, ends, &mut roots);
        roots
    }

    fn sturm_sequence(&self) -> Vec<IntegerPolynomial> {
        let mut sequence = vec![self.clone(), self.derivative()];
        while sequence[sequence.len() - 1].len > 1 {
            let m = sequence.len();
            let mut next = sequence[m - 2].remainder(&sequence[m - 1]);
            next.coefficients = next.coefficients.map(Integer::negated);
            sequence.push(next);
        }
        sequence
    }
}

fn variations(sequence: &[IntegerPolynomial], n: &Integer, k: u64) -> usize {
    let (mut count, mut last) = (0, 0);
    for p in sequence {
        let s = p.sign_at(n, k);
        if s != 0 {
            count += usize::from(last != 0 && s != last);
            last = s;
        }
    }
    count
}

/// Roots of `p` in `(n / 2^k, (n + 1) / 2^k]`, given the variations of its Sturm sequence at both ends.
fn isolate(
    p: &IntegerPolynomial,
    sequence: &[IntegerPolynomial],
    n: Integer,
    k: u64,
    ends: (usize, usize),
    roots: &mut Vec<Root>,
) {
    if ends.0 <= ends.1 {
        return;
    }
    if ends.0 - ends.1 == 1 {
        let next = n.plus(&Integer::from(1));
        if p.sign_at(&next, k) == 0 {
            roots.push(Root::rational(next, k));
            return;
        }
        let sign_low = p.sign_at(&n, k);
        if sign_low != 0 {
            roots.push(Root { n, k, inside: Some((p.clone(), sign_low)) });
            return;
        }
    }
    let low = n.shifted_up(1);
    let middle = low.plus(&Integer::from(1));
    let at_middle = variations(sequence, &middle, k + 1);
    isolate(p, sequence, low, k + 1, (ends.0, at_middle), roots);
    isolate(p, sequence, middle, k + 1, (at_middle, ends.1), roots);
}

/// A root in [0, 1]: a dyadic number exactly, or the only root of a polynomial inside a dyadic interval, a simple one.
#[derive(Clone, Debug)]
pub struct Root {
    n: Integer,
    k: u64,
    /// Polynomial and its sign at the lower end; `None` when the root is `n / 2^k` itself. Otherwise the root lies in
    /// the open interval from `n / 2^k` to `(n + 1) / 2^k`.
    inside: Option<(IntegerPolynomial, i32)>,
}

impl Root {
    /// `n / 2^k` itself.
    pub fn rational(n: Integer, k: u64) -> Root {
        Root { n, k, inside: None }
    }

    /// A double in [0, 1], exactly. `None` for others.
    pub fn from_double(t: f64) -> Option<Root> {
        if !(0.0..=1.0).contains(&t) {
            return None;
        }
        let (mantissa, exponent) = decompose(t);
        Some(Root::rational(Integer::from(mantissa), u64::from(exponent.unsigned_abs())))
    }

    /// The only root of `p` inside the dyadic interval around a bracket of doubles `(a, b)`, `0 <= l <= a < b <= r <= 1`,
    /// given that it is the only one in `[l, r]`, and simple. `None` where that interval does not fit into `[l, r]`.
    pub fn in_bracket(p: IntegerPolynomial, (l, r): (f64, f64), (a, b): (f64, f64)) -> Option<Root> {
        // Wider than the bracket, so that it meets at most two cells; at most 52 bits, so that doubles hold the ends.
        let k = (-(b - a).log2().ceil() - 1.0).clamp(0.0, 52.0);
        let cells = 2.0_f64.powi(k as i32);
        let mut n = (a * cells).floor();
        let k = k as u64;
        let middle = n + 1.0;
        if b * cells > middle {
            let (low, high) = (p.sign_at(&Integer::from(n as u64), k), p.sign_at(&Integer::from(middle as u64), k));
            if high == 0 {
                return Some(Root::rational(Integer::from(middle as u64), k));
            }
            if low == high {
                n = middle;
            }
        }
        if n < l * cells || n + 1.0 > r * cells {
            return None;
        }
        let (n, next) = (Integer::from(n as u64), Integer::from(n as u64 + 1));
        let (low, high) = (p.sign_at(&n, k), p.sign_at(&next, k));
        if low == 0 {
            return Some(Root::rational(n, k));
        }
        if high == 0 {
            return Some(Root::rational(next, k));
        }
        (low != high).then_some(Root { n, k, inside: Some((p, low)) })
    }

    /// The upper end of the interval, times `2^k`.
    fn upper(&self) -> Integer {
        self.n.plus(&Integer::from(1))
    }

    /// Shortens the interval to a width of `2^-bits` or less: by several bits at once where the secant predicts the
    /// part that holds the root, by halving otherwise.
    pub fn refine(&mut self, bits: u64) {
        let mut step = 4;
        while self.k < bits && self.inside.is_some() {
            if self.skip(u64::min(step, bits - self.k)) {
                step = u64::min(2 * step, 48);
            } else {
                self.halve();
                step = 2;
            }
        }
    }

    /// Tries to add `j` bits at once.
    fn skip(&mut self, j: u64) -> bool {
        let Some((p, sign_low)) = &self.inside else { return true };
        if j < 2 {
            return false;
        }
        let next = self.upper();
        let ratio = magnitude_ratio(&p.value_at(&self.n, self.k), &p.value_at(&next, self.k));
        let parts = 1_u64 << j;
        let part = ((ratio * parts as f64) as u64).min(parts - 1);
        let (low, k) = (self.n.shifted_up(j).plus(&Integer::from(part)), self.k + j);
        let high = low.plus(&Integer::from(1));
        let at_low = if part == 0 { *sign_low } else { p.sign_at(&low, k) };
        let at_high = if part == parts - 1 { -*sign_low } else { p.sign_at(&high, k) };
        if at_low == 0 || at_high == 0 {
            *self = Root::rational(if at_low == 0 { low } else { high }, k);
            return true;
        }
        if at_low != *sign_low || at_high == *sign_low {
            return false;
        }
        (self.n, self.k) = (low, k);
        true
    }

    fn halve(&mut self) {
        let Some((p, sign_low)) = &self.inside else { return };
        let low = self.n.shifted_up(1);
        let middle = low.plus(&Integer::from(1));
        let s = p.sign_at(&middle, self.k + 1);
        self.k += 1;
        if s == 0 {
            self.n = middle;
            self.inside = None;
        } else {
            self.n = if s == *sign_low { middle } else { low };
        }
    }

    /// The exact sign of `g` at the root.
    ///
    /// The interval is refined until g cannot vanish on it; where it does not help, a common divisor with the root's
    /// polynomial decides whether g is zero there. Ends, since a g that is not zero at the root is bounded away from
    /// zero there by a bound on resultants.
    pub fn sign_of(&mut self, g: &IntegerPolynomial) -> i32 {
        if g.len < 2 {
            return g.coefficients[0].sign();
        }
        let slope = g
            .get()
            .iter()
            .enumerate()
            .skip(1)
            .fold(Integer::ZERO, |sum, (i, c)| sum.plus(&c.clone().magnitude().times(&Integer::from(i as u64))));
        let degree = g.len as u64 - 1;
        let mut tested = false;
        loop {
            let value = g.value_at(&self.n, self.k);
            let Some((p, _)) = &self.inside else { return value.sign() };
            // On the interval g changes by at most `slope 2^-k`; the value carries the factor `2^(k degree)`.
            if value.compare_magnitudes(&slope.shifted_up(self.k * (degree - 1))).is_gt() {
                return value.sign();
            }
            if !tested && self.k >= 32 {
                tested = true;
                let common = p.common_divisor(g);
                let next = self.upper();
                if common.len > 1 && common.sign_at(&self.n, self.k) * common.sign_at(&next, self.k) < 0 {
                    return 0;
                }
            }
            let bits = (2 * self.k).max(16);
            self.refine(bits);
        }
    }

    /// Order of the lower ends of the present intervals.
    pub fn order_of_lower_ends(&self, other: &Root) -> Ordering {
        self.n.shifted_up(other.k).compare_magnitudes(&other.n.shifted_up(self.k))
    }

    /// Whether the root is greater than the double `t` in [0, 1].
    pub fn is_above(&mut self, t: f64) -> bool {
        let (mantissa, exponent) = decompose(t);
        // g(x) = 2^e x - m has the sign of x - t.
        let g = IntegerPolynomial::new([
            Integer::from(mantissa).negated(),
            Integer::from(1).shifted_up(exponent.unsigned_abs().into()),
        ]);
        self.sign_of(&g) > 0
    }

    /// The largest double that is certainly not above the root, within `2^-64` of it plus rounding.
    pub fn lower_double(&mut self) -> f64 {
        self.refine(64);
        let excess = self.n.bits().saturating_sub(53);
        // Cutting bits rounds towards zero.
        let mantissa = self.n.shifted_down(excess).low_word() as f64;
        scale_by_power_of_two(mantissa, excess as i64 - self.k as i64)
    }
}

/// About `|a| / (|a| + |b|)`.
fn magnitude_ratio(a: &Integer, b: &Integer) -> f64 {
    let shift = a.bits().max(b.bits()).saturating_sub(62);
    let top = |x: &Integer| x.shifted_down(shift).low_word() as f64;
    top(a) / (top(a) + top(b)).max(1.0)
}

/// `a 2^e`, rounded towards zero where subnormal, for `0 <= a < 2^53`.
fn scale_by_power_of_two(a: f64, e: i64) -> f64 {
    if e < -1074 - 53 {
        return 0.0;
    }
    if e >= -1022 {
        return a * 2.0_f64.powi(e.min(1023) as i32);
    }
    // Subnormal results keep fewer bits: cut them before scaling.
    let cut = (-1074 - e).max(0) as u32;
    let kept = if cut > 53 { 0 } else { (a as u64) >> cut };
    f64::from_bits(kept) * if e > -1074 { 2.0_f64.powi((e + 1074) as i32) } else { 1.0 }
}

/// `(m, e)` with `|a| = m 2^e`, m odd or zero, for finite a; for `|a| < 2`, e is not above zero when m is odd and not 1.
pub(crate) fn decompose(a: f64) -> (u64, i32) {
    let bits = a.to_bits();
    let biased = ((bits >> 52) & 0x7ff) as i32;
    let fraction = bits & ((1 << 52) - 1);
    let (mantissa, exponent) = if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) };
    if mantissa == 0 {
        return (0, 0);
    }
    let zeros = mantissa.trailing_zeros();
    (mantissa >> zeros, exponent + zeros as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial<const N: usize>(c: [i64; N]) -> IntegerPolynomial {
        IntegerPolynomial::new(c.map(|c| {
            let magnitude = Integer::from(c.unsigned_abs());
            if c < 0 { magnitude.negated() } else { magnitude }
        }))
    }

    #[test]
    fn roots_are_found_once_each_and_in_order() {
        // (2t - 1)^2 (3t - 1): 1/3 and 1/2.
        let p = polynomial([-1, 7, -16, 12]);
        let mut roots = p.roots_in_unit_interval();
        assert_eq!(roots.len(), 2);
        let values: Vec<f64> = roots.iter_mut().map(Root::lower_double).collect();
        assert!(values[0] <= 1.0 / 3.0 && values[0] > 1.0 / 3.0 - 1e-15);
        assert_eq!(values[1], 0.5);
        // t (t - 1) (t - 2): the closed interval counts, beyond does not.
        let p = polynomial([0, 2, -3, 1]);
        let values: Vec<f64> = p.roots_in_unit_interval().iter_mut().map(Root::lower_double).collect();
        assert_eq!(values, [0.0, 1.0]);
        assert!(polynomial([1, 0, 1]).roots_in_unit_interval().is_empty());
        assert!(IntegerPolynomial::default().roots_in_unit_interval().is_empty());
    }

    #[test]
    fn signs_at_irrational_roots_are_exact() {
        // 2t^2 - 1 at sqrt(1/2); g = (2t^2 - 1)(t + 3) vanishes there, 10^18-fold close rationals do not.
        let mut root = polynomial([-1, 0, 2]).roots_in_unit_interval().remove(0);
        assert_eq!(root.sign_of(&polynomial([-3, -1, 6, 2])), 0);
        let (below, above) = (707_106_781_186_547_524_i64, 707_106_781_186_547_525_i64);
        assert_eq!(root.sign_of(&polynomial([-below, 1_000_000_000_000_000_000])), 1);
        assert_eq!(root.sign_of(&polynomial([-above, 1_000_000_000_000_000_000])), -1);
        assert!(root.is_above(std::f64::consts::FRAC_1_SQRT_2.next_down()));
        assert!(!root.is_above(std::f64::consts::FRAC_1_SQRT_2.next_up()));
        assert_eq!(root.lower_double(), 0.707_106_781_186_547_5_f64.next_down().max(root.lower_double()));
    }

    #[test]
    fn doubles_are_taken_apart_exactly() {
        for a in [1.0, 0.75, 1e-310, 5e-324, 1e300, 0.1] {
            let (m, e) = decompose(a);
            assert_eq!(m as f64 * 2.0_f64.powi(e / 2) * 2.0_f64.powi(e - e / 2), a);
        }
        assert_eq!(decompose(0.0), (0, 0));
    }
}
