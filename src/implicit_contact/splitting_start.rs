//! A few iterations of operator splitting (ADMM) that carry `dv` and the multipliers most of the way on moving cloth,
//! where fast in-plane modes make relaxation slow to begin with [Boyd11; over-relaxation 1.6].
//!
//! `K dv = C^T (p + rho z)`, `K = A + C^T rho C` over all contacts; `q = 1.6 C dv - 0.6 z`;
//! `p' = P(p - rho (q + target))`; `z = q + (p' - p) / rho`. The linear solves are a few conjugate gradient steps from
//! the last `dv`, their products in single precision, preconditioned by an incomplete factor.

use super::friction::project;
use super::packed_contacts::relative_velocity;
use super::residuals::{Iterate, Task, Work};
use crate::linalg::{GradientBuffers, GradientEnding, IncompleteCholesky, conjugate_gradient};
use crate::math::{Mat3, Vec3, add, dot, is_finite, scale, sub};

/// Stiffness `rho` relative to the effective mass of a contact: `rho = k / mean eigenvalue of G`.
const STIFFNESS: f64 = 0.3;
/// Over-relaxation.
const OVER: f64 = 1.6;
/// Relative residual of a linear solve and its steps at most.
const LINEAR_SOLVE: (f64, u32) = (0.1, 5);

/// Factor of `A + blockdiag(C^T rho C)`; `None` where it breaks down.
fn factor(task: &Task, stiffness: impl Fn(usize) -> Option<Mat3> + Sync) -> Option<IncompleteCholesky> {
    let inverse = task.problem.inverse_diagonal;
    let fixed = |b: usize| inverse[b] == [[0.0; 3]; 3];
    let extra: Vec<Mat3> = task.par.map_indexed(inverse.len(), |b| {
        let mut sum = [[0.0; 3]; 3];
        if !fixed(b) && task.packed.incidence.touches(b) {
            task.packed.incidence.add_diagonal(b, &mut sum, &stiffness);
        }
        sum
    });
    IncompleteCholesky::new(task.problem.matrix, &extra, fixed)
}

/// Improves `at` by `iterations`; returns the steps of the linear solves made, 0 when the factor breaks down (then `at`
/// is as before).
pub(super) fn run(task: &Task, at: &mut Iterate, iterations: u32, work: &mut Work) -> u32 {
    let Task { problem, packed, single, par, .. } = *task;
    let rho: Vec<f64> = par.map_indexed(packed.contacts.len(), |c| stiffness(packed.natural_scale(c)));
    let isotropic = |c: usize| {
        let r = rho[c];
        (r > 0.0).then_some([[r, 0.0, 0.0], [0.0, r, 0.0], [0.0, 0.0, r]])
    };
    let Some(factor) = factor(task, isotropic) else { return 0 };
    work.blocks += 4 * problem.matrix.values.len() as u64;
    let start = at.clone();
    let frame_velocity = |c: usize, v: &[Vec3]| {
        let u = relative_velocity(&packed.contacts[c], problem.rows, v);
        packed.contacts[c].frame.map(|axis| dot(axis, u))
    };
    let mut z: Vec<Vec3> = par.map_indexed(rho.len(), |c| frame_velocity(c, &at.dv));
    let mut load = vec![[0.0; 3]; at.dv.len()];
    let (mut forces, mut impulses, mut buffer) = (Vec::new(), vec![[0.0; 3]; rho.len()], Vec::new());
    let mut buffers = GradientBuffers::default();
    let mut total = 0;
    for _ in 0..iterations {
        let pulled: Vec<Vec3> = par.map_indexed(rho.len(), |c| add(at.p[c], scale(rho[c], z[c])));
        packed.impulses(&pulled, &mut forces, par);
        par.map_into(&mut load, |b| packed.incidence.gather(b, &forces));
        let apply = |d: &[Vec3], out: &mut [Vec3]| {
            par.map_into(&mut impulses, |c| scale(rho[c], relative_velocity(&packed.contacts[c], problem.rows, d)));
            let f = &impulses;
            let rounded = single.round(d.len(), |b| d[b], par);
            par.map_into(out, |b| add(single.row_product(b, &rounded), packed.incidence.gather(b, f)));
        };
        let precondition = |r: &[Vec3], out: &mut [Vec3]| factor.apply(r, out, &mut buffer);
        let (steps, ending) =
            conjugate_gradient(apply, precondition, &load, &mut at.dv, false, LINEAR_SOLVE, &mut buffers, par);
        total += steps + 1;
        if ending == GradientEnding::Breakdown || !at.dv.iter().all(|v| is_finite(*v)) {
            *at = start;
            return 0;
        }
        let cone = task.settings.friction_cone;
        for (c, contact) in packed.contacts.iter().enumerate() {
            if rho[c] == 0.0 {
                continue;
            }
            let q = sub(scale(OVER, frame_velocity(c, &at.dv)), scale(OVER - 1.0, z[c]));
            let p = project(cone, contact.friction, sub(at.p[c], scale(rho[c], add(q, contact.target))));
            z[c] = add(q, scale(1.0 / rho[c], sub(p, at.p[c])));
            at.p[c] = p;
        }
    }
    work.blocks += u64::from(total) * 2 * problem.matrix.values.len() as u64;
    work.contacts += u64::from(total) * 2 * rho.len() as u64 + u64::from(iterations) * 3 * rho.len() as u64;
    total
}

fn stiffness([normal, tangent]: [f64; 2]) -> f64 {
    // The trace of G is at most the normal entry and twice the largest tangential one.
    let mean = (normal + 2.0 * tangent) / 3.0;
    if mean > 0.0 { STIFFNESS / mean } else { 0.0 }
}
