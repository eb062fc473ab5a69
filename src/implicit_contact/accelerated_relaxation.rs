//! Accelerated projected relaxation: anticipation made consistent (block Jacobi in the prediction and in the
//! correction), which makes an outer iteration a projected gradient step in a block-diagonal metric S >= A, and then
//! accelerated by momentum with restarts [Nesterov83; BeckTeboulle09; ODonoghueCandes15].
//!
//! An iteration: predict `u = z + S^-1 (C^T p - A z)`, relax the contacts against `u` (which keeps this equation true
//! while `p` changes), take `dv' = u`, extrapolate `z = dv' + beta (dv' - dv)`. One product with A per iteration: `A z`
//! follows by the same combination. `C^T p` is never formed: `C^T p = S (u - z) + A z` holds by construction.

use super::friction::LocalMetric;
use super::packed_contacts::PassContext;
use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work, contact_residuals, dynamics_residual};
use super::stop_test::{Ending, Run, Stagnation, StopTest, Verdict};
use crate::linalg::SinglePrecision;
use crate::math::{Mat3, Vec3, add, add_scaled, dot, mat_scale, mat_vec, scale, sub};
use crate::parallel::BLOCK;

/// First scale of S relative to the diagonal of A; grows where `e^T A e > e^T S e` is seen.
const FIRST_SCALE: f64 = 1.9;
/// Iterations between two residual checks, which also renew `A dv` in double precision; between them increments go
/// through single precision.
const CHECK_EVERY: u32 = 10;
/// Iterations without halving the residual after which an iteration makes more passes.
const STAGNATION: u32 = 50;
/// Passes per iteration, raised on stagnation.
const PASSES: [u32; 4] = [1, 3, 6, 12];
/// Of the passes, one in so many visits all contacts; the others those that are near or press.
const FULL_PASS_EVERY: u32 = 4;
/// Sums of one product sweep.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// `e^T A e`, `e = dv' - z`.
    curvature: f64,
    /// `e^T S e`
    metric: f64,
    /// `(z - dv')^T S (dv' - dv)`
    turn: f64,
}

/// State of one block between iterations.
#[derive(Clone, Copy)]
struct Node {
    dv: Vec3,
    a_dv: Vec3,
    z: Vec3,
    a_z: Vec3,
}

struct Relaxation<'a, 'b> {
    task: &'b Task<'a>,
    single: &'b SinglePrecision,
    /// Whether block row i has off-diagonal blocks; the others keep scale 1, where relaxation is exact.
    coupled: &'b [bool],
    metric_scale: f64,
    /// `S^-1` by block, and the contacts' local metrics for it.
    inverse: Vec<Mat3>,
    metrics: Vec<LocalMetric>,
    nodes: Vec<Node>,
    /// Prediction, then `dv'`.
    u: Vec<Vec3>,
    /// `A dv'`
    a_u: Vec<Vec3>,
    p: Vec<Vec3>,
    momentum: f64,
    near: Vec<u32>,
    work: Work,
}

