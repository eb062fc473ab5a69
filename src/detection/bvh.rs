//! A tree of boxes over elements: four children a node, eight elements a leaf, boxes in single precision.
//!
//! Boxes are compared in the tree's own frame: every coordinate goes through one monotone map to `f32`
//! ([`Frame::packed`]). A monotone map keeps `a <= b`, so boxes that overlap still overlap, however coarse the numbers
//! are; and `packed(a) < packed(b)` proves `a < b`, so only ties need the double-precision boxes.

use crate::geometry::Aabb;
use crate::math::Vec3;
use crate::math::simd::overlaps;

/// Elements of a leaf.
pub(super) const LEAF: usize = 8;

/// A box in a [`Frame`]; the fourth lane is idle.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub(super) struct PackedBox {
    low: [f32; 4],
    high: [f32; 4],
}

impl PackedBox {
    pub const EMPTY: PackedBox = PackedBox { low: [f32::INFINITY; 4], high: [f32::NEG_INFINITY; 4] };

    #[inline(always)]
    pub fn union(&self, other: &PackedBox) -> PackedBox {
        let mut out = *self;
        for k in 0..4 {
            out.low[k] = if other.low[k] < self.low[k] { other.low[k] } else { self.low[k] };
            out.high[k] = if other.high[k] > self.high[k] { other.high[k] } else { self.high[k] };
        }
        out
    }

    /// The union of four boxes given by lanes.
    pub fn of_lanes(low: &[[f32; 4]; 3], high: &[[f32; 4]; 3]) -> PackedBox {
        let mut out = PackedBox::EMPTY;
        for k in 0..3 {
            out.low[k] = low[k].iter().copied().fold(f32::INFINITY, f32::min);
            out.high[k] = high[k].iter().copied().fold(f32::NEG_INFINITY, f32::max);
        }
        out
    }

    /// Writes the box into one of four lanes.
    #[inline(always)]
    pub fn write(&self, low: &mut [[f32; 4]; 3], high: &mut [[f32; 4]; 3], lane: usize) {
        for k in 0..3 {
            low[k][lane] = self.low[k];
            high[k][lane] = self.high[k];
        }
    }

    /// For [`overlaps`].
    #[inline(always)]
    pub fn query(&self) -> [f32; 6] {
        let (l, h) = (&self.low, &self.high);
        [l[0], l[1], l[2], h[0], h[1], h[2]]
    }

    fn extent(&self) -> f64 {
        let side = |k: usize| f64::from(self.high[k] - self.low[k]).max(0.0);
        side(0) + side(1) + side(2)
    }
}

/// A monotone map of coordinates to single precision: the data's centre to 0, its extent to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    centre: Vec3,
    scale: f64,
}

impl Frame {
    /// The frame of everything in `bounds`.
    pub fn of(bounds: &Aabb) -> Frame {
        let mut frame = Frame { centre: [0.0; 3], scale: 1.0 };
        let mut extent: f64 = 0.0;
        for k in 0..3 {
            if bounds.low[k] <= bounds.high[k] {
                frame.centre[k] = 0.5 * bounds.low[k] + 0.5 * bounds.high[k];
                extent = extent.max(bounds.high[k] - bounds.low[k]);
            }
        }
        if extent > 0.0 && extent.is_finite() {
            frame.scale = (1.0 / extent).min(f64::MAX);
        }
        frame
    }

    #[inline(always)]
    fn lanes(&self, x: Vec3) -> [f32; 4] {
        let lane = |k: usize| ((x[k] - self.centre[k]) * self.scale) as f32;
        [lane(0), lane(1), lane(2), 0.0]
    }

    #[inline(always)]
    pub fn packed(&self, b: &Aabb) -> PackedBox {
        PackedBox { low: self.lanes(b.low), high: self.lanes(b.high) }
    }
}

/// A child that is a leaf has this bit; the rest is its number.
const LEAF_BIT: u32 = 1 << 31;
/// No child.
const NONE: u32 = u32::MAX;
/// Connected components differ within the leaf or branch.
pub(super) const MIXED: u32 = u32::MAX;

#[derive(Clone, Debug)]
#[repr(align(16))]
struct Node {
    low: [[f32; 4]; 3],
    high: [[f32; 4]; 3],
    child: [u32; 4],
    /// Largest leaf number below the child.
    last: [u32; 4],
    /// Connected component of everything below the child, or [`MIXED`].
    component: [u32; 4],
}

impl Node {
    const EMPTY: Node = Node {
        low: [[f32::INFINITY; 4]; 3],
        high: [[f32::NEG_INFINITY; 4]; 3],
        child: [NONE; 4],
        last: [0; 4],
        component: [MIXED; 4],
    };
}

/// The tree over leaves; leaves are numbered from left to right.
#[derive(Clone, Debug, Default)]
pub(super) struct Bvh {
    /// Parents before children.
    nodes: Vec<Node>,
    /// Component per leaf.
    pub components: Vec<u32>,
}

/// Order of the elements after building: leaf `i` holds `order[LEAF * i..]`, at most [`LEAF`] of them.
pub(super) type Order = Vec<u32>;

