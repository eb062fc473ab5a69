//! An estimate of the velocity error, which residuals do not bound on soft metrics.

use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work};
use crate::linalg::{SweepGradient, power_of_two};
use crate::math::{dot, sub};
use crate::parallel::Par;

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
    let (dv, product, contact) = (&at.dv, &buffers.product, &buffers.contact);
    let blocks = dv.len();
    let energy = task.par.sum(blocks, |b| dot(dv[b], product[b]));
    let scale = energy.max(task.impulse_floor * task.impulse_floor);
    let violation = VIOLATION_WEIGHT * residuals.contact_energy;
    let enough = (ENOUGH * wanted).powi(2) * scale - violation;
    let largest = (0..blocks).fold(0.0f64, |m, b| {
        let r = sub(contact[b], product[b]);
        m.max(r[0].abs()).max(r[1].abs()).max(r[2].abs())
    });
    let (sweep, unit) = (&mut buffers.sweep, power_of_two(largest));
    let mass = sweep.unit();
    sweep.set_inverse(|b| task.problem.inverse_diagonal[b], task.par);
    sweep.forget();
    let rho = sweep.begin(|b| sub(contact[b], product[b]), unit, task.par);
    // The sum is of squares of impulses over masses.
    let (terms, steps) = terms(sweep, rho, enough * mass / (unit * unit), task.par);
    work.blocks += steps as u64 * task.problem.matrix.values.len() as u64;
    let total: f64 = terms[..steps].iter().sum();
    let tail = geometric_tail(&terms[..steps]);
    let error = (((total + tail) * (unit * unit / mass) + violation) / scale).sqrt();
    if error.is_finite() { error } else { f64::INFINITY }
}

/// What each step of conjugate gradients on `A e = r` takes off the squared error, and how many there are; ends early once
/// their sum is above `enough` or hardly grows.
fn terms(sweep: &mut SweepGradient, mut rho: f64, enough: f64, par: Par) -> ([f64; STEPS], usize) {
    let mut terms = [0.0; STEPS];
    let (mut total, mut beta) = (0.0, 0.0);
    for step in 0..STEPS {
        if rho <= 0.0 {
            return (terms, step);
        }
        let curvature = sweep.turn(beta as f32, &mut (), par);
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
        let next = sweep.descend(alpha as f32, par);
        beta = next / rho;
        rho = next;
    }
    (terms, STEPS)
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
