//! The smallest change of velocities after which no row falls short: impulses push and never pull [Harmon10, §3.5].

use super::minimum_norm::{DENSE_ROWS, minimum_norm};
use super::zone_rows::{ZoneRows, inner};
use crate::math::{Vec3, add_scaled, scale};
use nalgebra::{DMatrix, DVector};

/// Penalties, relative to unit rows, from the first update of the multipliers on; the last one stays. Conjugate gradients
/// bear less than a factor does.
const PENALTIES: [f64; 5] = [1e1, 1e2, 1e3, 1e4, 1e5];

/// The same where Newton's systems are factored.
const PENALTIES_FACTORED: [f64; 4] = [1e2, 1e4, 1e6, 1e8];

/// Updates of the multipliers at most.
const UPDATES: usize = 40;

/// Newton steps at most, all updates together.
const NEWTON_STEPS: usize = 200;

/// Iterations of conjugate gradients in a Newton step at most.
const GRADIENT_STEPS: usize = 400;

/// Residual, relative to the right side, at which they end.
const GRADIENT_TOLERANCE: f64 = 1e-6;

/// An update at the last penalty must take this share off the complementarity, or rows contradict each other.
const PROGRESS: f64 = 0.5;

/// Complementarity, relative to the largest demand, at which the projection has converged.
pub(super) const TOLERANCE: f64 = 1e-11;

/// Complementarity below which the rows that push are trusted, and solved as equations.
const TRUSTED: f64 = 1e-4;

/// Times that rows which fall short join those that push.
const REPAIRS: usize = 4;

/// Halvings of a Newton step at most.
const HALVINGS: usize = 30;

/// A projection with its multipliers: `y = A^T lambda`, `lambda >= 0`.
pub(super) struct Unilateral {
    pub y: Vec<Vec3>,
    pub multipliers: Vec<f64>,
    pub converged: bool,
}

/// The smallest `y` with `A y >= demand`.
///
/// The complementarity problem that simplex methods could not solve robustly [Harmon10, §3.5] is the projection onto a
/// convex cone. The method of multipliers makes it a sequence of smooth convex problems, each solved by Newton steps
/// (factored for few rows, else by conjugate gradients) with a line search; rows that repeat or contradict each other leave all of these well posed.
/// Once the set of pushing rows has settled they are solved as equations, which removes what the iteration leaves. Rows
/// that cannot be met end at the work cap, near their least squares. Cost: at most 40 updates, 200 Newton steps of 400
/// iterations.
pub(super) fn unilateral(rows: &ZoneRows, demand: &[f64]) -> Unilateral {
    let size = demand.iter().fold(0.0_f64, |m, c| m.max(*c));
    let penalties: &[f64] = if rows.len() <= DENSE_ROWS { &PENALTIES_FACTORED } else { &PENALTIES };
    let mut state = Multipliers { y: vec![[0.0; 3]; rows.width], lambda: vec![0.0; rows.len()] };
    let mut steps = 0;
    let mut polished_at = f64::INFINITY;
    let mut last = f64::INFINITY;
    for update in 0..UPDATES {
        let complementarity = state.complementarity(rows, demand) / size.max(f64::MIN_POSITIVE);
        if size == 0.0 || complementarity <= TOLERANCE {
            return state.finished(rows, true);
        }
        if complementarity <= TRUSTED && complementarity < 1e-2 * polished_at {
            polished_at = complementarity;
            if let Some(solution) = polished(rows, demand, &state.lambda, size) {
                return solution;
            }
        }
        let stalls = update >= penalties.len() && complementarity > PROGRESS * last;
        if stalls || steps >= NEWTON_STEPS {
            break;
        }
        last = complementarity;
        let sigma = penalties[update.min(penalties.len() - 1)];
        let tolerance = 1e-2 * size * complementarity.min(1.0);
        steps += state.minimise(rows, demand, sigma, NEWTON_STEPS - steps, tolerance);
        for i in 0..rows.len() {
            state.lambda[i] = (state.lambda[i] + sigma * (demand[i] - rows.product(i, &state.y))).max(0.0);
        }
    }
    let converged = state.complementarity(rows, demand) <= TRUSTED * size;
    state.finished(rows, converged)
}

