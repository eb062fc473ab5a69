//! Augmented Lagrangian: contacts as penalties around the current multipliers, minimised over `dv` by Newton steps with
//! preconditioned conjugate gradients [Alart91; Bertsekas82]. Slower than relaxation on easy problems, but
//! conflicting rows only stiffen it, so it is the fallback.
//!
//! `phi(dv) = dv^T A dv / 2 + sum |P(p - rho w)|^2 / (2 rho)`, with `rho = k / d`, P the projection on the limits and the
//! friction bound frozen at the last update of the multipliers: convex and once differentiable.

use super::direct_newton::DirectNewton;
use super::friction::{project, project_tangent};
use super::newton_system::{Acting, NewtonSystem};
use super::packed_contacts::{PackedContacts, contact_velocity, relative_velocity, world_stiffness};
use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work, measure};
use super::stop_test::{Ending, Run, Stagnation, StopTest, Verdict};
use crate::math::{Mat3, Vec3, add_scaled, dot, mat_add, mat_scale, mat_vec, norm, sub};
use crate::model::FrictionCone;

/// Penalty stiffness relative to the effective mass of a contact.
const STIFFNESS: f64 = 3.0;
/// The same where Newton systems are factored, which stiffness does not disturb.
const STIFFNESS_FACTORED: f64 = 1e4;
/// A row whose residual is not brought below this share by an update is given so many times the stiffness, once: where
/// rows conflict, more would be too stiff for conjugate gradients.
const SLOW: f64 = 0.25;
const STIFFER: f64 = 5.0;
/// Rows that open faster than this share of the velocity scale are left out until they are violated.
const NEAR: f64 = 0.02;
/// Newton steps between two updates of the multipliers at most.
const NEWTON_STEPS: u32 = 3;
/// The same where they are factored.
const NEWTON_STEPS_FACTORED: u32 = 12;
/// Factored Newton steps go on until what they leave is this share of the contact tolerance.
const FACTORED_SHARE: f64 = 3e-6;
/// What Newton steps leave by rounding, relative to the velocity scale.
const ROUNDING: f64 = 1e-11;
/// Minima are good enough to judge once they leave this share of the contact tolerance.
const SETTLED: f64 = 0.03;
/// Where Newton systems are factored another update costs little: a solution goes on to this share of the contact
/// tolerance, so that what rests leaves no velocity that the next step has to stop again.
const POLISHED: f64 = 3e-4;
/// Updates for that at most.
const POLISHES: u32 = 8;
/// Updates without a better iterate after which friction limits no longer follow all of the way.
const CYCLE: u32 = 4;
/// Share by which they follow then.
const DAMPED: f64 = 0.5;
/// Relative residual of a Newton step's linear solve, and its steps at most.
const LINEAR_SOLVE: (f64, u32) = (0.3, 100);
/// Slope left at a full step, relative to the first, that calls for a line search.
const SLOPE: f64 = 0.3;

/// A contact's penalty.
#[derive(Clone, Copy, Debug, Default)]
struct Penalty {
    /// Normal and tangential stiffness `[kg]`; zero where nothing can move.
    stiffness: [f64; 2],
    /// Friction limit, frozen.
    bound: f64,
}

/// What a run may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    /// Iterations at most.
    pub iterations_max: u32,
    /// Iterations that need not halve the residuals.
    pub patience: u32,
    /// Whether penalties stiffen where updates bring little.
    pub stiffens: bool,
}

impl Turn {
    /// As many iterations, without patience ever running out.
    pub fn of(iterations_max: u32) -> Turn {
        Turn { iterations_max, patience: u32::MAX, stiffens: true }
    }
}

/// How far friction limits follow the normal multipliers at an update. Where friction decides how hard contacts press, all
/// of the way can lead round in circles.
struct Damping {
    share: f64,
    best: f64,
    since: u32,
}

impl Default for Damping {
    fn default() -> Damping {
        Damping { share: 1.0, best: f64::INFINITY, since: 0 }
    }
}

impl Damping {
    fn follow(&self, from: f64, to: f64) -> f64 {
        from + self.share * (to - from)
    }

