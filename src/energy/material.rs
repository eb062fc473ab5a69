//! Materials in physical units, and the energies that they give a mesh.

use super::{CorotationalTetrahedron, Damping, Forces, Hinge, Spring, TriangleMembrane};
use crate::math::{Vec3, cross, norm, sub};
use crate::mesh::{TetMesh, hinges};

/// A thin sheet: cloth, paper, metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetMaterial {
    /// Density `[kg/m^3]`.
    pub density: f64,
    /// Thickness h of the material `[m]`; what contact keeps apart is another number.
    pub thickness: f64,
    /// Young's modulus E `[Pa]`.
    pub young_modulus: f64,
    /// Poisson's ratio in `[0, 0.5)`.
    pub poisson_ratio: f64,
    /// Bending stiffness D `[N m]`; `None`: that of a plate, `E h^3 / (12 (1 - nu^2))`.
    pub bending_stiffness: Option<f64>,
    /// Whether it is flat at rest, whatever the rest shape.
    pub flat: bool,
    /// Rest lengths over those of the rest shape; below 1 for a garment that is tighter than drawn.
    pub rest_scale: f64,
    /// Damping.
    pub damping: Damping,
}

/// A solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidMaterial {
    /// Density `[kg/m^3]`.
    pub density: f64,
    /// Young's modulus E `[Pa]`.
    pub young_modulus: f64,
    /// Poisson's ratio in `[0, 0.5)`.
    pub poisson_ratio: f64,
    /// Rest lengths over those of the mesh.
    pub rest_scale: f64,
    /// Damping.
    pub damping: Damping,
}

/// What a mesh cannot be made of: what, place and value.
pub type MaterialFault = (&'static str, usize, f64);

impl SheetMaterial {
    /// Bending stiffness D in use `[N m]`.
    pub fn bending(&self) -> f64 {
        let plate = self.young_modulus * self.thickness.powi(3) / (12.0 * (1.0 - self.poisson_ratio.powi(2)));
        self.bending_stiffness.unwrap_or(plate)
    }

    /// Errors: a number out of its range.
    pub fn check(&self) -> Result<(), MaterialFault> {
        check_positive(&[self.density, self.thickness, self.young_modulus, self.rest_scale])?;
        check_poisson(self.poisson_ratio)?;
        let bending = self.bending();
        if !(bending >= 0.0 && bending.is_finite()) {
            return Err(("a bending stiffness is finite and not negative", 0, bending));
        }
        check_damping(&self.damping)
    }

    /// Lumped masses: a third of each face's mass to each of its vertices `[kg]`.
    ///
    /// Errors: a vertex of no face, which has no mass.
    pub fn lumped_masses(&self, rest: &[Vec3], faces: &[[u32; 3]]) -> Result<Vec<f64>, MaterialFault> {
        let mut masses = vec![0.0; rest.len()];
        for f in faces {
            let share = self.density * self.thickness * area(rest, f) / 3.0;
            f.iter().for_each(|v| masses[*v as usize] += share);
        }
        match masses.iter().position(|m| !(*m > 0.0 && m.is_finite())) {
            Some(i) => Err(("a vertex has no mass: it belongs to no face of positive area", i, masses[i])),
            None => Ok(masses),
        }
    }

    /// Discrete shell: constant-strain membranes, and a hinge per inner edge.
    ///
    /// Errors: material out of range; a face without area, with its number. Cost: a sort of the edges.
    pub fn shell(&self, rest: &[Vec3], faces: &[[u32; 3]]) -> Result<Forces, MaterialFault> {
        self.check()?;
        let mut forces = Forces { damping: self.damping, ..Forces::default() };
        for (i, f) in faces.iter().enumerate() {
            let corners = f.map(|v| rest[v as usize]);
            let (h, e, nu) = (self.thickness, self.young_modulus, self.poisson_ratio);
            match TriangleMembrane::new(&corners, h, e, nu, self.rest_scale) {
                Some(membrane) => forces.membranes.push(*f, membrane),
                None => return Err(("a face has no area at rest", i, area(rest, f))),
            }
        }
        self.add_hinges(rest, faces, &mut forces);
        Ok(forces)
    }

    fn add_hinges(&self, rest: &[Vec3], faces: &[[u32; 3]], forces: &mut Forces) {
        let bending = self.bending();
        if bending == 0.0 {
            return;
        }
        for nodes in hinges(faces) {
            if let Some(hinge) = Hinge::new(&nodes.map(|v| rest[v as usize]), bending, self.flat) {
                forces.hinges.push(nodes, hinge);
            }
        }
    }

    /// Mass-spring cloth [Provot95, Bridson02]: a spring per edge for stretch and shear, one across each inner edge for
    /// bending.
    ///
    /// An edge spring has `k = E h (areas of its faces) / L^2`, which gives a sheet Young's modulus E on regular meshes
    /// [VanGelder98, triangle meshes]; Poisson's ratio is whatever the mesh makes of it. A bending spring has
    /// `k = bend_ratio` times that of the edge that it crosses, and 0 leaves them out; a bending stiffness that is
    /// given (not that of the plate) adds hinges. Errors and cost as for the shell.
    pub fn mass_spring(&self, rest: &[Vec3], faces: &[[u32; 3]], bend_ratio: f64) -> Result<Forces, MaterialFault> {
        self.check()?;
        if !(bend_ratio >= 0.0 && bend_ratio.is_finite()) {
            return Err(("a bend ratio is finite and not negative", 0, bend_ratio));
        }
        let mut forces = Forces { damping: self.damping, ..Forces::default() };
        let mut sides: Vec<([u32; 2], usize)> = Vec::with_capacity(3 * faces.len());
        for (i, f) in faces.iter().enumerate() {
            if area(rest, f).partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
                return Err(("a face has no area at rest", i, area(rest, f)));
            }
            for k in 0..3 {
                let (a, b) = (f[k], f[(k + 1) % 3]);
                sides.push(([a.min(b), a.max(b)], i));
            }
        }
        sides.sort_unstable();
        let length = |[a, b]: [u32; 2]| norm(sub(rest[b as usize], rest[a as usize]));
        let stiffness = |edge: [u32; 2]| {
            let first = sides.partition_point(|s| s.0 < edge);
            let areas: f64 = sides[first..].iter().take_while(|s| s.0 == edge).map(|s| area(rest, &faces[s.1])).sum();
            self.young_modulus * self.thickness * areas / length(edge).powi(2)
        };
        let spring = |ends: [u32; 2], stiffness| Spring { stiffness, rest_length: self.rest_scale * length(ends) };
        for (i, (edge, _)) in sides.iter().enumerate() {
            if i == 0 || sides[i - 1].0 != *edge {
                forces.springs.push(*edge, spring(*edge, stiffness(*edge)));
            }
        }
        if self.bending_stiffness.is_some() {
            self.add_hinges(rest, faces, &mut forces);
        }
        for [e0, e1, a, b] in hinges(faces) {
            if bend_ratio > 0.0 && a != b {
                let crossed = stiffness([e0.min(e1), e0.max(e1)]);
                forces.springs.push([a, b], spring([a, b], bend_ratio * crossed));
            }
        }
        Ok(forces)
    }
}

