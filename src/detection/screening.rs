//! Candidates that one separating direction rules out, several side by side; what is left is listed.
//!
//! Both primitives are convex: a direction n keeps them apart by s when `n·D_k >= s |n|` for every difference `D_k` of
//! their vertices, and by s over a whole step when that holds at both ends, `n·D_k` being linear in time. The direction
//! is the one between approximate closest points at the start; whatever it is, the test proves what it says. Single
//! precision rules out most pairs, double precision what is too close for it.

use super::ccd::{DIRECTION_ERROR, Shape};
use super::directions::{differences, direction, sizes, support};
use super::primitives::{Candidates, Primitives};
use crate::geometry::Aabb;
use crate::math::simd::points::{Point, dot, gather, gather_quads};
use crate::math::simd::{Kernel, Lanes, Number, run_wide};
use crate::math::{Vec3, scale, sub};
use crate::parallel::Par;
use std::ops::Range;

/// Pairs side by side in double precision.
const WIDTH: usize = 4;

/// Pairs side by side in single precision.
const COARSE_WIDTH: usize = 8;

/// Positions bounded in one task.
const PART: usize = 8192;

/// Pairs screened in one task.
const BLOCK: usize = 4096;

/// Margin of rounding of distances from elsewhere, relative: what is ruled out here is ruled out there.
const SLACK: f64 = 1e-9;

/// The same in single precision; also how much a direction may be longer than one.
const COARSE_SLACK: f32 = 1e-4;

/// Rounding of `n·D` in single precision, for a difference of size one of points within the unit cube: of its
/// coordinates (a half unit in the last place each), and of the product.
pub(super) const COARSE_ERROR: f32 = 8.0 * UNIT_ROUNDOFF;

/// The same for each unit of the sizes of all differences together.
const COARSE_DIRECTION_ERROR: f32 = 32.0 * UNIT_ROUNDOFF;

/// Of single precision.
const UNIT_ROUNDOFF: f32 = 0.5 * f32::EPSILON;

/// Where single precision errs by more than this share of a reach, double precision looks at what it leaves.
const COARSE_SHARE: f64 = 0.01;

/// Numbers of the candidates that may be nearer at `x` than the reaches of their primitives together, vertex-face pairs
/// first, ascending; of those `among` where that is given, ascending. `reach` is by vertex index and the same for all
/// vertices of a primitive `[m]`.
///
/// None that is nearer is left out, by exact distance or by that of [`crate::geometry`]. Cost: linear.
pub fn near<'a>(
    x: &[Vec3],
    lists: Lists,
    among: Option<&[u32]>,
    reach: &[f64],
    buffers: &'a mut Buffers,
    par: Par,
) -> &'a [u32] {
    let Buffers { coarse, open } = buffers;
    if open.take(lists, among) {
        coarse.assign(x, None, reach, par);
        open.rule_out::<COARSE_WIDTH, _>(lists, coarse, par);
        let smallest = reach.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        if f64::from(COARSE_ERROR) > COARSE_SHARE * smallest * coarse.per_metre {
            open.rule_out::<WIDTH, _>(lists, &Fine { x0: x, x1: None, reach }, par);
        }
    }
    &open.numbers
}

/// Numbers of the candidates that may come closer than half of `min(thickness, distance at x0)` on straight lines from
/// `x0` to `x1`, where `thickness` is the sum of both primitives' half thicknesses; otherwise like [`near`].
pub fn approaching<'a>(
    x0: &[Vec3],
    x1: &[Vec3],
    lists: Lists,
    among: Option<&[u32]>,
    half_thickness: &[f64],
    buffers: &'a mut Buffers,
    par: Par,
) -> &'a [u32] {
    let Buffers { coarse, open } = buffers;
    if open.take(lists, among) {
        coarse.assign(x0, Some(x1), half_thickness, par);
        open.rule_out::<COARSE_WIDTH, _>(lists, coarse, par);
        open.rule_out::<WIDTH, _>(lists, &Fine { x0, x1: Some(x1), reach: half_thickness }, par);
    }
    &open.numbers
}

/// What is used again from call to call: capacity only.
#[derive(Default)]
pub struct Buffers {
    coarse: Coarse,
    open: Open,
}

/// Numbers of the candidates that are still open, ascending.
#[derive(Default)]
struct Open {
    numbers: Vec<u32>,
    /// How many of each block a screen left.
    left: Vec<usize>,
}

