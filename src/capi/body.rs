//! Bodies: creation, removal, filters, what they consist of.

use super::boundary::{call, change, look};
use super::shape::{SgnShapeDesc, tessellated};
use super::status::{Failure, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_NON_FINITE_INPUT, SGN_OK, SgnResult};
use super::structs::{self, Growing};
use super::views::{self, SgnView};
use super::world::{SgnBodyId, SgnMaterialId, SgnWorld};
use crate::kinematics::Pose;
use crate::math::Vec3;
use crate::model::{HalfSpace, Precision};
use crate::world::{BodyKind, BodyOptions, DeformableDescription, KinematicDescription, RigidDescription, Topology};

/// Number format in which a host takes the end state of a body. The state is certified after rounding to it, and
/// positions and poses are pulled in it.
pub type SgnPrecision = i32;
/// `double`. The default.
pub const SGN_PRECISION_F64: i32 = 0;
/// `float`
pub const SGN_PRECISION_F32: i32 = 1;

/// Flag of a deformable body: it does not collide with itself.
pub const SGN_BODY_NO_SELF_COLLISION: u64 = 1;
/// Flag of a rigid body: the inertia is given in world axes at the start pose, not in the body frame.
pub const SGN_BODY_INERTIA_IN_WORLD: u64 = 2;
/// Flag of a kinematic mesh: it moves from pose to pose, its vertices are in the body frame. Always so with a shape.
pub const SGN_BODY_POSED: u64 = 4;

/// What every description has in common, as the host gives it.
struct CommonFields {
    precision: SgnPrecision,
    flags: u64,
    half_thickness: f64,
    material: SgnMaterialId,
    groups: u64,
    mask: u64,
    user_key: u64,
}

/// The common fields of a description; the structs of the header are flat, so that each can grow on its own.
macro_rules! common_fields {
    ($desc:expr) => {
        CommonFields {
            precision: $desc.precision,
            flags: $desc.flags,
            half_thickness: $desc.half_thickness,
            material: $desc.material,
            groups: $desc.groups,
            mask: $desc.mask,
            user_key: $desc.user_key,
        }
    };
}

impl CommonFields {
    fn options(&self, allowed: u64) -> Result<BodyOptions, Failure> {
        let invalid = |what: &str, value: f64| {
            Failure::new(SGN_ERROR_INVALID_ARGUMENT, format!("{what} {value} is out of range")).value(value)
        };
        if self.flags & !allowed != 0 {
            return Err(invalid("flags", (self.flags & !allowed) as f64));
        }
        if !self.half_thickness.is_finite() {
            let message = "the half thickness is not finite";
            return Err(Failure::new(SGN_ERROR_NON_FINITE_INPUT, message).value(self.half_thickness));
        }
        let precision = match self.precision {
            SGN_PRECISION_F64 => Precision::Double,
            SGN_PRECISION_F32 => Precision::Single,
            other => return Err(invalid("precision", f64::from(other))),
        };
        Ok(BodyOptions {
            half_thickness: (self.half_thickness >= 0.0).then_some(self.half_thickness),
            material: self.material.value,
            groups: self.groups,
            mask: self.mask,
            self_collision: self.flags & SGN_BODY_NO_SELF_COLLISION == 0,
            precision,
            user_key: self.user_key,
        })
    }
}

