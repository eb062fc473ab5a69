//! Iterations of accelerated relaxation in double precision, for tolerances that rounding would reach.
//!
//! `C^T p` is never formed between two measurements: `C^T p = S (u - z) + A z` holds by construction.

use super::accelerated_relaxation::{Momentum, Sums};
use super::friction::LocalMetric;
use super::packed_contacts::PassContext;
use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work, measure};
use crate::math::{Mat3, Vec3, add, add_scaled, dot, mat_scale, mat_vec, scale, sub};
use crate::parallel::BLOCK;

/// Of the passes, one in so many visits all contacts; the others those that press.
const FULL_PASS_EVERY: u32 = 4;

/// State of one block between iterations.
#[derive(Clone, Copy)]
struct Node {
    dv: Vec3,
    a_dv: Vec3,
    z: Vec3,
    a_z: Vec3,
}

/// The state between two measurements; capacity is kept from run to run.
#[derive(Default)]
pub(super) struct DoubleRelaxation {
    momentum: Momentum,
    /// `S^-1` by block, and the contacts' local metrics for it.
    inverse: Vec<Mat3>,
    metrics: Vec<LocalMetric>,
    nodes: Vec<Node>,
    /// Prediction, then `dv'`.
    u: Vec<Vec3>,
    /// `A dv'`
    a_u: Vec<Vec3>,
    p: Vec<Vec3>,
    /// World impulses of the start.
    impulses: Vec<Vec3>,
    pressing: Vec<u32>,
    iteration: u32,
    work: Work,
}

impl DoubleRelaxation {
    /// Starts from `at` with this scale of the metric: predicts from its own `C^T p`.
    pub fn start(&mut self, task: &Task, at: &Iterate, metric_scale: f64) {
        let Task { problem, packed, par, .. } = *task;
        let blocks = at.dv.len();
        par.map_indexed_into(&mut self.nodes, blocks, |b| {
            let (dv, a_dv) = (at.dv[b], problem.matrix.row_product(b, &at.dv));
            Node { dv, a_dv, z: dv, a_z: a_dv }
        });
        self.momentum = Momentum::new(metric_scale);
        self.a_u.clear();
        self.a_u.resize(blocks, [0.0; 3]);
        self.p.clone_from(&at.p);
        self.pressing.clear();
        self.iteration = 0;
        self.work = Work { blocks: problem.matrix.values.len() as u64, contacts: at.p.len() as u64 };
        self.set_scale(task);
        packed.impulses(&self.p, &mut self.impulses, par);
        let (nodes, inverse, impulses) = (&self.nodes, &self.inverse, &self.impulses);
        par.map_indexed_into(&mut self.u, blocks, |b| {
            add(nodes[b].z, mat_vec(&inverse[b], sub(packed.incidence.gather(b, impulses), nodes[b].a_z)))
        });
    }

    fn set_scale(&mut self, task: &Task) {
        let Task { problem, packed, par, .. } = *task;
        let (source, momentum) = (problem.inverse_diagonal, &self.momentum);
        let scaled = |b: usize| mat_scale(1.0 / momentum.block_scale(task.coupled[b]), &source[b]);
        par.map_indexed_into(&mut self.inverse, source.len(), scaled);
        packed.metrics(problem.rows, &self.inverse, &mut self.metrics, par);
        self.work.contacts += self.metrics.len() as u64;
    }

    /// Makes iterations, the last one without extrapolation.
    pub fn advance(&mut self, task: &Task, iterations: u32, passes: u32) {
        for i in 1..=iterations {
            self.relax(task, passes);
            let sums = self.product(task);
            if self.momentum.observe(sums) {
                self.set_scale(task);
            }
            self.iteration += 1;
            if i < iterations {
                self.extrapolate(task, None);
            }
        }
    }

