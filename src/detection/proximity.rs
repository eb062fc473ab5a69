//! Pairs that are near each other at one state, with the weights, normal and distance of a contact.

use super::primitives::{Candidates, Filter, Primitives};
use super::{BroadPhase, brute_force};
use crate::geometry::{edge_edge, point_triangle};
use crate::math::{Vec3, cross, dot, norm_squared, scale, sub, tangents, unit};
use crate::parallel::Par;

/// Kind of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PairKind {
    /// A vertex and a face: stencil `p t0 t1 t2`.
    VertexFace,
    /// Two edges: stencil `ea0 ea1 eb0 eb1`.
    EdgeEdge,
}

/// A near pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearPair {
    /// Kind of the pair.
    pub kind: PairKind,
    /// Vertex index and face number, or two edge numbers, smaller first.
    pub features: [u32; 2],
    /// The four vertices of the stencil.
    pub vertices: [u32; 4],
    /// Signed weights: `(1, -a0, -a1, -a2)`, or `(1-s, s, -(1-t), -t)`.
    pub weights: [f64; 4],
    /// Unit normal with `normal · sum w_k x_k = distance >= 0`.
    pub normal: Vec3,
    /// Distance of the two primitives `[m]`.
    pub distance: f64,
}

/// Largest distance at which a pair counts as near `[m]`, by its kind and the four vertices of its stencil.
pub type Tolerance<'a> = dyn Fn(PairKind, &[u32; 4]) -> f64 + Sync + 'a;

/// Below this part of the extent, a separation has lost half of its digits, and the normal is that of the primitives.
const SHORT: f64 = 1e-8;

/// Normal of a pair.
///
/// The direction between the closest points, which also holds where edges are parallel. Where that is short against
/// the extent `L` (below `1e-8 L`) and the closest points lie inside the face or inside both edges: the normal of the
/// face or the common perpendicular `a x b`, on the side that the exact orientation says. Where the closest points
/// coincide: the same, positive side; if that vanishes too (no area, parallel edges), a fixed perpendicular of the
/// longest edge; if all points coincide, the z axis.
fn normal(separation: Vec3, plane: Vec3, longest: Vec3, inside: bool, side: impl Fn() -> f64) -> Vec3 {
    let extent_squared = norm_squared(longest).max(norm_squared(separation));
    let short = norm_squared(separation) <= SHORT * SHORT * extent_squared;
    let direction = unit(separation);
    if let Some(direction) = direction
        && !(short && inside)
    {
        return direction;
    }
    if let Some(n) = unit(plane) {
        return if side() < 0.0 { scale(-1.0, n) } else { n };
    }
    // No area, or parallel: the separation, however short, is all there is.
    direction.unwrap_or_else(|| unit(longest).map_or([0.0, 0.0, 1.0], |n| tangents(n).0))
}

fn longer(a: Vec3, b: Vec3) -> Vec3 {
    if norm_squared(b) > norm_squared(a) { b } else { a }
}

/// Weights, normal and distance of a point and a triangle.
pub fn vertex_face(p: Vec3, t0: Vec3, t1: Vec3, t2: Vec3) -> ([f64; 4], Vec3, f64) {
    let found = point_triangle::closest_points(p, t0, t1, t2);
    let (u, v) = (sub(t1, t0), sub(t2, t0));
    let inside = found.feature == point_triangle::Feature::Face;
    let longest = longer(longer(u, v), sub(t2, t1));
    let side = || -orientation(t0, t1, t2, p);
    let n = normal(found.separation, cross(u, v), longest, inside, side);
    let [a0, a1, a2] = found.barycentrics;
    ([1.0, -a0, -a1, -a2], n, dot(n, found.separation).max(0.0))
}

/// Weights, normal and distance of two edges.
pub fn edge_edge(ea0: Vec3, ea1: Vec3, eb0: Vec3, eb1: Vec3) -> ([f64; 4], Vec3, f64) {
    let found = edge_edge::closest_points(ea0, ea1, eb0, eb1);
    let (a, b) = (sub(ea1, ea0), sub(eb1, eb0));
    let inside = found.feature == edge_edge::Feature::Edges;
    let side = || -orientation(ea0, ea1, eb0, eb1);
    let n = normal(found.separation, cross(a, b), longer(a, b), inside, side);
    ([1.0 - found.s, found.s, -(1.0 - found.t), -found.t], n, dot(n, found.separation).max(0.0))
}

