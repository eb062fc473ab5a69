//! Finer frames for pictures: Loop's subdivision, constrained so that no surface passes through another.
//!
//! Each face becomes four, first in its own plane: the surface is the same, so what was clean is clean. From there the
//! vertices go where Loop's rules want them, as the velocities of one step: it ends as near as contact allows. Rigid and
//! scripted bodies stay as they are. [Otaduy09, section 6]

use super::build::Scene;
use super::frames::NamedSurface;
use super::mesh_source::used;
use crate::math::{Vec3, add, add_scaled, lerp, scale, sub};
use crate::model::Settings;
use crate::parallel::Par;
use crate::world::{BodyOptions, DeformableDescription, KinematicDescription, Topology, World, WorldError};

/// A surface whose faces are cut into four.
pub struct Refined {
    pub triangles: Vec<[u32; 3]>,
    /// Old vertices, then the middle of each edge.
    pub flat: Vec<Vec3>,
    /// Where Loop's rules put them.
    pub smooth: Vec<Vec3>,
}

/// An edge: its ends, and the corners across it in the first two faces that have it.
struct Edge {
    ends: [u32; 2],
    across: [Option<u32>; 2],
    faces: usize,
}

/// One level of Loop's subdivision, with his weights; edges of one face and of more than two are creases. Vertices of no
/// face stay. Cost: linear but for a sort of the edges.
pub fn refine(positions: &[Vec3], triangles: &[[u32; 3]]) -> Refined {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * triangles.len());
    for face in triangles {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], face[(k + 2) % 3]));
        }
    }
    sides.sort_unstable();
    let mut edges: Vec<Edge> = Vec::new();
    for (ends, across) in sides {
        match edges.last_mut() {
            Some(edge) if edge.ends == ends => {
                edge.across[1] = Some(across);
                edge.faces += 1;
            }
            _ => edges.push(Edge { ends, across: [Some(across), None], faces: 1 }),
        }
    }
    let middle_of = |a: u32, b: u32| {
        let ends = [a.min(b), a.max(b)];
        // Every side of a face is among the edges.
        (positions.len() + edges.binary_search_by_key(&ends, |edge| edge.ends).unwrap_or(0)) as u32
    };
    let mut finer = Vec::with_capacity(4 * triangles.len());
    for [a, b, c] in triangles.iter().copied() {
        let (ab, bc, ca) = (middle_of(a, b), middle_of(b, c), middle_of(c, a));
        finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    let at = |v: u32| positions[v as usize];
    let middles = edges.iter().map(|edge| lerp(at(edge.ends[0]), at(edge.ends[1]), 0.5));
    let flat: Vec<Vec3> = positions.iter().copied().chain(middles).collect();
    let mut smooth = old_vertices(positions, &edges);
    smooth.extend(edges.iter().map(|edge| {
        let sum = add(at(edge.ends[0]), at(edge.ends[1]));
        match (edge.across, edge.faces) {
            ([Some(c), Some(d)], 2) => add_scaled(scale(0.375, sum), 0.125, add(at(c), at(d))),
            _ => scale(0.5, sum),
        }
    }));
    Refined { triangles: finer, flat, smooth }
}

/// Old vertices by Loop's rules: inside by all neighbours, on a crease by the two along it, where creases meet not at all.
fn old_vertices(positions: &[Vec3], edges: &[Edge]) -> Vec<Vec3> {
    // Sums over neighbours and their number, of all edges and of creases.
    let mut all = vec![([0.0; 3], 0usize); positions.len()];
    let mut creases = all.clone();
    for edge in edges {
        for [v, other] in [edge.ends, [edge.ends[1], edge.ends[0]]].map(|ends| ends.map(|v| v as usize)) {
            for (sums, counts) in [(&mut all, true), (&mut creases, edge.faces != 2)] {
                if counts {
                    sums[v] = (add(sums[v].0, positions[other]), sums[v].1 + 1);
                }
            }
        }
    }
    let place = |v: usize| match (creases[v], all[v]) {
        ((along, 2), _) => add_scaled(scale(0.75, positions[v]), 0.125, along),
        ((_, 0), (around, n)) if n > 2 => {
            let share = 0.375 + 0.25 * (std::f64::consts::TAU / n as f64).cos();
            let beta = (0.625 - share * share) / n as f64;
            add_scaled(scale(1.0 - n as f64 * beta, positions[v]), beta, around)
        }
        _ => positions[v],
    };
    (0..positions.len()).map(place).collect()
}

/// The surfaces of a scene as it stands, sheets and solids subdivided so many times. Errors: what the world refuses, and
/// any intersection that the certificate finds.
///
/// Cost: a step of a world with four times the faces, for each level.
pub fn subdivided(scene: &Scene, levels: u32, settings: &Settings, par: Par) -> Result<Vec<NamedSurface>, String> {
    let mut surfaces = Vec::new();
    for body in &scene.bodies {
        let mut triangles = body.triangles.clone();
        let positions = scene.world.positions(body.id).map_err(|e| e.message)?;
        let positions = used(positions, triangles.iter_mut().flatten());
        surfaces.push(NamedSurface { name: body.name.clone(), positions, triangles });
    }
    for _ in 0..levels {
        let found = level(scene, &mut surfaces, settings, par).map_err(|e| e.message)?;
        if found > 0 {
            return Err(format!("the subdivided surfaces have {found} intersections"));
        }
    }
    surfaces.retain(|surface| !surface.triangles.is_empty());
    Ok(surfaces)
}

