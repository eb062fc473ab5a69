//! Constraint manifold refinement of one segment [Otaduy09, §4, steps 3 and 4].

use super::constraint_set::ConstraintSet;
use super::{ContactProblem, Memory, SolverReport, SolverScratch, solve};
use crate::constraint::{BuiltRows, Linearisation, Metric, Reached};
use crate::contact_search::{CandidateSearch, Contact, Hit};
use crate::math::{Vec3, add, dot, mat_vec, norm, scale, sub};
use crate::model::{Phase, Precision, Segment, Settings, State, StepError, StepReport};
use crate::parallel::Par;
use crate::step::{PartEnd, PartStart, Solved, SolvedContact, lap};
use std::time::Instant;

/// Factor of the tolerances when the solver missed a row that continuous detection then hit.
const TIGHTER: f64 = 0.1;

/// Tightest contact tolerance, relative to the velocity scale; below, rounding rules.
const TIGHTEST: f64 = 1e-9;

/// Share of the smallest thickness that a row may be missed by within the first tolerance.
const POSITION_SHARE: f64 = 0.1;

/// Tightest contact tolerance that thin pairs ask for before continuous detection has found a miss.
const TIGHTEST_AT_FIRST: f64 = 1e-5;

/// A solve may use up this part of the iterations that the step has left: what conflicts is a matter for the fail-safes.
const SHARE_OF_LEFT: u32 = 2;

/// A solve may always use this part of the step's iterations.
const SMALLEST_SHARE: u32 = 50;

/// Solves of one round until the translation that balances momentum is within the contact tolerance.
const BALANCES_MAX: u32 = 3;

/// A row of a turning body whose true gap differs from the linear one by more than this share of the required gap is
/// linearised anew.
const LINEARISATION_SHARE: f64 = 0.02;

/// A clean end that leaves a watched pair less than this share of its thickness is refined once more.
const ADMITTED_SHARE: f64 = 0.98;

/// Buffers of the refinement: capacity only, emptying them changes no bit.
#[derive(Default)]
pub(super) struct RefinementBuffers {
    refined: Refined,
    /// The tentative end, not rounded.
    linear_end: State,
    solve: SolveBuffers,
}

/// Buffers of a solve.
#[derive(Default)]
struct SolveBuffers {
    solver: SolverScratch,
    /// Translation per component.
    shifts: Vec<Vec3>,
    /// Multipliers of the rows.
    impulses: Vec<Vec3>,
    /// Response per block.
    dv: Vec<Vec3>,
    /// Warm impulse per block, and what it reaches.
    remembered: Vec<Vec3>,
    reached: Reached,
}

/// A tentative end of a segment, clean if `hits` is empty.
#[derive(Default)]
struct Refined {
    /// Velocity per block `[m/s]`.
    pub velocities: Vec<Vec3>,
    /// Contact impulse per block `[N s]`.
    pub block_impulses: Vec<Vec3>,
    /// End state, rounded to the hosts' formats.
    pub end: State,
    /// The constraints with their impulses.
    pub set: ConstraintSet,
    /// The rows of the last solve.
    pub built: BuiltRows,
    /// Pairs that came too close.
    pub hits: Vec<Hit>,
}

impl Refined {
    /// Nothing done yet.
    fn begin(&mut self, unconstrained: &[Vec3]) {
        self.velocities.clear();
        self.velocities.extend_from_slice(unconstrained);
        self.block_impulses.clear();
        self.hits.clear();
    }

    /// Writes the end that the refinement hands on.
    fn write(&self, out: &mut PartEnd) {
        let PartEnd { velocities, block_impulses, end, contacts, hits } = out;
        velocities.clone_from(&self.velocities);
        block_impulses.clone_from(&self.block_impulses);
        end.clone_from(&self.end);
        hits.clone_from(&self.hits);
        let set = &self.set;
        let each = set.contacts.iter().zip(&set.required_gaps).zip(&set.solved);
        let solved = |((contact, required_gap), solved): ((&Contact, &f64), &Solved)| SolvedContact {
            contact: *contact,
            required_gap: *required_gap,
            solved: *solved,
            is_row: false,
        };
        contacts.clear();
        contacts.extend(each.map(solved));
        self.built.contact.iter().for_each(|contact| contacts[*contact as usize].is_row = true);
    }
}

