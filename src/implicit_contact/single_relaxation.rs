//! Iterations of accelerated relaxation in single precision, on increments from a base that is renewed in double
//! precision: rounding is relative to what still changes, so it does not limit what is reached.

use super::accelerated_relaxation::{Momentum, Sums};
use super::residuals::{
    Iterate, MeasureBuffers, Residuals, Task, Work, contact_residuals, dynamics_residual, near_residuals,
};
use super::single_pass::SinglePass;
use super::translation_level::TranslationLevel;
use crate::linalg::SinglePrecision;
use crate::math::simd::{Kernel, Quad, run_wide};
use crate::math::{self, Vec3, mat_scale};
use crate::parallel::BLOCK;

/// All contacts are screened before every iteration below the first number, then before one in so many.
const SCREEN: (u32, u32) = (3, 5);

/// State of one block between iterations, increments from the base.
#[derive(Clone, Copy, Default)]
struct Node {
    dv: Quad,
    a_dv: Quad,
    z: Quad,
    a_z: Quad,
}

/// The state between two measurements; capacity is kept from run to run.
#[derive(Default)]
pub(super) struct SingleRelaxation {
    contacts: SinglePass,
    /// Scale of the metric by block: that of S where the block is coupled, else 1.
    block_scale: Vec<f32>,
    /// What increments are relative to; the same rounded.
    base: Vec<Vec3>,
    base_rounded: Vec<Quad>,
    nodes: Vec<Node>,
    /// Prediction, then `dv'`.
    u: Vec<Quad>,
    /// `A dv'`
    a_u: Vec<Quad>,
    /// Velocities that contacts are screened by.
    velocities: Vec<Quad>,
    /// `C^T p` of the start, and `C^T p - A base`.
    forces: Vec<Vec3>,
    gradient: Vec<Quad>,
    momentum: Momentum,
    iteration: u32,
    work: Work,
}

impl SingleRelaxation {
    /// Starts from `at` with this scale of the metric, with or without its second level.
    pub fn start(&mut self, task: &Task, at: &Iterate, metric_scale: f64, level: bool) {
        let blocks = at.dv.len();
        self.contacts.assign(task, level);
        self.base.clone_from(&at.dv);
        self.nodes.clear();
        self.nodes.resize(blocks, Node::default());
        for buffer in [&mut self.u, &mut self.a_u] {
            buffer.clear();
            buffer.resize(blocks, Quad::default());
        }
        self.momentum = Momentum::new(metric_scale);
        (self.iteration, self.work) = (0, Work::default());
        self.set_scale(task);
        self.contacts.start(task, &at.p, &at.dv);
        self.forces.clear();
        self.forces.resize(blocks, [0.0; 3]);
        task.packed.scatter(task.problem.rows, self.contacts.near(), &at.p, &mut self.forces);
        self.renew_base();
        self.screen(task);
        self.contacts.weigh(task);
        let unit = 1.0 / (task.single.unit() * self.contacts.velocity_unit());
        let product = |b: usize| task.problem.matrix.row_product(b, &at.dv);
        let forces = &self.forces;
        let gradient = |b: usize| Quad::round(math::sub(forces[b], product(b)), unit);
        task.par.map_indexed_into(&mut self.gradient, blocks, gradient);
        self.extrapolate(task, (0.0, 1.0), true);
        self.work.blocks += task.problem.matrix.values.len() as u64;
    }

    fn set_scale(&mut self, task: &Task) {
        let (source, momentum) = (task.problem.inverse_diagonal, &self.momentum);
        let block_scale = |b: usize| momentum.block_scale(task.coupled[b]);
        self.contacts.set_metric(task, |b| mat_scale(1.0 / block_scale(b), &source[b]));
        self.block_scale.clear();
        self.block_scale.extend((0..source.len()).map(|b| block_scale(b) as f32));
    }

    fn renew_base(&mut self) {
        let unit = 1.0 / self.contacts.velocity_unit();
        self.base_rounded.clear();
        self.base_rounded.extend(self.base.iter().map(|v| Quad::round(*v, unit)));
    }

