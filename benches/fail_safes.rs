//! Fail-safe projections of single zones: time and what is missed, against the pivoting methods for linear
//! complementarity problems that [Harmon10, §3.5] found unsatisfactory.
//!
//! `cargo bench --bench fail_safes`: kinds of zones, ten of each size; solved: complementarity below 1e-6 of the largest
//! demand; milliseconds of the processor, the mean of those zones. Baselines: Lemke's method with an artificial variable,
//! Dantzig's in the form of Baraff (1994), each on the dense matrix `C M^-1 C^T` and with the smallest index on ties.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
mod support;

use nalgebra::{DMatrix, DVector};
use signorini::constraint::{Metric, RowSet};
use signorini::fail_safe::{ZoneResponse, project_zone};
use signorini::math::{Mat3, Vec3, add, add_scaled, cross, dot, norm, scale, tangents, unit};
use signorini::model::{FailSafe, ZoneFriction};
use support::clock::thread_seconds;
use support::random::Random;

/// Pivots at most, per row.
const PIVOTS: usize = 50;

const SOLVED: f64 = 1e-6;

struct Zone {
    rows: RowSet,
    metric: Metric,
    velocities: Vec<Vec3>,
}

impl Zone {
    fn new(masses: &[f64], velocities: Vec<Vec3>) -> Zone {
        let block = |m: &f64| -> Mat3 { [[*m, 0.0, 0.0], [0.0, *m, 0.0], [0.0, 0.0, *m]] };
        let mut metric = Metric::default();
        metric.lumped = masses.iter().map(block).collect();
        let rows = RowSet { offsets: vec![0], angular_offsets: vec![0], ..RowSet::default() };
        Zone { rows, metric, velocities }
    }

    fn contact(&mut self, entries: &[(u32, f64)], normal: Vec3) {
        let rows = &mut self.rows;
        entries.iter().for_each(|(b, w)| (rows.blocks.push(*b), rows.weights.push(*w)).0);
        rows.offsets.push(rows.blocks.len() as u32);
        rows.angular_offsets.push(0);
        let n = unit(normal).unwrap();
        let (t1, t2) = tangents(n);
        rows.frames.push([n, t1, t2]);
        let [u, a, b] = rows.velocity(rows.frames.len() - 1, &self.velocities);
        rows.normal_targets.push(-u);
        rows.sliding_velocities.push([a, b]);
        rows.friction.push(0.0);
    }

    /// `C M^-1 C^T` and the demand, rows scaled to unit length.
    fn problem(&self) -> (DMatrix<f64>, DVector<f64>) {
        let k = self.rows.len();
        let mut matrix = DMatrix::zeros(k, k);
        for j in 0..k {
            let mut v = vec![[0.0; 3]; self.velocities.len()];
            self.rows.scatter(j, self.rows.frames[j][0], &mut v);
            v.iter_mut().zip(&self.metric.lumped).for_each(|(v, m)| *v = scale(1.0 / m[0][0], *v));
            (0..k).for_each(|i| matrix[(i, j)] = self.rows.velocity(i, &v)[0]);
        }
        let roots: Vec<f64> = (0..k).map(|i| 1.0 / matrix[(i, i)].sqrt()).collect();
        let demand = DVector::from_fn(k, |i, _| roots[i] * self.rows.normal_targets[i]);
        (DMatrix::from_fn(k, k, |i, j| roots[i] * matrix[(i, j)] * roots[j]), demand)
    }
}

/// Sheets over one another on a plane, each vertex on the one below.
fn stack(layers: usize, side: usize, random: &mut Random) -> Zone {
    let count = layers * side * side;
    let masses: Vec<f64> = (0..count).map(|_| random.between(0.5, 1.5)).collect();
    let fall = |random: &mut Random| add([0.0, 0.0, -1.0], scale(0.3, random.vector()));
    let mut zone = Zone::new(&masses, (0..count).map(|_| fall(random)).collect());
    for v in 0..count {
        let mut entries = vec![(v as u32, 1.0)];
        if v >= side * side {
            let below = |k: usize| (v / (side * side) - 1) * side * side + (v + k) % (side * side);
            entries.extend([(below(0) as u32, -0.5), (below(1) as u32, -0.3), (below(side) as u32, -0.2)]);
        }
        let tilt = cross([0.0, 0.0, 0.1], random.vector());
        zone.contact(&entries, add([0.0, 0.0, 1.0], tilt));
    }
    zone
}

