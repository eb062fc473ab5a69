//! Accelerated projected relaxation: anticipation made consistent (block Jacobi in the prediction and in the
//! correction), which makes an outer iteration a projected gradient step in a block-diagonal metric S >= A, and then
//! accelerated by momentum with restarts [Beck09; ODonoghue15].
//!
//! An iteration: predict `u = z + S^-1 (C^T p - A z)`, relax the contacts against `u` (which keeps this equation true
//! while `p` changes), take `dv' = u`, extrapolate `z = dv' + beta (dv' - dv)`. One product with A per iteration: `A z`
//! follows by the same combination. `C^T p` is never formed: `C^T p = S (u - z) + A z` holds by construction.

use super::friction::LocalMetric;
use super::packed_contacts::PassContext;
use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work, contact_residuals, dynamics_residual};
use super::single_pass::{Lanes, SinglePass};
use super::stop_test::{Ending, Run, Stagnation, StopTest, Verdict};
use crate::math::{Mat3, Vec3, add, add_scaled, dot, mat_scale, mat_vec, scale, sub};
use crate::parallel::BLOCK;

/// First scale of S relative to the diagonal of A; grows where `e^T A e > e^T S e` is seen.
const FIRST_SCALE: f64 = 1.9;
/// Iterations between two residual checks, which also renew `A dv` in double precision; between them increments go
/// through single precision.
const CHECK_EVERY: u32 = 10;
/// Iterations without halving the contact residual after which an iteration makes more passes. Where only the dynamics
/// lag behind, passes would not help.
const PASSES_STAGNATION: u32 = 50;
/// Passes per iteration, raised on stagnation.
const PASSES: [u32; 4] = [1, 3, 6, 12];
/// Smallest tolerance for which passes run in single precision.
const SINGLE_FROM: f64 = 1e-5;
/// Of the passes, one in so many visits all contacts; the others those that are near or press.
const FULL_PASS_EVERY: u32 = 4;
/// Residuals above which stagnation ends the run. Below, a slow relaxation is still faster than the augmented Lagrangian,
/// whose multipliers converge linearly.
const HAND_OVER_ABOVE: f64 = 1e-3;

/// How long a run may go on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    /// Iterations at most.
    pub iterations_max: u32,
    /// Iterations without halving the residuals together after which the run ends as stagnated.
    pub patience: u32,
    /// Whether iterations make the most passes from the first on.
    pub thorough: bool,
}

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
    /// Whether passes run in single precision, on these.
    rounded: bool,
    single_pass: SinglePass,
    p_single: Vec<Lanes>,
    u_single: Vec<Lanes>,
    momentum: f64,
    near: Vec<u32>,
    work: Work,
}

