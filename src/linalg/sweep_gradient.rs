//! Conjugate gradients in single precision, preconditioned by a symmetric Gauss-Seidel sweep over coloured rows. In the
//! form of [Eisenstat81] the two half sweeps are the product as well, so a step costs what it does with the diagonal alone,
//! and half as many are needed.
//!
//! With `A = L + D + U` the system is `(D+L)^-1 A (D+U)^-1`, preconditioned by D. Rows of a colour share no block and are
//! swept in any order: the same bits on any number of threads.

use super::BlockMatrix;
use super::single_precision::unit_of;
use crate::math::simd::{Kernel, Quad, Width, packed_row, run_wide};
use crate::math::{Mat3, Vec3};
use crate::parallel::Par;

/// Rows that a thread takes at a time.
const ROWS: usize = 512;

/// Colours that are shared; rows that find none of them have one each.
const COLOURS_SHARED: usize = 64;

/// What a step keeps of a row.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    change: Quad,
    /// `r = (D+L)^-1 (b - A x)` and `D r`.
    residual: Quad,
    weighted: Quad,
    /// `p` and `D p`.
    direction: Quad,
    weighted_direction: Quad,
    /// `U t`, and then `D q`.
    image: Quad,
}

/// The matrix, rounded and ordered by colour, and the vectors; capacity is kept.
#[derive(Clone, Debug, Default)]
pub struct SweepGradient {
    rows: ColouredRows,
    /// Columns of the inverse diagonal blocks, by position; zero leaves a row out.
    inverse: Vec<[Quad; 3]>,
    nodes: Vec<Node>,
    /// `t = (D+U)^-1 D p`: the direction in the unknowns of A.
    back: Vec<Quad>,
    /// `(D+L)^-1 (D p - D t)`
    forth: Vec<Quad>,
}

impl SweepGradient {
    /// Takes a symmetric matrix without the rows and columns that are `fixed`.
    ///
    /// Cost: a pass over the blocks; where they are elsewhere than last time the rows are coloured anew.
    pub fn assign(&mut self, matrix: &BlockMatrix, fixed: impl Fn(usize) -> bool) {
        self.rows.assign(matrix, fixed);
        let n = matrix.rows();
        self.inverse.resize(n, [Quad::default(); 3]);
        self.nodes.resize(n, Node::default());
        self.back.resize(n, Quad::default());
        self.forth.resize(n, Quad::default());
    }

    /// The mass, a power of two, that entries are relative to.
    pub fn unit(&self) -> f64 {
        self.rows.unit
    }

    /// Takes the inverse diagonal blocks; zero leaves a row out.
    pub fn set_inverse(&mut self, inverse: impl Fn(usize) -> Mat3 + Sync, par: Par) {
        let (order, mass) = (&self.rows.order, self.rows.unit);
        par.map_into(&mut self.inverse, |i| {
            let m = inverse(order[i] as usize);
            [0, 1, 2].map(|c| Quad::round([m[0][c], m[1][c], m[2][c]], mass))
        });
    }

    /// Forgets the last direction.
    pub fn forget(&mut self) {
        self.nodes.fill(Node::default());
    }

    /// Begins from no change and a residual, in units of `unit`; returns its square in the norm of the preconditioner.
    pub fn begin(&mut self, residual: impl Fn(usize) -> Vec3 + Sync, unit: f64, par: Par) -> f64 {
        let (rows, inverse) = (&self.rows, &self.inverse);
        let mut sum = 0.0;
        for colour in 0..rows.colours() {
            let range = rows.range(colour);
            let (done, rest) = self.forth.split_at_mut(range.start);
            let (own, nodes) = (&mut rest[..range.len()], &mut self.nodes[range.clone()]);
            sum += par.update_pairs_and_sum(ROWS, nodes, own, |at, nodes, solved| {
                let first = range.start + at;
                run_wide(Begin { rows, inverse, done, nodes, solved, first, residual: &residual, scale: 1.0 / unit })
            });
        }
        sum
    }

