//! Tetrahedral meshes: volumes, orientation, surface.

use super::surface::{MeshError, Surface};
use crate::math::predicates::orient3d;
use crate::math::{Vec3, cross, dot, is_finite, sub};

/// Vertices of the four faces of a tetrahedron, wound outward: face `k` is opposite vertex `k`.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A checked tetrahedral mesh: every element of positive volume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Rest positions of the nodes `[m]`.
    pub rest: Vec<Vec3>,
    /// Elements: vertex 3 on the side that the normal of face 0 1 2 points to.
    pub tetrahedra: Vec<[u32; 4]>,
}

impl TetMesh {
    /// Checks and orients; elements given the other way round are turned (their last two vertices swapped).
    ///
    /// Errors, with place and value: no element; a position that is not finite; a node that does not exist or is named
    /// twice by an element; an element without volume (decided exactly); a node of no element. Cost: linear.
    pub fn new(rest: Vec<Vec3>, mut tetrahedra: Vec<[u32; 4]>) -> Result<TetMesh, MeshError> {
        if tetrahedra.is_empty() || rest.len() > u32::MAX as usize / 4 {
            return Err(MeshError::new(
                0,
                rest.len() as f64,
                "a tetrahedral mesh needs elements, and not too many nodes",
            ));
        }
        if let Some(i) = rest.iter().position(|x| !is_finite(*x)) {
            let value = rest[i].iter().copied().find(|c| !c.is_finite()).unwrap_or(f64::NAN);
            return Err(MeshError::new(i, value, "a position is not finite"));
        }
        let mut used = vec![false; rest.len()];
        for (i, t) in tetrahedra.iter_mut().enumerate() {
            for k in 0..4 {
                if t[k] as usize >= rest.len() {
                    return Err(MeshError::new(i, f64::from(t[k]), "a tetrahedron names a node that does not exist"));
                }
                if t[..k].contains(&t[k]) {
                    return Err(MeshError::new(i, f64::from(t[k]), "a tetrahedron names a node twice"));
                }
                used[t[k] as usize] = true;
            }
            let [a, b, c, d] = t.map(|v| rest[v as usize]);
            // Positive where d is on the side of the normal of a b c.
            let side = orient3d(a, b, c, d);
            if side == 0 {
                return Err(MeshError::new(i, 0.0, "a tetrahedron has no volume"));
            }
            if side < 0 {
                t.swap(2, 3);
            }
        }
        if let Some(i) = used.iter().position(|u| !u) {
            return Err(MeshError::new(i, i as f64, "a node belongs to no tetrahedron"));
        }
        let mesh = TetMesh { rest, tetrahedra };
        match (0..mesh.tetrahedra.len()).find(|i| !(mesh.volume(*i) > 0.0 && mesh.volume(*i).is_finite())) {
            Some(i) => Err(MeshError::new(i, mesh.volume(i), "the volume of a tetrahedron cannot be represented")),
            None => Ok(mesh),
        }
    }

    /// Rest positions of an element's nodes.
    pub fn corners(&self, element: usize) -> [Vec3; 4] {
        self.tetrahedra[element].map(|v| self.rest[v as usize])
    }

    /// Rest volume of an element `[m^3]`.
    pub fn volume(&self, element: usize) -> f64 {
        let [a, b, c, d] = self.corners(element);
        dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6.0
    }

    /// Faces that bound the mesh, wound outward, in the order of the elements.
    ///
    /// Errors: a face of more than two elements, with an element and a node. Cost: a sort of the faces.
    pub fn boundary(&self) -> Result<Vec<[u32; 3]>, MeshError> {
        let mut all: Vec<([u32; 3], usize, usize)> = Vec::with_capacity(4 * self.tetrahedra.len());
        for (i, t) in self.tetrahedra.iter().enumerate() {
            for (k, face) in FACES.iter().enumerate() {
                let mut sorted = face.map(|corner| t[corner]);
                sorted.sort_unstable();
                all.push((sorted, i, k));
            }
        }
        all.sort_unstable();
        let mut open = Vec::new();
        let mut start = 0;
        while start < all.len() {
            let (key, element, k) = all[start];
            let count = all[start..].iter().take_while(|f| f.0 == key).count();
            if count > 2 {
                let message = "a face belongs to more than two tetrahedra";
                return Err(MeshError::new(element, f64::from(key[0]), message));
            }
            if count == 1 {
                open.push((element, k));
            }
            start += count;
        }
        open.sort_unstable();
        Ok(open.into_iter().map(|(i, k)| FACES[k].map(|corner| self.tetrahedra[i][corner])).collect())
    }

