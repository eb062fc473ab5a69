//! Candidates that one separating direction rules out, several side by side; what is left is listed.
//!
//! Both primitives are convex: a direction n keeps them apart by s when `n·D_k >= s |n|` for every difference `D_k` of
//! their vertices, and by s over a whole step when that holds at both ends, `n·D_k` being linear in time. The direction
//! is the one between approximate closest points at the start; whatever it is, the test proves what it says.

use super::ccd::{DIRECTION_ERROR, Shape};
use super::primitives::{Candidates, Primitives};
use crate::math::Vec3;
use crate::math::simd::points::{Point, cross, dot, gather, if_positive, scale, sub};
use crate::math::simd::{Kernel, Lanes, run_wide};
use crate::parallel::Par;

/// Pairs side by side.
const WIDTH: usize = 4;

/// No candidate.
const NONE: u32 = u32::MAX;

/// Margin of rounding of distances from elsewhere, relative: what is ruled out here is ruled out there.
const SLACK: f64 = 1e-9;

/// Numbers of the candidates that may be nearer at `x` than the reaches of their primitives together, vertex-face pairs
/// first, ascending. `reach` is by vertex index and the same for all vertices of a primitive `[m]`.
///
/// None that is nearer is left out, by exact distance or by that of [`crate::geometry`]. Cost: linear.
pub fn near(x: &[Vec3], primitives: &Primitives, candidates: &Candidates, reach: &[f64], par: Par) -> Vec<u32> {
    Screen { x0: x, x1: None, primitives, reach }.open(candidates, par)
}

/// Numbers of the candidates that may come closer than half of `min(thickness, distance at x0)` on straight lines from
/// `x0` to `x1`, where `thickness` is the sum of both primitives' half thicknesses; otherwise like [`near`].
pub fn approaching(
    x0: &[Vec3],
    x1: &[Vec3],
    primitives: &Primitives,
    candidates: &Candidates,
    half_thickness: &[f64],
    par: Par,
) -> Vec<u32> {
    Screen { x0, x1: Some(x1), primitives, reach: half_thickness }.open(candidates, par)
}

/// The question, for all candidates.
#[derive(Clone, Copy)]
struct Screen<'a> {
    x0: &'a [Vec3],
    x1: Option<&'a [Vec3]>,
    primitives: &'a Primitives<'a>,
    reach: &'a [f64],
}

impl Screen<'_> {
    fn open(self, candidates: &Candidates, par: Par) -> Vec<u32> {
        let (vertex_face, edge_edge) = (&candidates.vertex_face, &candidates.edge_edge);
        let mut numbers = vec![NONE; vertex_face.len() + edge_edge.len()];
        let (first, second) = numbers.split_at_mut(vertex_face.len());
        let lists =
            [(first, vertex_face, Shape::VertexFace, 0), (second, edge_edge, Shape::EdgeEdge, vertex_face.len())];
        for (out, pairs, shape, offset) in lists {
            par.for_each_block(out, |start, out| {
                let pairs = &pairs[start..start + out.len()];
                run_wide(Block { screen: self, shape, pairs, offset: (offset + start) as u32, out });
            });
        }
        numbers.retain(|n| *n != NONE);
        numbers
    }

    #[inline(always)]
    fn vertices(&self, shape: Shape, [a, b]: [u32; 2]) -> [usize; 4] {
        let v = match shape {
            Shape::VertexFace => {
                let [t0, t1, t2] = self.primitives.faces[b as usize];
                [a, t0, t1, t2]
            }
            Shape::EdgeEdge => {
                let ([a0, a1], [b0, b1]) = (self.primitives.edges[a as usize], self.primitives.edges[b as usize]);
                [a0, a1, b0, b1]
            }
        };
        v.map(|v| v as usize)
    }

    /// Greater than zero where the pair is ruled out.
    #[inline(always)]
    fn margin(&self, shape: Shape, pairs: &[[u32; 2]; WIDTH]) -> Lanes<WIDTH> {
        let v = pairs.map(|pair| self.vertices(shape, pair));
        let second = if shape == Shape::VertexFace { 1 } else { 2 };
        let mut reach = Lanes([0.0; WIDTH]);
        for l in 0..WIDTH {
            reach.0[l] = self.reach[v[l][0]] + self.reach[v[l][second]];
        }
        let d0 = differences(shape, &gather(self.x0, &v));
        let (n, distance) = direction(shape, &d0);
        match self.x1 {
            None => {
                let error = sizes(&d0) * Lanes::splat(16.0 * DIRECTION_ERROR);
                certain(support(&n, &d0), reach * Lanes::splat(1.0 + SLACK) + error, sizes(&d0))
            }
            Some(x1) => {
                let d1 = differences(shape, &gather(x1, &v));
                let extent = sizes(&d0) + sizes(&d1);
                let rounding = Lanes::splat(2.0 * DIRECTION_ERROR) * extent;
                let distance = distance * Lanes::splat(1.0 + SLACK) + rounding;
                let separation = Lanes::splat(0.5) * reach.min(distance);
                certain(support(&n, &d0).min(support(&n, &d1)), required(separation, extent), extent)
            }
        }
    }
}

/// Greater than zero where the direction between the closest points at one end of the step, `at_end` or the start,
/// keeps the pair apart by more than `separation` on the whole step.
#[inline(always)]
pub(super) fn separation_margin<const L: usize>(
    shape: Shape,
    x0: &[Point<L>; 4],
    x1: &[Point<L>; 4],
    separation: Lanes<L>,
    at_end: bool,
) -> Lanes<L> {
    let (d0, d1) = (differences(shape, x0), differences(shape, x1));
    let (n, _) = direction(shape, if at_end { &d1 } else { &d0 });
    let extent = sizes(&d0) + sizes(&d1);
    certain(support(&n, &d0).min(support(&n, &d1)), required(separation, extent), extent)
}

