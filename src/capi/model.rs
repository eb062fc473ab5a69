//! Bodies that the library drives: cloth, shells, solids; gravity and wind.

use super::body::create;
use super::boundary::{call, change};
use super::description::{SGN_BODY_NO_SELF_COLLISION, SGN_PRECISION_F64, SgnBodyOptions, SgnMesh, SgnPrecision};
use super::status::{Failure, SGN_ERROR_BUFFER_LAYOUT, SGN_ERROR_INVALID_ARGUMENT, SGN_OK, SgnResult};
use super::structs::{self, Growing};
use super::views::{self, SgnView};
use super::world::{SgnBodyId, SgnWorld};
use crate::energy::{Attachment, Damping, SheetMaterial, SolidMaterial};
use crate::math::Vec3;
use crate::world::{NodeForces, SheetDescription, SheetModel, SolidDescription};

/// Flag of a sheet: flat at rest, whatever the rest shape.
pub const SGN_BODY_FLAT: u64 = 8;
/// Flag of a solid: the host drives its nodes. Of the material only the density is used.
pub const SGN_BODY_HOST_DRIVEN: u64 = 16;

/// How a sheet resists stretch and shear.
pub type SgnSheetModel = i32;
/// Constant-strain triangles, and bending at the edges. The default.
pub const SGN_SHEET_SHELL: i32 = 0;
/// Springs along the edges and, with `bend_ratio`, across them.
pub const SGN_SHEET_MASS_SPRING: i32 = 1;

/// What acts on the nodes of a body that the library drives, besides its material. Frozen, like `SgnView`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnNodeForces {
    /// Velocities at the start, F32X3 or F64X3, one per node; empty: zero.
    pub velocities: SgnView,
    /// U8 per node: not 0 where the node goes to its TARGET_POSITION and nowhere else. Empty: none does.
    pub pinned: SgnView,
    /// Springs between nodes besides those of the material, U32X2 or U64X2; at rest at their rest distance.
    pub springs: SgnView,
    /// Their stiffnesses, F32 or F64, in force per length.
    pub spring_stiffness: SgnView,
    /// Nodes that a spring pulls to a target, U32 or U64; each target starts where its node starts.
    pub attachments: SgnView,
    /// Their stiffnesses, F32 or F64.
    pub attachment_stiffness: SgnView,
    /// Their damping, F32 or F64, in force per velocity; empty: none.
    pub attachment_damping: SgnView,
    /// Drag of the faces in the wind: density of the air times drag coefficient over 2. Default: 0.
    pub drag: f64,
    /// Rate at which every velocity decays. Default: 0.
    pub mass_damping: f64,
    /// Time that multiplies the stiffness of stretch, shear and volume as damping. Default: 0.
    pub stretch_damping_time: f64,
    /// Time that multiplies the stiffness of bending as damping. Default: 0.
    pub bending_damping_time: f64,
}

impl SgnNodeForces {
    const DEFAULT: SgnNodeForces = SgnNodeForces {
        velocities: SgnView::EMPTY,
        pinned: SgnView::EMPTY,
        springs: SgnView::EMPTY,
        spring_stiffness: SgnView::EMPTY,
        attachments: SgnView::EMPTY,
        attachment_stiffness: SgnView::EMPTY,
        attachment_damping: SgnView::EMPTY,
        drag: 0.0,
        mass_damping: 0.0,
        stretch_damping_time: 0.0,
        bending_damping_time: 0.0,
    };

    fn damping(&self) -> Damping {
        Damping {
            mass_rate: self.mass_damping,
            stretch_time: self.stretch_damping_time,
            bending_time: self.bending_damping_time,
        }
    }

    /// # Safety
    /// The views are readable.
    unsafe fn read(&self) -> Result<NodeForces, Failure> {
        let mut forces = NodeForces { drag: self.drag, ..NodeForces::default() };
        // SAFETY: the caller vouches for the views.
        unsafe {
            if !self.velocities.is_absent() {
                forces.velocities = views::floats::<3>(&self.velocities, "velocities")?;
            }
            if !self.pinned.is_absent() {
                forces.pinned = views::flags(&self.pinned, "pinned")?;
            }
            if !self.springs.is_absent() {
                let ends = views::indices::<2>(&self.springs, "springs")?;
                let stiffness = as_many(&self.spring_stiffness, "spring_stiffness", ends.len())?;
                forces.springs = ends.into_iter().zip(stiffness).collect();
            }
            if !self.attachments.is_absent() {
                let nodes = views::indices::<1>(&self.attachments, "attachments")?;
                let stiffness = as_many(&self.attachment_stiffness, "attachment_stiffness", nodes.len())?;
                let mut damping = vec![0.0; nodes.len()];
                if !self.attachment_damping.is_absent() {
                    damping = as_many(&self.attachment_damping, "attachment_damping", nodes.len())?;
                }
                let all = nodes.into_iter().zip(stiffness).zip(damping);
                forces.attachments =
                    all.map(|(([node], stiffness), damping)| Attachment { node, stiffness, damping }).collect();
            }
        }
        Ok(forces)
    }
}

