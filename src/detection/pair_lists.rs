//! Lists of pairs brought into one stable order.

use crate::parallel::Par;

/// Pairs found by the tasks of a traversal.
pub(super) type PairLists = Vec<Vec<[u32; 2]>>;

/// Joins the lists into `out`, sorted by first and then second number; first numbers are below `range`.
///
/// Cost: linear where no first number has many partners.
pub(super) fn merge(lists: PairLists, range: usize, out: &mut Vec<[u32; 2]>, par: Par) {
    let total: usize = lists.iter().map(Vec::len).sum();
    let mut ends = vec![0_u32; range + 1];
    for pair in lists.iter().flatten() {
        ends[pair[0] as usize + 1] += 1;
    }
    for i in 0..range {
        ends[i + 1] += ends[i];
    }
    out.clear();
    out.resize(total, [0; 2]);
    // `ends[i]` runs from the start of number i to its end while the pairs are put down.
    for pair in lists.iter().flatten() {
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
        for run in group.chunk_by_mut(|a, b| a[0] == b[0]) {
            run.sort_unstable_by_key(|pair| pair[1]);
        }
    });
}
