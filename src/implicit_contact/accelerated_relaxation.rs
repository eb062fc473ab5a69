//! Accelerated projected relaxation: anticipation made consistent (block Jacobi in the prediction and in the
//! correction), which makes an outer iteration a projected gradient step in a block-diagonal metric S >= A, and then
//! accelerated by momentum with restarts [Beck09; ODonoghue15].
//!
//! An iteration: predict `u = z + S^-1 (C^T p - A z)`, relax the contacts against `u` (which keeps this equation true
//! while `p` changes), take `dv' = u`, extrapolate `z = dv' + beta (dv' - dv)`. One product with A per iteration: `A z`
//! follows by the same combination. Iterations run in single precision on increments, or in double precision.

use super::double_relaxation::DoubleRelaxation;
use super::problem::ContactProblem;
use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work};
use super::single_relaxation::SingleRelaxation;
use super::stop_test::{Ending, Run, Stagnation, StopTest, Verdict};

/// First scale of S relative to the diagonal of A; grows where `e^T A e > e^T S e` is seen.
const FIRST_SCALE: f64 = 1.9;
/// Iterations between two measurements, which also renew what single precision adds increments to.
const MEASURE_EVERY: u32 = 10;
/// The same while a residual is so many times its tolerance: a measurement costs three iterations.
const MEASURE_EVERY_FAR: u32 = 20;
const FAR: f64 = 2.0;
/// Passes per iteration, raised on stagnation.
const PASSES: [u32; 7] = [1, 3, 6, 12, 25, 50, 100];
/// Passes that are made where need be at any price; more only while they relax no more contacts than A has blocks, since
/// then they cost about as much as the product.
const PASSES_ALWAYS: u32 = 12;
/// Iterations without halving the contact residual after which an iteration makes more passes. Where only the dynamics
/// lag behind, passes would not help.
const PASSES_PATIENCE: u32 = 30;
/// The same where one component is alone: what folds of one cloth do not gain in these they hardly gain in more.
const ALONE_PATIENCE: u32 = 20;
/// Smallest tolerance for which iterations run in single precision.
const SINGLE_FROM: f64 = 1e-5;
/// Residuals above which stagnation ends the run. Below, a slow relaxation is still faster than the augmented Lagrangian,
/// whose multipliers converge linearly.
const HAND_OVER_ABOVE: f64 = 1e-3;
/// Excess of `e^T A e` over `e^T S e` that is not rounding.
const CURVATURE_EXCESS: f64 = 1e-5;

/// How long a run may go on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    /// Iterations at most.
    pub iterations_max: u32,
    /// Iterations without halving the residuals together after which the run ends as stagnated.
    pub patience: u32,
    /// Passes of an iteration.
    pub passes: Passes,
}

/// How many passes over the contacts an iteration makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Passes {
    /// One; the run ends as stagnated where that is not enough.
    One,
    /// One, and more on stagnation.
    Growing,
    /// Twelve from the first iteration on, and more on stagnation.
    Many,
}

/// Sums of one product sweep.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    /// `e^T A e`, `e = dv' - z`.
    pub curvature: f64,
    /// `e^T S e`
    pub metric: f64,
    /// `(z - dv')^T S (dv' - dv)`
    pub turn: f64,
}

impl Sums {
    /// The sum, entry by entry.
    pub fn plus(self, other: &Sums) -> Sums {
        Sums {
            curvature: self.curvature + other.curvature,
            metric: self.metric + other.metric,
            turn: self.turn + other.turn,
        }
    }
}

/// Step size and momentum.
#[derive(Default)]
pub(super) struct Momentum {
    /// Scale of S on coupled blocks.
    pub metric_scale: f64,
    /// The scale before the last product, over the scale now.
    change: f64,
    t: f64,
}

impl Momentum {
    /// No momentum yet.
    pub fn new(metric_scale: f64) -> Momentum {
        Momentum { metric_scale, change: 1.0, t: 1.0 }
    }

    /// Scale of S on a block: blocks that are not coupled keep 1, where relaxation is exact.
    #[inline]
    pub fn block_scale(&self, coupled: bool) -> f64 {
        if coupled { self.metric_scale } else { 1.0 }
    }

