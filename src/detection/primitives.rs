//! The collision primitives of a whole model, and candidate pairs.

use crate::geometry::Aabb;
use crate::math::Vec3;

/// Borrowed collision primitives: vertex indices that take part, edges, faces.
#[derive(Clone, Copy)]
pub struct Primitives<'a> {
    /// Vertices that take part in contact.
    pub vertices: &'a [u32],
    /// Edges.
    pub edges: &'a [[u32; 2]],
    /// Triangles.
    pub faces: &'a [[u32; 3]],
}

/// Motion of the vertices over a step, and how far around it pairs count as near.
#[derive(Clone, Copy)]
pub struct Motion<'a> {
    /// Positions at the start, by vertex index `[m]`. Finite.
    pub x0: &'a [Vec3],
    /// Positions at the end; the same slice as `x0` for a state at rest `[m]`.
    pub x1: &'a [Vec3],
    /// Thickness of the box around each vertex, `>= 0`; empty for none. The box of a primitive also contains what lies
    /// within the interpolated thickness of its other points `[m]`.
    pub radius: &'a [f64],
}

impl Motion<'_> {
    /// Box of vertex `v`: the bounds of `x0` and `x1`, thickened and rounded outward.
    #[inline(always)]
    pub fn vertex_box(&self, v: u32) -> Aabb {
        let v = v as usize;
        Aabb::swept(self.x0[v], self.x1[v], self.radius.get(v).copied().unwrap_or(0.0))
    }

    /// Box of a primitive: the union of those of its vertices.
    #[inline(always)]
    pub fn primitive_box<const N: usize>(&self, primitive: &[u32; N]) -> Aabb {
        primitive.iter().fold(Aabb::EMPTY, |b, v| b.union(&self.vertex_box(*v)))
    }
}

/// Candidate pairs, each list sorted and without repeats: a stable order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Candidates {
    /// `[vertex index, face number]`
    pub vertex_face: Vec<[u32; 2]>,
    /// `[edge number, edge number]`, smaller first.
    pub edge_edge: Vec<[u32; 2]>,
    /// `[edge number, face number]`, for the intersection certificate.
    pub edge_face: Vec<[u32; 2]>,
}

/// Which vertices may meet, asked with one vertex of each primitive (its first).
///
/// Must be symmetric, and the same for every vertex of a connected component: it is for pairs of bodies, and is asked
/// once for many pairs.
pub type Filter<'a> = dyn Fn(u32, u32) -> bool + Sync + 'a;
