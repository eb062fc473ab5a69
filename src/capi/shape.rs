//! Shapes: tessellated into surface meshes in the body frame.

use super::boundary::call;
use super::status::{Failure, SGN_ERROR_UNSUPPORTED, SgnResult};
use super::structs::{self, Growing};
use super::views::SgnView;
use crate::math::Vec3;

/// Kind of a shape. All are centred at the origin of the body frame; axes of capsules and cylinders are y.
pub type SgnShape = i32;
/// A ball of `radius`.
pub const SGN_SHAPE_SPHERE: i32 = 1;
/// A box of `half_extents`.
pub const SGN_SHAPE_BOX: i32 = 2;
/// Points within `radius` of the segment from `-half_height` to `half_height` on the y axis.
pub const SGN_SHAPE_CAPSULE: i32 = 3;
/// A cylinder of `radius` and `half_height` about the y axis.
pub const SGN_SHAPE_CYLINDER: i32 = 4;
/// The convex hull of `points` (three floats each, in the body frame).
pub const SGN_SHAPE_CONVEX_HULL: i32 = 5;
/// A height field over the x-z plane: `points` holds `rows` times `columns` heights (one float each, row after row), rows
/// along z, columns along x, spread over `2 half_extents[0]` by `2 half_extents[2]`, heights scaled by `half_extents[1]`.
pub const SGN_SHAPE_HEIGHT_FIELD: i32 = 6;

/// A shape. Fill with `sgn_shape_desc_init`. Fields that a kind does not name are not read.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SgnShapeDesc {
    /// Set by the init function.
    pub struct_size: u32,
    /// An `SGN_SHAPE_` constant. Default: sphere.
    pub kind: SgnShape,
    /// Half sizes along x, y, z. Default: 0.
    pub half_extents: [f64; 3],
    /// Radius. Default: 0.
    pub radius: f64,
    /// Half of the straight part of a capsule, or of a cylinder. Default: 0.
    pub half_height: f64,
    /// Largest distance between the shape and its tessellation, as a fraction of the radius. Default: 0.01.
    pub tolerance: f64,
    /// Points of a hull, or heights.
    pub points: SgnView,
    /// Rows of a height field, at least 2.
    pub rows: u32,
    /// Columns of a height field, at least 2.
    pub columns: u32,
}

// SAFETY: repr(C) without padding; numbers and pointers.
unsafe impl Growing for SgnShapeDesc {
    const NAME: &'static str = "SgnShapeDesc";
    const FIRST_SIZE: usize = 104;
    fn defaults() -> Self {
        SgnShapeDesc {
            struct_size: 0,
            kind: SGN_SHAPE_SPHERE,
            half_extents: [0.0; 3],
            radius: 0.0,
            half_height: 0.0,
            tolerance: 0.01,
            points: SgnView::EMPTY,
            rows: 0,
            columns: 0,
        }
    }
}

/// Fills `desc` with defaults; `size` is `sizeof(SgnShapeDesc)`.
///
/// Thread: any. Errors: NULL_ARGUMENT, BAD_STRUCT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sgn_shape_desc_init(desc: *mut SgnShapeDesc, size: usize) -> SgnResult {
    // SAFETY: the caller vouches for `size` bytes.
    call(|| unsafe { structs::init(desc, size) })
}

/// Vertices and triangles of a shape.
///
/// # Safety
/// The view of its points is readable.
pub(super) unsafe fn tessellated(_desc: &SgnShapeDesc) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), Failure> {
    Err(Failure::new(SGN_ERROR_UNSUPPORTED, "shapes are not there yet"))
}