    /// Makes iterations, the last one without extrapolation.
    pub fn advance(&mut self, task: &Task, iterations: u32, passes: u32) {
        for i in 1..=iterations {
            if self.iteration < SCREEN.0 || self.iteration.is_multiple_of(SCREEN.1) {
                self.screen(task);
            }
            for _ in 0..passes {
                self.work.contacts += self.contacts.pass(task.settings.friction_cone, &mut self.u);
            }
            self.contacts.level_mut().settle(&mut self.u);
            let sums = self.product(task);
            if self.momentum.observe(sums) {
                self.set_scale(task);
            }
            self.iteration += 1;
            if i < iterations {
                let step = self.momentum.next();
                self.extrapolate(task, step, false);
            }
        }
    }

    fn screen(&mut self, task: &Task) {
        let (base, u) = (&self.base_rounded, &self.u);
        self.velocities.resize(u.len(), Quad::default());
        task.par.map_into(&mut self.velocities, |b| base[b] + u[b]);
        self.work.contacts += self.contacts.screen(task, &self.velocities, &self.base);
    }

    /// `A dv'` and the sums that steer step and momentum.
    fn product(&mut self, task: &Task) -> Sums {
        let (matrix, level) = (task.single, self.contacts.level());
        let (u, nodes, block_scale) = (&self.u[..], &self.nodes[..], &self.block_scale[..]);
        let mut total = Sums::default();
        task.par.fold_tasks(
            self.a_u.chunks_mut(BLOCK).enumerate(),
            |(i, out)| run_wide(Product { matrix, u, nodes, block_scale, level, start: i * BLOCK, out }),
            |sums| total = total.plus(&sums),
        );
        self.contacts.level_mut().observe(&self.a_u);
        self.work.blocks += task.problem.matrix.values.len() as u64;
        total
    }

    /// Puts the iterate into `now`, `A dv'` and `C^T p` into the buffers; returns the residuals. Contacts that are not
    /// near only count once the others have passed.
    pub fn measure(&mut self, task: &Task, now: &mut Iterate, buffers: &mut MeasureBuffers) -> Residuals {
        let Task { problem, packed, settings, par, .. } = *task;
        let unit = self.contacts.velocity_unit();
        let (base, u) = (&self.base, &self.u);
        now.dv.resize(u.len(), [0.0; 3]);
        par.map_into(&mut now.dv, |b| math::add(base[b], u[b].widen(unit)));
        now.p.clear();
        now.p.resize(packed.contacts.len(), [0.0; 3]);
        self.contacts.multipliers(task, &mut now.p);
        let (dv, list) = (&now.dv, self.contacts.near());
        buffers.product.resize(dv.len(), [0.0; 3]);
        problem.matrix.product(dv, &mut buffers.product, par);
        buffers.contact.clear();
        buffers.contact.resize(dv.len(), [0.0; 3]);
        packed.scatter(problem.rows, self.contacts.near(), &now.p, &mut buffers.contact);
        let mut residuals = near_residuals(task, list, dv, &now.p);
        self.work.contacts += self.contacts.near().len() as u64;
        self.work.blocks += problem.matrix.values.len() as u64;
        residuals.dynamics = dynamics_residual(task, &buffers.product, &buffers.contact);
        if residuals.contact() <= settings.contact_tolerance {
            residuals = Residuals { dynamics: residuals.dynamics, ..contact_residuals(task, dv, &now.p) };
            self.work.contacts += now.p.len() as u64;
        }
        residuals
    }

    /// Continues from what was just measured: the base moves there, and the prediction follows from the exact residual.
    pub fn renew(&mut self, task: &Task, measured: &Iterate, buffers: &MeasureBuffers) {
        self.base.clone_from(&measured.dv);
        self.renew_base();
        self.contacts.renew(task, &self.base);
        for ((node, u), a_u) in self.nodes.iter_mut().zip(&mut self.u).zip(&mut self.a_u) {
            *node = Node { dv: node.dv - *u, a_dv: node.a_dv - *a_u, z: node.z - *u, a_z: node.a_z - *a_u };
            (*u, *a_u) = Default::default();
        }
        self.contacts.level_mut().renew();
        self.contacts.weigh(task);
        let unit = 1.0 / (task.single.unit() * self.contacts.velocity_unit());
        let gradient = |b: usize| Quad::round(math::sub(buffers.contact[b], buffers.product[b]), unit);
        task.par.map_indexed_into(&mut self.gradient, self.u.len(), gradient);
        let step = self.momentum.next();
        self.extrapolate(task, step, true);
    }

