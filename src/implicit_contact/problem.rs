//! The frictional contact problem [Otaduy09, Eq. 7] over one metric, and the one signature of its solvers.

use super::accelerated_relaxation::{Control, Passes, RelaxationBuffers};
use super::augmented_lagrangian::{Lagrangian, Turn};
use super::block_diagonal::{Best, PassBuffers};
use super::direct_newton::DirectNewton;
use super::friction::project;
use super::iterative_anticipation::{self, Inner};
use super::packed_contacts::PackedContacts;
use super::residuals::{Iterate, MeasureBuffers, Task, Work, contact_residuals, measure};
use super::stop_test::{Ending, Run};
use super::velocity_error::velocity_error;
use super::{accelerated_relaxation, block_diagonal, full_anticipation, splitting_start};
use crate::constraint::{RowSet, Translations};
use crate::linalg::{BlockMatrix, SinglePrecision};
use crate::math::{Mat3, Vec3, is_finite, mat_vec};
use crate::model::{Settings, SolverChoice};
use crate::parallel::Par;

/// Fraction of the velocity scale that a block of mean mass would take from the smallest impulse that counts: the floor
/// of the dynamics residual while no contact is active.
const IMPULSE_FLOOR: f64 = 1e-2;

/// Iterations without halving the residuals after which the relaxation hands over.
const PATIENCE: u32 = 300;

/// Find `dv`, `p = (lambda, gamma)` with `A dv = C^T p`, `0 <= lambda perp J dv >= c`, and friction within its limit.
///
/// Blocks of infinite mass carry a zero inverse diagonal, are coupled to nothing in `matrix`, and keep `dv = 0`.
pub struct ContactProblem<'a> {
    /// Metric A `[kg]`.
    pub matrix: &'a BlockMatrix,
    /// Inverse of the diagonal blocks; zero for blocks of infinite mass.
    pub inverse_diagonal: &'a [Mat3],
    /// Contact rows.
    pub rows: &'a RowSet,
    /// Translations in which the caller balances momentum: a solve goes on until its rows hold after that too.
    pub translations: Option<&'a Translations>,
    /// Scale of velocities that residuals are relative to: the largest of `|v*|` `[m/s]`.
    pub velocity_scale: f64,
}

/// What a solver did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// Outer iterations, all solvers of a hand-over summed.
    pub iterations: u32,
    /// Whether the tolerances were met.
    pub converged: bool,
    /// Natural-map residual of `0 <= lambda perp J dv - c >= 0`, relative to the velocity scale.
    pub complementarity_residual: f64,
    /// Natural-map residual of the friction law, relative to the velocity scale.
    pub friction_residual: f64,
    /// `|A dv - C^T p| / |C^T p|` in the norm of the inverse diagonal.
    pub dynamics_residual: f64,
    /// Estimated `|dv - dv_exact| / |dv_exact|` in the norm of A.
    pub velocity_error: f64,
    /// Outer iterations at which the paper's 5 % criterion would have stopped [Otaduy09, §5.5]; 0 if never.
    pub paper_iterations: u32,
    /// Times one solver handed over to another.
    pub hand_overs: u32,
    /// Work done: blocks of A multiplied plus contacts visited. The same on every machine.
    pub work: u64,
}

/// Buffers of the solvers: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct SolverScratch {
    packed: PackedContacts,
    single: SinglePrecision,
    coupled: Vec<bool>,
    at: Iterate,
    buffers: Buffers,
}

/// What the solvers keep their capacity in.
#[derive(Default)]
struct Buffers {
    measure: MeasureBuffers,
    relaxation: RelaxationBuffers,
    best: Best,
    passes: PassBuffers,
    direct: DirectNewton,
    lagrangian: Lagrangian,
}

impl SolverScratch {
    /// `A dv` and `C^T p` of what the last solve returned.
    pub(super) fn balance(&self) -> (&[Vec3], &[Vec3]) {
        (&self.buffers.measure.product, &self.buffers.measure.contact)
    }
}

