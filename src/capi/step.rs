//! The step and its report.

use super::boundary::{call, change};
use super::context::{SGN_LOG_INFO, SGN_LOG_WARNING};
use super::status::{
    Failure, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_NON_FINITE_INPUT, SGN_ERROR_NULL_ARGUMENT, SGN_ERROR_UNSUPPORTED,
    SGN_NOTE_FAIL_SAFE_USED, SGN_NOTE_NOT_CONVERGED, SGN_NOTE_SUBDIVIDED, SGN_NOTE_TANGLED_PAIRS, SGN_OK, SgnResult,
};
use super::structs::{self, Growing};
use super::world::SgnWorld;
use crate::model::{
    FailSafe, FilterSettings, FrictionCone, Method, Phase, Settings, SolverChoice, StartPolicy, StepReport, Watch,
    ZoneFriction,
};
use std::ffi::c_void;
use std::sync::atomic::{AtomicBool, Ordering};

/// Contact method.
pub type SgnMethod = i32;
/// Implicit contact: constraint manifold refinement around iterative constraint anticipation. The default.
pub const SGN_METHOD_IMPLICIT: i32 = 0;
/// Velocity filter: repulsions, impulses with restitution, zones. Reads no system values, response is by lumped masses.
pub const SGN_METHOD_VELOCITY_FILTER: i32 = 1;
/// Reserved: asynchronous contact. `SGN_ERROR_UNSUPPORTED` in this version.
pub const SGN_METHOD_ASYNCHRONOUS: i32 = 2;

/// Solver of the constrained dynamics.
pub type SgnSolver = i32;
/// The fastest that converges, with hand-over on measured stagnation. The default.
pub const SGN_SOLVER_AUTOMATIC: i32 = 0;
/// Iterative constraint anticipation as published.
pub const SGN_SOLVER_ITERATIVE_ANTICIPATION: i32 = 1;
/// The same with one light pass over the contacts per iteration.
pub const SGN_SOLVER_LIGHT_ANTICIPATION: i32 = 2;
/// Accelerated projected relaxation alone.
pub const SGN_SOLVER_ACCELERATED_RELAXATION: i32 = 3;
/// Augmented Lagrangian with preconditioned conjugate gradients.
pub const SGN_SOLVER_AUGMENTED_LAGRANGIAN: i32 = 4;
/// Full constraint anticipation, a baseline of quadratic cost; beyond 32,768 rows (three per contact with friction)
/// iterative anticipation stands in.
pub const SGN_SOLVER_FULL_ANTICIPATION: i32 = 5;

/// Shape of the friction limit.
pub type SgnFrictionCone = i32;
/// Isotropic. The default.
pub const SGN_FRICTION_DISC: i32 = 0;
/// Per component, as published.
pub const SGN_FRICTION_PYRAMID: i32 = 1;

/// What to do with start states that intersect, and with scripted motion that leaves no room.
pub type SgnPolicy = i32;
/// Refuse with INTERSECTING_START or PINCHED, with witnesses. The default.
pub const SGN_POLICY_REFUSE: i32 = 0;
/// Pairs that touch the connected tangled component pass until it has separated; everything else keeps the promise.
pub const SGN_POLICY_PASS: i32 = 1;

/// What answers a zone of collisions that the method's own iterations left, before it moves as a rigid body and before
/// it is held.
pub type SgnFailSafe = i32;
/// The smallest change of velocities after which no collision of the zone is left; impulses push and never pull. The
/// default.
pub const SGN_FAIL_SAFE_UNILATERAL_PROJECTION: i32 = 0;
/// The smallest change after which nothing in the zone approaches or separates; impulses may pull.
pub const SGN_FAIL_SAFE_INELASTIC_PROJECTION: i32 = 1;
/// The zone moves as one rigid body.
pub const SGN_FAIL_SAFE_RIGID_ZONE: i32 = 2;

/// Friction within a projected zone.
pub type SgnZoneFriction = i32;
/// Each contact within its own limit. The default.
pub const SGN_ZONE_FRICTION_PER_CONTACT: i32 = 0;
/// One limit for all sliding of the zone.
pub const SGN_ZONE_FRICTION_PER_ZONE: i32 = 1;
/// None.
pub const SGN_ZONE_FRICTION_NONE: i32 = 2;

