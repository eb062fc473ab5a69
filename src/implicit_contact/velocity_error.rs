//! An estimate of the velocity error, which residuals do not bound on soft metrics.

use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work};
use crate::linalg::{SinglePrecision, power_of_two};
use crate::math::simd::{Kernel, Quad, run_wide};
use crate::math::{dot, sub};
use crate::parallel::BLOCK;

/// Conjugate gradient steps of the estimate at most.
const STEPS: usize = 24;

/// Weight of the contacts' energy in the estimate: violations act together, and a contact alone sees only the diagonal
/// of A. Chosen so that estimates of runs that end on violations are not below the true error.
const VIOLATION_WEIGHT: f64 = 10.0;

/// An error so many times what is asked for need not be known better.
const ENOUGH: f64 = 1.5;

/// Estimated `|dv - dv_exact|_A / |dv_exact|_A` of the iterate last measured; a lower bound where that is well above
/// `wanted`.
///
/// With `r = C^T p - A dv` the gap between the primal value at `dv` and the dual value at `p` is
/// `p · (C dv + target) + |r|^2 / 2` in the norm of `A^-1`, and half the squared error is at most the gap (frictionless,
/// feasible `dv`). The first term is replaced by the energy of the natural map, which also counts violations. The
/// second is summed by preconditioned conjugate gradients on `A e = r`, whose partial sums grow towards
/// `|r|^2` from below, plus a geometric tail; single precision is enough for a sum of squares. The residual in the norm
/// of the *diagonal*, the usual stop test, misses soft modes: it underestimates by up to the square root of the
/// condition number.
pub(super) fn velocity_error(
    task: &Task,
    at: &Iterate,
    residuals: &Residuals,
    wanted: f64,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> f64 {
    let MeasureBuffers { product, contact, error: system, .. } = buffers;
    let dv = &at.dv;
    let blocks = dv.len();
    let energy = task.par.sum(blocks, |b| dot(dv[b], product[b]));
    let scale = energy.max(task.impulse_floor * task.impulse_floor);
    let violation = VIOLATION_WEIGHT * residuals.contact_energy;
    let enough = (ENOUGH * wanted).powi(2) * scale - violation;
    let largest = (0..blocks).fold(0.0f64, |m, b| {
        let r = sub(contact[b], product[b]);
        m.max(r[0].abs()).max(r[1].abs()).max(r[2].abs())
    });
    let (mass, unit) = (task.single.unit(), power_of_two(largest));
    task.par.map_indexed_into(&mut system.inverse, blocks, |b| {
        let a = &task.problem.inverse_diagonal[b];
        [0, 1, 2].map(|c| Quad::round([a[0][c], a[1][c], a[2][c]], mass))
    });
    task.par.map_indexed_into(&mut system.residual, blocks, |b| Quad::round(sub(contact[b], product[b]), 1.0 / unit));
    for buffer in [&mut system.preconditioned, &mut system.direction, &mut system.image] {
        buffer.clear();
        buffer.resize(blocks, Quad::default());
    }
    // The sum is of squares of impulses over masses.
    let (terms, steps) = system.terms(task, enough * mass / (unit * unit));
    work.blocks += steps as u64 * task.problem.matrix.values.len() as u64;
    let total: f64 = terms[..steps].iter().sum();
    let tail = geometric_tail(&terms[..steps]);
    let error = (((total + tail) * (unit * unit / mass) + violation) / scale).sqrt();
    if error.is_finite() { error } else { f64::INFINITY }
}

/// Conjugate gradients on `A e = r`, for the squared error that each step takes away; capacity is kept.
#[derive(Default)]
pub(super) struct ErrorSystem {
    inverse: Vec<[Quad; 3]>,
    residual: Vec<Quad>,
    preconditioned: Vec<Quad>,
    direction: Vec<Quad>,
    image: Vec<Quad>,
}

impl ErrorSystem {
    /// The terms, and how many there are; ends early once their sum is above `enough` or hardly grows.
    fn terms(&mut self, task: &Task, enough: f64) -> ([f64; STEPS], usize) {
        let mut terms = [0.0; STEPS];
        let (mut total, mut beta) = (0.0, 0.0);
        let mut rho = self.descend(task, 0.0);
        for step in 0..STEPS {
            if rho <= 0.0 {
                return (terms, step);
            }
            let curvature = self.advance(task, beta);
            if curvature.is_nan() || curvature <= 0.0 {
                return (terms, step);
            }
            let alpha = rho / curvature;
            terms[step] = alpha * rho;
            total += terms[step];
            let little = step >= 3 && terms[step] + terms[step - 1] < 0.02 * total;
            if little || total > enough {
                return (terms, step + 1);
            }
            let next = self.descend(task, alpha);
            beta = next / rho;
            rho = next;
        }
        (terms, STEPS)
    }

    /// Next direction and its image; returns the curvature.
    fn advance(&mut self, task: &Task, beta: f64) -> f64 {
        let preconditioned = &self.preconditioned[..];
        task.par.for_each_block(&mut self.direction, |start, d| {
            run_wide(Turn { d, z: &preconditioned[start..], beta: beta as f32 });
        });
        let (matrix, d) = (task.single, &self.direction[..]);
        let mut total = 0.0;
        task.par.fold_tasks(
            self.image.chunks_mut(BLOCK).enumerate(),
            |(i, out)| run_wide(Image { matrix, d, start: i * BLOCK, out }),
            |sum| total += sum,
        );
        total
    }

    /// Takes `alpha` images off the residual; returns its square in the norm of the inverse diagonal.
    fn descend(&mut self, task: &Task, alpha: f64) -> f64 {
        let (inverse, image) = (&self.inverse[..], &self.image[..]);
        let parts = self.residual.chunks_mut(BLOCK).zip(self.preconditioned.chunks_mut(BLOCK)).enumerate();
        let block = |(i, (r, z)): (usize, (&mut [Quad], &mut [Quad]))| {
            let s = i * BLOCK;
            run_wide(&mut Descend { r, z, inverse: &inverse[s..], image: &image[s..], alpha: alpha as f32 })
        };
        let mut total = 0.0;
        task.par.fold_tasks(parts, block, |sum| total += sum);
        total
    }
}

struct Turn<'a> {
    d: &'a mut [Quad],
    z: &'a [Quad],
    beta: f32,
}

