//! The unilateral projection of few unknowns: a dual active-set method [Goldfarb83].

use super::unilateral_projection::{TRUSTED, Unilateral};
use super::zone_rows::ZoneRows;

/// Unknowns up to which it is used.
const UNKNOWNS: usize = 192;

/// Rows that fall short by less than this share of the largest demand are met.
const TOLERANCE: f64 = 1e-12;

/// A row of which the pushing ones leave no more than this share free depends on them.
const DEPENDENT: f64 = 1e-7;

/// Steps at most, per unknown.
const STEPS: usize = 20;

/// The smallest `y` with `A y >= demand`; `None` where the zone has too many unknowns, or too many steps were taken.
///
/// Rows that fall short join those that push one by one, those whose multiplier would turn negative leave: the multipliers
/// are those of a smallest `y` at every step, and its length only grows, so that no set comes twice. At most as many push
/// as there are unknowns, however many rows repeat each other. Rows with a guess above zero are looked at first. What no
/// set can meet ends at once. Cost: per step the square of the unknowns, and a pass over the rows.
pub(super) fn active_set(rows: &ZoneRows, demand: &[f64], guess: &[f64]) -> Option<Unilateral> {
    if 3 * rows.width > UNKNOWNS {
        return None;
    }
    let size = demand.iter().fold(0.0_f64, |m, c| m.max(*c));
    let mut set = PushingRows { y: vec![0.0; 3 * rows.width], ..PushingRows::default() };
    let guessed: Vec<usize> = (0..guess.len()).filter(|i| guess[*i] > 0.0).collect();
    let all: Vec<usize> = (0..rows.len()).collect();
    let (mut ignored, mut converged) = (vec![false; rows.len()], true);
    let mut steps = STEPS * set.y.len() + STEPS;
    for looked_at in [&guessed, &all] {
        while let Some(row) = worst(rows, demand, &set.y, looked_at, &ignored, TOLERANCE * size) {
            match set.meet(rows, demand, row, &mut steps) {
                Met::Yes => {}
                Met::Never(short) => {
                    ignored[row] = true;
                    converged &= short <= TRUSTED * size;
                    if !converged {
                        return Some(set.solution(rows, demand, false));
                    }
                }
                Met::OutOfSteps => return None,
            }
        }
    }
    Some(set.solution(rows, demand, converged))
}

/// The row that falls short most, by more than the tolerance.
fn worst(rows: &ZoneRows, demand: &[f64], y: &[f64], of: &[usize], ignored: &[bool], tolerance: f64) -> Option<usize> {
    let (mut worst, mut most) = (None, tolerance);
    for i in of.iter().copied().filter(|i| !ignored[*i]) {
        let short = demand[i] - product(rows, i, y);
        if short > most {
            (worst, most) = (Some(i), short);
        }
    }
    worst
}

#[inline]
fn product(rows: &ZoneRows, i: usize, y: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (column, entry) in rows.row(i) {
        sum += entry[0] * y[3 * column] + entry[1] * y[3 * column + 1] + entry[2] * y[3 * column + 2];
    }
    sum
}

/// Whether a row could be met.
enum Met {
    Yes,
    /// It depends on rows that push against it; by how much it falls short.
    Never(f64),
    OutOfSteps,
}

/// The rows that push, as `A_S^T = Q R` with orthonormal columns, and the smallest `y` that meets them.
#[derive(Default)]
struct PushingRows {
    set: Vec<usize>,
    multipliers: Vec<f64>,
    /// Columns of Q.
    basis: Vec<Vec<f64>>,
    /// Columns of R, from the top to the diagonal.
    factor: Vec<Vec<f64>>,
    y: Vec<f64>,
}

impl PushingRows {
    /// Makes a row push until it is met; what would pull leaves.
    fn meet(&mut self, rows: &ZoneRows, demand: &[f64], row: usize, steps: &mut usize) -> Met {
        let mut own = 0.0;
        loop {
            if *steps == 0 {
                return Met::OutOfSteps;
            }
            *steps -= 1;
            let (along, free) = self.split(rows, row);
            let square: f64 = free.iter().map(|x| x * x).sum();
            let change = self.solved(along.clone());
            let short = demand[row] - product(rows, row, &self.y);
            // How far until one of those that push would pull, and until the row is met.
            let mut first: Option<(f64, usize)> = None;
            for (k, slope) in change.iter().enumerate().filter(|(_, slope)| **slope > 0.0) {
                let way = self.multipliers[k].max(0.0) / slope;
                if first.is_none_or(|(least, _)| way < least) {
                    first = Some((way, k));
                }
            }
            let free_enough = square > DEPENDENT * DEPENDENT;
            let full = if free_enough { (short / square).max(0.0) } else { f64::INFINITY };
            let leaves = first.filter(|(way, _)| *way < full);
            let way = leaves.map_or(full, |(way, _)| way);
            if way == f64::INFINITY {
                return Met::Never(short);
            }
            own += way;
            self.multipliers.iter_mut().zip(&change).for_each(|(m, slope)| *m -= way * slope);
            if free_enough {
                self.y.iter_mut().zip(&free).for_each(|(y, f)| *y += way * f);
            }
            match leaves {
                Some((_, k)) => self.remove(k),
                None => {
                    self.append(row, own, along, free, square.sqrt());
                    return Met::Yes;
                }
            }
        }
    }