    fn observe(&mut self, merit: f64) {
        self.since += 1;
        if merit < self.best {
            self.best = merit;
            self.since = 0;
        } else if self.since >= CYCLE {
            self.share = DAMPED;
        }
    }
}

/// Updates after the tolerances are met.
struct Polish {
    /// Estimated velocity error at that time.
    error: f64,
    merit: f64,
    left: u32,
}

impl Polish {
    /// Takes note of an update; whether it is for the better.
    fn improves(&mut self, residuals: &Residuals) -> bool {
        self.left -= 1;
        let better = residuals.merit() < self.merit;
        self.merit = residuals.merit();
        better
    }
}

/// The rows that a run takes.
#[derive(Default)]
struct Taken {
    /// Whether each contact is, and whether it opens slower than it may.
    flags: Vec<bool>,
    opens_slower: Vec<bool>,
    /// Those that are, as a problem of their own.
    list: Vec<usize>,
    packed: PackedContacts,
    at: Iterate,
}

/// The state of a run; capacity is kept from run to run.
#[derive(Default)]
pub(super) struct Lagrangian {
    taken: Taken,
    now: Iterate,
    penalties: Vec<Penalty>,
    /// Normal velocity of each contact at the current `dv` `[m/s]`, and its change along the step.
    normals: Vec<f64>,
    normal_steps: Vec<f64>,
    /// Normal residual of each contact at the last update of the multipliers `[m/s]`.
    missed: Vec<f64>,
    /// Whether its penalty was stiffened, or is not to be.
    stiffened: Vec<bool>,
    /// Contacts that act at the current `dv`.
    system: NewtonSystem,
    gradient: Vec<Vec3>,
    step: Vec<Vec3>,
    /// `A dv` and `A step`.
    product: Vec<Vec3>,
    step_product: Vec<Vec3>,
    /// Contacts that the slope along a step takes in, with their velocities and what the step adds to them.
    sloping: Vec<usize>,
    slopes: Vec<[Vec3; 2]>,
    work: Work,
}

/// Puts whether each contact opens slower than `limit` `[m/s]` at `dv` into `out`.
fn list_opening_slower_than(task: &Task, dv: &[Vec3], limit: f64, out: &mut Vec<bool>) {
    task.par.map_indexed_into(out, task.packed.contacts.len(), |c| {
        let contact = &task.packed.contacts[c];
        dot(contact.frame[0], relative_velocity(contact, task.problem.rows, dv)) + contact.target[0] < limit
    });
}

/// `count` times `value`.
fn fill<T: Copy>(buffer: &mut Vec<T>, count: usize, value: T) {
    buffer.clear();
    buffer.resize(count, value);
}

fn penalty(relative: f64, [normal, tangent]: [f64; 2]) -> Penalty {
    let over = |d: f64| if d > 0.0 { relative / d } else { 0.0 };
    Penalty { stiffness: [over(normal), over(tangent)], bound: 0.0 }
}

impl Lagrangian {
    /// Runs from `at` until the tolerances are met or the turn is over; leaves the best iterate. Newton systems are factored
    /// by `direct`, without it solved by conjugate gradients. Iterations count the steps of the linear solves, which cost
    /// about as much as an iteration of the other solvers. Rows that open fast are left out until a solution violates them,
    /// and a run has converged only once it violates none.
    pub fn run(
        &mut self,
        task: &Task,
        direct: Option<&mut DirectNewton>,
        at: &mut Iterate,
        turn: Turn,
        buffers: &mut MeasureBuffers,
        work: &mut Work,
    ) -> Run {
        if direct.is_some() {
            return self.run_all(task, direct, at, turn, buffers, work);
        }
        let mut taken = std::mem::take(&mut self.taken);
        let run = self.run_near(task, &mut taken, at, turn, buffers, work);
        self.taken = taken;
        run
    }

