//! Co-rotational linear tetrahedra [Müller-Gross 2004].

use nalgebra::Matrix3;
use signorini::math::{Mat3, Vec3, add_scaled, cross, determinant, dot, inverse, mat_mul, scale, sub, transpose};

/// One tetrahedron.
#[derive(Clone, Debug)]
struct Element {
    vertices: [u32; 4],
    volume: f64,
    /// Gradient of each vertex's shape function at rest `[1/m]`.
    gradients: [Vec3; 4],
}

/// Tetrahedra with their rest shape and Lamé parameters `[Pa]`.
#[derive(Clone, Debug)]
pub struct Corotational {
    elements: Vec<Element>,
    lambda: f64,
    mu: f64,
}

impl Corotational {
    /// From a rest state of positively oriented tetrahedra.
    pub fn new(rest: &[Vec3], tetrahedra: &[[u32; 4]], young: f64, poisson: f64) -> Corotational {
        let elements = tetrahedra
            .iter()
            .map(|&vertices| {
                let [a, b, c, d] = vertices.map(|v| rest[v as usize]);
                let edges = transpose(&[sub(b, a), sub(c, a), sub(d, a)]);
                let rows = inverse(&edges).unwrap_or([[0.0; 3]; 3]);
                let first = scale(-1.0, add_scaled(add_scaled(rows[0], 1.0, rows[1]), 1.0, rows[2]));
                let gradients = [first, rows[0], rows[1], rows[2]];
                Element { vertices, volume: determinant(&edges) / 6.0, gradients }
            })
            .collect();
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        Corotational { elements, lambda, mu: young / (2.0 * (1.0 + poisson)) }
    }

    /// Vertices of each tetrahedron.
    pub fn stencils(&self) -> impl Iterator<Item = [u32; 4]> + '_ {
        self.elements.iter().map(|e| e.vertices)
    }

    /// Lumped mass per vertex at this `density` `[kg/m^3]`, added to `masses`.
    pub fn add_masses(&self, density: f64, masses: &mut [f64]) {
        for e in &self.elements {
            for v in e.vertices {
                masses[v as usize] += density * e.volume / 4.0;
            }
        }
    }

    fn deformation(e: &Element, x: &[Vec3]) -> Mat3 {
        let mut f = [[0.0; 3]; 3];
        for (v, g) in e.vertices.iter().zip(&e.gradients) {
            for (row, component) in f.iter_mut().zip(x[*v as usize]) {
                *row = add_scaled(*row, component, *g);
            }
        }
        f
    }

    /// Rotation and first Piola-Kirchhoff stress.
    fn stress(&self, f: &Mat3) -> (Mat3, Mat3) {
        let r = rotation_of(f);
        let stretch = mat_mul(&transpose(&r), f);
        let trace = self.lambda * (stretch[0][0] + stretch[1][1] + stretch[2][2] - 3.0);
        let mut p = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                p[i][j] = 2.0 * self.mu * (f[i][j] - r[i][j]) + trace * r[i][j];
            }
        }
        (r, p)
    }

    /// Elastic energy `[J]`.
    pub fn energy(&self, x: &[Vec3]) -> f64 {
        let mut sum = 0.0;
        for e in &self.elements {
            let f = Self::deformation(e, x);
            let r = rotation_of(&f);
            let stretch = mat_mul(&transpose(&r), &f);
            let trace = stretch[0][0] + stretch[1][1] + stretch[2][2] - 3.0;
            let distance: f64 = (0..3).map(|i| dot(sub(f[i], r[i]), sub(f[i], r[i]))).sum();
            sum += e.volume * (self.mu * distance + 0.5 * self.lambda * trace * trace);
        }
        sum
    }

    /// Adds the force, the negative gradient of the energy `[N]`.
    pub fn add_forces(&self, x: &[Vec3], forces: &mut [Vec3]) {
        for e in &self.elements {
            let (_, p) = self.stress(&Self::deformation(e, x));
            for (v, g) in e.vertices.iter().zip(&e.gradients) {
                let f = &mut forces[*v as usize];
                *f = add_scaled(*f, -e.volume, [dot(p[0], *g), dot(p[1], *g), dot(p[2], *g)]);
            }
        }
    }

    /// Calls `add(element, a, b, block)` with the blocks of the stiffness, the rotation held: positive semi-definite.
    pub fn add_stiffness(&self, x: &[Vec3], mut add: impl FnMut(usize, usize, usize, &Mat3)) {
        for (number, e) in self.elements.iter().enumerate() {
            let (r, _) = self.stress(&Self::deformation(e, x));
            // Gradients turned with the element: blocks become lambda ga gb^T + mu (gb ga^T + (ga·gb) I).
            let turned = e.gradients.map(|g| [dot(r[0], g), dot(r[1], g), dot(r[2], g)]);
            for a in 0..4 {
                for b in 0..4 {
                    let (ga, gb) = (turned[a], turned[b]);
                    let shear = self.mu * dot(ga, gb);
                    let mut block = [[0.0; 3]; 3];
                    for i in 0..3 {
                        for j in 0..3 {
                            let s = self.lambda * ga[i] * gb[j] + self.mu * gb[i] * ga[j];
                            block[i][j] = e.volume * (s + if i == j { shear } else { 0.0 });
                        }
                    }
                    add(number, a, b, &block);
                }
            }
        }
    }
}

/// The rotation nearest to `f`, also for inverted elements.
fn rotation_of(f: &Mat3) -> Mat3 {
    let m = Matrix3::from_fn(|i, j| f[i][j]);
    let svd = m.svd(true, true);
    let (Some(mut u), Some(vt)) = (svd.u, svd.v_t) else {
        return signorini::math::IDENTITY;
    };
    if (u * vt).determinant() < 0.0 {
        let least = svd.singular_values.imin();
        for i in 0..3 {
            u[(i, least)] = -u[(i, least)];
        }
    }
    let r = u * vt;
    [0, 1, 2].map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]])
}

/// Signed volume of a tetrahedron `[m^3]`.
pub fn volume([a, b, c, d]: [Vec3; 4]) -> f64 {
    dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6.0
}
