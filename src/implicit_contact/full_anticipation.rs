//! Full constraint anticipation [Otaduy09, §5.1, Eq. 8]: the dense matrix `B = C A^-1 C^T` by one linear solve per row,
//! then projected Gauss-Seidel on it. A baseline and an oracle: its memory and the cost of a pass are quadratic in the
//! rows, of which contacts without friction have one and others three.

use super::friction::{LocalMetric, local_step};
use super::packed_contacts::relative_velocity;
use super::residuals::{Iterate, MeasureBuffers, Task, Work, measure};
use super::stop_test::{Ending, Run, StopTest, Verdict};
use crate::linalg::{Envelope, EnvelopeCholesky, GradientBuffers, conjugate_gradient};
use crate::math::{Vec3, mat_vec, sub};

/// Relative residual of the linear solves, and their steps at most.
const LINEAR_SOLVE: (f64, u32) = (1e-13, 20_000);
/// Steps of conjugate gradients that a solve is taken to need: A is factored where that costs less than all of them.
const STEPS_EXPECTED: usize = 100;
/// Passes between two checks.
const CHECK_EVERY: u32 = 10;
/// Rows at most: their matrix takes 8 GiB.
const ROWS_MAX: usize = 1 << 15;

/// Runs from `at.p` until the tolerances are met or `iterations_max` passes; leaves the best iterate. `None` where there
/// are more than 32,768 rows.
pub(super) fn run(
    task: &Task,
    at: &mut Iterate,
    iterations_max: u32,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> Option<Run> {
    let rows = Rows::new(task);
    if rows.count() > ROWS_MAX {
        return None;
    }
    let mut inverse = Inverse::new(task, rows.count());
    let matrix = rows.matrix(task, &mut inverse, work);
    let metrics: Vec<LocalMetric> = (0..rows.contacts()).map(|c| rows.metric(&matrix, c)).collect();
    let mut now = at.clone();
    let mut multipliers = vec![0.0; rows.count()];
    for (c, p) in now.p.iter().enumerate() {
        multipliers[rows.of(c)].copy_from_slice(&p[..rows.of(c).len()]);
    }
    let mut test = StopTest::new();
    let cone = task.settings.friction_cone;
    for k in 1..=iterations_max {
        for (c, contact) in task.packed.contacts.iter().enumerate() {
            let mut w = contact.target;
            for (w, row) in w.iter_mut().zip(rows.of(c)) {
                *w += product(&matrix[row * rows.count()..(row + 1) * rows.count()], &multipliers);
            }
            now.p[c] = local_step(&metrics[c], cone, contact.friction, now.p[c], w);
            multipliers[rows.of(c)].copy_from_slice(&now.p[c][..rows.of(c).len()]);
        }
        work.contacts += (rows.contacts() * rows.contacts()) as u64;
        if k % CHECK_EVERY != 0 && k != iterations_max {
            continue;
        }
        respond(task, &mut now, &mut inverse, buffers, work);
        let residuals = measure(task, &now, buffers, work);
        match test.check(task, &now, &residuals, at, buffers, work) {
            Verdict::Converged(e) => return Some(Run { iterations: k, ending: Ending::Converged, error: Some(e) }),
            Verdict::Continue => {}
            Verdict::Overflowed => return Some(Run { iterations: k, ending: Ending::Stagnated, error: None }),
        }
    }
    Some(Run { iterations: iterations_max, ending: Ending::Exhausted, error: None })
}

/// Sums in blocks of four lanes: the passes are nothing else.
fn product(row: &[f64], multipliers: &[f64]) -> f64 {
    let (a, b) = (row.chunks_exact(4), multipliers.chunks_exact(4));
    let mut sum: f64 = a.remainder().iter().zip(b.remainder()).map(|(x, y)| x * y).sum();
    let mut lanes = [0.0; 4];
    for (a, b) in a.zip(b) {
        for k in 0..4 {
            lanes[k] += a[k] * b[k];
        }
    }
    for lane in lanes {
        sum += lane;
    }
    sum
}

/// `dv = A^-1 C^T p`
fn respond(task: &Task, now: &mut Iterate, inverse: &mut Inverse, buffers: &mut MeasureBuffers, work: &mut Work) {
    task.packed.impulses(&now.p, &mut buffers.impulses, task.par);
    let f = &buffers.impulses;
    task.par.map_into(&mut now.dv, |b| task.packed.incidence.gather(b, f));
    inverse.apply(&mut now.dv, work);
}

/// The rows of B: without friction the tangential multipliers stay zero and have none.
struct Rows {
    /// First row of each contact; one more entry than contacts.
    first: Vec<usize>,
}

impl Rows {
    fn new(task: &Task) -> Rows {
        let mut first = vec![0];
        let mut next = 0;
        for contact in &task.packed.contacts {
            next += if contact.friction > 0.0 { 3 } else { 1 };
            first.push(next);
        }
        Rows { first }
    }

    fn contacts(&self) -> usize {
        self.first.len() - 1
    }

    fn count(&self) -> usize {
        self.first[self.contacts()]
    }

    fn of(&self, contact: usize) -> std::ops::Range<usize> {
        self.first[contact]..self.first[contact + 1]
    }

    /// `B`, which is symmetric, row major.
    fn matrix(&self, task: &Task, inverse: &mut Inverse, work: &mut Work) -> Vec<f64> {
        let (packed, rows) = (task.packed, task.problem.rows);
        let mut matrix = vec![0.0; self.count() * self.count()];
        let mut response = vec![[0.0; 3]; task.problem.inverse_diagonal.len()];
        for (c, contact) in packed.contacts.iter().enumerate() {
            for (row, direction) in self.of(c).zip(rows.frames[contact.source as usize]) {
                response.fill([0.0; 3]);
                rows.scatter(contact.source as usize, direction, &mut response);
                inverse.apply(&mut response, work);
                for (other, contact) in packed.contacts.iter().enumerate() {
                    let w = sub(contact.in_frame(relative_velocity(contact, rows, &response)), contact.target);
                    for (column, w) in self.of(other).zip(w) {
                        matrix[row * self.count() + column] = w;
                    }
                }
            }
        }
        matrix
    }

    /// The block of a contact with itself.
    fn metric(&self, matrix: &[f64], contact: usize) -> LocalMetric {
        let of = self.of(contact);
        let entry = |i: usize, j: usize| {
            let at = |i: usize, j: usize| matrix[(of.start + i) * self.count() + of.start + j];
            if i.max(j) < of.len() { 0.5 * (at(i, j) + at(j, i)) } else { 0.0 }
        };
        LocalMetric::new([entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)])
    }
}

