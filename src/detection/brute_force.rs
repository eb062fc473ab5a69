//! Every pair tested: the definition of the candidate sets, and the oracle of [`super::BroadPhase`].

use super::primitives::{Candidates, Filter, Motion, Primitives};
use crate::geometry::Aabb;
use crate::mesh::share_vertex;

/// All pairs of one list of primitives with another whose boxes overlap.
fn pairs<const N: usize, const M: usize>(
    a: &[[u32; N]],
    b: &[[u32; M]],
    motion: &Motion,
    filter: &Filter,
    mut found: impl FnMut(usize, usize),
) {
    let boxes: Vec<Aabb> = b.iter().map(|p| motion.primitive_box(p)).collect();
    for (i, first) in a.iter().enumerate() {
        let bounds = motion.primitive_box(first);
        for (j, second) in b.iter().enumerate() {
            if bounds.overlaps(&boxes[j]) && !share_vertex(first, second) && filter(first[0], second[0]) {
                found(i, j);
            }
        }
    }
}

/// Vertex-face and edge-edge pairs whose boxes overlap, that share no vertex, and that the filter lets pass.
///
/// Cost: quadratic.
pub fn candidates(primitives: &Primitives, motion: &Motion, filter: &Filter) -> Candidates {
    let mut out = Candidates::default();
    let points: Vec<[u32; 1]> = primitives.vertices.iter().map(|v| [*v]).collect();
    pairs(&points, primitives.faces, motion, filter, |i, j| out.vertex_face.push([points[i][0], j as u32]));
    pairs(primitives.edges, primitives.edges, motion, filter, |i, j| {
        if i < j {
            out.edge_edge.push([i as u32, j as u32]);
        }
    });
    out.vertex_face.sort_unstable();
    out.vertex_face.dedup();
    out
}

/// Edge-face pairs whose boxes overlap, that share no vertex, and that the filter lets pass. Cost: quadratic.
pub fn edge_face_candidates(primitives: &Primitives, motion: &Motion, filter: &Filter) -> Candidates {
    let mut out = Candidates::default();
    pairs(primitives.edges, primitives.faces, motion, filter, |i, j| out.edge_face.push([i as u32, j as u32]));
    out
}
