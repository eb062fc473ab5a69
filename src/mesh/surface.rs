//! Collision surfaces: vertices, edges and faces of one body.

use crate::math::predicates::collinear;
use crate::math::{Vec3, is_finite, sub};

/// What is wrong with a mesh or a shape, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshError {
    /// Position in the array at fault, or 0.
    pub index: usize,
    /// Value at fault, or NaN.
    pub value: f64,
    /// What is wrong.
    pub message: &'static str,
}

impl MeshError {
    pub(super) fn new(index: usize, value: f64, message: &'static str) -> MeshError {
        MeshError { index, value, message }
    }
}

impl std::fmt::Display for MeshError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} (index {}, value {})", self.message, self.index, self.value)
    }
}

impl std::error::Error for MeshError {}

/// A collision surface: vertices by index, edges and faces. Any of the three may stand alone (points, wires, meshes).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Rest positions `[m]`; for rigid and posed bodies in the body frame about the centre of mass.
    pub rest: Vec<Vec3>,
    /// Vertices that take part in contact (those of an edge, a face, or points).
    pub vertices: Vec<u32>,
    /// Edges, smaller index first, sorted, unique; edges of faces included.
    pub edges: Vec<[u32; 2]>,
    /// Triangles.
    pub faces: Vec<[u32; 3]>,
}