/// Solves the problem with the solver that the settings choose.
///
/// `impulses` holds a warm start on entry (zero for new contacts) and the multipliers on return; `dv` likewise.
/// Always ends: at most `settings.iterations_max` outer iterations. Blocks without off-diagonal entries (lumped masses,
/// rigid bodies) leave with `dv = D^-1 C^T p` to rounding, at any number of iterations: momentum is exact for them.
/// Values that are not finite in the warm start are dropped; the result is finite.
///
/// Without a pool the choices `Automatic` (without a splitting start), `AcceleratedRelaxation` and `AugmentedLagrangian`
/// allocate nothing once the buffers have their size.
pub fn solve(
    problem: &ContactProblem,
    impulses: &mut [Vec3],
    dv: &mut [Vec3],
    settings: &Settings,
    scratch: &mut SolverScratch,
    par: Par,
) -> SolverReport {
    par.within(|| solve_here(problem, impulses, dv, settings, scratch, par))
}

fn solve_here(
    problem: &ContactProblem,
    impulses: &mut [Vec3],
    dv: &mut [Vec3],
    settings: &Settings,
    scratch: &mut SolverScratch,
    par: Par,
) -> SolverReport {
    let SolverScratch { packed, single, coupled, at, buffers } = scratch;
    packed.assign(problem, par);
    let velocity_scale = velocity_scale(problem);
    let typical_mass = typical_mass(problem, packed);
    single.assign(problem.matrix);
    coupled.clear();
    coupled.extend((0..dv.len()).map(|b| is_coupled(problem, b)));
    let task = Task {
        problem,
        packed,
        single,
        coupled,
        settings,
        velocity_scale,
        impulse_floor: (IMPULSE_FLOOR * velocity_scale * typical_mass.sqrt()).max(f64::MIN_POSITIVE),
        par,
    };
    warm_start(&task, impulses, dv, at);
    let mut work = Work::default();
    let mut report = SolverReport::default();
    let mut error = None;
    if packed.contacts.is_empty() {
        at.dv.fill([0.0; 3]);
        report.converged = true;
    } else {
        error = choose(&task, at, buffers, &mut work, &mut report);
    }
    finish(&task, at, &mut buffers.measure, &mut work, error, &mut report);
    for (c, contact) in packed.contacts.iter().enumerate() {
        impulses[contact.source as usize] = at.p[c];
    }
    dv.copy_from_slice(&at.dv);
    report
}

/// Iterations of the first turn of the augmented Lagrangian at most, and how many of a turn may not halve the residuals.
const FIRST_TURN: u32 = 400;
const TURN_PATIENCE: u32 = 100;

/// Block products of a factor, per contact, up to which the augmented Lagrangian goes first: it costs as much as about ten
/// passes over the contacts then, and leaves residuals of rounding.
const FACTORED_FIRST: usize = 64;

/// Passes over uncoupled blocks before the augmented Lagrangian has its first turn.
const UNCOUPLED_TURN: u32 = 32;

/// Runs the solver that the settings name.
fn choose(
    task: &Task,
    at: &mut Iterate,
    buffers: &mut Buffers,
    work: &mut Work,
    report: &mut SolverReport,
) -> Option<f64> {
    let max = task.settings.iterations_max;
    let run = match task.settings.solver {
        SolverChoice::IterativeAnticipation => anticipate(task, Inner::Paper, at, &mut buffers.measure, work, report),
        SolverChoice::LightAnticipation => anticipate(task, Inner::Light, at, &mut buffers.measure, work, report),
        SolverChoice::AugmentedLagrangian => minimise(task, at, Turn::of(max), buffers, work),
        SolverChoice::FullAnticipation => match full_anticipation::run(task, at, max, &mut buffers.measure, work) {
            Some(run) => run,
            None => anticipate(task, Inner::Paper, at, &mut buffers.measure, work, report),
        },
        SolverChoice::AcceleratedRelaxation => {
            let control = Control { iterations_max: max, patience: u32::MAX, passes: Passes::Growing };
            accelerated_relaxation::run(task, at, control, &mut buffers.relaxation, &mut buffers.measure, work)
        }
        SolverChoice::Automatic if task.coupled.iter().any(|c| *c) => automatic(task, at, buffers, work, report),
        SolverChoice::Automatic => automatic_uncoupled(task, at, buffers, work, report),
    };
    report.iterations = run.iterations;
    report.converged = run.ending == Ending::Converged;
    run.error
}

