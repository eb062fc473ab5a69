//! A tree of boxes over elements: eight children a node, eight elements a leaf, boxes in single precision.
//!
//! Boxes are compared in the tree's own frame: every coordinate goes through one monotone map to `f32`
//! ([`Frame::packed`]). A monotone map keeps `a <= b`, so boxes that overlap still overlap, however coarse the numbers
//! are; and `packed(a) < packed(b)` proves `a < b`, so only ties need the double-precision boxes.

use crate::geometry::Aabb;
use crate::math::Vec3;
use crate::math::simd::Eight;

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

    /// A lane that holds no box.
    pub const NONE: PackedBox = PackedBox { low: [f32::NAN; 4], high: [f32::NAN; 4] };

    #[inline(always)]
    pub fn union(&self, other: &PackedBox) -> PackedBox {
        let mut out = *self;
        for k in 0..4 {
            out.low[k] = if other.low[k] < self.low[k] { other.low[k] } else { self.low[k] };
            out.high[k] = if other.high[k] > self.high[k] { other.high[k] } else { self.high[k] };
        }
        out
    }

    /// Whether they overlap or touch.
    #[inline(always)]
    pub fn overlaps(&self, other: &PackedBox) -> bool {
        let mut hit = true;
        for k in 0..4 {
            hit &= (self.low[k] <= other.high[k]) & (other.low[k] <= self.high[k]);
        }
        hit
    }

    /// The union of eight boxes given by lanes; lanes of NaN hold none.
    #[inline(always)]
    pub fn of_lanes(low: &Rows, high: &Rows) -> PackedBox {
        let mut out = PackedBox::EMPTY;
        for k in 0..3 {
            let (mut smallest, mut largest) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
            for i in 0..8 {
                // Where a comparison with NaN is false, the neutral element stays.
                smallest[i] = if low[k][i] < smallest[i] { low[k][i] } else { smallest[i] };
                largest[i] = if high[k][i] > largest[i] { high[k][i] } else { largest[i] };
            }
            for width in [4, 2, 1] {
                for i in 0..width {
                    let (a, b) = (smallest[i + width], largest[i + width]);
                    smallest[i] = if a < smallest[i] { a } else { smallest[i] };
                    largest[i] = if b > largest[i] { b } else { largest[i] };
                }
            }
            (out.low[k], out.high[k]) = (smallest[0], largest[0]);
        }
        out
    }

    /// Eight boxes by lanes.
    #[inline(always)]
    pub fn rows(boxes: &[PackedBox; 8]) -> (Rows, Rows) {
        let (mut low, mut high) = (Rows::default(), Rows::default());
        for (i, b) in boxes.iter().enumerate() {
            b.write(&mut low, &mut high, i);
        }
        (low, high)
    }

    /// Writes the box into one of eight lanes.
    #[inline(always)]
    pub fn write(&self, low: &mut Rows, high: &mut Rows, lane: usize) {
        for k in 0..3 {
            low[k][lane] = self.low[k];
            high[k][lane] = self.high[k];
        }
    }

    /// For [`Eight::overlaps`].
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

/// A coordinate of eight boxes a row.
pub(super) type Rows = [[f32; 8]; 3];

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
                // A radius may reach to infinity, the centre must not.
                let (low, high) = (bounds.low[k].max(f64::MIN), bounds.high[k].min(f64::MAX));
                frame.centre[k] = 0.5 * low + 0.5 * high;
                extent = extent.max(high - low);
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
#[repr(align(32))]
struct Node {
    low: Rows,
    high: Rows,
    child: [u32; 8],
    /// Largest leaf number below the child.
    last: [u32; 8],
    /// Connected component of everything below the child, or [`MIXED`].
    component: [u32; 8],
}

