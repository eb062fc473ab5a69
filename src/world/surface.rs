//! Collision surfaces from the host's lists of triangles, edges and points.

use super::{Fault, WorldError};
use crate::math::{Vec3, is_finite, norm_squared, sub};
use crate::model::Surface;

/// What of a body collides, by vertex index. All empty: every vertex is a point.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Edges besides those of the triangles.
    pub edges: Vec<[u32; 2]>,
    /// Points besides the vertices of triangles and edges.
    pub points: Vec<u32>,
}

/// The collision surface over `rest`. Edges of triangles are added, doubled edges and points are merged.
///
/// Errors: an index out of range, an element that names a vertex twice, two triangles over the same vertices, an edge
/// or triangle side without length, a rest position that is not finite. Cost: a sort of the edges.
pub(super) fn surface(rest: Vec<Vec3>, topology: Topology) -> Result<Surface, WorldError> {
    if rest.is_empty() {
        return Err(WorldError::new(Fault::BadTopology, "a body needs at least one vertex"));
    }
    if rest.len() > u32::MAX as usize / 4 {
        return Err(WorldError::new(Fault::BadTopology, "too many vertices").value(rest.len() as f64));
    }
    if let Some(index) = rest.iter().position(|x| !is_finite(*x)) {
        return Err(WorldError::new(Fault::NonFinite, "a rest position is not finite").index(index));
    }
    check_elements(&topology.triangles, &rest, "triangle")?;
    check_elements(&topology.edges, &rest, "edge")?;
    check_range(topology.points.iter().map(std::slice::from_ref), rest.len(), "point")?;
    check_repeated_triangles(&topology.triangles)?;

    let mut edges = topology.edges;
    let growth = topology.triangles.len().checked_mul(3);
    if growth.is_none_or(|growth| edges.try_reserve(growth).is_err()) {
        return Err(WorldError::out_of_memory("no memory for the edges of the triangles"));
    }
    for [a, b, c] in &topology.triangles {
        edges.extend([[*a, *b], [*b, *c], [*c, *a]]);
    }
    for edge in &mut edges {
        edge.sort_unstable();
    }
    edges.sort_unstable();
    edges.dedup();

    let mut vertices = topology.points;
    if vertices.try_reserve(edges.len().saturating_mul(2).saturating_add(rest.len())).is_err() {
        return Err(WorldError::out_of_memory("no memory for the vertices of the surface"));
    }
    if edges.is_empty() && vertices.is_empty() {
        vertices.extend(0..rest.len() as u32);
    }
    vertices.extend(edges.iter().flatten());
    vertices.sort_unstable();
    vertices.dedup();
    Ok(Surface { rest, vertices, edges, faces: topology.triangles })
}

/// Indices in range, no vertex named twice, no side without length.
fn check_elements<const N: usize>(elements: &[[u32; N]], rest: &[Vec3], what: &str) -> Result<(), WorldError> {
    check_range(elements.iter().map(|element| element.as_slice()), rest.len(), what)?;
    for (index, element) in elements.iter().enumerate() {
        for (i, a) in element.iter().enumerate() {
            for b in &element[..i] {
                if a == b {
                    let message = format!("{what} {index} names vertex {a} twice");
                    return Err(WorldError::new(Fault::BadTopology, message).index(index).value(*a as f64));
                }
                if norm_squared(sub(rest[*a as usize], rest[*b as usize])) == 0.0 {
                    let message = format!("{what} {index} has a side without length in the rest positions");
                    return Err(WorldError::new(Fault::BadTopology, message).index(index).value(*a as f64));
                }
            }
        }
    }
    Ok(())
}

fn check_range<'a>(elements: impl Iterator<Item = &'a [u32]>, vertices: usize, what: &str) -> Result<(), WorldError> {
    for (index, element) in elements.enumerate() {
        if let Some(vertex) = element.iter().find(|vertex| **vertex as usize >= vertices) {
            let message = format!("{what} {index} names vertex {vertex} of {vertices}");
            return Err(WorldError::new(Fault::BadTopology, message).index(index).value(*vertex as f64));
        }
    }
    Ok(())
}

fn check_repeated_triangles(triangles: &[[u32; 3]]) -> Result<(), WorldError> {
    let mut sorted: Vec<([u32; 3], usize)> = Vec::new();
    if sorted.try_reserve_exact(triangles.len()).is_err() {
        return Err(WorldError::out_of_memory("no memory to compare the triangles"));
    }
    sorted.extend(triangles.iter().enumerate().map(|(index, triangle)| {
        let mut key = *triangle;
        key.sort_unstable();
        (key, index)
    }));
    sorted.sort_unstable();
    for pair in sorted.windows(2) {
        if pair[0].0 == pair[1].0 {
            let message = format!("triangles {} and {} have the same vertices", pair[0].1, pair[1].1);
            return Err(WorldError::new(Fault::BadTopology, message).index(pair[1].1));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<Vec3> {
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 5.0]]
    }

    #[test]
    fn edges_of_triangles_are_found_once_and_loose_vertices_left_out() {
        let topology = Topology { triangles: vec![[0, 1, 2], [0, 2, 3]], edges: vec![[1, 0]], points: vec![] };
        let surface = surface(square(), topology).unwrap();
        assert_eq!(surface.edges, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(surface.vertices, [0, 1, 2, 3]);
    }

    #[test]
    fn without_elements_every_vertex_is_a_point() {
        assert_eq!(surface(square(), Topology::default()).unwrap().vertices, [0, 1, 2, 3, 4]);
        let points = Topology { points: vec![3, 3, 1], ..Topology::default() };
        assert_eq!(surface(square(), points).unwrap().vertices, [1, 3]);
    }

    #[test]
    fn bad_elements_are_named() {
        let fault = |triangles: Vec<[u32; 3]>, rest: Vec<Vec3>| {
            let error = surface(rest, Topology { triangles, ..Topology::default() }).unwrap_err();
            (error.fault, error.index)
        };
        assert_eq!(fault(vec![[0, 1, 2], [0, 2, 5]], square()), (Fault::BadTopology, 1));
        assert_eq!(fault(vec![[0, 1, 1]], square()), (Fault::BadTopology, 0));
        assert_eq!(fault(vec![[0, 1, 2], [2, 0, 1]], square()), (Fault::BadTopology, 1));
        let mut rest = square();
        rest[2] = rest[1];
        assert_eq!(fault(vec![[0, 1, 2]], rest.clone()), (Fault::BadTopology, 0));
        rest[4][1] = f64::NAN;
        assert_eq!(fault(vec![], rest), (Fault::NonFinite, 4));
    }
}