/// Adds what a solve did to the report of the step.
fn book(solve: &SolverReport, report: &mut StepReport) {
    report.iterations += solve.iterations;
    report.not_converged |= !solve.converged;
    report.complementarity_residual = report.complementarity_residual.max(solve.complementarity_residual);
    report.friction_residual = report.friction_residual.max(solve.friction_residual);
    report.dynamics_residual = report.dynamics_residual.max(solve.dynamics_residual);
}

/// Refines the constraint manifold until the tentative end is clean or the rounds are used up, and writes it, or the last
/// clean one. Errors: cancelled.
pub(super) fn refine(
    part: &PartStart,
    memory: &Memory,
    buffers: &mut RefinementBuffers,
    search: &mut CandidateSearch,
    report: &mut StepReport,
    out: &mut PartEnd,
) -> Result<(), StepError> {
    let (sweep, segment) = (part.sweep(), &part.segment);
    let model = segment.model;
    let mut settings = *part.settings;
    let mut clock = Instant::now();
    let RefinementBuffers { refined, linear_end, solve: solve_buffers } = buffers;
    refined.begin(&segment.drives.velocities);
    segment.end_state(&refined.velocities, 1.0, false, linear_end);
    let near = &mut refined.set.watched;
    near.clear();
    if settings.ablation.near_contacts {
        sweep.near(linear_end, sweep.factor, search, near);
    }
    refined.set.begin(model, memory, &settings, segment.dt);
    refined.set.admit(model, &linear_end.positions, 1.0, memory, &settings, segment.dt);
    report.times.search += lap(&mut clock);
    let scale_of_motion = fastest(&segment.start.positions, &linear_end.positions, segment.dt);
    let mut tolerance_factor = 1.0;
    let mut tightened = false;
    let mut was_clean = false;
    let mut rounds_left = settings.rounds_max.max(1);
    while rounds_left > 0 {
        part.watch.ask(Phase::Round, segment.from)?;
        rounds_left -= 1;
        report.rounds += 1;
        let converged =
            solve_round(part, linear_end, scale_of_motion, tolerance_factor, memory, refined, solve_buffers, report);
        clock = Instant::now();
        segment.end_state(&refined.velocities, 1.0, true, &mut refined.end);
        refined.hits = sweep.hits(&refined.end, search);
        report.times.detection += lap(&mut clock);
        unrounded_end(segment, refined, linear_end);
        let end = &linear_end.positions;
        if !converged && refined.set.recovers() {
            // Nothing but recovery can ask for what has no solution: it is the first thing to go. What is left is
            // solved once at least, in a round more than the cap if need be.
            rounds_left = rounds_left.max(1);
            settings.recovery_fraction = 0.0;
            if refined.hits.is_empty() {
                refined.write(out);
                was_clean = true;
            }
            refined.set.drop_recovery();
            refined.velocities.clone_from(&segment.drives.velocities);
            refined.block_impulses.clear();
            segment.end_state(&refined.velocities, 1.0, false, linear_end);
            continue;
        }
        if refined.hits.is_empty() {
            refined.write(out);
            was_clean = true;
            let settled = worst_linearisation(segment, refined, linear_end) <= LINEARISATION_SHARE;
            if settled && !refined.set.would_admit(end, ADMITTED_SHARE) {
                return Ok(());
            }
            refined.set.admit(model, end, ADMITTED_SHARE, memory, &settings, segment.dt);
            continue;
        }
        let solved = refined.set.contacts.len();
        refined.set.admit(model, end, 1.0, memory, &settings, segment.dt);
        let growth = refined.set.grow(model, &refined.hits, end, solved, memory, &settings, segment.dt, tightened);
        if growth.missed > 0 {
            tolerance_factor *= TIGHTER;
        }
        tightened = growth.missed > 0;
    }
    if !was_clean {
        refined.write(out);
    }
    Ok(())
}

