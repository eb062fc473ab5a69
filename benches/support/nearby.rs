//! Close pairs of primitives by a plain grid search, independent of the library's detection.

use signorini::math::{Vec3, add_scaled, cross, dot, norm, scale, sub};
use std::collections::BTreeMap;

/// A close pair: up to four vertices with signed weights; `sum w x` points from the second primitive to the first.
#[derive(Clone, Debug)]
pub struct Pair {
    pub vertices: [u32; 4],
    pub weights: [f64; 4],
    /// Unit normal.
    pub normal: Vec3,
    /// Distance `[m]`.
    pub distance: f64,
}

/// Surfaces to search: triangles and edges over one vertex list, with the body of each vertex.
pub struct Surfaces<'a> {
    pub faces: &'a [[u32; 3]],
    pub edges: &'a [[u32; 2]],
    /// Body of each vertex.
    pub body: &'a [u32],
    /// Whether pairs within this body count, per body.
    pub self_contact: &'a [bool],
    /// Whether the body is prescribed, per body; pairs of two prescribed bodies do not count.
    pub prescribed: &'a [bool],
}

impl Surfaces<'_> {
    fn counts(&self, a: u32, b: u32) -> bool {
        let (a, b) = (self.body[a as usize] as usize, self.body[b as usize] as usize);
        if a == b { self.self_contact[a] } else { !(self.prescribed[a] && self.prescribed[b]) }
    }
}

type Cells = BTreeMap<[i32; 3], Vec<u32>>;

/// Calls `visit` for every cell of side `cell` that the bounding box of the points, widened by `range`, touches.
fn cells_of(points: &[Vec3], range: f64, cell: f64, mut visit: impl FnMut([i32; 3])) {
    let bound = |c: usize, sign: f64| {
        let extreme = points.iter().map(|p| sign * p[c]).fold(f64::NEG_INFINITY, f64::max);
        (sign * (extreme + range) / cell).floor() as i32
    };
    for i in bound(0, -1.0)..=bound(0, 1.0) {
        for j in bound(1, -1.0)..=bound(1, 1.0) {
            for k in bound(2, -1.0)..=bound(2, 1.0) {
                visit([i, j, k]);
            }
        }
    }
}

/// Vertex-face and edge-edge pairs nearer than `range` whose closest points lie inside both primitives.
pub fn pairs(x: &[Vec3], surfaces: &Surfaces, range: f64) -> Vec<Pair> {
    let lengths = surfaces.edges.iter().map(|e| norm(sub(x[e[0] as usize], x[e[1] as usize])));
    let cell = lengths.sum::<f64>() / surfaces.edges.len().max(1) as f64 + range;
    let mut out = vertex_face(x, surfaces, range, cell);
    out.extend(edge_edge(x, surfaces, range, cell));
    out
}

fn vertex_face(x: &[Vec3], surfaces: &Surfaces, range: f64, cell: f64) -> Vec<Pair> {
    let mut grid = Cells::new();
    let mut used: Vec<u32> = surfaces.edges.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    for v in used {
        cells_of(&[x[v as usize]], 0.0, cell, |key| grid.entry(key).or_default().push(v));
    }
    let mut out = Vec::new();
    for face in surfaces.faces {
        let corners = face.map(|v| x[v as usize]);
        cells_of(&corners, range, cell, |key| {
            for &p in grid.get(&key).into_iter().flatten() {
                if face.contains(&p) || !surfaces.counts(p, face[0]) {
                    continue;
                }
                if let Some((weights, offset)) = inside_triangle(x[p as usize], corners) {
                    let distance = norm(offset);
                    if distance < range && distance > 0.0 {
                        let vertices = [p, face[0], face[1], face[2]];
                        out.push(Pair { vertices, weights, normal: scale(1.0 / distance, offset), distance });
                    }
                }
            }
        });
    }
    out
}