/// What a computed `n·D` must reach to prove `separation`.
#[inline(always)]
fn required<const L: usize>(separation: Lanes<L>, extent: Lanes<L>) -> Lanes<L> {
    separation * Lanes::splat(1.0 + 4.0 * f64::EPSILON) + extent * Lanes::splat(DIRECTION_ERROR)
}

/// `gap - required` where the pair's sizes can be trusted: squares within the range of doubles, and no gap of a unit
/// vector longer than the pair.
#[inline(always)]
fn certain<const L: usize>(gap: Lanes<L>, required: Lanes<L>, extent: Lanes<L>) -> Lanes<L> {
    let in_range = (extent - Lanes::splat(1e-60)).min(Lanes::splat(1e60) - extent);
    // NaN last: the smaller of two is the second where one is not a number.
    in_range.min(Lanes::splat(4.0) * extent - gap).min(gap - required)
}

/// Candidates of one block; the numbers of those left open go to the front of `out`.
struct Block<'a> {
    screen: Screen<'a>,
    shape: Shape,
    pairs: &'a [[u32; 2]],
    offset: u32,
    out: &'a mut [u32],
}

impl Kernel for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        match self.shape {
            Shape::VertexFace => self.run_shape(Shape::VertexFace),
            Shape::EdgeEdge => self.run_shape(Shape::EdgeEdge),
        }
    }
}

impl Block<'_> {
    #[inline(always)]
    fn run_shape(self, shape: Shape) {
        let mut filled = 0;
        for (group, chunk) in self.pairs.chunks(WIDTH).enumerate() {
            // Lanes beyond the last pair repeat the first one.
            let mut pairs = [chunk[0]; WIDTH];
            pairs[..chunk.len()].copy_from_slice(chunk);
            let margin = self.screen.margin(shape, &pairs);
            for l in 0..chunk.len() {
                let open = margin.0[l] > 0.0;
                if !open {
                    self.out[filled] = self.offset + (WIDTH * group + l) as u32;
                    filled += 1;
                }
            }
        }
    }
}

/// The differences of a pair's vertices, from the second primitive to the first; of vertex-face pairs the last twice.
#[inline(always)]
fn differences<const L: usize>(shape: Shape, x: &[Point<L>; 4]) -> [Point<L>; 4] {
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
fn sizes<const L: usize>(d: &[Point<L>; 4]) -> Lanes<L> {
    let size = |v: &Point<L>| v[0].abs() + v[1].abs() + v[2].abs();
    (size(&d[0]) + size(&d[1])) + (size(&d[2]) + size(&d[3]))
}

/// The smallest `n·D_k`.
#[inline(always)]
fn support<const L: usize>(n: &Point<L>, d: &[Point<L>; 4]) -> Lanes<L> {
    dot(n, &d[0]).min(dot(n, &d[1])).min(dot(n, &d[2]).min(dot(n, &d[3])))
}

/// A unit direction that separates the pair well, and the distance of two of its points, to rounding.
#[inline(always)]
fn direction<const L: usize>(shape: Shape, d: &[Point<L>; 4]) -> (Point<L>, Lanes<L>) {
    match shape {
        Shape::VertexFace => vertex_face_direction(d),
        Shape::EdgeEdge => edge_edge_direction(d),
    }
}

#[inline(always)]
fn clamped<const L: usize>(t: Lanes<L>) -> Lanes<L> {
    t.max(Lanes::splat(0.0)).min(Lanes::splat(1.0))
}

/// The face normal or the direction from the nearest point of an edge, whichever separates farther.
#[inline(always)]
fn vertex_face_direction<const L: usize>(d: &[Point<L>; 4]) -> (Point<L>, Lanes<L>) {
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
    let offset = scale(Lanes::splat(1.0) / distance, &offset);
    let normal = cross(&edges[0], &edges[1]);
    let length = dot(&normal, &normal).sqrt();
    let inverse = Lanes::splat(1.0) / length;
    let normal = scale(dot(&normal, &d[0]).if_positive(inverse, inverse.negate()), &normal);
    let better = support(&normal, d) - support(&offset, d);
    (if_positive(better, &normal, &offset), distance)
}

/// The direction between the closest points of two edges.
#[inline(always)]
fn edge_edge_direction<const L: usize>(d: &[Point<L>; 4]) -> (Point<L>, Lanes<L>) {
    // Points `d0 + s e + t f` with e along the first edge and -f along the second.
    let (e, f) = (sub(&d[2], &d[0]), sub(&d[1], &d[0]));
    let (ee, ff, ef) = (dot(&e, &e), dot(&f, &f), dot(&e, &f));
    let (de, df) = (dot(&d[0], &e), dot(&d[0], &f));
    let s = clamped((ef * df - ff * de) / (ee * ff - ef * ef));
    let t = clamped((df + s * ef).negate() / ff);
    let s = clamped((de + t * ef).negate() / ee);
    let (along_e, along_f) = (scale(s, &e), scale(t, &f));
    let offset: Point<L> = std::array::from_fn(|c| d[0][c] + along_e[c] + along_f[c]);
    let distance = dot(&offset, &offset).sqrt();
    (scale(Lanes::splat(1.0) / distance, &offset), distance)
}