impl Bvh {
    /// Builds the tree by halving at the median of the longest side. `components[e]` is the element's component.
    ///
    /// Cost: `n log n`.
    pub fn build(centres: &[Vec3], components: &[u32]) -> (Bvh, Order) {
        let mut keyed: Vec<(Vec3, u32)> = centres.iter().copied().zip(0..).collect();
        let mut tree = Bvh::default();
        let leaves = keyed.len().div_ceil(LEAF);
        tree.nodes.reserve(leaves / 2 + 1);
        if leaves > 0 {
            tree.nodes.push(Node::EMPTY);
            tree.branch(0, &mut keyed, 0);
        }
        let order: Order = keyed.iter().map(|(_, element)| *element).collect();
        let uniform = |leaf: &[u32]| {
            let first = components[leaf[0] as usize];
            if leaf.iter().all(|e| components[*e as usize] == first) { first } else { MIXED }
        };
        tree.components = order.chunks(LEAF).map(uniform).collect();
        tree.label();
        (tree, order)
    }

    /// Fills node `index` with the four quarters of `keyed`, whose first leaf is `first`.
    fn branch(&mut self, index: usize, keyed: &mut [(Vec3, u32)], first: u32) {
        let half = halve(keyed);
        let (left, right) = keyed.split_at_mut(half);
        let mut slot = 0;
        let mut first = first;
        for part in [left, right] {
            let quarter = halve(part);
            let (a, b) = part.split_at_mut(quarter);
            for elements in [a, b] {
                let leaves = elements.len().div_ceil(LEAF) as u32;
                if leaves == 0 {
                    continue;
                }
                self.nodes[index].last[slot] = first + leaves - 1;
                if leaves == 1 {
                    self.nodes[index].child[slot] = LEAF_BIT | first;
                } else {
                    let child = self.nodes.len();
                    self.nodes[index].child[slot] = child as u32;
                    self.nodes.push(Node::EMPTY);
                    self.branch(child, elements, first);
                }
                first += leaves;
                slot += 1;
            }
        }
    }

    /// Components of branches, from those of the leaves.
    fn label(&mut self) {
        let mut below = vec![MIXED; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..4 {
                let child = self.nodes[index].child[slot];
                self.nodes[index].component[slot] = match child {
                    NONE => continue,
                    leaf if leaf & LEAF_BIT != 0 => self.components[(leaf & !LEAF_BIT) as usize],
                    node => below[node as usize],
                };
            }
            let node = &self.nodes[index];
            let used = || (0..4).filter(|s| node.child[*s] != NONE).map(|s| node.component[s]);
            let first = used().next().unwrap_or(MIXED);
            below[index] = if used().all(|c| c == first) { first } else { MIXED };
        }
    }

    /// New boxes of the leaves, from which those of the branches follow. Returns the sum of the branches' extents, by
    /// which a tree that has become bad can be told. Cost: linear.
    pub fn refit(&mut self, leaves: &[PackedBox]) -> f64 {
        let mut total = 0.0;
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..4 {
                let b = match self.nodes[index].child[slot] {
                    NONE => continue,
                    leaf if leaf & LEAF_BIT != 0 => leaves[(leaf & !LEAF_BIT) as usize],
                    node => {
                        let node = &self.nodes[node as usize];
                        PackedBox::of_lanes(&node.low, &node.high)
                    }
                };
                total += b.extent();
                let node = &mut self.nodes[index];
                b.write(&mut node.low, &mut node.high, slot);
            }
        }
        total
    }

    /// Calls `visit` for every leaf numbered `from` or higher whose box overlaps or touches `b`. Branches for whose
    /// component `enter` says no are left out ([`MIXED`] branches are always entered).
    #[inline(always)]
    pub fn visit(&self, b: &[f32; 6], from: u32, enter: impl Fn(u32) -> bool, mut visit: impl FnMut(u32)) {
        // A branch halves twice a level: 2^32 leaves are 16 levels of at most three open siblings.
        let mut stack = [0_u32; 64];
        let mut open = usize::from(!self.nodes.is_empty());
        while open > 0 {
            open -= 1;
            let node = &self.nodes[stack[open] as usize];
            let mut mask = overlaps::<false>(&node.low, &node.high, b);
            while mask != 0 {
                let slot = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                // Boxes may be infinite: an empty slot can seem to overlap.
                if node.child[slot] == NONE || node.last[slot] < from {
                    continue;
                }
                if !(node.component[slot] == MIXED || enter(node.component[slot])) {
                    continue;
                }
                let child = node.child[slot];
                if child & LEAF_BIT != 0 {
                    visit(child & !LEAF_BIT);
                } else {
                    stack[open] = child;
                    open += 1;
                }
            }
        }
    }
}

/// Where to split so that the left part has whole leaves, after ordering the elements about that place along the
/// longest side of their centres. Equal coordinates are ordered by element number.
fn halve(keyed: &mut [(Vec3, u32)]) -> usize {
    let leaves = keyed.len().div_ceil(LEAF);
    if leaves < 2 {
        return keyed.len();
    }
    let mut bounds = Aabb::EMPTY;
    for (x, _) in keyed.iter() {
        bounds = bounds.union(&Aabb { low: *x, high: *x });
    }
    let side = |k: usize| bounds.high[k] - bounds.low[k];
    let axis = if side(0) >= side(1) && side(0) >= side(2) {
        0
    } else if side(1) >= side(2) {
        1
    } else {
        2
    };
    let split = leaves / 2 * LEAF;
    keyed.select_nth_unstable_by(split, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    split
}
