//! Full constraint anticipation [Otaduy09, §5.1, Eq. 8]: the dense matrix `B = C A^-1 C^T` by one linear solve per row,
//! then projected Gauss-Seidel on it. A baseline and an oracle: its memory and the cost of a pass are quadratic in the
//! contacts.

use super::friction::{LocalMetric, local_step};
use super::residuals::{Iterate, MeasureBuffers, Task, Work, measure};
use super::stop_test::{Ending, Run, StopTest, Verdict};
use crate::linalg::{GradientBuffers, conjugate_gradient};
use crate::math::{Mat3, Vec3, add, dot, mat_vec, sub};

/// Relative residual of the linear solves, and their steps at most.
const LINEAR_SOLVE: (f64, u32) = (1e-13, 20_000);
/// Passes between two checks.
const CHECK_EVERY: u32 = 10;

/// Runs from `at.p` until the tolerances are met or `iterations_max` passes; leaves the best iterate.
pub(super) fn run(
    task: &Task,
    at: &mut Iterate,
    iterations_max: u32,
    buffers: &mut MeasureBuffers,
    work: &mut Work,
) -> Run {
    let contacts = task.packed.contacts.len();
    let delassus = delassus(task, work);
    let metrics: Vec<LocalMetric> = (0..contacts)
        .map(|c| {
            let g = &delassus[c * contacts + c];
            let mean = |i: usize, j: usize| 0.5 * (g[i][j] + g[j][i]);
            LocalMetric::new([g[0][0], mean(0, 1), mean(0, 2), g[1][1], mean(1, 2), g[2][2]])
        })
        .collect();
    let mut now = at.clone();
    let mut test = StopTest::new();
    let cone = task.settings.friction_cone;
    for k in 1..=iterations_max {
        for c in 0..contacts {
            let contact = &task.packed.contacts[c];
            let mut w = contact.target;
            for (block, p) in delassus[c * contacts..(c + 1) * contacts].iter().zip(&now.p) {
                if *p != [0.0; 3] {
                    w = add(w, mat_vec(block, *p));
                }
            }
            now.p[c] = local_step(&metrics[c], cone, contact.friction, now.p[c], w);
        }
        work.contacts += (contacts * contacts) as u64;
        if k % CHECK_EVERY != 0 && k != iterations_max {
            continue;
        }
        respond(task, &mut now, buffers, work);
        let residuals = measure(task, &now, buffers, work);
        match test.check(task, &now, &residuals, at, buffers, work) {
            Verdict::Converged(e) => return Run { iterations: k, ending: Ending::Converged, error: Some(e) },
            Verdict::Continue => {}
            Verdict::Overflowed => return Run { iterations: k, ending: Ending::Stagnated, error: None },
        }
    }
    Run { iterations: iterations_max, ending: Ending::Exhausted, error: None }
}

/// `dv = A^-1 C^T p`
fn respond(task: &Task, now: &mut Iterate, buffers: &mut MeasureBuffers, work: &mut Work) {
    task.packed.impulses(&now.p, &mut buffers.impulses, task.par);
    let f = &buffers.impulses;
    buffers.contact.resize(now.dv.len(), [0.0; 3]);
    task.par.map_into(&mut buffers.contact, |b| task.packed.incidence.gather(b, f));
    solve_metric(task, &buffers.contact, &mut now.dv, &mut GradientBuffers::default(), work);
}

fn solve_metric(task: &Task, b: &[Vec3], x: &mut [Vec3], buffers: &mut GradientBuffers, work: &mut Work) {
    let (matrix, inverse, par) = (task.problem.matrix, task.problem.inverse_diagonal, task.par);
    let apply = |d: &[Vec3], out: &mut [Vec3]| matrix.product(d, out, par);
    let precondition = |r: &[Vec3], z: &mut [Vec3]| par.map_into(z, |i| mat_vec(&inverse[i], r[i]));
    let (steps, _) = conjugate_gradient(apply, precondition, b, x, true, LINEAR_SOLVE, buffers, par);
    work.blocks += u64::from(steps) * matrix.values.len() as u64;
}

/// `B` by 3x3 blocks, row major over contacts.
fn delassus(task: &Task, work: &mut Work) -> Vec<Mat3> {
    let (packed, rows) = (task.packed, task.problem.rows);
    let contacts = packed.contacts.len();
    let blocks = task.problem.inverse_diagonal.len();
    let mut b = vec![[[0.0; 3]; 3]; contacts * contacts];
    let (mut load, mut response) = (vec![[0.0; 3]; blocks], vec![[0.0; 3]; blocks]);
    let mut buffers = GradientBuffers::default();
    for column in 0..contacts {
        let source = packed.contacts[column].source as usize;
        // Without friction the tangential multipliers stay zero: their columns are never multiplied.
        let axes = if packed.contacts[column].friction > 0.0 { 3 } else { 1 };
        for (axis, direction) in rows.frames[source].iter().enumerate().take(axes) {
            load.fill([0.0; 3]);
            rows.scatter(source, *direction, &mut load);
            solve_metric(task, &load, &mut response, &mut buffers, work);
            for (row, contact) in packed.contacts.iter().enumerate() {
                let w = sub(
                    contact.in_frame(super::packed_contacts::relative_velocity(contact, rows, &response)),
                    contact.target,
                );
                let block = &mut b[row * contacts + column];
                for (entries, w) in block.iter_mut().zip(w) {
                    entries[axis] = w;
                }
            }
        }
    }
    debug_assert!(b.iter().all(|m| dot(m[0], m[0]).is_finite()));
    b
}
