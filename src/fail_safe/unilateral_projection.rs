//! The smallest change of velocities after which no row falls short: impulses push and never pull [Harmon10, §3.5].

use super::active_set::active_set;
use super::zone_factor::{LateFactor, ZoneFactor};
use super::zone_rows::{ZoneRows, inner};
use crate::math::{Vec3, add_scaled, scale};

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
const TOLERANCE: f64 = 1e-13;

/// Where unknowns would have to change by this many times the largest demand there is no projection: rows contradict each
/// other, or would have the zone slip out of what squeezes it.
pub(super) const ESCAPE: f64 = 16.0;

/// Complementarity that is accepted where no more is to be had.
pub(super) const TRUSTED: f64 = 1e-4;

/// A projection with its multipliers: `y = A^T lambda`, `lambda >= 0`.
pub(super) struct Unilateral {
    pub y: Vec<Vec3>,
    pub multipliers: Vec<f64>,
    pub converged: bool,
}

/// The smallest `y` with `A y >= demand`.
///
/// The complementarity problem that simplex methods could not solve robustly [Harmon10, §3.5] is the projection onto a
/// convex cone. Few unknowns are a matter for [`active_set`]. Else the method of multipliers makes it a sequence of smooth
/// convex problems, each solved by Newton steps (factored in the unknowns where that is cheap, else by conjugate
/// gradients) with an exact line search; rows that repeat or contradict each other leave all of these well posed.
/// Everything is in terms of what an update changes, so that rounding shrinks with it. Rows that cannot be met end by
/// duality or at the work cap, near their least squares. Cost: at most 40 updates, 200 Newton steps of a factorisation or
/// 400 iterations. A guess of the multipliers saves most of that; it may be empty.
pub(super) fn unilateral(rows: &ZoneRows, demand: &[f64], guess: &[f64], factor: &mut LateFactor) -> Unilateral {
    if let Some(solution) = active_set(rows, demand, guess) {
        return solution;
    }
    let mut factor = factor.of(rows);
    let size = demand.iter().fold(0.0_f64, |m, c| m.max(*c));
    let penalties: &[f64] = if factor.is_some() { &PENALTIES_FACTORED } else { &PENALTIES };
    let mut state = Multipliers::new(rows, demand);
    let (mut steps, mut last, mut first) = (0, f64::INFINITY, 0);
    if guess.iter().any(|l| *l > 0.0) {
        state.lambda = guess.iter().map(|l| l.max(0.0)).collect();
        state.renew(rows, demand);
        first = penalties.len() / 2;
    }
    for update in first..UPDATES {
        let complementarity = state.complementarity() / size.max(f64::MIN_POSITIVE);
        if size == 0.0 || complementarity <= TOLERANCE {
            return state.finished(true);
        }
        let stalls = update >= penalties.len() && complementarity > PROGRESS * last;
        if stalls || steps >= NEWTON_STEPS {
            break;
        }
        if state.shortest(demand) > ESCAPE * size * (3.0 * rows.width as f64).sqrt() {
            return state.finished(false);
        }
        last = complementarity;
        let sigma = penalties[update.min(penalties.len() - 1)];
        let tolerance = 1e-2 * size * complementarity.min(1.0);
        steps += state.update(rows, demand, sigma, NEWTON_STEPS - steps, tolerance, factor.as_deref_mut());
    }
    let converged = state.complementarity() <= TRUSTED * size;
    state.finished(converged)
}

struct Multipliers {
    lambda: Vec<f64>,
    /// `A^T lambda`
    y: Vec<Vec3>,
    /// `demand - A y`
    left: Vec<f64>,
}

impl Multipliers {
    fn new(rows: &ZoneRows, demand: &[f64]) -> Multipliers {
        Multipliers { lambda: vec![0.0; rows.len()], y: vec![[0.0; 3]; rows.width], left: demand.to_vec() }
    }

    /// A length that no `y` with `A y >= demand` falls below, by duality: grows without bound where there is none.
    fn shortest(&self, demand: &[f64]) -> f64 {
        let gained: f64 = self.lambda.iter().zip(demand).map(|(l, c)| l * c).sum();
        let length = inner(&self.y, &self.y).sqrt();
        if length > 0.0 { gained / length } else { 0.0 }
    }

    /// Largest component of `min(lambda, A y - demand)`.
    fn complementarity(&self) -> f64 {
        self.lambda.iter().zip(&self.left).fold(0.0, |m, (l, left)| m.max(l.min(-left).abs()))
    }

