//! Saint Venant-Kirchhoff membrane: constant strain per triangle, plane stress.

use signorini::math::{Mat3, Vec3, add_scaled, cross, dot, norm, scale, sub};

/// One triangle of a membrane.
#[derive(Clone, Debug)]
struct Element {
    face: [u32; 3],
    area: f64,
    /// Gradient of each vertex's shape function in the two material directions `[1/m]`.
    gradients: [[f64; 2]; 3],
}

/// Triangles with their rest shape and Lamé parameters `[N/m]`.
#[derive(Clone, Debug)]
pub struct Membrane {
    elements: Vec<Element>,
    lambda: f64,
    mu: f64,
}

/// Deformation gradient (two columns) and Green strain `(E11, E22, 2 E12)` and stress `(S11, S22, S12)` of a triangle.
struct Strain {
    columns: [Vec3; 2],
    strain: [f64; 3],
    stress: [f64; 3],
}

impl Membrane {
    /// From a rest state; `young` is the two-dimensional modulus `[N/m]`.
    pub fn new(rest: &[Vec3], faces: &[[u32; 3]], young: f64, poisson: f64) -> Membrane {
        let elements = faces
            .iter()
            .map(|&face| {
                let [a, b, c] = face.map(|v| rest[v as usize]);
                let (e1, e2) = (sub(b, a), sub(c, a));
                // Material axes: along the first edge and across it.
                let length = norm(e1);
                let along = dot(e1, e2) / length;
                let height = norm(cross(e1, e2)) / length;
                // Inverse of the matrix with columns (length, 0) and (along, height).
                let g1 = [1.0 / length, -along / (length * height)];
                let g2 = [0.0, 1.0 / height];
                let g0 = [-g1[0] - g2[0], -g1[1] - g2[1]];
                Element { face, area: 0.5 * length * height, gradients: [g0, g1, g2] }
            })
            .collect();
        let lambda = young * poisson / (1.0 - poisson * poisson);
        Membrane { elements, lambda, mu: young / (2.0 * (1.0 + poisson)) }
    }

    /// Vertices of each triangle.
    pub fn stencils(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.elements.iter().map(|e| e.face)
    }

    /// Lumped mass per vertex of a sheet of this `density` `[kg/m^2]`, added to `masses`.
    pub fn add_masses(&self, density: f64, masses: &mut [f64]) {
        for e in &self.elements {
            for v in e.face {
                masses[v as usize] += density * e.area / 3.0;
            }
        }
    }

    fn strain(&self, e: &Element, x: &[Vec3]) -> Strain {
        let mut columns = [[0.0; 3]; 2];
        for (v, g) in e.face.iter().zip(&e.gradients) {
            for (column, slope) in columns.iter_mut().zip(g) {
                *column = add_scaled(*column, *slope, x[*v as usize]);
            }
        }
        let [f1, f2] = columns;
        let strain = [0.5 * (dot(f1, f1) - 1.0), 0.5 * (dot(f2, f2) - 1.0), dot(f1, f2)];
        let trace = self.lambda * (strain[0] + strain[1]);
        let stress = [trace + 2.0 * self.mu * strain[0], trace + 2.0 * self.mu * strain[1], self.mu * strain[2]];
        Strain { columns, strain, stress }
    }

    /// Elastic energy `[J]`.
    pub fn energy(&self, x: &[Vec3]) -> f64 {
        let density = |s: Strain| (0..3).map(|i| 0.5 * s.strain[i] * s.stress[i]).sum::<f64>();
        self.elements.iter().map(|e| e.area * density(self.strain(e, x))).sum()
    }

    /// Adds the force, the negative gradient of the energy `[N]`.
    pub fn add_forces(&self, x: &[Vec3], forces: &mut [Vec3]) {
        for e in &self.elements {
            let Strain { columns: [f1, f2], stress: [s11, s22, s12], .. } = self.strain(e, x);
            let p1 = add_scaled(scale(s11, f1), s12, f2);
            let p2 = add_scaled(scale(s12, f1), s22, f2);
            for (v, g) in e.face.iter().zip(&e.gradients) {
                let f = &mut forces[*v as usize];
                *f = add_scaled(add_scaled(*f, -e.area * g[0], p1), -e.area * g[1], p2);
            }
        }
    }

    /// Calls `add(element, a, b, block)` with the blocks of the stiffness `-dF/dx` `[N/m]`, made positive semi-definite
    /// by leaving compressive stress out of the geometric part.
    pub fn add_stiffness(&self, x: &[Vec3], mut add: impl FnMut(usize, usize, usize, &Mat3)) {
        for (number, e) in self.elements.iter().enumerate() {
            let Strain { columns: [f1, f2], stress, .. } = self.strain(e, x);
            let tension = tensile_part(stress);
            let modulus = self.lambda + 2.0 * self.mu;
            // Rows of the strain derivative per vertex: dE11 = g1 f1, dE22 = g2 f2, d(2 E12) = g1 f2 + g2 f1.
            let rows = e.gradients.map(|g| [scale(g[0], f1), scale(g[1], f2), add_scaled(scale(g[0], f2), g[1], f1)]);
            for a in 0..3 {
                for b in 0..3 {
                    let (ga, gb) = (e.gradients[a], e.gradients[b]);
                    let geometric = ga[0] * (tension[0] * gb[0] + tension[2] * gb[1])
                        + ga[1] * (tension[2] * gb[0] + tension[1] * gb[1]);
                    let mut block = [[0.0; 3]; 3];
                    for i in 0..3 {
                        for j in 0..3 {
                            let (ra, rb) = (&rows[a], &rows[b]);
                            let material = ra[0][i] * (modulus * rb[0][j] + self.lambda * rb[1][j])
                                + ra[1][i] * (self.lambda * rb[0][j] + modulus * rb[1][j])
                                + ra[2][i] * self.mu * rb[2][j];
                            block[i][j] = e.area * (material + if i == j { geometric } else { 0.0 });
                        }
                    }
                    add(number, a, b, &block);
                }
            }
        }
    }
}

/// The part of a symmetric 2x2 matrix `(m11, m22, m12)` with the negative eigenvalues set to zero.
fn tensile_part([m11, m22, m12]: [f64; 3]) -> [f64; 3] {
    let (mean, half) = (0.5 * (m11 + m22), 0.5 * (m11 - m22));
    let radius = half.hypot(m12);
    let (high, low) = (mean + radius, mean - radius);
    if low >= 0.0 {
        return [m11, m22, m12];
    }
    if high <= 0.0 {
        return [0.0; 3];
    }
    // high times the projector on its eigenvector, (M - low I) / (high - low).
    let s = high / (high - low);
    [s * (m11 - low), s * (m22 - low), s * m12]
}
