//! The response of one row: a normal impulse, and Coulomb friction within its limit [Harmon10, §2.3].

use crate::constraint::{Angular, Metric, RowSet};
use crate::math::{Mat3, Vec3, ZERO_MATRIX, add, add_scaled, cross, dot, inverse, mat_vec, scale};

/// Share of the friction limit within which a contact sticks.
pub const WELL_WITHIN: f64 = 1.0 - 1e-6;

/// The inverse of the lumped mass of a block; zero where it is infinite.
#[inline]
pub fn inverse_mass(metric: &Metric, block: usize) -> Mat3 {
    if metric.fixed[block] { ZERO_MATRIX } else { inverse(&metric.lumped[block]).unwrap_or(ZERO_MATRIX) }
}

/// Inverse masses by entry of a set of rows.
pub struct EntryMasses {
    /// Of linear entries `[1/kg]`: lumped masses are the same in all directions.
    linear: Vec<f64>,
    /// Of angular entries: inverse world inertias.
    angular: Vec<Mat3>,
}

impl EntryMasses {
    /// The lumped inverse masses of all entries.
    pub fn new(rows: &RowSet, metric: &Metric) -> EntryMasses {
        let linear = |block: &u32| inverse_mass(metric, *block as usize)[0][0];
        let angular = |entry: &Angular| inverse_mass(metric, entry.block as usize);
        EntryMasses {
            linear: rows.blocks.iter().map(linear).collect(),
            angular: rows.angular.iter().map(angular).collect(),
        }
    }
}

/// What an impulse on a row does to it and to its blocks.
pub struct RowResponse {
    /// `K = C M^-1 C^T` in the row's frame `[1/kg]`, by columns.
    columns: [Vec3; 3],
}

impl RowResponse {
    /// The response of row `i` under lumped masses. Cost: three scatters.
    pub fn new(rows: &RowSet, i: usize, masses: &EntryMasses) -> RowResponse {
        let frame = rows.frames[i];
        let columns = frame.map(|axis| {
            let mut u = [0.0; 3];
            for_each_change(rows, i, masses, axis, |entry, change| {
                u = match entry {
                    Entry::Linear(weight, _) => add_scaled(u, weight, change),
                    Entry::Angular(lever, _) => add(u, cross(change, lever)),
                };
            });
            frame.map(|e| dot(e, u))
        });
        RowResponse { columns }
    }

    /// The normal impulse that changes the normal velocity by `change` `[N s]`; `None` without finite mass.
    #[inline]
    pub fn normal_impulse(&self, change: f64) -> Option<f64> {
        let mobility = self.columns[0][0];
        (mobility > 0.0).then(|| change / mobility).filter(|p| p.is_finite())
    }

    /// The impulse `(lambda, gamma1, gamma2)` of a row with relative velocity `u`, and whether it sticks: friction is what
    /// stops the sliding that the normal impulse leaves, scaled down to `mu lambda`.
    ///
    /// Scaled down, and not turned, it never raises the kinetic energy, however anisotropic the masses are.
    pub fn with_friction(&self, u: Vec3, lambda: f64, mu: f64) -> (Vec3, bool) {
        let [n, t1, t2] = self.columns;
        let after = add_scaled(u, lambda, n);
        let determinant = t1[1] * t2[2] - t2[1] * t1[2];
        if mu <= 0.0 || determinant <= 0.0 {
            return ([lambda, 0.0, 0.0], false);
        }
        let stop = [
            -(t2[2] * after[1] - t2[1] * after[2]) / determinant,
            -(t1[1] * after[2] - t1[2] * after[1]) / determinant,
        ];
        let (wanted, limit) = (stop[0].hypot(stop[1]), mu * lambda);
        let share = if wanted > limit { limit / wanted } else { 1.0 };
        ([lambda, share * stop[0], share * stop[1]], wanted <= WELL_WITHIN * limit)
    }

    /// The largest eigenvalue of the tangential part `[1/kg]`: how far friction may go in one step of descent.
    pub fn tangential_mobility(&self) -> f64 {
        let [_, t1, t2] = self.columns;
        let (mean, half) = (0.5 * (t1[1] + t2[2]), 0.5 * (t1[1] - t2[2]));
        mean + half.hypot(0.5 * (t1[2] + t2[1]))
    }
}

/// An entry of a row with its block.
pub enum Entry {
    /// Weight on a linear block.
    Linear(f64, usize),
    /// Lever on an angular block.
    Angular(Vec3, usize),
}