/// The rows that push, and those that then fall short, solved as equations; `None` where that is another motion, or some
/// row still falls short.
fn polished(rows: &ZoneRows, demand: &[f64], lambda: &[f64], size: f64) -> Option<Unilateral> {
    let tolerance = TOLERANCE * size;
    let before = rows.transposed_product(lambda);
    let mut pushes: Vec<bool> = lambda.iter().map(|l| *l > 0.0).collect();
    for _ in 0..REPAIRS {
        let active: Vec<usize> = (0..rows.len()).filter(|i| pushes[*i]).collect();
        let right: Vec<f64> = active.iter().map(|i| demand[*i]).collect();
        let solution = minimum_norm(&rows.selected(&active), &right);
        let short = |i: &usize| rows.product(*i, &solution.y) < demand[*i] - tolerance;
        let missed: Vec<usize> = (0..rows.len()).filter(short).collect();
        if missed.iter().any(|i| pushes[*i]) {
            return None;
        }
        if !missed.is_empty() {
            missed.into_iter().for_each(|i| pushes[i] = true);
            continue;
        }
        // Rows that repeat each other have many multipliers, of which the smallest may pull: then those of the iteration
        // stand for them, as long as they move the same.
        let pulls = solution.multipliers.iter().any(|l| *l < -tolerance);
        let change: Vec<Vec3> = solution.y.iter().zip(&before).map(|(a, b)| add_scaled(*a, -1.0, *b)).collect();
        if pulls && inner(&change, &change) > TRUSTED * TRUSTED * inner(&before, &before) {
            return None;
        }
        let mut multipliers = lambda.to_vec();
        if !pulls {
            multipliers.fill(0.0);
            active.iter().zip(&solution.multipliers).for_each(|(i, l)| multipliers[*i] = l.max(0.0));
        }
        return Some(Unilateral { y: solution.y, multipliers, converged: true });
    }
    None
}

struct Multipliers {
    y: Vec<Vec3>,
    lambda: Vec<f64>,
}

impl Multipliers {
    /// Largest component of `min(lambda, A y - demand)` at `y = A^T lambda`.
    fn complementarity(&self, rows: &ZoneRows, demand: &[f64]) -> f64 {
        let y = rows.transposed_product(&self.lambda);
        let of = |i: usize| self.lambda[i].min(rows.product(i, &y) - demand[i]).abs();
        (0..rows.len()).map(of).fold(0.0, f64::max)
    }

    /// Minimises `|y|²/2 + sum max(0, lambda + sigma (demand - A y))²/(2 sigma)` over y; Newton steps taken.
    fn minimise(&mut self, rows: &ZoneRows, demand: &[f64], sigma: f64, steps_max: usize, tolerance: f64) -> usize {
        for step in 0..steps_max {
            let pushes = self.pushes(rows, demand, sigma, &self.y);
            let mut gradient = self.y.clone();
            for (i, z) in pushes.iter().enumerate().filter(|(_, z)| **z > 0.0) {
                rows.add_row(i, -z, &mut gradient);
            }
            // Below the rounding of the pushes there is nothing to gain.
            let rounding = 4.0 * f64::EPSILON * (1.0 + sigma) * inner(&self.y, &self.y).sqrt();
            if inner(&gradient, &gradient).sqrt() <= tolerance.max(rounding) {
                return step;
            }
            let active: Vec<usize> = (0..rows.len()).filter(|i| pushes[*i] > 0.0).collect();
            let direction = newton_direction(rows, &active, sigma, &gradient);
            if !self.search(rows, demand, sigma, &direction, inner(&gradient, &direction)) {
                return step + 1;
            }
        }
        steps_max
    }