impl SolidMaterial {
    /// Errors: a number out of its range.
    pub fn check(&self) -> Result<(), MaterialFault> {
        check_positive(&[self.density, self.young_modulus, self.rest_scale])?;
        check_poisson(self.poisson_ratio)?;
        check_damping(&self.damping)
    }

    /// Co-rotational tetrahedra. Errors: material out of range; an element whose scaled volume cannot be represented.
    pub fn solid(&self, mesh: &TetMesh) -> Result<Forces, MaterialFault> {
        self.check()?;
        let mut forces = Forces { damping: self.damping, ..Forces::default() };
        for (i, nodes) in mesh.tetrahedra.iter().enumerate() {
            let corners = mesh.corners(i).map(|p| crate::math::scale(self.rest_scale, p));
            match CorotationalTetrahedron::new(&corners, self.young_modulus, self.poisson_ratio) {
                Some(element) => forces.tetrahedra.push(*nodes, element),
                None => return Err(("the volume of a tetrahedron cannot be represented", i, mesh.volume(i))),
            }
        }
        Ok(forces)
    }
}

fn area(rest: &[Vec3], f: &[u32; 3]) -> f64 {
    let [a, b, c] = f.map(|v| rest[v as usize]);
    0.5 * norm(cross(sub(b, a), sub(c, a)))
}

fn check_positive(values: &[f64]) -> Result<(), MaterialFault> {
    match values.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        Some(value) => Err(("density, thickness, Young's modulus and rest scale are positive and finite", 0, *value)),
        None => Ok(()),
    }
}

fn check_poisson(ratio: f64) -> Result<(), MaterialFault> {
    if (0.0..0.5).contains(&ratio) { Ok(()) } else { Err(("Poisson's ratio is at least 0 and below 0.5", 0, ratio)) }
}

