//! The final line of a run, and the bounds that it broke.

use super::energy::Centre;
use super::file::{BodyBound, Bounds, Up};
use super::settings::{FailSafeName, MethodName};
use super::statistics::{Spread, StepRow};
use crate::math::{Vec3, dot, sub, unit};
use serde::Serialize;
use std::collections::BTreeMap;

/// What a run came to; one line of JSON.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    #[serde(flatten)]
    pub facts: Facts,
    pub version: &'static str,
    /// Steps that the figures are over: fewer when a run was resumed without the rows of its first part.
    pub steps_counted: u64,
    pub duration: f64,
    pub contacts_max: u32,
    pub active_contacts_max: u32,
    /// Steps with contact by rounds of constraint manifold refinement, those of a divided step per part.
    pub cmr_rounds_histogram: BTreeMap<u32, u64>,
    pub rounds_within_three: f64,
    /// Steps that were divided.
    pub divisions: u64,
    /// Steps with zones or held vertices.
    pub failsafes: u64,
    /// Steps that ended early.
    pub pinched: u64,
    /// Steps in which a solve stopped at its work cap.
    pub not_converged: u64,
    /// Certified, over all steps.
    pub intersections: u64,
    /// The largest of the three below.
    pub residual_max: f64,
    pub complementarity_residual_max: f64,
    pub friction_residual_max: f64,
    pub dynamics_residual_max: f64,
    pub iterations: Spread,
    pub seconds_per_step: Spread,
    pub processor_seconds_per_step: Spread,
    /// Sums over the steps.
    pub seconds_by_stage: BTreeMap<&'static str, f64>,
    pub kinetic_energy_end: f64,
    pub kinetic_energy_end_per_kg: f64,
    pub elastic_energy_end: f64,
    pub bytes_max: u64,
    /// Where the bodies that bounds name have come.
    pub ends: Vec<End>,
    pub bounds_broken: Vec<String>,
}

/// Two bodies, by their names in order, with no room between them.
#[derive(Clone, Debug, Serialize)]
pub struct Pinch {
    pub bodies: [String; 2],
    pub first_step: u64,
    pub last_step: u64,
    pub steps: u64,
}

/// How far the centre of mass of a body has come along a direction, and how fast it goes there.
#[derive(Clone, Debug, Serialize)]
pub struct End {
    pub name: String,
    pub direction: Vec3,
    /// `[m]`
    pub travel: f64,
    /// `[m/s]`
    pub speed: f64,
}

/// What is known of a run besides the rows of its steps.
#[derive(Clone, Debug, Serialize)]
pub struct Facts {
    pub scene: String,
    pub title: String,
    pub about: String,
    pub method: MethodName,
    pub fail_safe: FailSafeName,
    /// Of every body, where it was chosen in place of the scene's.
    pub friction: Option<f64>,
    pub vertices: usize,
    /// Of bodies that are not scripted.
    pub free_vertices: usize,
    pub tets: usize,
    pub bodies: usize,
    /// Steps that the state has behind it.
    pub steps: u64,
    /// Whether the bounds about the end count.
    #[serde(skip)]
    pub whole: bool,
    pub dt: f64,
    /// `[kg]`
    #[serde(skip)]
    pub mass: f64,
    pub threads: usize,
    pub jitter: u64,
    pub up: Up,
    /// Offset of the half-space that faces up, if there is one.
    pub floor: Option<f64>,
    /// Half-spaces at the end: normal and offset.
    pub planes: Vec<[f64; 4]>,
    /// Names of the bodies of prescribed motion.
    pub scripted: Vec<String>,
    pub camera: Option<Vec3>,
    pub look_at: Option<Vec3>,
    /// Between which bodies steps were pinched, since the run began or was resumed.
    pub pinches: Vec<Pinch>,
    pub frames: u64,
    pub frames_per_second: f64,
    /// State hash.
    pub hash: String,
    /// Whether the run was stopped before its last step.
    pub interrupted: bool,
    /// Of the bodies that bounds name: at the start and at the end.
    #[serde(skip)]
    pub centres: Vec<[Centre; 2]>,
}

