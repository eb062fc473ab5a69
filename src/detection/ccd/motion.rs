//! One pair of primitives in relative coordinates, and separating directions for it.
//!
//! A pair is described by the differences of its vertices, one per vertex pair: `p - t_j` for vertex-face (three) and
//! `a_i - b_j` for edge-edge (four). Both primitives are convex, so a direction n separates them by at least s exactly
//! when `n·D_k >= s |n|` for every difference. Differences of doubles carry a *relative* rounding error, so nothing in
//! here loses accuracy far from the origin.

use super::exact::Shape;
use crate::math::{Vec3, add_scaled, cross, dot, norm, norm_squared, scale, sub};

/// Unit roundoff of f64.
pub(super) const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Error of a computed `n·D(t)` relative to `|n| M`, with M the largest component of the differences at both ends.
///
/// With u the unit roundoff: the difference u M, its interpolation 3 u M, the three-term dot product 3 u on top: below
/// 8 u per component, times `|n|_1 <= sqrt(3) |n|`; doubled for the sums of two such terms and for the rounding of the
/// threshold itself.
pub(in crate::detection) const DIRECTION_ERROR: f64 = 32.0 * UNIT_ROUNDOFF;

/// A separating direction at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// Unit direction, from the second primitive to the first.
    pub unit: Vec3,
    /// Length of the natural polynomial direction of the feature, so that interpolating `weight * unit` over time is
    /// exact for face normals, edge cross products and vertex differences.
    pub weight: f64,
    /// Which feature pair the direction belongs to; two times with one feature interpolate well.
    pub feature: u8,
    /// Lower bound of the distance at that time, up to rounding: `min_k unit·D_k`; negative when not separated.
    pub gap: f64,
}

/// The two kinds of pairs; `N` differences.
pub(super) trait Kind<const N: usize> {
    /// The same as a value.
    const SHAPE: Shape;

    /// The differences of four vertices.
    fn differences(x: &[Vec3; 4]) -> [Vec3; N];
    /// The candidate directions of all feature pairs, handed to `visit` with their feature number and weight.
    /// One of them is the direction between the closest points.
    fn feature_directions(d: &[Vec3; N], visit: &mut impl FnMut(u8, Vec3, f64));
    /// The direction of the feature pair that a plain closest-point computation names, numbered and weighted as above,
    /// and the square of the distance it finds. Both may suffer from rounding: to be checked against each other.
    fn closest_direction(d: &[Vec3; N]) -> (u8, Vec3, f64, f64);
}

/// Vertex-face.
pub(super) struct VertexFace;
/// Edge-edge.
pub(super) struct EdgeEdge;

/// The part of `a` orthogonal to `e`, orthogonal to rounding error of the result (projected twice).
#[inline(always)]
fn reject(a: Vec3, e: Vec3) -> Vec3 {
    let ee = norm_squared(e);
    if ee == 0.0 {
        return a;
    }
    let once = add_scaled(a, -dot(a, e) / ee, e);
    add_scaled(once, -dot(once, e) / ee, e)
}

/// A normal of the plane of two directions that is orthogonal to both up to rounding even when they are nearly
/// parallel: the shorter one is made orthogonal to the longer one first. Returns the normal with length `|e x f|`.
#[inline(always)]
fn plane_normal(e: Vec3, f: Vec3) -> Vec3 {
    if norm_squared(e) >= norm_squared(f) { cross(e, reject(f, e)) } else { cross(reject(e, f), f) }
}

impl Kind<3> for VertexFace {
    const SHAPE: Shape = Shape::VertexFace;

    #[inline(always)]
    fn differences(x: &[Vec3; 4]) -> [Vec3; 3] {
        [sub(x[0], x[1]), sub(x[0], x[2]), sub(x[0], x[3])]
    }

    fn feature_directions(d: &[Vec3; 3], visit: &mut impl FnMut(u8, Vec3, f64)) {
        let edges = [sub(d[0], d[1]), sub(d[1], d[2]), sub(d[2], d[0])];
        let longest = (0..3).fold(0, |b, i| if norm_squared(edges[i]) > norm_squared(edges[b]) { i } else { b });
        let normal = plane_normal(edges[longest], edges[(longest + 1) % 3]);
        let normal = if dot(normal, d[0]) < 0.0 { scale(-1.0, normal) } else { normal };
        visit(0, normal, norm(normal));
        for i in 0..3 {
            visit(1 + i as u8, reject(d[i], edges[i]), 1.0);
        }
        for (i, difference) in d.iter().enumerate() {
            visit(4 + i as u8, *difference, norm(*difference));
        }
    }

