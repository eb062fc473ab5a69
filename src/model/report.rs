//! What a step did, and how building or stepping can fail.

use crate::math::Vec3;

/// One contact of the last solve, as the host pulls it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactRecord {
    /// Body keys, `[a, b]`.
    pub bodies: [u64; 2],
    /// 0 vertex-face, 1 edge-edge, 2 vertex-half-space.
    pub kind: u32,
    /// Feature of each body, local index: vertex and face, or edge and edge.
    pub features: [u32; 2],
    /// The four signed weights of the stencil.
    pub weights: [f64; 4],
    /// Contact point `[m]`, on body `b`'s side.
    pub point: Vec3,
    /// Unit normal, from `b` to `a`.
    pub normal: Vec3,
    /// Distance at the end of the step `[m]`.
    pub distance: f64,
    /// Impulse on `a` over the step `[N s]`.
    pub impulse: Vec3,
    /// 0 separated (no impulse), 1 sticking, 2 slipping.
    pub state: u32,
    /// Persistent key: the same pair keeps it from step to step.
    pub key: u64,
}

/// Two features that intersect or leave no room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Witness {
    /// [`Witness::VERTEX_FACE`] and the others.
    pub kind: u32,
    /// Body keys, `[edge or vertex, face, edge or half-space]`.
    pub bodies: [u64; 2],
    /// Local indices of the two features; 0 for a half-space.
    pub features: [u32; 2],
    /// A point of the intersection, or between the two features `[m]`.
    pub point: Vec3,
}

impl Witness {
    /// A vertex and a face.
    pub const VERTEX_FACE: u32 = 0;
    /// Two edges.
    pub const EDGE_EDGE: u32 = 1;
    /// A vertex and a half-space.
    pub const VERTEX_HALF_SPACE: u32 = 2;
    /// An edge and a face.
    pub const EDGE_FACE: u32 = 3;
}

/// Microseconds by stage. Not part of any hash.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Metric; assembly and unconstrained solve of MODEL bodies.
    pub dynamics: f64,
    /// Proximity and candidate search.
    pub search: f64,
    /// Rows and frames.
    pub rows: f64,
    /// Constrained dynamics.
    pub solve: f64,
    /// Continuous detection.
    pub detection: f64,
    /// Fail-safes.
    pub fail_safe: f64,
    /// Certificate.
    pub certificate: f64,
    /// The whole step.
    pub total: f64,
}

/// What a step did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepReport {
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
    /// Zones whose velocities were projected.
    pub projected_zones: u32,
    /// Zones that moved as rigid bodies.
    pub rigid_zones: u32,
    /// Vertices held.
    pub held_vertices: u32,
    /// Pairs that passed because they touch a tangled component.
    pub tangled_pairs: u32,
    /// Some solve stopped at its work cap.
    pub not_converged: bool,
    /// Complementarity residual, relative; worst of the step.
    pub complementarity_residual: f64,
    /// Friction residual, relative; worst of the step.
    pub friction_residual: f64,
    /// Dynamics residual `|A dv - J^T lambda| / |J^T lambda|`; worst of the step.
    pub dynamics_residual: f64,
    /// Work done by thickness recovery, by springs of the velocity filter at most `[J]`.
    pub recovery_work: f64,
    /// Momentum taken by held zones and infinite masses `[N s]`.
    pub momentum_taken: Vec3,
    /// Error in angular momentum from normals at impact `[N m s]`.
    pub angular_momentum_error: f64,
    /// Fraction of the step that the state stands at; below 1 only when pinched.
    pub certified_fraction: f64,
    /// Intersections found by the certificate, if asked for.
    pub intersections: Option<u32>,
    /// Microseconds by stage.
    pub times: StageTimes,
    /// Bytes of what is carried to the next step, and of candidates: not of models, metrics and other buffers.
    pub bytes: u64,
}

impl StepReport {
    /// Zones that were projected or moved as rigid bodies.
    pub fn zones(&self) -> u32 {
        self.projected_zones + self.rigid_zones
    }
}

/// A description that cannot be built, naming what and where.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildError {
    /// Key of the body, or 0.
    pub body: u64,
    /// Array index at fault, or 0.
    pub index: usize,
    /// Value at fault, or NaN.
    pub value: f64,
    /// What is wrong.
    pub message: &'static str,
}

/// Why a step gave no end state (or, pinched, an early one).
#[derive(Clone, Debug, PartialEq)]
pub enum StepError {
    /// The start state intersects.
    IntersectingStart(Vec<Witness>),
    /// Scripted geometry leaves no room; the state stands at the reported fraction.
    Pinched {
        /// Where.
        witnesses: Vec<Witness>,
        /// The report up to there.
        report: Box<StepReport>,
    },
    /// A host matrix is not positive definite at this block row.
    SingularSystem {
        /// Index of the system.
        system: usize,
        /// Block row.
        row: usize,
    },
    /// A length, mass or velocity is not finite or out of range.
    BadInput(BuildError),
    /// Cancelled by the host; the state is unchanged.
    Cancelled,
}