fn edge_edge(x: &[Vec3], surfaces: &Surfaces, range: f64, cell: f64) -> Vec<Pair> {
    let mut grid = Cells::new();
    for (number, e) in surfaces.edges.iter().enumerate() {
        let ends = e.map(|v| x[v as usize]);
        cells_of(&ends, 0.5 * range, cell, |key| grid.entry(key).or_default().push(number as u32));
    }
    let mut candidates: Vec<[u32; 2]> = Vec::new();
    for list in grid.values() {
        for (i, &a) in list.iter().enumerate() {
            for &b in &list[i + 1..] {
                candidates.push([a.min(b), a.max(b)]);
            }
        }
    }
    candidates.sort_unstable();
    candidates.dedup();
    let mut out = Vec::new();
    for [a, b] in candidates {
        let (ea, eb) = (surfaces.edges[a as usize], surfaces.edges[b as usize]);
        if ea.iter().any(|v| eb.contains(v)) || !surfaces.counts(ea[0], eb[0]) {
            continue;
        }
        let ends = [ea[0], ea[1], eb[0], eb[1]];
        if let Some((weights, offset)) = inside_edges(ends.map(|v| x[v as usize])) {
            let distance = norm(offset);
            if distance < range && distance > 0.0 {
                out.push(Pair { vertices: ends, weights, normal: scale(1.0 / distance, offset), distance });
            }
        }
    }
    out
}

/// Weights and offset of a point from its foot on a triangle, where the foot lies inside.
fn inside_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Option<([f64; 4], Vec3)> {
    let n = cross(sub(b, a), sub(c, a));
    let size = dot(n, n);
    let w1 = dot(cross(sub(p, a), sub(c, a)), n) / size;
    let w2 = dot(cross(sub(b, a), sub(p, a)), n) / size;
    let w0 = 1.0 - w1 - w2;
    if !(w0 > 0.0 && w1 > 0.0 && w2 > 0.0) {
        return None;
    }
    let foot = add_scaled(add_scaled(scale(w0, a), w1, b), w2, c);
    Some(([1.0, -w0, -w1, -w2], sub(p, foot)))
}

/// Weights and offset between the closest points of two edges, where both lie inside and the edges are not parallel.
fn inside_edges([a0, a1, b0, b1]: [Vec3; 4]) -> Option<([f64; 4], Vec3)> {
    let (u, v, w) = (sub(a1, a0), sub(b1, b0), sub(a0, b0));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let determinant = uu * vv - uv * uv;
    if determinant <= 1e-8 * uu * vv {
        return None;
    }
    let s = (uv * vw - vv * uw) / determinant;
    let t = (uu * vw - uv * uw) / determinant;
    if !(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) {
        return None;
    }
    let offset = sub(add_scaled(a0, s, u), add_scaled(b0, t, v));
    Some(([1.0 - s, s, t - 1.0, -t], offset))
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{cloth_grid, edges_of};
    use super::*;

    #[test]
    fn two_shifted_sheets_give_their_crossings() {
        // A second sheet 1 mm above the first, shifted by a third of a cell: every vertex of it lies over a face.
        let below = cloth_grid(4, 0.3);
        let mut x = below.positions.clone();
        x.extend(below.positions.iter().map(|p| [p[0] + 0.031, p[1] + 0.045, 0.001]));
        let mut faces = below.faces.clone();
        faces.extend(below.faces.iter().map(|f| f.map(|v| v + 16)));
        let edges = edges_of(&faces);
        let body: Vec<u32> = (0..32).map(|v| v / 16).collect();
        let surfaces =
            Surfaces { faces: &faces, edges: &edges, body: &body, self_contact: &[true; 2], prescribed: &[false; 2] };
        let found = pairs(&x, &surfaces, 0.002);
        let vertex_face = found.iter().filter(|p| p.weights[0] == 1.0).count();
        assert_eq!(vertex_face, 9 + 9);
        assert!(found.len() > 40);
        for p in &found {
            assert!((p.distance - 0.001).abs() < 1e-12 && p.normal[2].abs() > 1.0 - 1e-12);
            assert!(p.weights.iter().sum::<f64>().abs() < 1e-12);
            let along: f64 = (0..4).map(|k| p.weights[k] * x[p.vertices[k] as usize][2]).sum();
            assert!((along * p.normal[2] - 0.001).abs() < 1e-12);
        }
        let none = Surfaces { prescribed: &[true; 2], self_contact: &[false; 2], ..surfaces };
        assert!(pairs(&x, &none, 0.002).is_empty());
        let far = pairs(&x, &surfaces_like(&faces, &edges, &body), 0.0005);
        assert!(far.is_empty());
    }

    fn surfaces_like<'a>(faces: &'a [[u32; 3]], edges: &'a [[u32; 2]], body: &'a [u32]) -> Surfaces<'a> {
        Surfaces { faces, edges, body, self_contact: &[true; 2], prescribed: &[false; 2] }
    }
}
