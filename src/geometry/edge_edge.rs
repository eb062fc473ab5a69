//! Closest points of two edges.

use super::{point_edge, scaling};
use crate::math::{Vec3, add_scaled, cross, dot, norm_squared, scale, sub};

/// Parts of the two edges on which the closest points lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// End 0 or 1 of `a` and end 0 or 1 of `b`.
    Vertices(u8, u8),
    /// End 0 or 1 of `a` and the inside of `b`.
    VertexEdge(u8),
    /// The inside of `a` and end 0 or 1 of `b`.
    EdgeVertex(u8),
    /// Inside both edges.
    Edges,
}

/// The closest points of two edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeEdge {
    /// Parameter in `[0, 1]` on `a`: the closest point is `(1 - s) ea0 + s ea1`.
    pub s: f64,
    /// Parameter in `[0, 1]` on `b`: the closest point is `(1 - t) eb0 + t eb1`.
    pub t: f64,
    /// `|closest_a - closest_b|^2` `[m^2]`
    pub distance_squared: f64,
    /// The closest point of `a` `[m]`; rounded to the size of its coordinates, which `separation` is not.
    pub closest_a: Vec3,
    /// The closest point of `b` `[m]`.
    pub closest_b: Vec3,
    /// From the closest point of `b` to that of `a` `[m]`.
    pub separation: Vec3,
    /// Where the closest points lie. Follows the parameters as computed.
    pub feature: Feature,
}

/// Closest parameters and the separation from `b` to `a`.
#[derive(Clone, Copy)]
struct Pair {
    distance_squared: f64,
    s: f64,
    t: f64,
    separation: Vec3,
}

/// The query by differences: `between[i][j] = eb_j - ea_i`, and the edge vectors.
struct Local {
    between: [[Vec3; 2]; 2],
    a: Vec3,
    b: Vec3,
    scale: f64,
}

impl Local {
    #[inline(always)]
    fn new(ea0: Vec3, ea1: Vec3, eb0: Vec3, eb1: Vec3) -> Local {
        let all = [sub(eb0, ea0), sub(eb1, ea0), sub(eb0, ea1), sub(eb1, ea1), sub(ea1, ea0), sub(eb1, eb0)];
        let factor = scaling::factor(scaling::extent(&all));
        let all = if factor == 1.0 { all } else { all.map(|v| scale(factor, v)) };
        Local { between: [[all[0], all[1]], [all[2], all[3]]], a: all[4], b: all[5], scale: factor }
    }

    /// The closest pair among those where one of the points is an end of its edge.
    #[inline(always)]
    fn ends(&self) -> Pair {
        let mut best = Pair { distance_squared: f64::INFINITY, s: 0.0, t: 0.0, separation: [0.0; 3] };
        for i in 0..2 {
            let (t, separation) = point_edge::closest_to_origin(self.between[i][0], self.between[i][1], self.b);
            let distance_squared = norm_squared(separation);
            if distance_squared < best.distance_squared {
                best = Pair { distance_squared, s: i as f64, t, separation };
            }
        }
        let back = scale(-1.0, self.a);
        for j in 0..2 {
            // About the end of `b`, edge `a` runs from `-between[0][j]` to `-between[1][j]`; mirrored.
            let (s, separation) = point_edge::closest_to_origin(self.between[0][j], self.between[1][j], back);
            let distance_squared = norm_squared(separation);
            if distance_squared < best.distance_squared {
                best = Pair { distance_squared, s, t: j as f64, separation };
            }
        }
        best
    }

    /// The closest pair inside both edges, if the lines are closest there.
    ///
    /// `n = a x b` is as wrong as `eps / sin(angle)`, so the solution for nearly parallel edges is refined with its
    /// own residual, kept across the edges: without that, crossing edges at an angle of 1e-8 would seem 1e-8 of
    /// their length apart.
    #[inline(always)]
    fn inside(&self) -> Option<Pair> {
        let n = cross(self.a, self.b);
        let n_squared = norm_squared(n);
        if n_squared <= 0.0 {
            return None;
        }
        let to_s = cross(self.b, n);
        let b_squared = norm_squared(self.b);
        let sine_squared = n_squared / (norm_squared(self.a) * b_squared);
        let (mut s, mut t) = (0.0, 0.0);
        let mut r = self.between[0][0];
        // Each round multiplies the error by about eps / sin(angle).
        for enough in [0.25, 1e-12, 0.0] {
            s += dot(r, to_s) / n_squared;
            let (near, ds) = if s <= 0.5 { (&self.between[0], s) } else { (&self.between[1], s - 1.0) };
            t = dot(add_scaled(scale(-1.0, near[0]), ds, self.a), self.b) / b_squared;
            r = if t <= 0.5 {
                add_scaled(add_scaled(near[0], t, self.b), -ds, self.a)
            } else {
                add_scaled(add_scaled(near[1], t - 1.0, self.b), -ds, self.a)
            };
            if sine_squared > enough {
                break;
            }
        }
        if !(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) {
            return None;
        }
        Some(Pair { distance_squared: norm_squared(r), s, t, separation: scale(-1.0, r) })
    }

    #[inline(always)]
    fn closest(&self) -> Pair {
        let best = self.ends();
        match self.inside() {
            Some(pair) if pair.distance_squared < best.distance_squared => pair,
            _ => best,
        }
    }
}

/// Closest points of the edges `ea0 ea1` and `eb0 eb1`.
///
/// An edge without length is a point. Parallel edges: one of the closest pairs with an end point. The four ends are
/// always compared with the inside, so a bad solution can never win. Accuracy: see [`super`].
#[inline]
pub fn closest_points(ea0: Vec3, ea1: Vec3, eb0: Vec3, eb1: Vec3) -> EdgeEdge {
    let local = Local::new(ea0, ea1, eb0, eb1);
    let pair = local.closest();
    let separation = scale(1.0 / local.scale, pair.separation);
    let at_end = |u: f64| u == 0.0 || u == 1.0;
    let feature = match (at_end(pair.s), at_end(pair.t)) {
        (true, true) => Feature::Vertices(pair.s as u8, pair.t as u8),
        (true, false) => Feature::VertexEdge(pair.s as u8),
        (false, true) => Feature::EdgeVertex(pair.t as u8),
        (false, false) => Feature::Edges,
    };
    EdgeEdge {
        s: pair.s,
        t: pair.t,
        distance_squared: norm_squared(separation),
        closest_a: crate::math::lerp(ea0, ea1, pair.s),
        closest_b: crate::math::lerp(eb0, eb1, pair.t),
        separation,
        feature,
    }
}

/// `|closest_a - closest_b|^2` `[m^2]` of [`closest_points`], the same number.
#[inline]
pub fn distance_squared(ea0: Vec3, ea1: Vec3, eb0: Vec3, eb1: Vec3) -> f64 {
    let local = Local::new(ea0, ea1, eb0, eb1);
    norm_squared(scale(1.0 / local.scale, local.closest().separation))
}
