//! Bodies of a world: descriptions with their checks, and what the world keeps of each.

use super::surface::surface;
use super::{Fault, Topology, World, WorldError, ids};
use crate::kinematics::{Pose, place_vertices};
use crate::math::{Mat3, Vec3, ZERO, is_finite, mat_mul, norm, transpose};
use crate::model::{BodyDescription, Dynamics, HalfSpace, Kind, Precision, Surface};
use std::sync::Arc;

/// What every kind of body has.
#[derive(Clone, Copy, Debug)]
pub struct BodyOptions {
    /// Half of the pair thickness `[m]`; `None`: a tenth of the mean edge length.
    pub half_thickness: Option<f64>,
    /// Material id; 0: frictionless.
    pub material: u64,
    /// Groups the body belongs to.
    pub groups: u64,
    /// Groups it collides with.
    pub mask: u64,
    /// Whether a deformable body collides with itself.
    pub self_collision: bool,
    /// Number format in which the host takes the end state.
    pub precision: Precision,
    /// A number of the host's, handed back unread.
    pub user_key: u64,
}

impl Default for BodyOptions {
    fn default() -> Self {
        BodyOptions {
            half_thickness: None,
            material: 0,
            groups: 1,
            mask: u64::MAX,
            self_collision: true,
            precision: Precision::Double,
            user_key: 0,
        }
    }
}

/// A body of free vertices, driven by the host.
#[derive(Clone, Debug, Default)]
pub struct DeformableDescription {
    /// What every kind of body has.
    pub options: BodyOptions,
    /// Start positions `[m]`.
    pub positions: Vec<Vec3>,
    /// Rest positions `[m]`; empty: the start positions.
    pub rest: Vec<Vec3>,
    /// What collides.
    pub topology: Topology,
    /// Lumped masses `[kg]`, positive.
    pub masses: Vec<f64>,
    /// Vertices that follow their displacement velocity exactly; empty: none.
    pub pinned: Vec<bool>,
}

/// A rigid body, driven by the host.
#[derive(Clone, Debug)]
pub struct RigidDescription {
    /// What every kind of body has.
    pub options: BodyOptions,
    /// Vertices in the body frame, about the centre of mass `[m]`.
    pub vertices: Vec<Vec3>,
    /// What collides.
    pub topology: Topology,
    /// Mass `[kg]`, positive.
    pub mass: f64,
    /// Inertia about the centre of mass `[kg m^2]`, symmetric positive definite.
    pub inertia: Mat3,
    /// Whether the inertia is given in world axes (at the start pose) and not in the body frame.
    pub inertia_in_world: bool,
    /// Start pose.
    pub pose: Pose,
    /// Displacement velocity of the centre of mass `[m/s]`.
    pub velocity: Vec3,
    /// Angular displacement velocity `[rad/s]`, world axes.
    pub angular_velocity: Vec3,
    /// Whether the library drives it, and the rates at which linear and angular velocity then decay `[1/s]`. The
    /// velocities are then those at the start.
    pub own_dynamics: Option<[f64; 2]>,
}

/// A body of prescribed motion and infinite mass.
#[derive(Clone, Debug, Default)]
pub struct KinematicDescription {
    /// What every kind of body has.
    pub options: BodyOptions,
    /// Vertices `[m]`: in the body frame with a pose, in the world without.
    pub vertices: Vec<Vec3>,
    /// What collides.
    pub topology: Topology,
    /// Start pose of a body that moves from pose to pose; `None`: vertices move on their own.
    pub pose: Option<Pose>,
}

/// Where a body stood when its state was last certified; kept while the host has pushed another start without saying
/// that it is a teleport.
#[derive(Clone, Debug)]
pub(super) struct Certified {
    pub positions: Vec<Vec3>,
    pub pose: Pose,
    pub half_space: HalfSpace,
}

/// A body as the world keeps it.
pub(super) struct Body {
    pub description: BodyDescription,
    /// Key of the material; 0: none.
    pub material: u64,
    pub user_key: u64,
    /// Start positions of the next step; world positions for every kind.
    pub positions: Vec<Vec3>,
    pub pose: Pose,
    pub half_space: HalfSpace,
    /// Whether a step has ended in, or been given, this state.
    pub stepped: bool,
    pub certified: Option<Certified>,
    /// Displacement velocity per block; of MODEL bodies the velocity at the start of the next step.
    pub velocities: Vec<Vec3>,
    /// Where prescribed motion ends; `None`: it stays.
    pub target_positions: Option<Vec<Vec3>>,
    pub target_pose: Option<Pose>,
    /// Where springs to targets pull at the start of the next step, and at its end if that was pushed.
    pub attachments: Vec<Vec3>,
    pub attachment_targets: Option<Vec<Vec3>>,
    pub target_half_space: Option<HalfSpace>,
    /// Results of the last step, per block; empty before the first.
    pub result_velocities: Vec<Vec3>,
    pub result_end_velocities: Vec<Vec3>,
    pub result_impulses: Vec<Vec3>,
}