/// Phase of a step.
pub type SgnPhase = i32;
/// Unconstrained dynamics of bodies that the library drives.
pub const SGN_PHASE_DYNAMICS: i32 = 0;
/// The start state is checked.
pub const SGN_PHASE_START: i32 = 1;
/// A round: contacts, constrained dynamics, continuous detection; or a pass of impulses.
pub const SGN_PHASE_ROUND: i32 = 2;
/// Zones and held vertices.
pub const SGN_PHASE_FAIL_SAFE: i32 = 3;

/// Told before each phase of a step, on the thread that steps, with the fraction of the step that is done. Returns 0 to
/// cancel. Calls into the world return `SGN_ERROR_BUSY`. Must not throw.
pub type SgnProgressCallback = Option<unsafe extern "C" fn(user: *mut c_void, phase: SgnPhase, fraction: f64) -> i32>;

/// Flag of a step: certify the end state by exact predicates.
pub const SGN_STEP_CERTIFY: u64 = 1;

/// A step to be made. Fill with `sgn_step_desc_init`, then set `dt`. All tolerances are relative, all caps are counters.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnStepDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_METHOD_` constant.
    pub method: SgnMethod,
    /// Duration, positive. Default: 0, which is refused.
    pub dt: f64,
    /// `SGN_STEP_` flags. Default: 0.
    pub flags: u64,
    /// An `SGN_SOLVER_` constant.
    pub solver: SgnSolver,
    /// An `SGN_FRICTION_` constant.
    pub friction_cone: SgnFrictionCone,
    /// An `SGN_POLICY_` constant.
    pub policy: SgnPolicy,
    /// Outer iterations of a step at most: each solve may use half of what is left, and always a fiftieth.
    pub iterations_max: u32,
    /// Rounds of constraint manifold refinement before the step is divided.
    pub rounds_max: u32,
    /// Halvings of the step before the fail-safes, 0 to 20.
    pub halvings_max: u32,
    /// Bound of the complementarity and friction residuals, relative to the largest velocity.
    pub contact_tolerance: f64,
    /// Bound of the estimated relative velocity error.
    pub velocity_tolerance: f64,
    /// Thickness regained in a step at most, as a fraction of the pair thickness, 0 to 1.
    pub recovery_fraction: f64,
    /// Range of the proximity search, as a multiple of the pair thickness, at least 1.
    pub proximity_factor: f64,
    /// A part that turns by more than this angle is subdivided in time, in radians, positive.
    pub turn_max: f64,
    /// Told before each phase, may cancel; NULL: none. Default: NULL.
    pub progress_callback: SgnProgressCallback,
    /// Handed to the callback.
    pub progress_user: *mut c_void,
    /// An `SGN_FAIL_SAFE_` constant.
    pub fail_safe: SgnFailSafe,
    /// An `SGN_ZONE_FRICTION_` constant.
    pub zone_friction: SgnZoneFriction,
    /// Velocity filter: coefficient of restitution that collisions have at least, whatever their materials', 0 to 1.
    /// Default: 0.
    pub restitution: f64,
    /// Velocity filter: stiffness of the springs between what is closer than its thickness, in units of effective mass over
    /// `dt^2`, 0 to 1e6; 1 makes up for the whole overlap in a step, but for the cap of `recovery_fraction`. 0: no springs.
    /// Default: 10.
    pub repulsion_stiffness: f64,
    /// Velocity filter: passes of impulses and continuous detection before the fail-safes, at most 1e6.
    pub passes_max: u32,
    /// Must be 0.
    pub reserved: u32,
}