    /// Judges an iteration by its sums; returns whether the scale grew.
    pub fn observe(&mut self, sums: Sums) -> bool {
        let before = self.metric_scale;
        if sums.turn > 0.0 {
            self.t = 1.0;
        }
        let grows = sums.curvature > sums.metric * (1.0 + CURVATURE_EXCESS);
        if grows {
            self.metric_scale = (1.02 * before * sums.curvature / sums.metric).max(1.03 * before);
            self.t = 1.0;
        }
        self.change = before / self.metric_scale;
        grows
    }

    /// Share of the last change to extrapolate by, and the change of the scale before it.
    pub fn next(&mut self) -> (f64, f64) {
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.t * self.t).sqrt());
        let beta = (self.t - 1.0) / next;
        self.t = next;
        (beta, self.change)
    }
}

/// How many passes an iteration makes: an inexact projection breaks the momentum where rows conflict, and a heavy body
/// on a light one takes passes in proportion to the masses.
struct PassSchedule {
    level: usize,
    stagnation: Stagnation<1>,
    /// Blocks of A.
    blocks: usize,
}

impl PassSchedule {
    fn new(problem: &ContactProblem, passes: Passes) -> PassSchedule {
        let most = PASSES.partition_point(|p| *p <= PASSES_ALWAYS) - 1;
        let level = if passes == Passes::Many { most } else { 0 };
        let several = problem.translations.is_some_and(|t| t.inverse_masses().len() > 1);
        let patience = if several { PASSES_PATIENCE } else { ALONE_PATIENCE };
        PassSchedule { level, stagnation: Stagnation::new(patience), blocks: problem.matrix.values.len() }
    }

    fn passes(&self) -> u32 {
        PASSES[self.level]
    }

    /// Judges the contact residual at `iteration`; a pass relaxes `contacts`. Returns whether it stagnated.
    fn observe(&mut self, residual: f64, iteration: u32, contacts: usize) -> bool {
        let stagnated = self.stagnation.seen([residual], iteration);
        if let Some(next) = PASSES.get(self.level + 1)
            && stagnated
            && (*next <= PASSES_ALWAYS || *next as usize * contacts <= self.blocks)
        {
            self.level += 1;
        }
        stagnated
    }
}

/// What runs keep their capacity in.
#[derive(Default)]
pub(super) struct RelaxationBuffers {
    single: SingleRelaxation,
    double: DoubleRelaxation,
    now: Iterate,
}

