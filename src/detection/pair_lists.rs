//! Lists of pairs brought into one stable order.

use crate::math::simd::Eight;
use crate::parallel::Par;

/// Pairs found by the tasks of a traversal.
pub(super) type PairLists = Vec<PairBuffer>;

/// A list that takes up to eight pairs at once.
#[derive(Default)]
pub(super) struct PairBuffer {
    pairs: Vec<[u32; 2]>,
    used: usize,
    /// Of these, screened already.
    kept: usize,
}

/// Pairs that are many: as much as the nearest of the processor's caches holds.
const MANY: usize = 4096;

impl PairBuffer {
    /// Appends `[first, seconds[i]]` for the lanes of the mask; see [`Eight::pairs`].
    #[inline(always)]
    pub fn push<E: Eight, const ASCENDING: bool>(&mut self, eight: E, first: u32, seconds: &[u32; 8], mask: u32) {
        if self.pairs.len() < self.used + 8 {
            self.grow();
        }
        if let Some(out) = self.pairs[self.used..].first_chunk_mut() {
            self.used += eight.pairs::<ASCENDING>(first, seconds, mask, out);
        }
    }

    /// Appends a pair.
    pub fn push_one(&mut self, pair: [u32; 2]) {
        if self.pairs.len() == self.used {
            self.grow();
        }
        self.pairs[self.used] = pair;
        self.used += 1;
    }

    /// Forgets all pairs.
    pub fn clear(&mut self) {
        (self.used, self.kept) = (0, 0);
    }

    #[cold]
    fn grow(&mut self) {
        self.pairs.resize((2 * self.pairs.len()).max(512), [0; 2]);
    }

    /// Whether there are so many that they should be screened while they are in the processor's cache.
    pub fn is_many(&self) -> bool {
        self.used >= MANY
    }

    /// Keeps, of the pairs added since the last time, those that `screen` moves to the front, as many as it says.
    pub fn screen(&mut self, screen: impl FnOnce(&mut [[u32; 2]]) -> usize) {
        self.kept += screen(&mut self.pairs[self.kept..self.used]);
        self.used = self.kept;
    }

    /// Keeps the memory of the pairs alone.
    pub fn shrink(&mut self) {
        self.pairs.truncate(self.used);
        self.pairs.shrink_to_fit();
    }

    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs[..self.used]
    }
}

/// Joins the lists into `out`, sorted by first and then second number; first numbers are below `range`.
///
/// Cost: linear where no first number has many partners.
pub(super) fn merge(lists: PairLists, range: usize, out: &mut Vec<[u32; 2]>, par: Par) {
    let total: usize = lists.iter().map(|list| list.used).sum();
    let mut ends = vec![0_u32; range + 1];
    for pair in lists.iter().flat_map(PairBuffer::pairs) {
        ends[pair[0] as usize + 1] += 1;
    }
    for i in 0..range {
        ends[i + 1] += ends[i];
    }
    out.resize(total, [0; 2]);
    // `ends[i]` runs from the start of number i to its end while the pairs are put down.
    for pair in lists.iter().flat_map(PairBuffer::pairs) {
        let place = &mut ends[pair[0] as usize];
        out[*place as usize] = *pair;
        *place += 1;
    }
    let mut groups: Vec<&mut [[u32; 2]]> = Vec::new();
    let mut rest = out.as_mut_slice();
    let mut start = 0;
    // Groups of whole numbers, large enough to be worth a task.
    for end in &ends[..range] {
        if *end - start >= 4096 {
            let (group, after) = rest.split_at_mut((*end - start) as usize);
            groups.push(group);
            (rest, start) = (after, *end);
        }
    }
    groups.push(rest);
    par.for_each_task(&mut groups, |group| {
        group.chunk_by_mut(|a, b| a[0] == b[0]).for_each(sort_by_second);
    });
}

/// Adds sorted pairs to sorted pairs, each once; leaves what was new in `more`. Cost: linear, and little for few.
pub(super) fn unite(all: &mut Vec<[u32; 2]>, more: &mut Vec<[u32; 2]>) {
    let mut first = 0;
    more.retain(|pair| {
        first += all[first..].partition_point(|p| p < pair);
        all.get(first) != Some(pair)
    });
    let (mut old, mut place) = (all.len(), all.len() + more.len());
    all.resize(place, [0; 2]);
    // From the back, so that each pair is moved once.
    for pair in more.iter().rev() {
        let before = all[..old].partition_point(|p| p < pair);
        all.copy_within(before..old, place - (old - before));
        place -= old - before + 1;
        all[place] = *pair;
        old = before;
    }
}

/// Sorts pairs with one first number by their second one.
#[inline(always)]
fn sort_by_second(run: &mut [[u32; 2]]) {
    if run.len() > 20 {
        run.sort_unstable_by_key(|pair| pair[1]);
        return;
    }
    // Most runs are a few pairs long: a call would cost more than the work.
    for i in 1..run.len() {
        let pair = run[i];
        let mut place = i;
        while place > 0 && run[place - 1][1] > pair[1] {
            run[place] = run[place - 1];
            place -= 1;
        }
        run[place] = pair;
    }
}
