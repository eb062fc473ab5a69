//! Projected Gauss-Seidel on `w = D^-1 C^T p`: exact for metrics without off-diagonal blocks (lumped masses, rigid
//! bodies, infinite mass), where anticipation needs no outer loop.

use super::packed_contacts::PassContext;
use super::residuals::{Iterate, Task, Work, contact_residuals};
use crate::math::{Vec3, add_scaled, dot, mat_vec, sub};

/// Passes between two residual checks.
const CHECK_EVERY: u32 = 8;

/// Solves in place; returns the passes made and whether the contact tolerance was met.
///
/// Passes are accelerated as a nonlinear conjugate gradient method [Silcowitz10]: a pass is a fixed-point map of `p`,
/// its step the gradient. The direction is dropped whenever the step grows.
pub(super) fn solve(task: &Task, at: &mut Iterate, iterations_max: u32, work: &mut Work) -> (u32, bool) {
    let Task { problem, packed, settings, par, .. } = *task;
    let inverse = problem.inverse_diagonal;
    let metrics = packed.metrics(problem.rows, inverse, par);
    let cone = settings.friction_cone;
    let cx = PassContext { rows: problem.rows, inverse, metrics: &metrics, cone, repeats: 1, par };
    let respond = |p: &[Vec3], dv: &mut Vec<Vec3>, impulses: &mut Vec<Vec3>| {
        packed.impulses(p, impulses, par);
        let f = &*impulses;
        par.map_into(dv, |b| mat_vec(&inverse[b], packed.gather(b, f)));
    };
    let mut impulses = Vec::new();
    respond(&at.p, &mut at.dv, &mut impulses);
    let count = at.p.len();
    let mut before = vec![[0.0; 3]; count];
    let mut direction = vec![[0.0; 3]; count];
    let mut step_squared = f64::INFINITY;
    let mut iterations = 0;
    while iterations < iterations_max {
        before.copy_from_slice(&at.p);
        work.contacts += packed.pass(&cx, None, &mut at.p, &mut at.dv);
        iterations += 1;
        let last = iterations == iterations_max;
        if iterations % CHECK_EVERY == 1 || last {
            let mut exact = Iterate { dv: vec![[0.0; 3]; at.dv.len()], p: Vec::new() };
            respond(&at.p, &mut exact.dv, &mut impulses);
            let residuals = contact_residuals(task, &exact.dv, &at.p);
            work.contacts += 2 * count as u64;
            at.dv = exact.dv;
            if residuals.contact() <= settings.contact_tolerance && small(task, at, residuals.contact_energy) {
                return (iterations, true);
            }
            if last {
                break;
            }
        }
        accelerate(task, at, &before, &mut direction, &mut step_squared);
        respond(&at.p, &mut at.dv, &mut impulses);
        work.contacts += count as u64;
    }
    (iterations, false)
}

/// Whether the energy of what is left is within the velocity tolerance.
fn small(task: &Task, at: &Iterate, contact_energy: f64) -> bool {
    let (matrix, dv) = (task.problem.matrix, &at.dv);
    let energy = task.par.sum(dv.len(), |b| dot(dv[b], matrix.row_product(b, dv)));
    let tolerance = task.settings.velocity_tolerance;
    contact_energy <= tolerance * tolerance * energy.max(task.impulse_floor * task.impulse_floor)
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
    let mut pairs: Vec<(&mut Vec3, &mut Vec3)> = direction.iter_mut().zip(at.p.iter_mut()).collect();
    task.par.for_each_block(&mut pairs, |start, part| {
        for (i, (d, p)) in part.iter_mut().enumerate() {
            let c = start + i;
            let moved = add_scaled(**p, ratio, **d);
            **d = add_scaled(sub(**p, before[c]), ratio, **d);
            **p = super::friction::project(cone, task.packed.contacts[c].friction, moved);
        }
    });
}
