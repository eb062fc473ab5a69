//! A zone's velocities projected onto what its collisions allow [Harmon10, §3.5-3.7].

use super::minimum_norm::minimum_norm;
use super::unilateral_projection::unilateral;
use super::zone_factor::LateFactor;
use super::zone_friction::{ContactFriction, zone_friction};
use super::zone_rows::{ZoneBlocks, ZoneRows, inner};
use crate::constraint::{Metric, RowSet};
use crate::math::{Vec3, add};
use crate::model::{FailSafe, ZoneFriction};

/// How often friction and normal response take turns.
const FRICTION_ROUNDS: usize = 2;

/// How a zone answers its collisions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ZoneResponse {
    /// Projection or rigid motion.
    pub fail_safe: FailSafe,
    /// Friction with projections; rigid zones do not slide.
    pub friction: ZoneFriction,
}

/// What a projection came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Projection {
    /// Normal impulse of each row `[N s]`.
    pub normal_impulses: Vec<f64>,
    /// Independent collisions: the rank of the inelastic projection (large zones: steps taken), rows that push of the
    /// unilateral one.
    pub rank: usize,
    /// Largest normal velocity missed, `|∇C q'|` of the inelastic projection `[m/s]`.
    pub residual: f64,
    /// Whether the projection met its tolerance; where scripted parts contradict each other none can.
    pub converged: bool,
}

/// Projects the velocities of the rows `of` (a zone): targets are changes wanted of `velocities`, coupled blocks count
/// with their lumped masses.
///
/// Inelastic: no row approaches or separates; unilateral: none falls short of its target. Then friction, then once more.
/// Without scripted parts the kinetic energy does not rise, and linear momentum holds to rounding. Cost: of
/// the minimum-norm or complementarity solutions, at most three.
pub fn project_zone(
    rows: &RowSet,
    of: &[usize],
    metric: &Metric,
    response: &ZoneResponse,
    velocities: &mut [Vec3],
) -> Projection {
    let targets: Vec<f64> = of.iter().map(|row| rows.normal_targets[*row]).collect();
    let projected = project(rows, of, &targets, &vec![0.0; of.len()], metric, response);
    projected.add_to(velocities);
    projected.result
}

/// A projection that is not applied yet.
pub(super) struct Projected {
    blocks: ZoneBlocks,
    y: Vec<Vec3>,
    /// What it came to.
    pub result: Projection,
}

impl Projected {
    /// Applies it.
    pub fn add_to(&self, velocities: &mut [Vec3]) {
        self.blocks.add_to(&self.y, velocities);
    }
}

/// [`project_zone`] with targets of its own, from a guess of the normal impulses.
pub(super) fn project(
    rows: &RowSet,
    of: &[usize],
    targets: &[f64],
    guess: &[f64],
    metric: &Metric,
    response: &ZoneResponse,
) -> Projected {
    let blocks = ZoneBlocks::new(rows, of, metric);
    let normals = ZoneRows::new(rows, of, 0..1, &blocks);
    let demand: Vec<f64> = targets.iter().zip(&normals.scales).map(|(target, s)| s * target).collect();
    let inverse = |s: f64| if s > 0.0 { 1.0 / s } else { 0.0 };
    let guess: Vec<f64> = guess.iter().zip(&normals.scales).map(|(g, s)| g * inverse(*s)).collect();
    let mut zone = Zone {
        y: vec![[0.0; 3]; normals.width],
        factor: LateFactor::default(),
        normals,
        demand,
        unilateral: response.fail_safe != FailSafe::InelasticProjection,
        result: Projection { normal_impulses: vec![0.0; of.len()], ..Projection::default() },
    };
    zone.respond(&guess);
    // What cannot be met is answered otherwise anyway.
    let rubs = zone.result.converged && of.iter().any(|row| rows.friction[*row] > 0.0);
    match response.friction {
        ZoneFriction::PerContact if rubs => {
            let tangents = ZoneRows::new(rows, of, 1..3, &blocks);
            let sliding = of.iter().map(|row| rows.sliding_velocities[*row]).collect();
            let coefficients = of.iter().map(|row| rows.friction[*row]).collect();
            let mut friction = ContactFriction::new(tangents, sliding, coefficients);
            for _ in 0..FRICTION_ROUNDS {
                friction.apply(&zone.result.normal_impulses, &mut zone.y);
                zone.respond(&[]);
            }
        }
        ZoneFriction::PerZone if rubs => {
            zone.rub_as_one(rows, of, &blocks);
            zone.respond(&[]);
        }
        _ => {}
    }
    if zone.unilateral {
        zone.result.rank = zone.result.normal_impulses.iter().filter(|impulse| **impulse > 0.0).count();
    }
    zone.result.residual = zone.residual();
    Projected { blocks, y: zone.y, result: zone.result }
}