/// Steps 4.1 and 4.2: rows about the last tentative motion, constrained dynamics, new velocities; whether the solver
/// met its tolerances.
fn solve_round(
    part: &PartStart,
    about: &State,
    scale_of_motion: f64,
    tolerance_factor: f64,
    memory: &Memory,
    refined: &mut Refined,
    buffers: &mut SolveBuffers,
    step_report: &mut StepReport,
) -> bool {
    let mut clock = Instant::now();
    let (segment, metric) = (&part.segment, part.metric);
    let (model, unconstrained) = (segment.model, &segment.drives.velocities);
    let about = Linearisation {
        start: segment.start,
        end: about,
        velocities: &refined.velocities,
        unconstrained,
        dt: segment.dt,
    };
    let SolveBuffers { solver, shifts, impulses, dv, remembered, reached } = buffers;
    let Refined { set, built, .. } = refined;
    built.assign(model, metric, &set.contacts, &set.required_gaps, &set.kept_tangents, &about);
    step_report.times.rows += lap(&mut clock);
    if built.rows.is_empty() {
        refined.velocities.clone_from(unconstrained);
        refined.block_impulses.clear();
        refined.block_impulses.resize(model.block_count, [0.0; 3]);
        return true;
    }
    set.row_impulses(built, impulses);
    dv.clear();
    if refined.block_impulses.is_empty() {
        block_impulses(model.block_count, built, impulses, remembered);
        metric.reached(remembered, reached);
        remembered_response(segment, &reached.blocks, memory, dv);
    } else {
        dv.extend(refined.velocities.iter().zip(unconstrained).map(|(v, u)| sub(*v, *u)));
    }
    let demanded = built.rows.normal_targets.iter().fold(0.0_f64, |a, c| a.max(*c));
    let velocity_scale = scale_of_motion.max(demanded);
    let settings = Settings {
        iterations_max: iterations_left(part.settings.iterations_max, step_report.iterations),
        ..solve_tolerances(part.settings, set, segment.dt * velocity_scale, tolerance_factor)
    };
    let problem = ContactProblem {
        matrix: &metric.matrix,
        inverse_diagonal: &metric.inverse_diagonal,
        rows: &built.rows,
        translations: Some(&metric.translations),
        velocity_scale,
    };
    let report = if velocity_scale > 0.0 {
        solve_balanced(&problem, metric, impulses, dv, &settings, (solver, shifts), part.par)
    } else {
        // Nothing moves and no row asks for anything.
        impulses.fill([0.0; 3]);
        dv.fill([0.0; 3]);
        SolverReport { converged: true, ..SolverReport::default() }
    };
    book(&report, step_report);
    set.keep(part.settings.friction_cone, built, impulses);
    block_impulses(model.block_count, built, impulses, &mut refined.block_impulses);
    for block in 0..model.block_count {
        // Where masses are lumped the response is the impulse over the mass, to rounding, whatever the iterations.
        let response = if metric.uncoupled[block] {
            mat_vec(&metric.inverse_diagonal[block], refined.block_impulses[block])
        } else {
            dv[block]
        };
        refined.velocities[block] = add(unconstrained[block], response);
    }
    step_report.times.solve += lap(&mut clock);
    report.converged
}

/// The tolerances of a solve in which the fastest part moves by `way` `[m]`: no row is missed by more than a share of the
/// smallest thickness.
fn solve_tolerances(settings: &Settings, set: &ConstraintSet, way: f64, factor: f64) -> Settings {
    let start = settings.contact_tolerance;
    let thinnest = set.contacts.iter().fold(f64::INFINITY, |a, c| a.min(c.thickness));
    let by_thickness = (POSITION_SHARE * thinnest / way).max(TIGHTEST_AT_FIRST);
    let contact_tolerance = (start.min(by_thickness) * factor).max(TIGHTEST.min(start));
    let velocity_tolerance = settings.velocity_tolerance * (contact_tolerance / start).max(1e-3);
    Settings { contact_tolerance, velocity_tolerance, ..*settings }
}

/// Iterations of the next solve of a step that may make `max` in all and has made `done`.
fn iterations_left(max: u32, done: u32) -> u32 {
    (max.saturating_sub(done) / SHARE_OF_LEFT).max(max.div_ceil(SMALLEST_SHARE))
}