/// A test of `L` pairs side by side, given by the indices of their vertices.
trait Screen<const L: usize>: Sync {
    type Margin: Number;
    /// Greater than zero where the pair is ruled out.
    fn margin(&self, shape: Shape, v: &[[usize; 4]; L]) -> [Self::Margin; L];
}

/// Candidates by number, vertex-face pairs first.
#[derive(Clone, Copy)]
pub struct Lists<'a> {
    /// What they are pairs of.
    pub primitives: &'a Primitives<'a>,
    /// The pairs.
    pub candidates: &'a Candidates,
}

impl Open {
    /// Begins with all candidates, or with some; whether there are any.
    fn take(&mut self, lists: Lists, among: Option<&[u32]>) -> bool {
        let Candidates { vertex_face, edge_edge, .. } = lists.candidates;
        self.numbers.clear();
        match among {
            Some(among) => self.numbers.extend_from_slice(among),
            None => self.numbers.extend(0..(vertex_face.len() + edge_edge.len()) as u32),
        }
        !self.numbers.is_empty()
    }

    /// Leaves those that the screen does not rule out.
    fn rule_out<const L: usize, S: Screen<L>>(&mut self, lists: Lists, screen: &S, par: Par) {
        let Open { numbers, left } = self;
        left.clear();
        let screened = |numbers| run_wide(Block::<L, S> { lists, screen, numbers });
        par.fold_tasks(numbers.chunks_mut(BLOCK), screened, |count: usize| left.push(count));
        let mut filled = 0;
        for (block, left) in left.iter().enumerate() {
            numbers.copy_within(block * BLOCK..block * BLOCK + left, filled);
            filled += left;
        }
        numbers.truncate(filled);
    }
}

impl Lists<'_> {
    #[inline(always)]
    fn vertices(&self, shape: Shape, number: u32) -> [usize; 4] {
        let number = number as usize;
        let v = match shape {
            Shape::VertexFace => {
                let [a, b] = self.candidates.vertex_face[number];
                let [t0, t1, t2] = self.primitives.faces[b as usize];
                [a, t0, t1, t2]
            }
            Shape::EdgeEdge => {
                let [a, b] = self.candidates.edge_edge[number - self.candidates.vertex_face.len()];
                let ([a0, a1], [b0, b1]) = (self.primitives.edges[a as usize], self.primitives.edges[b as usize]);
                [a0, a1, b0, b1]
            }
        };
        [v[0] as usize, v[1] as usize, v[2] as usize, v[3] as usize]
    }
}

/// Some of the numbers; those of pairs left open go to the front, and it is told how many they are.
struct Block<'a, const L: usize, S> {
    lists: Lists<'a>,
    screen: &'a S,
    numbers: &'a mut [u32],
}

impl<const L: usize, S: Screen<L>> Kernel for Block<'_, L, S> {
    type Output = usize;

    #[inline(always)]
    fn run(mut self) -> usize {
        let vertex_faces = self.lists.candidates.vertex_face.len();
        let split = self.numbers.partition_point(|n| (*n as usize) < vertex_faces);
        let filled = self.compact(Shape::VertexFace, 0..split, 0);
        self.compact(Shape::EdgeEdge, split..self.numbers.len(), filled)
    }
}

impl<const L: usize, S: Screen<L>> Block<'_, L, S> {
    /// Moves what is left of a range to `filled` and behind; returns the end of it.
    #[inline(always)]
    fn compact(&mut self, shape: Shape, range: Range<usize>, mut filled: usize) -> usize {
        let mut start = range.start;
        while start < range.end {
            let width = L.min(range.end - start);
            // Lanes beyond the last pair repeat it.
            let mut numbers = [self.numbers[start]; L];
            let mut v = [[0; 4]; L];
            for l in 0..L {
                numbers[l] = self.numbers[start + l.min(width - 1)];
                v[l] = self.lists.vertices(shape, numbers[l]);
            }
            let margin = self.screen.margin(shape, &v);
            for l in 0..width {
                // What is not a number stays open.
                let apart = margin[l] > S::Margin::ZERO;
                self.numbers[filled] = numbers[l];
                filled += 1 - usize::from(apart);
            }
            start += width;
        }
        filled
    }
}

/// In double precision, as the data are.
struct Fine<'a> {
    x0: &'a [Vec3],
    x1: Option<&'a [Vec3]>,
    reach: &'a [f64],
}

