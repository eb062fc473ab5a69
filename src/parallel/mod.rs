//! Drivers that map kernels over indices: serial, or on a private pool.
//!
//! Work is split by data in blocks of fixed size and sums run over blocks in index order, so every number of threads
//! gives the same bits. The only module that names rayon.

use rayon::prelude::*;
use std::ops::Range;

/// Items per block of [`Par::for_each_block`] and [`Par::sum`]. Part of the numbers: changing it changes sums.
pub const BLOCK: usize = 1024;

/// Where work runs. Copied freely; holds no state of its own.
#[derive(Clone, Copy)]
pub enum Par<'a> {
    /// On the calling thread; spawns nothing.
    Serial,
    /// On a private pool.
    Pool(&'a Pool),
}

/// A private thread pool, joined when dropped.
pub struct Pool {
    pool: Option<rayon::ThreadPool>,
    handles: std::sync::Arc<std::sync::Mutex<Vec<std::thread::JoinHandle<()>>>>,
}

impl Pool {
    /// A pool of `threads` workers (at least one). Errors: the operating system's message when a thread cannot start.
    pub fn new(threads: usize) -> Result<Pool, String> {
        let handles = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
        let kept = handles.clone();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.max(1))
            .spawn_handler(move |worker| {
                let handle = std::thread::Builder::new().spawn(|| worker.run())?;
                if let Ok(mut list) = kept.lock() {
                    list.push(handle);
                }
                Ok(())
            })
            .build()
            .map_err(|error| error.to_string())?;
        Ok(Pool { pool: Some(pool), handles })
    }

    /// Number of workers.
    pub fn threads(&self) -> usize {
        self.pool.as_ref().map_or(1, |pool| pool.current_num_threads())
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        drop(self.pool.take());
        if let Ok(mut list) = self.handles.lock() {
            for handle in list.drain(..) {
                // A worker that panicked has been reported by the task that panicked.
                let _ = handle.join();
            }
        }
    }
}

