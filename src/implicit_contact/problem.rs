//! The frictional contact problem [Otaduy09, Eq. 7] over one metric, and the one signature of its solvers.

use crate::constraint::RowSet;
use crate::linalg::BlockMatrix;
use crate::math::{Mat3, Vec3};
use crate::model::Settings;
use crate::parallel::Par;

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
    /// Estimated `|dv - dv_exact| / |dv_exact|`.
    pub velocity_error: f64,
    /// Outer iterations at which the paper's 5 % criterion would have stopped [Otaduy09, §5.5]; 0 if never.
    pub paper_iterations: u32,
}

/// Buffers of the solvers: capacity only, emptying it changes no bit.
#[derive(Default)]
pub struct SolverScratch {}

/// Solves the problem with the solver that the settings choose.
///
/// `impulses` holds a warm start on entry (zero for new contacts) and the multipliers on return; `dv` likewise.
/// Always ends: at most `settings.iterations_max` outer iterations.
pub fn solve(
    _problem: &ContactProblem,
    _impulses: &mut [Vec3],
    _dv: &mut [Vec3],
    _settings: &Settings,
    _scratch: &mut SolverScratch,
    _par: Par,
) -> SolverReport {
    SolverReport::default()
}