/// Runs from `at` until the tolerances are met or `control` ends it; leaves the best iterate.
pub(super) fn run(
    task: &Task,
    coupled: &[bool],
    at: &mut Iterate,
    control: Control,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> Run {
    let blocks = at.dv.len();
    let tolerance = task.settings.contact_tolerance.min(task.settings.velocity_tolerance);
    let rounded = tolerance >= SINGLE_FROM;
    let single_pass = if rounded {
        SinglePass::new(task.packed, task.problem.rows, task.typical_mass, task.velocity_scale)
    } else {
        SinglePass::default()
    };
    let mut r = Relaxation {
        task,
        coupled,
        metric_scale: FIRST_SCALE,
        inverse: Vec::new(),
        metrics: Vec::new(),
        nodes: Vec::new(),
        u: vec![[0.0; 3]; blocks],
        a_u: vec![[0.0; 3]; blocks],
        p: Vec::new(),
        rounded,
        single_pass,
        p_single: Vec::new(),
        u_single: Vec::new(),
        momentum: 1.0,
        near: Vec::new(),
        work: Work::default(),
    };
    r.set_scale(FIRST_SCALE);
    r.restart_from(at);
    let outcome = r.iterate(at, control, buffers);
    work.blocks += r.work.blocks;
    work.contacts += r.work.contacts;
    outcome
}

impl Relaxation<'_, '_> {
    fn set_scale(&mut self, s: f64) {
        let before = std::mem::replace(&mut self.metric_scale, s);
        let (source, coupled, par) = (self.task.problem.inverse_diagonal, self.coupled, self.task.par);
        self.inverse.resize(source.len(), [[0.0; 3]; 3]);
        par.map_into(&mut self.inverse, |b| if coupled[b] { mat_scale(1.0 / s, &source[b]) } else { source[b] });
        let packed = self.task.packed;
        let uniform = !(0..self.coupled.len()).any(|b| !self.coupled[b] && packed.touches(b));
        if uniform && !self.metrics.is_empty() {
            let r = before / s;
            self.metrics.iter_mut().for_each(|m| *m = m.scaled(r));
        } else {
            self.metrics = packed.metrics(self.task.problem.rows, &self.inverse, par);
        }
        if self.rounded {
            self.single_pass.set_metric(&self.inverse, &self.metrics, par);
        }
        self.work.contacts += self.metrics.len() as u64;
    }

    /// Takes `at` as `dv = z` and predicts from its own `C^T p`.
    fn restart_from(&mut self, at: &Iterate) {
        let Task { problem, packed, par, .. } = *self.task;
        self.p.clone_from(&at.p);
        if self.rounded {
            self.p_single = self.single_pass.round_multipliers(&at.p);
        }
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

    fn iterate(&mut self, at: &mut Iterate, control: Control, buffers: &mut MeasureBuffers) -> Run {
        let mut test = StopTest::new();
        let mut passes_stagnation = Stagnation::new(PASSES_STAGNATION);
        let mut stagnation = Stagnation::new(control.patience);
        let iterations_max = control.iterations_max;
        let mut level = if control.thorough { PASSES.len() - 1 } else { 0 };
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
                    Verdict::Converged(e) => return Run { iterations: k, ending: Ending::Converged, error: Some(e) },
                    Verdict::Diverged => {
                        self.rounded = false;
                        self.set_scale(1.5 * self.metric_scale);
                        self.restart_from(at);
                        continue;
                    }
                    Verdict::Continue => {}
                }
                if residuals.contact() > self.task.settings.contact_tolerance
                    && passes_stagnation.seen(residuals.contact(), k)
                    && level + 1 < PASSES.len()
                {
                    level += 1;
                }
                if stagnation.seen(residuals.merit(), k) {
                    if self.rounded {
                        // What is left may be rounding.
                        self.rounded = false;
                    } else if residuals.merit() > HAND_OVER_ABOVE {
                        return Run { iterations: k, ending: Ending::Stagnated, error: None };
                    }
                }
            }
            self.extrapolate(sums, check.then_some(buffers.contact.as_slice()));
        }
        Run { iterations: k, ending: Ending::Exhausted, error: None }
    }

    /// Relaxes the contacts: all of them now and then, else those that press.
    fn passes(&mut self, passes: u32, iteration: u32) {
        let Task { problem, packed, settings, par, .. } = *self.task;
        let cone = settings.friction_cone;
        if self.rounded {
            self.single_pass.round_velocities(&self.u, &mut self.u_single, par);
        }
        for pass in 0..passes {
            let full = pass == 0 && iteration.is_multiple_of(FULL_PASS_EVERY);
            let list = if full { None } else { Some(self.near.as_slice()) };
            self.work.contacts += if self.rounded {
                self.single_pass.pass(cone, list, &mut self.p_single, &mut self.u_single)
            } else {
                let (inverse, metrics) = (self.inverse.as_slice(), self.metrics.as_slice());
                let cx = PassContext { rows: problem.rows, inverse, metrics, cone, repeats: 1, par };
                packed.pass(&cx, list, &mut self.p, &mut self.u)
            };
            if full {
                self.near.clear();
                let (p, p_single, rounded) = (&self.p, &self.p_single, self.rounded);
                let presses = |c: usize| if rounded { p_single[c][0] > 0.0 } else { p[c][0] > 0.0 };
                self.near.extend((0..packed.contacts.len() as u32).filter(|c| presses(*c as usize)));
            }
        }
        if self.rounded {
            // The change in f32 is added to the prediction in f64.
            let (pass, after) = (&self.single_pass, &self.u_single);
            par.for_each_block(&mut self.u, |start, part| {
                for (i, u) in part.iter_mut().enumerate() {
                    *u = pass.add_change(*u, after[start + i]);
                }
            });
        }
    }

    /// `A dv'` and the sums that steer step and momentum; `exact` in double precision throughout.
    fn product(&mut self, exact: bool) -> Sums {
        let Task { problem, single, par, .. } = *self.task;
        let matrix = problem.matrix;
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
        let Task { packed, settings, par, .. } = *self.task;
        if self.rounded {
            self.single_pass.multipliers(packed, settings.friction_cone, &self.p_single, &mut self.p);
        }
        let mut residuals = contact_residuals(self.task, &self.u, &self.p);
        self.work.contacts += 2 * self.p.len() as u64;
        buffers.product.clone_from(&self.a_u);
        buffers.contact.resize(self.u.len(), [0.0; 3]);
        packed.impulses(&self.p, &mut buffers.impulses, par);
        let f = &buffers.impulses;
        par.map_into(&mut buffers.contact, |b| packed.gather(b, f));
        residuals.dynamics = dynamics_residual(self.task, &buffers.product, &buffers.contact);
        residuals
    }

    /// Momentum, restarts and step size; the next prediction.
    ///
    /// `contact` is `C^T p` where that was just gathered; else it follows from the prediction that was relaxed.
    fn extrapolate(&mut self, sums: Sums, contact: Option<&[Vec3]>) {
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
        });
    }
}
