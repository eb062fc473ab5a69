//! The primitives of one kind in the order of the tree's leaves, four side by side.

use super::bvh::PackedBox;
use crate::math::simd::{equals, overlaps};
use crate::parallel::Par;

/// No primitive in this lane.
const NONE: u32 = u32::MAX;

/// Four primitives with `N` vertices each: boxes, vertices and numbers by lane.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub(super) struct Block<const N: usize> {
    low: [[f32; 4]; 3],
    high: [[f32; 4]; 3],
    corners: [[u32; 4]; N],
    /// Vertex index, edge number or face number.
    numbers: [u32; 4],
    /// One bit per lane that holds a primitive.
    used: i32,
}

impl<const N: usize> Block<N> {
    /// Bits of the primitives whose boxes overlap or touch the query.
    #[inline(always)]
    pub fn near(&self, query: &[f32; 6]) -> i32 {
        overlaps::<false>(&self.low, &self.high, query) & self.used
    }

    /// Bits of the lanes whose overlap is certain.
    #[inline(always)]
    pub fn proven(&self, query: &[f32; 6]) -> i32 {
        overlaps::<true>(&self.low, &self.high, query)
    }

    /// Bits of the primitives that have one of the vertices.
    #[inline(always)]
    pub fn sharing<const M: usize>(&self, vertices: &[u32; M]) -> i32 {
        let mut mask = 0;
        for v in vertices {
            for corners in &self.corners {
                mask |= equals(corners, *v);
            }
        }
        mask
    }

    #[inline(always)]
    pub fn query(&self, lane: usize) -> [f32; 6] {
        let (l, h) = (&self.low, &self.high);
        [l[0][lane], l[1][lane], l[2][lane], h[0][lane], h[1][lane], h[2][lane]]
    }

    #[inline(always)]
    pub fn corners(&self, lane: usize) -> [u32; N] {
        std::array::from_fn(|k| self.corners[k][lane])
    }

    #[inline(always)]
    pub fn number(&self, lane: usize) -> u32 {
        self.numbers[lane]
    }

    /// The box of all lanes.
    pub fn bounds(&self) -> PackedBox {
        PackedBox::of_lanes(&self.low, &self.high)
    }
}

/// Blocks of all leaves; a leaf starts a new block.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafBlocks<const N: usize> {
    blocks: Vec<Block<N>>,
    /// First block of each leaf, and the end.
    offsets: Vec<u32>,
}

impl<const N: usize> LeafBlocks<N> {
    /// From the numbers of each leaf, one after the other.
    pub fn arrange<'a>(leaves: impl Iterator<Item = &'a [u32]>, corners: impl Fn(u32) -> [u32; N]) -> Self {
        let mut out = LeafBlocks { blocks: Vec::new(), offsets: vec![0] };
        for numbers in leaves {
            for four in numbers.chunks(4) {
                let mut block = Block {
                    low: [[f32::INFINITY; 4]; 3],
                    high: [[f32::NEG_INFINITY; 4]; 3],
                    corners: [[NONE; 4]; N],
                    numbers: [NONE; 4],
                    used: (1 << four.len()) - 1,
                };
                for (lane, number) in four.iter().enumerate() {
                    block.numbers[lane] = *number;
                    for (k, v) in corners(*number).into_iter().enumerate() {
                        block.corners[k][lane] = v;
                    }
                }
                out.blocks.push(block);
            }
            out.offsets.push(out.blocks.len() as u32);
        }
        out
    }

    #[inline(always)]
    pub fn leaf(&self, leaf: u32) -> &[Block<N>] {
        &self.blocks[self.offsets[leaf as usize] as usize..self.offsets[leaf as usize + 1] as usize]
    }

    /// New boxes: the unions of the boxes of the vertices. Cost: linear.
    pub fn refit(&mut self, vertices: &[PackedBox], par: Par) {
        par.for_each_block(&mut self.blocks, |_, blocks| {
            for block in blocks {
                for lane in 0..4 {
                    if block.used >> lane & 1 == 0 {
                        continue;
                    }
                    let corners = block.corners(lane);
                    let mut bounds = vertices[corners[0] as usize];
                    for v in &corners[1..] {
                        bounds = bounds.union(&vertices[*v as usize]);
                    }
                    bounds.write(&mut block.low, &mut block.high, lane);
                }
            }
        });
    }
}