    /// Runs with the rows that are near alone, until they are all that count.
    fn run_near(
        &mut self,
        task: &Task,
        taken: &mut Taken,
        at: &mut Iterate,
        turn: Turn,
        buffers: &mut MeasureBuffers,
        work: &mut Work,
    ) -> Run {
        let Taken { flags, opens_slower, list, packed, at: near } = taken;
        flags.clear();
        flags.resize(at.p.len(), false);
        let mut last: Option<Run> = None;
        loop {
            let iterations = last.map_or(0, |run| run.iterations);
            // The solution of the rows taken may violate others: then with those too, from there.
            let share = if last.is_none() { NEAR } else { -task.settings.contact_tolerance };
            list_opening_slower_than(task, &at.dv, share * task.velocity_scale, opens_slower);
            work.contacts += at.p.len() as u64;
            let before = flags.iter().filter(|taken| **taken).count();
            for (c, taken) in flags.iter_mut().enumerate() {
                *taken |= at.p[c] != [0.0; 3] || opens_slower[c];
            }
            list.clear();
            list.extend((0..flags.len()).filter(|c| flags[*c]));
            if let Some(run) = last {
                if list.len() == before {
                    return run;
                }
                if iterations >= turn.iterations_max {
                    return Run { ending: Ending::Exhausted, error: None, ..run };
                }
            }
            packed.assign_subset(task.packed, task.problem, list);
            let part = Task { packed, ..*task };
            near.dv.clone_from(&at.dv);
            near.p.clear();
            near.p.extend(list.iter().map(|c| at.p[*c]));
            let left = Turn { iterations_max: turn.iterations_max - iterations, ..turn };
            let run = self.run_all(&part, None, near, left, buffers, work);
            at.dv.copy_from_slice(&near.dv);
            for (c, p) in list.iter().zip(&near.p) {
                at.p[*c] = *p;
            }
            let run = Run { iterations: iterations + run.iterations, ..run };
            if run.ending != Ending::Converged {
                return run;
            }
            last = Some(run);
        }
    }

    /// Runs with all contacts of the task.
    fn run_all(
        &mut self,
        task: &Task,
        direct: Option<&mut DirectNewton>,
        at: &mut Iterate,
        turn: Turn,
        buffers: &mut MeasureBuffers,
        work: &mut Work,
    ) -> Run {
        let (blocks, contacts) = (at.dv.len(), at.p.len());
        let relative = if direct.is_some() { STIFFNESS_FACTORED } else { STIFFNESS };
        let penalty = |c: usize| penalty(relative, task.packed.natural_scale(c));
        task.par.map_indexed_into(&mut self.penalties, contacts, penalty);
        fill(&mut self.normals, contacts, 0.0);
        fill(&mut self.normal_steps, contacts, 0.0);
        fill(&mut self.missed, contacts, f64::INFINITY);
        fill(&mut self.stiffened, contacts, !turn.stiffens);
        for buffer in [&mut self.gradient, &mut self.step, &mut self.product, &mut self.step_product] {
            fill(buffer, blocks, [0.0; 3]);
        }
        self.now.clone_from(at);
        self.work = Work::default();
        let run = self.iterate(task, direct, at, turn, buffers);
        // Bounds were frozen: what is left of that, within the tolerances, goes.
        for (p, contact) in at.p.iter_mut().zip(&task.packed.contacts) {
            *p = project(task.settings.friction_cone, contact.friction, *p);
        }
        work.blocks += self.work.blocks;
        work.contacts += self.work.contacts;
        run
    }