    /// The next prediction: from `self.gradient` where that was `renewed`; else it follows from the prediction that was
    /// relaxed.
    fn extrapolate(&mut self, task: &Task, (beta, change): (f64, f64), renewed: bool) {
        let gradient = renewed.then_some(&self.gradient[..]);
        let (beta, change) = (beta as f32, change as f32);
        self.contacts.level_mut().predict(beta, gradient);
        let (a_u, inverse, level) = (&self.a_u[..], self.contacts.inverse(), self.contacts.level());
        let coupled = task.coupled;
        let chunks = self.nodes.chunks_mut(BLOCK).zip(self.u.chunks_mut(BLOCK));
        let block = |(i, (nodes, u)): (usize, (&mut [Node], &mut [Quad]))| {
            run_wide(Extrapolate { nodes, u, a_u, inverse, level, gradient, coupled, beta, change, start: i * BLOCK });
        };
        task.par.fold_tasks(chunks.enumerate(), block, |()| {});
    }

    /// Work so far.
    pub fn work(&self) -> Work {
        self.work
    }

    /// Contacts that a pass relaxes.
    pub fn relaxed(&self) -> usize {
        self.contacts.near().len()
    }

    /// Scale of the metric reached.
    pub fn metric_scale(&self) -> f64 {
        self.momentum.metric_scale
    }
}

struct Product<'a> {
    matrix: &'a SinglePrecision,
    u: &'a [Quad],
    nodes: &'a [Node],
    block_scale: &'a [f32],
    level: &'a TranslationLevel,
    start: usize,
    out: &'a mut [Quad],
}

impl Kernel for Product<'_> {
    type Output = Sums;
    #[inline(always)]
    fn run(self) -> Sums {
        let (mut curvature, mut metric, mut turn) = (Quad::default(), Quad::default(), Quad::default());
        for (i, y) in self.out.iter_mut().enumerate() {
            let b = self.start + i;
            let (node, u) = (&self.nodes[b], self.u[b]);
            *y = self.matrix.rounded_row_product(b, self.u);
            let e = u - node.z;
            // The metric of both levels maps the step to what S maps its share of the first level to.
            let own = e - self.level.shift(b);
            let se = self.matrix.diagonal_product(b, own).scaled(self.block_scale[b]);
            curvature = curvature + e * (*y - node.a_z);
            metric = metric + e * se;
            turn = turn - se * (u - node.dv);
        }
        Sums { curvature: curvature.total(), metric: metric.total(), turn: turn.total() }
    }
}

struct Extrapolate<'a> {
    nodes: &'a mut [Node],
    u: &'a mut [Quad],
    a_u: &'a [Quad],
    inverse: &'a [[Quad; 3]],
    level: &'a TranslationLevel,
    gradient: Option<&'a [Quad]>,
    coupled: &'a [bool],
    beta: f32,
    change: f32,
    start: usize,
}

impl Kernel for Extrapolate<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (i, (node, u)) in self.nodes.iter_mut().zip(self.u.iter_mut()).enumerate() {
            let b = self.start + i;
            let a_u = self.a_u[b];
            let z = u.add_scaled(self.beta, *u - node.dv);
            let a_z = a_u.add_scaled(self.beta, a_u - node.a_dv);
            let response = match self.gradient {
                Some(q) => Quad::combine(&self.inverse[b], q[b] - a_z),
                None => {
                    let step =
                        (*u - node.z - self.level.before(b)).scaled(if self.coupled[b] { self.change } else { 1.0 });
                    step + Quad::combine(&self.inverse[b], node.a_z - a_z)
                }
            };
            *node = Node { dv: *u, a_dv: a_u, z, a_z };
            *u = z + response + self.level.shift(b);
        }
    }
}
