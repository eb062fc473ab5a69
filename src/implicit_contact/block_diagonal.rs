//! Projected Gauss-Seidel on `w = D^-1 C^T p`: exact for metrics without off-diagonal blocks (lumped masses, rigid
//! bodies, infinite mass), where anticipation needs no outer loop.

use super::friction::{LocalMetric, project};
use super::packed_contacts::PassContext;
use super::residuals::{Iterate, Task, Work, contact_residuals};
use super::stop_test::{Ending, Run};
use crate::math::{Vec3, add_scaled, dot, mat_vec, sub};
use crate::parallel::BLOCK;

/// Passes between two residual checks.
const CHECK_EVERY: u32 = 8;

/// The best iterate of several solvers in turn, by the contact residual of the velocities that follow from its impulses;
/// capacity is kept.
#[derive(Default)]
pub(super) struct Best {
    residual: f64,
    at: Iterate,
    impulses: Vec<Vec3>,
}

impl Best {
    /// `at` is the best so far.
    pub fn start(&mut self, task: &Task, at: &mut Iterate, work: &mut Work) {
        self.residual = f64::INFINITY;
        self.at.clone_from(at);
        self.take(task, at, work);
    }

    /// Gives `at` the velocities that follow from its impulses, and puts the better of it and the best into both; whether
    /// the contacts hold.
    pub fn take(&mut self, task: &Task, at: &mut Iterate, work: &mut Work) -> bool {
        respond(task, &at.p, &mut at.dv, &mut self.impulses);
        work.contacts += 2 * at.p.len() as u64;
        let residual = contact_residuals(task, &at.dv, &at.p).contact();
        if residual < self.residual {
            self.residual = residual;
            self.at.clone_from(at);
        } else {
            at.clone_from(&self.at);
        }
        self.residual <= task.settings.contact_tolerance
    }
}

/// `dv = D^-1 C^T p`
fn respond(task: &Task, p: &[Vec3], dv: &mut [Vec3], impulses: &mut Vec<Vec3>) {
    let (packed, inverse, par) = (task.packed, task.problem.inverse_diagonal, task.par);
    packed.impulses(p, impulses, par);
    let f = &*impulses;
    par.map_into(dv, |b| mat_vec(&inverse[b], packed.incidence.gather(b, f)));
}

/// What passes keep their capacity in.
#[derive(Default)]
pub(super) struct PassBuffers {
    metrics: Vec<LocalMetric>,
    impulses: Vec<Vec3>,
    /// Multipliers before a pass, and the direction of the method.
    before: Vec<Vec3>,
    direction: Vec<Vec3>,
    /// Velocities of the last check.
    checked: Vec<Vec3>,
}

/// Solves in place, until the residuals and the estimated velocity error are within their tolerances.
///
/// Passes are accelerated as a nonlinear conjugate gradient method [Silcowitz10]: a pass is a fixed-point map of `p`,
/// its step the gradient. The direction is dropped whenever the step grows.
pub(super) fn solve(
    task: &Task,
    at: &mut Iterate,
    iterations_max: u32,
    buffers: &mut PassBuffers,
    work: &mut Work,
) -> Run {
    let Task { problem, packed, settings, par, .. } = *task;
    let PassBuffers { metrics, impulses, before, direction, checked } = buffers;
    let inverse = problem.inverse_diagonal;
    packed.metrics(problem.rows, inverse, metrics, par);
    let cone = settings.friction_cone;
    let cx = PassContext { rows: problem.rows, inverse, metrics, cone, repeats: 1, par };
    respond(task, &at.p, &mut at.dv, impulses);
    let count = at.p.len();
    direction.clear();
    direction.resize(count, [0.0; 3]);
    let mut step_squared = f64::INFINITY;
    let mut iterations = 0;
    let mut contraction = Contraction::default();
    while iterations < iterations_max {
        before.clone_from(&at.p);
        work.contacts += packed.pass(&cx, None, &mut at.p, &mut at.dv);
        iterations += 1;
        let last = iterations == iterations_max;
        if iterations % CHECK_EVERY == 1 || last {
            respond(task, &at.p, &mut at.dv, impulses);
            let residuals = contact_residuals(task, &at.dv, &at.p);
            work.contacts += 2 * count as u64;
            let error = contraction.error(task, &at.dv, checked, residuals.contact_energy);
            if residuals.contact() <= settings.contact_tolerance && error <= settings.velocity_tolerance {
                return Run { iterations, ending: Ending::Converged, error: Some(error) };
            }
            if last {
                break;
            }
        }
        accelerate(task, at, before, direction, &mut step_squared);
        respond(task, &at.p, &mut at.dv, impulses);
        work.contacts += count as u64;
    }
    Run { iterations, ending: Ending::Exhausted, error: None }
}

/// Velocity error from how fast the iterates draw together: violations of a tall stack are small everywhere and large
/// together, so their energy alone says little.
#[derive(Default)]
struct Contraction {
    /// Whether there was a check.
    continues: bool,
    /// `|change|^2` in the norm of A between the last two checks.
    change: Option<f64>,
}

impl Contraction {
    /// Estimated `|dv - dv_exact|_A / |dv_exact|_A`: the change since `checked`, the velocities of the last check, continued
    /// geometrically; those are `dv` then.
    fn error(&mut self, task: &Task, dv: &[Vec3], checked: &mut Vec<Vec3>, contact_energy: f64) -> f64 {
        let matrix = task.problem.matrix;
        let diagonal = |b: usize, v: Vec3| dot(v, mat_vec(matrix.diagonal_block(b), v));
        let energy = task.par.sum(dv.len(), |b| diagonal(b, dv[b]));
        let scale = energy.max(task.impulse_floor * task.impulse_floor);
        let violation = (contact_energy / scale).sqrt();
        let tolerance = task.settings.velocity_tolerance;
        if !std::mem::replace(&mut self.continues, true) {
            checked.clear();
            checked.extend_from_slice(dv);
            // Nothing to continue yet: only what is solved outright may stop here.
            return if violation <= 1e-2 * tolerance { violation } else { f64::INFINITY };
        }
        let change = task.par.sum(dv.len(), |b| diagonal(b, sub(dv[b], checked[b])));
        let ratio = match self.change {
            Some(before) if before > 0.0 => (change / before).sqrt().min(0.98),
            _ => 0.5,
        };
        self.change = Some(change);
        checked.copy_from_slice(dv);
        violation.max((change / scale).sqrt() * ratio / (1.0 - ratio))
    }
}

/// Adds the conjugate direction to `at.p` after a pass from `before`, and projects.
fn accelerate(task: &Task, at: &mut Iterate, before: &[Vec3], direction: &mut [Vec3], step_squared: &mut f64) {
    let p = &at.p;
    let next = task.par.sum(p.len(), |c| {
        let d = sub(p[c], before[c]);
        dot(d, d)
    });
    let ratio = next / *step_squared;
    *step_squared = next;
    if ratio.is_nan() || ratio > 1.0 {
        direction.fill([0.0; 3]);
        return;
    }
    let cone = task.settings.friction_cone;
    task.par.update_pairs_and_sum(BLOCK, direction, &mut at.p, |start, directions, p| {
        for (i, (d, p)) in directions.iter_mut().zip(p).enumerate() {
            let c = start + i;
            let moved = add_scaled(*p, ratio, *d);
            *d = add_scaled(sub(*p, before[c]), ratio, *d);
            *p = project(cone, task.packed.contacts[c].friction, moved);
        }
        0.0
    });
}
