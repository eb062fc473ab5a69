//! The contact record of the search: four vertices, four signed weights, a unit normal [Otaduy09, §3.2].

use super::pair::{ClosestPoints, Pair, PairKind, distance_along, gather};
use crate::math::{Vec3, add_scaled, cross, dot, scale, sub, unit};
use crate::model::{HalfSpace, Model};

/// A linearised contact: the gap at positions `x` is `normal · sum w_k x_k - offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The pair it belongs to.
    pub pair: Pair,
    /// Its number among the contacts of its pair.
    pub ordinal: u32,
    /// Vertices; those with weight zero do not count.
    pub vertices: [u32; 4],
    /// Signed weights, positive on the first primitive.
    pub weights: [f64; 4],
    /// Unit normal from the second primitive to the first; of the half-space's end for half-space pairs.
    pub normal: Vec3,
    /// Offset of the half-space at the end of the segment `[m]`; 0 for mesh pairs.
    pub offset: f64,
    /// Pair thickness delta `[m]`.
    pub thickness: f64,
    /// Gap at the start of the segment, along this normal and with these weights `[m]`.
    pub start_gap: f64,
}

impl Contact {
    /// Gap at positions `x` `[m]`.
    #[inline]
    pub fn gap(&self, x: &[Vec3]) -> f64 {
        match self.pair.kind {
            PairKind::VertexHalfSpace => dot(self.normal, x[self.vertices[0] as usize]) - self.offset,
            _ => distance_along(self.normal, &self.weights, &gather(self.vertices, x)),
        }
    }

    /// The gap that the end of the segment must keep: `min(delta, gap at start + recovery)` `[m]`.
    #[inline]
    pub fn required_gap(&self, recovery_fraction: f64) -> f64 {
        self.thickness.min(self.start_gap + recovery_fraction * self.thickness)
    }

    /// The contact point on the second primitive at positions `x` `[m]`.
    pub fn point(&self, x: &[Vec3]) -> Vec3 {
        let first = x[self.vertices[0] as usize];
        if self.pair.kind == PairKind::VertexHalfSpace {
            return add_scaled(first, -self.gap(x), self.normal);
        }
        let mut point = [0.0; 3];
        for k in 0..4 {
            if self.on_second(k) {
                point = add_scaled(point, -self.weights[k], x[self.vertices[k] as usize]);
            }
        }
        point
    }

    /// Whether vertex `k` of the stencil belongs to the second primitive.
    #[inline]
    pub fn on_second(&self, k: usize) -> bool {
        match self.pair.kind {
            PairKind::VertexFace => k > 0,
            PairKind::EdgeEdge => k > 1,
            PairKind::VertexHalfSpace => false,
        }
    }
}

/// The contact of a mesh pair from its closest points at some time; the gap is taken at the start positions `x0`.
///
/// The normal is the direction between the closest points; where that vanishes, the face normal or the edges' cross
/// product at that time, then the direction at the start, then a direction across the first edge. It is turned so that
/// the gap at the start is not negative.
pub fn mesh_contact(
    model: &Model,
    pair: Pair,
    ordinal: u32,
    closest: &ClosestPoints,
    at: &[Vec3; 4],
    x0: &[Vec3; 4],
    thickness: f64,
) -> Contact {
    let normal = unit(closest.separation)
        .or_else(|| unit(surface_direction(pair.kind, at)))
        .or_else(|| unit(pair.closest_points(x0).separation))
        .unwrap_or_else(|| across_first_edge(at));
    let gap = distance_along(normal, &closest.weights, x0);
    let (normal, start_gap) = if gap < 0.0 { (scale(-1.0, normal), -gap) } else { (normal, gap) };
    Contact {
        pair,
        ordinal,
        vertices: pair.vertices(model),
        weights: closest.weights,
        normal,
        offset: 0.0,
        thickness,
        start_gap,
    }
}

fn surface_direction(kind: PairKind, x: &[Vec3; 4]) -> Vec3 {
    match kind {
        PairKind::EdgeEdge => cross(sub(x[1], x[0]), sub(x[3], x[2])),
        _ => cross(sub(x[2], x[1]), sub(x[3], x[1])),
    }
}

fn across_first_edge(x: &[Vec3; 4]) -> Vec3 {
    unit(sub(x[3], x[2])).map_or([0.0, 0.0, 1.0], |direction| crate::math::tangents(direction).0)
}

/// The contact of a vertex with a half-space that moves from `start` to `end`.
pub fn half_space_contact(pair: Pair, start: &HalfSpace, end: &HalfSpace, x0: Vec3, thickness: f64) -> Contact {
    Contact {
        pair,
        ordinal: 0,
        vertices: [pair.features[0]; 4],
        weights: [1.0, 0.0, 0.0, 0.0],
        normal: end.normal,
        offset: end.offset,
        thickness,
        start_gap: dot(start.normal, x0) - start.offset,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, norm_squared};

    #[test]
    fn crossing_parallel_edges_still_have_a_unit_normal() {
        // Both edges along x and touching: neither the closest points nor the cross product give a direction.
        let x0 = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let at = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0]];
        let model = Model { edges: vec![[0, 1], [2, 3]], ..Model::default() };
        let pair = Pair { kind: PairKind::EdgeEdge, features: [0, 1] };
        let contact = mesh_contact(&model, pair, 0, &pair.closest_points(&at), &at, &x0, 0.1);
        assert!(norm(sub(contact.normal, [0.0, 0.0, 1.0])) < 1e-15, "{:?}", contact.normal);
        assert!((contact.start_gap - 1.0).abs() < 1e-15);
        let collapsed = [[0.0; 3]; 4];
        let contact = mesh_contact(&model, pair, 0, &pair.closest_points(&collapsed), &collapsed, &collapsed, 0.1);
        assert!((norm_squared(contact.normal) - 1.0).abs() < 1e-15);
    }
}