/// # Safety
/// The view is readable.
unsafe fn as_many(view: &SgnView, what: &str, count: usize) -> Result<Vec<f64>, Failure> {
    // SAFETY: passed on.
    let values = unsafe { views::scalars(view, what) }?;
    if values.len() == count {
        return Ok(values);
    }
    let message = format!("{what}: {} given, {count} needed", values.len());
    Err(Failure::new(SGN_ERROR_BUFFER_LAYOUT, message).value(values.len() as f64))
}

/// Cloth or a shell that the library drives. Fill with `sgn_sheet_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnSheetDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// What all bodies have in common. Flags: NO_SELF_COLLISION, FLAT.
    pub options: SgnBodyOptions,
    /// The mesh at its start positions; its triangles are the sheet. Every vertex is a node.
    pub mesh: SgnMesh,
    /// Rest positions, as many as vertices; empty: the start positions.
    pub rest_positions: SgnView,
    /// An `SGN_SHEET_` constant. Default: SHELL.
    pub model: SgnSheetModel,
    /// Must be 0.
    pub reserved: u32,
    /// Mass per volume, positive. Default: 200.
    pub density: f64,
    /// Thickness of the material, positive; not that of contact, which is in the options. Default: 0.001.
    pub thickness: f64,
    /// Young's modulus, positive. Default: 1e6.
    pub young_modulus: f64,
    /// Poisson's ratio, at least 0 and below 0.5; springs have none. Default: 0.3.
    pub poisson_ratio: f64,
    /// Bending stiffness, a torque; negative: that of a plate for a shell, none for springs. Default: -1.
    pub bending_stiffness: f64,
    /// Stiffness of a spring across an edge over that of the edge's own; springs only. Default: 0.01.
    pub bend_ratio: f64,
    /// Rest lengths over those of the rest shape, positive. Default: 1.
    pub rest_scale: f64,
    /// What else acts on it.
    pub forces: SgnNodeForces,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnSheetDesc {
    const NAME: &'static str = "SgnSheetDesc";
    const FIRST_SIZE: usize = 632;
    fn defaults() -> Self {
        SgnSheetDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            options: SgnBodyOptions::DEFAULT,
            mesh: SgnMesh::EMPTY,
            rest_positions: SgnView::EMPTY,
            model: SGN_SHEET_SHELL,
            reserved: 0,
            density: 200.0,
            thickness: 1e-3,
            young_modulus: 1e6,
            poisson_ratio: 0.3,
            bending_stiffness: -1.0,
            bend_ratio: 0.01,
            rest_scale: 1.0,
            forces: SgnNodeForces::DEFAULT,
        }
    }
}

/// A solid of tetrahedra, with its own boundary or with a surface that it carries. Fill with `sgn_solid_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnSolidDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_PRECISION_` constant. Default: F64.
    pub precision: SgnPrecision,
    /// What all bodies have in common. Flags: NO_SELF_COLLISION, HOST_DRIVEN.
    pub options: SgnBodyOptions,
    /// Start positions of the nodes, F32X3 or F64X3.
    pub nodes: SgnView,
    /// Rest positions of the nodes, as many; empty: the start positions.
    pub rest_positions: SgnView,
    /// Tetrahedra, U32X4 or U64X4, either orientation. Every node belongs to one.
    pub tetrahedra: SgnView,
    /// A mesh in the rest shape that the tetrahedra carry and that collides for them: each vertex moves with the element
    /// that holds it, or the nearest. Empty: the boundary of the tetrahedra collides.
    pub surface: SgnMesh,
    /// Mass per volume, positive. Default: 1000.
    pub density: f64,
    /// Young's modulus, positive. Default: 1e6.
    pub young_modulus: f64,
    /// Poisson's ratio, at least 0 and below 0.5. Default: 0.3.
    pub poisson_ratio: f64,
    /// Rest lengths over those of the rest shape, positive. Default: 1.
    pub rest_scale: f64,
    /// What else acts on it. With HOST_DRIVEN: velocities are displacement velocities, pins follow them, the rest must be
    /// empty.
    pub forces: SgnNodeForces,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnSolidDesc {
    const NAME: &'static str = "SgnSolidDesc";
    const FIRST_SIZE: usize = 680;
    fn defaults() -> Self {
        SgnSolidDesc {
            struct_size: 0,
            precision: SGN_PRECISION_F64,
            options: SgnBodyOptions::DEFAULT,
            nodes: SgnView::EMPTY,
            rest_positions: SgnView::EMPTY,
            tetrahedra: SgnView::EMPTY,
            surface: SgnMesh::EMPTY,
            density: 1000.0,
            young_modulus: 1e6,
            poisson_ratio: 0.3,
            rest_scale: 1.0,
            forces: SgnNodeForces::DEFAULT,
        }
    }
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnSheetDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_sheet_desc_init(desc: *mut SgnSheetDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnSolidDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_solid_desc_init(desc: *mut SgnSolidDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Adds cloth or a shell that the library drives: a deformable body with dynamics of its own.
///
/// Ownership, thread, errors: as sgn_deformable_create.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_sheet_create(
    world: *mut SgnWorld,
    desc: *const SgnSheetDesc,
    out: *mut SgnBodyId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and views.
    unsafe {
        create(world, "sgn_sheet_create", desc, out, |world, desc| {
            let model = match desc.model {
                SGN_SHEET_SHELL => SheetModel::Shell,
                SGN_SHEET_MASS_SPRING => SheetModel::MassSpring { bend_ratio: desc.bend_ratio },
                other => {
                    let message = format!("model {other} is out of range");
                    return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message).value(f64::from(other)));
                }
            };
            if desc.reserved != 0 {
                return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, "reserved must be 0"));
            }
            let options = desc.options.checked(desc.precision, SGN_BODY_NO_SELF_COLLISION | SGN_BODY_FLAT)?;
            let (positions, topology) = desc.mesh.read()?;
            let material = SheetMaterial {
                density: desc.density,
                thickness: desc.thickness,
                young_modulus: desc.young_modulus,
                poisson_ratio: desc.poisson_ratio,
                bending_stiffness: (desc.bending_stiffness >= 0.0 || desc.bending_stiffness.is_nan())
                    .then_some(desc.bending_stiffness),
                flat: desc.options.flags & SGN_BODY_FLAT != 0,
                rest_scale: desc.rest_scale,
                damping: desc.forces.damping(),
            };
            let rest = if desc.rest_positions.is_absent() {
                Vec::new()
            } else {
                views::floats::<3>(&desc.rest_positions, "rest_positions")?
            };
            let forces = desc.forces.read()?;
            Ok(world.add_sheet(SheetDescription { options, positions, rest, topology, material, model, forces })?)
        })
    }
}