impl Screen<WIDTH> for Fine<'_> {
    type Margin = f64;

    #[inline(always)]
    fn margin(&self, shape: Shape, v: &[[usize; 4]; WIDTH]) -> [f64; WIDTH] {
        let mut reach = Lanes([0.0; WIDTH]);
        for l in 0..WIDTH {
            reach.0[l] = self.reach[v[l][0]] + self.reach[v[l][second(shape)]];
        }
        let d0 = differences(shape, &gather(self.x0, v));
        let (n, distance) = direction(shape, &d0);
        let Some(x1) = self.x1 else {
            let error = sizes(&d0) * Lanes::splat(16.0 * DIRECTION_ERROR);
            return certain(support(&n, &d0), reach * Lanes::splat(1.0 + SLACK) + error, sizes(&d0)).0;
        };
        let d1 = differences(shape, &gather(x1, v));
        let extent = sizes(&d0) + sizes(&d1);
        let distance = distance * Lanes::splat(1.0 + SLACK) + Lanes::splat(2.0 * DIRECTION_ERROR) * extent;
        let separation = Lanes::splat(0.5) * reach.min(distance);
        certain(support(&n, &d0).min(support(&n, &d1)), required(separation, extent), extent).0
    }
}

/// In single precision, moved and scaled to the unit cube: the fourth number is the reach.
#[derive(Default)]
pub(super) struct Coarse {
    pub x0: Vec<[f32; 4]>,
    x1: Vec<[f32; 4]>,
    /// Lengths here for each metre there; zero, so that every pair stays open, where squares of these may leave the range
    /// of doubles.
    per_metre: f64,
}

impl Coarse {
    /// A reach that is missing is zero.
    pub fn assign(&mut self, x0: &[Vec3], x1: Option<&[Vec3]>, reach: &[f64], par: Par) {
        let x1 = x1.unwrap_or(&[]);
        let mut bounds = Aabb::EMPTY;
        let of_part = |x: &[Vec3]| x.iter().fold(Aabb::EMPTY, |b, x| b.union(&Aabb { low: *x, high: *x }));
        for x in [x0, x1] {
            par.fold_tasks(x.chunks(PART), of_part, |part| bounds = bounds.union(&part));
        }
        let (low, size) = (bounds.low, sub(bounds.high, bounds.low));
        let largest = size[0].max(size[1]).max(size[2]);
        let per_metre = if (1e-50..1e60).contains(&largest) { 1.0 / largest } else { 0.0 };
        for (x, packed) in [(x0, &mut self.x0), (x1, &mut self.x1)] {
            packed.resize(x.len(), [0.0; 4]);
            par.map_into(packed, |v| {
                let [a, b, c] = scale(per_metre, sub(x[v], low));
                // Rounding is within the slack of the tests.
                [a as f32, b as f32, c as f32, (per_metre * reach.get(v).copied().unwrap_or(0.0)) as f32]
            });
        }
        self.per_metre = per_metre;
    }
}

impl Screen<COARSE_WIDTH> for Coarse {
    type Margin = f32;

    #[inline(always)]
    fn margin(&self, shape: Shape, v: &[[usize; 4]; COARSE_WIDTH]) -> [f32; COARSE_WIDTH] {
        let (x0, reach) = gather_quads(&self.x0, v);
        let reach = reach[0] + reach[second(shape)];
        let d0 = differences(shape, &x0);
        let (n, distance) = direction(shape, &d0);
        let (mut gap, mut extent, mut separation) = (support(&n, &d0), sizes(&d0), reach);
        if !self.x1.is_empty() {
            let d1 = differences(shape, &gather_quads(&self.x1, v).0);
            (gap, extent) = (gap.min(support(&n, &d1)), extent + sizes(&d1));
            let distance = distance * Lanes::splat(1.0 + COARSE_SLACK) + Lanes::splat(2.0) * coarse_error(extent);
            separation = Lanes::splat(0.5) * reach.min(distance);
        }
        let required = separation * Lanes::splat(1.0 + COARSE_SLACK) + coarse_error(extent);
        let unit = Lanes::splat(1.0 + COARSE_SLACK) - dot(&n, &n);
        // NaN last: the smaller of two is the second where one is not a number.
        unit.min(gap - required).0
    }
}

/// Bound on the rounding of `n·D`, and on half that of a distance.
#[inline(always)]
fn coarse_error<const L: usize>(extent: Lanes<L, f32>) -> Lanes<L, f32> {
    Lanes::splat(COARSE_ERROR) + Lanes::splat(COARSE_DIRECTION_ERROR) * extent
}

/// The first vertex of the second primitive.
#[inline(always)]
fn second(shape: Shape) -> usize {
    if shape == Shape::VertexFace { 1 } else { 2 }
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