/// One level, from surfaces in the order of the scene's bodies. The number of intersections.
fn level(scene: &Scene, surfaces: &mut [NamedSurface], settings: &Settings, par: Par) -> Result<u32, WorldError> {
    let mut world = World::new();
    let mut moving = Vec::new();
    for (body, surface) in scene.bodies.iter().zip(surfaces.iter_mut()) {
        let half_thickness = Some(scene.world.body_info(body.id)?.half_thickness);
        let options = BodyOptions { material: 0, half_thickness, ..body.options };
        if surface.triangles.is_empty() {
            world.add_half_space(options, scene.world.half_space(body.id)?)?;
            continue;
        }
        if !body.deforms() {
            let topology = Topology { triangles: surface.triangles.clone(), ..Topology::default() };
            let vertices = surface.positions.clone();
            world.add_kinematic(KinematicDescription { options, vertices, topology, pose: None })?;
            continue;
        }
        let Refined { triangles, flat, smooth } = refine(&surface.positions, &surface.triangles);
        let velocities = smooth.iter().zip(&flat).map(|(to, from)| sub(*to, *from)).collect();
        let description = DeformableDescription {
            options,
            masses: vec![1.0; flat.len()],
            positions: flat,
            rest: Vec::new(),
            topology: Topology { triangles: triangles.clone(), ..Topology::default() },
            pinned: Vec::new(),
        };
        let id = world.add_deformable(description)?;
        world.push_velocities(id, velocities)?;
        surface.triangles = triangles;
        moving.push((id, surface));
    }
    // An end short of what Loop's rules ask for is no error: it is as clean.
    let report = world.step(settings, 1.0, par).map_err(|failure| failure.error)?;
    for (id, surface) in moving {
        surface.positions = world.positions(id)?.to_vec();
    }
    Ok(report.intersections.unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{dot, norm};

    #[test]
    fn weights_are_those_of_loop() {
        // A tetrahedron: three neighbours each, weight 3/16; across an edge 3/8 and 1/8.
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let fine = refine(&corners, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]);
        assert_eq!((fine.flat.len(), fine.triangles.len()), (10, 16));
        assert!(norm(sub(fine.smooth[0], [3.0 / 16.0; 3])) < 1e-15);
        // The edges are sorted: the first joins the corners 0 and 1.
        assert_eq!(fine.flat[4], [0.5, 0.0, 0.0]);
        assert!(norm(sub(fine.smooth[4], [0.375, 0.125, 0.125])) < 1e-15);
    }

    #[test]
    fn a_regular_sheet_keeps_quadratics_up_to_a_constant_inside_and_its_border_is_a_spline() {
        // Loop's scheme makes box splines on the regular triangulation: a quadratic at the vertices stays that quadratic
        // and a constant. Borders follow the cubic B-spline.
        let (n, height) = (6u32, |x: f64, y: f64| x * x + 0.5 * x * y - 0.25 * y * y);
        let point = |i: u32, j: u32| {
            let (x, y) = (f64::from(i) + 0.5 * f64::from(j), 0.75f64.sqrt() * f64::from(j));
            [x, y, height(x, y)]
        };
        let positions: Vec<Vec3> = (0..=n).flat_map(|j| (0..=n).map(move |i| point(i, j))).collect();
        let at = |i: u32, j: u32| j * (n + 1) + i;
        let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let two = |(i, j)| [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]];
        let faces: Vec<[u32; 3]> = cells.flat_map(two).collect();
        let fine = refine(&positions, &faces);
        let inside = |x: &Vec3| {
            let j = x[1] / 0.75f64.sqrt();
            let i = x[0] - 0.5 * j;
            [i, j].iter().all(|c| (0.9..=f64::from(n) - 0.9).contains(c))
        };
        let lifts: Vec<f64> = fine.smooth.iter().filter(|x| inside(x)).map(|x| x[2] - height(x[0], x[1])).collect();
        assert!(lifts.len() > 60, "{}", lifts.len());
        assert!(lifts.iter().all(|lift| (lift - lifts[0]).abs() < 1e-12 && *lift > 0.01), "{lifts:?}");
        // Vertex 2 of the lower border, between 1 and 3.
        let expected = (0..3).map(|k| 0.75 * positions[2][k] + 0.125 * (positions[1][k] + positions[3][k]));
        assert!(expected.zip(fine.smooth[2]).all(|(a, b)| (a - b).abs() < 1e-15));
        // A corner is a vertex of the border like others.
        let corner = add_scaled(scale(0.75, positions[0]), 0.125, add(positions[1], positions[7]));
        assert!(norm(sub(fine.smooth[0], corner)) < 1e-15);
    }

    #[test]
    fn faces_cover_the_same_surface_with_the_same_sides() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.1], [0.0, 1.0, 0.3], [1.0, 1.0, 0.7], [0.2, 0.3, 4.0]];
        let faces = [[0, 1, 2], [1, 3, 2], [1, 2, 4]];
        let fine = refine(&corners, &faces);
        let area = |positions: &[Vec3], face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            crate::math::cross(sub(b, a), sub(c, a))
        };
        for (face, four) in faces.iter().zip(fine.triangles.chunks(4)) {
            let whole = area(&corners, face);
            for part in four {
                assert!(norm(sub(scale(4.0, area(&fine.flat, part)), whole)) < 1e-14, "{part:?}");
                assert!(dot(area(&fine.flat, part), whole) > 0.0);
            }
        }
        // The edge of three faces is a crease.
        let crease = fine.flat.iter().position(|x| norm(sub(*x, [0.5, 0.5, 0.2])) < 1e-15).unwrap();
        assert_eq!(fine.smooth[crease], fine.flat[crease]);
    }
}
