//! Directions that may keep two primitives apart, for several pairs side by side.
//!
//! Nothing here is proven: who uses a direction tests what it separates.

use super::ccd::Shape;
use crate::math::simd::points::{Point, cross, dot, if_positive, scale, sub};
use crate::math::simd::{Lanes, Number};

/// The differences of a pair's vertices, from the second primitive to the first; of vertex-face pairs the last twice.
#[inline(always)]
pub(super) fn differences<const L: usize, T: Number>(shape: Shape, x: &[Point<L, T>; 4]) -> [Point<L, T>; 4] {
    match shape {
        Shape::VertexFace => {
            let last = sub(&x[0], &x[3]);
            [sub(&x[0], &x[1]), sub(&x[0], &x[2]), last, last]
        }
        Shape::EdgeEdge => [sub(&x[0], &x[2]), sub(&x[0], &x[3]), sub(&x[1], &x[2]), sub(&x[1], &x[3])],
    }
}

/// Sum of all sizes: at least the largest, and not a number where one is none.
#[inline(always)]
pub(super) fn sizes<const L: usize, T: Number>(d: &[Point<L, T>; 4]) -> Lanes<L, T> {
    let size = |v: &Point<L, T>| v[0].abs() + v[1].abs() + v[2].abs();
    (size(&d[0]) + size(&d[1])) + (size(&d[2]) + size(&d[3]))
}

/// The smallest `n·D_k`.
#[inline(always)]
pub(super) fn support<const L: usize, T: Number>(n: &Point<L, T>, d: &[Point<L, T>; 4]) -> Lanes<L, T> {
    dot(n, &d[0]).min(dot(n, &d[1])).min(dot(n, &d[2]).min(dot(n, &d[3])))
}

/// A unit direction that separates the pair well, and the distance of two of its points, to rounding.
#[inline(always)]
pub(super) fn direction<const L: usize, T: Number>(shape: Shape, d: &[Point<L, T>; 4]) -> (Point<L, T>, Lanes<L, T>) {
    match shape {
        Shape::VertexFace => vertex_face_direction(d),
        Shape::EdgeEdge => edge_edge_direction(d),
    }
}

#[inline(always)]
fn clamped<const L: usize, T: Number>(t: Lanes<L, T>) -> Lanes<L, T> {
    t.max(Lanes::splat(T::ZERO)).min(Lanes::splat(T::ONE))
}

/// The face normal or the direction from the nearest point of an edge, whichever separates farther.
#[inline(always)]
fn vertex_face_direction<const L: usize, T: Number>(d: &[Point<L, T>; 4]) -> (Point<L, T>, Lanes<L, T>) {
    let edges = [sub(&d[0], &d[1]), sub(&d[1], &d[2]), sub(&d[2], &d[0])];
    let from_edge = |i: usize| {
        let t = clamped(dot(&d[i], &edges[i]) / dot(&edges[i], &edges[i]));
        sub(&d[i], &scale(t, &edges[i]))
    };
    let mut offset = from_edge(0);
    let mut square = dot(&offset, &offset);
    for i in 1..3 {
        let other = from_edge(i);
        let closer = square - dot(&other, &other);
        offset = if_positive(closer, &other, &offset);
        square = square.min(dot(&other, &other));
    }
    let distance = square.sqrt();
    let offset = scale(Lanes::splat(T::ONE) / distance, &offset);
    let normal = cross(&edges[0], &edges[1]);
    let length = dot(&normal, &normal).sqrt();
    let inverse = Lanes::splat(T::ONE) / length;
    let normal = scale(dot(&normal, &d[0]).if_positive(inverse, inverse.negate()), &normal);
    let better = support(&normal, d) - support(&offset, d);
    (if_positive(better, &normal, &offset), distance)
}

/// The direction between the closest points of two edges.
#[inline(always)]
fn edge_edge_direction<const L: usize, T: Number>(d: &[Point<L, T>; 4]) -> (Point<L, T>, Lanes<L, T>) {
    // Points `d0 + s e + t f` with e along the first edge and -f along the second.
    let (e, f) = (sub(&d[2], &d[0]), sub(&d[1], &d[0]));
    let (ee, ff, ef) = (dot(&e, &e), dot(&f, &f), dot(&e, &f));
    let (de, df) = (dot(&d[0], &e), dot(&d[0], &f));
    let s = clamped((ef * df - ff * de) / (ee * ff - ef * ef));
    let t = clamped((df + s * ef).negate() / ff);
    let s = clamped((de + t * ef).negate() / ee);
    let (along_e, along_f) = (scale(s, &e), scale(t, &f));
    let offset: Point<L, T> = std::array::from_fn(|c| d[0][c] + along_e[c] + along_f[c]);
    let distance = dot(&offset, &offset).sqrt();
    (scale(Lanes::splat(T::ONE) / distance, &offset), distance)
}