/// A body of free vertices whose dynamics are the host's. Fill with `sgn_deformable_desc_init`.
///
/// Triangles, edges and points say what collides; edges of triangles need not be given. All three empty: every vertex is
/// a point.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnDeformableDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// `SGN_BODY_` flags. Default: 0.
    pub flags: u64,
    /// Half of the thickness of a pair, in the host's unit of length: two bodies keep the sum of their halves apart.
    /// Negative: a tenth of the mean edge length. Default: -1.
    pub half_thickness: f64,
    /// Material; null: frictionless. Default: null.
    pub material: SgnMaterialId,
    /// Groups that the body belongs to, a bit each. Default: 1.
    pub groups: u64,
    /// Groups that it collides with; two bodies collide when each has a group of the other in its mask. Default: all.
    pub mask: u64,
    /// A number of the host's, handed back by `sgn_body_info`. Default: 0.
    pub user_key: u64,
    /// Start positions, F32X3 or F64X3. They say how many vertices there are.
    pub positions: SgnView,
    /// Rest positions, as many; empty: the start positions.
    pub rest_positions: SgnView,
    /// Triangles, U32X3 or U64X3, either winding.
    pub triangles: SgnView,
    /// Edges besides those of triangles, U32X2 or U64X2.
    pub edges: SgnView,
    /// Points besides the vertices of triangles and edges, U32 or U64.
    pub points: SgnView,
    /// Lumped masses, F32 or F64, one per vertex, positive.
    pub masses: SgnView,
    /// U8 per vertex: not 0 where the vertex follows its displacement velocity exactly. Empty: none does.
    pub pinned: SgnView,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnDeformableDesc {
    const NAME: &'static str = "SgnDeformableDesc";
    const FIRST_SIZE: usize = 336;
    fn defaults() -> Self {
        SgnDeformableDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            flags: 0,
            half_thickness: -1.0,
            material: SgnMaterialId { value: 0 },
            groups: 1,
            mask: u64::MAX,
            user_key: 0,
            positions: SgnView::EMPTY,
            rest_positions: SgnView::EMPTY,
            triangles: SgnView::EMPTY,
            edges: SgnView::EMPTY,
            points: SgnView::EMPTY,
            masses: SgnView::EMPTY,
            pinned: SgnView::EMPTY,
        }
    }
}

/// A rigid body whose dynamics are the host's: a mesh or a shape. Fill with `sgn_rigid_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnRigidDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// `SGN_BODY_` flags. Default: 0.
    pub flags: u64,
    /// Half of the thickness of a pair, in the host's unit of length: two bodies keep the sum of their halves apart.
    /// Negative: a tenth of the mean edge length. Default: -1.
    pub half_thickness: f64,
    /// Material; null: frictionless. Default: null.
    pub material: SgnMaterialId,
    /// Groups that the body belongs to, a bit each. Default: 1.
    pub groups: u64,
    /// Groups that it collides with; two bodies collide when each has a group of the other in its mask. Default: all.
    pub mask: u64,
    /// A number of the host's, handed back by `sgn_body_info`. Default: 0.
    pub user_key: u64,
    /// A shape, or NULL for a mesh; read during the call.
    pub shape: *const SgnShapeDesc,
    /// Vertices of a mesh in the body frame, about the centre of mass, F32X3 or F64X3.
    pub vertices: SgnView,
    /// As for a deformable body.
    pub triangles: SgnView,
    /// As for a deformable body.
    pub edges: SgnView,
    /// As for a deformable body.
    pub points: SgnView,
    /// Mass, positive. Default: 1.
    pub mass: f64,
    /// Inertia about the centre of mass, 3x3, symmetric, positive definite. Default: the identity.
    pub inertia: [f64; 9],
    /// Centre of mass at the start. Default: the origin.
    pub position: [f64; 3],
    /// Orientation at the start, quaternion x y z w; made a unit one. Default: 0 0 0 1.
    pub orientation: [f64; 4],
    /// Displacement velocity of the centre of mass. Default: 0.
    pub velocity: [f64; 3],
    /// Angular displacement velocity, world axes, radians per time. Default: 0.
    pub angular_velocity: [f64; 3],
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnRigidDesc {
    const NAME: &'static str = "SgnRigidDesc";
    const FIRST_SIZE: usize = 408;
    fn defaults() -> Self {
        SgnRigidDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            flags: 0,
            half_thickness: -1.0,
            material: SgnMaterialId { value: 0 },
            groups: 1,
            mask: u64::MAX,
            user_key: 0,
            shape: std::ptr::null(),
            vertices: SgnView::EMPTY,
            triangles: SgnView::EMPTY,
            edges: SgnView::EMPTY,
            points: SgnView::EMPTY,
            mass: 1.0,
            inertia: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
        }
    }
}

