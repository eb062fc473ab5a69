//! Quadratic bending of a sheet that is flat at rest: constant stiffness per hinge [Bergou 2006].

use signorini::math::{Vec3, add_scaled, cross, dot, norm, scale, sub};
use std::collections::BTreeMap;

/// Hinges of a sheet: edge `i j` and the opposite vertices of its two faces; the energy is `k/2 |sum c_v x_v|^2`.
#[derive(Clone, Debug, Default)]
pub struct Bending {
    hinges: Vec<Hinge>,
}

#[derive(Clone, Debug)]
struct Hinge {
    vertices: [u32; 4],
    weights: [f64; 4],
    stiffness: f64,
}

impl Bending {
    /// From a flat rest state; `rigidity` is the plate stiffness `[N m]`.
    pub fn new(rest: &[Vec3], faces: &[[u32; 3]], rigidity: f64) -> Bending {
        let mut opposite: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for f in faces {
            for k in 0..3 {
                let (i, j) = (f[k], f[(k + 1) % 3]);
                opposite.entry([i.min(j), i.max(j)]).or_default().push(f[(k + 2) % 3]);
            }
        }
        let hinges = opposite
            .iter()
            .filter(|(_, far)| far.len() == 2)
            .map(|(edge, far)| {
                let vertices = [edge[0], edge[1], far[0], far[1]];
                let [x0, x1, x2, x3] = vertices.map(|v| rest[v as usize]);
                let cotangent = |u: Vec3, w: Vec3| dot(u, w) / norm(cross(u, w));
                let e = sub(x1, x0);
                let back = scale(-1.0, e);
                let (a2, a3) = (cotangent(e, sub(x2, x0)), cotangent(e, sub(x3, x0)));
                let (b2, b3) = (cotangent(back, sub(x2, x1)), cotangent(back, sub(x3, x1)));
                let weights = [b2 + b3, a2 + a3, -a2 - b2, -a3 - b3];
                let area = 0.5 * (norm(cross(e, sub(x2, x0))) + norm(cross(e, sub(x3, x0))));
                Hinge { vertices, weights, stiffness: 3.0 * rigidity / area }
            })
            .collect();
        Bending { hinges }
    }

    /// Vertices of each hinge.
    pub fn stencils(&self) -> impl Iterator<Item = [u32; 4]> + '_ {
        self.hinges.iter().map(|h| h.vertices)
    }

    fn curvature(&self, h: &Hinge, x: &[Vec3]) -> Vec3 {
        h.vertices.iter().zip(h.weights).fold([0.0; 3], |c, (v, w)| add_scaled(c, w, x[*v as usize]))
    }

    /// Elastic energy `[J]`.
    pub fn energy(&self, x: &[Vec3]) -> f64 {
        self.hinges.iter().map(|h| 0.5 * h.stiffness * dot(self.curvature(h, x), self.curvature(h, x))).sum()
    }

    /// Adds the force, the negative gradient of the energy `[N]`.
    pub fn add_forces(&self, x: &[Vec3], forces: &mut [Vec3]) {
        for h in &self.hinges {
            let c = self.curvature(h, x);
            for (v, w) in h.vertices.iter().zip(h.weights) {
                forces[*v as usize] = add_scaled(forces[*v as usize], -h.stiffness * w, c);
            }
        }
    }

    /// Calls `add(hinge, a, b, s)`: the constant stiffness `-dF/dx` has the block `s I` `[N/m]` there.
    pub fn add_stiffness(&self, mut add: impl FnMut(usize, usize, usize, f64)) {
        for (number, h) in self.hinges.iter().enumerate() {
            for a in 0..4 {
                for b in 0..4 {
                    add(number, a, b, h.stiffness * h.weights[a] * h.weights[b]);
                }
            }
        }
    }
}
