//! Bodies: creation, removal, filters, what they consist of.

use super::boundary::{call, change, look};
use super::description::{
    SGN_BODY_INERTIA_IN_WORLD, SGN_BODY_MODEL_DRIVEN, SGN_BODY_NO_SELF_COLLISION, SGN_BODY_POSED, SgnDeformableDesc,
    SgnHalfSpaceDesc, SgnKinematicDesc, SgnRigidDesc,
};
use super::status::{Failure, SGN_OK, SgnResult};
use super::structs::{self, Growing};
use super::views;
use super::world::{SgnBodyId, SgnMaterialId, SgnWorld};
use crate::kinematics::Pose;
use crate::model::HalfSpace;
use crate::world::{BodyKind, DeformableDescription, KinematicDescription, RigidDescription, World};

/// Kind of a body.
pub type SgnBodyKind = i32;
/// Nodes: free vertices, a sheet, or a solid of tetrahedra.
pub const SGN_BODY_KIND_DEFORMABLE: i32 = 1;
/// Rigid.
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
    /// Number of vertices: of a solid that carries a surface, those of the surface.
    pub vertices: u64,
    /// Number of edges, those of triangles included.
    pub edges: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Entries of its velocities and impulses: its nodes (its vertices, or those of the tetrahedra that carry them), or 1
    /// for a rigid body, or 0.
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

/// Fills `info` with zeros and its size; `size` is `sizeof(SgnBodyInfo)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_body_info_init(info: *mut SgnBodyInfo, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(info, size) })
}

/// The body of a create function: reads the description, adds the body, writes its id.
///
/// # Safety
/// `world` is NULL or a live world, `desc` and `out` are NULL or valid.
pub(super) unsafe fn create<T: Growing>(
    world: *mut SgnWorld,
    function: &str,
    desc: *const T,
    out: *mut SgnBodyId,
    add: impl FnOnce(&mut World, T) -> Result<u64, Failure>,
) -> SgnResult {
    // SAFETY: passed on.
    unsafe {
        change(world, function, |world, _| {
            let desc = structs::read(desc)?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let value = add(world, desc)?;
            out.write_unaligned(SgnBodyId { value });
            Ok(SGN_OK)
        })
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
        create(world, "sgn_deformable_create", desc, out, |world, desc| {
            let (positions, topology) = desc.mesh.read()?;
            let mut description = DeformableDescription {
                options: desc.options.checked(desc.precision, SGN_BODY_NO_SELF_COLLISION)?,
                positions,
                topology,
                masses: views::scalars(&desc.masses, "masses")?,
                ..DeformableDescription::default()
            };
            if !desc.rest_positions.is_absent() {
                description.rest = views::floats::<3>(&desc.rest_positions, "rest_positions")?;
            }
            if !desc.pinned.is_absent() {
                description.pinned = views::flags(&desc.pinned, "pinned")?;
            }
            Ok(world.add_deformable(description)?)
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
        create(world, "sgn_rigid_create", desc, out, |world, desc| {
            let (vertices, topology) = desc.mesh.or_shape(desc.shape)?;
            let [a, b, c, d, e, f, g, h, i] = desc.inertia;
            Ok(world.add_rigid(RigidDescription {
                options: desc.options.checked(desc.precision, SGN_BODY_INERTIA_IN_WORLD | SGN_BODY_MODEL_DRIVEN)?,
                vertices,
                topology,
                mass: desc.mass,
                inertia: [[a, b, c], [d, e, f], [g, h, i]],
                inertia_in_world: desc.options.flags & SGN_BODY_INERTIA_IN_WORLD != 0,
                pose: Pose { position: desc.position, orientation: desc.orientation },
                velocity: desc.velocity,
                angular_velocity: desc.angular_velocity,
                own_dynamics: (desc.options.flags & SGN_BODY_MODEL_DRIVEN != 0)
                    .then_some([desc.linear_damping, desc.angular_damping]),
            })?)
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
        create(world, "sgn_kinematic_create", desc, out, |world, desc| {
            let (vertices, topology) = desc.mesh.or_shape(desc.shape)?;
            let posed = !desc.shape.is_null() || desc.options.flags & SGN_BODY_POSED != 0;
            let pose = Pose { position: desc.position, orientation: desc.orientation };
            Ok(world.add_kinematic(KinematicDescription {
                options: desc.options.checked(desc.precision, SGN_BODY_POSED)?,
                vertices,
                topology,
                pose: posed.then_some(pose),
            })?)
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
        create(world, "sgn_half_space_create", desc, out, |world, desc| {
            let plane = HalfSpace { normal: desc.normal, offset: desc.offset };
            Ok(world.add_half_space(desc.options.checked(desc.precision, 0)?, plane)?)
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
