//! Iterative constraint anticipation as published [Otaduy09, §5.2-5.5]: the inner loop relaxes the contacts against a
//! block-Jacobi prediction, the outer loop refines `dv` by one block Gauss-Seidel sweep.

use super::packed_contacts::PassContext;
use super::residuals::{Iterate, MeasureBuffers, Residuals, Task, Work, contact_residuals, measure};
use super::stop_test::{Ending, Run, StopTest, Verdict};
use crate::linalg::gauss_seidel_sweep;
use crate::math::{Vec3, add, mat_vec, sub};

/// Change between two iterations below which the paper stops [Otaduy09, §5.5].
const PAPER_CHANGE: f64 = 0.05;
/// Passes of the inner loop at most [Otaduy09, §5.3: "less than 10 in 90% of the cases"].
const PAPER_PASSES: u32 = 10;
/// Outer iterations between two checks of the stop test.
const CHECK_EVERY: u32 = 5;

/// The inner loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Inner {
    /// Repeats per contact as the settings say, passes until the residuals change by less than 5 %.
    Paper,
    /// One pass, one local step per contact.
    Light,
}

/// Runs from `at`, which is replaced by the best iterate; also returns the outer iterations at which the paper's
/// criterion would have stopped (0: never).
///
/// The criterion looks at changes: it also holds where the residuals stand still far from a solution, so it is only
/// reported. Its clause on the distance along the normal needs positions, which this problem does not have.
pub(super) fn run(
    task: &Task,
    inner: Inner,
    at: &mut Iterate,
    iterations_max: u32,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> (Run, u32) {
    let inverse = task.problem.inverse_diagonal;
    let mut now = at.clone();
    let mut test = StopTest::new();
    let mut predicted = vec![[0.0; 3]; at.dv.len()];
    let (mut before, mut paper) = (None, 0);
    let mut metrics = Vec::new();
    task.packed.metrics(task.problem.rows, inverse, &mut metrics, task.par);
    measure(task, &now, buffers, work);
    for k in 1..=iterations_max {
        {
            let (q, y, dv) = (&buffers.contact, &buffers.product, &now.dv);
            task.par.map_into(&mut predicted, |b| add(dv[b], mat_vec(&inverse[b], sub(q[b], y[b]))));
        }
        let repeats = if inner == Inner::Paper { task.settings.ablation.repeats.max(1) } else { 1 };
        let (rows, cone) = (task.problem.rows, task.settings.friction_cone);
        let cx = PassContext { rows, inverse, metrics: &metrics, cone, repeats, par: task.par };
        relax(task, inner, &cx, &mut now.p, &mut predicted, work);
        task.packed.impulses(&now.p, &mut buffers.impulses, task.par);
        let f = &buffers.impulses;
        task.par.map_into(&mut buffers.contact, |b| task.packed.incidence.gather(b, f));
        gauss_seidel_sweep(task.problem.matrix, inverse, &buffers.contact, &mut now.dv);
        work.blocks += task.problem.matrix.values.len() as u64;
        let residuals = measure(task, &now, buffers, work);
        if paper == 0 && before.is_some_and(|b| paper_stops(&b, &residuals)) {
            paper = k;
        }
        before = Some(residuals);
        if k % CHECK_EVERY != 0 && k != iterations_max && residuals.merit().is_finite() {
            continue;
        }
        match test.check(task, &now, &residuals, at, buffers, work) {
            Verdict::Converged(e) => return (Run { iterations: k, ending: Ending::Converged, error: Some(e) }, paper),
            Verdict::Continue => {}
            Verdict::Overflowed => {
                return (Run { iterations: k, ending: Ending::Stagnated, error: None }, paper);
            }
        }
    }
    (Run { iterations: iterations_max, ending: Ending::Exhausted, error: None }, paper)
}

/// The inner loop: passes over all contacts.
fn relax(task: &Task, inner: Inner, cx: &PassContext, p: &mut [Vec3], predicted: &mut [Vec3], work: &mut Work) {
    let mut before = f64::INFINITY;
    let passes = if inner == Inner::Paper { PAPER_PASSES } else { 1 };
    for pass in 1..=passes {
        work.contacts += task.packed.pass(cx, None, p, predicted);
        if pass == passes {
            break;
        }
        let r = contact_residuals(task, predicted, p).contact_energy.sqrt();
        work.contacts += p.len() as u64;
        if (before - r).abs() <= PAPER_CHANGE * before {
            break;
        }
        before = r;
    }
}

/// Whether all residuals changed by less than 5 % between two iterations.
fn paper_stops(before: &Residuals, now: &Residuals) -> bool {
    let small = |a: f64, b: f64| (a - b).abs() <= PAPER_CHANGE * a;
    small(before.normal, now.normal) && small(before.friction, now.friction) && small(before.dynamics, now.dynamics)
}
