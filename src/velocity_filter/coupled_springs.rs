//! Springs of stage 3 where a matrix couples velocities: what they give is carried on within the step.

use super::row_response::WELL_WITHIN;
use super::stage_rows::StageRows;
use crate::constraint::{Metric, RowSet};
use crate::linalg::{GradientBuffers, conjugate_gradient};
use crate::math::{
    IDENTITY, Mat3, Vec3, ZERO_MATRIX, add, add_scaled, dot, inverse, mat_add, mat_mul, mat_scale, mat_vec, outer,
    skew, sub, transpose,
};
use crate::parallel::Par;

/// Stiffness of a spring below its limit, in units of its contact's effective mass: it leaves of an approach what its
/// impulse is by that.
const STIFFNESS: f64 = 10.0;

/// Newton steps at most.
const NEWTON_STEPS: usize = 12;

/// Newton steps end when the residual is this share of the first.
const SETTLED: f64 = 1e-3;

/// Conjugate gradients of a Newton step: residual, relative to the right side, at which they end, and steps at most.
const GRADIENTS: (f64, u32) = (3e-2, 200);

/// Evaluations of a line search at most.
const TRIALS: usize = 10;

/// Slope, relative to that at the start, with which a line search is content.
const LEVEL: f64 = 0.3;

/// Mass that a contact feels along its normal under the diagonal of the metric `[kg]`; `None` without finite mass.
pub fn effective_mass(rows: &RowSet, row: usize, metric: &Metric) -> Option<f64> {
    let mut mobility = 0.0;
    for_each_entry(rows, row, |block, entry| {
        let felt = mat_vec(&transpose(&entry), rows.frames[row][0]);
        mobility += dot(felt, mat_vec(&metric.inverse_diagonal[block], felt));
    });
    (mobility > 0.0).then(|| 1.0 / mobility).filter(|m| m.is_finite())
}

/// Tells for each block that a row feels the matrix `E` by which it feels it: `u = sum E v`.
fn for_each_entry(rows: &RowSet, row: usize, mut told: impl FnMut(usize, Mat3)) {
    for k in rows.offsets[row] as usize..rows.offsets[row + 1] as usize {
        told(rows.blocks[k] as usize, mat_scale(rows.weights[k], &IDENTITY));
    }
    for a in &rows.angular[rows.angular_offsets[row] as usize..rows.angular_offsets[row + 1] as usize] {
        told(a.block as usize, mat_scale(-1.0, &skew(a.lever)));
    }
}

/// Gives the springs their impulses under the matrix of the metric, and the rows the change of velocity that these make.
///
/// A spring gives in proportion to what it misses of the separation asked for, between nothing and its limit; friction
/// likewise against sliding, within the coefficient times what the spring gives. With these limits fixed that is the
/// lowest point of a convex function over `A`: Newton steps with a line search, after which they are renewed. Momentum
/// holds to rounding. Cost: a few dozen products with A.
pub fn settle_coupled(stage: &mut StageRows, limits: &[f64], metric: &Metric, par: Par) {
    let n = metric.lumped.len();
    let product = |v: &[Vec3]| par.map_indexed(n, |i| metric.matrix.row_product(i, v));
    let inner = |a: &[Vec3], b: &[Vec3]| par.sum(n, |i| dot(a[i], b[i]));
    let mut springs = Springs::new(stage, limits, metric);
    let (mut dv, mut first, mut buffers) = (vec![[0.0; 3]; n], 0.0, GradientBuffers::default());
    let mut balance = (Vec::new(), Vec::new());
    for number in 0..=NEWTON_STEPS {
        springs.feel(&dv);
        balance = (springs.given(n), product(&dv));
        let residual: Vec<Vec3> = balance.0.iter().zip(&balance.1).map(|(f, p)| sub(*f, *p)).collect();
        let size = par.sum(n, |i| dot(residual[i], mat_vec(&metric.inverse_diagonal[i], residual[i])));
        first = if number == 0 { size } else { first };
        if size <= SETTLED * SETTLED * first || number == NEWTON_STEPS {
            break;
        }
        let direction = springs.newton_direction(&residual, metric, &mut buffers, par);
        let (slope, curvature) = (inner(&direction, &balance.1), inner(&direction, &product(&direction)));
        let way = springs.lowest(&direction, slope, curvature);
        if way == 0.0 {
            break;
        }
        dv.iter_mut().zip(&direction).for_each(|(v, d)| *v = add_scaled(*v, way, *d));
    }
    let mut missing = Vec::new();
    metric.translations.missing(&balance.0, &balance.1, &mut missing);
    metric.translations.translate(&missing, &mut dv);
    let Springs { impulses, sticks, .. } = springs;
    stage.respond(impulses, sticks, dv);
}

