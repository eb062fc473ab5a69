//! The contacts of each block: what a block feels of them is gathered in their order, so that any number of threads
//! gives the same bits.

use crate::constraint::RowSet;
use crate::math::simd::Quad;
use crate::math::{Mat3, Vec3, add, add_scaled, cross, mat_vec};

/// Entries of a list of contacts by block. A contact is named by its place in the list.
#[derive(Clone, Debug, Default)]
pub(super) struct Incidence {
    /// Start of each block's entries in `linear`; one more than blocks.
    offsets: Vec<u32>,
    /// Contact and signed weight.
    linear: Vec<(u32, f64)>,
    /// Start of each block's entries in `angular`; empty when there are none.
    angular_offsets: Vec<u32>,
    /// Contact and weighted lever.
    angular: Vec<(u32, Vec3)>,
    /// Next free place of each block.
    next: Vec<u32>,
}

impl Incidence {
    /// Takes the rows `sources` as its contacts. Cost: one pass over their entries and over the blocks.
    pub fn rebuild(&mut self, rows: &RowSet, blocks: usize, sources: impl Iterator<Item = usize> + Clone) {
        let linear = |i: usize| rows.offsets[i] as usize..rows.offsets[i + 1] as usize;
        let angular = |i: usize| rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize;
        count(&mut self.offsets, blocks, sources.clone().flat_map(|i| &rows.blocks[linear(i)]).copied());
        self.next.clone_from(&self.offsets);
        self.linear.clear();
        self.linear.resize(self.offsets[blocks] as usize, (0, 0.0));
        for (c, i) in sources.clone().enumerate() {
            for k in linear(i) {
                let slot = &mut self.next[rows.blocks[k] as usize];
                self.linear[*slot as usize] = (c as u32, rows.weights[k]);
                *slot += 1;
            }
        }
        self.angular.clear();
        self.angular_offsets.clear();
        if rows.angular.is_empty() {
            return;
        }
        let levers = sources.clone().flat_map(|i| &rows.angular[angular(i)]);
        count(&mut self.angular_offsets, blocks, levers.map(|a| a.block));
        self.next.clone_from(&self.angular_offsets);
        self.angular.resize(self.angular_offsets[blocks] as usize, (0, [0.0; 3]));
        for (c, i) in sources.enumerate() {
            for a in &rows.angular[angular(i)] {
                let slot = &mut self.next[a.block as usize];
                self.angular[*slot as usize] = (c as u32, a.lever);
                *slot += 1;
            }
        }
    }

    #[inline(always)]
    fn linear(&self, b: usize) -> &[(u32, f64)] {
        &self.linear[self.offsets[b] as usize..self.offsets[b + 1] as usize]
    }

    #[inline(always)]
    fn angular(&self, b: usize) -> &[(u32, Vec3)] {
        if self.angular_offsets.is_empty() {
            return &[];
        }
        &self.angular[self.angular_offsets[b] as usize..self.angular_offsets[b + 1] as usize]
    }

    /// Whether any contact touches block `b`.
    pub fn touches(&self, b: usize) -> bool {
        !self.linear(b).is_empty() || !self.angular(b).is_empty()
    }

    /// Block `b` of `W^T f`, with the world impulse of every contact.
    #[inline]
    pub fn gather(&self, b: usize, f: &[Vec3]) -> Vec3 {
        let mut total = [0.0; 3];
        for (c, w) in self.linear(b) {
            total = add_scaled(total, *w, f[*c as usize]);
        }
        for (c, lever) in self.angular(b) {
            total = add(total, cross(*lever, f[*c as usize]));
        }
        total
    }

    /// The same in single precision.
    #[inline(always)]
    pub fn gather_rounded(&self, b: usize, f: &[Quad]) -> Quad {
        let mut total = Quad::default();
        for (c, w) in self.linear(b) {
            total = total.add_scaled(*w as f32, f[*c as usize]);
        }
        for (c, lever) in self.angular(b) {
            total = total + Quad::round(*lever, 1.0).cross(f[*c as usize]);
        }
        total
    }

    /// Adds `W^T E W` of block `b` to `sum`, `e(c)` being the symmetric world stiffness of contact `c`: the diagonal
    /// block of `C^T diag C`.
    pub fn add_diagonal(&self, b: usize, sum: &mut Mat3, e: impl Fn(usize) -> Option<Mat3>) {
        for (c, w) in self.linear(b) {
            if let Some(m) = e(*c as usize) {
                for i in 0..3 {
                    sum[i] = add_scaled(sum[i], w * w, m[i]);
                }
            }
        }
        for (c, lever) in self.angular(b) {
            let Some(m) = e(*c as usize) else { continue };
            // L = [lever]x: torque = L f, seen velocity = L^T omega, so the block is L E L^T.
            for axis in 0..3 {
                let mut unit = [0.0; 3];
                unit[axis] = 1.0;
                let column = cross(*lever, mat_vec(&m, cross(unit, *lever)));
                for i in 0..3 {
                    sum[i][axis] += column[i];
                }
            }
        }
    }
}

/// Offsets of groups from the group of each entry.
fn count(offsets: &mut Vec<u32>, groups: usize, entries: impl Iterator<Item = u32>) {
    offsets.clear();
    offsets.resize(groups + 1, 0);
    for b in entries {
        offsets[b as usize + 1] += 1;
    }
    for b in 0..groups {
        offsets[b + 1] += offsets[b];
    }
}
