//! Meshes made from formulas.

use signorini::math::{Vec3, add, cross, dot, norm, scale, sub};

/// Triangles over vertices.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    pub positions: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
}

/// Tetrahedra over vertices, positively oriented.
#[derive(Clone, Debug, Default)]
pub struct Tetrahedra {
    pub positions: Vec<Vec3>,
    pub tetrahedra: Vec<[u32; 4]>,
}

/// `n` x `n` vertices of a square of side `size` in the plane z = 0, centred on 0, diagonals alternating.
pub fn cloth_grid(n: usize, size: f64) -> Triangles {
    let at = |i: usize| -0.5 * size + size * i as f64 / (n - 1) as f64;
    let positions = (0..n * n).map(|k| [at(k / n), at(k % n), 0.0]).collect();
    let mut faces = Vec::with_capacity(2 * (n - 1) * (n - 1));
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let v = |di: usize, dj: usize| ((i + di) * n + j + dj) as u32;
            let (a, b, c, d) = (v(0, 0), v(1, 0), v(1, 1), v(0, 1));
            faces.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    Triangles { positions, faces }
}

/// An icosahedron refined `level` times, vertices on the sphere, faces seen counter-clockwise from outside.
pub fn sphere(centre: Vec3, radius: f64, level: usize) -> Triangles {
    let p = 0.5 * (1.0 + 5f64.sqrt());
    let mut unit: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, p), (-1.0, p), (1.0, -p), (-1.0, -p)] {
        unit.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]]);
    }
    // The faces of the hull are the triples of vertices at edge distance 2 from one another.
    let mut faces = Vec::new();
    let adjacent = |i: usize, j: usize| (norm(sub(unit[i], unit[j])) - 2.0).abs() < 1e-9;
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if adjacent(i, j) && adjacent(j, k) && adjacent(i, k) {
                    let outward = dot(cross(sub(unit[j], unit[i]), sub(unit[k], unit[i])), unit[i]) > 0.0;
                    faces.push(if outward { [i as u32, j as u32, k as u32] } else { [i as u32, k as u32, j as u32] });
                }
            }
        }
    }
    for _ in 0..level {
        let mut middles = std::collections::BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * faces.len());
        for &[a, b, c] in &faces {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    unit.push(scale(0.5, add(unit[i as usize], unit[j as usize])));
                    unit.len() as u32 - 1
                })
            };
            let (x, y, z) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, x, z], [b, y, x], [c, z, y], [x, y, z]]);
        }
        faces = finer;
    }
    let positions = unit.iter().map(|u| add(centre, scale(radius / norm(*u), *u))).collect();
    Triangles { positions, faces }
}

/// An axis-aligned box of `cells` cubes of side `cell` with one corner at `corner`, six tetrahedra per cube.
pub fn solid_box(corner: Vec3, cells: [usize; 3], cell: f64) -> Tetrahedra {
    let [nx, ny, nz] = cells;
    let at = |i: usize, j: usize, k: usize| ((i * (ny + 1) + j) * (nz + 1) + k) as u32;
    let mut mesh = Tetrahedra::default();
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                mesh.positions.push(add(corner, scale(cell, [i as f64, j as f64, k as f64])));
            }
        }
    }
    // Kuhn's division: one tetrahedron per order in which the three axes are walked from corner to corner.
    for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
        for i in 0..nx {
            for j in 0..ny {
                for k in 0..nz {
                    let mut corner = [i, j, k];
                    let mut walk = [0u32; 4];
                    walk[0] = at(i, j, k);
                    for (step, &axis) in order.iter().enumerate() {
                        corner[axis] += 1;
                        walk[step + 1] = at(corner[0], corner[1], corner[2]);
                    }
                    let edge = |n: usize| sub(mesh.positions[walk[n] as usize], mesh.positions[walk[0] as usize]);
                    if dot(cross(edge(1), edge(2)), edge(3)) < 0.0 {
                        walk.swap(2, 3);
                    }
                    mesh.tetrahedra.push(walk);
                }
            }
        }
    }
    mesh
}

/// Faces of tetrahedra that belong to one tetrahedron only, seen counter-clockwise from outside.
pub fn boundary_faces(tetrahedra: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces: Vec<([u32; 3], [u32; 3])> = Vec::with_capacity(4 * tetrahedra.len());
    for &[a, b, c, d] in tetrahedra {
        for face in [[a, c, b], [a, b, d], [a, d, c], [b, c, d]] {
            let mut key = face;
            key.sort_unstable();
            faces.push((key, face));
        }
    }
    faces.sort_unstable();
    let alone =
        |i: usize| (i == 0 || faces[i - 1].0 != faces[i].0) && (i + 1 == faces.len() || faces[i + 1].0 != faces[i].0);
    (0..faces.len()).filter(|&i| alone(i)).map(|i| faces[i].1).collect()
}

/// Edges of faces, smaller index first, sorted, unique.
pub fn edges_of(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = faces
        .iter()
        .flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]])
        .map(|e| [e[0].min(e[1]), e[0].max(e[1])])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_surfaces_have_the_volume_of_their_formula() {
        let volume = |positions: &[Vec3], faces: &[[u32; 3]]| {
            faces
                .iter()
                .map(|f| {
                    let [a, b, c] = f.map(|v| positions[v as usize]);
                    dot(a, cross(b, c)) / 6.0
                })
                .sum::<f64>()
        };
        let ball = sphere([0.3, -0.2, 1.0], 0.5, 4);
        assert_eq!(ball.faces.len(), 20 * 256);
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((volume(&ball.positions, &ball.faces) / exact - 1.0).abs() < 0.005);
        let block = solid_box([0.1, 0.2, 0.3], [2, 3, 4], 0.1);
        assert_eq!((block.positions.len(), block.tetrahedra.len()), (60, 144));
        let faces = boundary_faces(&block.tetrahedra);
        assert!((volume(&block.positions, &faces) - 0.024).abs() < 1e-15);
        assert_eq!(edges_of(&faces).len() * 2, faces.len() * 3);
    }
}