    /// The next direction, `beta` times the last one added, and its image; returns the curvature along it.
    pub fn turn(&mut self, beta: f32, par: Par) -> f64 {
        let (rows, inverse) = (&self.rows, &self.inverse);
        for colour in (0..rows.colours()).rev() {
            let range = rows.range(colour);
            let (rest, done) = self.back.split_at_mut(range.end);
            let (own, nodes) = (&mut rest[range.start..], &mut self.nodes[range.clone()]);
            par.update_pairs_and_sum(ROWS, nodes, own, |at, nodes, solved| {
                run_wide(Back { rows, inverse, done, nodes, solved, first: range.start + at, beta });
                0.0
            });
        }
        let mut sum = 0.0;
        for colour in 0..rows.colours() {
            let range = rows.range(colour);
            let (done, rest) = self.forth.split_at_mut(range.start);
            let (own, nodes) = (&mut rest[..range.len()], &mut self.nodes[range.clone()]);
            sum += par.update_pairs_and_sum(ROWS, nodes, own, |at, nodes, solved| {
                run_wide(Forth { rows, inverse, done, nodes, solved, first: range.start + at })
            });
        }
        sum
    }

    /// A step of `alpha` along the direction; returns the squared residual in the norm of the preconditioner.
    pub fn descend(&mut self, alpha: f32, par: Par) -> f64 {
        let (back, forth) = (&self.back, &self.forth);
        par.update_and_sum(&mut self.nodes, |start, nodes| {
            run_wide(Descend { nodes, back: &back[start..], forth: &forth[start..], alpha })
        })
    }

    /// Change of a row since the beginning, in units of impulse over mass.
    #[inline(always)]
    pub fn change(&self, row: usize) -> Quad {
        self.nodes[self.rows.position[row] as usize].change
    }
}

/// The rows of a matrix by colour, rounded. Blocks of a row: those after it, then those before it.
#[derive(Clone, Debug, Default)]
struct ColouredRows {
    /// Row at each position, and the other way round.
    order: Vec<u32>,
    position: Vec<u32>,
    /// First position of each colour; one more than colours.
    starts: Vec<usize>,
    /// Start of the blocks after and of those before each position; one more than positions.
    offsets: Vec<[u32; 2]>,
    /// Position of a block's column; of those after it less the end of the colour.
    columns: Vec<u32>,
    /// Place of each block in the matrix.
    places: Vec<u32>,
    /// Blocks by columns.
    values: Vec<[f32; 9]>,
    unit: f64,
    width: Width,
    /// What the order was made for.
    row_offsets: Vec<usize>,
    block_columns: Vec<u32>,
    fixed: Vec<bool>,
}

impl ColouredRows {
    fn assign(&mut self, matrix: &BlockMatrix, fixed: impl Fn(usize) -> bool) {
        let n = matrix.rows();
        let same = self.row_offsets == matrix.row_offsets
            && self.block_columns == matrix.columns
            && (0..n).all(|i| self.fixed[i] == fixed(i));
        if !same {
            self.row_offsets.clone_from(&matrix.row_offsets);
            self.block_columns.clone_from(&matrix.columns);
            self.fixed.clear();
            self.fixed.extend((0..n).map(fixed));
            self.order_rows();
            self.split_rows();
        }
        self.unit = unit_of(matrix);
        self.width = Width::detect();
        self.values.resize(self.places.len(), [0.0; 9]);
        let factor = 1.0 / self.unit;
        run_wide(RoundBlocks { values: &mut self.values, places: &self.places, blocks: &matrix.values, factor });
    }

    /// Columns of the blocks beside the diagonal of row `i` with their places, without those left out.
    fn beside(&self, i: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let range = if self.fixed[i] { 0..0 } else { self.row_offsets[i]..self.row_offsets[i + 1] };
        range.map(|k| (k, self.block_columns[k] as usize)).filter(move |(_, j)| *j != i && !self.fixed[*j])
    }

    /// Greedy colours in index order, and the rows by colour.
    fn order_rows(&mut self) {
        let n = self.fixed.len();
        let mut colours = vec![u32::MAX; n];
        let mut sizes = vec![0usize; COLOURS_SHARED];
        for i in 0..n {
            let taken = self.beside(i).map(|(_, j)| colours[j]).filter(|c| *c < COLOURS_SHARED as u32);
            let free = (!taken.fold(0u64, |used, c| used | 1 << c)).trailing_zeros();
            if (free as usize) < COLOURS_SHARED {
                colours[i] = free;
            } else {
                colours[i] = sizes.len() as u32;
                sizes.push(0);
            }
            sizes[colours[i] as usize] += 1;
        }
        self.starts.clear();
        self.starts.push(0);
        let mut next = Vec::with_capacity(sizes.len());
        let mut sum = 0;
        for size in &sizes {
            next.push(sum);
            sum += size;
            if *size > 0 {
                self.starts.push(sum);
            }
        }
        self.order.resize(n, 0);
        self.position.resize(n, 0);
        for (i, colour) in colours.iter().enumerate() {
            let place = &mut next[*colour as usize];
            self.order[*place] = i as u32;
            self.position[i] = *place as u32;
            *place += 1;
        }
    }

