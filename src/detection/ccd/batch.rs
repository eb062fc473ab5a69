//! Continuous detection of whole candidate lists: all hits, or the earliest time.
//!
//! Four pairs side by side go through the tests that rule most of them out; what is left goes through the kernels one
//! by one. Blocks have a fixed size, so results have the same bits on any number of threads.

use super::coplanarity::{Frame, Point, axis_gap, plane_gap};
use super::exact::Shape;
use super::motion::{EdgeEdge, Kind, VertexFace};
use super::roots::only_root;
use super::{filter, separation};
use crate::detection::screening::separation_margin;
use crate::detection::{Candidates, Primitives};
use crate::math::simd::{Kernel, Lanes, points, run_wide};
use crate::math::{Vec3, is_finite};
use crate::parallel::Par;

/// Pairs side by side.
const WIDTH: usize = 4;

/// Pairs side by side where roots are sought: two chains of operations overlap.
const ROOT_WIDTH: usize = 8;

/// Pairs filtered in one go.
const BLOCK: usize = 512;

/// Blocks that start from the same earliest time; part of the numbers of [`earliest_time_of_impact`].
const ROUND: usize = 8;

/// Positions at both ends of the step and the primitives on them.
#[derive(Clone, Copy)]
struct Step<'a> {
    x0: &'a [Vec3],
    x1: &'a [Vec3],
    primitives: &'a Primitives<'a>,
}

/// The separations below which pairs count as hit `[m]`; zero asks for exact contact.
#[derive(Clone, Copy)]
pub enum Separation<'a> {
    /// One for all.
    Uniform(f64),
    /// One for each candidate, in their order.
    PerPair {
        /// For `Candidates::vertex_face`.
        vertex_face: &'a [f64],
        /// For `Candidates::edge_edge`.
        edge_edge: &'a [f64],
    },
}

/// A candidate pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pair {
    /// `[vertex index, face number]`
    VertexFace([u32; 2]),
    /// `[edge number, edge number]`
    EdgeEdge([u32; 2]),
}

/// A pair that comes into contact, or closer than its separation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Which pair.
    pub pair: Pair,
    /// When, as a fraction of the step, by the kernels' rules.
    pub time: f64,
}

/// All candidates that hit within the step: vertex-face pairs in the order of the list, then edge-edge pairs.
///
/// For separation zero the decision is exact ([`super::point_triangle::time_of_impact`]), otherwise conservative
/// ([`super::point_triangle::time_of_impact_with_separation`]). A pair with coordinates that are not finite is a hit at
/// time zero.
pub fn hits(
    x0: &[Vec3],
    x1: &[Vec3],
    primitives: &Primitives,
    candidates: &Candidates,
    separation: Separation,
    par: Par,
) -> Vec<Hit> {
    let (vertex_face, edge_edge) = lists(Step { x0, x1, primitives }, candidates, separation);
    let blocks = vertex_face.blocks() + edge_edge.blocks();
    let mut tasks: Vec<(usize, Vec<Hit>)> = (0..blocks).map(|b| (b, Vec::new())).collect();
    par.for_each_task(&mut tasks, |(b, found)| {
        let b = *b;
        if b < vertex_face.blocks() {
            vertex_face.block::<3, VertexFace>(b, 1.0, |hit, _| found.push(hit));
        } else {
            edge_edge.block::<4, EdgeEdge>(b - vertex_face.blocks(), 1.0, |hit, _| found.push(hit));
        }
    });
    tasks.into_iter().flat_map(|(_, found)| found).collect()
}

/// The earliest hit of a candidate list; the first in its order among equal times. `None` without a hit.
///
/// The time is never later than the earliest exact one; for separation zero it is at most 1e-6 earlier. Pairs are
/// tested up to the earliest time found so far only.
pub fn earliest_time_of_impact(
    x0: &[Vec3],
    x1: &[Vec3],
    primitives: &Primitives,
    candidates: &Candidates,
    separation: Separation,
    par: Par,
) -> Option<Hit> {
    let (vertex_face, edge_edge) = lists(Step { x0, x1, primitives }, candidates, separation);
    let blocks = vertex_face.blocks() + edge_edge.blocks();
    let mut earliest: Option<Hit> = None;
    for round in (0..blocks).step_by(ROUND) {
        let t_max = earliest.map_or(1.0, |hit| hit.time);
        if t_max == 0.0 {
            break;
        }
        let mut tasks: Vec<(usize, Option<Hit>)> = (round..blocks.min(round + ROUND)).map(|b| (b, None)).collect();
        par.for_each_task(&mut tasks, |(b, best)| {
            let b = *b;
            let mut keep = |hit: Hit, t_max: &mut f64| {
                if best.is_none_or(|b| hit.time < b.time) {
                    *best = Some(hit);
                    *t_max = hit.time;
                }
            };
            if b < vertex_face.blocks() {
                vertex_face.block::<3, VertexFace>(b, t_max, &mut keep);
            } else {
                edge_edge.block::<4, EdgeEdge>(b - vertex_face.blocks(), t_max, &mut keep);
            }
        });
        for hit in tasks.into_iter().filter_map(|(_, best)| best) {
            if earliest.is_none_or(|e| hit.time < e.time) {
                earliest = Some(hit);
            }
        }
    }
    earliest
}