/// Collisions of a crumple: overlapping stencils in any direction, `doubled` of them repeats, some nearly parallel.
fn crumple(rows: usize, doubled: f64, random: &mut Random) -> Zone {
    let count = rows / 2 + 6;
    let masses: Vec<f64> = (0..count).map(|_| random.power(-1.0, 1.0)).collect();
    let mut zone = Zone::new(&masses, (0..count).map(|_| random.vector()).collect());
    let mut earlier: Vec<(Vec<(u32, f64)>, Vec3)> = Vec::new();
    while zone.rows.len() < rows {
        if random.chance(doubled) && !earlier.is_empty() {
            let (entries, normal) = earlier[random.pick(earlier.len())].clone();
            let tilt = if random.chance(0.5) { 0.0 } else { 1e-4 };
            zone.contact(&entries, add_scaled(normal, tilt, random.vector()));
            continue;
        }
        let mut entries: Vec<(u32, f64)> = Vec::new();
        while entries.len() < 4 {
            let v = random.pick(count) as u32;
            if entries.iter().all(|(b, _)| *b != v) {
                entries.push((v, 0.0));
            }
        }
        let (s, t) = (random.unit(), random.unit());
        entries.iter_mut().zip([1.0 - s, s, t - 1.0, -t]).for_each(|(e, w)| e.1 = w);
        let normal = random.vector();
        zone.contact(&entries, normal);
        earlier.push((entries, normal));
    }
    zone
}

/// Largest component of `min(lambda, B lambda - demand)`, relative to the largest demand.
fn missed(matrix: &DMatrix<f64>, demand: &DVector<f64>, lambda: &DVector<f64>) -> f64 {
    let w = matrix * lambda - demand;
    let largest = demand.iter().fold(0.0_f64, |m, c| m.max(*c));
    let worst = w.iter().zip(lambda.iter()).map(|(w, l)| w.min(*l).abs()).fold(0.0, f64::max);
    if worst.is_finite() { worst / largest } else { f64::INFINITY }
}

/// Lemke's method on the tableau of `w - B lambda - z0 = -demand`; `None`: a ray, or too many pivots.
fn lemke(matrix: &DMatrix<f64>, demand: &DVector<f64>) -> Option<DVector<f64>> {
    let k = demand.len();
    // Columns: w, lambda, z0, right side.
    let mut t = DMatrix::zeros(k, 2 * k + 2);
    for i in 0..k {
        t[(i, i)] = 1.0;
        (0..k).for_each(|j| t[(i, k + j)] = -matrix[(i, j)]);
        t[(i, 2 * k)] = -1.0;
        t[(i, 2 * k + 1)] = -demand[i];
    }
    let mut basis: Vec<usize> = (0..k).collect();
    let mut row = (0..k).min_by(|a, b| t[(*a, 2 * k + 1)].total_cmp(&t[(*b, 2 * k + 1)]))?;
    if t[(row, 2 * k + 1)] >= 0.0 {
        return Some(DVector::zeros(k));
    }
    let mut entering = 2 * k;
    for _ in 0..PIVOTS * k {
        let pivot = t[(row, entering)];
        let line = t.row(row) / pivot;
        for i in 0..k {
            let factor = t[(i, entering)];
            if i != row && factor != 0.0 {
                let change = &line * factor;
                let mut other = t.row_mut(i);
                other -= change;
            }
        }
        t.set_row(row, &line);
        let leaving = std::mem::replace(&mut basis[row], entering);
        if leaving == 2 * k {
            let mut lambda = DVector::zeros(k);
            let set = basis.iter().enumerate().filter(|(_, b)| (k..2 * k).contains(*b));
            set.for_each(|(i, b)| lambda[b - k] = t[(i, 2 * k + 1)]);
            return Some(lambda);
        }
        entering = if leaving < k { leaving + k } else { leaving - k };
        let ratio = |i: usize| t[(i, 2 * k + 1)] / t[(i, entering)];
        row = (0..k).filter(|i| t[(*i, entering)] > 1e-10).min_by(|a, b| ratio(*a).total_cmp(&ratio(*b)))?;
    }
    None
}