    /// Splits the blocks of each row into those after it and those before it.
    fn split_rows(&mut self) {
        let (mut offsets, mut columns, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for colour in 0..self.colours() {
            let end = self.range(colour).end;
            for at in self.range(colour) {
                let row = self.order[at] as usize;
                let mut offset = [columns.len() as u32; 2];
                for (k, j) in self.beside(row).filter(|(_, j)| self.position[*j] as usize >= end) {
                    columns.push(self.position[j] - end as u32);
                    places.push(k as u32);
                }
                offset[1] = columns.len() as u32;
                for (k, j) in self.beside(row).filter(|(_, j)| (self.position[*j] as usize) < at) {
                    columns.push(self.position[j]);
                    places.push(k as u32);
                }
                offsets.push(offset);
            }
        }
        offsets.push([columns.len() as u32; 2]);
        (self.offsets, self.columns, self.places) = (offsets, columns, places);
    }

    fn colours(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    fn range(&self, colour: usize) -> std::ops::Range<usize> {
        self.starts[colour]..self.starts[colour + 1]
    }

    #[inline(always)]
    fn product(&self, range: std::ops::Range<u32>, x: &[Quad]) -> Quad {
        let range = range.start as usize..range.end as usize;
        packed_row(self.width, &self.values[range.clone()], &self.columns[range], x).padded()
    }

    /// The blocks after a position times what is behind the end of its colour.
    #[inline(always)]
    fn after(&self, at: usize, x: &[Quad]) -> Quad {
        let [after, before] = self.offsets[at];
        self.product(after..before, x)
    }

    /// The blocks before a position times what is in front of its colour.
    #[inline(always)]
    fn before(&self, at: usize, x: &[Quad]) -> Quad {
        self.product(self.offsets[at][1]..self.offsets[at + 1][0], x)
    }
}

struct RoundBlocks<'a> {
    values: &'a mut [[f32; 9]],
    places: &'a [u32],
    blocks: &'a [Mat3],
    factor: f64,
}

impl Kernel for RoundBlocks<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (out, place) in self.values.iter_mut().zip(self.places) {
            let m = &self.blocks[*place as usize];
            for (i, entry) in out.iter_mut().enumerate() {
                *entry = (self.factor * m[i % 3][i / 3]) as f32;
            }
        }
    }
}

struct Begin<'a, F> {
    rows: &'a ColouredRows,
    inverse: &'a [[Quad; 3]],
    done: &'a [Quad],
    nodes: &'a mut [Node],
    solved: &'a mut [Quad],
    first: usize,
    residual: &'a F,
    scale: f64,
}

impl<F: Fn(usize) -> Vec3> Kernel for Begin<'_, F> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for (i, (node, solved)) in self.nodes.iter_mut().zip(self.solved).enumerate() {
            let at = self.first + i;
            let residual = Quad::round((self.residual)(self.rows.order[at] as usize), self.scale);
            let weighted = residual - self.rows.before(at, self.done);
            *solved = Quad::combine(&self.inverse[at], weighted);
            *node = Node { change: Quad::default(), residual: *solved, weighted, ..*node };
            sum = sum + *solved * weighted;
        }
        sum.total()
    }
}

struct Back<'a> {
    rows: &'a ColouredRows,
    inverse: &'a [[Quad; 3]],
    done: &'a [Quad],
    nodes: &'a mut [Node],
    solved: &'a mut [Quad],
    first: usize,
    beta: f32,
}

impl Kernel for Back<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (i, (node, solved)) in self.nodes.iter_mut().zip(self.solved).enumerate() {
            let at = self.first + i;
            node.direction = node.residual.add_scaled(self.beta, node.direction);
            node.weighted_direction = node.weighted.add_scaled(self.beta, node.weighted_direction);
            node.image = self.rows.after(at, self.done);
            *solved = node.direction - Quad::combine(&self.inverse[at], node.image);
        }
    }
}

struct Forth<'a> {
    rows: &'a ColouredRows,
    inverse: &'a [[Quad; 3]],
    done: &'a [Quad],
    nodes: &'a mut [Node],
    solved: &'a mut [Quad],
    first: usize,
}

