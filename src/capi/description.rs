//! Descriptions of bodies, as a host fills them in.

use super::boundary::call;
use super::shape::{SgnShapeDesc, tessellated};
use super::status::{Failure, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_NON_FINITE_INPUT, SgnResult};
use super::structs::{self, Growing};
use super::views::{self, SgnView};
use super::world::SgnMaterialId;
use crate::math::Vec3;
use crate::model::Precision;
use crate::world::{BodyOptions, Topology};

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

/// Flag of a rigid body: the library drives it, under gravity and its gyroscopic torque.
pub const SGN_BODY_MODEL_DRIVEN: u64 = 32;

/// What all bodies have in common. Frozen, like `SgnView`: it stands in the middle of other structs.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnBodyOptions {
    /// `SGN_BODY_` flags. Default: 0.
    pub flags: u64,
    /// Half of the thickness of a pair, in the host's unit of length: two bodies keep the sum of their halves apart.
    /// Negative: a tenth of the mean edge length, for a half-space 0. Default: -1.
    pub half_thickness: f64,
    /// Material; null: frictionless. Default: null.
    pub material: SgnMaterialId,
    /// Groups that the body belongs to, a bit each. Default: 1.
    pub groups: u64,
    /// Groups that it collides with; two bodies collide when each has a group of the other in its mask. Default: all.
    pub mask: u64,
    /// A number of the host's, handed back by `sgn_body_info`. Default: 0.
    pub user_key: u64,
}

impl SgnBodyOptions {
    pub(super) const DEFAULT: SgnBodyOptions = SgnBodyOptions {
        flags: 0,
        half_thickness: -1.0,
        material: SgnMaterialId { value: 0 },
        groups: 1,
        mask: u64::MAX,
        user_key: 0,
    };

    /// Checks what can be checked without the world. `allowed`: the flags that the kind of body knows.
    pub(super) fn checked(&self, precision: SgnPrecision, allowed: u64) -> Result<BodyOptions, Failure> {
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
        let precision = match precision {
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

/// Vertices and what of them collides. Frozen, like `SgnView`. Edges of triangles need not be given. Triangles, edges and
/// points all empty: every vertex is a point.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnMesh {
    /// Vertices, F32X3 or F64X3. They say how many there are.
    pub vertices: SgnView,
    /// Triangles, U32X3 or U64X3, either winding.
    pub triangles: SgnView,
    /// Edges besides those of triangles, U32X2 or U64X2.
    pub edges: SgnView,
    /// Points besides the vertices of triangles and edges, U32 or U64.
    pub points: SgnView,
}

impl SgnMesh {
    pub(super) const EMPTY: SgnMesh =
        SgnMesh { vertices: SgnView::EMPTY, triangles: SgnView::EMPTY, edges: SgnView::EMPTY, points: SgnView::EMPTY };

    /// # Safety
    /// The views are readable.
    pub(super) unsafe fn read(&self) -> Result<(Vec<Vec3>, Topology), Failure> {
        let mut topology = Topology::default();
        // SAFETY: the caller vouches for the views.
        unsafe {
            let vertices = views::floats::<3>(&self.vertices, "vertices")?;
            if !self.triangles.is_absent() {
                topology.triangles = views::indices::<3>(&self.triangles, "triangles")?;
            }
            if !self.edges.is_absent() {
                topology.edges = views::indices::<2>(&self.edges, "edges")?;
            }
            if !self.points.is_absent() {
                topology.points = views::indices::<1>(&self.points, "points")?.into_iter().flatten().collect();
            }
            Ok((vertices, topology))
        }
    }

    /// Vertices and topology of the shape, if there is one, or else of the mesh.
    ///
    /// # Safety
    /// The shape is NULL or readable, and so are all views.
    pub(super) unsafe fn or_shape(&self, shape: *const SgnShapeDesc) -> Result<(Vec<Vec3>, Topology), Failure> {
        // SAFETY: the caller vouches for the pointers.
        unsafe {
            if shape.is_null() {
                return self.read();
            }
            if [self.vertices, self.triangles, self.edges, self.points].iter().any(|view| !view.is_absent()) {
                let message = "a shape and a mesh are given: only one is wanted";
                return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message));
            }
            let (vertices, triangles) = tessellated(&structs::read(shape)?)?;
            Ok((vertices, Topology { triangles, ..Topology::default() }))
        }
    }
}

/// A body of free vertices whose dynamics are the host's. Fill with `sgn_deformable_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnDeformableDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// What all bodies have in common.
    pub options: SgnBodyOptions,
    /// The mesh at its start positions.
    pub mesh: SgnMesh,
    /// Rest positions, as many as vertices; empty: the start positions.
    pub rest_positions: SgnView,
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
            options: SgnBodyOptions::DEFAULT,
            mesh: SgnMesh::EMPTY,
            rest_positions: SgnView::EMPTY,
            masses: SgnView::EMPTY,
            pinned: SgnView::EMPTY,
        }
    }
}

/// A rigid body, a mesh or a shape, driven by the host or, with `SGN_BODY_MODEL_DRIVEN`, by the library. Fill with `sgn_rigid_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnRigidDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// What all bodies have in common.
    pub options: SgnBodyOptions,
    /// A shape, or NULL for a mesh; read during the call.
    pub shape: *const SgnShapeDesc,
    /// A mesh in the body frame, about the centre of mass.
    pub mesh: SgnMesh,
    /// Mass, positive. Default: 1.
    pub mass: f64,
    /// Inertia about the centre of mass, 3x3, symmetric, positive definite. Default: the identity.
    pub inertia: [f64; 9],
    /// Centre of mass at the start. Default: the origin.
    pub position: [f64; 3],
    /// Orientation at the start, quaternion x y z w; made a unit one. Default: 0 0 0 1.
    pub orientation: [f64; 4],
    /// Displacement velocity of the centre of mass; the velocity at the start if the library drives it. Default: 0.
    pub velocity: [f64; 3],
    /// Angular displacement velocity, world axes, radians per time; likewise. Default: 0.
    pub angular_velocity: [f64; 3],
    /// Rate at which the velocity decays; read with MODEL_DRIVEN. Default: 0.
    pub linear_damping: f64,
    /// Rate at which the angular velocity decays; read with MODEL_DRIVEN. Default: 0.
    pub angular_damping: f64,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnRigidDesc {
    const NAME: &'static str = "SgnRigidDesc";
    const FIRST_SIZE: usize = 424;
    fn defaults() -> Self {
        SgnRigidDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            options: SgnBodyOptions::DEFAULT,
            shape: std::ptr::null(),
            mesh: SgnMesh::EMPTY,
            mass: 1.0,
            inertia: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            linear_damping: 0.0,
            angular_damping: 0.0,
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
    /// What all bodies have in common.
    pub options: SgnBodyOptions,
    /// A shape, or NULL for a mesh; read during the call.
    pub shape: *const SgnShapeDesc,
    /// A mesh at its start positions, or with `SGN_BODY_POSED` in the body frame.
    pub mesh: SgnMesh,
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
            options: SgnBodyOptions::DEFAULT,
            shape: std::ptr::null(),
            mesh: SgnMesh::EMPTY,
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
    /// What all bodies have in common.
    pub options: SgnBodyOptions,
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
            options: SgnBodyOptions::DEFAULT,
            normal: [0.0, 0.0, 1.0],
            offset: 0.0,
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
