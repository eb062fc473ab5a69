//! Points carried along by a tetrahedral mesh.

use super::TetMesh;
use super::surface::MeshError;
use crate::math::{Vec3, add_scaled, cross, dot, sub};

/// A point further out of every element than this, in barycentric coordinates, is taken for a mistake.
const FARTHEST: f64 = -1.0;

/// Points as fixed combinations of nodes: `x = sum w_k x_k` over the four nodes of an element, weights summing to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Embedding {
    /// Nodes per point.
    pub nodes: Vec<[u32; 4]>,
    /// Weights per point.
    pub weights: Vec<[f64; 4]>,
}

impl Embedding {
    /// Embeds points at rest: each in the element that holds it, or else in the one it is least outside of (smallest
    /// barycentric coordinate the largest; the lower element of two equals), extrapolated.
    ///
    /// Errors: a point that is not finite, or outside by more than the size of an element. Cost: points times elements,
    /// most of them rejected by a box.
    pub fn new(mesh: &TetMesh, points: &[Vec3]) -> Result<Embedding, MeshError> {
        let boxes: Vec<[Vec3; 2]> = (0..mesh.tetrahedra.len()).map(|i| bounds(&mesh.corners(i))).collect();
        let mut out = Embedding { nodes: Vec::with_capacity(points.len()), weights: Vec::with_capacity(points.len()) };
        for (index, point) in points.iter().enumerate() {
            if let Some(value) = point.iter().find(|c| !c.is_finite()) {
                return Err(MeshError::new(index, *value, "an embedded point is not finite"));
            }
            let near = (0..boxes.len()).filter(|i| contains(&boxes[*i], *point));
            let (element, weights, least) = best(mesh, *point, near)
                .filter(|found| found.2 >= 0.0)
                .or_else(|| best(mesh, *point, 0..boxes.len()))
                .unwrap_or((0, [1.0, 0.0, 0.0, 0.0], f64::NEG_INFINITY));
            if least < FARTHEST {
                return Err(MeshError::new(index, least, "an embedded point is far outside of every tetrahedron"));
            }
            out.nodes.push(mesh.tetrahedra[element]);
            out.weights.push(weights);
        }
        Ok(out)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Where point `i` stands when the nodes stand at `x`. From differences, so that far from the origin no digits are
    /// lost; the same formula gives its velocity from the nodes' velocities.
    #[inline]
    pub fn place(&self, i: usize, x: &[Vec3]) -> Vec3 {
        let (nodes, weights) = (&self.nodes[i], &self.weights[i]);
        let first = x[nodes[0] as usize];
        (1..4).fold(first, |p, k| add_scaled(p, weights[k], sub(x[nodes[k] as usize], first)))
    }

    /// Nodes and weights of a point that are not zero.
    pub fn terms(&self, i: usize) -> impl Iterator<Item = (u32, f64)> {
        self.nodes[i].into_iter().zip(self.weights[i]).filter(|(_, w)| *w != 0.0)
    }
}

fn bounds(corners: &[Vec3; 4]) -> [Vec3; 2] {
    let fold =
        |f: fn(f64, f64) -> f64| std::array::from_fn(|c| corners[1..].iter().fold(corners[0][c], |a, p| f(a, p[c])));
    [fold(f64::min), fold(f64::max)]
}

fn contains([low, high]: &[Vec3; 2], p: Vec3) -> bool {
    (0..3).all(|c| p[c] >= low[c] && p[c] <= high[c])
}

/// The element among `candidates` with the largest smallest weight: element, weights, that weight.
fn best(mesh: &TetMesh, p: Vec3, candidates: impl Iterator<Item = usize>) -> Option<(usize, [f64; 4], f64)> {
    let mut found: Option<(usize, [f64; 4], f64)> = None;
    for element in candidates {
        let weights = barycentric(&mesh.corners(element), p);
        let least = weights.iter().fold(f64::INFINITY, |a, w| a.min(*w));
        if found.is_none_or(|f| least > f.2) {
            found = Some((element, weights, least));
        }
    }
    found
}

/// Barycentric coordinates of `p`; the first one is what the others leave of 1.
fn barycentric(corners: &[Vec3; 4], p: Vec3) -> [f64; 4] {
    let [a, b, c] = [1, 2, 3].map(|k| sub(corners[k], corners[0]));
    let r = sub(p, corners[0]);
    let six = dot(a, cross(b, c));
    let [w1, w2, w3] = [dot(r, cross(b, c)) / six, dot(a, cross(r, c)) / six, dot(a, cross(b, r)) / six];
    [1.0 - w1 - w2 - w3, w1, w2, w3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::norm;

    fn two() -> TetMesh {
        let rest = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        TetMesh::new(rest, vec![[0, 1, 2, 3], [1, 2, 3, 4]]).unwrap()
    }

    #[test]
    fn points_follow_affine_motions_and_keep_to_their_element() {
        let mesh = two();
        let points = [[0.1, 0.2, 0.3], [0.7, 0.6, 0.5], [0.0, 0.0, 1.0], [-0.1, 0.3, 0.2], [1.2, 1.1, 1.0]];
        let embedding = Embedding::new(&mesh, &points).unwrap();
        assert_eq!(embedding.nodes[0], mesh.tetrahedra[0]);
        assert_eq!(embedding.nodes[1], mesh.tetrahedra[1]);
        let map = |p: Vec3| [1e3 + 2.0 * p[0] - p[1], 0.5 * p[2] + p[1] - 7.0, p[0] - 3.0 * p[2]];
        let moved: Vec<Vec3> = mesh.rest.iter().map(|p| map(*p)).collect();
        for (i, p) in points.iter().enumerate() {
            assert!(norm(sub(embedding.place(i, &mesh.rest), *p)) < 1e-15);
            assert!(norm(sub(embedding.place(i, &moved), map(*p))) < 1e-12);
            assert!((embedding.weights[i].iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
        assert!(embedding.weights[3].iter().any(|w| *w < 0.0), "extrapolated");
        assert_eq!(embedding.terms(2).count(), 1, "a point on a node is carried by that node alone");
    }

    #[test]
    fn points_far_outside_are_refused() {
        let error = Embedding::new(&two(), &[[0.1; 3], [9.0; 3]]).unwrap_err();
        assert_eq!(error.index, 1);
        assert!(error.value < -1.0);
        assert_eq!(Embedding::new(&two(), &[[f64::NAN; 3]]).unwrap_err().index, 0);
    }
}
