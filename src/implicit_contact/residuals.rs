//! Residuals with a meaning: the natural map of the contact laws, the dynamics residual, and an estimate of the
//! velocity error, which neither of them bounds on soft metrics.

use super::packed_contacts::{PackedContacts, contact_velocity};
use super::problem::ContactProblem;
use crate::linalg::SinglePrecision;
use crate::math::{Mat3, Vec3, add, add_scaled, dot, mat_vec, sub};
use crate::model::Settings;
use crate::parallel::{BLOCK, Par};

/// Conjugate gradient steps of the velocity error estimate at most.
const ESTIMATE_STEPS: usize = 24;

/// Weight of the contacts' energy in the estimate: violations act together, and a contact alone sees only the diagonal
/// of A. Chosen so that estimates of runs that end on violations are not below the true error.
const VIOLATION_WEIGHT: f64 = 10.0;

/// One solve: the problem, its packed contacts and the scales that make residuals relative.
pub(super) struct Task<'a> {
    /// The problem.
    pub problem: &'a ContactProblem<'a>,
    /// Contacts in sweep order.
    pub packed: &'a PackedContacts,
    /// The metric in single precision.
    pub single: &'a SinglePrecision,
    /// Settings of the step.
    pub settings: &'a Settings,
    /// Scale of velocities `[m/s]`, positive.
    pub velocity_scale: f64,
    /// Harmonic mean mass of the blocks that contacts touch `[kg]`, positive.
    pub typical_mass: f64,
    /// Floor of `|C^T p|` in the norm of the inverse diagonal `[kg^1/2 m/s]`: what the dynamics residual is relative to
    /// while no contact is active.
    pub impulse_floor: f64,
    /// Where kernels run.
    pub par: Par<'a>,
}

/// A candidate solution; `p` in sweep order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Iterate {
    /// Velocity change per block `[m/s]`.
    pub dv: Vec<Vec3>,
    /// Multipliers per contact `[N s]`.
    pub p: Vec<Vec3>,
}

/// Work done, in entries touched: what a cap on time would be, but the same on every machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Work {
    /// Blocks of A multiplied.
    pub blocks: u64,
    /// Contacts visited.
    pub contacts: u64,
}

/// Residuals of an iterate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Residuals {
    /// Largest normal natural-map residual, relative to the velocity scale.
    pub normal: f64,
    /// Largest tangential one.
    pub friction: f64,
    /// `|A dv - C^T p| / |C^T p|` in the norm of the inverse diagonal.
    pub dynamics: f64,
    /// `sum` of squared natural-map residuals times effective masses `[J]`.
    pub contact_energy: f64,
}

impl Residuals {
    /// Largest of the contact residuals.
    pub fn contact(&self) -> f64 {
        self.normal.max(self.friction)
    }

    /// One number to compare iterates by; infinite where something is not finite.
    pub fn merit(&self) -> f64 {
        let m = self.contact() + self.dynamics;
        if m.is_finite() { m } else { f64::INFINITY }
    }
}

/// Natural-map residuals alone (the dynamics residual is left 0).
pub(super) fn contact_residuals(task: &Task, dv: &[Vec3], p: &[Vec3]) -> Residuals {
    let count = task.packed.contacts.len();
    let cone = task.settings.friction_cone;
    let mut partial = vec![Residuals::default(); count.div_ceil(BLOCK)];
    // One entry per block of contacts: maxima do not care about order, the sum is taken in index order.
    let each = |r: &mut Residuals, b: usize| {
        let range = b * BLOCK..count.min((b + 1) * BLOCK);
        for ((c, contact), p) in range.clone().zip(&task.packed.contacts[range.clone()]).zip(&p[range]) {
            let w = contact_velocity(contact, task.problem.rows, dv);
            let [n, t] = task.packed.natural_map(cone, c, *p, w);
            if !(n.is_finite() && t.is_finite()) {
                r.normal = f64::INFINITY;
                continue;
            }
            r.normal = r.normal.max(n);
            r.friction = r.friction.max(t);
            let [dn, dt] = contact.natural_scale;
            if dn > 0.0 {
                r.contact_energy += n * n / dn;
            }
            if dt > 0.0 {
                r.contact_energy += t * t / dt;
            }
        }
    };
    let mut tasks: Vec<(usize, &mut Residuals)> = partial.iter_mut().enumerate().collect();
    task.par.for_each_task(&mut tasks, |(b, r)| each(r, *b));
    let mut total = Residuals::default();
    for r in partial {
        total.normal = total.normal.max(r.normal);
        total.friction = total.friction.max(r.friction);
        total.contact_energy += r.contact_energy;
    }
    total.normal /= task.velocity_scale;
    total.friction /= task.velocity_scale;
    total
}

/// Buffers of [`measure`] and [`velocity_error`].
#[derive(Default)]
pub(super) struct MeasureBuffers {
    /// World impulses of the last call.
    pub impulses: Vec<Vec3>,
    /// `A dv` of the last call.
    pub product: Vec<Vec3>,
    /// `C^T p` of the last call.
    pub contact: Vec<Vec3>,
    residual: Vec<Vec3>,
    direction: Vec<Vec3>,
    image: Vec<Vec3>,
}