    /// One update of the multipliers: to `z = max(0, lambda + sigma (demand - A (y + d)))` where d minimises
    /// `|y + d|²/2 + |z|²/(2 sigma)`; Newton steps taken.
    fn update(
        &mut self,
        rows: &ZoneRows,
        demand: &[f64],
        sigma: f64,
        steps_max: usize,
        tolerance: f64,
        mut factor: Option<&mut ZoneFactor>,
    ) -> usize {
        let mut change = vec![[0.0; 3]; rows.width];
        // lambda + sigma (demand - A (y + d)), pushing or not.
        let mut pushes: Vec<f64> = self.lambda.iter().zip(&self.left).map(|(l, left)| l + sigma * left).collect();
        let mut steps = 0;
        while steps < steps_max {
            // y is A^T lambda: what is left of the gradient.
            let mut gradient = change.clone();
            let mut active = Vec::new();
            for (i, push) in pushes.iter().enumerate() {
                if *push > 0.0 {
                    active.push(i);
                }
                let gained = push.max(0.0) - self.lambda[i];
                if gained != 0.0 {
                    rows.add_row(i, -gained, &mut gradient);
                }
            }
            let size = inner(&change, &change).sqrt();
            let rounding = 4.0 * f64::EPSILON * (1.0 + sigma) * size;
            if inner(&gradient, &gradient).sqrt() <= tolerance.max(rounding) {
                break;
            }
            steps += 1;
            let direction = newton_direction(rows, &active, sigma, &gradient, factor.as_deref_mut());
            let speeds: Vec<f64> = (0..rows.len()).map(|i| -sigma * rows.product(i, &direction)).collect();
            let slope = inner(&gradient, &direction);
            let way = lowest(&pushes, &speeds, sigma, slope, inner(&direction, &direction));
            if way == 0.0 {
                break;
            }
            change.iter_mut().zip(&direction).for_each(|(c, d)| *c = add_scaled(*c, way, *d));
            pushes.iter_mut().zip(&speeds).for_each(|(push, speed)| *push += way * speed);
        }
        self.lambda.iter_mut().zip(&pushes).for_each(|(l, push)| *l = push.max(0.0));
        self.renew(rows, demand);
        steps
    }

    /// What follows from lambda.
    fn renew(&mut self, rows: &ZoneRows, demand: &[f64]) {
        self.y = rows.transposed_product(&self.lambda);
        self.left = (0..rows.len()).map(|i| demand[i] - rows.product(i, &self.y)).collect();
    }

    fn finished(self, converged: bool) -> Unilateral {
        Unilateral { y: self.y, multipliers: self.lambda, converged }
    }
}

/// How far to go where the function is lowest along a direction; 0 unless it falls.
///
/// Its slope, `slope` at first, grows by `square` and by the squares of the speeds of what pushes, over sigma: piecewise
/// linear, with a bend where a row starts or ends to push. Cost: a sort of the bends.
fn lowest(pushes: &[f64], speeds: &[f64], sigma: f64, slope: f64, square: f64) -> f64 {
    let mut bends = Vec::new();
    let mut curvature = square;
    for (push, speed) in pushes.iter().zip(speeds) {
        let bend = speed * speed / sigma;
        if *push > 0.0 {
            curvature += bend;
        }
        if *push > 0.0 && *speed < 0.0 {
            bends.push((-push / speed, -bend));
        } else if *push <= 0.0 && *speed > 0.0 {
            bends.push((-push / speed, bend));
        }
    }
    bends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let (mut at, mut slope) = (0.0, slope);
    for (bend, more) in bends {
        let there = slope + (bend - at) * curvature;
        if there >= 0.0 {
            break;
        }
        (at, slope) = (bend, there);
        curvature = (curvature + more).max(square);
    }
    if slope < 0.0 && curvature > 0.0 { at - slope / curvature } else { at }
}

/// `-(I + sigma A_S^T A_S)^-1 gradient`
fn newton_direction(
    rows: &ZoneRows,
    active: &[usize],
    sigma: f64,
    gradient: &[Vec3],
    factor: Option<&mut ZoneFactor>,
) -> Vec<Vec3> {
    let mut direction: Vec<Vec3> = gradient.iter().map(|g| scale(-1.0, *g)).collect();
    if let Some(factor) = factor
        && factor.assign(rows, active, sigma)
    {
        factor.solve(&mut direction);
        return direction;
    }
    by_conjugate_gradients(rows, active, sigma, direction)
}

fn by_conjugate_gradients(rows: &ZoneRows, active: &[usize], sigma: f64, right: Vec<Vec3>) -> Vec<Vec3> {
    let apply = |d: &[Vec3]| {
        let mut out = d.to_vec();
        active.iter().for_each(|i| rows.add_row(*i, sigma * rows.product(*i, d), &mut out));
        out
    };
    let mut direction = vec![[0.0; 3]; right.len()];
    let mut residual = right;
    let mut search = residual.clone();
    let mut square = inner(&residual, &residual);
    let end = GRADIENT_TOLERANCE * GRADIENT_TOLERANCE * square;
    for _ in 0..GRADIENT_STEPS.min(8 * residual.len() + 8) {
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
