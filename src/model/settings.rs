//! Tolerances and work caps of a step. All relative or counters: never wall-clock, never absolute lengths.

/// Contact method of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Implicit contact: constraint manifold refinement around iterative constraint anticipation [Otaduy09, §3-5].
    #[default]
    ImplicitContact,
    /// Velocity filter: repulsions, impulses, zones [Harmon10, ch. 3].
    VelocityFilter,
}

/// Which solver runs the constrained dynamics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SolverChoice {
    /// Accelerated projected relaxation with a short splitting start and the augmented Lagrangian as fallback.
    #[default]
    Automatic,
    /// Iterative constraint anticipation exactly as published [Otaduy09, §5.5].
    IterativeAnticipation,
    /// The same with one light pass over the contacts per outer iteration.
    LightAnticipation,
    /// Accelerated projected relaxation alone.
    AcceleratedRelaxation,
    /// Augmented Lagrangian with preconditioned conjugate gradients.
    AugmentedLagrangian,
    /// Full constraint anticipation [Otaduy09, §5.1]; a baseline, quadratic cost. Beyond 32,768 rows, three per contact with
    /// friction, iterative anticipation stands in.
    FullAnticipation,
}

/// Shape of the friction limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrictionCone {
    /// `|gamma| <= mu lambda`, isotropic.
    #[default]
    Disc,
    /// Each component clamped on its own, aligned with the unconstrained sliding velocity [Otaduy09, §3.4]; up to
    /// `sqrt 2 mu` along the diagonal.
    Pyramid,
}

/// What to do with a start state that intersects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartPolicy {
    /// Refuse it, with witnesses.
    #[default]
    Refuse,
    /// Let every pair that touches the tangled component pass until it has separated.
    Pass,
}

/// What answers a zone of collisions that the method's own iterations left. One that does not help turns the zone into
/// a rigid one, then into one that is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FailSafe {
    /// The smallest change of velocities, in the metric of the masses, after which no collision of the zone comes closer
    /// than it may: impulses push and never pull.
    #[default]
    UnilateralProjection,
    /// The smallest change after which no collision of the zone approaches or separates [Harmon10, Eq. 3.8]: impulses may
    /// pull.
    InelasticProjection,
    /// The zone moves as one rigid body [Harmon10, Algorithm 2].
    RigidZone,
}

/// Friction within a zone that is projected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ZoneFriction {
    /// Each contact within its own limit, with its own coefficient.
    #[default]
    PerContact,
    /// One limit and one coefficient for all sliding of the zone [Harmon10, §3.7].
    PerZone,
    /// None.
    Frictionless,
}

/// Parts of the method that can be left out, to measure what each is worth; the default leaves nothing out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ablation {
    /// Pairs near at the start are contacts from the first round; otherwise continuous detection alone makes contacts
    /// [Otaduy09, §4].
    pub near_contacts: bool,
    /// Rows bound the gap at the end of the step; otherwise they only forbid what is in contact to approach
    /// [Otaduy09, §4].
    pub position_level: bool,
    /// Repeats at each contact of [`SolverChoice::IterativeAnticipation`] [Otaduy09, §5.5: 3].
    pub repeats: u32,
}

impl Default for Ablation {
    fn default() -> Self {
        Ablation { near_contacts: true, position_level: true, repeats: 3 }
    }
}

/// What only [`Method::VelocityFilter`] reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSettings {
    /// Coefficient of restitution, 0 to 1, that collisions have at least: the share of its normal velocity with which one
    /// parts is the greatest of this and of its materials'.
    pub restitution: f64,
    /// Stiffness k of the springs between what is closer than its thickness, at least 0, in units of the contact's
    /// effective mass over `dt^2`: 1 makes up for the whole overlap within a step, before the cap on the separation that it
    /// causes (`recovery_fraction`), and so carries a load that would fall by the overlap in a step; 10, ten of them.
    /// 0: no springs.
    pub repulsion_stiffness: f64,
    /// Passes of impulses and continuous detection before the fail-safes.
    pub passes_max: u32,
    /// Whether collisions with scripts are answered first, zones included, and all others after that, as [Harmon10, §3.8]
    /// tried. A baseline that fails: what it leaves is held or pinched, since nothing passes here.
    pub two_pass: bool,
}

impl Default for FilterSettings {
    fn default() -> Self {
        FilterSettings { restitution: 0.0, repulsion_stiffness: 10.0, passes_max: 10, two_pass: false }
    }
}

/// Settings of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Contact method that [`crate::world::World::step`] runs.
    pub method: Method,
    /// What the velocity filter reads.
    pub filter: FilterSettings,
    /// Solver of the constrained dynamics.
    pub solver: SolverChoice,
    /// Shape of the friction limit.
    pub friction_cone: FrictionCone,
    /// Start states that intersect, and scripted motions that leave no room.
    pub start_policy: StartPolicy,
    /// Bound of the complementarity and friction residuals, relative to the largest velocity.
    pub contact_tolerance: f64,
    /// Bound of the estimated relative velocity error.
    pub velocity_tolerance: f64,
    /// Outer iterations of a step: each constrained dynamics solve may use half of what is left, and always a fiftieth.
    pub iterations_max: u32,
    /// Iterations of operator splitting before the relaxation of [`SolverChoice::Automatic`]; 0 for none. They pay where
    /// a coarse answer to fast moving, stiff cloth is enough.
    pub splitting_iterations: u32,
    /// Rounds of constraint manifold refinement before a step is divided [Otaduy09, §4: 5].
    pub rounds_max: u32,
    /// Halvings of a step before the fail-safes [Otaduy09, §4: 2].
    pub halvings_max: u32,
    /// Thickness regained per step at most, as a fraction of the pair thickness.
    pub recovery_fraction: f64,
    /// Proximity range at the start of a step, as a multiple of the pair thickness, at least 1. Pairs beyond 1 become
    /// contacts when a tentative motion brings them within their thickness.
    pub proximity_factor: f64,
    /// A rigid or kinematic part that turns more than this in a step is subdivided in time `[rad]`.
    pub turn_max: f64,
    /// What answers zones of collisions that are left.
    pub fail_safe: FailSafe,
    /// Friction within projected zones.
    pub zone_friction: ZoneFriction,
    /// Certify the end state by exact predicates.
    pub certify: bool,
    /// What is left out.
    pub ablation: Ablation,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            method: Method::default(),
            filter: FilterSettings::default(),
            solver: SolverChoice::default(),
            friction_cone: FrictionCone::default(),
            start_policy: StartPolicy::default(),
            contact_tolerance: 3e-3,
            velocity_tolerance: 3e-2,
            iterations_max: 2000,
            splitting_iterations: 0,
            rounds_max: 5,
            halvings_max: 2,
            recovery_fraction: 0.1,
            proximity_factor: 2.0,
            turn_max: 0.5,
            fail_safe: FailSafe::default(),
            zone_friction: ZoneFriction::default(),
            certify: false,
            ablation: Ablation::default(),
        }
    }
}