// SAFETY: repr(C) without padding; numbers, a pointer and a nullable function.
unsafe impl Growing for SgnStepDesc {
    const NAME: &'static str = "SgnStepDesc";
    const FIRST_SIZE: usize = 136;
    fn defaults() -> Self {
        let s = Settings::default();
        SgnStepDesc {
            struct_size: 0,
            method: SGN_METHOD_IMPLICIT,
            dt: 0.0,
            flags: 0,
            solver: SGN_SOLVER_AUTOMATIC,
            friction_cone: SGN_FRICTION_DISC,
            policy: SGN_POLICY_REFUSE,
            iterations_max: s.iterations_max,
            rounds_max: s.rounds_max,
            halvings_max: s.halvings_max,
            contact_tolerance: s.contact_tolerance,
            velocity_tolerance: s.velocity_tolerance,
            recovery_fraction: s.recovery_fraction,
            proximity_factor: s.proximity_factor,
            turn_max: s.turn_max,
            progress_callback: None,
            progress_user: std::ptr::null_mut(),
            fail_safe: SGN_FAIL_SAFE_UNILATERAL_PROJECTION,
            zone_friction: SGN_ZONE_FRICTION_PER_CONTACT,
            restitution: s.filter.restitution,
            repulsion_stiffness: s.filter.repulsion_stiffness,
            passes_max: s.filter.passes_max,
            reserved: 0,
        }
    }
}

/// The fail-safe of an `SGN_FAIL_SAFE_` constant.
pub(super) fn fail_safe(constant: SgnFailSafe) -> Result<FailSafe, Failure> {
    match constant {
        SGN_FAIL_SAFE_UNILATERAL_PROJECTION => Ok(FailSafe::UnilateralProjection),
        SGN_FAIL_SAFE_INELASTIC_PROJECTION => Ok(FailSafe::InelasticProjection),
        SGN_FAIL_SAFE_RIGID_ZONE => Ok(FailSafe::RigidZone),
        other => Err(invalid("fail_safe", f64::from(other))),
    }
}

/// The friction of an `SGN_ZONE_FRICTION_` constant.
pub(super) fn zone_friction(constant: SgnZoneFriction) -> Result<ZoneFriction, Failure> {
    match constant {
        SGN_ZONE_FRICTION_PER_CONTACT => Ok(ZoneFriction::PerContact),
        SGN_ZONE_FRICTION_PER_ZONE => Ok(ZoneFriction::PerZone),
        SGN_ZONE_FRICTION_NONE => Ok(ZoneFriction::Frictionless),
        other => Err(invalid("zone_friction", f64::from(other))),
    }
}

fn invalid(what: &str, value: f64) -> Failure {
    let code = if value.is_finite() { SGN_ERROR_INVALID_ARGUMENT } else { SGN_ERROR_NON_FINITE_INPUT };
    Failure::new(code, format!("{what} {value} is out of range")).value(value)
}