    fn closest_direction(d: &[Vec3; 3]) -> (u8, Vec3, f64, f64) {
        // Barycentric coordinates over each edge: `b[i]` is positive where the foot of p lies beyond corner i towards i+1.
        let edges = [sub(d[0], d[1]), sub(d[1], d[2]), sub(d[2], d[0])];
        let normal = cross(edges[0], edges[1]);
        let nn = norm_squared(normal);
        // Inside of edge i where the corner differences turn the same way as the triangle.
        let turn: [f64; 3] = std::array::from_fn(|i| dot(cross(d[i], d[(i + 1) % 3]), normal));
        if turn[0] >= 0.0 && turn[1] >= 0.0 && turn[2] >= 0.0 && nn > 0.0 {
            let h = dot(d[0], normal);
            let longest = (0..3).fold(0, |b, i| if norm_squared(edges[i]) > norm_squared(edges[b]) { i } else { b });
            let n = plane_normal(edges[longest], edges[(longest + 1) % 3]);
            let n = if dot(n, d[0]) < 0.0 { scale(-1.0, n) } else { n };
            return (0, n, norm(n), h * h / nn);
        }
        let mut best = (4, d[0], 0.0, f64::INFINITY);
        for i in 0..3 {
            let e = edges[i];
            let (ee, along) = (norm_squared(e), dot(d[i], e));
            let offset = if along <= 0.0 || ee == 0.0 {
                d[i]
            } else if along >= ee {
                d[(i + 1) % 3]
            } else {
                add_scaled(d[i], -along / ee, e)
            };
            let square = norm_squared(offset);
            if square < best.3 {
                best = if along <= 0.0 || ee == 0.0 {
                    (4 + i as u8, d[i], square.sqrt(), square)
                } else if along >= ee {
                    (4 + ((i + 1) % 3) as u8, offset, square.sqrt(), square)
                } else {
                    (1 + i as u8, add_scaled(offset, -dot(offset, e) / ee, e), 1.0, square)
                };
            }
        }
        best
    }
}

impl Kind<4> for EdgeEdge {
    const SHAPE: Shape = Shape::EdgeEdge;

    #[inline(always)]
    fn differences(x: &[Vec3; 4]) -> [Vec3; 4] {
        [sub(x[0], x[2]), sub(x[0], x[3]), sub(x[1], x[2]), sub(x[1], x[3])]
    }

    fn feature_directions(d: &[Vec3; 4], visit: &mut impl FnMut(u8, Vec3, f64)) {
        let (e, f) = (sub(d[2], d[0]), sub(d[0], d[1]));
        let normal = plane_normal(e, f);
        let normal = if dot(normal, d[0]) < 0.0 { scale(-1.0, normal) } else { normal };
        visit(0, normal, norm(normal));
        visit(1, reject(d[0], f), 1.0);
        visit(2, reject(d[2], f), 1.0);
        visit(3, reject(d[0], e), 1.0);
        visit(4, reject(d[1], e), 1.0);
        for (i, difference) in d.iter().enumerate() {
            visit(5 + i as u8, *difference, norm(*difference));
        }
    }

    fn closest_direction(d: &[Vec3; 4]) -> (u8, Vec3, f64, f64) {
        // Points `d0 + s e + t f` with e along the first edge and -f along the second.
        let (e, f) = (sub(d[2], d[0]), sub(d[1], d[0]));
        let (ee, ff, ef) = (norm_squared(e), norm_squared(f), dot(e, f));
        let (de, df) = (dot(d[0], e), dot(d[0], f));
        let determinant = ee * ff - ef * ef;
        let mut s = if determinant > 0.0 { ((ef * df - ff * de) / determinant).clamp(0.0, 1.0) } else { 0.0 };
        let mut t = if ff > 0.0 { -(df + s * ef) / ff } else { 0.0 };
        if !(0.0..=1.0).contains(&t) {
            t = t.clamp(0.0, 1.0);
            s = if ee > 0.0 { (-(de + t * ef) / ee).clamp(0.0, 1.0) } else { 0.0 };
        }
        let offset = add_scaled(add_scaled(d[0], s, e), t, f);
        let square = norm_squared(offset);
        let (end_s, end_t) = (s == 0.0 || s == 1.0, t == 0.0 || t == 1.0);
        let (at_s, at_t) = (usize::from(s == 1.0), usize::from(t == 1.0));
        match (end_s, end_t) {
            (false, false) => {
                let n = plane_normal(e, sub(d[0], d[1]));
                let n = if dot(n, d[0]) < 0.0 { scale(-1.0, n) } else { n };
                (0, n, norm(n), square)
            }
            (true, false) => (1 + at_s as u8, reject(d[2 * at_s], f), 1.0, square),
            (false, true) => (3 + at_t as u8, reject(d[at_t], e), 1.0, square),
            (true, true) => {
                let k = 2 * at_s + at_t;
                (5 + k as u8, d[k], square.sqrt(), square)
            }
        }
    }
}