    fn iterate(
        &mut self,
        task: &Task,
        mut direct: Option<&mut DirectNewton>,
        at: &mut Iterate,
        turn: Turn,
        buffers: &mut MeasureBuffers,
    ) -> Run {
        let iterations_max = turn.iterations_max;
        let mut stagnation = Stagnation::new(turn.patience);
        let mut test = StopTest::new();
        let mut damping = Damping::default();
        let mut polish: Option<Polish> = None;
        let mut iterations = 0;
        let factored = direct.is_some();
        let tolerance = task.settings.contact_tolerance;
        let exact = (FACTORED_SHARE * tolerance).max(ROUNDING) * task.velocity_scale;
        // Further from a minimum, the velocities that follow from its impulses are far from those that led to them.
        let settled = SETTLED * tolerance * task.velocity_scale;
        self.start(task);
        while iterations < iterations_max {
            for (penalty, (contact, p)) in self.penalties.iter_mut().zip(task.packed.contacts.iter().zip(&self.now.p)) {
                let bound = contact.friction * p[0];
                let follows = iterations > 0 && *p != [0.0; 3];
                penalty.bound = if follows { damping.follow(penalty.bound, bound) } else { bound };
            }
            iterations += self.minimise(task, direct.as_deref_mut(), iterations_max - iterations, exact);
            while factored && self.gradient_velocity(task) > settled && iterations < iterations_max {
                iterations += self.minimise(task, direct.as_deref_mut(), iterations_max - iterations, exact);
            }
            self.now.p.fill([0.0; 3]);
            for acting in &self.system.acting {
                self.now.p[acting.contact as usize] = acting.trial;
            }
            let residuals = measure(task, &self.now, buffers, &mut self.work);
            self.product.copy_from_slice(&buffers.product);
            if let Some(polish) = &mut polish {
                if !polish.improves(&residuals) {
                    break;
                }
                at.clone_from(&self.now);
                if polish.left == 0 || residuals.contact() <= POLISHED * tolerance {
                    break;
                }
                continue;
            }
            if !factored {
                self.stiffen(task);
            }
            damping.observe(residuals.merit());
            if factored && self.gradient_velocity(task) > settled {
                break;
            }
            match test.check(task, &self.now, &residuals, at, buffers, &mut self.work) {
                Verdict::Converged(error) if factored => {
                    polish = Some(Polish { error, merit: residuals.merit(), left: POLISHES });
                }
                Verdict::Converged(e) => return Run { iterations, ending: Ending::Converged, error: Some(e) },
                Verdict::Continue => {}
                Verdict::Overflowed => return Run { iterations, ending: Ending::Stagnated, error: None },
            }
            if polish.is_none() && stagnation.seen([residuals.merit(), residuals.contact_energy.sqrt()], iterations) {
                return Run { iterations, ending: Ending::Stagnated, error: None };
            }
        }
        match polish {
            Some(polish) => Run { iterations, ending: Ending::Converged, error: Some(polish.error) },
            None => Run { iterations, ending: Ending::Exhausted, error: None },
        }
    }

    /// Stiffens the penalties of rows that the last update brought too little: rows that nearly depend on each other meet
    /// little compliance in their difference, of which an update takes away a small share.
    fn stiffen(&mut self, task: &Task) {
        let enough = task.settings.contact_tolerance * task.velocity_scale;
        for acting in &self.system.acting {
            let c = acting.contact as usize;
            let stiffness = &mut self.penalties[c].stiffness[0];
            let missed = self.normals[c].min(self.now.p[c][0] / *stiffness).abs();
            let before = std::mem::replace(&mut self.missed[c], missed);
            if missed > enough && missed > SLOW * before && !self.stiffened[c] {
                self.stiffened[c] = true;
                *stiffness *= STIFFER;
            }
        }
    }

    /// Newton steps over `dv` with the multipliers and bounds as they are; leaves the next multipliers in `trial`. Returns
    /// the steps of the linear solves.
    fn minimise(&mut self, task: &Task, mut direct: Option<&mut DirectNewton>, iterations_max: u32, exact: f64) -> u32 {
        let factored = direct.is_some();
        let mut iterations = 0;
        for newton in 0..if factored { NEWTON_STEPS_FACTORED } else { NEWTON_STEPS } {
            let change = self.evaluate(task);
            let enough = if factored { exact } else { 2.0 * change };
            if (newton > 0 && self.gradient_velocity(task) <= enough) || iterations >= iterations_max {
                return iterations;
            }
            iterations += self.newton_step(task, direct.as_deref_mut(), iterations_max - iterations).max(1);
            self.line_search(task);
        }
        self.evaluate(task);
        iterations
    }

    /// What follows `dv` from step to step, at a new one.
    fn start(&mut self, task: &Task) {
        let Task { problem, packed, par, .. } = *task;
        let now = &self.now;
        problem.matrix.product(&now.dv, &mut self.product, par);
        par.map_into(&mut self.normals, |c| {
            let contact = &packed.contacts[c];
            dot(contact.frame[0], relative_velocity(contact, problem.rows, &now.dv)) + contact.target[0]
        });
    }