/// A body of prescribed motion and infinite mass: a mesh or a shape. Fill with `sgn_kinematic_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnKinematicDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// `SGN_BODY_` flags. Default: 0.
    pub flags: u64,
    /// Half of the thickness of a pair, in the host's unit of length: two bodies keep the sum of their halves apart.
    /// Negative: a tenth of the mean edge length. Default: -1.
    pub half_thickness: f64,
    /// Material; null: frictionless. Default: null.
    pub material: SgnMaterialId,
    /// Groups that the body belongs to, a bit each. Default: 1.
    pub groups: u64,
    /// Groups that it collides with; two bodies collide when each has a group of the other in its mask. Default: all.
    pub mask: u64,
    /// A number of the host's, handed back by `sgn_body_info`. Default: 0.
    pub user_key: u64,
    /// A shape, or NULL for a mesh; read during the call.
    pub shape: *const SgnShapeDesc,
    /// Vertices of a mesh, F32X3 or F64X3: start positions, or with `SGN_BODY_POSED` in the body frame.
    pub vertices: SgnView,
    /// As for a deformable body.
    pub triangles: SgnView,
    /// As for a deformable body.
    pub edges: SgnView,
    /// As for a deformable body.
    pub points: SgnView,
    /// Origin of the body frame at the start; read with `SGN_BODY_POSED` or a shape. Default: the origin.
    pub position: [f64; 3],
    /// Orientation at the start, likewise; quaternion x y z w. Default: 0 0 0 1.
    pub orientation: [f64; 4],
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnKinematicDesc {
    const NAME: &'static str = "SgnKinematicDesc";
    const FIRST_SIZE: usize = 280;
    fn defaults() -> Self {
        SgnKinematicDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            flags: 0,
            half_thickness: -1.0,
            material: SgnMaterialId { value: 0 },
            groups: 1,
            mask: u64::MAX,
            user_key: 0,
            shape: std::ptr::null(),
            vertices: SgnView::EMPTY,
            triangles: SgnView::EMPTY,
            edges: SgnView::EMPTY,
            points: SgnView::EMPTY,
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
        }
    }
}

/// A half-space of infinite mass: points with `normal . x >= offset` are free. Fill with `sgn_half_space_desc_init`.
/// Deformable and rigid bodies collide with it; kinematic ones do not.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnHalfSpaceDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// `SGN_BODY_` flags. Default: 0.
    pub flags: u64,
    /// Half of the thickness of a pair, in the host's unit of length: two bodies keep the sum of their halves apart.
    /// Negative: 0. Default: -1.
    pub half_thickness: f64,
    /// Material; null: frictionless. Default: null.
    pub material: SgnMaterialId,
    /// Groups that the body belongs to, a bit each. Default: 1.
    pub groups: u64,
    /// Groups that it collides with; two bodies collide when each has a group of the other in its mask. Default: all.
    pub mask: u64,
    /// A number of the host's, handed back by `sgn_body_info`. Default: 0.
    pub user_key: u64,
    /// Towards the free side; made a unit vector. Default: 0 0 1.
    pub normal: [f64; 3],
    /// Distance of the plane from the origin along the unit normal. Default: 0.
    pub offset: f64,
}

// SAFETY: repr(C) without padding; numbers.
unsafe impl Growing for SgnHalfSpaceDesc {
    const NAME: &'static str = "SgnHalfSpaceDesc";
    const FIRST_SIZE: usize = 88;
    fn defaults() -> Self {
        SgnHalfSpaceDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            flags: 0,
            half_thickness: -1.0,
            material: SgnMaterialId { value: 0 },
            groups: 1,
            mask: u64::MAX,
            user_key: 0,
            normal: [0.0, 0.0, 1.0],
            offset: 0.0,
        }
    }
}

/// Kind of a body.
pub type SgnBodyKind = i32;
/// Free vertices, driven by the host.
pub const SGN_BODY_KIND_DEFORMABLE: i32 = 1;
/// Rigid, driven by the host.
pub const SGN_BODY_KIND_RIGID: i32 = 2;
/// Prescribed vertex positions.
pub const SGN_BODY_KIND_KINEMATIC_MESH: i32 = 3;
/// Prescribed poses.
pub const SGN_BODY_KIND_KINEMATIC_POSED: i32 = 4;
/// A half-space.
pub const SGN_BODY_KIND_HALF_SPACE: i32 = 5;

/// What a body consists of. Fill with `sgn_body_info_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnBodyInfo {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_BODY_` kind.
    pub kind: SgnBodyKind,
    /// Number of vertices.
    pub vertices: u64,
    /// Number of edges, those of triangles included.
    pub edges: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Entries of its velocities and impulses: its vertices, or 1 for a rigid body, or 0.
    pub velocities: u64,
    /// Half thickness in use.
    pub half_thickness: f64,
    /// The host's number.
    pub user_key: u64,
}

