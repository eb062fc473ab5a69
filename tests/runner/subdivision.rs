//! Finer frames: Loop's subdivision where there is room for it, and no crossings where there is not.

use crate::command::{Folder, report};
use crate::outputs::{Group, read_obj};
use signorini::detection::Primitives;
use signorini::detection::intersection::find;
use signorini::mesh::Surface;
use signorini::parallel::Par;
use std::collections::BTreeMap;

/// A cloth over a block with sharp edges.
const OVER_A_BLOCK: &str = r#"
title = "A cloth over a block"
dt = 0.01
duration = 0.3
[output]
frames_per_second = 20.0
[[sheet]]
name = "cloth"
mesh.grid = { cells = [12, 12], size = [0.6, 0.6] }
placement.position = [0.01, 0.02, 0.153]
half_thickness = 0.001
friction = 0.3
material = { density = 300.0, thickness = 0.001, young_modulus = 1e5, poisson_ratio = 0.3, bending_stiffness = 1e-5 }
[[rigid]]
name = "block"
mesh.box = { size = [0.3, 0.3, 0.15] }
placement.position = [0.0, 0.0, 0.0755]
half_thickness = 0.001
density = 1000.0
[[half_space]]
name = "ground"
normal = [0.0, 0.0, 1.0]
half_thickness = 0.001
"#;

/// Loop's subdivision once more, vertex by vertex from its definition.
fn loop_subdivision((name, positions, faces): &Group) -> Group {
    let mut across: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for [a, b, c] in faces {
        for (a, b, c) in [(a, b, c), (b, c, a), (c, a, b)] {
            across.entry([*a.min(b), *a.max(b)]).or_default().push(*c);
        }
    }
    let sum = |parts: &[(f64, u32)]| {
        let part = |k: usize| parts.iter().map(|(share, v)| share * positions[*v as usize][k]).sum::<f64>();
        [part(0), part(1), part(2)]
    };
    let number: BTreeMap<[u32; 2], u32> = across.keys().copied().zip(positions.len() as u32..).collect();
    let mut finer: Vec<[f64; 3]> = (0..positions.len() as u32)
        .map(|v| {
            let other = |edge: &[u32; 2]| edge[0] + edge[1] - v;
            let around: Vec<&[u32; 2]> = across.keys().filter(|edge| edge.contains(&v)).collect();
            let border: Vec<u32> =
                around.iter().filter(|edge| across[**edge].len() == 1).map(|edge| other(edge)).collect();
            if let [a, b] = border[..] {
                return sum(&[(0.75, v), (0.125, a), (0.125, b)]);
            }
            let n = around.len() as f64;
            let beta = (0.625 - (0.375 + 0.25 * (std::f64::consts::TAU / n).cos()).powi(2)) / n;
            let mut parts = vec![(1.0 - n * beta, v)];
            parts.extend(around.iter().map(|edge| (beta, other(edge))));
            sum(&parts)
        })
        .collect();
    finer.extend(across.iter().map(|(&[a, b], corners)| match corners[..] {
        [c, d] => sum(&[(0.375, a), (0.375, b), (0.125, c), (0.125, d)]),
        _ => sum(&[(0.5, a), (0.5, b)]),
    }));
    let middle = |a: u32, b: u32| number[&[a.min(b), a.max(b)]];
    let four = |&[a, b, c]: &[u32; 3]| {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    (name.clone(), finer, faces.iter().flat_map(four).collect())
}

/// Faces of a file's groups count over all its vertices; here over the group's own.
fn own_numbers(groups: Vec<Group>) -> Vec<Group> {
    let mut first = 0;
    let renumbered = groups.into_iter().map(|(name, positions, faces)| {
        let faces = faces.iter().map(|face| face.map(|v| v - first)).collect();
        first += positions.len() as u32;
        (name, positions, faces)
    });
    renumbered.collect()
}

fn intersections(groups: &[Group]) -> usize {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for (_, points, triangles) in groups {
        let first = positions.len() as u32;
        positions.extend_from_slice(points);
        faces.extend(triangles.iter().map(|face| face.map(|v| v + first)));
    }
    let surface = Surface::from_triangles(positions, faces).unwrap();
    let primitives = Primitives { vertices: &surface.vertices, edges: &surface.edges, faces: &surface.faces };
    find(&primitives, &surface.rest, &|_, _| true, Par::Serial).len()
}

#[test]
fn finer_frames_are_those_of_loop_and_cross_nothing() {
    let folder = Folder::new("subdivide");
    folder.file("scene.toml", OVER_A_BLOCK);
    report(&folder, &["scene.toml", "--out", "out", "--subdivide", "1"]);
    let (mut free, mut moved, mut crossing) = (0, 0, 0);
    for step in (0..=30).step_by(5) {
        let read = |kind: &str| own_numbers(read_obj(&folder.read(&format!("out/{kind}/frame_{step:06}.obj"))));
        let (coarse, fine) = (read("frames"), read("subdivided"));
        assert_eq!(fine.iter().map(|g| g.0.as_str()).collect::<Vec<_>>(), ["cloth", "block"]);
        assert_eq!(fine[1], coarse[1], "rigid bodies stay as they are");
        assert_eq!(intersections(&fine), 0, "{step}");
        let plain = loop_subdivision(&coarse[0]);
        assert_eq!(fine[0].2, plain.2);
        let distance = |(x, y): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt();
        let distances: Vec<f64> = fine[0].1.iter().zip(&plain.1).map(distance).collect();
        free += distances.iter().filter(|d| **d < 1e-9).count();
        moved += distances.iter().filter(|d| **d > 1e-4).count();
        // A vertex moves by less than the length of an edge.
        assert!(distances.iter().all(|d| *d < 0.05), "{step}");
        crossing += usize::from(intersections(&[plain, coarse[1].clone()]) > 0);
    }
    println!(
        "{free} vertices where Loop has them, {moved} held back; without constraints {crossing} of 7 frames cross"
    );
    assert!(free > 1000 && moved > 10 && crossing > 2, "{free} {moved} {crossing}");
}

#[test]
fn two_levels_are_finer_still() {
    let folder = Folder::new("subdivide-twice");
    folder.file("scene.toml", OVER_A_BLOCK);
    report(&folder, &["scene.toml", "--out", "out", "--subdivide", "2", "--steps", "10"]);
    let groups = own_numbers(read_obj(&folder.read("out/subdivided/frame_000010.obj")));
    assert_eq!(groups[0].2.len(), 16 * 2 * 144);
    assert_eq!(intersections(&groups), 0);
    // Frames of a longer run that a later one does not reach are removed.
    report(&folder, &["scene.toml", "--out", "out", "--subdivide", "1", "--steps", "5"]);
    assert!(!folder.0.join("out/subdivided/frame_000010.obj").exists());
}