fn anticipate(
    task: &Task,
    inner: Inner,
    at: &mut Iterate,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
    report: &mut SolverReport,
) -> Run {
    let max = task.settings.iterations_max;
    let (run, paper_iterations) = iterative_anticipation::run(task, inner, at, max, buffers, work);
    report.paper_iterations = paper_iterations;
    run
}

/// A turn of the augmented Lagrangian, its Newton systems factored where that is cheap.
fn minimise(task: &Task, at: &mut Iterate, turn: Turn, buffers: &mut Buffers, work: &mut Work) -> Run {
    let direct = buffers.direct.assign(task.problem);
    buffers.lagrangian.run(task, direct, at, turn, &mut buffers.measure, work)
}

/// A short splitting start if asked for, relaxation with a pass an iteration, and where that is not enough the augmented
/// Lagrangian in turn with relaxation: moving cloth that folds is solved sooner by the first, heaps and heavy bodies on
/// light ones by the second, which makes as many passes as it takes.
fn automatic(task: &Task, at: &mut Iterate, buffers: &mut Buffers, work: &mut Work, report: &mut SolverReport) -> Run {
    let max = task.settings.iterations_max;
    if task.settings.splitting_iterations > 0 {
        splitting_start::run(task, at, task.settings.splitting_iterations, work);
    }
    let mut iterations = 0;
    let mut turn = FIRST_TURN;
    let mut control = Control { iterations_max: max, patience: PATIENCE, passes: Passes::One };
    loop {
        control.iterations_max = max - iterations;
        let run = accelerated_relaxation::run(task, at, control, &mut buffers.relaxation, &mut buffers.measure, work);
        iterations += run.iterations;
        if run.ending != Ending::Stagnated || iterations >= max {
            return Run { iterations, ..run };
        }
        report.hand_overs += 1;
        // What stiffer penalties did not solve is tried without.
        let stiffens = control.passes == Passes::One;
        let this = Turn { iterations_max: turn.min(max - iterations), patience: TURN_PATIENCE, stiffens };
        let run = minimise(task, at, this, buffers, work);
        iterations += run.iterations;
        if run.ending == Ending::Converged || iterations >= max {
            return Run { iterations, ..run };
        }
        report.hand_overs += 1;
        turn = turn.saturating_mul(2);
        control = match control.passes {
            Passes::One => Control { passes: Passes::Growing, ..control },
            _ => Control { patience: control.patience.saturating_mul(2), passes: Passes::Many, ..control },
        };
    }
}

/// Gauss-Seidel on the contacts where no system couples blocks, in turn with the augmented Lagrangian: a tall stack, or
/// rows that share a load, take the first as many passes as it is high, and the second a few linear solves.
fn automatic_uncoupled(
    task: &Task,
    at: &mut Iterate,
    buffers: &mut Buffers,
    work: &mut Work,
    report: &mut SolverReport,
) -> Run {
    let max = task.settings.iterations_max;
    let mut iterations = 0;
    let small = |direct: &&mut DirectNewton| direct.work() <= FACTORED_FIRST * task.packed.contacts.len();
    buffers.best.start(task, at, work);
    if let Some(direct) = buffers.direct.assign(task.problem).filter(small) {
        let left = (2 * UNCOUPLED_TURN).min(max / 2);
        let run = buffers.lagrangian.run(task, Some(direct), at, Turn::of(left), &mut buffers.measure, work);
        iterations += run.iterations;
        // Velocities follow from the impulses here, and with those the contacts must hold.
        if (buffers.best.take(task, at, work) && run.ending == Ending::Converged) || iterations >= max {
            return run;
        }
        report.hand_overs += 1;
    }
    let mut turn = UNCOUPLED_TURN;
    loop {
        let run = block_diagonal::solve(task, at, turn.min(max - iterations), &mut buffers.passes, work);
        iterations += run.iterations;
        if run.ending == Ending::Converged {
            return Run { iterations, ..run };
        }
        buffers.best.take(task, at, work);
        if iterations >= max {
            return Run { iterations, ..run };
        }
        report.hand_overs += 1;
        let left = (2 * turn).min(max - iterations);
        let run = minimise(task, at, Turn::of(left), buffers, work);
        iterations += run.iterations;
        // Converged or not: with the velocities that follow from the impulses the passes have the last word.
        buffers.best.take(task, at, work);
        if iterations >= max {
            return Run { iterations, ending: Ending::Exhausted, error: None };
        }
        report.hand_overs += 1;
        turn = turn.saturating_mul(2);
    }
}