/// Dantzig's method: rows are met one by one, the sets of those that push and those that part kept as they were.
fn dantzig(matrix: &DMatrix<f64>, demand: &DVector<f64>) -> Option<DVector<f64>> {
    let k = demand.len();
    let mut lambda = DVector::<f64>::zeros(k);
    let mut w = -demand;
    let (mut pushing, mut parting) = (Vec::<usize>::new(), Vec::<usize>::new());
    let mut pivots = 0;
    for row in 0..k {
        while w[row] < 0.0 {
            pivots += 1;
            if pivots > PIVOTS * k {
                return None;
            }
            // One more unit at the row, the pushing ones balanced.
            let own = DMatrix::from_fn(pushing.len(), pushing.len(), |i, j| matrix[(pushing[i], pushing[j])]);
            let against = DVector::from_fn(pushing.len(), |i, _| -matrix[(pushing[i], row)]);
            let balance = if pushing.is_empty() { against } else { own.lu().solve(&against)? };
            let mut change = DVector::zeros(k);
            change[row] = 1.0;
            pushing.iter().enumerate().for_each(|(i, p)| change[*p] = balance[i]);
            let speed = matrix * &change;
            let mut step = if speed[row] > 0.0 { -w[row] / speed[row] } else { f64::INFINITY };
            let mut leaves = None;
            for p in pushing.iter().filter(|p| change[**p] < 0.0) {
                if -lambda[*p] / change[*p] < step {
                    (step, leaves) = (-lambda[*p] / change[*p], Some(*p));
                }
            }
            let mut joins = None;
            for p in parting.iter().filter(|p| speed[**p] < 0.0) {
                if -w[*p] / speed[*p] < step {
                    (step, leaves, joins) = (-w[*p] / speed[*p], None, Some(*p));
                }
            }
            if !step.is_finite() {
                return None;
            }
            lambda += &change * step;
            w += &speed * step;
            if let Some(p) = leaves {
                pushing.retain(|q| *q != p);
                parting.push(p);
                lambda[p] = 0.0;
            } else if let Some(p) = joins {
                parting.retain(|q| *q != p);
                pushing.push(p);
                w[p] = 0.0;
            } else {
                w[row] = 0.0;
                pushing.push(row);
            }
        }
        if !pushing.contains(&row) {
            parting.push(row);
        }
    }
    Some(lambda)
}

/// Solved, and milliseconds, of one way to answer a zone.
#[derive(Default)]
struct Tally {
    solved: usize,
    milliseconds: f64,
    worst: f64,
}

impl Tally {
    fn add(&mut self, seconds: f64, missed: f64) {
        self.solved += usize::from(missed <= SOLVED);
        self.milliseconds += 1e3 * seconds;
        self.worst = self.worst.max(missed);
    }

    fn text(&self, count: usize) -> String {
        format!("{}/{count},{:.2},{:.0e}", self.solved, self.milliseconds / count as f64, self.worst)
    }
}

fn projection(zone: &Zone, fail_safe: FailSafe) -> (f64, f64) {
    let all: Vec<usize> = (0..zone.rows.len()).collect();
    let mut velocities = zone.velocities.clone();
    let response = ZoneResponse { fail_safe, friction: ZoneFriction::Frictionless };
    let from = thread_seconds();
    let projection = project_zone(&zone.rows, &all, &zone.metric, &response, &mut velocities);
    let seconds = thread_seconds() - from;
    let fastest = zone.rows.normal_targets.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let still = velocities.iter().all(|v| norm(*v).is_finite() && dot(*v, *v) >= 0.0);
    (seconds, if still { projection.residual / fastest } else { f64::INFINITY })
}

fn main() {
    println!("zone,rows,unilateral,ms,worst,inelastic,ms,worst,Lemke,ms,worst,Dantzig,ms,worst");
    let count = 10;
    for (name, sizes) in [
        ("stack", [27, 64, 128, 320, 1000]),
        ("crumple", [20, 50, 100, 200, 400]),
        ("crumple, a third doubled", [20, 50, 100, 200, 400]),
    ] {
        for size in sizes {
            let mut tallies: [Tally; 4] = Default::default();
            let mut rows = 0;
            for seed in 0..count {
                let mut random = Random::new(seed as u64 + 1);
                let zone = match name {
                    "stack" => stack((size as f64 / 9.0).round().max(1.0) as usize, 3, &mut random),
                    "crumple" => crumple(size, 0.0, &mut random),
                    _ => crumple(size, 0.33, &mut random),
                };
                rows = zone.rows.len();
                let (seconds, missed_) = projection(&zone, FailSafe::UnilateralProjection);
                tallies[0].add(seconds, missed_);
                let (seconds, missed_) = projection(&zone, FailSafe::InelasticProjection);
                tallies[1].add(seconds, missed_);
                if rows > 400 {
                    continue;
                }
                let (matrix, demand) = zone.problem();
                for (tally, solve) in [(2, lemke as fn(&_, &_) -> _), (3, dantzig)] {
                    let from = thread_seconds();
                    let lambda: Option<DVector<f64>> = solve(&matrix, &demand);
                    let seconds = thread_seconds() - from;
                    tallies[tally].add(seconds, lambda.map_or(f64::INFINITY, |l| missed(&matrix, &demand, &l)));
                }
            }
            let texts: Vec<String> = tallies.iter().map(|t| t.text(count)).collect();
            println!("{name},{rows},{}", texts.join(","));
        }
    }
}
