//! A Newton step of the augmented Lagrangian: the contacts that act in it, and its linear system `(A + C^T E C) x = b`
//! by preconditioned conjugate gradients in single precision. Steps are wanted to a digit.

use super::incidence::Incidence;
use super::packed_contacts::Contact;
use super::residuals::{Task, Work};
use super::single_pass::{General, NONE, general, seen};
use crate::linalg::{SweepGradient, Term, power_of_two};
use crate::math::simd::Quad;
use crate::math::{Mat3, Vec3, ZERO_MATRIX, inverse, mat_add};
use crate::parallel::Par;

/// A contact that presses at the trial, or carries a multiplier.
#[derive(Clone, Copy, Debug)]
pub(super) struct Acting {
    /// The contact, in sweep order.
    pub contact: u32,
    /// `P(p - rho w)`, in its frame.
    pub trial: Vec3,
    /// World stiffness; `None` where the trial does not follow the velocity.
    pub stiffness: Option<Mat3>,
}

/// An acting contact, rounded.
#[derive(Clone, Copy, Debug, Default)]
struct Resisting {
    blocks: [u32; 4],
    weights: [f32; 4],
    /// Columns of its stiffness.
    stiffness: [Quad; 3],
    /// Position in `general`, or `NONE`.
    general: u32,
}

/// The acting contacts and the linear system; capacity is kept from step to step.
#[derive(Default)]
pub(super) struct NewtonSystem {
    /// In sweep order.
    pub acting: Vec<Acting>,
    /// World impulses of their trials `[N s]`.
    pub impulses: Vec<Vec3>,
    /// The acting contacts of each block.
    pub incidence: Incidence,
    resisting: Vec<Resisting>,
    general: Vec<General>,
    /// Diagonal blocks of `C^T E C`.
    diagonal: Vec<Mat3>,
    own_columns: Vec<[Quad; 3]>,
    forces: Vec<Quad>,
}

impl NewtonSystem {
    /// Takes the contacts of `self.acting`.
    pub fn index(&mut self, task: &Task) {
        let contacts = &task.packed.contacts;
        let of = |a: &Acting| &contacts[a.contact as usize];
        self.impulses.clear();
        self.impulses.extend(self.acting.iter().map(|a| of(a).in_world(a.trial)));
        let sources = self.acting.iter().map(|a| of(a).source as usize);
        self.incidence.rebuild(task.problem.rows, task.problem.inverse_diagonal.len(), sources);
    }

    /// `step := - (A + C^T E C)^-1 gradient` until the residual in the norm of the preconditioner has fallen to
    /// `tolerance`, at most `steps_max` steps; returns the steps made.
    pub fn solve(
        &mut self,
        task: &Task,
        sweep: &mut SweepGradient,
        gradient: &[Vec3],
        step: &mut [Vec3],
        (tolerance, steps_max): (f64, u32),
        work: &mut Work,
    ) -> u32 {
        let par = task.par;
        let mass = sweep.unit();
        let load = power_of_two(gradient.iter().flatten().fold(0.0f64, |a, g| a.max(g.abs())));
        self.round(task, sweep);
        sweep.forget();
        let mut rho = sweep.begin(|b| gradient[b].map(|g| -g), load, par);
        let target = tolerance * tolerance * rho;
        let (mut steps, mut beta) = (0, 0.0);
        while steps < steps_max && rho > target {
            let curvature = sweep.turn(beta, &mut Resistance { system: self }, par);
            if !(curvature > 0.0 && rho.is_finite()) {
                break;
            }
            steps += 1;
            let next = sweep.descend((rho / curvature) as f32, par);
            if next.is_nan() || next < 0.0 {
                break;
            }
            beta = (next / rho) as f32;
            rho = next;
        }
        work.blocks += u64::from(steps) * task.problem.matrix.values.len() as u64;
        work.contacts += u64::from(steps) * 2 * self.acting.len() as u64;
        par.map_into(step, |b| sweep.change(b).widen(load / mass));
        steps
    }

    /// Rounds contacts and diagonal, relative to the unit of mass.
    fn round(&mut self, task: &Task, sweep: &mut SweepGradient) {
        let (rows, packed, problem, mass) = (task.problem.rows, task.packed, task.problem, sweep.unit());
        self.general.clear();
        self.resisting.clear();
        for acting in &self.acting {
            let contact: &Contact = &packed.contacts[acting.contact as usize];
            let e = acting.stiffness.unwrap_or_default();
            let mut record = Resisting {
                blocks: contact.blocks.map(|b| sweep.position(b as usize)),
                weights: contact.weights.map(|w| w as f32),
                stiffness: columns(&e, 1.0 / mass),
                general: NONE,
            };
            if contact.general {
                record.general = self.general.len() as u32;
                self.general.push(general(rows, contact.source as usize, |b| sweep.position(b as usize)));
            }
            self.resisting.push(record);
        }
        self.forces.resize(self.resisting.len(), Quad::default());
        let (incidence, acting) = (&self.incidence, &self.acting);
        self.diagonal.resize(problem.inverse_diagonal.len(), ZERO_MATRIX);
        task.par.map_into(&mut self.diagonal, |b| {
            let mut sum = ZERO_MATRIX;
            if incidence.touches(b) {
                incidence.add_diagonal(b, &mut sum, |k| acting[k].stiffness);
            }
            sum
        });
        let diagonal = &self.diagonal;
        sweep.set_inverse(
            |b| {
                let source = problem.inverse_diagonal[b];
                if source == ZERO_MATRIX || diagonal[b] == ZERO_MATRIX {
                    return source;
                }
                inverse(&mat_add(problem.matrix.diagonal_block(b), &diagonal[b])).unwrap_or(ZERO_MATRIX)
            },
            task.par,
        );
        self.own_columns.resize(diagonal.len(), [Quad::default(); 3]);
        task.par.map_into(&mut self.own_columns, |b| columns(&diagonal[b], 1.0 / mass));
    }
}

/// `C^T E C` beside the matrix.
struct Resistance<'a> {
    system: &'a mut NewtonSystem,
}

impl Term for Resistance<'_> {
    fn apply(&mut self, direction: &[Quad], par: Par) {
        let NewtonSystem { resisting, general, forces, .. } = &mut *self.system;
        par.map_into(forces, |k| resisting[k].force(general, direction));
    }

    #[inline(always)]
    fn beside_diagonal(&self, row: usize, own: Quad) -> Quad {
        let NewtonSystem { incidence, forces, own_columns, .. } = &*self.system;
        if !incidence.touches(row) {
            return Quad::default();
        }
        incidence.gather_rounded(row, forces) - Quad::combine(&own_columns[row], own)
    }
}

impl Resisting {
    #[inline(always)]
    fn force(&self, general: &[General], v: &[Quad]) -> Quad {
        let simple = self.general == NONE;
        let u = if simple { seen(&self.blocks, &self.weights, v) } else { general[self.general as usize].seen(v) };
        Quad::combine(&self.stiffness, u)
    }
}

/// Columns of `s m`, rounded.
fn columns(m: &Mat3, s: f64) -> [Quad; 3] {
    [0, 1, 2].map(|c| Quad::round([m[0][c], m[1][c], m[2][c]], s))
}
