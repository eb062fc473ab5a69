//! Residuals with a meaning: the natural map of the contact laws, and the dynamics residual. Neither bounds the velocity
//! error on soft metrics: `velocity_error` estimates that.

use super::packed_contacts::{PackedContacts, contact_velocity};
use super::problem::ContactProblem;
use super::velocity_error::ErrorSystem;
use crate::linalg::SinglePrecision;
use crate::math::{Vec3, dot, mat_vec, sub};
use crate::model::Settings;
use crate::parallel::{BLOCK, Par};

/// One solve: the problem, its packed contacts and the scales that make residuals relative.
pub(super) struct Task<'a> {
    /// The problem.
    pub problem: &'a ContactProblem<'a>,
    /// Contacts in sweep order.
    pub packed: &'a PackedContacts,
    /// The metric in single precision.
    pub single: &'a SinglePrecision,
    /// Whether the row of each block in the metric has entries beside its diagonal.
    pub coupled: &'a [bool],
    /// Settings of the step.
    pub settings: &'a Settings,
    /// Scale of velocities `[m/s]`, positive.
    pub velocity_scale: f64,
    /// Floor of `|C^T p|` in the norm of the inverse diagonal `[kg^1/2 m/s]`: what the dynamics residual is relative to
    /// while no contact is active.
    pub impulse_floor: f64,
    /// Where kernels run.
    pub par: Par<'a>,
}

/// A candidate solution; `p` in sweep order.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Iterate {
    /// Velocity change per block `[m/s]`.
    pub dv: Vec<Vec3>,
    /// Multipliers per contact `[N s]`.
    pub p: Vec<Vec3>,
}

impl Clone for Iterate {
    fn clone(&self) -> Iterate {
        Iterate { dv: self.dv.clone(), p: self.p.clone() }
    }

    // The derived one would not keep the memory.
    fn clone_from(&mut self, source: &Iterate) {
        self.dv.clone_from(&source.dv);
        self.p.clone_from(&source.p);
    }
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

/// Adds contact `c` to the residuals, velocities not yet relative.
#[inline]
fn count_contact(task: &Task, r: &mut Residuals, c: usize, dv: &[Vec3], p: Vec3) {
    let w = contact_velocity(&task.packed.contacts[c], task.problem.rows, dv);
    if p == [0.0; 3] && w[0] >= 0.0 {
        return;
    }
    let scales = task.packed.natural_scale(c);
    let [n, t] = task.packed.natural_map(task.settings.friction_cone, c, scales, p, w);
    if !(n.is_finite() && t.is_finite()) {
        r.normal = f64::INFINITY;
        return;
    }
    r.normal = r.normal.max(n);
    r.friction = r.friction.max(t);
    let [dn, dt] = scales;
    if dn > 0.0 {
        r.contact_energy += n * n / dn;
    }
    if dt > 0.0 {
        r.contact_energy += t * t / dt;
    }
}

/// Natural-map residuals of the contacts `list` alone (the dynamics residual is left 0).
pub(super) fn near_residuals(task: &Task, list: impl Iterator<Item = usize>, dv: &[Vec3], p: &[Vec3]) -> Residuals {
    let mut r = Residuals::default();
    for c in list {
        count_contact(task, &mut r, c, dv, p[c]);
    }
    r.normal /= task.velocity_scale;
    r.friction /= task.velocity_scale;
    r
}

/// Natural-map residuals alone (the dynamics residual is left 0).
pub(super) fn contact_residuals(task: &Task, dv: &[Vec3], p: &[Vec3]) -> Residuals {
    let count = task.packed.contacts.len();
    // Block by block of contacts: maxima do not care about order, the sum is taken in index order.
    let each = |b: usize| {
        let mut r = Residuals::default();
        for c in b * BLOCK..count.min((b + 1) * BLOCK) {
            count_contact(task, &mut r, c, dv, p[c]);
        }
        r
    };
    let mut total = Residuals::default();
    task.par.fold_tasks(0..count.div_ceil(BLOCK), each, |r| {
        total.normal = total.normal.max(r.normal);
        total.friction = total.friction.max(r.friction);
        total.contact_energy += r.contact_energy;
    });
    total.normal /= task.velocity_scale;
    total.friction /= task.velocity_scale;
    total
}

/// Buffers of [`measure`] and of what judges an iterate by it; capacity is kept.
#[derive(Default)]
pub(super) struct MeasureBuffers {
    /// World impulses of the last call.
    pub impulses: Vec<Vec3>,
    /// `A dv` of the last call.
    pub product: Vec<Vec3>,
    /// `C^T p` of the last call.
    pub contact: Vec<Vec3>,
    /// The iterate last judged, with its momentum balanced.
    pub balanced: Vec<Vec3>,
    /// The translations that balanced it.
    pub translations: Vec<Vec3>,
    /// What estimates its velocity error.
    pub error: ErrorSystem,
    /// No response at all.
    pub none: Iterate,
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
    task.par.map_into(&mut buffers.contact, |b| task.packed.incidence.gather(b, impulses));
    total.dynamics = dynamics_residual(task, &buffers.product, &buffers.contact);
    work.blocks += matrix.values.len() as u64;
    work.contacts += 2 * at.p.len() as u64;
    total
}

/// `|A dv - C^T p| / |C^T p|` in the norm of the inverse diagonal, from `A dv` and `C^T p`.
pub(super) fn dynamics_residual(task: &Task, product: &[Vec3], contact: &[Vec3]) -> f64 {
    let inverse = task.problem.inverse_diagonal;
    let square = |b: usize, v: Vec3| dot(v, mat_vec(&inverse[b], v));
    let count = product.len();
    let sums = |k: usize| {
        let blocks = k * BLOCK..count.min((k + 1) * BLOCK);
        blocks.fold([0.0; 2], |s, b| [s[0] + square(b, sub(product[b], contact[b])), s[1] + square(b, contact[b])])
    };
    let mut total = [0.0; 2];
    task.par.fold_tasks(0..count.div_ceil(BLOCK), sums, |s| total = [total[0] + s[0], total[1] + s[1]]);
    let [residual, scale] = total;
    if residual == 0.0 { 0.0 } else { residual.sqrt() / scale.sqrt().max(task.impulse_floor) }
}
