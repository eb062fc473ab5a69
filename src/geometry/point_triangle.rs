//! Closest point of a triangle to a point.

use super::{point_edge, scaling};
use crate::math::{Vec3, add_scaled, dot, norm_squared, scale, sub};

/// Part of the triangle on which the closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// Vertex 0, 1 or 2.
    Vertex(u8),
    /// Inside edge 0 (`t0 t1`), 1 (`t1 t2`) or 2 (`t2 t0`).
    Edge(u8),
    /// Inside the triangle.
    Face,
}

/// The closest point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTriangle {
    /// Weights of `t0 t1 t2`: not negative, sum one.
    pub barycentrics: [f64; 3],
    /// `|p - closest|^2` `[m^2]`
    pub distance_squared: f64,
    /// The closest point `[m]`; rounded to the size of its coordinates, which `separation` is not.
    pub closest: Vec3,
    /// From the closest point to `p` `[m]`.
    pub separation: Vec3,
    /// Where the closest point lies. Follows the weights as computed.
    pub feature: Feature,
}

/// The query about the point as origin: corners and edges.
struct Local {
    corners: [Vec3; 3],
    edges: [Vec3; 3],
    scale: f64,
}

impl Local {
    #[inline(always)]
    fn new(p: Vec3, t: [Vec3; 3]) -> Local {
        let corners = t.map(|c| sub(c, p));
        let edges = [sub(t[1], t[0]), sub(t[2], t[1]), sub(t[0], t[2])];
        let all = [corners[0], corners[1], corners[2], edges[0], edges[1], edges[2]];
        let factor = scaling::factor(scaling::extent(&all));
        if factor == 1.0 {
            return Local { corners, edges, scale: 1.0 };
        }
        Local { corners: corners.map(|c| scale(factor, c)), edges: edges.map(|e| scale(factor, e)), scale: factor }
    }

    /// Weights and separation of the closest point inside the triangle, if the point projects into it.
    ///
    /// In the frame of the longest edge: the parameter along it is accurate for any triangle, and the direction
    /// across is as accurate as the data allow; an error in it moves the result within the triangle only.
    #[inline(always)]
    fn interior(&self) -> Option<([f64; 3], Vec3)> {
        let lengths = self.edges.map(norm_squared);
        let k = if lengths[0] >= lengths[1] && lengths[0] >= lengths[2] {
            0
        } else if lengths[1] >= lengths[2] {
            1
        } else {
            2
        };
        let (i0, i1, i2) = (k, (k + 1) % 3, (k + 2) % 3);
        let (base, length_squared) = (self.edges[i0], lengths[i0]);
        if length_squared <= 0.0 {
            return None;
        }
        let (a, to_apex) = (self.corners[i0], scale(-1.0, self.edges[i2]));
        let apex = dot(to_apex, base) / length_squared;
        let height = add_scaled(to_apex, -apex, base);
        let height_squared = norm_squared(height);
        if height_squared <= 0.0 {
            return None;
        }
        let along = -dot(a, base) / length_squared;
        let rest = add_scaled([-a[0], -a[1], -a[2]], -along, base);
        let w2 = dot(rest, height) / height_squared;
        let w1 = along - w2 * apex;
        let w0 = 1.0 - w1 - w2;
        if !(w0 > 0.0 && w1 > 0.0 && w2 > 0.0) {
            return None;
        }
        let mut weights = [0.0; 3];
        (weights[i0], weights[i1], weights[i2]) = (w0, w1, w2);
        let closest = add_scaled(add_scaled(a, w1, base), w2, to_apex);
        Some((weights, [-closest[0], -closest[1], -closest[2]]))
    }
}

/// Closest point of the triangle `t0 t1 t2` to `p`.
///
/// A triangle without area is the union of its edges, an edge without length a point. Every edge is compared with the
/// interior, so a bad projection can never win. Accuracy: see [`super`].
#[inline]
pub fn closest_points(p: Vec3, t0: Vec3, t1: Vec3, t2: Vec3) -> PointTriangle {
    let local = Local::new(p, [t0, t1, t2]);
    let mut best = (f64::INFINITY, 0, 0.0, [0.0; 3]);
    for k in 0..3 {
        let (t, separation) =
            point_edge::closest_to_origin(local.corners[k], local.corners[(k + 1) % 3], local.edges[k]);
        let distance_squared = norm_squared(separation);
        if distance_squared < best.0 {
            best = (distance_squared, k, t, separation);
        }
    }
    let (bound, k, t, mut separation) = best;
    let mut weights = [0.0; 3];
    weights[k] = 1.0 - t;
    weights[(k + 1) % 3] = t;
    let mut feature = match t {
        0.0 => Feature::Vertex(k as u8),
        1.0 => Feature::Vertex(((k + 1) % 3) as u8),
        _ => Feature::Edge(k as u8),
    };
    if let Some((inside, across)) = local.interior()
        && norm_squared(across) < bound
    {
        (weights, separation, feature) = (inside, across, Feature::Face);
    }
    let separation = scale(1.0 / local.scale, separation);
    let closest = match feature {
        Feature::Vertex(0) => t0,
        Feature::Vertex(1) => t1,
        Feature::Vertex(_) => t2,
        _ => sub(p, separation),
    };
    PointTriangle { barycentrics: weights, distance_squared: norm_squared(separation), closest, separation, feature }
}

/// `|p - closest|^2` `[m^2]` of [`closest_points`], the same number.
#[inline]
pub fn distance_squared(p: Vec3, t0: Vec3, t1: Vec3, t2: Vec3) -> f64 {
    let local = Local::new(p, [t0, t1, t2]);
    let mut best = (f64::INFINITY, [0.0; 3]);
    for k in 0..3 {
        let (_, separation) =
            point_edge::closest_to_origin(local.corners[k], local.corners[(k + 1) % 3], local.edges[k]);
        let distance_squared = norm_squared(separation);
        if distance_squared < best.0 {
            best = (distance_squared, separation);
        }
    }
    if let Some((_, across)) = local.interior()
        && norm_squared(across) < best.0
    {
        best.1 = across;
    }
    norm_squared(scale(1.0 / local.scale, best.1))
}