const NO_HALF_SPACE: HalfSpace = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 };

impl Body {
    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        match &self.description.kind {
            Kind::Deformable { masses, .. } => masses.len(),
            Kind::Rigid { .. } => 2,
            Kind::Kinematic { .. } | Kind::HalfSpace(_) => 0,
        }
    }

    /// Where the nodes of a deformable body begin among its positions: after the points that they carry.
    pub fn first_node(&self) -> usize {
        self.description.embedding.as_ref().map_or(0, |embedding| embedding.len())
    }

    /// Number of vertices that collide or could: embedded points, or else all.
    pub fn vertex_count(&self) -> usize {
        if self.description.embedding.is_some() { self.first_node() } else { self.description.surface.rest.len() }
    }

    /// Whether the body has a pose.
    pub fn posed(&self) -> bool {
        matches!(self.description.kind, Kind::Rigid { .. } | Kind::Kinematic { posed: true })
    }

    /// World positions of the vertices at `pose`. Errors: one that is not finite.
    pub fn posed_vertices(&self, pose: &Pose) -> Result<Vec<Vec3>, WorldError> {
        let rest = &self.description.surface.rest;
        let mut positions = vec![ZERO; rest.len()];
        place_vertices(pose, rest, self.description.precision == Precision::Single, &mut positions);
        match positions.iter().position(|x| !is_finite(*x)) {
            Some(index) => Err(WorldError::new(Fault::NonFinite, "a posed vertex is not finite").index(index)),
            None => Ok(positions),
        }
    }

    pub(super) fn new(options: &BodyOptions, kind: Kind, surface: Surface) -> Body {
        let half_space = if let Kind::HalfSpace(plane) = &kind { *plane } else { NO_HALF_SPACE };
        let description = BodyDescription {
            key: 0,
            surface: Arc::new(surface),
            kind,
            half_thickness: options.half_thickness,
            material: 0,
            groups: options.groups,
            mask: options.mask,
            self_collision: options.self_collision,
            precision: options.precision,
            embedding: None,
            dynamics: None,
        };
        Body {
            description,
            material: 0,
            user_key: options.user_key,
            positions: Vec::new(),
            pose: Pose::IDENTITY,
            half_space,
            stepped: false,
            certified: None,
            velocities: Vec::new(),
            target_positions: None,
            target_pose: None,
            attachments: Vec::new(),
            attachment_targets: None,
            target_half_space: None,
            result_velocities: Vec::new(),
            result_end_velocities: Vec::new(),
            result_impulses: Vec::new(),
        }
    }
}

impl World {
    /// Adds a deformable body. Errors name the array index and the value; the world is then as it was.
    pub fn add_deformable(&mut self, description: DeformableDescription) -> Result<u64, WorldError> {
        let DeformableDescription { options, mut positions, rest, topology, masses, mut pinned } = description;
        let count = positions.len();
        let rest = if rest.is_empty() { positions.clone() } else { rest };
        if pinned.is_empty() {
            pinned = vec![false; count];
        }
        for (name, length) in [("rest positions", rest.len()), ("masses", masses.len()), ("pin flags", pinned.len())] {
            if length != count {
                let message = format!("{length} {name} for {count} vertices");
                return Err(WorldError::new(Fault::BufferLayout, message).value(length as f64));
            }
        }
        check_masses(&masses)?;
        round_all(&mut positions, options.precision, "start position")?;
        let surface = surface(rest, topology)?;
        let mut body = Body::new(&options, Kind::Deformable { masses, pinned }, surface);
        body.velocities = vec![ZERO; count];
        body.positions = positions;
        self.insert(&options, body)
    }

