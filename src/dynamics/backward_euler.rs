//! Unconstrained velocities of the bodies that the library drives: what a host would push for its own.

use super::assembly::{Assembled, Surroundings, assemble};
use super::rigid_body::free_angular_velocity;
use crate::energy::Pattern;
use crate::kinematics::world_inertia;
use crate::linalg::{BlockMatrix, EnvelopeCholesky, GradientEnding, MixedGradient};
use crate::math::{Vec3, add, add_scaled, lerp, mat_vec, scale, sub};
use crate::model::{ByBody, Drives, Dynamics, Kind, Model, Segment, System, write_by_body};
use crate::parallel::Par;

/// Residual of the unconstrained solve, relative to that of standing at the old velocity, in the norm of the inverse
/// diagonal. What it leaves of the velocity change is well below what the contact solver's tolerance does.
pub const TOLERANCE: f64 = 1e-3;

/// Steps of conjugate gradients at most, per node and in all: beyond, the velocity reached is used and reported.
const STEPS_PER_NODE: usize = 3;
const STEPS_MAX: usize = 2000;

/// Steps of conjugate gradients that a direct factor may cost to be taken first.
const DIRECT_STEPS: usize = 40;

/// Block products that a direct factor may cost where conjugate gradients have failed.
const DIRECT_WORK: usize = 20_000_000;

/// Accelerations beyond gravity that an unconstrained solve found, by body key: where the next one starts.
pub type Accelerations = ByBody;

/// What a segment of a step is driven with once the library has driven its own bodies; reused from step to step.
#[derive(Clone, Debug, Default)]
pub struct Unconstrained {
    /// The host's drives, with velocities and matrices of MODEL bodies filled in.
    pub drives: Drives,
    /// Steps of conjugate gradients, summed over bodies.
    pub iterations: u32,
    /// Whether every body met the tolerance.
    pub converged: bool,
    works: Vec<BodyWork>,
}

/// A deformable body's share of the work: its buffers, and what its solve gave.
#[derive(Clone, Debug, Default)]
struct BodyWork {
    body: usize,
    velocities: Vec<Vec3>,
    targets: Vec<Vec3>,
    assembled: Assembled,
    solver: FreeSolver,
    /// Whether conjugate gradients were needed.
    iterated: bool,
    iterations: u32,
    converged: bool,
}

impl Unconstrained {
    /// Assembles and solves every MODEL body over the segment: `A v* = b`, linearised about the start of the segment.
    ///
    /// Pinned nodes go where their script has them at the end of the segment. HOST bodies keep what the host pushed.
    /// `remembered` accelerations only save iterations. Cost: one pass over the stencils, and the solves.
    pub fn assign(&mut self, segment: &Segment, remembered: &Accelerations, par: Par) {
        let (model, host) = (segment.model, segment.drives);
        self.works.resize_with((0..model.bodies.len()).filter(|i| deformable(model, *i)).count(), BodyWork::default);
        let bodies = (0..model.bodies.len()).filter(|i| deformable(model, *i));
        self.works.iter_mut().zip(bodies).for_each(|(work, body)| work.body = body);
        self.take_drives(host);
        for (index, body) in model.bodies.iter().enumerate() {
            if let Some(Dynamics::Rigid { linear_damping, angular_damping }) = body.description.dynamics.as_deref() {
                let moved = rigid_velocity(segment, index, [*linear_damping, *angular_damping]);
                self.drives.velocities[body.blocks.clone()].copy_from_slice(&moved);
            }
        }
        par.within(|| par.for_each_task(&mut self.works, |work| work.run(segment, remembered, par)));
        for work in &self.works {
            self.drives.velocities[model.bodies[work.body].blocks.clone()].copy_from_slice(&work.velocities);
        }
        let systems = &mut self.drives.systems[host.systems.len()..];
        for (work, system) in self.works.iter_mut().zip(systems) {
            std::mem::swap(&mut work.assembled.matrix.values, &mut system.values);
        }
        self.iterations = self.works.iter().map(|w| w.iterations).sum();
        self.converged = self.works.iter().all(|w| w.converged);
    }

    /// The host's drives, with a place for the matrix of each deformable body behind the host's systems.
    fn take_drives(&mut self, host: &Drives) {
        let Drives { velocities, target_positions, target_poses, target_half_spaces, systems, attachments, .. } = host;
        let own = &mut self.drives;
        own.velocities.clone_from(velocities);
        own.target_positions.clone_from(target_positions);
        own.target_poses.clone_from(target_poses);
        own.target_half_spaces.clone_from(target_half_spaces);
        own.attachments.clone_from(attachments);
        (own.gravity, own.wind) = (host.gravity, host.wind);
        own.systems.resize_with(systems.len() + self.works.len(), System::default);
        let (first, rest) = own.systems.split_at_mut(systems.len());
        first.iter_mut().zip(systems).for_each(|(own, host)| own.clone_from(host));
        for (work, system) in self.works.iter_mut().zip(rest) {
            std::mem::swap(&mut work.assembled.matrix.values, &mut system.values);
        }
    }

