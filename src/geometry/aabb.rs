//! Axis-aligned bounding boxes.

use crate::math::Vec3;

/// A closed axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner `[m]`.
    pub low: Vec3,
    /// Largest corner `[m]`.
    pub high: Vec3,
}

impl Aabb {
    /// The box of nothing: the neutral element of [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    /// The box of a point that moves on a line from `x0` to `x1`, thickened by `radius >= 0` on every side.
    ///
    /// Exact for radius 0, rounded outward otherwise: it contains the exact box.
    #[inline(always)]
    pub fn swept(x0: Vec3, x1: Vec3, radius: f64) -> Aabb {
        let mut out = Aabb::EMPTY;
        for k in 0..3 {
            (out.low[k], out.high[k]) = (x0[k].min(x1[k]), x0[k].max(x1[k]));
            if radius > 0.0 {
                // The nearest number is at most half a step too far in.
                out.low[k] = (out.low[k] - radius).next_down();
                out.high[k] = (out.high[k] + radius).next_up();
            }
        }
        out
    }

    /// The smallest box that contains both.
    #[inline]
    pub fn union(&self, other: &Aabb) -> Aabb {
        let mut out = *self;
        for k in 0..3 {
            out.low[k] = out.low[k].min(other.low[k]);
            out.high[k] = out.high[k].max(other.high[k]);
        }
        out
    }

    /// Whether the closed boxes share a point.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && other.low[k] <= self.high[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thickened_boxes_contain_the_exact_ones() {
        // 0.3 - 0.1 and 0.1 + 0.2 are rounded towards the inside by the nearest-number rule in one of the cases.
        for (x, r) in [(0.3, 0.1), (0.1, 0.2), (1e16, 1.0), (1.0, 1e-30), (-7.3, 2.6)] {
            let b = Aabb::swept([x; 3], [x; 3], r);
            // x - r < low is impossible: low + r <= x must hold even when the sum is rounded up.
            assert!(b.low[0] < x && b.high[0] > x);
            assert!(b.low[0] < x - r || x - r == f64::NEG_INFINITY);
            assert!(b.high[0] > x + r);
        }
        let b = Aabb::swept([1.0, 2.0, 3.0], [0.0, 5.0, 3.0], 0.0);
        assert_eq!(b, Aabb { low: [0.0, 2.0, 3.0], high: [1.0, 5.0, 3.0] });
    }

    #[test]
    fn touching_boxes_overlap_and_the_empty_box_overlaps_nothing() {
        let a = Aabb { low: [0.0; 3], high: [1.0; 3] };
        let b = Aabb { low: [1.0, 1.0, 1.0], high: [2.0; 3] };
        assert!(a.overlaps(&b) && b.overlaps(&a));
        assert!(!a.overlaps(&Aabb { low: [1.0_f64.next_up(), 0.0, 0.0], high: [2.0; 3] }));
        assert!(!a.overlaps(&Aabb::EMPTY));
        assert_eq!(a.union(&Aabb::EMPTY), a);
    }
}
