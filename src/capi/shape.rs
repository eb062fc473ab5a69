//! Shapes: tessellated into surface meshes in the body frame.

use super::boundary::call;
use super::status::{
    Failure, SGN_ERROR_BUFFER_LAYOUT, SGN_ERROR_INVALID_ARGUMENT, SGN_ERROR_NON_FINITE_INPUT, SgnResult,
};
use super::structs::{self, Growing};
use super::views::{self, SgnView};
use crate::math::Vec3;
use crate::mesh::Shape;

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
/// along z, columns along x, spread over `2 half_extents[0]` by `2 half_extents[2]`. Open, facing up (y).
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
pub(super) unsafe fn tessellated(desc: &SgnShapeDesc) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), Failure> {
    let SgnShapeDesc { radius, half_height, half_extents, .. } = *desc;
    let shape = match desc.kind {
        SGN_SHAPE_SPHERE => Shape::Sphere { radius },
        SGN_SHAPE_BOX => Shape::Box { half_extents },
        SGN_SHAPE_CAPSULE => Shape::Capsule { radius, half_height },
        SGN_SHAPE_CYLINDER => Shape::Cylinder { radius, half_height },
        // SAFETY: passed on.
        SGN_SHAPE_CONVEX_HULL => Shape::ConvexHull(unsafe { views::floats::<3>(&desc.points, "points") }?),
        SGN_SHAPE_HEIGHT_FIELD => {
            // SAFETY: passed on.
            let heights = unsafe { views::scalars(&desc.points, "points") }?;
            if u64::from(desc.rows) * u64::from(desc.columns) != heights.len() as u64 {
                let message = format!("{} heights for {} rows of {}", heights.len(), desc.rows, desc.columns);
                return Err(Failure::new(SGN_ERROR_BUFFER_LAYOUT, message).value(heights.len() as f64));
            }
            let size = [2.0 * half_extents[0], 2.0 * half_extents[2]];
            Shape::HeightField { heights, rows: desc.rows as usize, size }
        }
        other => {
            let message = format!("kind {other} is out of range");
            return Err(Failure::new(SGN_ERROR_INVALID_ARGUMENT, message).value(f64::from(other)));
        }
    };
    let round = matches!(desc.kind, SGN_SHAPE_SPHERE | SGN_SHAPE_CAPSULE | SGN_SHAPE_CYLINDER);
    // Shapes with flat faces are exact whatever the tolerance.
    let tolerance = if round { desc.tolerance * radius } else { 1.0 };
    let surface = shape.tessellate(tolerance).map_err(|error| {
        let sizes = [radius, half_height, desc.tolerance, half_extents[0], half_extents[1], half_extents[2]];
        let finite = sizes.iter().all(|size| size.is_finite());
        let code = if finite { SGN_ERROR_INVALID_ARGUMENT } else { SGN_ERROR_NON_FINITE_INPUT };
        Failure::new(code, format!("shape: {}", error.message)).index(error.index).value(error.value)
    })?;
    Ok((surface.rest, surface.faces))
}