/// Runs from `at` until the tolerances are met, `iterations_max`, or (with `hand_over`) the residual stagnates with the
/// most passes; leaves the best iterate.
pub(super) fn run(
    task: &Task,
    single: &SinglePrecision,
    coupled: &[bool],
    at: &mut Iterate,
    (iterations_max, hand_over): (u32, bool),
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> Run {
    let blocks = at.dv.len();
    let mut r = Relaxation {
        task,
        single,
        coupled,
        metric_scale: FIRST_SCALE,
        inverse: Vec::new(),
        metrics: Vec::new(),
        nodes: Vec::new(),
        u: vec![[0.0; 3]; blocks],
        a_u: vec![[0.0; 3]; blocks],
        p: Vec::new(),
        momentum: 1.0,
        near: Vec::new(),
        work: Work::default(),
    };
    r.set_scale(FIRST_SCALE);
    r.restart_from(at);
    let outcome = r.iterate(at, iterations_max, hand_over, buffers);
    work.blocks += r.work.blocks;
    work.contacts += r.work.contacts;
    outcome
}

impl Relaxation<'_, '_> {
    fn set_scale(&mut self, s: f64) {
        self.metric_scale = s;
        let (source, coupled, par) = (self.task.problem.inverse_diagonal, self.coupled, self.task.par);
        self.inverse.resize(source.len(), [[0.0; 3]; 3]);
        par.map_into(&mut self.inverse, |b| if coupled[b] { mat_scale(1.0 / s, &source[b]) } else { source[b] });
        self.metrics = self.task.packed.metrics(self.task.problem.rows, &self.inverse, par);
        self.work.contacts += self.metrics.len() as u64;
    }

    /// Takes `at` as `dv = z` and predicts from its own `C^T p`.
    fn restart_from(&mut self, at: &Iterate) {
        let Task { problem, packed, par, .. } = *self.task;
        self.p.clone_from(&at.p);
        self.nodes = par.map_indexed(at.dv.len(), |b| {
            let (dv, a_dv) = (at.dv[b], problem.matrix.row_product(b, &at.dv));
            Node { dv, a_dv, z: dv, a_z: a_dv }
        });
        let mut impulses = Vec::new();
        packed.impulses(&self.p, &mut impulses, par);
        let (nodes, inverse) = (&self.nodes, &self.inverse);
        par.map_into(&mut self.u, |b| {
            add(nodes[b].z, mat_vec(&inverse[b], sub(packed.gather(b, &impulses), nodes[b].a_z)))
        });
        self.momentum = 1.0;
        self.work.blocks += problem.matrix.values.len() as u64;
        self.work.contacts += self.p.len() as u64;
    }

    fn iterate(&mut self, at: &mut Iterate, iterations_max: u32, hand_over: bool, buffers: &mut MeasureBuffers) -> Run {
        let mut test = StopTest::new();
        let mut stagnation = Stagnation::new(STAGNATION);
        let mut level = 0;
        let mut k = 0;
        while k < iterations_max {
            self.passes(PASSES[level], k);
            k += 1;
            let check = k % CHECK_EVERY == 0 || k == iterations_max;
            let sums = self.product(check);
            if check {
                let residuals = self.residuals(buffers);
                let now = Iterate { dv: std::mem::take(&mut self.u), p: std::mem::take(&mut self.p) };
                let verdict = test.check(self.task, &now, &residuals, k, at, buffers, &mut self.work);
                (self.u, self.p) = (now.dv, now.p);
                match verdict {
                    Verdict::Converged => return Run { iterations: k, ending: Ending::Converged },
                    Verdict::Diverged => {
                        self.set_scale(1.5 * self.metric_scale);
                        self.restart_from(at);
                        continue;
                    }
                    Verdict::Continue => {}
                }
                if stagnation.seen(residuals.merit(), k) {
                    if level + 1 < PASSES.len() {
                        level += 1;
                    } else if hand_over {
                        return Run { iterations: k, ending: Ending::Stagnated };
                    }
                }
            }
            self.extrapolate(sums);
        }
        Run { iterations: k, ending: Ending::Exhausted }
    }

    /// Relaxes the contacts: all of them now and then, else those that press or are near.
    fn passes(&mut self, passes: u32, iteration: u32) {
        let Task { problem, packed, settings, par, .. } = *self.task;
        let cx = PassContext {
            rows: problem.rows,
            inverse: &self.inverse,
            metrics: &self.metrics,
            cone: settings.friction_cone,
            repeats: 1,
            par,
        };
        for pass in 0..passes {
            let full = pass == 0 && iteration % FULL_PASS_EVERY == 0;
            if full {
                self.work.contacts += packed.pass(&cx, None, &mut self.p, &mut self.u);
                self.near.clear();
                let p = &self.p;
                self.near.extend((0..p.len() as u32).filter(|c| p[*c as usize][0] > 0.0));
            } else {
                self.work.contacts += packed.pass(&cx, Some(&self.near), &mut self.p, &mut self.u);
            }
        }
    }

    /// `A dv'` and the sums that steer step and momentum; `exact` in double precision throughout.
    fn product(&mut self, exact: bool) -> Sums {
        let Task { problem, par, .. } = *self.task;
        let (matrix, single) = (problem.matrix, self.single);
        let (u, nodes) = (&self.u, &self.nodes);
        let (coupled, s) = (self.coupled, self.metric_scale);
        let increment = if exact { Default::default() } else { single.round(u.len(), |b| sub(u[b], nodes[b].dv), par) };
        let mut tasks: Vec<(usize, &mut [Vec3], Sums)> =
            self.a_u.chunks_mut(BLOCK).enumerate().map(|(i, c)| (i * BLOCK, c, Sums::default())).collect();
        par.for_each_task(&mut tasks, |(start, out, sums)| {
            for (i, y) in out.iter_mut().enumerate() {
                let b = *start + i;
                let node = &nodes[b];
                *y = if exact { matrix.row_product(b, u) } else { add(node.a_dv, single.row_product(b, &increment)) };
                let e = sub(u[b], node.z);
                let se = scale(if coupled[b] { s } else { 1.0 }, mat_vec(matrix.diagonal_block(b), e));
                sums.curvature += dot(e, sub(*y, node.a_z));
                sums.metric += dot(e, se);
                sums.turn -= dot(se, sub(u[b], node.dv));
            }
        });
        self.work.blocks += matrix.values.len() as u64;
        tasks.iter().fold(Sums::default(), |t, (_, _, s)| Sums {
            curvature: t.curvature + s.curvature,
            metric: t.metric + s.metric,
            turn: t.turn + s.turn,
        })
    }

    /// Residuals of `(dv', p)`; leaves `A dv'` and `C^T p` in the buffers for the error estimate.
    fn residuals(&mut self, buffers: &mut MeasureBuffers) -> Residuals {
        let Task { problem, par, .. } = *self.task;
        let mut residuals = contact_residuals(self.task, &self.u, &self.p);
        self.work.contacts += self.p.len() as u64;
        buffers.product.clone_from(&self.a_u);
        buffers.contact.resize(self.u.len(), [0.0; 3]);
        let (u, nodes, coupled, s) = (&self.u, &self.nodes, self.coupled, self.metric_scale);
        par.map_into(&mut buffers.contact, |b| {
            let s = if coupled[b] { s } else { 1.0 };
            add_scaled(nodes[b].a_z, s, mat_vec(problem.matrix.diagonal_block(b), sub(u[b], nodes[b].z)))
        });
        residuals.dynamics = dynamics_residual(self.task, &buffers.product, &buffers.contact);
        residuals
    }

    /// Momentum, restarts and step size; the next prediction.
    fn extrapolate(&mut self, sums: Sums) {
        let before = self.metric_scale;
        if sums.curvature > sums.metric * (1.0 + 1e-9) {
            self.set_scale((1.02 * before * sums.curvature / sums.metric).max(1.03 * before));
            self.momentum = 1.0;
        }
        if sums.turn > 0.0 {
            self.momentum = 1.0;
        }
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.momentum * self.momentum).sqrt());
        let beta = (self.momentum - 1.0) / next;
        self.momentum = next;
        let change = before / self.metric_scale;
        let (a_u, inverse, coupled) = (&self.a_u, &self.inverse, self.coupled);
        let chunks = self.nodes.chunks_mut(BLOCK).zip(self.u.chunks_mut(BLOCK));
        let mut tasks: Vec<(usize, &mut [Node], &mut [Vec3])> =
            chunks.enumerate().map(|(i, (nodes, u))| (i * BLOCK, nodes, u)).collect();
        self.task.par.for_each_task(&mut tasks, |(start, nodes, u)| {
            for (i, (node, u)) in nodes.iter_mut().zip(u.iter_mut()).enumerate() {
                let b = *start + i;
                let z = add_scaled(*u, beta, sub(*u, node.dv));
                let a_z = add_scaled(a_u[b], beta, sub(a_u[b], node.a_dv));
                let step = scale(if coupled[b] { change } else { 1.0 }, sub(*u, node.z));
                let response = mat_vec(&inverse[b], sub(node.a_z, a_z));
                *node = Node { dv: *u, a_dv: a_u[b], z, a_z };
                *u = add(z, add(step, response));
            }
        });
    }
}