    /// Adds a rigid body. Errors as for a deformable one.
    pub fn add_rigid(&mut self, description: RigidDescription) -> Result<u64, WorldError> {
        let RigidDescription { options, vertices, topology, mass, pose, .. } = description;
        if !(mass > 0.0 && mass.is_finite()) {
            let fault = if mass.is_finite() { Fault::InvalidArgument } else { Fault::NonFinite };
            return Err(WorldError::new(fault, "the mass of a rigid body is positive and finite").value(mass));
        }
        let pose = checked_pose(pose, options.precision)?;
        let mut inertia = symmetric(description.inertia)?;
        if description.inertia_in_world {
            let r = pose.rotation();
            inertia = mat_mul(&transpose(&r), &mat_mul(&inertia, &r));
            inertia = symmetric(inertia)?;
        }
        for (what, v) in [("velocity", description.velocity), ("angular velocity", description.angular_velocity)] {
            if !is_finite(v) {
                return Err(WorldError::new(Fault::NonFinite, format!("the {what} is not finite")));
            }
        }
        let surface = surface(vertices, topology)?;
        let mut body = Body::new(&options, Kind::Rigid { mass, inertia }, surface);
        body.velocities = vec![description.velocity, description.angular_velocity];
        if let Some([linear_damping, angular_damping]) = description.own_dynamics {
            if let Some(rate) = [linear_damping, angular_damping].iter().find(|d| !(**d >= 0.0 && d.is_finite())) {
                let fault = if rate.is_finite() { Fault::InvalidArgument } else { Fault::NonFinite };
                return Err(WorldError::new(fault, "a damping rate is finite and not negative").value(*rate));
            }
            body.description.dynamics = Some(Arc::new(Dynamics::Rigid { linear_damping, angular_damping }));
        }
        self.insert_posed(&options, body, pose)
    }

    /// Adds a kinematic body. Errors as for a deformable one.
    pub fn add_kinematic(&mut self, description: KinematicDescription) -> Result<u64, WorldError> {
        let KinematicDescription { options, mut vertices, topology, pose } = description;
        if let Some(pose) = pose {
            let pose = checked_pose(pose, options.precision)?;
            let surface = surface(vertices, topology)?;
            return self.insert_posed(&options, Body::new(&options, Kind::Kinematic { posed: true }, surface), pose);
        }
        let rest = vertices.clone();
        round_all(&mut vertices, options.precision, "start position")?;
        let mut body = Body::new(&options, Kind::Kinematic { posed: false }, surface(rest, topology)?);
        body.positions = vertices;
        self.insert(&options, body)
    }

    /// Adds a half-space. Errors: a normal without direction, values that are not finite.
    pub fn add_half_space(&mut self, options: BodyOptions, plane: HalfSpace) -> Result<u64, WorldError> {
        let plane = checked_half_space(plane)?;
        self.insert(&options, Body::new(&options, Kind::HalfSpace(plane), Surface::default()))
    }

    fn insert_posed(&mut self, options: &BodyOptions, mut body: Body, pose: Pose) -> Result<u64, WorldError> {
        body.positions = body.posed_vertices(&pose)?;
        body.pose = pose;
        self.insert(options, body)
    }

    pub(super) fn insert(&mut self, options: &BodyOptions, mut body: Body) -> Result<u64, WorldError> {
        if let Some(half_thickness) = body.description.half_thickness
            && !(half_thickness >= 0.0 && half_thickness.is_finite())
        {
            let fault = if half_thickness.is_nan() { Fault::NonFinite } else { Fault::InvalidArgument };
            return Err(WorldError::new(fault, "the half thickness is finite and not negative").value(half_thickness));
        }
        body.material = self.materials.key_of(options.material)?;
        let id = self.bodies.insert_with(|id| {
            body.description.key = ids::key(id);
            Ok(body)
        })?;
        self.model_current = false;
        Ok(id)
    }

    /// Removes a body, and the systems that name it.
    pub fn remove_body(&mut self, id: u64) -> Result<(), WorldError> {
        self.bodies.remove(id)?;
        let named: Vec<u64> = self
            .systems
            .iter()
            .filter(|(_, system)| system.bodies.contains(&ids::key(id)))
            .map(|(system, _)| system)
            .collect();
        for system in named {
            self.systems.remove(system)?;
        }
        self.model_current = false;
        Ok(())
    }

    /// Sets the groups and the mask of a body.
    pub fn set_filter(&mut self, id: u64, groups: u64, mask: u64) -> Result<(), WorldError> {
        let body = self.bodies.get_mut(id)?;
        body.description.groups = groups;
        body.description.mask = mask;
        self.model_current = false;
        Ok(())
    }

    /// Sets the material of a body; 0: frictionless.
    pub fn set_material(&mut self, id: u64, material: u64) -> Result<(), WorldError> {
        let material = self.materials.key_of(material)?;
        self.bodies.get_mut(id)?.material = material;
        self.model_current = false;
        Ok(())
    }
}