    /// `max(0, lambda + sigma (demand - A y))`
    fn pushes(&self, rows: &ZoneRows, demand: &[f64], sigma: f64, y: &[Vec3]) -> Vec<f64> {
        let of = |i: usize| (self.lambda[i] + sigma * (demand[i] - rows.product(i, y))).max(0.0);
        (0..rows.len()).map(of).collect()
    }

    fn value(&self, rows: &ZoneRows, demand: &[f64], sigma: f64, y: &[Vec3]) -> f64 {
        let squares: f64 = self.pushes(rows, demand, sigma, y).iter().map(|z| z * z).sum();
        0.5 * inner(y, y) + 0.5 * squares / sigma
    }

    /// Goes along a direction of descent of the given slope as far as the value falls; whether it did.
    fn search(&mut self, rows: &ZoneRows, demand: &[f64], sigma: f64, direction: &[Vec3], slope: f64) -> bool {
        let start = self.value(rows, demand, sigma, &self.y);
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            let there: Vec<Vec3> = self.y.iter().zip(direction).map(|(y, d)| add_scaled(*y, share, *d)).collect();
            if self.value(rows, demand, sigma, &there) < start + 1e-4 * share * slope {
                self.y = there;
                return true;
            }
            share *= 0.5;
        }
        false
    }

    fn finished(self, rows: &ZoneRows, converged: bool) -> Unilateral {
        Unilateral { y: rows.transposed_product(&self.lambda), multipliers: self.lambda, converged }
    }
}

/// `-(I + sigma A_S^T A_S)^-1 gradient`
fn newton_direction(rows: &ZoneRows, active: &[usize], sigma: f64, gradient: &[Vec3]) -> Vec<Vec3> {
    if rows.len() <= DENSE_ROWS
        && let Some(direction) = by_factor(rows, active, sigma, gradient)
    {
        return direction;
    }
    by_conjugate_gradients(rows, active, sigma, gradient)
}

/// By a factor of `A_S A_S^T + I/sigma`, which is as small as there are rows.
fn by_factor(rows: &ZoneRows, active: &[usize], sigma: f64, gradient: &[Vec3]) -> Option<Vec<Vec3>> {
    let n = active.len();
    let entry = |i: usize, j: usize| {
        let shift = if i == j { 1.0 / sigma } else { 0.0 };
        rows.inner_product(active[i.min(j)], active[i.max(j)]) + shift
    };
    let factor = DMatrix::from_fn(n, n, entry).cholesky()?;
    let load = factor.solve(&DVector::from_fn(n, |i, _| rows.product(active[i], gradient)));
    let mut direction: Vec<Vec3> = gradient.iter().map(|g| scale(-1.0, *g)).collect();
    active.iter().zip(load.iter()).for_each(|(i, l)| rows.add_row(*i, *l, &mut direction));
    Some(direction)
}

fn by_conjugate_gradients(rows: &ZoneRows, active: &[usize], sigma: f64, gradient: &[Vec3]) -> Vec<Vec3> {
    let apply = |d: &[Vec3]| {
        let mut out = d.to_vec();
        active.iter().for_each(|i| rows.add_row(*i, sigma * rows.product(*i, d), &mut out));
        out
    };
    let mut direction = vec![[0.0; 3]; gradient.len()];
    let mut residual: Vec<Vec3> = gradient.iter().map(|g| scale(-1.0, *g)).collect();
    let mut search = residual.clone();
    let mut square = inner(&residual, &residual);
    let end = GRADIENT_TOLERANCE * GRADIENT_TOLERANCE * square;
    for _ in 0..GRADIENT_STEPS.min(8 * gradient.len() + 8) {
        if square <= end {
            break;
        }
        let image = apply(&search);
        let alpha = square / inner(&search, &image);
        for b in 0..direction.len() {
            direction[b] = add_scaled(direction[b], alpha, search[b]);
            residual[b] = add_scaled(residual[b], -alpha, image[b]);
        }
        let next = inner(&residual, &residual);
        let beta = next / square;
        square = next;
        search.iter_mut().zip(&residual).for_each(|(s, r)| *s = add_scaled(*r, beta, *s));
    }
    direction
}
