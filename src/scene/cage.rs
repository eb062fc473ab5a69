//! Coarse tetrahedra around a surface that they carry.

use super::mesh_source::{SourceMesh, lattice, used};
use crate::math::{Vec3, cross, dot, lerp, norm, sub};

/// Room around the surface, of the longest side of its box: rounding must not push a vertex out.
const MARGIN: f64 = 1e-3;

/// The cells of a lattice over the box of a closed surface that it meets or encloses, six tetrahedra each. Cells are as
/// large as fits the box, at most `cell` along each axis.
///
/// Errors: a surface without triangles, more cells than can be counted. Cost: cells times triangles.
pub fn cage(surface: &SourceMesh, cell: Vec3) -> Result<SourceMesh, String> {
    let corner = |pick: fn(f64, f64) -> f64, from: f64| {
        [0, 1, 2].map(|k| surface.positions.iter().map(|x| x[k]).fold(from, pick))
    };
    let (low, high) = (corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY));
    if surface.triangles.is_empty() {
        return Err("a cage goes around a surface with triangles".to_string());
    }
    let room = MARGIN * sub(high, low).into_iter().fold(0.0, f64::max);
    let (low, high) = (low.map(|c| c - room), high.map(|c| c + room));
    let extent = sub(high, low);
    let counts = [0, 1, 2].map(|k| ((extent[k] - 2.0 * room) / cell[k]).ceil().max(1.0));
    if counts.iter().product::<f64>() > 1e6 {
        return Err(format!("{counts:?} cells are too many"));
    }
    let cells = counts.map(|count| count as usize);
    let at = |u: Vec3| [0, 1, 2].map(|k| low[k] + u[k] * extent[k]);
    let mut mesh = lattice(cells, at);
    let tetrahedra = mesh.tetrahedra.chunks_exact(6).enumerate();
    mesh.tetrahedra = tetrahedra
        .filter(|(index, _)| {
            let place = [index / (cells[1] * cells[2]), index / cells[2] % cells[1], index % cells[2]];
            let corner = |step: f64| at([0, 1, 2].map(|k| (place[k] as f64 + step) / counts[k]));
            meets(surface, corner(0.0), corner(1.0)) || encloses(surface, corner(0.5))
        })
        .flat_map(|(_, six)| six.to_vec())
        .collect();
    let kept = used(&mesh.positions, mesh.tetrahedra.iter_mut().flatten());
    Ok(SourceMesh { positions: kept, ..mesh })
}

/// Whether a part of the surface lies in the box from `low` to `high`.
fn meets(surface: &SourceMesh, low: Vec3, high: Vec3) -> bool {
    surface.triangles.iter().any(|face| {
        let mut polygon: Vec<Vec3> = face.iter().map(|v| surface.positions[*v as usize]).collect();
        for k in 0..3 {
            polygon = clipped(&polygon, |x| x[k] - low[k]);
            polygon = clipped(&polygon, |x| high[k] - x[k]);
        }
        !polygon.is_empty()
    })
}

/// The part of a convex polygon where `inside` is not negative.
fn clipped(polygon: &[Vec3], inside: impl Fn(Vec3) -> f64) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (from, to) = (inside(*a), inside(b));
        if from >= 0.0 {
            out.push(*a);
        }
        if (from < 0.0) != (to < 0.0) {
            out.push(lerp(*a, b, from / (from - to)));
        }
    }
    out
}

/// Whether the surface winds around a point: by the solid angles of its faces.
fn encloses(surface: &SourceMesh, point: Vec3) -> bool {
    let angle = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| sub(surface.positions[v as usize], point));
        let (la, lb, lc) = (norm(a), norm(b), norm(c));
        let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        2.0 * dot(a, cross(b, c)).atan2(below)
    };
    surface.triangles.iter().map(angle).sum::<f64>().abs() > std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TetMesh;

    /// An L of three unit cubes, as a surface: the boundary of its tetrahedra.
    fn corner_piece() -> SourceMesh {
        let mut solid = lattice([2, 2, 1], |u| [2.0 * u[0], 2.0 * u[1], u[2]]);
        solid.tetrahedra.truncate(18);
        solid.positions = used(&solid.positions, solid.tetrahedra.iter_mut().flatten());
        let tets = TetMesh::new(solid.positions.clone(), solid.tetrahedra.clone()).unwrap();
        SourceMesh { triangles: tets.boundary().unwrap(), tetrahedra: Vec::new(), ..solid }
    }

    fn volume(mesh: &SourceMesh) -> f64 {
        let edge = |t: &[u32; 4], n: usize| sub(mesh.positions[t[n] as usize], mesh.positions[t[0] as usize]);
        mesh.tetrahedra.iter().map(|t| dot(cross(edge(t, 1), edge(t, 2)), edge(t, 3)) / 6.0).sum()
    }

    #[test]
    fn a_cage_holds_its_surface_and_little_else() {
        let surface = corner_piece();
        // Cells of half a unit: the cells of the missing cube that touch the two inner faces are met, the fourth part of
        // it in the corner is not.
        let cage = cage(&surface, [0.5; 3]).unwrap();
        assert_eq!(cage.tetrahedra.len() % 6, 0);
        let (v, all) = (volume(&cage), 4.0);
        assert!((3.0..all).contains(&v), "{v}");
        // Every vertex of the surface in some tetrahedron: all four volumes with it are positive.
        for x in &surface.positions {
            let holds = |t: &[u32; 4]| {
                (0..4).all(|n| {
                    let mut p = t.map(|v| cage.positions[v as usize]);
                    p[n] = *x;
                    dot(cross(sub(p[1], p[0]), sub(p[2], p[0])), sub(p[3], p[0])) >= -1e-12
                })
            };
            assert!(cage.tetrahedra.iter().any(holds), "{x:?}");
        }
        // Nothing loose, and a cell that no face meets, in the middle of a large box, belongs to it.
        assert!((0..cage.positions.len() as u32).all(|v| cage.tetrahedra.iter().flatten().any(|w| *w == v)));
        let block = lattice([1, 1, 1], |u| u);
        let tets = TetMesh::new(block.positions.clone(), block.tetrahedra.clone()).unwrap();
        let block = SourceMesh { triangles: tets.boundary().unwrap(), tetrahedra: Vec::new(), ..block };
        assert_eq!(super::cage(&block, [0.2; 3]).unwrap().tetrahedra.len(), 6 * 125);
        assert!(super::cage(&block, [1e-3; 3]).is_err());
    }
}