impl Surface {
    /// A surface from a host's arrays: triangles, further edges (wires) and further points.
    ///
    /// Vertices that nothing names stay in `rest` and take no part in contact. Errors: a position that is not finite,
    /// an index out of range, an index that a triangle or edge repeats; with its place and value. Triangles without
    /// area are allowed ([`Surface::degenerate_faces`] names them). Cost: `n log n`.
    pub fn new(
        rest: Vec<Vec3>,
        faces: Vec<[u32; 3]>,
        wires: &[[u32; 2]],
        points: &[u32],
    ) -> Result<Surface, MeshError> {
        // Checked before use: the edges of bad faces mean nothing.
        let mut surface = Surface { rest, vertices: points.to_vec(), edges: wires.to_vec(), faces };
        surface.check_numbers()?;
        for edge in &mut surface.edges {
            edge.sort_unstable();
        }
        surface.edges.extend(
            surface
                .faces
                .iter()
                .flat_map(|f| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])].map(|(a, b)| [a.min(b), a.max(b)])),
        );
        surface.edges.sort_unstable();
        surface.edges.dedup();
        surface.vertices.extend(surface.edges.iter().flatten());
        surface.vertices.sort_unstable();
        surface.vertices.dedup();
        Ok(surface)
    }

    /// A surface of triangles. Errors: see [`Surface::new`].
    pub fn from_triangles(rest: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Result<Surface, MeshError> {
        Surface::new(rest, faces, &[], &[])
    }

    /// Checks a surface, however it was put together. Errors: those of [`Surface::new`]; edges that are not ordered,
    /// sorted and unique; an edge of a face that is missing among the edges.
    pub fn validate(&self) -> Result<(), MeshError> {
        self.check_numbers()?;
        for (i, e) in self.edges.iter().enumerate() {
            if e[0] > e[1] {
                return Err(MeshError::new(i, f64::from(e[0]), "the smaller vertex of an edge comes first"));
            }
            if i > 0 && self.edges[i - 1] >= *e {
                return Err(MeshError::new(i, f64::from(e[0]), "edges are sorted and unique"));
            }
        }
        for (i, f) in self.faces.iter().enumerate() {
            for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
                if self.edges.binary_search(&[a.min(b), a.max(b)]).is_err() {
                    return Err(MeshError::new(i, f64::from(a), "an edge of a face is missing among the edges"));
                }
            }
        }
        Ok(())
    }

    /// Counts, positions, ranges and repeats.
    fn check_numbers(&self) -> Result<(), MeshError> {
        let count = self.rest.len();
        if count > u32::MAX as usize / 2 || self.faces.len() > u32::MAX as usize / 8 {
            return Err(MeshError::new(count, count as f64, "too many vertices or faces"));
        }
        for (i, x) in self.rest.iter().enumerate() {
            if !is_finite(*x) {
                let value = x.iter().copied().find(|c| !c.is_finite()).unwrap_or(f64::NAN);
                return Err(MeshError::new(i, value, "a position is not finite"));
            }
        }
        let check = |i: usize, corners: &[u32], out: &'static str, repeated: &'static str| {
            for (k, v) in corners.iter().enumerate() {
                if *v as usize >= count {
                    return Err(MeshError::new(i, f64::from(*v), out));
                }
                if corners[..k].contains(v) {
                    return Err(MeshError::new(i, f64::from(*v), repeated));
                }
            }
            Ok(())
        };
        for (i, f) in self.faces.iter().enumerate() {
            check(i, f, "a face names a vertex that does not exist", "a face names a vertex twice")?;
        }
        for (i, e) in self.edges.iter().enumerate() {
            check(i, e, "an edge names a vertex that does not exist", "an edge names a vertex twice")?;
        }
        for (i, v) in self.vertices.iter().enumerate() {
            check(i, &[*v], "a point names a vertex that does not exist", "")?;
        }
        Ok(())
    }

    /// Faces whose corners lie on a line at rest, exactly.
    pub fn degenerate_faces(&self) -> Vec<u32> {
        let flat = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| self.rest[v as usize]);
            collinear(a, b, c)
        };
        (0..self.faces.len() as u32).filter(|i| flat(&self.faces[*i as usize])).collect()
    }

    /// The same surface about another origin: every rest position minus `origin`.
    pub fn about(mut self, origin: Vec3) -> Surface {
        for x in &mut self.rest {
            *x = sub(*x, origin);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<Vec3> {
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [9.0, 9.0, 9.0], [2.0, 0.0, 0.0]]
    }

    #[test]
    fn edges_of_faces_and_wires_are_listed_once() {
        let s = Surface::new(square(), vec![[0, 1, 2], [0, 2, 3]], &[[2, 1], [5, 1]], &[]).unwrap();
        assert_eq!(s.edges, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 5], [2, 3]]);
        assert_eq!(s.vertices, [0, 1, 2, 3, 5]);
        assert_eq!(s.validate(), Ok(()));
        let s = Surface::new(square(), vec![], &[], &[4, 2, 4]).unwrap();
        assert_eq!((s.vertices, s.edges.len()), (vec![2, 4], 0));
    }

    #[test]
    fn errors_name_place_and_value() {
        let error = |rest, faces, wires: &[[u32; 2]], points: &[u32]| {
            let e = Surface::new(rest, faces, wires, points).unwrap_err();
            (e.index, e.value, e.message)
        };
        assert_eq!(
            error(square(), vec![[0, 1, 2], [0, 6, 2]], &[], &[]),
            (1, 6.0, "a face names a vertex that does not exist")
        );
        assert_eq!(error(square(), vec![[0, 1, 0]], &[], &[]), (0, 0.0, "a face names a vertex twice"));
        assert_eq!(error(square(), vec![], &[[3, 3]], &[]), (0, 3.0, "an edge names a vertex twice"));
        assert_eq!(error(square(), vec![], &[[0, 99]], &[]), (0, 99.0, "an edge names a vertex that does not exist"));
        assert_eq!(error(square(), vec![], &[], &[7]), (0, 7.0, "a point names a vertex that does not exist"));
        let mut bad = square();
        bad[3][1] = f64::INFINITY;
        assert_eq!(error(bad, vec![], &[], &[]), (3, f64::INFINITY, "a position is not finite"));
    }

    #[test]
    fn surfaces_put_together_by_hand_are_checked() {
        let good = Surface::from_triangles(square(), vec![[0, 1, 2]]).unwrap();
        let with = |edges: Vec<[u32; 2]>| Surface { edges, ..good.clone() }.validate().unwrap_err().message;
        assert_eq!(with(vec![[0, 1], [0, 2]]), "an edge of a face is missing among the edges");
        assert_eq!(with(vec![[0, 2], [0, 1], [1, 2]]), "edges are sorted and unique");
        assert_eq!(with(vec![[1, 0], [0, 2], [1, 2]]), "the smaller vertex of an edge comes first");
    }

    #[test]
    fn faces_without_area_are_named() {
        let s = Surface::from_triangles(square(), vec![[0, 1, 5], [0, 1, 2]]).unwrap();
        assert_eq!(s.degenerate_faces(), [0]);
    }
}
