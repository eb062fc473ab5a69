//! A root of the coplanarity cubic and contact at it, for several pairs side by side.
//!
//! Lanes do not influence each other, so a pair gives the same bits in any company.

use super::coplanarity::{CUBIC_ERROR, Frame, Point, cross};
use super::exact::Shape;
use super::motion::UNIT_ROUNDOFF;
use crate::math::simd::Lanes;

/// Evaluations of the cubic per root at most.
pub const MAX_ITERATIONS: usize = 40;

/// The reported time may be this much earlier than the exact one.
pub(super) const TIME_TOLERANCE: f64 = 1e-6;

/// Cubics in Bernstein form on [0, 1] with the rounding bound of their values.
pub(super) struct Cubic<const L: usize> {
    pub b: [Lanes<L>; 4],
    pub error: Lanes<L>,
}

/// A time interval around a root.
pub(super) struct Bracket<const L: usize> {
    pub a: Lanes<L>,
    pub b: Lanes<L>,
    /// Greater than zero where the signs of the cubic at both ends are certain.
    pub certain: Lanes<L>,
}

#[inline(always)]
fn lerp<const L: usize>(a: Lanes<L>, b: Lanes<L>, t: Lanes<L>) -> Lanes<L> {
    (Lanes::splat(1.0) - t) * a + t * b
}

impl<const L: usize> Cubic<L> {
    /// From a frame and its sizes.
    #[inline(always)]
    pub fn new(frame: &Frame<L>, sizes: &[Lanes<L>; 3]) -> Self {
        let (b, third) = (frame.cubic_times_three(&frame.normals()), Lanes::splat(1.0 / 3.0));
        let b = [b[0] * third, b[1] * third, b[2] * third, b[3] * third];
        Cubic { b, error: Lanes::splat(CUBIC_ERROR) * (sizes[0] * sizes[1] * sizes[2]) }
    }

    /// The blossom: with all arguments t the value, with l's and r's mixed the coefficients on [l, r].
    #[inline(always)]
    fn blossom(&self, s: Lanes<L>, t: Lanes<L>, u: Lanes<L>) -> Lanes<L> {
        let b = &self.b;
        let (p, q, r) = (lerp(b[0], b[1], s), lerp(b[1], b[2], s), lerp(b[2], b[3], s));
        lerp(lerp(p, q, t), lerp(q, r, t), u)
    }

    /// Value and derivative.
    #[inline(always)]
    fn at(&self, t: Lanes<L>) -> (Lanes<L>, Lanes<L>) {
        let b = &self.b;
        let (p, q, r) = (lerp(b[0], b[1], t), lerp(b[1], b[2], t), lerp(b[2], b[3], t));
        let (v, w) = (lerp(p, q, t), lerp(q, r, t));
        (lerp(v, w, t), Lanes::splat(3.0) * (w - v))
    }

    /// The coefficients on [l, r].
    #[inline(always)]
    pub fn part(&self, l: f64, r: f64) -> [Lanes<L>; 4] {
        if l == 0.0 && r == 1.0 {
            return self.b;
        }
        let (l, r) = (Lanes::splat(l), Lanes::splat(r));
        [self.blossom(l, l, l), self.blossom(l, l, r), self.blossom(l, r, r), self.blossom(r, r, r)]
    }

    /// Encloses the only root in (l, r), where the values at both ends are certain and differ in sign.
    #[inline(always)]
    pub fn bracket(&self, l: f64, r: f64, values: (Lanes<L>, Lanes<L>)) -> Bracket<L> {
        let (one, zero) = (Lanes::splat(1.0), Lanes::splat(0.0));
        let side = values.0.if_positive(one, Lanes::splat(-1.0));
        let (l, r) = (Lanes::splat(l), Lanes::splat(r));
        let (mut low, mut high) = (l, r);
        let mut t = (l + (r - l) * (values.0 / (values.0 - values.1))).max(l).min(r);
        let (mut slope, mut active) = (zero, one);
        for _ in 0..MAX_ITERATIONS {
            let (value, derivative) = self.at(t);
            slope = active.if_positive(derivative, slope);
            let step = value / derivative;
            let settled = (self.error - value.abs()).max(Lanes::splat(UNIT_ROUNDOFF) - step.abs());
            active = settled.if_positive(zero, active);
            if active.0.iter().all(|a| *a == 0.0) {
                break;
            }
            let before = value * side;
            low = before.if_positive(t, low);
            high = before.if_positive(high, t);
            let next = t - step;
            let within = (next - low).min(high - next);
            let next = within.if_positive(next, Lanes::splat(0.5) * (low + high));
            t = active.if_positive(next, t);
        }
        // Steps outwards from the approximate root until the signs are certain.
        let mut reach = Lanes::splat(2.5) * self.error / slope.abs() + Lanes::splat(2.0 * UNIT_ROUNDOFF);
        let mut bracket = Bracket { a: l, b: r, certain: zero };
        for _ in 0..4 {
            let (a, b) = ((t - reach).max(l), (t + reach).min(r));
            let certain = (self.at(a).0 * side - self.error).min(zero - self.at(b).0 * side - self.error);
            let open = bracket.certain.if_positive(zero, one);
            bracket.a = open.if_positive(a, bracket.a);
            bracket.b = open.if_positive(b, bracket.b);
            bracket.certain = open.if_positive(certain, bracket.certain);
            if bracket.certain.0.iter().all(|c| *c > 0.0) {
                break;
            }
            reach = reach * Lanes::splat(4.0);
        }
        bracket
    }
}