/// `A^-1`: factored, or by conjugate gradients.
struct Inverse<'a> {
    task: &'a Task<'a>,
    factor: Option<(Envelope, EnvelopeCholesky)>,
    right: Vec<Vec3>,
    buffers: GradientBuffers,
}

impl<'a> Inverse<'a> {
    /// For that many solves.
    fn new(task: &'a Task<'a>, solves: usize) -> Inverse<'a> {
        let matrix = task.problem.matrix;
        let envelope = Envelope::new(matrix);
        let pays = envelope.work() <= solves * STEPS_EXPECTED * matrix.values.len();
        let fixed: Vec<bool> = task.problem.inverse_diagonal.iter().map(|m| *m == [[0.0; 3]; 3]).collect();
        let factor = if pays { EnvelopeCholesky::new(matrix, &envelope, &fixed) } else { None };
        let factor = factor.map(|factor| (envelope, factor));
        Inverse { task, factor, right: Vec::new(), buffers: GradientBuffers::default() }
    }

    /// `x := A^-1 x`, zero where nothing moves.
    fn apply(&mut self, x: &mut [Vec3], work: &mut Work) {
        let (matrix, diagonal, par) = (self.task.problem.matrix, self.task.problem.inverse_diagonal, self.task.par);
        if let Some((envelope, factor)) = &self.factor {
            x.iter_mut().zip(diagonal).filter(|(_, m)| **m == [[0.0; 3]; 3]).for_each(|(x, _)| *x = [0.0; 3]);
            factor.solve(envelope, x, &mut self.right);
            work.blocks += 2 * envelope.len() as u64;
            return;
        }
        self.right.clear();
        self.right.extend_from_slice(x);
        let apply = |d: &[Vec3], out: &mut [Vec3]| matrix.product(d, out, par);
        let precondition = |r: &[Vec3], z: &mut [Vec3]| par.map_into(z, |i| mat_vec(&diagonal[i], r[i]));
        x.fill([0.0; 3]);
        let (steps, _) =
            conjugate_gradient(apply, precondition, &self.right, x, true, LINEAR_SOLVE, &mut self.buffers, par);
        work.blocks += u64::from(steps) * matrix.values.len() as u64;
    }
}
