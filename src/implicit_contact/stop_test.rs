//! When to stop: meaningful residuals first, then the estimated velocity error; and the best iterate seen.

use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work, contact_residuals};
use super::velocity_error::velocity_error;

/// Share of the contact tolerance that a translation is too small to count.
const ROUNDING: f64 = 1e-3;

/// How a run of a solver ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// Tolerances met.
    Converged,
    /// The residual no longer falls: time for another solver.
    Stagnated,
    /// Work cap.
    Exhausted,
}

/// What a run of a solver reports.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// Iterations made.
    pub iterations: u32,
    /// How it ended.
    pub ending: Ending,
    /// Estimated velocity error of the iterate left in place, where one was made.
    pub error: Option<f64>,
}

/// What to do after a check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Tolerances met by the iterate just checked, with this estimated velocity error.
    Converged(f64),
    /// Go on.
    Continue,
    /// The iterate is not finite: it left the range of its numbers.
    Overflowed,
}

/// The test, over the checks of one run.
pub(super) struct StopTest {
    best: f64,
    /// Error over dynamics residual at the last estimate. It changes slowly, and mostly grows.
    ratio: f64,
}

impl StopTest {
    /// A test that has seen nothing.
    pub fn new() -> StopTest {
        StopTest { best: f64::INFINITY, ratio: 0.0 }
    }

    /// Judges `now`, with its `residuals` and with `A dv`, `C^T p` in the buffers. `best` is replaced when `now` is
    /// better. The estimate costs some iterations, so it is made only once the residuals have passed, and where the
    /// ratio of the last one lets expect that it passes.
    pub fn check(
        &mut self,
        task: &Task,
        now: &Iterate,
        residuals: &Residuals,
        best: &mut Iterate,
        buffers: &mut MeasureBuffers,
        work: &mut Work,
    ) -> Verdict {
        let (merit, settings) = (residuals.merit(), task.settings);
        if !merit.is_finite() {
            return Verdict::Overflowed;
        }
        if merit <= self.best {
            self.best = merit;
            best.clone_from(now);
        }
        let tolerance = settings.velocity_tolerance;
        let passed = residuals.contact() <= settings.contact_tolerance && residuals.dynamics <= tolerance;
        // What the ratio hides is looked at again some time.
        self.ratio *= 0.9;
        if passed && self.ratio * residuals.dynamics <= tolerance {
            // The cheaper question first: rows that do not hold with momentum balanced take more iterations anyway.
            if !balanced(task, now, buffers, work) {
                return Verdict::Continue;
            }
            let error = velocity_error(task, now, residuals, tolerance, buffers, work);
            if error <= tolerance {
                best.p.clone_from(&now.p);
                best.dv.clone_from(&buffers.balanced);
                return Verdict::Converged(error);
            }
            self.ratio = error / residuals.dynamics.max(f64::MIN_POSITIVE);
        }
        Verdict::Continue
    }
}

/// Translates what is coupled by the momentum that it lacks, the softest mode; whether the rows still hold.
fn balanced(task: &Task, at: &Iterate, buffers: &mut MeasureBuffers, work: &mut Work) -> bool {
    let MeasureBuffers { product, contact, balanced, translations: missing, .. } = buffers;
    balanced.clone_from(&at.dv);
    let Some(translations) = task.problem.translations else { return true };
    translations.missing(contact, product, missing);
    let moved = translations.translate(missing, balanced);
    let tolerance = task.settings.contact_tolerance;
    // A row weighs both its sides with one at most.
    if 2.0 * moved <= ROUNDING * tolerance * task.velocity_scale {
        return true;
    }
    work.contacts += at.p.len() as u64;
    contact_residuals(task, balanced, &at.p).contact() <= tolerance
}

/// Watches residuals for stagnation: the iterations since one of them was last halved.
pub(super) struct Stagnation<const N: usize> {
    patience: u32,
    references: [f64; N],
    since: u32,
}

impl<const N: usize> Stagnation<N> {
    /// Stagnation is `patience` iterations in which none of the residuals halves.
    pub fn new(patience: u32) -> Stagnation<N> {
        Stagnation { patience, references: [f64::INFINITY; N], since: 0 }
    }

    /// Whether the residuals have stagnated at `iteration`; if so, the count begins again.
    pub fn seen(&mut self, residuals: [f64; N], iteration: u32) -> bool {
        for (reference, residual) in self.references.iter_mut().zip(residuals) {
            if residual <= 0.5 * *reference {
                *reference = residual;
                self.since = iteration;
            }
        }
        let stagnated = iteration - self.since >= self.patience;
        if stagnated {
            self.since = iteration;
        }
        stagnated
    }
}
