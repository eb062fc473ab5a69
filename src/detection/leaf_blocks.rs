//! The primitives of one kind in the order of the tree's leaves, eight side by side.

use super::bvh::{PackedBox, Rows};
use super::ownership::Lists;
use crate::math::simd::Eight;
use crate::parallel::Par;

/// No primitive in this lane.
pub(super) const NONE: u32 = u32::MAX;

/// Eight primitives with `N` vertices each: boxes, vertices and numbers by lane.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub(super) struct Block<const N: usize> {
    low: Rows,
    high: Rows,
    corners: [[u32; 8]; N],
    /// Vertex index, edge number or face number.
    pub numbers: [u32; 8],
    /// Lanes that hold a primitive, from the first on; the boxes of the others are NaN.
    used: usize,
}

impl<const N: usize> Block<N> {
    const EMPTY: Block<N> = Block {
        low: [[f32::NAN; 8]; 3],
        high: [[f32::NAN; 8]; 3],
        corners: [[NONE; 8]; N],
        numbers: [NONE; 8],
        used: 0,
    };

    /// Bits of the primitives whose boxes overlap or touch the query.
    #[inline(always)]
    pub fn near<E: Eight>(&self, eight: E, query: &[f32; 6]) -> u32 {
        eight.overlaps::<false>(&self.low, &self.high, query)
    }

    /// Bits of the lanes whose overlap is certain.
    #[inline(always)]
    pub fn proven<E: Eight>(&self, eight: E, query: &[f32; 6]) -> u32 {
        eight.overlaps::<true>(&self.low, &self.high, query)
    }

    /// Bits of the primitives that have one of the vertices.
    #[inline(always)]
    pub fn sharing<E: Eight, const M: usize>(&self, eight: E, vertices: &[u32; M]) -> u32 {
        eight.any_equal(&self.corners, vertices)
    }

    #[inline(always)]
    pub fn query(&self, lane: usize) -> [f32; 6] {
        let (l, h) = (&self.low, &self.high);
        [l[0][lane], l[1][lane], l[2][lane], h[0][lane], h[1][lane], h[2][lane]]
    }

    #[inline(always)]
    pub fn corners(&self, lane: usize) -> [u32; N] {
        let mut corners = [0; N];
        for k in 0..N {
            corners[k] = self.corners[k][lane];
        }
        corners
    }

    /// The box of all lanes.
    #[inline(always)]
    pub fn bounds(&self) -> PackedBox {
        PackedBox::of_lanes(&self.low, &self.high)
    }

    fn refit(&mut self, vertices: &[PackedBox]) {
        let mut lanes = [PackedBox::NONE; 8];
        for (lane, bounds) in lanes.iter_mut().enumerate().take(self.used) {
            let corners = self.corners(lane);
            *bounds = vertices[corners[0] as usize];
            for v in &corners[1..] {
                *bounds = bounds.union(&vertices[*v as usize]);
            }
        }
        (self.low, self.high) = PackedBox::rows(&lanes);
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
    /// Holds the primitives of each leaf's elements from now on, one after the other.
    pub fn arrange<'a>(
        &mut self,
        leaves: impl ExactSizeIterator<Item = &'a [u32]>,
        owned: &Lists,
        corners: impl Fn(u32) -> [u32; N],
    ) {
        let LeafBlocks { blocks, offsets } = self;
        blocks.clear();
        blocks.reserve(leaves.len() + owned.total() / 8);
        offsets.clear();
        offsets.push(0);
        for leaf in leaves {
            let first = blocks.len();
            for number in leaf.iter().flat_map(|element| owned.of(*element)) {
                if blocks.len() == first || blocks[blocks.len() - 1].used == 8 {
                    blocks.push(Block::EMPTY);
                }
                let last = blocks.len() - 1;
                let block = &mut blocks[last];
                block.numbers[block.used] = *number;
                for (row, v) in block.corners.iter_mut().zip(corners(*number)) {
                    row[block.used] = v;
                }
                block.used += 1;
            }
            offsets.push(blocks.len() as u32);
        }
    }

    #[inline(always)]
    pub fn leaf(&self, leaf: u32) -> &[Block<N>] {
        &self.blocks[self.offsets[leaf as usize] as usize..self.offsets[leaf as usize + 1] as usize]
    }

    /// Whether a primitive of the leaf has a vertex for which `woken` says yes.
    pub fn holds(&self, leaf: u32, woken: &[bool]) -> bool {
        let of_block =
            |block: &Block<N>| block.corners.iter().any(|row| row[..block.used].iter().any(|v| woken[*v as usize]));
        self.leaf(leaf).iter().any(of_block)
    }

    /// The box of all primitives of a leaf.
    #[inline(always)]
    pub fn bounds(&self, leaf: u32) -> PackedBox {
        self.leaf(leaf).iter().fold(PackedBox::EMPTY, |all, block| all.union(&block.bounds()))
    }

    /// New boxes of one leaf.
    pub fn refit_leaf(&mut self, leaf: u32, vertices: &[PackedBox]) {
        let range = self.offsets[leaf as usize] as usize..self.offsets[leaf as usize + 1] as usize;
        self.blocks[range].iter_mut().for_each(|block| block.refit(vertices));
    }

    /// New boxes: the unions of the boxes of the vertices. Cost: linear.
    pub fn refit(&mut self, vertices: &[PackedBox], par: Par) {
        par.for_each_block(&mut self.blocks, |_, blocks| blocks.iter_mut().for_each(|block| block.refit(vertices)));
    }
}