/// Adds a solid of tetrahedra: a deformable body, driven by the library or, with HOST_DRIVEN, by the host, whose
/// velocities, impulses and system rows are those of the nodes.
///
/// Ownership, thread, errors: as sgn_deformable_create.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_solid_create(
    world: *mut SgnWorld,
    desc: *const SgnSolidDesc,
    out: *mut SgnBodyId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers and views.
    unsafe {
        create(world, "sgn_solid_create", desc, out, |world, desc| {
            let options = desc.options.checked(desc.precision, SGN_BODY_NO_SELF_COLLISION | SGN_BODY_HOST_DRIVEN)?;
            let positions = views::floats::<3>(&desc.nodes, "nodes")?;
            let tetrahedra = views::indices::<4>(&desc.tetrahedra, "tetrahedra")?;
            let rest = if desc.rest_positions.is_absent() {
                Vec::new()
            } else {
                views::floats::<3>(&desc.rest_positions, "rest_positions")?
            };
            let embedded = if desc.surface.vertices.is_absent() { None } else { Some(desc.surface.read()?) };
            let material = SolidMaterial {
                density: desc.density,
                young_modulus: desc.young_modulus,
                poisson_ratio: desc.poisson_ratio,
                rest_scale: desc.rest_scale,
                damping: desc.forces.damping(),
            };
            let host_driven = desc.options.flags & SGN_BODY_HOST_DRIVEN != 0;
            let forces = desc.forces.read()?;
            let extra = !forces.springs.is_empty() || !forces.attachments.is_empty() || forces.drag != 0.0;
            if host_driven && extra {
                let message = "springs, attachments and drag are of bodies that the library drives";
                return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message));
            }
            Ok(world.add_solid(SolidDescription {
                options,
                positions,
                rest,
                tetrahedra,
                embedded,
                material,
                host_driven,
                forces,
            })?)
        })
    }
}

/// # Safety
/// `vector` is NULL or points to three doubles.
unsafe fn vector(vector: *const f64, what: &str) -> Result<Vec3, Failure> {
    if vector.is_null() {
        return Err(Failure::null(what));
    }
    // SAFETY: passed on.
    Ok(std::array::from_fn(|i| unsafe { vector.add(i).read_unaligned() }))
}

/// Sets the acceleration of gravity on the bodies that the library drives: three doubles. Zero at first.
///
/// Thread: exclusive. Errors (it then stays): NULL_ARGUMENT, NON_FINITE_INPUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_set_gravity(world: *mut SgnWorld, gravity: *const f64) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        change(world, "sgn_world_set_gravity", |world, _| {
            world.set_gravity(vector(gravity, "gravity")?)?;
            Ok(SGN_OK)
        })
    }
}

/// Sets the velocity of the air around the bodies that the library drives: three doubles. Zero at first.
///
/// Thread: exclusive. Errors (it then stays): NULL_ARGUMENT, NON_FINITE_INPUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_world_set_wind(world: *mut SgnWorld, wind: *const f64) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        change(world, "sgn_world_set_wind", |world, _| {
            world.set_wind(vector(wind, "wind")?)?;
            Ok(SGN_OK)
        })
    }
}
