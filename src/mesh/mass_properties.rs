//! Mass, centre of mass and inertia.

use super::surface::MeshError;
use super::{Surface, open_half_edges};
use crate::math::{Mat3, Vec3, ZERO_MATRIX, add, add_scaled, cross, dot, norm_squared, scale, sub};

/// Mass properties of a solid of uniform density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass `[kg]`.
    pub mass: f64,
    /// Centre of mass in the frame of the mesh or shape `[m]`.
    pub centre: Vec3,
    /// Inertia about the centre of mass, axes of the mesh or shape `[kg m^2]`.
    pub inertia: Mat3,
}

impl MassProperties {
    /// Of the volume that a closed, outward wound mesh bounds, for a density `[kg/m^3]`.
    ///
    /// Exact up to rounding: sums over tetrahedra from the mean vertex to each face. Errors: density not positive and
    /// finite; an edge without exactly one opposite; no positive volume (wound inward, or flat). Cost: `n log n`.
    pub fn of_closed_mesh(surface: &Surface, density: f64) -> Result<MassProperties, MeshError> {
        check_density(density)?;
        if let Some(edge) = open_half_edges(&surface.faces).first() {
            let message = "the mesh is not closed: an edge from this vertex has no single opposite";
            return Err(MeshError::new(edge[0] as usize, f64::from(edge[1]), message));
        }
        let count = surface.vertices.len().max(1) as f64;
        let at = |v: u32| surface.rest[v as usize];
        let mean = surface.vertices.iter().fold([0.0; 3], |s, v| add_scaled(s, 1.0 / count, at(*v)));
        let (mut volume, mut first, mut second) = (0.0, [0.0; 3], ZERO_MATRIX);
        for f in &surface.faces {
            let [a, b, c] = f.map(|v| sub(at(v), mean));
            // Six times the signed volume of the tetrahedron (0, a, b, c).
            let determinant = dot(a, cross(b, c));
            let sum = add(add(a, b), c);
            volume += determinant / 6.0;
            first = add_scaled(first, determinant / 24.0, sum);
            for i in 0..3 {
                for j in 0..3 {
                    let products = a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j];
                    second[i][j] += determinant / 120.0 * products;
                }
            }
        }
        if !(volume > 0.0 && volume.is_finite()) {
            return Err(MeshError::new(0, volume, "the mesh bounds no positive volume: flat, or wound inward"));
        }
        let offset = scale(1.0 / volume, first);
        let trace = second[0][0] + second[1][1] + second[2][2] - volume * norm_squared(offset);
        let mut inertia = ZERO_MATRIX;
        for i in 0..3 {
            for j in 0..3 {
                let about_centre = second[i][j] - volume * offset[i] * offset[j];
                inertia[i][j] = density * (if i == j { trace } else { 0.0 } - about_centre);
            }
        }
        Ok(MassProperties { mass: density * volume, centre: add(mean, offset), inertia })
    }
}

pub(super) fn check_density(density: f64) -> Result<(), MeshError> {
    if density > 0.0 && density.is_finite() {
        return Ok(());
    }
    Err(MeshError::new(0, density, "a density must be positive and finite"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_far_from_the_origin() {
        let origin = [1e3, -2e3, 5e2];
        let rest = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|x| add(x, origin));
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mesh = Surface::from_triangles(rest.to_vec(), faces.clone()).unwrap();
        let m = MassProperties::of_closed_mesh(&mesh, 6.0).unwrap();
        assert!((m.mass - 1.0).abs() < 1e-12);
        // Closed form for the corner tetrahedron: diagonal 2 (1/10 - 1/16), off the diagonal -(1/20 - 1/16).
        assert!(m.centre.iter().zip(origin).all(|(c, o)| (c - o - 0.25).abs() < 1e-12));
        for (i, row) in m.inertia.iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                let expected = if i == j { 0.075 } else { 0.0125 };
                assert!((found - expected).abs() < 1e-12, "{:?}", m.inertia);
            }
        }
        let inward = Surface::from_triangles(rest.to_vec(), faces.iter().map(|f| [f[1], f[0], f[2]]).collect());
        assert!(MassProperties::of_closed_mesh(&inward.unwrap(), 1.0).is_err());
        let open = Surface::from_triangles(rest.to_vec(), faces[1..].to_vec()).unwrap();
        assert!(MassProperties::of_closed_mesh(&open, 1.0).is_err());
        assert!(MassProperties::of_closed_mesh(&mesh, 0.0).is_err());
    }
}