/// The scale that residuals are relative to: the problem's, else the largest target, else 1.
fn velocity_scale(problem: &ContactProblem) -> f64 {
    let usable = |s: f64| s > 0.0 && s.is_finite();
    if usable(problem.velocity_scale) {
        return problem.velocity_scale;
    }
    let targets = problem.rows.normal_targets.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if usable(targets) { targets } else { 1.0 }
}

/// Harmonic mean mass of the blocks that contacts touch, so that what is light counts; 1 when none has a finite mass.
fn typical_mass(problem: &ContactProblem, packed: &PackedContacts) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (b, m) in problem.inverse_diagonal.iter().enumerate() {
        let trace = m[0][0] + m[1][1] + m[2][2];
        if trace > 0.0 && packed.incidence.touches(b) {
            sum += trace / 3.0;
            count += 1.0;
        }
    }
    let mean: f64 = if sum > 0.0 { count / sum } else { 1.0 };
    if mean.is_finite() && mean > 0.0 { mean } else { 1.0 }
}

/// Whether block row `b` has entries beside its diagonal.
fn is_coupled(problem: &ContactProblem, b: usize) -> bool {
    let m = problem.matrix;
    let range = m.row_offsets[b]..m.row_offsets[b + 1];
    range.into_iter().any(|k| m.columns[k] as usize != b && m.values[k] != [[0.0; 3]; 3])
}

/// Puts the warm start into `at`, in sweep order: multipliers within their limits, infinite masses at rest, nothing that
/// is not finite.
fn warm_start(task: &Task, impulses: &[Vec3], dv: &[Vec3], at: &mut Iterate) {
    let inverse = task.problem.inverse_diagonal;
    let usable = |b: usize| is_finite(dv[b]) && inverse[b] != [[0.0; 3]; 3];
    let cone = task.settings.friction_cone;
    task.par.map_indexed_into(&mut at.dv, dv.len(), |b| if usable(b) { dv[b] } else { [0.0; 3] });
    at.p.clear();
    at.p.extend(task.packed.contacts.iter().map(|c| project(cone, c.friction, impulses[c.source as usize])));
}

/// Makes uncoupled blocks exact, and reports the residuals of what is handed back.
fn finish(
    task: &Task,
    at: &mut Iterate,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
    error: Option<f64>,
    report: &mut SolverReport,
) {
    let sound = |at: &Iterate| at.dv.iter().chain(&at.p).all(|v| is_finite(*v));
    if !sound(at) {
        // No response at all satisfies the dynamics exactly, if not the contacts: the caller's fail-safes go on.
        at.dv.fill([0.0; 3]);
        at.p.fill([0.0; 3]);
        report.converged = false;
    }
    task.packed.impulses(&at.p, &mut buffers.impulses, task.par);
    let inverse = task.problem.inverse_diagonal;
    for (b, v) in at.dv.iter_mut().enumerate() {
        if !task.coupled[b] {
            *v = mat_vec(&inverse[b], task.packed.incidence.gather(b, &buffers.impulses));
        }
    }
    let mut residuals = measure(task, at, buffers, work);
    if !report.converged {
        let Iterate { dv, p } = &mut buffers.none;
        for (none, count) in [(&mut *dv, at.dv.len()), (&mut *p, at.p.len())] {
            none.clear();
            none.resize(count, [0.0; 3]);
        }
        if contact_residuals(task, dv, p).contact() < residuals.contact() {
            // Worse than no response: the impulses would be the next step's warm start, and grow from step to step.
            at.clone_from(&buffers.none);
            residuals = measure(task, at, buffers, work);
        }
    }
    report.complementarity_residual = residuals.normal;
    report.friction_residual = residuals.friction;
    report.dynamics_residual = residuals.dynamics;
    report.velocity_error = error.unwrap_or_else(|| velocity_error(task, at, &residuals, f64::INFINITY, buffers, work));
    report.work = work.blocks + work.contacts;
}