// SAFETY: repr(C) without padding; numbers.
unsafe impl Growing for SgnBodyInfo {
    const NAME: &'static str = "SgnBodyInfo";
    const FIRST_SIZE: usize = 56;
    fn defaults() -> Self {
        SgnBodyInfo {
            struct_size: 0,
            kind: 0,
            vertices: 0,
            edges: 0,
            triangles: 0,
            velocities: 0,
            half_thickness: 0.0,
            user_key: 0,
        }
    }
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnDeformableDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_deformable_desc_init(desc: *mut SgnDeformableDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnRigidDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_rigid_desc_init(desc: *mut SgnRigidDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnKinematicDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_kinematic_desc_init(desc: *mut SgnKinematicDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnHalfSpaceDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_half_space_desc_init(desc: *mut SgnHalfSpaceDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `info` with zeros and its size; `size` is `sizeof(SgnBodyInfo)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_info_init(info: *mut SgnBodyInfo, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(info, size) })
}

unsafe fn topology(triangles: &SgnView, edges: &SgnView, points: &SgnView) -> Result<Topology, Failure> {
    let mut topology = Topology::default();
    // SAFETY: the caller vouches for the views.
    unsafe {
        if !triangles.is_absent() {
            topology.triangles = views::indices::<3>(triangles, "triangles")?;
        }
        if !edges.is_absent() {
            topology.edges = views::indices::<2>(edges, "edges")?;
        }
        if !points.is_absent() {
            topology.points = views::indices::<1>(points, "points")?.into_iter().flatten().collect();
        }
    }
    Ok(topology)
}

/// Vertices and topology of a mesh, or of a shape if there is one.
unsafe fn geometry(
    shape: *const SgnShapeDesc,
    vertices: &SgnView,
    [triangles, edges, points]: [&SgnView; 3],
) -> Result<(Vec<Vec3>, Topology), Failure> {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        if shape.is_null() {
            return Ok((views::floats::<3>(vertices, "vertices")?, topology(triangles, edges, points)?));
        }
        if [vertices, triangles, edges, points].iter().any(|view| !view.is_absent()) {
            return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, "a shape and a mesh are given: only one is wanted"));
        }
        let (vertices, triangles) = tessellated(&structs::read(shape)?)?;
        Ok((vertices, Topology { triangles, ..Topology::default() }))
    }
}

/// Adds a deformable body.
///
/// Ownership: everything is copied; no pointer is kept. Thread: exclusive.
/// Errors (the world is then as it was): NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, INVALID_ID,
/// BUFFER_LAYOUT, NON_FINITE_INPUT, BAD_TOPOLOGY, OUT_OF_MEMORY, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_deformable_create(
    world: *mut SgnWorld,
    desc: *const SgnDeformableDesc,
    out: *mut SgnBodyId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and views.
    unsafe {
        change(world, "sgn_deformable_create", |world, _| {
            let desc = structs::read(desc)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let mut description = DeformableDescription {
                options: common_fields!(desc).options(SGN_BODY_NO_SELF_COLLISION)?,
                positions: views::floats::<3>(&desc.positions, "positions")?,
                topology: topology(&desc.triangles, &desc.edges, &desc.points)?,
                masses: views::scalars(&desc.masses, "masses")?,
                ..DeformableDescription::default()
            };
            if !desc.rest_positions.is_absent() {
                description.rest = views::floats::<3>(&desc.rest_positions, "rest_positions")?;
            }
            if !desc.pinned.is_absent() {
                description.pinned = views::flags(&desc.pinned, "pinned")?;
            }
            let value = world.add_deformable(description)?;
            out.write_unaligned(SgnBodyId { value });
            Ok(SGN_OK)
        })
    }
}

/// Adds a rigid body.
///
/// Ownership, thread, errors: as sgn_deformable_create, and UNSUPPORTED.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_rigid_create(
    world: *mut SgnWorld,
    desc: *const SgnRigidDesc,
    out: *mut SgnBodyId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and views.
    unsafe {
        change(world, "sgn_rigid_create", |world, _| {
            let desc = structs::read(desc)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let lists = [&desc.triangles, &desc.edges, &desc.points];
            let (vertices, topology) = geometry(desc.shape, &desc.vertices, lists)?;
            let [a, b, c, d, e, f, g, h, i] = desc.inertia;
            let value = world.add_rigid(RigidDescription {
                options: common_fields!(desc).options(SGN_BODY_INERTIA_IN_WORLD)?,
                vertices,
                topology,
                mass: desc.mass,
                inertia: [[a, b, c], [d, e, f], [g, h, i]],
                inertia_in_world: desc.flags & SGN_BODY_INERTIA_IN_WORLD != 0,
                pose: Pose { position: desc.position, orientation: desc.orientation },
                velocity: desc.velocity,
                angular_velocity: desc.angular_velocity,
            })?;
            out.write_unaligned(SgnBodyId { value });
            Ok(SGN_OK)
        })
    }
}

/// Adds a kinematic body. It stays where it is until targets are pushed.
///
/// Ownership, thread, errors: as sgn_deformable_create, and UNSUPPORTED.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_kinematic_create(
    world: *mut SgnWorld,
    desc: *const SgnKinematicDesc,
    out: *mut SgnBodyId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and views.
    unsafe {
        change(world, "sgn_kinematic_create", |world, _| {
            let desc = structs::read(desc)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let lists = [&desc.triangles, &desc.edges, &desc.points];
            let (vertices, topology) = geometry(desc.shape, &desc.vertices, lists)?;
            let posed = !desc.shape.is_null() || desc.flags & SGN_BODY_POSED != 0;
            let pose = Pose { position: desc.position, orientation: desc.orientation };
            let value = world.add_kinematic(KinematicDescription {
                options: common_fields!(desc).options(SGN_BODY_POSED)?,
                vertices,
                topology,
                pose: posed.then_some(pose),
            })?;
            out.write_unaligned(SgnBodyId { value });
            Ok(SGN_OK)
        })
    }
}

/// Adds a half-space. It stays where it is until a target is pushed.
///
/// Thread, errors: as sgn_deformable_create.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_half_space_create(
    world: *mut SgnWorld,
    desc: *const SgnHalfSpaceDesc,
    out: *mut SgnBodyId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        change(world, "sgn_half_space_create", |world, _| {
            let desc = structs::read(desc)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let plane = HalfSpace { normal: desc.normal, offset: desc.offset };
            let value = world.add_half_space(common_fields!(desc).options(0)?, plane)?;
            out.write_unaligned(SgnBodyId { value });
            Ok(SGN_OK)
        })
    }
}

/// Removes a body, and the systems that name it. Their ids are stale from now on.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_destroy(world: *mut SgnWorld, body: SgnBodyId) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    unsafe {
        change(world, "sgn_body_destroy", |world, _| {
            world.remove_body(body.value)?;
            Ok(SGN_OK)
        })
    }
}

/// Sets groups and mask of a body.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_set_filter(
    world: *mut SgnWorld,
    body: SgnBodyId,
    groups: u64,
    mask: u64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    unsafe {
        change(world, "sgn_body_set_filter", |world, _| {
            world.set_filter(body.value, groups, mask)?;
            Ok(SGN_OK)
        })
    }
}

/// Sets the material of a body; null: frictionless.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_set_material(
    world: *mut SgnWorld,
    body: SgnBodyId,
    material: SgnMaterialId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    unsafe {
        change(world, "sgn_body_set_material", |world, _| {
            world.set_material(body.value, material.value)?;
            Ok(SGN_OK)
        })
    }
}

/// What a body consists of; also tells whether an id is valid.
///
/// Thread: concurrent. Errors: NULL_ARGUMENT, BAD_STRUCT, INVALID_ID, STALE_ID, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_info(world: *const SgnWorld, body: SgnBodyId, info: *mut SgnBodyInfo) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        look(world, "sgn_body_info", |world| {
            let size = structs::checked_size(info)?;
            let found = world.body_info(body.value)?;
            let kind = match found.kind {
                BodyKind::Deformable => SGN_BODY_KIND_DEFORMABLE,
                BodyKind::Rigid => SGN_BODY_KIND_RIGID,
                BodyKind::KinematicMesh => SGN_BODY_KIND_KINEMATIC_MESH,
                BodyKind::KinematicPosed => SGN_BODY_KIND_KINEMATIC_POSED,
                BodyKind::HalfSpace => SGN_BODY_KIND_HALF_SPACE,
            };
            let answer = SgnBodyInfo {
                struct_size: 0,
                kind,
                vertices: found.vertices as u64,
                edges: found.edges as u64,
                triangles: found.triangles as u64,
                velocities: found.velocities as u64,
                half_thickness: found.half_thickness,
                user_key: found.user_key,
            };
            structs::write(info, size, &answer);
            Ok(SGN_OK)
        })
    }
}