fn orientation(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> f64 {
    let p = |v: Vec3| robust::Coord3D { x: v[0], y: v[1], z: v[2] };
    robust::orient3d(p(a), p(b), p(c), p(d))
}

/// The candidates whose distance at `x` is at most their tolerance: vertex-face pairs, then edge-edge pairs, each in
/// the order of the candidates.
///
/// Every pair of primitives is reported on its own, also where its closest points lie on a border and belong to other
/// pairs too; [`distinct`] leaves one of each. Nothing is missed as long as the candidates were searched with radii
/// that add up to the tolerance for any two vertices of a pair. Cost: linear in the candidates.
pub fn pairs_within(
    primitives: &Primitives,
    candidates: &Candidates,
    x: &[Vec3],
    tolerance: &Tolerance,
    par: Par,
) -> Vec<NearPair> {
    among(primitives, candidates, x, &|pair| pair.distance <= tolerance(pair.kind, &pair.vertices), par)
}

/// The candidates that `keep` accepts, as near pairs.
fn among(
    primitives: &Primitives,
    candidates: &Candidates,
    x: &[Vec3],
    keep: &(dyn Fn(&NearPair) -> bool + Sync),
    par: Par,
) -> Vec<NearPair> {
    let at = |v: u32| x[v as usize];
    let near = |kind: PairKind, features: [u32; 2], vertices: [u32; 4]| {
        let [a, b, c, d] = vertices.map(at);
        let (weights, normal, distance) = match kind {
            PairKind::VertexFace => vertex_face(a, b, c, d),
            PairKind::EdgeEdge => edge_edge(a, b, c, d),
        };
        let pair = NearPair { kind, features, vertices, weights, normal, distance };
        keep(&pair).then_some(pair)
    };
    let first = par.map_indexed(candidates.vertex_face.len(), |i| {
        let [v, f] = candidates.vertex_face[i];
        let [t0, t1, t2] = primitives.faces[f as usize];
        near(PairKind::VertexFace, [v, f], [v, t0, t1, t2])
    });
    let second = par.map_indexed(candidates.edge_edge.len(), |i| {
        let [e, f] = candidates.edge_edge[i];
        let ([a0, a1], [b0, b1]) = (primitives.edges[e as usize], primitives.edges[f as usize]);
        near(PairKind::EdgeEdge, [e, f], [a0, a1, b0, b1])
    });
    first.into_iter().chain(second).flatten().collect()
}

/// All vertex-face and edge-edge pairs at `x` that are no farther apart than the sum of their radii `[m]`; sorted as in
/// [`pairs_within`]. Between the vertices of a primitive the radius is interpolated: the sum is taken at the closest
/// points.
///
/// Refits `broad_phase`, which was built from the same primitives. Cost: `n log n` plus the candidates.
pub fn search(
    broad_phase: &mut BroadPhase,
    primitives: &Primitives,
    x: &[Vec3],
    radius: &[f64],
    filter: &Filter,
    par: Par,
) -> Vec<NearPair> {
    broad_phase.refit(x, x, radius, par);
    let mut candidates = Candidates::default();
    broad_phase.candidates(filter, &mut candidates, par);
    among(primitives, &candidates, x, &|pair| pair.distance <= sum_of_radii(radius, pair), par)
}

/// [`search`] by brute force: its oracle. Cost: quadratic.
pub fn search_brute_force(primitives: &Primitives, x: &[Vec3], radius: &[f64], filter: &Filter) -> Vec<NearPair> {
    let everywhere = vec![f64::MAX; x.len()];
    let motion = super::Motion { x0: x, x1: x, radius: &everywhere };
    let candidates = brute_force::candidates(primitives, &motion, filter);
    among(primitives, &candidates, x, &|pair| pair.distance <= sum_of_radii(radius, pair), Par::Serial)
}

/// Radius of the one primitive plus that of the other, at the closest points.
fn sum_of_radii(radius: &[f64], pair: &NearPair) -> f64 {
    let at = |k: usize| pair.weights[k].abs() * radius.get(pair.vertices[k] as usize).copied().unwrap_or(0.0);
    at(0) + at(1) + at(2) + at(3)
}

/// The vertices on which the closest points depend: those of the first primitive, and those of the second.
type Support = [[u32; 3]; 2];

fn support(pair: &NearPair) -> Support {
    let split = match pair.kind {
        PairKind::VertexFace => 1,
        PairKind::EdgeEdge => 2,
    };
    let side = |range: std::ops::Range<usize>| {
        let mut out = [u32::MAX; 3];
        for (slot, k) in range.filter(|k| pair.weights[*k] != 0.0).enumerate() {
            out[slot] = pair.vertices[k];
        }
        out.sort_unstable();
        out
    };
    let (a, b) = (side(0..split), side(split..4));
    // The sides have no order of their own: an edge and a vertex may come as either.
    if a <= b { [a, b] } else { [b, a] }
}

/// Leaves one pair of each set of pairs whose closest points depend on the same vertices of both sides.
///
/// A vertex above an edge inside a mesh is near two faces and, by way of its own edges, near the edge several times:
/// all of these state one and the same row (same weights, same normal). The first in the given order stays, so
/// vertex-face pairs go before edge-edge pairs. No constraint is lost; pairs with different supports all stay.
/// Cost: `n log n`.
pub fn distinct(pairs: Vec<NearPair>) -> Vec<NearPair> {
    let mut keyed: Vec<(Support, u32)> = pairs.iter().map(support).zip(0..).collect();
    keyed.sort_unstable();
    keyed.dedup_by_key(|(support, _)| *support);
    let mut kept: Vec<u32> = keyed.into_iter().map(|(_, i)| i).collect();
    kept.sort_unstable();
    kept.into_iter().map(|i| pairs[i as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{add_scaled, norm};

    fn check(x: [Vec3; 4], found: ([f64; 4], Vec3, f64)) -> (Vec3, f64) {
        let (w, n, distance) = found;
        let separation = (0..4).fold([0.0; 3], |s, k| add_scaled(s, w[k], x[k]));
        assert!((norm(n) - 1.0).abs() < 1e-14, "{found:?}");
        assert!((dot(n, separation) - distance).abs() < 1e-14, "{found:?}");
        (n, distance)
    }

    #[test]
    fn normals_of_touching_and_nearly_touching_pairs() {
        let (o, x, y) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for (height, sign) in [(1e-3, 1.0), (-1e-3, -1.0), (1e-17, 1.0), (-1e-17, -1.0), (0.0, 1.0), (-1e-160, -1.0)] {
            let p = [0.25, 0.25, height];
            let (n, d) = check([p, o, x, y], vertex_face(p, o, x, y));
            assert!((n[2] - sign).abs() < 1e-14 && (d - height.abs()).abs() < 1e-15);
            let (b0, b1) = ([0.5, -1.0, -height], [0.5, 1.0, -height]);
            let (n, d) = check([o, x, b0, b1], edge_edge(o, x, b0, b1));
            assert!((n[2] - sign).abs() < 1e-14 && (d - height.abs()).abs() < 1e-15);
        }
    }

    #[test]
    fn parallel_coincident_and_degenerate_pairs_have_normals() {
        let (o, x) = ([0.0; 3], [1.0, 0.0, 0.0]);
        // Parallel, apart: the direction between them. The common perpendicular vanishes here.
        let (n, d) = check([o, x, [0.2, 0.0, 0.1], [0.8, 0.0, 0.1]], edge_edge(o, x, [0.2, 0.0, 0.1], [0.8, 0.0, 0.1]));
        assert_eq!((n, d), ([0.0, 0.0, -1.0], 0.1));
        // Collinear and overlapping: a perpendicular.
        let (n, d) = check([o, x, [0.2, 0.0, 0.0], [0.8, 0.0, 0.0]], edge_edge(o, x, [0.2, 0.0, 0.0], [0.8, 0.0, 0.0]));
        assert_eq!((n[0], d), (0.0, 0.0));
        // Everything in one point.
        assert_eq!(check([x; 4], edge_edge(x, x, x, x)), ([0.0, 0.0, 1.0], 0.0));
        assert_eq!(check([x; 4], vertex_face(x, x, x, x)), ([0.0, 0.0, 1.0], 0.0));
        // A triangle without area, touched.
        let (n, d) = check([[0.5, 0.0, 0.0], o, x, x], vertex_face([0.5, 0.0, 0.0], o, x, x));
        assert_eq!((n[0], d), (0.0, 0.0));
    }

    #[test]
    fn one_pair_stays_for_a_vertex_above_an_inner_edge() {
        // Two faces with the common edge 0 1, and a vertex 4 with two edges above it.
        let x =
            [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.1], [1.0, 0.5, 1.0]];
        let edges = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [4, 5]];
        let p = Primitives { vertices: &[0, 1, 2, 3, 4, 5], edges: &edges, faces: &[[0, 1, 2], [1, 0, 3]] };
        let all = search_brute_force(&p, &x, &[0.06; 6], &|_, _| true);
        assert_eq!(all.len(), 3, "{all:?}");
        let kept = distinct(all);
        assert_eq!(kept.len(), 1);
        assert_eq!((kept[0].kind, kept[0].features), (PairKind::VertexFace, [4, 0]));
    }
}