/// A projection under way.
struct Zone {
    normals: ZoneRows,
    /// Of the normals.
    factor: LateFactor,
    /// Wanted `A y`.
    demand: Vec<f64>,
    /// Response so far.
    y: Vec<Vec3>,
    unilateral: bool,
    result: Projection,
}

impl Zone {
    /// Adds the smallest response that meets what is still wanted; searched for from a guess of its multipliers.
    fn respond(&mut self, guess: &[f64]) {
        let left: Vec<f64> =
            (0..self.demand.len()).map(|i| self.demand[i] - self.normals.product(i, &self.y)).collect();
        let (y, multipliers) = if self.unilateral {
            let solution = unilateral(&self.normals, &left, guess, &mut self.factor);
            self.result.converged = solution.converged;
            (solution.y, solution.multipliers)
        } else {
            let solution = minimum_norm(&self.normals, &left, &mut self.factor);
            self.result.rank = solution.rank;
            (solution.y, solution.multipliers)
        };
        self.y.iter_mut().zip(&y).for_each(|(sum, y)| *sum = add(*sum, *y));
        for (i, multiplier) in multipliers.iter().enumerate() {
            self.result.normal_impulses[i] += self.normals.scales[i] * multiplier;
        }
        if !self.unilateral {
            let wanted = self.demand.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            let missed = (0..self.demand.len()).map(|i| (self.demand[i] - self.normals.product(i, &self.y)).abs());
            self.result.converged = missed.fold(0.0, f64::max) <= 1e-6 * wanted;
        }
    }

    /// Largest normal velocity missed `[m/s]`.
    fn residual(&self) -> f64 {
        let of = |i: usize| {
            let missed = (self.demand[i] - self.normals.product(i, &self.y)) / self.normals.scales[i];
            if self.unilateral { missed.max(0.0) } else { missed.abs() }
        };
        (0..self.demand.len()).filter(|i| self.normals.scales[*i] > 0.0).map(of).fold(0.0, f64::max)
    }

    /// One friction limit for the zone: over the contacts that push, or all where impulses may pull.
    fn rub_as_one(&mut self, rows: &RowSet, of: &[usize], blocks: &ZoneBlocks) {
        let impulses = &self.result.normal_impulses;
        let pushing: Vec<usize> = (0..of.len()).filter(|i| !self.unilateral || impulses[*i] > 0.0).collect();
        let weight: f64 = pushing.iter().map(|i| impulses[*i].abs()).sum();
        if weight == 0.0 {
            return;
        }
        // A zone has one coefficient: the mean, weighted by impulse.
        let coefficient = pushing.iter().map(|i| rows.friction[of[*i]] * impulses[*i].abs()).sum::<f64>() / weight;
        let named: Vec<usize> = pushing.iter().map(|i| of[*i]).collect();
        let all = ZoneRows::new(rows, &named, 0..3, blocks);
        let mut relative = Vec::with_capacity(all.len());
        for (k, i) in pushing.iter().enumerate() {
            relative.push(self.normals.product(*i, &self.y) - self.demand[*i]);
            for axis in 0..2 {
                let row = 3 * k + 1 + axis;
                let sliding = rows.sliding_velocities[of[*i]][axis];
                relative.push(all.scales[row] * sliding + all.product(row, &self.y));
            }
        }
        let response = inner(&self.y, &self.y).sqrt();
        zone_friction(&all, &relative, coefficient, response, &mut self.y);
    }
}
