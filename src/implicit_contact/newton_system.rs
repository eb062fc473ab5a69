//! A Newton step of the augmented Lagrangian: the contacts that act in it, and its linear system `(A + C^T E C) x = b`
//! by preconditioned conjugate gradients [Hestenes52] in single precision. Steps are wanted to a digit.

use super::incidence::Incidence;
use super::packed_contacts::Contact;
use super::residuals::{Task, Work};
use super::single_pass::{GeneralRows, NONE, seen};
use crate::linalg::power_of_two;
use crate::math::simd::Quad;
use crate::math::{Mat3, Vec3, inverse, mat_add};
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

/// What conjugate gradients keep of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    x: Quad,
    residual: Quad,
    preconditioned: Quad,
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
    general: GeneralRows,
    /// Columns of the inverse diagonal blocks of the system.
    preconditioner: Vec<[Quad; 3]>,
    nodes: Vec<Node>,
    direction: Vec<Quad>,
    image: Vec<Quad>,
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
        gradient: &[Vec3],
        step: &mut [Vec3],
        (tolerance, steps_max): (f64, u32),
        work: &mut Work,
    ) -> u32 {
        let par = task.par;
        let mass = task.single.unit();
        let largest = gradient.iter().flatten().fold(0.0f64, |a, g| a.max(g.abs()));
        let load = power_of_two(largest);
        self.round(task, mass);
        self.nodes.resize(gradient.len(), Node::default());
        self.direction.resize(gradient.len(), Quad::default());
        self.image.resize(gradient.len(), Quad::default());
        let preconditioner = &self.preconditioner[..];
        let mut rho = par.update_and_sum(&mut self.nodes, |start, part| {
            let mut sum = Quad::default();
            for (i, node) in part.iter_mut().enumerate() {
                let residual = Quad::round(gradient[start + i], -1.0 / load);
                let preconditioned = Quad::combine(&preconditioner[start + i], residual);
                *node = Node { x: Quad::default(), residual, preconditioned };
                sum = sum + residual * preconditioned;
            }
            sum.total()
        });
        let nodes = &self.nodes;
        par.map_into(&mut self.direction, |b| nodes[b].preconditioned);
        let target = tolerance * tolerance * rho;
        let mut steps = 0;
        while steps < steps_max && rho > target {
            let curvature = self.apply(task);
            if !(curvature > 0.0 && rho.is_finite()) {
                break;
            }
            steps += 1;
            let next = self.advance(par, (rho / curvature) as f32);
            if next.is_nan() || next < 0.0 {
                break;
            }
            let beta = (next / rho) as f32;
            rho = next;
            let nodes = &self.nodes;
            par.for_each_block(&mut self.direction, |start, part| {
                for (i, d) in part.iter_mut().enumerate() {
                    *d = nodes[start + i].preconditioned.add_scaled(beta, *d);
                }
            });
        }
        work.blocks += u64::from(steps) * task.problem.matrix.values.len() as u64;
        work.contacts += u64::from(steps) * 2 * self.acting.len() as u64;
        let nodes = &self.nodes;
        par.map_into(step, |b| nodes[b].x.widen(load / mass));
        steps
    }

    /// Rounds contacts and preconditioner, relative to `mass`.
    fn round(&mut self, task: &Task, mass: f64) {
        let (rows, packed) = (task.problem.rows, task.packed);
        self.general.clear();
        self.resisting.clear();
        for acting in &self.acting {
            let contact: &Contact = &packed.contacts[acting.contact as usize];
            let e = acting.stiffness.unwrap_or_default();
            let mut record = Resisting {
                blocks: contact.blocks,
                weights: contact.weights.map(|w| w as f32),
                stiffness: columns(&e, 1.0 / mass),
                general: NONE,
            };
            if contact.general {
                record.general = self.general.push(rows, contact.source as usize);
            }
            self.resisting.push(record);
        }
        self.forces.resize(self.resisting.len(), Quad::default());
        let (incidence, acting, problem) = (&self.incidence, &self.acting, task.problem);
        self.preconditioner.resize(problem.inverse_diagonal.len(), [Quad::default(); 3]);
        task.par.map_into(&mut self.preconditioner, |b| {
            let source = &problem.inverse_diagonal[b];
            if *source == [[0.0; 3]; 3] || !incidence.touches(b) {
                return columns(source, mass);
            }
            let mut sum = [[0.0; 3]; 3];
            incidence.add_diagonal(b, &mut sum, |k| acting[k].stiffness);
            let inverse = inverse(&mat_add(problem.matrix.diagonal_block(b), &sum));
            columns(&inverse.unwrap_or(*source), mass)
        });
    }

    /// `image := (A + C^T E C) direction`; returns `direction . image`.
    fn apply(&mut self, task: &Task) -> f64 {
        let (resisting, general, direction) = (&self.resisting[..], &self.general, &self.direction[..]);
        task.par.map_into(&mut self.forces, |k| resisting[k].force(general, direction));
        let (incidence, forces, single) = (&self.incidence, &self.forces[..], task.single);
        task.par.update_and_sum(&mut self.image, |start, part| {
            let mut sum = Quad::default();
            for (i, y) in part.iter_mut().enumerate() {
                let b = start + i;
                *y = single.rounded_row_product(b, direction) + incidence.gather_rounded(b, forces);
                sum = sum + direction[b] * *y;
            }
            sum.total()
        })
    }

    /// Moves by `alpha` along the direction; returns the new squared residual.
    fn advance(&mut self, par: Par, alpha: f32) -> f64 {
        let (direction, image, preconditioner) = (&self.direction[..], &self.image[..], &self.preconditioner[..]);
        par.update_and_sum(&mut self.nodes, |start, part| {
            let mut sum = Quad::default();
            for (i, node) in part.iter_mut().enumerate() {
                let b = start + i;
                node.x = node.x.add_scaled(alpha, direction[b]);
                node.residual = node.residual.add_scaled(-alpha, image[b]);
                node.preconditioned = Quad::combine(&preconditioner[b], node.residual);
                sum = sum + node.residual * node.preconditioned;
            }
            sum.total()
        })
    }
}

impl Resisting {
    #[inline(always)]
    fn force(&self, general: &GeneralRows, v: &[Quad]) -> Quad {
        let simple = self.general == NONE;
        let u = if simple { seen(&self.blocks, &self.weights, v) } else { general.seen(self.general, v) };
        Quad::combine(&self.stiffness, u)
    }
}

/// Columns of `s m`, rounded.
fn columns(m: &Mat3, s: f64) -> [Quad; 3] {
    [0, 1, 2].map(|c| Quad::round([m[0][c], m[1][c], m[2][c]], s))
}