impl SgnStepDesc {
    pub(super) fn settings(&self) -> Result<Settings, Failure> {
        let method = match self.method {
            SGN_METHOD_IMPLICIT => Method::ImplicitContact,
            SGN_METHOD_VELOCITY_FILTER => Method::VelocityFilter,
            SGN_METHOD_ASYNCHRONOUS => {
                return Err(Failure::new(SGN_ERROR_UNSUPPORTED, "this version has no asynchronous method"));
            }
            other => return Err(invalid("method", f64::from(other))),
        };
        if self.flags & !SGN_STEP_CERTIFY != 0 {
            return Err(invalid("flags", self.flags as f64));
        }
        let solver = match self.solver {
            SGN_SOLVER_AUTOMATIC => SolverChoice::Automatic,
            SGN_SOLVER_ITERATIVE_ANTICIPATION => SolverChoice::IterativeAnticipation,
            SGN_SOLVER_LIGHT_ANTICIPATION => SolverChoice::LightAnticipation,
            SGN_SOLVER_ACCELERATED_RELAXATION => SolverChoice::AcceleratedRelaxation,
            SGN_SOLVER_AUGMENTED_LAGRANGIAN => SolverChoice::AugmentedLagrangian,
            SGN_SOLVER_FULL_ANTICIPATION => SolverChoice::FullAnticipation,
            other => return Err(invalid("solver", f64::from(other))),
        };
        let friction_cone = match self.friction_cone {
            SGN_FRICTION_DISC => FrictionCone::Disc,
            SGN_FRICTION_PYRAMID => FrictionCone::Pyramid,
            other => return Err(invalid("friction_cone", f64::from(other))),
        };
        let start_policy = match self.policy {
            SGN_POLICY_REFUSE => StartPolicy::Refuse,
            SGN_POLICY_PASS => StartPolicy::Pass,
            other => return Err(invalid("policy", f64::from(other))),
        };
        for (what, value, low, high) in [
            ("iterations_max", f64::from(self.iterations_max), 1.0, f64::from(u32::MAX)),
            ("rounds_max", f64::from(self.rounds_max), 1.0, f64::from(u32::MAX)),
            ("halvings_max", f64::from(self.halvings_max), 0.0, 20.0),
            ("contact_tolerance", self.contact_tolerance, 0.0, 1.0),
            ("velocity_tolerance", self.velocity_tolerance, 0.0, 1.0),
            ("recovery_fraction", self.recovery_fraction, 0.0, 1.0),
            ("proximity_factor", self.proximity_factor, 1.0, 1e6),
            ("turn_max", self.turn_max, f64::MIN_POSITIVE, 4.0),
            ("restitution", self.restitution, 0.0, 1.0),
            ("repulsion_stiffness", self.repulsion_stiffness, 0.0, 1e6),
            ("passes_max", f64::from(self.passes_max), 0.0, 1e6),
        ] {
            if !(low..=high).contains(&value) {
                return Err(invalid(what, value));
            }
        }
        if self.reserved != 0 {
            return Err(invalid("reserved", f64::from(self.reserved)));
        }
        let filter = FilterSettings {
            restitution: self.restitution,
            repulsion_stiffness: self.repulsion_stiffness,
            passes_max: self.passes_max,
            two_pass: false,
        };
        Ok(Settings {
            method,
            filter,
            solver,
            friction_cone,
            start_policy,
            contact_tolerance: self.contact_tolerance,
            velocity_tolerance: self.velocity_tolerance,
            iterations_max: self.iterations_max,
            rounds_max: self.rounds_max,
            halvings_max: self.halvings_max,
            recovery_fraction: self.recovery_fraction,
            proximity_factor: self.proximity_factor,
            turn_max: self.turn_max,
            fail_safe: fail_safe(self.fail_safe)?,
            zone_friction: zone_friction(self.zone_friction)?,
            certify: self.flags & SGN_STEP_CERTIFY != 0,
            ..Settings::default()
        })
    }
}

/// Bit of `SgnStepReport.notes`: a solve stopped at its work cap.
pub const SGN_STEP_NOT_CONVERGED: u64 = 1;
/// Bit of `SgnStepReport.notes`: the step was divided.
pub const SGN_STEP_SUBDIVIDED: u64 = 2;
/// Bit of `SgnStepReport.notes`: zones were projected or moved as rigid bodies, or vertices held.
pub const SGN_STEP_FAIL_SAFE_USED: u64 = 4;
/// Bit of `SgnStepReport.notes`: pairs of a tangled component passed.
pub const SGN_STEP_TANGLED_PAIRS: u64 = 8;

/// What a step did. Fill with `sgn_step_report_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnStepReport {
    /// Set by the init function.
    pub struct_size: u32,
    /// Contacts in the last solve.
    pub contacts: u32,
    /// Contacts with an impulse.
    pub active_contacts: u32,
    /// Rounds of constraint manifold refinement, or passes of the velocity filter, summed over the parts of the step.
    pub rounds: u32,
    /// Outer solver iterations, or impulses of the velocity filter, summed.
    pub iterations: u32,
    /// Parts that the step was divided into; 1 when it was not.
    pub parts: u32,
    /// Zones that moved as rigid bodies.
    pub rigid_zones: u32,
    /// Vertices held.
    pub held_vertices: u32,
    /// Pairs that passed because they touch a tangled component.
    pub tangled_pairs: u32,
    /// 1 if `intersections` was certified, else 0.
    pub certified: u32,
    /// Intersections that the certificate found; 0 without SGN_STEP_CERTIFY.
    pub intersections: u64,
    /// All notes of the step, a bit each.
    pub notes: u64,
    /// Complementarity residual, relative; worst of the step.
    pub complementarity_residual: f64,
    /// Friction residual, relative; worst of the step.
    pub friction_residual: f64,
    /// Dynamics residual, relative; worst of the step.
    pub dynamics_residual: f64,
    /// Work done by thickness recovery; by springs of the velocity filter at most.
    pub recovery_work: f64,
    /// Momentum taken by held zones and infinite masses.
    pub momentum_taken: [f64; 3],
    /// Error in angular momentum from normals at impact.
    pub angular_momentum_error: f64,
    /// Fraction of the step that the state stands at; below 1 only with PINCHED.
    pub certified_fraction: f64,
    /// Microseconds of proximity and candidate search.
    pub search_microseconds: f64,
    /// Microseconds of rows and frames.
    pub rows_microseconds: f64,
    /// Microseconds of constrained dynamics.
    pub solve_microseconds: f64,
    /// Microseconds of continuous detection.
    pub detection_microseconds: f64,
    /// Microseconds of the fail-safes.
    pub fail_safe_microseconds: f64,
    /// Microseconds of the certificate.
    pub certificate_microseconds: f64,
    /// Microseconds of the whole step.
    pub total_microseconds: f64,
    /// Bytes held by the method's memory and buffers.
    pub bytes: u64,
    /// Microseconds of the metric, and of assembly and unconstrained solve of the bodies that the library drives.
    pub dynamics_microseconds: f64,
    /// Zones whose velocities were projected.
    pub projected_zones: u64,
}

