//! Closest point of an edge to a point.

use crate::math::{Vec3, add_scaled, dot, norm_squared, sub};

/// Parameter in `[0, 1]` of the point of the segment `a + t d` that is closest to the origin, and the vector from it
/// to the origin. A segment without length gives parameter 0.
#[inline(always)]
pub(super) fn closest_to_origin(a: Vec3, b: Vec3, d: Vec3) -> (f64, Vec3) {
    let length_squared = norm_squared(d);
    let t = if length_squared > 0.0 { (-dot(a, d) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    // From the nearer end, so that the error is relative to the shorter part.
    let closest = if t <= 0.5 { add_scaled(a, t, d) } else { add_scaled(b, t - 1.0, d) };
    (t, [-closest[0], -closest[1], -closest[2]])
}

/// The closest point of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointEdge {
    /// Parameter in `[0, 1]`: the closest point is `(1 - t) e0 + t e1`.
    pub t: f64,
    /// `|p - closest|^2` `[m^2]`
    pub distance_squared: f64,
    /// From the closest point to `p` `[m]`.
    pub separation: Vec3,
}

/// Closest point of the edge `e0 e1` to `p`. An edge without length is the point `e0`. Accuracy: see [`super`].
#[inline]
pub fn closest_points(p: Vec3, e0: Vec3, e1: Vec3) -> PointEdge {
    let vectors = [sub(e0, p), sub(e1, p), sub(e1, e0)];
    let scale = super::scaling::factor(super::scaling::extent(&vectors));
    let [a, b, d] = vectors.map(|v| crate::math::scale(scale, v));
    let (t, separation) = closest_to_origin(a, b, d);
    let separation = crate::math::scale(1.0 / scale, separation);
    PointEdge { t, distance_squared: norm_squared(separation), separation }
}