fn lists<'a>(step: Step<'a>, candidates: &'a Candidates, separation: Separation<'a>) -> (List<'a>, List<'a>) {
    let finite = step.x0.iter().chain(step.x1).all(|x| is_finite(*x));
    let (vertex_face, edge_edge) = match separation {
        Separation::Uniform(_) => (None, None),
        Separation::PerPair { vertex_face, edge_edge } => (Some(vertex_face), Some(edge_edge)),
    };
    let uniform = if let Separation::Uniform(s) = separation { s } else { 0.0 };
    let list = |pairs, per_pair| List { step, pairs, per_pair, uniform, finite };
    (list(&candidates.vertex_face[..], vertex_face), list(&candidates.edge_edge[..], edge_edge))
}

/// One of the two candidate lists with its separations.
struct List<'a> {
    step: Step<'a>,
    pairs: &'a [[u32; 2]],
    per_pair: Option<&'a [f64]>,
    uniform: f64,
    finite: bool,
}

impl List<'_> {
    fn blocks(&self) -> usize {
        self.pairs.len().div_ceil(BLOCK)
    }

    #[inline(always)]
    fn separation(&self, i: usize) -> f64 {
        self.per_pair.map_or(self.uniform, |s| s[i])
    }

    #[inline(always)]
    fn vertices(&self, shape: Shape, i: usize) -> [usize; 4] {
        let [a, b] = self.pairs[i];
        let v = match shape {
            Shape::VertexFace => {
                let [t0, t1, t2] = self.step.primitives.faces[b as usize];
                [a, t0, t1, t2]
            }
            Shape::EdgeEdge => {
                let ([a0, a1], [b0, b1]) =
                    (self.step.primitives.edges[a as usize], self.step.primitives.edges[b as usize]);
                [a0, a1, b0, b1]
            }
        };
        v.map(|v| v as usize)
    }

    /// Hits of one block up to `t_max`, which `keep` may lower.
    fn block<const N: usize, K: Kind<N>>(&self, b: usize, t_max: f64, mut keep: impl FnMut(Hit, &mut f64)) {
        let start = b * BLOCK;
        let count = BLOCK.min(self.pairs.len() - start);
        let separated = self.per_pair.is_some() || self.uniform > 0.0;
        let mut open = [0_u16; BLOCK];
        let mut times = [f64::NAN; BLOCK];
        let mut filled = count;
        if self.finite {
            let filter = BlockFilter { list: self, shape: K::SHAPE, start, count, t_max, separated, open: &mut open };
            filled = run_wide(filter);
            if separated {
                for at_end in [false, true] {
                    let open = &mut open[..filled];
                    filled = run_wide(BlockDirections { list: self, shape: K::SHAPE, start, at_end, open });
                }
            } else {
                let open = &open[..filled];
                run_wide(BlockRoots { list: self, shape: K::SHAPE, start, t_max, open, times: &mut times });
            }
        } else {
            for (i, o) in open.iter_mut().enumerate() {
                *o = i as u16;
            }
        }
        let mut t_max = t_max;
        for (o, time) in open[..filled].iter().zip(times) {
            let i = start + *o as usize;
            let time = if time.is_nan() { self.single::<N, K>(i, t_max) } else { (time <= t_max).then_some(time) };
            if let Some(time) = time {
                let pair = match K::SHAPE {
                    Shape::VertexFace => Pair::VertexFace(self.pairs[i]),
                    Shape::EdgeEdge => Pair::EdgeEdge(self.pairs[i]),
                };
                keep(Hit { pair, time }, &mut t_max);
            }
        }
    }

    /// The kernel for one pair that the tests of several pairs at once left open.
    fn single<const N: usize, K: Kind<N>>(&self, i: usize, t_max: f64) -> Option<f64> {
        let v = self.vertices(K::SHAPE, i);
        let (x0, x1) = (v.map(|v| self.step.x0[v]), v.map(|v| self.step.x1[v]));
        let s = self.separation(i);
        if s > 0.0 {
            separation::first_approach::<N, K>(&x0, &x1, s, t_max, separation::MAX_INTERVALS)
        } else if self.finite {
            let frame = Frame::new(K::SHAPE, &filter::single(&x0), &filter::single(&x1));
            filter::after_plane_test::<N, K>(&x0, &x1, &frame, t_max)
        } else {
            filter::time_of_impact::<N, K>(&x0, &x1, t_max)
        }
    }

    /// The points of several pairs at both ends of the step.
    #[inline(always)]
    fn gather<const L: usize>(&self, shape: Shape, pairs: &[usize; L]) -> ([Point<L>; 4], [Point<L>; 4]) {
        let mut v = [[0; 4]; L];
        for l in 0..L {
            v[l] = self.vertices(shape, pairs[l]);
        }
        (points::gather(self.step.x0, &v), points::gather(self.step.x1, &v))
    }
}

