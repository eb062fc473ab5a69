//! All pairs of primitives of two leaves whose boxes overlap: the innermost loops of a traversal.

use super::bvh::LEAF;
use super::leaf_blocks::{Block, NONE};
use super::pair_lists::PairBuffer;
use super::primitives::Filter;
use crate::geometry::Aabb;
use crate::math::simd::Eight;

/// Blocks of vertices, edges or faces of one leaf at most: three primitives an element.
const BLOCKS: usize = 3 * LEAF / 8;

/// Pairs between two leaves, and where they go.
pub(super) struct Side<'a, E> {
    pub eight: E,
    /// Boxes in double precision by vertex index, for ties.
    pub boxes: &'a [Aabb],
    /// Asked for each pair, if at all.
    pub filter: Option<&'a Filter<'a>>,
    /// Vertices that two primitives must not share, by index; none beyond the end. `None` for all.
    pub apart_at: Option<&'a [bool]>,
    pub out: &'a mut PairBuffer,
}

impl<E: Eight> Side<'_, E> {
    /// All pairs of primitives of one leaf with those of another, each first restricted to the other's box. With
    /// `ASCENDING` the smaller number of a pair goes first.
    #[inline(always)]
    pub fn pairs<const N: usize, const M: usize, const ASCENDING: bool>(
        &mut self,
        first: &[Block<N>],
        near_first: &[f32; 6],
        second: &[Block<M>],
        near_second: &[f32; 6],
    ) {
        let mut masks = [0; BLOCKS];
        let mut any = 0;
        for (mask, block) in masks.iter_mut().zip(second) {
            *mask = block.near(self.eight, near_second);
            any |= *mask;
        }
        if any == 0 {
            return;
        }
        for block in first {
            let mut lanes = block.near(self.eight, near_first);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                for (other, mask) in second.iter().zip(&masks) {
                    self.with::<N, M, ASCENDING>(block, lane, other, *mask);
                }
            }
        }
    }

    /// Each pair of primitives of one list once, the smaller number first.
    #[inline(always)]
    pub fn pairs_within<const N: usize>(&mut self, list: &[Block<N>]) {
        for (i, block) in list.iter().enumerate() {
            for lane in 0..8 {
                // Of its own block, only the lanes behind it. Empty lanes overlap nothing.
                self.with::<N, N, true>(block, lane, block, !((2 << lane) - 1));
                for other in &list[i + 1..] {
                    self.with::<N, N, true>(block, lane, other, !0);
                }
            }
        }
    }

    /// One primitive with those of a block: keeps what is in the mask, overlaps exactly, shares no vertex (of those that
    /// count) and passes the filter.
    #[inline(always)]
    fn with<const N: usize, const M: usize, const ASCENDING: bool>(
        &mut self,
        block: &Block<N>,
        lane: usize,
        other: &Block<M>,
        mask: u32,
    ) {
        let (query, corners) = (block.query(lane), block.corners(lane));
        let mut hits = other.near(self.eight, &query) & mask;
        if hits == 0 {
            return;
        }
        let mut unshared = corners;
        if let Some(apart_at) = self.apart_at {
            unshared = corners.map(|v| if apart_at.get(v as usize).is_some_and(|apart| *apart) { v } else { NONE });
        }
        hits &= !other.sharing(self.eight, &unshared);
        if hits == 0 {
            return;
        }
        let ties = hits & !other.proven(self.eight, &query);
        if ties != 0 {
            hits &= !apart(self.boxes, &corners, other, ties);
        }
        if let Some(filter) = self.filter {
            hits = only(hits, |lane| filter(corners[0], other.corners(lane)[0]));
        }
        self.out.push::<E, ASCENDING>(self.eight, block.numbers[lane], &other.numbers, hits);
    }
}

/// Bits of `lanes` whose exact boxes do not overlap that of the corners.
#[inline(never)]
fn apart<const N: usize, const M: usize>(boxes: &[Aabb], corners: &[u32; N], other: &Block<M>, lanes: u32) -> u32 {
    let own = exact_box(boxes, corners);
    only(lanes, |lane| !own.overlaps(&exact_box(boxes, &other.corners(lane))))
}

/// Those of the bits for which `keep` says yes.
#[inline(always)]
fn only(lanes: u32, keep: impl Fn(usize) -> bool) -> u32 {
    let (mut rest, mut kept) = (lanes, 0);
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        kept |= u32::from(keep(lane)) << lane;
    }
    kept
}

#[inline(always)]
fn exact_box<const N: usize>(boxes: &[Aabb], corners: &[u32; N]) -> Aabb {
    let mut out = boxes[corners[0] as usize];
    for v in &corners[1..] {
        let b = &boxes[*v as usize];
        for k in 0..3 {
            out.low[k] = if b.low[k] < out.low[k] { b.low[k] } else { out.low[k] };
            out.high[k] = if b.high[k] > out.high[k] { b.high[k] } else { out.high[k] };
        }
    }
    out
}