/// All residuals of an iterate, from `dv` and `p` alone. Cost: one product with A and one pass over the contacts.
pub(super) fn measure(task: &Task, at: &Iterate, buffers: &mut MeasureBuffers, work: &mut Work) -> Residuals {
    let matrix = task.problem.matrix;
    let mut total = contact_residuals(task, &at.dv, &at.p);
    let blocks = at.dv.len();
    buffers.product.resize(blocks, [0.0; 3]);
    buffers.contact.resize(blocks, [0.0; 3]);
    matrix.product(&at.dv, &mut buffers.product, task.par);
    task.packed.impulses(&at.p, &mut buffers.impulses, task.par);
    let impulses = &buffers.impulses;
    task.par.map_into(&mut buffers.contact, |b| task.packed.gather(b, impulses));
    total.dynamics = dynamics_residual(task, &buffers.product, &buffers.contact);
    work.blocks += matrix.values.len() as u64;
    work.contacts += 2 * at.p.len() as u64;
    total
}

/// `|A dv - C^T p| / |C^T p|` in the norm of the inverse diagonal, from `A dv` and `C^T p`.
pub(super) fn dynamics_residual(task: &Task, product: &[Vec3], contact: &[Vec3]) -> f64 {
    let inverse = task.problem.inverse_diagonal;
    let norm_squared = |f: &(dyn Fn(usize) -> Vec3 + Sync)| {
        task.par.sum(product.len(), |b| {
            let v = f(b);
            dot(v, mat_vec(&inverse[b], v))
        })
    };
    let residual = norm_squared(&|b| sub(product[b], contact[b])).sqrt();
    let scale = norm_squared(&|b| contact[b]).sqrt().max(task.impulse_floor);
    if residual == 0.0 { 0.0 } else { residual / scale }
}

/// Estimated `|dv - dv_exact|_A / |dv_exact|_A` of the iterate last given to [`measure`].
///
/// With `r = C^T p - A dv` the gap between the primal value at `dv` and the dual value at `p` is
/// `p · (C dv + target) + |r|^2 / 2` in the norm of `A^-1`, and half the squared error is at most the gap (frictionless,
/// feasible `dv`). The first term is replaced by the energy of the natural map, which also counts violations. The
/// second is summed by preconditioned conjugate gradients on `A e = r`, whose partial sums grow towards
/// `|r|^2` from below, plus a geometric tail. The residual in the norm of the *diagonal*, the usual stop test, misses
/// soft modes: it underestimates by up to the square root of the condition number.
pub(super) fn velocity_error(
    task: &Task,
    at: &Iterate,
    residuals: &Residuals,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> f64 {
    let MeasureBuffers { product, contact, residual, direction, image, .. } = buffers;
    let blocks = at.dv.len();
    let dv = &at.dv;
    let energy = task.par.sum(blocks, |b| dot(dv[b], product[b]));
    let scale = energy.max(task.impulse_floor * task.impulse_floor);
    residual.resize(blocks, [0.0; 3]);
    direction.resize(blocks, [0.0; 3]);
    image.resize(blocks, [0.0; 3]);
    let inverse: &[Mat3] = task.problem.inverse_diagonal;
    {
        let (q, y) = (&*contact, &*product);
        task.par.map_into(residual, |b| sub(q[b], y[b]));
        let r = &*residual;
        task.par.map_into(direction, |b| mat_vec(&inverse[b], r[b]));
    }
    let z_dot_r = |r: &[Vec3]| task.par.sum(blocks, |b| dot(r[b], mat_vec(&inverse[b], r[b])));
    let mut rho = z_dot_r(residual);
    let (mut total, mut gains) = (0.0, [0.0; ESTIMATE_STEPS]);
    let mut steps = 0;
    while steps < ESTIMATE_STEPS && rho > 0.0 {
        let rounded = task.single.round(blocks, |b| direction[b], task.par);
        task.par.map_into(image, |b| task.single.row_product(b, &rounded));
        work.blocks += task.problem.matrix.values.len() as u64;
        let curvature = {
            let (d, k) = (&*direction, &*image);
            task.par.sum(blocks, |b| dot(d[b], k[b]))
        };
        if curvature.is_nan() || curvature <= 0.0 {
            break;
        }
        let alpha = rho / curvature;
        gains[steps] = alpha * rho;
        total += gains[steps];
        steps += 1;
        // Enough is known once the last steps add little.
        if steps >= 4 && gains[steps - 1] + gains[steps - 2] < 0.02 * total {
            break;
        }
        {
            let k = &*image;
            task.par.for_each_block(residual, |start, part| {
                for (i, r) in part.iter_mut().enumerate() {
                    *r = add_scaled(*r, -alpha, k[start + i]);
                }
            });
        }
        let next = z_dot_r(residual);
        let beta = next / rho;
        rho = next;
        {
            let r = &*residual;
            task.par.for_each_block(direction, |start, part| {
                for (i, d) in part.iter_mut().enumerate() {
                    *d = add(mat_vec(&inverse[start + i], r[start + i]), [beta * d[0], beta * d[1], beta * d[2]]);
                }
            });
        }
    }
    let tail = geometric_tail(&gains[..steps]);
    let error = ((total + tail + VIOLATION_WEIGHT * residuals.contact_energy) / scale).sqrt();
    if error.is_finite() { error } else { f64::INFINITY }
}

/// Sum of the terms that a slowly decaying series still has to come, from its last two thirds.
fn geometric_tail(gains: &[f64]) -> f64 {
    let n = gains.len();
    if n < 6 {
        return 0.0;
    }
    let third = n / 3;
    let older: f64 = gains[n - 2 * third..n - third].iter().sum();
    let newer: f64 = gains[n - third..].iter().sum();
    if older <= 0.0 || newer <= 0.0 {
        return 0.0;
    }
    let ratio = (newer / older).min(0.9);
    newer * ratio / (1.0 - ratio)
}
