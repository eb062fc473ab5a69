//! Unconstrained velocities of the bodies that the library drives: what a host would push for its own.

use super::assembly::{Assembled, Surroundings, assemble};
use super::rigid_body::free_angular_velocity;
use crate::energy::{Forces, Pattern};
use crate::kinematics::world_inertia;
use crate::linalg::{BlockMatrix, EnvelopeCholesky, GradientBuffers, GradientEnding, conjugate_gradient};
use crate::math::{Mat3, Vec3, add, add_scaled, inverse, lerp, mat_vec, scale, sub};
use crate::model::{Body, Drives, Dynamics, Kind, Segment, System};
use crate::parallel::Par;

/// Residual of the unconstrained solve, relative to that of standing at the old velocity, in the norm of the inverse
/// diagonal.
pub const TOLERANCE: f64 = 1e-6;

/// Steps of conjugate gradients at most, per node and in all: beyond, the velocity reached is used and reported.
const STEPS_PER_NODE: usize = 3;
const STEPS_MAX: usize = 2000;

/// Steps of conjugate gradients that a direct factor may cost to be taken first.
const DIRECT_STEPS: usize = 40;

/// Block products that a direct factor may cost where conjugate gradients have failed.
const DIRECT_WORK: usize = 20_000_000;

/// What a segment of a step is driven with once the library has driven its own bodies.
#[derive(Clone, Debug, Default)]
pub struct Unconstrained {
    /// The host's drives, with velocities and matrices of MODEL bodies filled in.
    pub drives: Drives,
    /// Steps of conjugate gradients, summed over bodies.
    pub iterations: u32,
    /// Whether every body met the tolerance.
    pub converged: bool,
}

/// A body's share of the work.
struct Task<'a> {
    body: &'a Body,
    forces: &'a Forces,
    pattern: &'a Pattern,
    velocities: Vec<Vec3>,
    assembled: Assembled,
    iterations: u32,
    converged: bool,
}

/// Assembles and solves every MODEL body over the segment: `A v* = b`, linearised about the start of the segment.
///
/// Pinned nodes go where their script has them at the end of the segment. HOST bodies keep what the host pushed. Cost:
/// one pass over the stencils, and the solves.
pub fn unconstrained(segment: &Segment, par: Par) -> Unconstrained {
    let (model, host) = (segment.model, segment.drives);
    let mut out = Unconstrained { drives: host.clone(), iterations: 0, converged: true };
    let mut tasks: Vec<Task> = Vec::new();
    for (index, body) in model.bodies.iter().enumerate() {
        match body.description.dynamics.as_deref() {
            Some(Dynamics::Deformable { forces, pattern }) => tasks.push(Task {
                body,
                forces,
                pattern,
                velocities: Vec::new(),
                assembled: Assembled::default(),
                iterations: 0,
                converged: false,
            }),
            Some(Dynamics::Rigid { linear_damping, angular_damping }) => {
                let moved = rigid_velocity(segment, index, [*linear_damping, *angular_damping]);
                out.drives.velocities[body.blocks.clone()].copy_from_slice(&moved);
            }
            None => {}
        }
    }
    par.for_each_task(&mut tasks, |task| task.run(segment, par));
    for task in tasks {
        out.drives.velocities[task.body.blocks.clone()].copy_from_slice(&task.velocities);
        out.iterations += task.iterations;
        out.converged &= task.converged;
        out.drives.systems.push(System { values: task.assembled.matrix.values, ..System::default() });
    }
    out
}

impl Task<'_> {
    fn run(&mut self, segment: &Segment, par: Par) {
        let (body, start) = (self.body, segment.start);
        let Kind::Deformable { masses, pinned } = &body.description.kind else { return };
        let x = &start.positions[body.nodes()];
        let mut v = start.velocities[body.blocks.clone()].to_vec();
        let targets = &segment.drives.attachments[body.attachments.clone()];
        let targets: Vec<Vec3> = targets.iter().map(|[from, to]| lerp(*from, *to, segment.to)).collect();
        let around = Surroundings { gravity: segment.drives.gravity, wind: segment.drives.wind };
        let (dt, out) = (segment.dt, &mut self.assembled);
        assemble(self.forces, self.pattern, masses, (x, &v), &targets, &around, dt, out, par);
        for (i, node) in body.nodes().enumerate().filter(|(i, _)| pinned[*i]) {
            let end = segment.scripted(node, segment.to);
            v[i] = scale(1.0 / dt, sub(end, x[i]));
        }
        (self.iterations, self.converged) = free_velocities(self.pattern, &out.matrix, &out.right, pinned, &mut v, par);
        self.velocities = v;
    }
}

