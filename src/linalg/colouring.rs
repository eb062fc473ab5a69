//! Colourings of items that share blocks, for sweeps that may run in parallel within a colour.

/// Colours tried before an item goes to the remainder.
const COLOURS_MAX: usize = 64;

/// Groups of items: within a group no two items share a block, except in the last group (the remainder), which holds
/// what found no colour (items on a hub such as a rigid body) and must be swept in order.
#[derive(Clone, Debug, Default)]
pub struct Colouring {
    /// Items, group by group; ascending within each.
    pub order: Vec<u32>,
    /// Start of each group in `order`; one more entry than groups. The last group is the remainder, possibly empty.
    pub offsets: Vec<usize>,
    /// Colours that each block has seen, and the colour of each item: capacity only.
    seen: Vec<u64>,
    colours: Vec<u8>,
}

impl Colouring {
    /// All of `count` items in the remainder.
    pub fn assign_uncoloured(&mut self, count: usize) {
        self.order.clear();
        self.order.extend(0..count as u32);
        self.offsets.clear();
        self.offsets.extend([0, count]);
    }

    /// Greedy colouring of `count` items in index order: each takes the first colour that none of its `blocks` has seen.
    /// Depends on the topology alone. Cost: one pass over the entries.
    pub fn assign<'a, I>(&mut self, count: usize, block_count: usize, blocks: impl Fn(usize) -> I)
    where
        I: Iterator<Item = u32> + Clone + 'a,
    {
        let Colouring { order, offsets, seen, colours } = self;
        seen.clear();
        seen.resize(block_count, 0);
        colours.clear();
        colours.resize(count, COLOURS_MAX as u8);
        let mut sizes = [0usize; COLOURS_MAX + 1];
        for (item, colour) in colours.iter_mut().enumerate() {
            let used = blocks(item).fold(0u64, |u, b| u | seen[b as usize]);
            if used != u64::MAX {
                let first = (!used).trailing_zeros();
                *colour = first as u8;
                for b in blocks(item) {
                    seen[b as usize] |= 1 << first;
                }
            }
            sizes[*colour as usize] += 1;
        }
        let groups = sizes[..COLOURS_MAX].iter().position(|s| *s == 0).unwrap_or(COLOURS_MAX);
        offsets.clear();
        let mut starts = [0usize; COLOURS_MAX + 1];
        let mut start = 0;
        for (colour, size) in sizes.iter().enumerate() {
            starts[colour] = start;
            if colour < groups || colour == COLOURS_MAX {
                offsets.push(start);
            }
            start += size;
        }
        offsets.push(start);
        order.clear();
        order.resize(count, 0);
        for (item, colour) in colours.iter().enumerate() {
            order[starts[*colour as usize]] = item as u32;
            starts[*colour as usize] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_items_of_a_colour_share_a_block_and_hubs_go_to_the_remainder() {
        // Edges of a grid, plus 200 items that all touch block 0.
        let width = 20u32;
        let mut items: Vec<[u32; 2]> = Vec::new();
        for y in 0..width {
            for x in 0..width - 1 {
                items.push([y * width + x, y * width + x + 1]);
                items.push([x * width + y, (x + 1) * width + y]);
            }
        }
        items.extend((0..200).map(|k| [0, k + 1]));
        let mut c = Colouring::default();
        c.assign_uncoloured(7);
        assert_eq!((c.order.len(), &c.offsets[..]), (7, &[0, 7][..]));
        c.assign(items.len(), (width * width) as usize, |i| items[i].iter().copied());
        let groups = c.offsets.len() - 1;
        for g in 0..groups - 1 {
            let mut seen = vec![false; (width * width) as usize];
            for item in &c.order[c.offsets[g]..c.offsets[g + 1]] {
                for b in items[*item as usize] {
                    assert!(!std::mem::replace(&mut seen[b as usize], true));
                }
            }
        }
        assert!(c.offsets[groups] - c.offsets[groups - 1] > 100, "the hub's items");
        let mut all = c.order.clone();
        all.sort_unstable();
        assert!(all.iter().enumerate().all(|(i, item)| i as u32 == *item));
    }
}
