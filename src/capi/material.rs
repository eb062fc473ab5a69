//! Materials: friction, combine rules, pairs.

use super::boundary::{call, change};
use super::status::{Failure, SGN_ERROR_INVALID_ARGUMENT, SGN_OK, SgnResult};
use super::structs::{self, Growing};
use super::world::{SgnMaterialId, SgnWorld};
use crate::model::{CombineRule, Material};

/// How the friction coefficients `a` and `b` of two materials make that of a pair. Of two materials with different
/// rules the one with the larger number wins.
pub type SgnCombine = i32;
/// `sqrt(a b)`. The default.
pub const SGN_COMBINE_GEOMETRIC_MEAN: i32 = 0;
/// `(a + b)/2`
pub const SGN_COMBINE_MEAN: i32 = 1;
/// `min(a, b)`
pub const SGN_COMBINE_MINIMUM: i32 = 2;
/// `max(a, b)`
pub const SGN_COMBINE_MAXIMUM: i32 = 3;
/// `a b`
pub const SGN_COMBINE_PRODUCT: i32 = 4;

/// A surface material. Fill with `sgn_material_desc_init`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnMaterialDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_COMBINE_` constant. Default: geometric mean.
    pub combine: SgnCombine,
    /// Coulomb friction coefficient, at least 0. Default: 0.
    pub friction: f64,
    /// Coefficient of restitution, 0 to 1: the share of its normal velocity with which a collision parts. A pair has the
    /// greatest of its two materials' and of that of `SgnStepDesc`. Read by the velocity filter; the implicit method's
    /// impacts are inelastic. Default: 0.
    pub restitution: f64,
}

// SAFETY: repr(C) without padding; numbers.
unsafe impl Growing for SgnMaterialDesc {
    const NAME: &'static str = "SgnMaterialDesc";
    const FIRST_SIZE: usize = 24;
    fn defaults() -> Self {
        SgnMaterialDesc { struct_size: 0, combine: SGN_COMBINE_GEOMETRIC_MEAN, friction: 0.0, restitution: 0.0 }
    }
}

impl SgnMaterialDesc {
    fn material(&self) -> Result<Material, Failure> {
        let combine_rule = match self.combine {
            SGN_COMBINE_GEOMETRIC_MEAN => CombineRule::GeometricMean,
            SGN_COMBINE_MEAN => CombineRule::Mean,
            SGN_COMBINE_MINIMUM => CombineRule::Minimum,
            SGN_COMBINE_MAXIMUM => CombineRule::Maximum,
            SGN_COMBINE_PRODUCT => CombineRule::Product,
            other => {
                let message = format!("combine {other} is out of range");
                return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message).value(f64::from(other)));
            }
        };
        Ok(Material { friction_coefficient: self.friction, combine_rule, restitution: self.restitution })
    }
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnMaterialDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_material_desc_init(desc: *mut SgnMaterialDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Adds a material.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, BAD_STRUCT, UNSUPPORTED_STRUCT, INVALID_ARGUMENT, NON_FINITE_INPUT,
/// OUT_OF_MEMORY, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_material_create(
    world: *mut SgnWorld,
    desc: *const SgnMaterialDesc,
    out: *mut SgnMaterialId,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        change(world, "sgn_material_create", |world, _| {
            let material = structs::read(desc)?.material()?;
            if out.is_null() {
                return Err(Failure::null("out"));
            }
            let value = world.add_material(material)?;
            out.write_unaligned(SgnMaterialId { value });
            Ok(SGN_OK)
        })
    }
}

/// Changes a material; bodies that have it follow.
///
/// Thread: exclusive. Errors: as sgn_material_create, and INVALID_ID.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_material_set(
    world: *mut SgnWorld,
    material: SgnMaterialId,
    desc: *const SgnMaterialDesc,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointers.
    unsafe {
        change(world, "sgn_material_set", |world, _| {
            let values = structs::read(desc)?.material()?;
            world.set_material_values(material.value, values)?;
            Ok(SGN_OK)
        })
    }
}

/// Sets the friction coefficient of a pair of materials, whatever their combine rules say. A null id stands for the
/// frictionless default.
///
/// Thread: exclusive. Errors: NULL_ARGUMENT, INVALID_ID, INVALID_ARGUMENT, NON_FINITE_INPUT, BUSY, POISONED, PANIC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_material_set_pair(
    world: *mut SgnWorld,
    a: SgnMaterialId,
    b: SgnMaterialId,
    friction: f64,
) -> SgnResult {
    // SAFETY: the caller vouches for the pointer.
    unsafe {
        change(world, "sgn_material_set_pair", |world, _| {
            world.set_pair_friction(a.value, b.value, friction)?;
            Ok(SGN_OK)
        })
    }
}