impl Node {
    const EMPTY: Node = Node {
        low: [[f32::NAN; 8]; 3],
        high: [[f32::NAN; 8]; 3],
        child: [NONE; 8],
        last: [0; 8],
        component: [MIXED; 8],
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

/// An element on its way to its leaf.
#[derive(Clone, Copy)]
struct Item {
    /// Twice the centre of its box in the frame, moved to positive numbers: those have the order of their bits.
    centre: [f32; 3],
    element: u32,
}

impl Item {
    fn new(bounds: &PackedBox, element: u32) -> Item {
        Item { centre: std::array::from_fn(|k| (bounds.low[k] + bounds.high[k] + 1.0).max(0.0)), element }
    }

    /// Total order along a side; elements at equal places by their numbers.
    #[inline(always)]
    fn key(&self, axis: usize) -> u64 {
        u64::from(self.centre[axis].to_bits()) << 32 | u64::from(self.element)
    }
}

impl Bvh {
    /// Builds the tree by halving at the median of the longest side. `boxes` are those of the elements,
    /// `components[e]` is the element's component.
    ///
    /// Cost: `n log n`.
    pub fn build(boxes: impl Iterator<Item = PackedBox>, components: &[u32]) -> (Bvh, Order) {
        let mut items: Vec<Item> = boxes.zip(0..).map(|(b, element)| Item::new(&b, element)).collect();
        let mut tree = Bvh::default();
        if !items.is_empty() {
            tree.nodes.reserve(items.len() / (4 * LEAF) + 1);
            tree.nodes.push(Node::EMPTY);
            tree.deal(0, 0, &mut items, 0, 0);
        }
        let order: Order = items.iter().map(|item| item.element).collect();
        let uniform = |leaf: &[u32]| {
            let first = components[leaf[0] as usize];
            if leaf.iter().all(|e| components[*e as usize] == first) { first } else { MIXED }
        };
        tree.components = order.chunks(LEAF).map(uniform).collect();
        tree.label();
        (tree, order)
    }

    /// Puts `items`, whose first leaf is `first`, into node `index` from slot `slot` on, after `halvings` of its three
    /// levels of halving. Returns the next free slot.
    fn deal(&mut self, index: usize, slot: usize, items: &mut [Item], first: u32, halvings: u32) -> usize {
        let leaves = items.len().div_ceil(LEAF);
        if leaves > 1 && halvings < 3 {
            let split = leaves / 2 * LEAF;
            halve(items, split);
            let (left, right) = items.split_at_mut(split);
            let slot = self.deal(index, slot, left, first, halvings + 1);
            return self.deal(index, slot, right, first + (leaves / 2) as u32, halvings + 1);
        }
        self.nodes[index].last[slot] = first + leaves as u32 - 1;
        if leaves == 1 {
            self.nodes[index].child[slot] = LEAF_BIT | first;
        } else {
            let child = self.nodes.len();
            self.nodes[index].child[slot] = child as u32;
            self.nodes.push(Node::EMPTY);
            self.deal(child, 0, items, first, 0);
        }
        slot + 1
    }

    /// Components of branches, from those of the leaves.
    fn label(&mut self) {
        let mut below = vec![MIXED; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..8 {
                let child = self.nodes[index].child[slot];
                self.nodes[index].component[slot] = match child {
                    NONE => continue,
                    leaf if leaf & LEAF_BIT != 0 => self.components[(leaf & !LEAF_BIT) as usize],
                    node => below[node as usize],
                };
            }
            let node = &self.nodes[index];
            let used = || (0..8).filter(|s| node.child[*s] != NONE).map(|s| node.component[s]);
            let first = used().next().unwrap_or(MIXED);
            below[index] = if used().all(|c| c == first) { first } else { MIXED };
        }
    }

    /// New boxes of the leaves, from which those of the branches follow. Returns the sum of the branches' extents, by
    /// which a tree that has become bad can be told. Cost: linear.
    pub fn refit(&mut self, leaves: &[PackedBox]) -> f64 {
        let mut total = 0.0;
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..8 {
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

    /// Lists every leaf numbered `from` or higher whose box overlaps or touches `b`. Branches for whose component
    /// `enter` says no are left out ([`MIXED`] branches are always entered).
    #[inline(always)]
    pub fn list<E: Eight>(&self, eight: E, b: &[f32; 6], from: u32, enter: impl Fn(u32) -> bool, out: &mut Vec<u32>) {
        out.clear();
        // A branch halves at least once a level: 2^28 leaves are 28 levels of at most seven open siblings.
        let mut stack = [0_u32; 256];
        let mut open = usize::from(!self.nodes.is_empty());
        while open > 0 {
            open -= 1;
            let node = &self.nodes[stack[open] as usize];
            let mut mask = eight.overlaps::<false>(&node.low, &node.high, b);
            while mask != 0 {
                let slot = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if node.last[slot] < from || !(node.component[slot] == MIXED || enter(node.component[slot])) {
                    continue;
                }
                let child = node.child[slot];
                if child & LEAF_BIT != 0 {
                    out.push(child & !LEAF_BIT);
                } else {
                    stack[open] = child;
                    open += 1;
                }
            }
        }
    }
}

/// Moves the elements that come first along the longest side of the centres before `split`, the others behind it.
fn halve(items: &mut [Item], split: usize) {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items.iter() {
        for k in 0..3 {
            let x = item.centre[k];
            low[k] = if x < low[k] { x } else { low[k] };
            high[k] = if x > high[k] { x } else { high[k] };
        }
    }
    let side = |k: usize| high[k] - low[k];
    let axis = if side(0) >= side(1) && side(0) >= side(2) {
        0
    } else if side(1) >= side(2) {
        1
    } else {
        2
    };
    items.select_nth_unstable_by_key(split, |item| item.key(axis));
}