/// Solves, and translates what is coupled so that its momentum changes by the impulses, to rounding; again from there
/// where that moved rows by more than the contact tolerance. Residuals count the translation.
fn solve_balanced(
    problem: &ContactProblem,
    metric: &Metric,
    impulses: &mut [Vec3],
    dv: &mut [Vec3],
    settings: &Settings,
    (scratch, shifts): (&mut SolverScratch, &mut Vec<Vec3>),
    par: Par,
) -> SolverReport {
    let mut settings = *settings;
    let mut total = SolverReport::default();
    for _ in 0..BALANCES_MAX {
        let report = solve(problem, impulses, dv, &settings, scratch, par);
        let (product, given) = scratch.balance();
        metric.translations.missing(given, product, shifts);
        let moved = metric.translations.translate(shifts, dv);
        // A row weighs both its sides with one at most.
        let off = 2.0 * moved / problem.velocity_scale;
        total = SolverReport {
            iterations: total.iterations + report.iterations,
            complementarity_residual: report.complementarity_residual + off,
            friction_residual: report.friction_residual + off,
            ..report
        };
        settings.iterations_max = settings.iterations_max.saturating_sub(report.iterations);
        if off <= settings.contact_tolerance || !report.converged || settings.iterations_max == 0 {
            break;
        }
    }
    total
}

/// `C^T p` per block.
fn block_impulses(blocks: usize, built: &BuiltRows, impulses: &[Vec3], out: &mut Vec<Vec3>) {
    out.clear();
    out.resize(blocks, [0.0; 3]);
    for (row, p) in impulses.iter().enumerate() {
        built.rows.scatter(row, built.rows.impulse(row, *p), out);
    }
}

/// Warm start of the response: last velocity minus v*, on blocks that a warm impulse reaches; zero elsewhere.
fn remembered_response(segment: &Segment, reached: &[bool], memory: &Memory, dv: &mut Vec<Vec3>) {
    dv.clear();
    dv.resize(segment.model.block_count, [0.0; 3]);
    for (key, velocities) in &memory.velocities {
        let Some(body) = segment.model.body_index(*key).map(|b| &segment.model.bodies[b]) else { continue };
        if body.blocks.len() != velocities.len() {
            continue;
        }
        for (block, v) in body.blocks.clone().zip(velocities) {
            if reached[block] {
                dv[block] = sub(*v, segment.drives.velocities[block]);
            }
        }
    }
}

/// The tentative end before rounding; the rounded one where no body is rounded.
fn unrounded_end(segment: &Segment, refined: &Refined, out: &mut State) {
    let single = segment.model.bodies.iter().any(|b| b.description.precision == Precision::Single);
    if single {
        segment.end_state(&refined.velocities, 1.0, false, out);
    } else {
        out.clone_from(&refined.end);
    }
}

/// Largest difference between true and linear gap of rows that push, as a share of the required gap.
fn worst_linearisation(segment: &Segment, refined: &Refined, end: &State) -> f64 {
    let rows = &refined.built.rows;
    let response = |block: usize| sub(refined.velocities[block], segment.drives.velocities[block]);
    let mut worst = 0.0_f64;
    for (row, contact) in refined.built.contact.iter().enumerate() {
        let index = *contact as usize;
        let turning = rows.angular_offsets[row] != rows.angular_offsets[row + 1];
        if !turning || norm(refined.set.solved[index].impulse) == 0.0 {
            continue;
        }
        let required = refined.set.required_gaps[index];
        let excess = dot(rows.frames[row][0], rows.relative_velocity_of(row, response)) - rows.normal_targets[row];
        let difference = refined.set.contacts[index].gap(&end.positions) - (required + segment.dt * excess);
        worst = worst.max(difference.abs() / required.abs().max(f64::MIN_POSITIVE));
    }
    worst
}

/// Fastest vertex between two sets of positions `[m/s]`.
fn fastest(x0: &[Vec3], x1: &[Vec3], dt: f64) -> f64 {
    x0.iter().zip(x1).fold(0.0_f64, |a, (p, q)| a.max(norm(scale(1.0 / dt, sub(*q, *p)))))
}