/// Tells for each entry of row `i` how the world impulse `f` on the row changes the velocity of its block.
#[inline]
pub fn for_each_change(rows: &RowSet, i: usize, masses: &EntryMasses, f: Vec3, mut told: impl FnMut(Entry, Vec3)) {
    for k in rows.offsets[i] as usize..rows.offsets[i + 1] as usize {
        let (block, weight) = (rows.blocks[k] as usize, rows.weights[k]);
        told(Entry::Linear(weight, block), scale(weight * masses.linear[k], f));
    }
    for k in rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize {
        let Angular { block, lever } = rows.angular[k];
        told(Entry::Angular(lever, block as usize), mat_vec(&masses.angular[k], cross(lever, f)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::IDENTITY;
    use crate::math::mat_scale;

    /// A vertex of mass 2 against a rigid body of mass 3 with another inertia about each axis, hit off its centre.
    fn pair() -> (RowSet, Metric) {
        let rows = RowSet {
            offsets: vec![0, 2],
            blocks: vec![0, 1],
            weights: vec![1.0, -1.0],
            angular_offsets: vec![0, 1],
            angular: vec![Angular { block: 2, lever: [-0.3, 0.2, 0.5] }],
            frames: vec![[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]],
            ..RowSet::default()
        };
        let inertia = [[0.2, 0.0, 0.0], [0.0, 0.5, 0.1], [0.0, 0.1, 0.9]];
        let lumped = vec![mat_scale(2.0, &IDENTITY), mat_scale(3.0, &IDENTITY), inertia];
        let mut metric = Metric::default();
        (metric.lumped, metric.fixed) = (lumped, vec![false; 3]);
        (rows, metric)
    }

    fn energy(metric: &Metric, v: &[Vec3]) -> f64 {
        metric.lumped.iter().zip(v).map(|(m, v)| 0.5 * dot(*v, mat_vec(m, *v))).sum()
    }

    /// Restitution and friction by solving again for the velocities, with momentum and energy counted by hand.
    #[test]
    fn an_impulse_reflects_the_normal_velocity_and_friction_only_takes() {
        let (rows, metric) = pair();
        let masses = EntryMasses::new(&rows, &metric);
        let response = RowResponse::new(&rows, 0, &masses);
        for restitution in [0.0, 0.4, 1.0] {
            for mu in [0.0, 0.1, 0.7, 50.0] {
                let mut v = vec![[1.0, -2.0, -4.0], [0.5, 0.3, 1.0], [2.0, -1.0, 3.0]];
                let (before, u) = (energy(&metric, &v), rows.velocity(0, &v));
                assert!(u[0] < 0.0);
                let lambda = response.normal_impulse(-(1.0 + restitution) * u[0]).unwrap();
                let (p, sticks) = response.with_friction(u, lambda, mu);
                assert!(p[1].hypot(p[2]) <= mu * lambda * (1.0 + 1e-12));
                let f = rows.impulse(0, p);
                let mut given = vec![[0.0; 3]; 3];
                rows.scatter(0, f, &mut given);
                for_each_change(&rows, 0, &masses, f, |entry, change| {
                    let (Entry::Linear(_, block) | Entry::Angular(_, block)) = entry;
                    let expected = mat_vec(&inverse(&metric.lumped[block]).unwrap(), given[block]);
                    assert!(crate::math::norm(crate::math::sub(change, expected)) < 1e-12);
                    v[block] = add(v[block], change);
                });
                let after = rows.velocity(0, &v);
                assert!(energy(&metric, &v) <= before * (1.0 + 1e-12), "e {restitution} mu {mu}");
                assert!(if mu < 0.5 { !sticks } else { sticks || mu < 1.0 }, "e {restitution} mu {mu}");
                if mu == 0.0 {
                    assert!((after[0] + restitution * u[0]).abs() < 1e-12);
                }
                if sticks {
                    assert!(after[1].hypot(after[2]) < 1e-12, "{after:?}");
                }
            }
        }
    }

    #[test]
    fn a_row_without_finite_mass_takes_no_impulse() {
        let (rows, mut metric) = pair();
        metric.fixed = vec![true; 3];
        let masses = EntryMasses::new(&rows, &metric);
        assert_eq!(RowResponse::new(&rows, 0, &masses).normal_impulse(1.0), None);
    }
}