/// Rules out pairs, several at once; what is left is listed in `open`, relative to `start`.
struct BlockFilter<'a> {
    list: &'a List<'a>,
    shape: Shape,
    start: usize,
    count: usize,
    t_max: f64,
    separated: bool,
    open: &'a mut [u16; BLOCK],
}

impl Kernel for BlockFilter<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        match self.shape {
            Shape::VertexFace => self.run_shape(Shape::VertexFace),
            Shape::EdgeEdge => self.run_shape(Shape::EdgeEdge),
        }
    }
}

impl BlockFilter<'_> {
    #[inline(always)]
    fn run_shape(self, shape: Shape) -> usize {
        let mut filled = 0;
        for group in (0..self.count).step_by(WIDTH) {
            let width = WIDTH.min(self.count - group);
            // Lanes beyond the last pair repeat it.
            let mut pairs = [self.start + group; WIDTH];
            let mut s = Lanes([0.0; WIDTH]);
            for l in 0..WIDTH {
                pairs[l] += l.min(width - 1);
                s.0[l] = self.list.separation(pairs[l]);
            }
            let (x0, x1) = self.list.gather(shape, &pairs);
            let mut gap = axis_gap(shape, &x0, &x1, s, self.t_max);
            if !self.separated {
                gap = gap.max(plane_gap(&Frame::new(shape, &x0, &x1), self.t_max));
            }
            for l in 0..width {
                self.open[filled] = (group + l) as u16;
                filled += 1 - usize::from(gap.0[l] > 0.0);
            }
        }
        filled
    }
}

/// Rules out pairs that a fixed direction keeps apart by their separation; what is left stays in `open`.
struct BlockDirections<'a> {
    list: &'a List<'a>,
    shape: Shape,
    start: usize,
    at_end: bool,
    open: &'a mut [u16],
}

impl Kernel for BlockDirections<'_> {
    type Output = usize;

    #[inline(always)]
    fn run(self) -> usize {
        match self.shape {
            Shape::VertexFace => self.run_shape(Shape::VertexFace),
            Shape::EdgeEdge => self.run_shape(Shape::EdgeEdge),
        }
    }
}

impl BlockDirections<'_> {
    #[inline(always)]
    fn run_shape(self, shape: Shape) -> usize {
        let mut filled = 0;
        for group in (0..self.open.len()).step_by(WIDTH) {
            let width = WIDTH.min(self.open.len() - group);
            // Lanes beyond the last pair repeat it.
            let mut numbers = [0; WIDTH];
            let mut pairs = [0; WIDTH];
            let mut s = Lanes([0.0; WIDTH]);
            for l in 0..WIDTH {
                numbers[l] = self.open[group + l.min(width - 1)];
                pairs[l] = self.start + numbers[l] as usize;
                s.0[l] = self.list.separation(pairs[l]);
            }
            let (x0, x1) = self.list.gather(shape, &pairs);
            let margin = separation_margin(shape, &x0, &x1, s, self.at_end);
            for l in 0..width {
                // What is not a number stays open.
                let apart = margin.0[l] > 0.0;
                self.open[filled] = numbers[l];
                filled += 1 - usize::from(apart);
            }
        }
        filled
    }
}

/// Decides pairs whose cubic has a single root, several at once; the others stay NaN in `times`.
struct BlockRoots<'a> {
    list: &'a List<'a>,
    shape: Shape,
    start: usize,
    t_max: f64,
    open: &'a [u16],
    times: &'a mut [f64; BLOCK],
}

impl Kernel for BlockRoots<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        match self.shape {
            Shape::VertexFace => self.run_shape(Shape::VertexFace),
            Shape::EdgeEdge => self.run_shape(Shape::EdgeEdge),
        }
    }
}

impl BlockRoots<'_> {
    #[inline(always)]
    fn run_shape(self, shape: Shape) {
        for (group, times) in self.open.chunks(ROOT_WIDTH).zip(self.times.chunks_mut(ROOT_WIDTH)) {
            // Lanes beyond the last pair repeat the first one.
            let mut pairs = [self.start + group[0] as usize; ROOT_WIDTH];
            for (pair, o) in pairs.iter_mut().zip(group) {
                *pair = self.start + *o as usize;
            }
            let (x0, x1) = self.list.gather(shape, &pairs);
            let found = only_root(shape, &Frame::new(shape, &x0, &x1), self.t_max).0;
            times[..group.len()].copy_from_slice(&found[..group.len()]);
        }
    }
}