    /// The contacts that act now, their trial multipliers and stiffness, and the gradient; returns the largest change
    /// of a multiplier over its stiffness `[m/s]`.
    fn evaluate(&mut self, task: &Task) -> f64 {
        let Task { problem, packed, settings, par, .. } = *task;
        let (now, penalties, normals) = (&self.now, &self.penalties, &self.normals);
        let acts = |c: &usize| now.p[*c] != [0.0; 3] || penalties[*c].stiffness[0] * normals[*c] < 0.0;
        let of = |c: usize| {
            let (contact, penalty) = (&packed.contacts[c], &penalties[c]);
            let y = pulled(penalty, now.p[c], contact_velocity(contact, problem.rows, &now.dv));
            let stiffness = tangent_stiffness(settings.friction_cone, penalty, y);
            Acting {
                contact: c as u32,
                trial: project_trial(settings.friction_cone, penalty, y),
                stiffness: stiffness.map(|s| world_stiffness(&contact.frame, &s)),
            }
        };
        self.system.acting.clear();
        par.extend_filtered(&mut self.system.acting, now.p.len(), |c| acts(&c).then(|| of(c)));
        self.system.index(task);
        let (incidence, impulses, product) = (&self.system.incidence, &self.system.impulses, &self.product);
        par.map_into(&mut self.gradient, |b| sub(product[b], incidence.gather(b, impulses)));
        self.work.contacts += 4 * self.system.acting.len() as u64;
        let change = |acting: &Acting| {
            let c = acting.contact as usize;
            let ([n, t], d) = (penalties[c].stiffness, sub(acting.trial, now.p[c]));
            let over = |d: f64, stiffness: f64| if stiffness > 0.0 { d / stiffness } else { 0.0 };
            over(d[0].abs(), n).max(over(d[1].abs().max(d[2].abs()), t))
        };
        self.system.acting.iter().map(change).fold(0.0, f64::max)
    }

    /// Largest `|D^-1 gradient|` `[m/s]`.
    fn gradient_velocity(&self, task: &Task) -> f64 {
        let inverse = task.problem.inverse_diagonal;
        self.gradient.iter().zip(inverse).map(|(g, m)| norm(mat_vec(m, *g))).fold(0.0, f64::max)
    }

    /// Solves for the Newton step; returns the steps of the linear solve.
    fn newton_step(&mut self, task: &Task, direct: Option<&mut DirectNewton>, steps_max: u32) -> u32 {
        let Task { problem, packed, .. } = *task;
        if let Some(direct) = direct {
            for (step, g) in self.step.iter_mut().zip(&self.gradient) {
                *step = g.map(|x| -x);
            }
            let row = |a: &Acting| Some((packed.contacts[a.contact as usize].source as usize, a.stiffness?));
            if direct.solve(self.system.acting.iter().filter_map(row), &mut self.step) {
                self.work.blocks += problem.matrix.values.len() as u64;
                self.work.contacts += 2 * self.system.acting.len() as u64;
                return 1;
            }
        }
        let control = (LINEAR_SOLVE.0, LINEAR_SOLVE.1.min(steps_max));
        self.system.solve(task, &self.gradient, &mut self.step, control, &mut self.work)
    }