/// The conditions of contact at a root, with what rounding and the width of its bracket leave certain.
pub(super) struct Contact<const L: usize> {
    /// Where the normal is largest: 0, 1 or 2.
    pub axis: Lanes<L>,
    /// The sign of that component.
    pub side: Lanes<L>,
    /// Greater than zero where that component and its sign are certain.
    pub normal: Lanes<L>,
    /// The conditions, each of which must not be negative.
    pub conditions: [Lanes<L>; 4],
    /// Their errors.
    pub errors: [Lanes<L>; 4],
}

impl<const L: usize> Contact<L> {
    /// Greater than zero where there is contact for certain.
    #[inline(always)]
    pub fn inside(&self) -> Lanes<L> {
        let (c, e) = (&self.conditions, &self.errors);
        self.normal.min((c[0] - e[0]).min(c[1] - e[1]).min((c[2] - e[2]).min(c[3] - e[3])))
    }

    /// Greater than zero where there is none for certain.
    #[inline(always)]
    pub fn outside(&self) -> Lanes<L> {
        let (c, e) = (&self.conditions, &self.errors);
        let least = (c[0] + e[0]).min(c[1] + e[1]).min((c[2] + e[2]).min(c[3] + e[3]));
        self.normal.min(least.negate())
    }
}

/// The vector at time t, given at both ends.
#[inline(always)]
fn at<const L: usize>([a, b]: &[Point<L>; 2], t: Lanes<L>) -> Point<L> {
    [lerp(a[0], b[0], t), lerp(a[1], b[1], t), lerp(a[2], b[2], t)]
}

/// The component of v along the axis that [`Contact`] chooses: the third where `first` is not positive, of the others
/// the first where `second` is.
#[inline(always)]
fn pick<const L: usize>(v: &Point<L>, first: Lanes<L>, second: Lanes<L>) -> Lanes<L> {
    first.if_positive(second.if_positive(v[0], v[1]), v[2])
}

/// Contact at the root of the cubic in the bracket.
///
/// At the root the points are coplanar, so the cross products that hold the barycentric coordinates are multiples of
/// the normal, and their components along the axis where the normal is largest decide. Such a component is a sum of
/// two products of components linear in time: rounding is at most 20 u of the product of sizes, and over the bracket
/// it changes by at most `8 half-width` of it.
#[inline(always)]
pub(super) fn contact<const L: usize>(
    shape: Shape,
    frame: &Frame<L>,
    bracket: &Bracket<L>,
    sizes: &[Lanes<L>; 3],
) -> Contact<L> {
    let half = Lanes::splat(0.5);
    let t = half * (bracket.a + bracket.b);
    let (e, f, g) = (at(&frame.e, t), at(&frame.f, t), at(&frame.g, t));
    let n = cross(&e, &f);
    let (x, y, z) = (n[0].abs(), n[1].abs(), n[2].abs());
    let (first, second) = (x.max(y) - z, x - y);
    let axis = pick(&[Lanes::splat(0.0), Lanes::splat(1.0), Lanes::splat(2.0)], first, second);
    let n = pick(&n, first, second);
    let side = n.if_positive(Lanes::splat(1.0), Lanes::splat(-1.0));
    let n = n * side;
    let relative = Lanes::splat(32.0 * UNIT_ROUNDOFF) + Lanes::splat(8.0) * (half * (bracket.b - bracket.a));
    let ef = relative * (sizes[0] * sizes[1]);
    let gf = relative * (sizes[2] * sizes[1]);
    let ge = relative * (sizes[2] * sizes[0]);
    let u = pick(&cross(&g, &f), first, second) * side;
    let (conditions, errors) = match shape {
        Shape::VertexFace => {
            let v = pick(&cross(&e, &g), first, second) * side;
            ([u, v, n - u - v, n], [gf, ge, ef + gf + ge, ef])
        }
        Shape::EdgeEdge => {
            let r = pick(&cross(&g, &e), first, second) * side;
            ([u, n - u, r, n - r], [gf, ef + gf, ge, ef + ge])
        }
    };
    Contact { axis, side, normal: n - ef, conditions, errors }
}

/// First contact in `[0, t_max]` for pairs whose cubic has one change of sign for certain: the time, infinity for none,
/// NaN for a pair that this leaves open.
#[inline(always)]
pub(super) fn only_root<const L: usize>(shape: Shape, frame: &Frame<L>, t_max: f64) -> Lanes<L> {
    let sizes = frame.sizes();
    let cubic = Cubic::new(frame, &sizes);
    let b = cubic.part(0.0, t_max);
    let side = b[0].if_positive(Lanes::splat(1.0), Lanes::splat(-1.0));
    let (start, end) = (b[0] * side - cubic.error, (b[3] * side).negate() - cubic.error);
    let inner = (b[1] * side - cubic.error).max((b[2] * side).negate() - cubic.error);
    let one_change = start.min(end).min(inner);
    let product = sizes[0] * sizes[1] * sizes[2];
    let in_range = (product - Lanes::splat(1e-250)).min(Lanes::splat(1e250) - product);
    let bracket = cubic.bracket(0.0, t_max, (b[0], b[3]));
    let contact = contact(shape, frame, &bracket, &sizes);
    let usable = one_change.min(in_range).min(bracket.certain);
    let short = Lanes::splat(TIME_TOLERANCE) - (bracket.b - bracket.a);
    let open = Lanes::splat(f64::NAN);
    let miss = contact.outside().if_positive(Lanes::splat(f64::INFINITY), open);
    usable.if_positive(contact.inside().min(short).if_positive(bracket.a, miss), open)
}