    /// Relaxes the contacts: all of them now and then, else those that press.
    fn relax(&mut self, task: &Task, passes: u32) {
        let Task { problem, packed, settings, par, .. } = *task;
        let (inverse, metrics) = (self.inverse.as_slice(), self.metrics.as_slice());
        let cx = PassContext { rows: problem.rows, inverse, metrics, cone: settings.friction_cone, repeats: 1, par };
        for pass in 0..passes {
            let full = pass == 0 && self.iteration.is_multiple_of(FULL_PASS_EVERY);
            let list = if full { None } else { Some(self.pressing.as_slice()) };
            self.work.contacts += packed.pass(&cx, list, &mut self.p, &mut self.u);
            if full {
                let p = &self.p;
                self.pressing.clear();
                self.pressing.extend((0..p.len() as u32).filter(|c| p[*c as usize][0] > 0.0));
            }
        }
    }

    /// `A dv'` and the sums that steer step and momentum.
    fn product(&mut self, task: &Task) -> Sums {
        let Task { problem, coupled, par, .. } = *task;
        let matrix = problem.matrix;
        let (u, nodes, momentum) = (&self.u, &self.nodes, &self.momentum);
        let block = |(block, out): (usize, &mut [Vec3])| {
            let mut sums = Sums::default();
            for (i, y) in out.iter_mut().enumerate() {
                let b = block * BLOCK + i;
                let node = &nodes[b];
                *y = matrix.row_product(b, u);
                let e = sub(u[b], node.z);
                let se = scale(momentum.block_scale(coupled[b]), mat_vec(matrix.diagonal_block(b), e));
                sums.curvature += dot(e, sub(*y, node.a_z));
                sums.metric += dot(e, se);
                sums.turn -= dot(se, sub(u[b], node.dv));
            }
            sums
        };
        let mut total = Sums::default();
        par.fold_tasks(self.a_u.chunks_mut(BLOCK).enumerate(), block, |sums| total = total.plus(&sums));
        self.work.blocks += matrix.values.len() as u64;
        total
    }

    /// Puts the iterate into `now`, `A dv'` and `C^T p` into the buffers; returns the residuals.
    pub fn measure(&mut self, task: &Task, now: &mut Iterate, buffers: &mut MeasureBuffers) -> Residuals {
        now.dv.clone_from(&self.u);
        now.p.clone_from(&self.p);
        measure(task, now, buffers, &mut self.work)
    }

    /// Continues from what was just measured.
    pub fn renew(&mut self, task: &Task, buffers: &MeasureBuffers) {
        self.extrapolate(task, Some(&buffers.contact));
    }

    /// The next prediction. `contact` is `C^T p` where that is known; else it follows from the prediction that was relaxed.
    fn extrapolate(&mut self, task: &Task, contact: Option<&[Vec3]>) {
        let (beta, change) = self.momentum.next();
        let (a_u, inverse, coupled) = (&self.a_u, &self.inverse, task.coupled);
        let chunks = self.nodes.chunks_mut(BLOCK).zip(self.u.chunks_mut(BLOCK));
        let block = |(block, (nodes, u)): (usize, (&mut [Node], &mut [Vec3]))| {
            for (i, (node, u)) in nodes.iter_mut().zip(u.iter_mut()).enumerate() {
                let b = block * BLOCK + i;
                let z = add_scaled(*u, beta, sub(*u, node.dv));
                let a_z = add_scaled(a_u[b], beta, sub(a_u[b], node.a_dv));
                let response = match contact {
                    Some(q) => mat_vec(&inverse[b], sub(q[b], a_z)),
                    None => {
                        let step = scale(if coupled[b] { change } else { 1.0 }, sub(*u, node.z));
                        add(step, mat_vec(&inverse[b], sub(node.a_z, a_z)))
                    }
                };
                *node = Node { dv: *u, a_dv: a_u[b], z, a_z };
                *u = add(z, response);
            }
        };
        task.par.fold_tasks(chunks.enumerate(), block, |()| {});
    }

    /// Contacts that most passes relax.
    pub fn relaxed(&self) -> usize {
        self.pressing.len()
    }

    /// Scale of the metric reached.
    pub fn metric_scale(&self) -> f64 {
        self.momentum.metric_scale
    }

    /// Work so far.
    pub fn work(&self) -> Work {
        self.work
    }
}