/// The smallest `n·D_k`.
#[inline(always)]
pub(super) fn support<const N: usize>(n: Vec3, d: &[Vec3; N]) -> f64 {
    let mut least = dot(n, d[0]);
    for difference in &d[1..] {
        least = least.min(dot(n, *difference));
    }
    least
}

/// The best separating direction of a configuration: that of the closest points, up to rounding. `None` when no
/// feature gives a finite direction (all differences vanish).
///
/// A plain closest-point computation comes first. Its direction is taken when it separates by the distance found:
/// nothing can separate by more. Otherwise all features are tried.
pub(super) fn separating_direction<const N: usize, K: Kind<N>>(d: &[Vec3; N]) -> Option<Direction> {
    let (feature, n, weight, distance_squared) = K::closest_direction(d);
    let length = norm(n);
    if length > 0.0 && length.is_finite() {
        let unit = scale(1.0 / length, n);
        let gap = support(unit, d);
        if gap > 0.0 && gap * gap >= distance_squared * (1.0 - 1e-9) {
            return Some(Direction { unit, weight, feature, gap });
        }
    }
    best_of_all_features::<N, K>(d)
}

fn best_of_all_features<const N: usize, K: Kind<N>>(d: &[Vec3; N]) -> Option<Direction> {
    let mut best: Option<Direction> = None;
    K::feature_directions(d, &mut |feature, n, weight| {
        let length = norm(n);
        if length > 0.0 && length.is_finite() {
            let unit = scale(1.0 / length, n);
            let gap = support(unit, d);
            if best.is_none_or(|b| gap > b.gap) {
                best = Some(Direction { unit, weight, feature, gap });
            }
        }
    });
    best
}

/// Whether a fixed direction keeps `n·D_k >= required` for all differences at both ends, and so, each being linear in
/// time, on the whole interval. `n` has unit length.
#[inline(always)]
pub(super) fn fixed_direction_separates<const N: usize>(
    n: Vec3,
    da: &[Vec3; N],
    db: &[Vec3; N],
    required: f64,
) -> bool {
    support(n, da) >= required && support(n, db) >= required
}

/// Whether the direction with quadratic Bernstein control vectors `n` separates by `required` on the whole interval.
///
/// `n(t)·D_k(t)` is a cubic with the coefficients below; `|n(t)| <= sum B_i(t) |n_i|` by the triangle inequality, and
/// raising that bound to degree three gives the coefficients it is compared with. Coefficient-wise order implies order
/// on the interval.
pub(super) fn moving_direction_separates<const N: usize>(
    n: &[Vec3; 3],
    da: &[Vec3; N],
    db: &[Vec3; N],
    required: f64,
) -> bool {
    let length = [norm(n[0]), norm(n[1]), norm(n[2])];
    let bound = [
        required * length[0],
        required * (length[0] + 2.0 * length[1]),
        required * (2.0 * length[1] + length[2]),
        required * length[2],
    ];
    // A direction that vanishes somewhere separates nothing there: `required > 0` makes every test strict.
    (0..N).all(|k| {
        dot(n[0], da[k]) >= bound[0]
            && dot(n[0], db[k]) + 2.0 * dot(n[1], da[k]) >= bound[1]
            && 2.0 * dot(n[1], db[k]) + dot(n[2], da[k]) >= bound[2]
            && dot(n[2], db[k]) >= bound[3]
    })
}

/// The differences at time t, interpolated componentwise.
#[inline(always)]
pub(super) fn differences_at<const N: usize>(d0: &[Vec3; N], d1: &[Vec3; N], t: f64) -> [Vec3; N] {
    let s = 1.0 - t;
    let mut d = *d0;
    for k in 0..N {
        for c in 0..3 {
            d[k][c] = s * d0[k][c] + t * d1[k][c];
        }
    }
    d
}

/// The largest absolute component, NaN or infinite when a component is.
#[inline(always)]
pub(super) fn largest_component<const N: usize>(d: &[Vec3; N]) -> f64 {
    let mut largest = 0.0_f64;
    let mut sum = 0.0;
    for difference in d {
        for c in difference {
            largest = largest.max(c.abs());
            sum += c.abs();
        }
    }
    // `max` drops a NaN, the sum keeps it.
    if sum.is_finite() { largest } else { sum }
}
