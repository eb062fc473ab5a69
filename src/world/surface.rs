//! Collision surfaces from the host's lists of triangles, edges and points.

use super::{Fault, WorldError};
use crate::math::{Vec3, is_finite};
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
/// Errors: no vertices, an index out of range, an element that names a vertex twice, a rest position that is not
/// finite. Cost: a sort of the edges.
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
    let Topology { triangles, edges, mut points } = topology;
    if triangles.is_empty() && edges.is_empty() && points.is_empty() {
        points.extend(0..rest.len() as u32);
    }
    Surface::new(rest, triangles, &edges, &points).map_err(|error| {
        let message = format!("{} (element {})", error.message, error.index);
        WorldError::new(Fault::BadTopology, message).index(error.index).value(error.value)
    })
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
        assert_eq!(fault(vec![], vec![]), (Fault::BadTopology, u64::MAX));
        let mut rest = square();
        rest[4][1] = f64::NAN;
        assert_eq!(fault(vec![], rest), (Fault::NonFinite, 4));
    }
}