/// Masses are positive and finite, those of pinned vertices too.
pub(super) fn check_masses(masses: &[f64]) -> Result<(), WorldError> {
    for (index, mass) in masses.iter().enumerate() {
        if !mass.is_finite() {
            return Err(WorldError::new(Fault::NonFinite, "a mass is not finite").index(index).value(*mass));
        }
        if *mass <= 0.0 {
            return Err(WorldError::new(Fault::InvalidArgument, "a mass is not positive").index(index).value(*mass));
        }
    }
    Ok(())
}

/// The number nearest to `x` in the host's format.
pub(super) fn rounded(x: f64, precision: Precision) -> f64 {
    match precision {
        Precision::Single => x as f32 as f64,
        Precision::Double => x,
    }
}

/// Rounds to the host's format. Errors: a value that is not finite there.
pub(super) fn round_all(positions: &mut [Vec3], precision: Precision, what: &str) -> Result<(), WorldError> {
    for (index, x) in positions.iter_mut().enumerate() {
        for value in x.iter_mut() {
            let given = *value;
            *value = rounded(given, precision);
            if !value.is_finite() {
                let message = format!("{what} {index} is not finite in the host's number format");
                return Err(WorldError::new(Fault::NonFinite, message).index(index).value(given));
            }
        }
    }
    Ok(())
}

/// The pose with its orientation brought to unit length, rounded to the host's format. An orientation that has unit
/// length to the rounding of the format is taken as it is. Errors: not finite, no direction.
pub(super) fn checked_pose(pose: Pose, precision: Precision) -> Result<Pose, WorldError> {
    let mut position = [pose.position];
    round_all(&mut position, precision, "the position of pose")?;
    let q = pose.orientation;
    if q.iter().any(|c| !c.is_finite()) {
        return Err(WorldError::new(Fault::NonFinite, "the orientation is not finite"));
    }
    let largest = q.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if largest == 0.0 {
        return Err(WorldError::new(Fault::InvalidArgument, "the orientation is the zero quaternion").value(0.0));
    }
    let scaled = q.map(|c| c / largest);
    let length = largest * scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
    let slack = match precision {
        Precision::Single => 4.0 * f32::EPSILON as f64,
        Precision::Double => 4.0 * f64::EPSILON,
    };
    let unit = if (length - 1.0).abs() <= slack { q } else { scaled.map(|c| c * (largest / length)) };
    Ok(Pose { position: position[0], orientation: unit.map(|c| rounded(c, precision)) })
}

/// The half-space with a unit normal. Errors: not finite, no direction.
pub(super) fn checked_half_space(plane: HalfSpace) -> Result<HalfSpace, WorldError> {
    if !is_finite(plane.normal) || !plane.offset.is_finite() {
        return Err(WorldError::new(Fault::NonFinite, "the half-space is not finite"));
    }
    let length = norm(plane.normal);
    if (length - 1.0).abs() <= 4.0 * f64::EPSILON {
        return Ok(plane);
    }
    let normal = crate::math::unit(plane.normal)
        .ok_or_else(|| WorldError::new(Fault::InvalidArgument, "the normal of the half-space is zero").value(0.0))?;
    Ok(HalfSpace { normal, offset: plane.offset })
}

/// The inertia with its rounding asymmetry removed. Errors: not finite, not symmetric to a millionth of its largest
/// entry, not positive definite.
pub(super) fn symmetric(m: Mat3) -> Result<Mat3, WorldError> {
    if m.iter().any(|row| !is_finite(*row)) {
        return Err(WorldError::new(Fault::NonFinite, "the inertia is not finite"));
    }
    let largest = m.iter().flatten().fold(0.0f64, |l, x| l.max(x.abs()));
    let mut s = m;
    for i in 0..3 {
        for j in 0..3 {
            let difference = m[i][j] - m[j][i];
            if difference.abs() > 1e-6 * largest {
                let message = format!("the inertia is not symmetric at row {i}, column {j}");
                return Err(WorldError::new(Fault::InvalidArgument, message).index(3 * i + j).value(m[i][j]));
            }
            s[i][j] = 0.5 * m[i][j] + 0.5 * m[j][i];
        }
    }
    if !crate::math::is_positive_definite(&s) {
        let determinant = crate::math::determinant(&s);
        return Err(WorldError::new(Fault::InvalidArgument, "the inertia is not positive definite").value(determinant));
    }
    Ok(s)
}