    /// Writes the accelerations beyond gravity of the bodies that took iterations over the segment last solved.
    pub fn keep_accelerations(&self, segment: &Segment, out: &mut Accelerations) {
        let of_works = self.works.iter().filter(|work| work.iterated).map(|work| {
            let body = &segment.model.bodies[work.body];
            let old = &segment.start.velocities[body.blocks.clone()];
            let acceleration =
                |(v, u): (&Vec3, &Vec3)| sub(scale(1.0 / segment.dt, sub(*v, *u)), segment.drives.gravity);
            (body.description.key, work.velocities.iter().zip(old).map(acceleration))
        });
        write_by_body(out, of_works);
    }
}

/// Whether the library drives the body, and it deforms.
fn deformable(model: &Model, body: usize) -> bool {
    matches!(model.bodies[body].description.dynamics.as_deref(), Some(Dynamics::Deformable { .. }))
}

impl BodyWork {
    fn run(&mut self, segment: &Segment, remembered: &Accelerations, par: Par) {
        let (body, start) = (&segment.model.bodies[self.body], segment.start);
        let Kind::Deformable { masses, pinned } = &body.description.kind else { return };
        let Some(Dynamics::Deformable { forces, pattern }) = body.description.dynamics.as_deref() else { return };
        let known = remembered.iter().find(|(key, _)| *key == body.description.key);
        let accelerations = known.filter(|(_, a)| a.len() == body.blocks.len()).map_or(&[][..], |(_, a)| a);
        let BodyWork { velocities: v, targets, assembled, solver, .. } = &mut *self;
        let x = &start.positions[body.nodes()];
        let old = &start.velocities[body.blocks.clone()];
        v.clear();
        v.extend_from_slice(old);
        targets.clear();
        let moving = &segment.drives.attachments[body.attachments.clone()];
        targets.extend(moving.iter().map(|[from, to]| lerp(*from, *to, segment.to)));
        let around = Surroundings { gravity: segment.drives.gravity, wind: segment.drives.wind };
        let dt = segment.dt;
        assemble(forces, pattern, masses, (x, v), targets, &around, dt, assembled, par);
        for (i, node) in body.nodes().enumerate().filter(|(i, _)| pinned[*i]) {
            let end = segment.scripted(node, segment.to);
            v[i] = scale(1.0 / dt, sub(end, x[i]));
        }
        let guess = |i: usize| {
            let beyond = accelerations.get(i).map_or(around.gravity, |a| add(*a, around.gravity));
            add_scaled(old[i], dt, beyond)
        };
        let found = solver.solve(pattern, &assembled.matrix, &assembled.right, pinned, guess, v, par);
        (self.iterated, self.iterations, self.converged) = found;
    }
}

/// Buffers of the solve of one body; capacity only.
#[derive(Clone, Debug, Default)]
pub struct FreeSolver {
    gradient: MixedGradient,
    factor: EnvelopeCholesky,
    change: Vec<Vec3>,
    buffer: Vec<Vec3>,
}

impl FreeSolver {
    /// Solves `A v = b` for the nodes that are not `pinned`, until the residual is [`TOLERANCE`] of that of the given `v`:
    /// whether it took conjugate gradients, their steps, and whether it got there. Pinned nodes keep their `v`.
    ///
    /// A direct factor where it costs no more than 40 steps of conjugate gradients would, and where those do not
    /// get there if its envelope is of moderate size; else conjugate gradients with the inverse diagonal blocks, from
    /// `guess`. A matrix that is not positive definite leaves what was reached.
    pub fn solve(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix,
        right: &[Vec3],
        pinned: &[bool],
        guess: impl Fn(usize) -> Vec3,
        v: &mut [Vec3],
        par: Par,
    ) -> (bool, u32, bool) {
        let envelope = &pattern.envelope;
        // A product of blocks is three products with a vector.
        let cheap = 3 * envelope.work() <= DIRECT_STEPS * matrix.columns.len();
        if cheap && self.direct(pattern, matrix, right, pinned, v, par) {
            return (false, 0, true);
        }
        self.gradient.prepare(matrix, pinned, par);
        let target = TOLERANCE * TOLERANCE * self.gradient.residual_squared(matrix, right, v, par);
        (0..v.len()).filter(|i| !pinned[*i]).for_each(|i| v[i] = guess(i));
        let steps_max = (STEPS_PER_NODE * pinned.len() + 10).min(STEPS_MAX) as u32;
        let (steps, ending) = self.gradient.solve(matrix, right, v, (target, steps_max), par);
        let mut converged = ending == GradientEnding::Converged;
        if !converged && !cheap && envelope.work() <= DIRECT_WORK {
            converged = self.direct(pattern, matrix, right, pinned, v, par);
        }
        (true, steps, converged)
    }

    /// By the direct factor; whether there is one.
    fn direct(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix,
        right: &[Vec3],
        pinned: &[bool],
        v: &mut [Vec3],
        par: Par,
    ) -> bool {
        if !self.factor.assign(matrix, &pattern.envelope, pinned) {
            return false;
        }
        self.change.resize(v.len(), [0.0; 3]);
        let start = &*v;
        let residual = |i: usize| sub(right[i], matrix.row_product(i, start));
        par.map_into(&mut self.change, |i| if pinned[i] { [0.0; 3] } else { residual(i) });
        self.factor.solve(&pattern.envelope, &mut self.change, &mut self.buffer);
        v.iter_mut().zip(&self.change).for_each(|(v, d)| *v = add(*v, *d));
        true
    }
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