    /// The boundary as a collision surface over all nodes; nodes within do not collide. Errors as for the boundary.
    pub fn surface(&self) -> Result<Surface, MeshError> {
        Surface::new(self.rest.clone(), self.boundary()?, &[], &[])
    }

    /// Lumped masses: a quarter of each element's mass to each of its nodes, for a density `[kg/m^3]`.
    pub fn lumped_masses(&self, density: f64) -> Vec<f64> {
        let mut masses = vec![0.0; self.rest.len()];
        for (i, t) in self.tetrahedra.iter().enumerate() {
            let share = 0.25 * density * self.volume(i);
            t.iter().for_each(|v| masses[*v as usize] += share);
        }
        masses
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MassProperties, open_half_edges};

    /// A cube of five tetrahedra, one of them given inside out.
    fn cube() -> (Vec<Vec3>, Vec<[u32; 4]>) {
        let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
        let tetrahedra = vec![[0, 1, 2, 4], [3, 2, 1, 7], [5, 1, 4, 7], [6, 4, 2, 7], [2, 1, 4, 7]];
        ((0..8).map(corner).collect(), tetrahedra)
    }

    #[test]
    fn the_boundary_of_a_cube_is_closed_and_wound_outward() {
        let (rest, tetrahedra) = cube();
        let mesh = TetMesh::new(rest, tetrahedra).unwrap();
        let volumes: Vec<f64> = (0..5).map(|i| mesh.volume(i)).collect();
        assert!(volumes.iter().all(|v| *v > 0.0));
        assert!((volumes.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let faces = mesh.boundary().unwrap();
        assert_eq!(faces.len(), 12);
        assert!(open_half_edges(&faces).is_empty());
        let solid = MassProperties::of_closed_mesh(&mesh.surface().unwrap(), 3.0).unwrap();
        assert!((solid.mass - 3.0).abs() < 1e-14);
        assert!((mesh.lumped_masses(3.0).iter().sum::<f64>() - 3.0).abs() < 1e-14);
    }

    #[test]
    fn faults_are_named() {
        let error = |rest: Vec<Vec3>, tetrahedra: Vec<[u32; 4]>| {
            let e = TetMesh::new(rest, tetrahedra).unwrap_err();
            (e.index, e.value, e.message)
        };
        let (rest, tetrahedra) = cube();
        assert_eq!(error(rest.clone(), vec![]).2, "a tetrahedral mesh needs elements, and not too many nodes");
        let with = |extra: [u32; 4]| [tetrahedra.clone(), vec![extra]].concat();
        assert_eq!(error(rest.clone(), with([0, 1, 2, 8])), (5, 8.0, "a tetrahedron names a node that does not exist"));
        assert_eq!(error(rest.clone(), with([0, 1, 1, 4])), (5, 1.0, "a tetrahedron names a node twice"));
        assert_eq!(error(rest.clone(), with([0, 1, 2, 3])), (5, 0.0, "a tetrahedron has no volume"));
        let lonely = [rest.clone(), vec![[9.0; 3]]].concat();
        assert_eq!(error(lonely, tetrahedra.clone()), (8, 8.0, "a node belongs to no tetrahedron"));
        let mut bad = rest.clone();
        bad[3][1] = f64::NAN;
        assert_eq!(error(bad, tetrahedra.clone()).0, 3);
        let twice = TetMesh::new(rest, with([1, 2, 4, 0])).unwrap();
        let twice = TetMesh { tetrahedra: [twice.tetrahedra, vec![[2, 1, 4, 3]]].concat(), ..twice };
        assert_eq!(twice.boundary().unwrap_err().message, "a face belongs to more than two tetrahedra");
    }
}