/// Iterations in either precision.
enum Engine<'a> {
    Single(&'a mut SingleRelaxation),
    Double(&'a mut DoubleRelaxation),
}

/// Runs from `at` until the tolerances are met or `control` ends it; leaves the best iterate.
pub(super) fn run(
    task: &Task,
    at: &mut Iterate,
    control: Control,
    relaxation: &mut RelaxationBuffers,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> Run {
    let RelaxationBuffers { single, double, now } = relaxation;
    let tolerance = task.settings.contact_tolerance.min(task.settings.velocity_tolerance);
    let mut engine = if tolerance >= SINGLE_FROM {
        // What conflicts with whole bodies that give way is tried without in the next turn.
        Engine::single(single, task, at, control.passes == Passes::One)
    } else {
        Engine::double(double, task, at, FIRST_SCALE)
    };
    let mut test = StopTest::new();
    let mut schedule = PassSchedule::new(task.problem, control.passes);
    let mut stagnation = Stagnation::new(control.patience);
    let mut far = false;
    let mut k = 0;
    while k < control.iterations_max {
        let every = if far { MEASURE_EVERY_FAR } else { MEASURE_EVERY };
        let steps = every.min(control.iterations_max - k);
        engine.advance(task, steps, schedule.passes());
        k += steps;
        let residuals = engine.measure(task, now, buffers);
        far = residuals.contact() > FAR * task.settings.contact_tolerance
            || residuals.dynamics > FAR * task.settings.velocity_tolerance;
        match test.check(task, now, &residuals, at, buffers, work) {
            Verdict::Converged(e) => {
                engine.account(work);
                return Run { iterations: k, ending: Ending::Converged, error: Some(e) };
            }
            Verdict::Overflowed => {
                engine.account(work);
                if let Engine::Double(_) = &engine {
                    return Run { iterations: k, ending: Ending::Stagnated, error: None };
                }
                // The range of single precision was too small for these masses.
                engine = Engine::double(double, task, at, FIRST_SCALE);
                continue;
            }
            Verdict::Continue => {}
        }
        if residuals.contact() > task.settings.contact_tolerance
            && schedule.observe(residuals.contact(), k, engine.relaxed())
            && control.passes == Passes::One
        {
            engine.account(work);
            return Run { iterations: k, ending: Ending::Stagnated, error: None };
        }
        let stagnated = stagnation.seen([residuals.merit()], k);
        if stagnated && let Engine::Single(_) = &engine {
            // What is left may be rounding.
            engine.account(work);
            let metric_scale = engine.metric_scale();
            engine = Engine::double(double, task, now, metric_scale);
        } else if stagnated && residuals.merit() > HAND_OVER_ABOVE {
            engine.account(work);
            return Run { iterations: k, ending: Ending::Stagnated, error: None };
        } else {
            engine.renew(task, now, buffers);
        }
    }
    engine.account(work);
    Run { iterations: k, ending: Ending::Exhausted, error: None }
}

impl<'a> Engine<'a> {
    fn single(state: &'a mut SingleRelaxation, task: &Task, at: &Iterate, level: bool) -> Engine<'a> {
        state.start(task, at, FIRST_SCALE, level);
        Engine::Single(state)
    }

    fn double(state: &'a mut DoubleRelaxation, task: &Task, at: &Iterate, metric_scale: f64) -> Engine<'a> {
        state.start(task, at, metric_scale);
        Engine::Double(state)
    }

    fn advance(&mut self, task: &Task, iterations: u32, passes: u32) {
        match self {
            Engine::Single(e) => e.advance(task, iterations, passes),
            Engine::Double(e) => e.advance(task, iterations, passes),
        }
    }

    fn measure(&mut self, task: &Task, now: &mut Iterate, buffers: &mut MeasureBuffers) -> Residuals {
        match self {
            Engine::Single(e) => e.measure(task, now, buffers),
            Engine::Double(e) => e.measure(task, now, buffers),
        }
    }

    fn renew(&mut self, task: &Task, now: &Iterate, buffers: &MeasureBuffers) {
        match self {
            Engine::Single(e) => e.renew(task, now, buffers),
            Engine::Double(e) => e.renew(task, buffers),
        }
    }

    /// Contacts that a pass relaxes.
    fn relaxed(&self) -> usize {
        match self {
            Engine::Single(e) => e.relaxed(),
            Engine::Double(e) => e.relaxed(),
        }
    }

    fn metric_scale(&self) -> f64 {
        match self {
            Engine::Single(e) => e.metric_scale(),
            Engine::Double(e) => e.metric_scale(),
        }
    }

    /// Adds the work done to `work`, once, at the end.
    fn account(&self, work: &mut Work) {
        let done = match self {
            Engine::Single(e) => e.work(),
            Engine::Double(e) => e.work(),
        };
        work.blocks += done.blocks;
        work.contacts += done.contacts;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::{RowSet, Translations};
    use crate::linalg::BlockMatrix;
    use crate::math::IDENTITY;

    /// The iteration at which a run with so many components, measured every ten iterations, is told that it stagnates.
    fn stagnates_at(components: u32) -> Option<u32> {
        let pairs = (0..components).flat_map(|c| [(2 * c, 2 * c + 1), (2 * c + 1, 2 * c)]);
        let mut matrix = BlockMatrix::from_places(2 * components as usize, pairs.collect());
        matrix.values.fill(IDENTITY);
        let blocks = matrix.rows();
        let translations = Translations::new(&matrix, &vec![true; blocks]);
        let problem = ContactProblem {
            matrix: &matrix,
            inverse_diagonal: &vec![IDENTITY; blocks],
            rows: &RowSet::default(),
            translations: Some(&translations),
            velocity_scale: 1.0,
        };
        let mut schedule = PassSchedule::new(&problem, Passes::One);
        (10..200).step_by(10).find(|k| schedule.observe(1.0, *k, 1000))
    }

    #[test]
    fn folds_of_one_cloth_are_handed_over_sooner_than_heaps() {
        assert_eq!([1, 2, 9].map(stagnates_at), [Some(30), Some(40), Some(40)]);
    }
}