fn check_damping(damping: &Damping) -> Result<(), MaterialFault> {
    damping.fault().map_or(Ok(()), |value| Err(("damping is finite and not negative", 0, value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> SheetMaterial {
        SheetMaterial {
            density: 200.0,
            thickness: 1e-3,
            young_modulus: 1e5,
            poisson_ratio: 0.25,
            bending_stiffness: None,
            flat: false,
            rest_scale: 1.0,
            damping: Damping::default(),
        }
    }

    /// A strip of equilateral triangles along x, `length` of them per row.
    fn equilateral(columns: u32, rows: u32, a: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let (mut rest, mut faces) = (Vec::new(), Vec::new());
        for j in 0..=rows {
            for i in 0..=columns {
                let shift = if j % 2 == 1 { 0.5 } else { 0.0 };
                rest.push([a * (f64::from(i) + shift), a * 0.75_f64.sqrt() * f64::from(j), 0.0]);
            }
        }
        let at = |i: u32, j: u32| j * (columns + 1) + i;
        for j in 0..rows {
            for i in 0..columns {
                if j % 2 == 0 {
                    faces.extend([
                        [at(i, j), at(i + 1, j), at(i, j + 1)],
                        [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)],
                    ]);
                } else {
                    faces.extend([
                        [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                        [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                    ]);
                }
            }
        }
        (rest, faces)
    }

    #[test]
    fn a_shell_bent_to_a_cylinder_has_the_energy_of_the_plate() {
        let (rest, faces) = equilateral(40, 40, 0.02);
        let material = sheet();
        let forces = material.shell(&rest, &faces).unwrap();
        let curvature = 0.1;
        for direction in [[1.0, 0.0], [0.0, 1.0], [0.8, 0.6]] {
            let bent: Vec<Vec3> = rest
                .iter()
                .map(|p| {
                    let s = direction[0] * p[0] + direction[1] * p[1];
                    [p[0], p[1], 0.5 * curvature * s * s]
                })
                .collect();
            let area: f64 = faces.iter().map(|f| super::area(&rest, f)).sum();
            let plate = 0.5 * material.bending() * curvature * curvature * area;
            let ratio = forces.hinges.energy(&bent) / plate;
            assert!((ratio - 1.0).abs() < 0.05, "{direction:?}: {ratio}");
        }
    }

    #[test]
    fn a_stretched_spring_sheet_has_youngs_modulus() {
        let (rest, faces) = equilateral(60, 60, 0.02);
        let forces = sheet().mass_spring(&rest, &faces, 0.0).unwrap();
        // Poisson's ratio of a triangular lattice is 1/3: let the sheet contract so, then the energy is that of plane
        // stress under uniaxial tension.
        let strain = 1e-4;
        let x: Vec<Vec3> = rest.iter().map(|p| [p[0] * (1.0 + strain), p[1] * (1.0 - strain / 3.0), 0.0]).collect();
        let area: f64 = faces.iter().map(|f| super::area(&rest, f)).sum();
        let expected = 0.5 * sheet().young_modulus * sheet().thickness * strain * strain * area;
        let ratio = forces.springs.energy(&x) / expected;
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        assert!((sheet().lumped_masses(&rest, &faces).unwrap().iter().sum::<f64>() - 0.2 * area).abs() < 1e-12);
    }

    #[test]
    fn faults_are_named() {
        let rest = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];
        let faces = [[0, 1, 2], [0, 1, 3]];
        assert_eq!(sheet().shell(&rest, &faces).unwrap_err().1, 1);
        assert_eq!(sheet().mass_spring(&rest, &faces, 0.0).unwrap_err().1, 1);
        assert_eq!(sheet().lumped_masses(&rest, &faces[..1]).unwrap_err().1, 3);
        let bad = SheetMaterial { poisson_ratio: 0.5, ..sheet() };
        assert_eq!(bad.shell(&rest, &faces[..1]).unwrap_err().2, 0.5);
        assert_eq!(sheet().mass_spring(&rest, &faces[..1], -1.0).unwrap_err().2, -1.0);
        let mesh = TetMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], vec![[0, 1, 2, 3]]);
        let solid = SolidMaterial {
            density: 1000.0,
            young_modulus: -1.0,
            poisson_ratio: 0.3,
            rest_scale: 1.0,
            damping: Damping::default(),
        };
        assert_eq!(solid.solid(&mesh.unwrap()).unwrap_err().2, -1.0);
    }
}