/// The springs at a change of velocity.
struct Springs<'a> {
    rows: &'a RowSet,
    /// Relative velocities without response, less the separation asked for.
    unconstrained: Vec<Vec3>,
    /// Impulse of each at most `[N s]`.
    limits: &'a [f64],
    /// Impulse of each per missed velocity `[kg]`.
    stiffness: Vec<f64>,
    /// Friction of each at most `[N s]`.
    friction: Vec<f64>,
    /// Relative velocities, less the separation asked for.
    missed: Vec<Vec3>,
    impulses: Vec<Vec3>,
    sticks: Vec<bool>,
}

impl<'a> Springs<'a> {
    fn new(stage: &'a StageRows, limits: &'a [f64], metric: &Metric) -> Springs<'a> {
        let (rows, count) = (&stage.built.rows, stage.len());
        let missed = |row: usize| sub(stage.velocity(row), [stage.separations[row], 0.0, 0.0]);
        let stiffness = |row: usize| STIFFNESS * effective_mass(rows, row, metric).unwrap_or(0.0);
        let unconstrained: Vec<Vec3> = (0..count).map(missed).collect();
        Springs {
            rows,
            missed: unconstrained.clone(),
            unconstrained,
            limits,
            stiffness: (0..count).map(stiffness).collect(),
            friction: vec![0.0; count],
            impulses: vec![[0.0; 3]; count],
            sticks: vec![false; count],
        }
    }

    /// Takes the springs to a change of velocity, their friction within what they give there.
    fn feel(&mut self, dv: &[Vec3]) {
        for row in 0..self.rows.len() {
            self.missed[row] = add(self.unconstrained[row], self.rows.velocity(row, dv));
            self.friction[row] = self.rows.friction[row] * self.push(row, self.missed[row][0]);
            self.impulses[row] = self.impulse(row, self.missed[row]);
            let [_, s1, s2] = self.missed[row];
            self.sticks[row] = self.stiffness[row] * s1.hypot(s2) <= WELL_WITHIN * self.friction[row];
        }
    }

    /// Share of its stiffness that friction keeps within its limit.
    fn friction_share(&self, row: usize, [_, s1, s2]: Vec3) -> f64 {
        let wanted = self.stiffness[row] * s1.hypot(s2);
        if wanted > self.friction[row] { self.friction[row] / wanted } else { 1.0 }
    }

    /// The normal impulse of a spring that misses so much.
    fn push(&self, row: usize, missed: f64) -> f64 {
        (-self.stiffness[row] * missed).clamp(0.0, self.limits[row])
    }

    /// The impulse of a spring that misses so much, friction within its limit.
    fn impulse(&self, row: usize, missed: Vec3) -> Vec3 {
        let (k, share) = (self.stiffness[row], self.friction_share(row, missed));
        [self.push(row, missed[0]), -k * share * missed[1], -k * share * missed[2]]
    }

    /// What all give to each of the blocks.
    fn given(&self, blocks: usize) -> Vec<Vec3> {
        let mut out = vec![[0.0; 3]; blocks];
        for (row, p) in self.impulses.iter().enumerate().filter(|(_, p)| **p != [0.0; 3]) {
            self.rows.scatter(row, self.rows.impulse(row, *p), &mut out);
        }
        out
    }

    /// How the impulse of a row falls with its relative velocity, world frame `[kg]`; `None` where it does not.
    fn tangent(&self, row: usize) -> Option<Mat3> {
        let (k, [normal, t1, t2]) = (self.stiffness[row], self.rows.frames[row]);
        let pushes = -k * self.missed[row][0];
        let along = if pushes > 0.0 && pushes < self.limits[row] { k } else { 0.0 };
        let across = if self.friction[row] > 0.0 { k * self.friction_share(row, self.missed[row]) } else { 0.0 };
        let sliding = mat_scale(across, &mat_add(&outer(t1, t1), &outer(t2, t2)));
        (along > 0.0 || across > 0.0).then(|| mat_add(&mat_scale(along, &outer(normal, normal)), &sliding))
    }

    /// `(A + C^T K C)^-1 residual`, roughly.
    fn newton_direction(
        &self,
        residual: &[Vec3],
        metric: &Metric,
        buffers: &mut GradientBuffers,
        par: Par,
    ) -> Vec<Vec3> {
        let rows = self.rows;
        let tangents: Vec<(usize, Mat3)> = (0..rows.len()).filter_map(|row| Some((row, self.tangent(row)?))).collect();
        let n = residual.len();
        let mut diagonal: Vec<Mat3> = (0..n).map(|i| *metric.matrix.diagonal_block(i)).collect();
        for (row, tangent) in &tangents {
            for_each_entry(rows, *row, |block, entry| {
                let felt = mat_mul(&transpose(&entry), &mat_mul(tangent, &entry));
                diagonal[block] = mat_add(&diagonal[block], &felt);
            });
        }
        let free = |i: &usize| !metric.fixed[*i];
        let inverses: Vec<Mat3> =
            (0..n).map(|i| Some(i).filter(free).and_then(|i| inverse(&diagonal[i])).unwrap_or(ZERO_MATRIX)).collect();
        let apply = |d: &[Vec3], out: &mut [Vec3]| {
            metric.matrix.product(d, out, par);
            for (row, tangent) in &tangents {
                rows.scatter(*row, mat_vec(tangent, rows.relative_velocity(*row, d)), out);
            }
        };
        let precondition = |r: &[Vec3], out: &mut [Vec3]| par.map_into(out, |i| mat_vec(&inverses[i], r[i]));
        let mut direction = vec![[0.0; 3]; n];
        conjugate_gradient(apply, precondition, residual, &mut direction, true, GRADIENTS, buffers, par);
        direction
    }

    /// How far to go along a direction until the function is nearly level; 0 unless it falls. `slope` and `curvature`
    /// are those of the metric.
    fn lowest(&self, direction: &[Vec3], slope: f64, curvature: f64) -> f64 {
        let speeds: Vec<Vec3> = (0..self.rows.len()).map(|row| self.rows.velocity(row, direction)).collect();
        let rise = |way: f64| {
            let springs = speeds
                .iter()
                .enumerate()
                .map(|(row, speed)| dot(self.impulse(row, add_scaled(self.missed[row], way, *speed)), *speed));
            slope + way * curvature - springs.sum::<f64>()
        };
        let start = rise(0.0);
        if start >= 0.0 || !start.is_finite() {
            return 0.0;
        }
        let (mut low, mut high, mut way) = (0.0, f64::INFINITY, 1.0);
        for _ in 0..TRIALS {
            let here = rise(way);
            if here.abs() <= -LEVEL * start {
                break;
            }
            *(if here < 0.0 { &mut low } else { &mut high }) = way;
            way = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * way };
        }
        way
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::constraint::BuiltRows;
    use crate::linalg::BlockMatrix;
    use crate::math::{norm, scale};

    /// A chain of equal masses on springs.
    pub fn chain(n: usize, mass: f64, stiffness: f64) -> Metric {
        let places = (1..n as u32).flat_map(|i| [(i, i - 1), (i - 1, i)]).collect();
        let mut matrix = BlockMatrix::from_places(n, places);
        for i in 0..n as u32 {
            let neighbours = [i.checked_sub(1), Some(i + 1).filter(|j| *j < n as u32)];
            let own = mass + stiffness * neighbours.iter().flatten().count() as f64;
            let place = matrix.place(i, i);
            matrix.values[place] = mat_scale(own, &IDENTITY);
            for j in neighbours.into_iter().flatten() {
                let place = matrix.place(i, j);
                matrix.values[place] = mat_scale(-stiffness, &IDENTITY);
            }
        }
        let mut metric = Metric::default();
        metric.inverse_diagonal = (0..n).map(|i| inverse(matrix.diagonal_block(i)).unwrap()).collect();
        metric.lumped = vec![mat_scale(mass, &IDENTITY); n];
        metric.fixed = vec![false; n];
        metric.translations = crate::constraint::Translations::new(&matrix, &vec![true; n]);
        metric.translations.update(&matrix);
        metric.matrix = matrix;
        metric
    }

    /// Rows between neighbours `(block, next)` or of one block, that approach along `normal` at `speed` and slide at 0.3.
    pub fn stage(metric: &Metric, contacts: &[(u32, Option<u32>, f64)], friction: f64) -> StageRows {
        let mut built = BuiltRows::default();
        let rows = &mut built.rows;
        (rows.offsets, rows.angular_offsets) = (vec![0], vec![0]);
        for (i, (block, other, speed)) in contacts.iter().enumerate() {
            rows.blocks.push(*block);
            rows.weights.push(1.0);
            if let Some(other) = other {
                rows.blocks.push(*other);
                rows.weights.push(-1.0);
            }
            rows.offsets.push(rows.blocks.len() as u32);
            rows.angular_offsets.push(0);
            let normal = [0.6, 0.0, if i % 2 == 0 { 0.8 } else { -0.8 }];
            let (t1, t2) = crate::math::tangents(normal);
            rows.frames.push([normal, t1, t2]);
            rows.normal_targets.push(*speed);
            rows.sliding_velocities.push([0.3, -0.1]);
            rows.friction.push(friction);
            built.contact.push(i as u32);
        }
        StageRows::new(built, metric)
    }

    /// What a push on one end of a stiff chain takes is the momentum of all of it, not that of the mass that is touched.
    #[test]
    fn a_stiff_chain_is_stopped_as_a_whole() {
        let (n, mass) = (12, 0.25);
        let metric = chain(n, mass, 1e4);
        let mut rows = stage(&metric, &[(0, None, 2.0)], 0.0);
        let spring = STIFFNESS * effective_mass(&rows.built.rows, 0, &metric).unwrap();
        settle_coupled(&mut rows, &[f64::INFINITY], &metric, Par::Serial);
        let whole = n as f64 * mass;
        assert!((rows.impulses[0][0] / (2.0 * whole) - 1.0).abs() < 1e-2 + whole / spring, "{:?}", rows.impulses);
        let change = rows.coupled_change().unwrap();
        let momentum = change.iter().fold([0.0; 3], |sum, v| add_scaled(sum, mass, *v));
        let given = rows.built.rows.impulse(0, rows.impulses[0]);
        // Rounding of products with a matrix a hundred thousand times the masses.
        assert!(norm(sub(momentum, given)) < 1e-10 * norm(given));
    }

    /// Against plain descent of the same convex function, springs at their limits included; friction within its own.
    #[test]
    fn springs_end_where_descent_ends() {
        let metric = chain(9, 0.5, 3.0);
        let contacts = [(0, None, 1.0), (2, Some(5), 0.8), (5, None, -0.4), (7, Some(3), 2.0), (8, None, 0.5)];
        for (friction, limits) in [(0.0, [9.0, 0.05, 9.0, 9.0, 9.0]), (0.4, [9.0, 0.3, 9.0, 0.2, 9.0])] {
            let mut rows = stage(&metric, &contacts, friction);
            settle_coupled(&mut rows, &limits, &metric, Par::Serial);
            let before = stage(&metric, &contacts, friction);
            let mut springs = Springs::new(&before, &limits, &metric);
            let mut dv = vec![[0.0; 3]; 9];
            for _ in 0..20_000 {
                springs.feel(&dv);
                let given = springs.given(9);
                for (i, v) in given.iter().enumerate() {
                    let force = sub(*v, metric.matrix.row_product(i, &dv));
                    dv[i] = add(dv[i], scale(0.004, force));
                }
            }
            let found = rows.coupled_change().unwrap();
            let largest = dv.iter().fold(0.0, |m: f64, v| m.max(norm(*v)));
            for (a, b) in found.iter().zip(&dv) {
                assert!(norm(sub(*a, *b)) < 5e-3 * largest, "friction {friction}: {found:?} {dv:?}");
            }
            for (p, limit) in rows.impulses.iter().zip(limits) {
                assert!(p[0] >= 0.0 && p[0] <= limit && p[1].hypot(p[2]) <= friction * p[0] * (1.0 + 1e-12), "{p:?}");
            }
            assert!(rows.impulses[1][0] == limits[1] && rows.impulses[2][0] == 0.0, "{:?}", rows.impulses);
        }
    }
}