    /// A row as its part along the basis and what is orthogonal to that.
    fn split(&self, rows: &ZoneRows, row: usize) -> (Vec<f64>, Vec<f64>) {
        let mut free = vec![0.0; self.y.len()];
        for (column, entry) in rows.row(row) {
            free[3 * column..3 * column + 3].copy_from_slice(&entry);
        }
        let mut along: Vec<f64> = self.basis.iter().map(|q| product(rows, row, q)).collect();
        subtract(&self.basis, &along, &mut free);
        // Once more: rounding leaves a part along the basis.
        let again: Vec<f64> = self.basis.iter().map(|q| dot(q, &free)).collect();
        subtract(&self.basis, &again, &mut free);
        along.iter_mut().zip(&again).for_each(|(a, more)| *a += more);
        (along, free)
    }

    /// `R^-1 x`
    fn solved(&self, mut x: Vec<f64>) -> Vec<f64> {
        for k in (0..x.len()).rev() {
            x[k] /= self.factor[k][k];
            let value = x[k];
            for i in 0..k {
                x[i] -= self.factor[k][i] * value;
            }
        }
        x
    }

    fn append(&mut self, row: usize, multiplier: f64, mut along: Vec<f64>, mut free: Vec<f64>, length: f64) {
        free.iter_mut().for_each(|x| *x /= length);
        along.push(length);
        self.basis.push(free);
        self.factor.push(along);
        self.set.push(row);
        self.multipliers.push(multiplier);
    }

    /// Takes a row out; rotations make the factor a triangle again.
    fn remove(&mut self, k: usize) {
        self.set.remove(k);
        self.multipliers.remove(k);
        self.factor.remove(k);
        for j in k..self.factor.len() {
            let (a, b) = (self.factor[j][j], self.factor[j][j + 1]);
            let length = a.hypot(b);
            let (c, s) = if length > 0.0 { (a / length, b / length) } else { (1.0, 0.0) };
            for column in &mut self.factor[j..] {
                let (x, y) = (column[j], column[j + 1]);
                (column[j], column[j + 1]) = (c * x + s * y, c * y - s * x);
            }
            self.factor[j].truncate(j + 1);
            let (left, right) = self.basis.split_at_mut(j + 1);
            for (p, q) in left[j].iter_mut().zip(right[0].iter_mut()) {
                (*p, *q) = (c * *p + s * *q, c * *q - s * *p);
            }
        }
        self.basis.pop();
    }

    /// Multipliers and `y` from the rows alone: `R^T R lambda = demand`, refined once.
    fn solution(&self, rows: &ZoneRows, demand: &[f64], converged: bool) -> Unilateral {
        let mut multipliers = vec![0.0; rows.len()];
        let mut y = vec![[0.0; 3]; rows.width];
        for _ in 0..2 {
            let mut right: Vec<f64> = self.set.iter().map(|i| demand[*i] - rows.product(*i, &y)).collect();
            for k in 0..right.len() {
                let column = &self.factor[k];
                let known: f64 = (0..k).map(|i| column[i] * right[i]).sum();
                right[k] = (right[k] - known) / column[k];
            }
            let change = self.solved(right);
            self.set.iter().zip(&change).for_each(|(i, more)| multipliers[*i] += more);
            y = rows.transposed_product(&multipliers);
        }
        if multipliers.iter().any(|l| *l < 0.0) {
            multipliers.iter_mut().for_each(|l| *l = l.max(0.0));
            y = rows.transposed_product(&multipliers);
        }
        Unilateral { y, multipliers, converged }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sum = 0.0;
    for i in 0..a.len() {
        sum += a[i] * b[i];
    }
    sum
}

/// `x -= sum of c_k q_k`
fn subtract(basis: &[Vec<f64>], c: &[f64], x: &mut [f64]) {
    for (q, factor) in basis.iter().zip(c) {
        for i in 0..x.len() {
            x[i] -= factor * q[i];
        }
    }
}
