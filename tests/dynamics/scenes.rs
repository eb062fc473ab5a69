//! Small worlds of bodies that the library drives.

use signorini::energy::{Damping, SheetMaterial, SolidMaterial};
use signorini::math::Vec3;
use signorini::model::Settings;
use signorini::parallel::Par;
use signorini::world::{BodyOptions, NodeForces, SheetDescription, SheetModel, SolidDescription, Topology, World};

pub const NO_DAMPING: Damping = Damping { mass_rate: 0.0, stretch_time: 0.0, bending_time: 0.0 };

pub fn options() -> BodyOptions {
    BodyOptions { half_thickness: Some(1e-3), ..BodyOptions::default() }
}

pub fn sheet_material() -> SheetMaterial {
    SheetMaterial {
        density: 200.0,
        thickness: 1e-3,
        young_modulus: 1e6,
        poisson_ratio: 0.0,
        bending_stiffness: None,
        flat: false,
        rest_scale: 1.0,
        damping: NO_DAMPING,
    }
}

pub fn solid_material() -> SolidMaterial {
    SolidMaterial { density: 1000.0, young_modulus: 1e6, poisson_ratio: 0.0, rest_scale: 1.0, damping: NO_DAMPING }
}

/// A grid of `columns` x `rows` cells in the plane z = 0, diagonals alternating.
pub fn grid(columns: u32, rows: u32, width: f64, depth: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |i: u32, j: u32| j * (columns + 1) + i;
    let mut points = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            points.push([width * f64::from(i) / f64::from(columns), depth * f64::from(j) / f64::from(rows), 0.0]);
        }
    }
    let mut faces = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if (i + j) % 2 == 0 {
                faces.extend([[a, b, c], [a, c, d]]);
            } else {
                faces.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    (points, faces)
}

/// A box of `cells` cubes of five tetrahedra each.
pub fn block(cells: [u32; 3], size: Vec3, origin: Vec3) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let [nx, ny, nz] = cells;
    let at = |i: u32, j: u32, k: u32| (k * (ny + 1) + j) * (nx + 1) + i;
    let mut points = Vec::new();
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                let f = [f64::from(i) / f64::from(nx), f64::from(j) / f64::from(ny), f64::from(k) / f64::from(nz)];
                points.push(std::array::from_fn(|c| origin[c] + size[c] * f[c]));
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let odd = (i + j + k) % 2;
                let v = |c: u32| at(i + ((c & 1) ^ odd), j + (c >> 1 & 1), k + (c >> 2));
                tetrahedra.extend([
                    [v(0), v(1), v(2), v(4)],
                    [v(3), v(1), v(2), v(7)],
                    [v(5), v(1), v(4), v(7)],
                    [v(6), v(2), v(4), v(7)],
                    [v(1), v(2), v(4), v(7)],
                ]);
            }
        }
    }
    (points, tetrahedra)
}

pub fn sheet(
    (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>),
    material: SheetMaterial,
    model: SheetModel,
    forces: NodeForces,
) -> SheetDescription {
    let topology = Topology { triangles, ..Topology::default() };
    SheetDescription { options: options(), positions, rest: Vec::new(), topology, material, model, forces }
}

pub fn solid(
    (positions, tetrahedra): (Vec<Vec3>, Vec<[u32; 4]>),
    material: SolidMaterial,
    forces: NodeForces,
) -> SolidDescription {
    SolidDescription {
        options: BodyOptions { self_collision: false, ..options() },
        positions,
        rest: Vec::new(),
        tetrahedra,
        embedded: None,
        material,
        host_driven: false,
        forces,
    }
}

pub fn run(world: &mut World, dt: f64, steps: usize) {
    for step in 0..steps {
        let report = world.step(&Settings::default(), dt, Par::Serial);
        let report = report.unwrap_or_else(|failure| panic!("step {step}: {:?}", failure.error));
        assert!(!report.not_converged, "step {step}: {report:?}");
    }
}