// SAFETY: repr(C) without padding; numbers.
unsafe impl Growing for SgnStepReport {
    const NAME: &'static str = "SgnStepReport";
    const FIRST_SIZE: usize = 208;
    fn defaults() -> Self {
        // SAFETY: numbers only.
        unsafe { std::mem::zeroed() }
    }
}

impl SgnStepReport {
    pub(super) fn of(report: &StepReport) -> SgnStepReport {
        let notes = [
            (report.not_converged, SGN_STEP_NOT_CONVERGED),
            (report.parts > 1, SGN_STEP_SUBDIVIDED),
            (report.projected_zones + report.rigid_zones + report.held_vertices > 0, SGN_STEP_FAIL_SAFE_USED),
            (report.tangled_pairs > 0, SGN_STEP_TANGLED_PAIRS),
        ];
        SgnStepReport {
            struct_size: 0,
            contacts: report.contacts,
            active_contacts: report.active_contacts,
            rounds: report.rounds,
            iterations: report.iterations,
            parts: report.parts,
            rigid_zones: report.rigid_zones,
            held_vertices: report.held_vertices,
            tangled_pairs: report.tangled_pairs,
            certified: u32::from(report.intersections.is_some()),
            intersections: u64::from(report.intersections.unwrap_or(0)),
            notes: notes.iter().filter(|(holds, _)| *holds).map(|(_, bit)| bit).sum(),
            complementarity_residual: report.complementarity_residual,
            friction_residual: report.friction_residual,
            dynamics_residual: report.dynamics_residual,
            recovery_work: report.recovery_work,
            momentum_taken: report.momentum_taken,
            angular_momentum_error: report.angular_momentum_error,
            certified_fraction: report.certified_fraction,
            search_microseconds: report.times.search,
            rows_microseconds: report.times.rows,
            solve_microseconds: report.times.solve,
            detection_microseconds: report.times.detection,
            fail_safe_microseconds: report.times.fail_safe,
            certificate_microseconds: report.times.certificate,
            total_microseconds: report.times.total,
            bytes: report.bytes,
            dynamics_microseconds: report.times.dynamics,
            projected_zones: u64::from(report.projected_zones),
        }
    }