impl Report {
    pub fn new(facts: Facts, rows: &[StepRow], bounds: &Bounds) -> Report {
        let count = |f: &dyn Fn(&StepRow) -> bool| rows.iter().filter(|row| f(row)).count() as u64;
        let largest = |f: &dyn Fn(&StepRow) -> f64| rows.iter().map(f).fold(0.0, f64::max);
        let mut histogram = BTreeMap::new();
        for row in rows.iter().filter(|row| row.contacts > 0) {
            *histogram.entry(row.rounds_of_a_part()).or_insert(0) += 1;
        }
        let touching: u64 = histogram.values().sum();
        let few: u64 = histogram.iter().filter(|(rounds, _)| **rounds <= 3).map(|(_, count)| count).sum();
        let residuals = [
            largest(&|r| r.complementarity_residual),
            largest(&|r| r.friction_residual),
            largest(&|r| r.dynamics_residual),
        ];
        let last = rows.last().cloned().unwrap_or_default();
        let sum = |f: &dyn Fn(&StepRow) -> f64| rows.iter().map(f).sum::<f64>();
        let mut report = Report {
            version: env!("CARGO_PKG_VERSION"),
            steps_counted: rows.len() as u64,
            duration: facts.steps as f64 * facts.dt,
            contacts_max: rows.iter().map(|r| r.contacts).max().unwrap_or(0),
            active_contacts_max: rows.iter().map(|r| r.active_contacts).max().unwrap_or(0),
            cmr_rounds_histogram: histogram,
            rounds_within_three: if touching == 0 { 1.0 } else { few as f64 / touching as f64 },
            divisions: count(&|r| r.parts > 1),
            failsafes: count(&StepRow::fail_safe_used),
            pinched: count(&|r| r.certified_fraction < 1.0),
            not_converged: count(&|r| r.not_converged > 0),
            intersections: rows.iter().map(|r| u64::from(r.intersections)).sum(),
            residual_max: residuals.iter().copied().fold(0.0, f64::max),
            complementarity_residual_max: residuals[0],
            friction_residual_max: residuals[1],
            dynamics_residual_max: residuals[2],
            iterations: Spread::of(rows.iter().map(|r| f64::from(r.iterations))),
            seconds_per_step: Spread::of(rows.iter().map(|r| r.seconds)),
            processor_seconds_per_step: Spread::of(rows.iter().map(|r| r.processor_seconds)),
            seconds_by_stage: BTreeMap::from([
                ("dynamics", sum(&|r| r.dynamics)),
                ("search", sum(&|r| r.search)),
                ("rows", sum(&|r| r.rows)),
                ("solve", sum(&|r| r.solve)),
                ("detection", sum(&|r| r.detection)),
                ("fail_safe", sum(&|r| r.fail_safe)),
                ("certificate", sum(&|r| r.certificate)),
                ("total", sum(&|r| r.seconds)),
            ]),
            kinetic_energy_end: last.kinetic_energy,
            kinetic_energy_end_per_kg: if facts.mass > 0.0 { last.kinetic_energy / facts.mass } else { 0.0 },
            elastic_energy_end: last.elastic_energy,
            bytes_max: rows.iter().map(|r| r.bytes).max().unwrap_or(0),
            ends: bounds.body.iter().zip(&facts.centres).map(End::of).collect(),
            bounds_broken: Vec::new(),
            facts,
        };
        report.bounds_broken = broken(&report, bounds);
        report
    }
}

impl End {
    fn of((bound, [start, end]): (&BodyBound, &[Centre; 2])) -> End {
        let direction = unit(bound.direction).unwrap_or_default();
        let travel = dot(direction, sub(end.position, start.position));
        End { name: bound.name.clone(), direction, travel, speed: dot(direction, end.velocity) }
    }
}

/// The bounds that a run broke, each with the number that broke it.
fn broken(report: &Report, bounds: &Bounds) -> Vec<String> {
    let mut checks = vec![
        at_most("intersections", report.intersections as f64, Some(0.0)),
        at_most("contacts_max", f64::from(report.contacts_max), bounds.contacts_max.map(f64::from)),
        at_most("divisions_max", report.divisions as f64, bounds.divisions_max.map(f64::from)),
        at_most("fail_safes_max", report.failsafes as f64, bounds.fail_safes_max.map(f64::from)),
        at_most("pinched_max", report.pinched as f64, bounds.pinched_max.map(f64::from)),
        at_most("not_converged_max", report.not_converged as f64, bounds.not_converged_max.map(f64::from)),
        at_least("rounds_within_three_min", report.rounds_within_three, bounds.rounds_within_three_min),
    ];
    if report.facts.whole {
        checks.push(at_least("contacts_min", f64::from(report.contacts_max), bounds.contacts_min.map(f64::from)));
        checks.push(at_most("kinetic_energy_end_max", report.kinetic_energy_end_per_kg, bounds.kinetic_energy_end_max));
        checks.push(at_least("pinched_min", report.pinched as f64, bounds.pinched_min.map(f64::from)));
        for (bound, end) in bounds.body.iter().zip(&report.ends) {
            let (travel, speed) = (end.travel, end.speed);
            let name = |what: &str| format!("{} {what}", bound.name);
            checks.push(at_least(&name("travel_min"), travel, bound.travel_min));
            checks.push(at_most(&name("travel_max"), travel, bound.travel_max));
            checks.push(at_least(&name("speed_min"), speed, bound.speed_min));
            checks.push(at_most(&name("speed_max"), speed, bound.speed_max));
        }
    }
    checks.into_iter().flatten().collect()
}

/// What is wrong unless the value is at most the bound; not a number is wrong.
fn at_most(name: &str, value: f64, bound: Option<f64>) -> Option<String> {
    let bound = bound?;
    if value <= bound { None } else { Some(format!("{name}: {value}, at most {bound}")) }
}

/// What is wrong unless the value is at least the bound; not a number is wrong.
fn at_least(name: &str, value: f64, bound: Option<f64>) -> Option<String> {
    let bound = bound?;
    if value >= bound { None } else { Some(format!("{name}: {value}, at least {bound}")) }
}