    /// Moves `now.dv` along the step, all of it where that leaves a small slope.
    fn line_search(&mut self, task: &Task) {
        let Task { problem, packed, settings, par, .. } = *task;
        problem.matrix.product(&self.step, &mut self.step_product, par);
        let (step, product, step_product) = (&self.step, &self.product, &self.step_product);
        let n = step.len();
        let linear = par.sum(n, |b| dot(step[b], product[b]));
        let curvature = par.sum(n, |b| dot(step[b], step_product[b]));
        par.map_into(&mut self.normal_steps, |c| {
            let contact = &packed.contacts[c];
            dot(contact.frame[0], relative_velocity(contact, problem.rows, step))
        });
        let Lagrangian { now, penalties, normals, normal_steps, sloping: list, slopes: seen, .. } = self;
        let p = &now.p;
        // The trial of a contact without multiplier is zero all along where it is zero at both ends.
        let acts = |c: &usize| {
            p[*c] != [0.0; 3] || penalties[*c].stiffness[0] * normals[*c].min(normals[*c] + normal_steps[*c]) < 0.0
        };
        list.clear();
        list.extend((0..p.len()).filter(acts));
        par.map_indexed_into(seen, list.len(), |k| {
            let contact = &packed.contacts[list[k]];
            let d = relative_velocity(contact, problem.rows, step);
            let f = &contact.frame;
            [contact_velocity(contact, problem.rows, &now.dv), [dot(f[0], d), dot(f[1], d), dot(f[2], d)]]
        });
        let slope = |alpha: f64| {
            let contacts = par.sum(seen.len(), |k| {
                let ([w, d], c) = (seen[k], list[k]);
                let y = pulled(&penalties[c], p[c], add_scaled(w, alpha, d));
                dot(project_trial(settings.friction_cone, &penalties[c], y), d)
            });
            linear + alpha * curvature - contacts
        };
        self.work.contacts += (p.len() + 2 * seen.len()) as u64;
        let first = slope(0.0);
        let (mut low, mut high) = (0.0, 1.0);
        let (mut at_low, mut at_high) = (first, slope(1.0));
        let mut alpha = 1.0;
        // The slope grows along the step: a root lies between. False position, with a share of bisection.
        let mut tries = 0;
        let mut now_slope = at_high;
        while now_slope > SLOPE * first.abs() && tries < 12 && first < 0.0 {
            let secant = low - at_low * (high - low) / (at_high - at_low);
            let middle = 0.5 * (low + high);
            alpha = if tries % 3 == 2 || !secant.is_finite() { middle } else { 0.8 * secant + 0.2 * middle };
            now_slope = slope(alpha);
            self.work.contacts += seen.len() as u64;
            if now_slope > 0.0 {
                (high, at_high) = (alpha, now_slope);
            } else {
                (low, at_low) = (alpha, now_slope);
            }
            tries += 1;
        }
        for (b, dv) in now.dv.iter_mut().enumerate() {
            *dv = add_scaled(*dv, alpha, step[b]);
        }
        for (y, a) in self.product.iter_mut().zip(&self.step_product) {
            *y = add_scaled(*y, alpha, *a);
        }
        for (w, d) in self.normals.iter_mut().zip(&self.normal_steps) {
            *w += alpha * d;
        }
        self.work.blocks += problem.matrix.values.len() as u64;
    }
}

/// `p - rho w`
#[inline(always)]
fn pulled(penalty: &Penalty, p: Vec3, w: Vec3) -> Vec3 {
    let [n, t] = penalty.stiffness;
    [p[0] - n * w[0], p[1] - t * w[1], p[2] - t * w[2]]
}

/// Projection with the frozen friction limit.
#[inline(always)]
fn project_trial(cone: FrictionCone, penalty: &Penalty, y: Vec3) -> Vec3 {
    let [g1, g2] = project_tangent(cone, penalty.bound, [y[1], y[2]]);
    [y[0].max(0.0), g1, g2]
}

/// Derivative of the penalty impulse by the contact velocity, in the frame of the contact; `None` where it is zero.
fn tangent_stiffness(cone: FrictionCone, penalty: &Penalty, y: Vec3) -> Option<Mat3> {
    let [n, t] = penalty.stiffness;
    let mut s = [[0.0; 3]; 3];
    if y[0] > 0.0 {
        s[0][0] = n;
    }
    let bound = penalty.bound;
    if bound > 0.0 {
        match cone {
            FrictionCone::Pyramid => {
                for i in 1..3 {
                    if y[i].abs() < bound {
                        s[i][i] = t;
                    }
                }
            }
            FrictionCone::Disc => {
                let length = (y[1] * y[1] + y[2] * y[2]).sqrt();
                if length <= bound {
                    (s[1][1], s[2][2]) = (t, t);
                } else {
                    // Slipping resists only a turn of the direction: the rank-one block across it.
                    let r = t * bound / length;
                    let across = [-y[2] / length, y[1] / length];
                    let block = mat_scale(
                        r,
                        &[
                            [0.0; 3],
                            [0.0, across[0] * across[0], across[0] * across[1]],
                            [0.0, across[1] * across[0], across[1] * across[1]],
                        ],
                    );
                    s = mat_add(&s, &block);
                }
            }
        }
    }
    (s != [[0.0; 3]; 3]).then_some(s)
}