impl Kernel for Forth<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for (i, (node, solved)) in self.nodes.iter_mut().zip(self.solved).enumerate() {
            let at = self.first + i;
            let right = node.image - self.rows.before(at, self.done);
            *solved = Quad::combine(&self.inverse[at], right);
            node.image = (node.weighted_direction - node.image) + right;
            sum = sum + node.direction * node.image;
        }
        sum.total()
    }
}

struct Descend<'a> {
    nodes: &'a mut [Node],
    back: &'a [Quad],
    forth: &'a [Quad],
    alpha: f32,
}

impl Kernel for Descend<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for ((node, back), forth) in self.nodes.iter_mut().zip(self.back).zip(self.forth) {
            node.change = node.change.add_scaled(self.alpha, *back);
            node.residual = node.residual.add_scaled(-self.alpha, *back + *forth);
            node.weighted = node.weighted.add_scaled(-self.alpha, node.image);
            sum = sum + node.residual * node.weighted;
        }
        sum.total()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{ZERO_MATRIX, inverse, mat_add, mat_scale, norm, sub};

    /// Springs along a ring, from one row to 90 others, and between all of 70: more colours than may be shared.
    fn wheel(n: u32) -> BlockMatrix {
        let mut pairs: Vec<(u32, u32)> = (0..n).map(|i| (i, (i + 1) % n)).collect();
        pairs.extend((0..90).map(|k| (5, 20 + 7 * k)));
        pairs.extend((0..70u32).flat_map(|i| (0..i).map(move |j| (900 + i, 900 + j))));
        let places = pairs.iter().flat_map(|(i, j)| [(*i, *j), (*j, *i)]).collect();
        let mut a = BlockMatrix::from_places(n as usize, places);
        let mut put = |row, column, m: &Mat3, s: f64| {
            let place = a.place(row, column);
            a.values[place] = mat_add(&a.values[place], &mat_scale(s, m));
        };
        for i in 0..n {
            put(i, i, &[[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 0.5]], 0.1);
        }
        for (k, (i, j)) in pairs.iter().enumerate() {
            let spring = [[3.0, 0.4, 0.0], [0.4, 2.0, 0.1], [0.0, 0.1, 0.5 + (k % 5) as f64]];
            for (row, column, s) in [(*i, *i, 1.0), (*j, *j, 1.0), (*i, *j, -1.0), (*j, *i, -1.0)] {
                put(row, column, &spring, s);
            }
        }
        a
    }

    #[test]
    fn solves_without_the_fixed_rows_and_with_the_same_bits_on_threads() {
        let a = wheel(3000);
        let is_fixed = |i: usize| i.is_multiple_of(41);
        let b: Vec<Vec3> = (0..3000).map(|i| [f64::from(i % 7) - 3.0, 1.0, f64::from(i % 11)]).collect();
        let run = |par: Par| {
            let mut sweep = SweepGradient::default();
            sweep.assign(&a, is_fixed);
            sweep.assign(&a, is_fixed);
            let diagonal = |i: usize| if is_fixed(i) { None } else { inverse(a.diagonal_block(i)) };
            sweep.set_inverse(|i| diagonal(i).unwrap_or(ZERO_MATRIX), par);
            let (mut rho, mut beta, mut steps) = (sweep.begin(|i| b[i], 1.0, par), 0.0, 0);
            let first = rho;
            while rho > 1e-11 * first && steps < 300 {
                let curvature = sweep.turn(beta as f32, par);
                let next = sweep.descend((rho / curvature) as f32, par);
                (beta, rho, steps) = (next / rho, next, steps + 1);
            }
            ((0..3000).map(|i| sweep.change(i).widen(1.0 / sweep.unit())).collect::<Vec<Vec3>>(), steps)
        };
        let (x, steps) = run(Par::Serial);
        let mut worst = 0.0f64;
        for i in 0..3000 {
            if is_fixed(i) {
                assert_eq!(x[i], [0.0; 3]);
            } else {
                worst = worst.max(norm(sub(b[i], a.row_product(i, &x))));
            }
        }
        assert!(worst < 5e-3 && steps < 200, "residual {worst} of 10 after {steps} steps");
        let pool = crate::parallel::Pool::new(3).unwrap();
        assert!(run(Par::Pool(&pool)) == (x, steps));
    }
}