/// Solves `A v = b` for the nodes that are not `pinned`, from the given `v`, which the pinned keep; steps of conjugate
/// gradients made, and whether the residual fell to [`TOLERANCE`] of what it was.
///
/// A direct factor where it costs no more than 40 steps of conjugate gradients would, and where those do not
/// get there if its envelope is of moderate size; else conjugate gradients with the inverse diagonal blocks. A matrix
/// that is not positive definite leaves what was reached.
pub fn free_velocities(
    pattern: &Pattern,
    matrix: &BlockMatrix,
    right: &[Vec3],
    pinned: &[bool],
    v: &mut [Vec3],
    par: Par,
) -> (u32, bool) {
    let free = |i: usize, f: Vec3| if pinned[i] { [0.0; 3] } else { f };
    let residual = par.map_indexed(v.len(), |i| free(i, sub(right[i], matrix.row_product(i, v))));
    let (envelope, entries) = (&pattern.envelope, matrix.columns.len());
    let direct = |change: &mut Vec<Vec3>| {
        let Some(factor) = EnvelopeCholesky::new(matrix, envelope, pinned) else { return false };
        change.clone_from(&residual);
        factor.solve(envelope, change);
        true
    };
    let mut change = vec![[0.0; 3]; v.len()];
    let (mut steps, mut converged) = (0, false);
    // A product of blocks is three products with a vector.
    let cheap = 3 * envelope.work() <= DIRECT_STEPS * entries;
    if cheap {
        converged = direct(&mut change);
    }
    if !converged {
        (steps, converged) = iterate(matrix, &residual, pinned, &mut change, par);
        if !converged && !cheap && envelope.work() <= DIRECT_WORK {
            converged = direct(&mut change);
        }
    }
    v.iter_mut().zip(&change).for_each(|(v, d)| *v = add(*v, *d));
    (steps, converged)
}

/// Conjugate gradients from zero.
fn iterate(matrix: &BlockMatrix, residual: &[Vec3], pinned: &[bool], change: &mut [Vec3], par: Par) -> (u32, bool) {
    let inverse_diagonal: Vec<Mat3> = par.map_indexed(pinned.len(), |i| {
        if pinned[i] { [[0.0; 3]; 3] } else { inverse(matrix.diagonal_block(i)).unwrap_or([[0.0; 3]; 3]) }
    });
    let free = |i: usize, f: Vec3| if pinned[i] { [0.0; 3] } else { f };
    let steps_max = (STEPS_PER_NODE * pinned.len() + 10).min(STEPS_MAX) as u32;
    let (steps, ending) = conjugate_gradient(
        |d, out| par.map_into(out, |i| free(i, matrix.row_product(i, d))),
        |r, out| par.map_into(out, |i| mat_vec(&inverse_diagonal[i], r[i])),
        residual,
        change,
        true,
        (TOLERANCE, steps_max),
        &mut GradientBuffers::default(),
        par,
    );
    (steps, ending == GradientEnding::Converged)
}

/// Linear and angular velocity of a free rigid body at the end of the segment.
fn rigid_velocity(segment: &Segment, index: usize, damping: [f64; 2]) -> [Vec3; 2] {
    let body = &segment.model.bodies[index];
    let first = body.blocks.start;
    let (linear, angular) = (segment.start.velocities[first], segment.start.velocities[first + 1]);
    let Kind::Rigid { mass, inertia } = &body.description.kind else { return [linear, angular] };
    let dt = segment.dt;
    let decay = damping.map(|rate| 1.0 / (1.0 + dt * rate));
    let linear = if mass.is_infinite() { linear } else { add_scaled(linear, dt, segment.drives.gravity) };
    let turned = if inertia.iter().flatten().all(|v| v.is_finite()) {
        let inertia = world_inertia(&segment.start.poses[index], inertia);
        free_angular_velocity(&inertia, scale(decay[1], mat_vec(&inertia, angular)), dt)
    } else {
        angular
    };
    [scale(decay[0], linear), turned]
}