    /// The gravest note.
    pub(super) fn note(&self) -> SgnResult {
        [
            (SGN_STEP_TANGLED_PAIRS, SGN_NOTE_TANGLED_PAIRS),
            (SGN_STEP_FAIL_SAFE_USED, SGN_NOTE_FAIL_SAFE_USED),
            (SGN_STEP_NOT_CONVERGED, SGN_NOTE_NOT_CONVERGED),
            (SGN_STEP_SUBDIVIDED, SGN_NOTE_SUBDIVIDED),
        ]
        .iter()
        .find(|(bit, _)| self.notes & bit != 0)
        .map_or(SGN_OK, |(_, note)| *note)
    }
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnStepDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_step_desc_init(desc: *mut SgnStepDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `report` with zeros and its size; `size` is `sizeof(SgnStepReport)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_step_report_init(report: *mut SgnStepReport, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(report, size) })
}

/// Advances all bodies by `desc->dt` with what has been pushed. `report` may be NULL.
///
/// Afterwards the end state is the start state of the next step, pushed displacement velocities and system values stay,
/// targets are used up.
/// Thread: exclusive; log callbacks come on this thread. Notes (the gravest is returned, all are in the report):
/// TANGLED_PAIRS, FAIL_SAFE_USED, NOT_CONVERGED, SUBDIVIDED. Errors (the world is then as it was, PINCHED excepted):
/// NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT, UNSUPPORTED, INTERSECTING_START,
/// PINCHED, SINGULAR_SYSTEM, OUT_OF_MEMORY, CANCELLED, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_step(
    world: *mut SgnWorld,
    desc: *const SgnStepDesc,
    report: *mut SgnStepReport,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        let Some(SgnWorld { cancelled, .. }) = world.as_ref() else { return SGN_ERROR_NULL_ARGUMENT };
        change(world, "sgn_world_step", |world, context| {
            let desc = structs::read(desc)?;
            let settings = desc.settings()?;
            let size = if report.is_null() { 0 } else { structs::checked_size(report)? };
            let hand_over = |given: &StepReport| {
                let answer = SgnStepReport::of(given);
                if size > 0 {
                    structs::write(report, size, &answer);
                }
                answer
            };
            cancelled.store(false, Ordering::Relaxed);
            let host = ProgressOfHost { callback: desc.progress_callback, user: desc.progress_user, cancelled };
            let told = |phase, fraction| host.goes_on(phase, fraction);
            match world.step_watched(&settings, desc.dt, context.par(), Watch { told: Some(&told) }) {
                Ok(given) => {
                    let answer = hand_over(&given);
                    let level = if answer.notes == 0 { SGN_LOG_INFO } else { SGN_LOG_WARNING };
                    context.log(level, || summary("sgn_world_step", &answer));
                    Ok(answer.note())
                }
                Err(failure) => {
                    if let Some(given) = &failure.report {
                        hand_over(given);
                    }
                    Err(failure.error.into())
                }
            }
        })
    }
}

/// Cancels the step that is running in the world: it returns CANCELLED before its next phase, and the world is as it was
/// before it. Without a running step it does nothing.
///
/// Thread: any, also while the world is at work, and in its callbacks. Errors: NULL_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_cancel(world: *mut SgnWorld) -> SgnResult {
    call(|| {
        // SAFETY: the caller vouches for the pointer.
        let world = unsafe { world.as_ref() }.ok_or_else(|| Failure::null("world"))?;
        world.cancelled.store(true, Ordering::Relaxed);
        Ok(SGN_OK)
    })
}

/// The host as it watches a step.
pub(super) struct ProgressOfHost<'a> {
    pub callback: SgnProgressCallback,
    pub user: *mut c_void,
    pub cancelled: &'a AtomicBool,
}

// SAFETY: the callback is called on the thread that steps, and nowhere else; the rest is atomic or constant.
unsafe impl Sync for ProgressOfHost<'_> {}

impl ProgressOfHost<'_> {
    pub fn goes_on(&self, phase: Phase, fraction: f64) -> bool {
        let number = match phase {
            Phase::Dynamics => SGN_PHASE_DYNAMICS,
            Phase::Start => SGN_PHASE_START,
            Phase::Round => SGN_PHASE_ROUND,
            Phase::FailSafe => SGN_PHASE_FAIL_SAFE,
        };
        // SAFETY: the host gave the callback for this use.
        let agreed = self.callback.is_none_or(|callback| unsafe { callback(self.user, number, fraction) } != 0);
        agreed && !self.cancelled.load(Ordering::Relaxed)
    }
}

/// A line for the log.
pub(super) fn summary(function: &str, report: &SgnStepReport) -> String {
    format!(
        "{function}: {} contacts, {} with an impulse, {} rounds, {} iterations, {} parts, {} projected and \
         {} rigid zones, {} held vertices, {} tangled pairs, residuals {:.1e} {:.1e} {:.1e}, {:.0} us",
        report.contacts,
        report.active_contacts,
        report.rounds,
        report.iterations,
        report.parts,
        report.projected_zones,
        report.rigid_zones,
        report.held_vertices,
        report.tangled_pairs,
        report.complementarity_residual,
        report.friction_residual,
        report.dynamics_residual,
        report.total_microseconds
    )
}