impl Kernel for Turn<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (d, z) in self.d.iter_mut().zip(self.z) {
            *d = z.add_scaled(self.beta, *d);
        }
    }
}

struct Image<'a> {
    matrix: &'a SinglePrecision,
    d: &'a [Quad],
    start: usize,
    out: &'a mut [Quad],
}

impl Kernel for Image<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for (i, y) in self.out.iter_mut().enumerate() {
            *y = self.matrix.rounded_row_product(self.start + i, self.d);
            sum = sum + self.d[self.start + i] * *y;
        }
        sum.total()
    }
}

struct Descend<'a> {
    r: &'a mut [Quad],
    z: &'a mut [Quad],
    inverse: &'a [[Quad; 3]],
    image: &'a [Quad],
    alpha: f32,
}

impl Kernel for &mut Descend<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for (i, (r, z)) in self.r.iter_mut().zip(self.z.iter_mut()).enumerate() {
            *r = r.add_scaled(-self.alpha, self.image[i]);
            *z = Quad::combine(&self.inverse[i], *r);
            sum = sum + *r * *z;
        }
        sum.total()
    }
}

/// Sum of the terms that a slowly decaying series still has to come, from its last two thirds.
fn geometric_tail(terms: &[f64]) -> f64 {
    let n = terms.len();
    if n < 6 {
        return 0.0;
    }
    let third = n / 3;
    let older: f64 = terms[n - 2 * third..n - third].iter().sum();
    let newer: f64 = terms[n - third..].iter().sum();
    if older <= 0.0 || newer <= 0.0 {
        return 0.0;
    }
    let ratio = (newer / older).min(0.9);
    newer * ratio / (1.0 - ratio)
}