impl Par<'_> {
    fn pool(&self) -> Option<&rayon::ThreadPool> {
        match self {
            Par::Serial => None,
            Par::Pool(pool) => pool.pool.as_ref(),
        }
    }

    /// Runs `f` on a thread of the pool, where each of the calls below starts without a hand-over from outside: for
    /// stretches of many short ones. On the calling thread when serial.
    pub fn within<R: Send>(&self, f: impl FnOnce() -> R + Send) -> R {
        match self.pool() {
            Some(pool) => pool.install(f),
            None => f(),
        }
    }

    /// `out[i] = f(i)` for every index.
    pub fn map_into<T: Send>(&self, out: &mut [T], f: impl Fn(usize) -> T + Sync) {
        self.for_each_block(out, |start, block| {
            for (i, item) in block.iter_mut().enumerate() {
                *item = f(start + i);
            }
        });
    }

    /// The vector of `f(i)` for `i` in `0..count`.
    pub fn map_indexed<T: Send>(&self, count: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let mut out = Vec::new();
        self.map_indexed_into(&mut out, count, f);
        out
    }

    /// The same in the memory of `out`, whose items go.
    pub fn map_indexed_into<T: Send>(&self, out: &mut Vec<T>, count: usize, f: impl Fn(usize) -> T + Sync) {
        match self.pool() {
            Some(pool) if count > BLOCK => pool.install(|| {
                (0..count).into_par_iter().with_min_len(BLOCK).map(&f).collect_into_vec(out);
            }),
            _ => {
                out.clear();
                out.extend((0..count).map(f));
            }
        }
    }

    /// What `f(i)` gives for `i` in `0..count` where it gives something, in this order.
    pub fn filter_indexed<T: Send>(&self, count: usize, f: impl Fn(usize) -> Option<T> + Sync) -> Vec<T> {
        let mut found = Vec::new();
        self.extend_filtered(&mut found, count, f);
        found
    }

    /// Adds to `out` what `f(i)` gives for `i` in `0..count` where it gives something, in this order. Without a pool
    /// nothing else is gathered.
    pub fn extend_filtered<T: Send>(&self, out: &mut Vec<T>, count: usize, f: impl Fn(usize) -> Option<T> + Sync) {
        self.extend_by_ranges(out, count, |range, out| out.extend(range.filter_map(&f)));
    }

    /// Lets `f` add what it finds in ranges that make up `0..count`, in this order. Without a pool nothing else is
    /// gathered.
    pub fn extend_by_ranges<T: Send>(
        &self,
        out: &mut Vec<T>,
        count: usize,
        f: impl Fn(Range<usize>, &mut Vec<T>) + Sync,
    ) {
        match self.pool() {
            Some(pool) if count > BLOCK => {
                let blocks = (0..count.div_ceil(BLOCK)).into_par_iter().with_max_len(1);
                let found = blocks.map(|b| {
                    let mut list = Vec::new();
                    f(b * BLOCK..count.min((b + 1) * BLOCK), &mut list);
                    list
                });
                let mut lists: Vec<Vec<T>> = pool.install(|| found.collect());
                out.reserve(lists.iter().map(Vec::len).sum());
                lists.iter_mut().for_each(|list| out.append(list));
            }
            _ => f(0..count, out),
        }
    }

    /// Calls `f(start, block)` for disjoint blocks of [`BLOCK`] items of `data`.
    pub fn for_each_block<T: Send>(&self, data: &mut [T], f: impl Fn(usize, &mut [T]) + Sync) {
        match self.pool() {
            Some(pool) if data.len() > BLOCK => pool.install(|| {
                data.par_chunks_mut(BLOCK).enumerate().for_each(|(i, block)| f(i * BLOCK, block));
            }),
            _ => data.chunks_mut(BLOCK).enumerate().for_each(|(i, block)| f(i * BLOCK, block)),
        }
    }

    /// Calls `f(start, block)` for disjoint blocks of [`BLOCK`] items of `data`; returns the sum of what it returns, in
    /// the order of the blocks.
    pub fn update_and_sum<T: Send>(&self, data: &mut [T], f: impl Fn(usize, &mut [T]) -> f64 + Sync) -> f64 {
        match self.pool() {
            Some(pool) if data.len() > BLOCK => {
                let parts = data.par_chunks_mut(BLOCK).enumerate();
                let sums: Vec<f64> = pool.install(|| parts.map(|(i, block)| f(i * BLOCK, block)).collect());
                sums.into_iter().fold(0.0, |s, part| s + part)
            }
            _ => data.chunks_mut(BLOCK).enumerate().fold(0.0, |s, (i, block)| s + f(i * BLOCK, block)),
        }
    }

    /// Calls `f(start, block of a, block of b)` for disjoint blocks of `size` items of two slices of one length;
    /// returns the sum of what it returns, in the order of the blocks.
    pub fn update_pairs_and_sum<A: Send, B: Send>(
        &self,
        size: usize,
        a: &mut [A],
        b: &mut [B],
        f: impl Fn(usize, &mut [A], &mut [B]) -> f64 + Sync,
    ) -> f64 {
        match self.pool() {
            Some(pool) if a.len() > size => {
                let parts = a.par_chunks_mut(size).zip(b.par_chunks_mut(size)).enumerate();
                let sums: Vec<f64> = pool.install(|| parts.map(|(i, (a, b))| f(i * size, a, b)).collect());
                sums.into_iter().fold(0.0, |s, part| s + part)
            }
            _ => {
                let parts = a.chunks_mut(size).zip(b.chunks_mut(size)).enumerate();
                parts.fold(0.0, |s, (i, (a, b))| s + f(i * size, a, b))
            }
        }
    }

    /// Calls `f` for every item, items being tasks of unequal size (one body, one tree branch).
    pub fn for_each_task<T: Send>(&self, tasks: &mut [T], f: impl Fn(&mut T) + Sync) {
        match self.pool() {
            Some(pool) if tasks.len() > 1 => pool.install(|| tasks.par_iter_mut().with_max_len(1).for_each(&f)),
            _ => tasks.iter_mut().for_each(f),
        }
    }

    /// Calls `f` for every task of a list that is made on the way, and `take` for what it gives, in the order of the list.
    /// Without a pool nothing is gathered.
    pub fn fold_tasks<T: Send, R: Send>(
        &self,
        tasks: impl ExactSizeIterator<Item = T>,
        f: impl Fn(T) -> R + Sync,
        mut take: impl FnMut(R),
    ) {
        match self.pool() {
            Some(pool) if tasks.len() > 1 => {
                let tasks: Vec<T> = tasks.collect();
                let results: Vec<R> = pool.install(|| tasks.into_par_iter().with_max_len(1).map(&f).collect());
                results.into_iter().for_each(take);
            }
            _ => tasks.for_each(|task| take(f(task))),
        }
    }

    /// `sum f(i)` for `i` in `0..count`, summed within blocks of [`BLOCK`] and then over blocks in index order.
    pub fn sum(&self, count: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
        let blocks = count.div_ceil(BLOCK);
        let partial = |b: usize| (b * BLOCK..count.min((b + 1) * BLOCK)).fold(0.0, |s, i| s + f(i));
        match self.pool() {
            Some(pool) if blocks > 1 => {
                let partials: Vec<f64> = pool.install(|| (0..blocks).into_par_iter().map(partial).collect());
                partials.into_iter().fold(0.0, |s, p| s + p)
            }
            _ => (0..blocks).map(partial).fold(0.0, |s, p| s + p),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_have_the_same_bits_on_any_number_of_threads() {
        let f = |i: usize| 1.0 / (1.0 + i as f64);
        let serial = Par::Serial.sum(100_003, f);
        for threads in [1, 2, 5] {
            let pool = Pool::new(threads).expect("threads start");
            assert_eq!(serial.to_bits(), Par::Pool(&pool).sum(100_003, f).to_bits());
            let squares = Par::Pool(&pool).map_indexed(5000, |i| i * i);
            assert!(squares.iter().enumerate().all(|(i, s)| *s == i * i));
            let mut reused = squares.clone();
            Par::Pool(&pool).map_indexed_into(&mut reused, 4000, |i| i * i);
            assert_eq!(reused, squares[..4000]);
        }
    }

    #[test]
    fn folds_keep_the_order_of_their_tasks_on_any_number_of_threads() {
        let order = |par: Par| {
            let mut seen = Vec::new();
            par.fold_tasks((0..300).map(|i| 3 * i), |i| i + 1, |r| seen.push(r));
            seen
        };
        let wanted: Vec<usize> = (0..300).map(|i| 3 * i + 1).collect();
        assert_eq!(order(Par::Serial), wanted);
        for threads in [1, 2, 5] {
            let pool = Pool::new(threads).expect("threads start");
            assert_eq!(order(Par::Pool(&pool)), wanted);
        }
    }
}
