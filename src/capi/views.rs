//! Strided host memory: read and written element by element, never referenced, never assumed aligned.

use super::status::{
    Failure, SGN_ERROR_BAD_TOPOLOGY, SGN_ERROR_BUFFER_LAYOUT, SGN_ERROR_NON_FINITE_INPUT, SGN_ERROR_OUT_OF_MEMORY,
};
use crate::math::{Mat3, Vec3};
use std::ffi::c_void;

/// Format of the elements of a view.
pub type SgnFormat = i32;
/// No format; only of an empty view.
pub const SGN_FORMAT_NONE: i32 = 0;
/// `uint8_t`, a flag: 0 or not.
pub const SGN_FORMAT_U8: i32 = 1;
/// `uint32_t`
pub const SGN_FORMAT_U32: i32 = 2;
/// `uint64_t`
pub const SGN_FORMAT_U64: i32 = 3;
/// `uint32_t[2]`
pub const SGN_FORMAT_U32X2: i32 = 10;
/// `uint32_t[3]`
pub const SGN_FORMAT_U32X3: i32 = 11;
/// `uint64_t[2]`
pub const SGN_FORMAT_U64X2: i32 = 12;
/// `uint64_t[3]`
pub const SGN_FORMAT_U64X3: i32 = 13;
/// `uint32_t[4]`
pub const SGN_FORMAT_U32X4: i32 = 14;
/// `uint64_t[4]`
pub const SGN_FORMAT_U64X4: i32 = 15;
/// `float`
pub const SGN_FORMAT_F32: i32 = 20;
/// `double`
pub const SGN_FORMAT_F64: i32 = 21;
/// `float[3]`
pub const SGN_FORMAT_F32X3: i32 = 22;
/// `double[3]`
pub const SGN_FORMAT_F64X3: i32 = 23;
/// `float[4]`: normal and offset of a plane, or four weights
pub const SGN_FORMAT_F32X4: i32 = 24;
/// `double[4]`: normal and offset of a plane, or four weights
pub const SGN_FORMAT_F64X4: i32 = 25;
/// `float[7]`, a pose: position x y z, unit quaternion x y z w
pub const SGN_FORMAT_F32X7: i32 = 26;
/// `double[7]`, a pose: position x y z, unit quaternion x y z w
pub const SGN_FORMAT_F64X7: i32 = 27;
/// `float[9]`, a 3x3 block, row after row
pub const SGN_FORMAT_F32_3X3_ROWS: i32 = 30;
/// `float[9]`, a 3x3 block, column after column
pub const SGN_FORMAT_F32_3X3_COLUMNS: i32 = 31;
/// `double[9]`, a 3x3 block, row after row
pub const SGN_FORMAT_F64_3X3_ROWS: i32 = 32;
/// `double[9]`, a 3x3 block, column after column
pub const SGN_FORMAT_F64_3X3_COLUMNS: i32 = 33;

/// Memory of the host that is read: `count` elements, the first at `ptr + byte_offset`, each `byte_stride` after the one
/// before; stride 0 means tightly packed. No alignment is needed, nothing after the last element is touched, and
/// nothing is kept after the call. All zero is the empty view. This struct will not change.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SgnView {
    /// An `SGN_FORMAT_` constant.
    pub format: SgnFormat,
    /// Must be 0.
    pub reserved: u32,
    /// Start of the memory.
    pub ptr: *const c_void,
    /// From there to the first element.
    pub byte_offset: u64,
    /// From one element to the next; 0: their size.
    pub byte_stride: u64,
    /// Number of elements.
    pub count: u64,
}

/// Memory of the host that is written; laid out as `SgnView`. Elements must not overlap; what lies between them is left
/// as it is. This struct will not change.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SgnViewMut {
    /// An `SGN_FORMAT_` constant.
    pub format: SgnFormat,
    /// Must be 0.
    pub reserved: u32,
    /// Start of the memory.
    pub ptr: *mut c_void,
    /// From there to the first element.
    pub byte_offset: u64,
    /// From one element to the next; 0: their size.
    pub byte_stride: u64,
    /// Number of elements.
    pub count: u64,
}

impl SgnView {
    /// The view of nothing.
    pub const EMPTY: SgnView = SgnView {
        format: SGN_FORMAT_NONE,
        reserved: 0,
        ptr: std::ptr::null(),
        byte_offset: 0,
        byte_stride: 0,
        count: 0,
    };

    /// Whether nothing is given.
    pub(super) fn is_absent(&self) -> bool {
        self.count == 0 && self.ptr.is_null()
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Scalar {
    U8,
    U32,
    U64,
    F32,
    F64,
}

/// Scalar, scalars per element, and whether they are to be transposed.
fn decode(format: SgnFormat) -> Option<(Scalar, usize, bool)> {
    Some(match format {
        SGN_FORMAT_U8 => (Scalar::U8, 1, false),
        SGN_FORMAT_U32 => (Scalar::U32, 1, false),
        SGN_FORMAT_U64 => (Scalar::U64, 1, false),
        SGN_FORMAT_U32X2 => (Scalar::U32, 2, false),
        SGN_FORMAT_U32X3 => (Scalar::U32, 3, false),
        SGN_FORMAT_U64X2 => (Scalar::U64, 2, false),
        SGN_FORMAT_U64X3 => (Scalar::U64, 3, false),
        SGN_FORMAT_U32X4 => (Scalar::U32, 4, false),
        SGN_FORMAT_U64X4 => (Scalar::U64, 4, false),
        SGN_FORMAT_F32 => (Scalar::F32, 1, false),
        SGN_FORMAT_F64 => (Scalar::F64, 1, false),
        SGN_FORMAT_F32X3 => (Scalar::F32, 3, false),
        SGN_FORMAT_F64X3 => (Scalar::F64, 3, false),
        SGN_FORMAT_F32X4 => (Scalar::F32, 4, false),
        SGN_FORMAT_F64X4 => (Scalar::F64, 4, false),
        SGN_FORMAT_F32X7 => (Scalar::F32, 7, false),
        SGN_FORMAT_F64X7 => (Scalar::F64, 7, false),
        SGN_FORMAT_F32_3X3_ROWS => (Scalar::F32, 9, false),
        SGN_FORMAT_F32_3X3_COLUMNS => (Scalar::F32, 9, true),
        SGN_FORMAT_F64_3X3_ROWS => (Scalar::F64, 9, false),
        SGN_FORMAT_F64_3X3_COLUMNS => (Scalar::F64, 9, true),
        _ => return None,
    })
}

impl Scalar {
    fn size(self) -> usize {
        match self {
            Scalar::U8 => 1,
            Scalar::U32 | Scalar::F32 => 4,
            Scalar::U64 | Scalar::F64 => 8,
        }
    }
}

/// A view whose layout has been checked.
struct Layout {
    scalar: Scalar,
    lanes: usize,
    transposed: bool,
    base: *const u8,
    stride: usize,
    count: usize,
}

fn layout_error(what: &str, problem: &str, value: u64) -> Failure {
    Failure::new(SGN_ERROR_BUFFER_LAYOUT, format!("{what}: {problem}")).value(value as f64)
}

/// Checks format, stride and extent: all arithmetic on host numbers is checked.
fn layout(view: &SgnView, what: &str) -> Result<Layout, Failure> {
    if view.reserved != 0 {
        return Err(layout_error(what, "reserved field of the view is not 0", u64::from(view.reserved)));
    }
    let Some((scalar, lanes, transposed)) = decode(view.format) else {
        return Err(layout_error(what, "unknown format", view.format as u64));
    };
    let element = scalar.size() * lanes;
    let too_large = || layout_error(what, "the view does not fit into the address space", view.count);
    let stride = if view.byte_stride == 0 { element as u64 } else { view.byte_stride };
    if stride < element as u64 {
        return Err(layout_error(what, "the stride is smaller than an element", stride));
    }
    if view.count == 0 {
        return Ok(Layout { scalar, lanes, transposed, base: std::ptr::null(), stride: 0, count: 0 });
    }
    if view.ptr.is_null() {
        return Err(Failure::null(what));
    }
    let extent = (view.count - 1)
        .checked_mul(stride)
        .and_then(|bytes| bytes.checked_add(element as u64))
        .and_then(|bytes| bytes.checked_add(view.byte_offset))
        .filter(|bytes| *bytes <= isize::MAX as u64)
        .ok_or_else(too_large)?;
    (view.ptr as usize).checked_add(extent as usize).ok_or_else(too_large)?;
    let base = view.ptr.cast::<u8>().wrapping_add(view.byte_offset as usize);
    Ok(Layout { scalar, lanes, transposed, base, stride: stride as usize, count: view.count as usize })
}

impl Layout {
    fn at(&self, index: usize, lane: usize) -> *const u8 {
        self.base.wrapping_add(index * self.stride + lane * self.scalar.size())
    }

    /// Lane of the host's memory that holds entry `lane` of the element.
    fn lane(&self, lane: usize) -> usize {
        if self.transposed { 3 * (lane % 3) + lane / 3 } else { lane }
    }

    /// # Safety
    /// The element is within the view, readable, and of a float format.
    unsafe fn float(&self, index: usize, lane: usize) -> f64 {
        let place = self.at(index, self.lane(lane));
        // SAFETY: passed on.
        unsafe {
            if self.scalar == Scalar::F32 {
                f64::from(place.cast::<f32>().read_unaligned())
            } else {
                place.cast::<f64>().read_unaligned()
            }
        }
    }

    /// # Safety
    /// The element is within the view, readable, and of an integer format.
    unsafe fn integer(&self, index: usize, lane: usize) -> u64 {
        let place = self.at(index, lane);
        // SAFETY: passed on.
        unsafe {
            match self.scalar {
                Scalar::U8 => u64::from(place.read()),
                Scalar::U32 => u64::from(place.cast::<u32>().read_unaligned()),
                _ => place.cast::<u64>().read_unaligned(),
            }
        }
    }
}

fn reserved<T>(count: usize, what: &str) -> Result<Vec<T>, Failure> {
    let mut list = Vec::new();
    match list.try_reserve_exact(count) {
        Ok(()) => Ok(list),
        Err(_) => {
            let message = format!("{what}: no memory for {count} elements");
            Err(Failure::new(SGN_ERROR_OUT_OF_MEMORY, message).value(count as f64))
        }
    }
}

/// Copies the view that the caller points to.
///
/// # Safety
/// `view` is NULL or points to a view.
pub(super) unsafe fn given(view: *const SgnView, what: &str) -> Result<SgnView, Failure> {
    if view.is_null() {
        return Err(Failure::null(what));
    }
    // SAFETY: passed on.
    Ok(unsafe { view.read_unaligned() })
}

/// The same for a view that is written to.
///
/// # Safety
/// As for [`given`].
pub(super) unsafe fn given_mut(view: *const SgnViewMut, what: &str) -> Result<SgnViewMut, Failure> {
    if view.is_null() {
        return Err(Failure::null(what));
    }
    // SAFETY: passed on.
    Ok(unsafe { view.read_unaligned() })
}

/// Whether a format is of `float`.
pub(super) fn is_single(format: SgnFormat) -> bool {
    matches!(decode(format), Some((Scalar::F32, _, _)))
}

/// Reads elements of `N` floats, all finite.
///
/// # Safety
/// The view's memory is readable.
pub(super) unsafe fn floats<const N: usize>(view: &SgnView, what: &str) -> Result<Vec<[f64; N]>, Failure> {
    // SAFETY: passed on.
    unsafe { floats_with(view, what, f64::is_finite) }
}

/// Reads masses, which may be infinite.
///
/// # Safety
/// As for [`floats`].
pub(super) unsafe fn masses(view: &SgnView, what: &str) -> Result<Vec<f64>, Failure> {
    // SAFETY: passed on.
    let list = unsafe { floats_with::<1>(view, what, |mass| mass.is_finite() || mass == f64::INFINITY) }?;
    Ok(list.into_iter().map(|[mass]| mass).collect())
}

unsafe fn floats_with<const N: usize>(
    view: &SgnView,
    what: &str,
    allowed: impl Fn(f64) -> bool,
) -> Result<Vec<[f64; N]>, Failure> {
    let layout = layout(view, what)?;
    if layout.lanes != N || !matches!(layout.scalar, Scalar::F32 | Scalar::F64) {
        return Err(layout_error(
            what,
            &format!("{N} floats per element are needed, the format is another"),
            view.format as u64,
        ));
    }
    let mut list = reserved(layout.count, what)?;
    for index in 0..layout.count {
        let mut element = [0.0; N];
        for (lane, value) in element.iter_mut().enumerate() {
            // SAFETY: within the view.
            *value = unsafe { layout.float(index, lane) };
            if !allowed(*value) {
                let message = format!("{what}[{index}] is {value}");
                return Err(Failure::new(SGN_ERROR_NON_FINITE_INPUT, message).index(index).value(*value));
            }
        }
        list.push(element);
    }
    Ok(list)
}

/// Reads exactly one element of `N` floats.
///
/// # Safety
/// As for [`floats`].
pub(super) unsafe fn one<const N: usize>(view: &SgnView, what: &str) -> Result<[f64; N], Failure> {
    if view.count != 1 {
        return Err(layout_error(what, "exactly one element is needed", view.count));
    }
    // SAFETY: passed on.
    let list = unsafe { floats::<N>(view, what) }?;
    list.first().copied().ok_or_else(|| layout_error(what, "exactly one element is needed", 0))
}

/// Reads scalars.
///
/// # Safety
/// As for [`floats`].
pub(super) unsafe fn scalars(view: &SgnView, what: &str) -> Result<Vec<f64>, Failure> {
    // SAFETY: passed on.
    let list = unsafe { floats::<1>(view, what) }?;
    Ok(list.into_iter().map(|[value]| value).collect())
}

/// Reads 3x3 blocks, rows first whatever the format.
///
/// # Safety
/// As for [`floats`].
pub(super) unsafe fn blocks(view: &SgnView, what: &str) -> Result<Vec<Mat3>, Failure> {
    // SAFETY: passed on.
    let list = unsafe { floats::<9>(view, what) }?;
    let mut blocks = reserved(list.len(), what)?;
    blocks.extend(list.into_iter().map(|[a, b, c, d, e, f, g, h, i]| [[a, b, c], [d, e, f], [g, h, i]]));
    Ok(blocks)
}

/// Reads elements of `N` indices below 2^32.
///
/// # Safety
/// As for [`floats`].
pub(super) unsafe fn indices<const N: usize>(view: &SgnView, what: &str) -> Result<Vec<[u32; N]>, Failure> {
    let layout = layout(view, what)?;
    if layout.lanes != N || !matches!(layout.scalar, Scalar::U32 | Scalar::U64) {
        return Err(layout_error(
            what,
            &format!("{N} indices per element are needed, the format is another"),
            view.format as u64,
        ));
    }
    let mut list = reserved(layout.count, what)?;
    for index in 0..layout.count {
        let mut element = [0u32; N];
        for (lane, entry) in element.iter_mut().enumerate() {
            // SAFETY: within the view.
            let value = unsafe { layout.integer(index, lane) };
            *entry = u32::try_from(value).map_err(|_| {
                let message = format!("{what}[{index}] names vertex {value}");
                Failure::new(SGN_ERROR_BAD_TOPOLOGY, message).index(index).value(value as f64)
            })?;
        }
        list.push(element);
    }
    Ok(list)
}

/// Reads flags.
///
/// # Safety
/// As for [`floats`].
pub(super) unsafe fn flags(view: &SgnView, what: &str) -> Result<Vec<bool>, Failure> {
    let layout = layout(view, what)?;
    if layout.scalar != Scalar::U8 {
        return Err(layout_error(what, "flags are of format U8", view.format as u64));
    }
    let mut list = reserved(layout.count, what)?;
    // SAFETY: within the view.
    list.extend((0..layout.count).map(|index| unsafe { layout.integer(index, 0) } != 0));
    Ok(list)
}

/// A checked view that is ready to be written: nothing can fail any more.
pub(super) struct Output {
    layout: Layout,
}

/// What is written.
pub(super) enum Column<'a> {
    /// Elements of so many floats, one after the other.
    Floats(usize, &'a [f64]),
    /// Elements of so many integers, one after the other.
    Integers(usize, &'a [u64]),
}

impl Column<'_> {
    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Column::Floats(lanes, data) => data.len() / lanes,
            Column::Integers(lanes, data) => data.len() / lanes,
        }
    }
}

impl Output {
    /// Checks that `view` can take `column`: the format must fit, integers must not lose bits.
    pub fn new(view: &SgnViewMut, what: &str, column: &Column) -> Result<Output, Failure> {
        let given = SgnView {
            format: view.format,
            reserved: view.reserved,
            ptr: view.ptr,
            byte_offset: view.byte_offset,
            byte_stride: view.byte_stride,
            count: view.count,
        };
        let layout = layout(&given, what)?;
        let fits = match (column, layout.scalar) {
            (Column::Floats(lanes, _), Scalar::F32 | Scalar::F64) => *lanes == layout.lanes,
            (Column::Integers(lanes, data), Scalar::U32) => {
                *lanes == layout.lanes && data.iter().all(|value| *value <= u64::from(u32::MAX))
            }
            (Column::Integers(lanes, _), Scalar::U64) => *lanes == layout.lanes,
            _ => false,
        };
        if !fits {
            return Err(layout_error(what, "the format cannot take these elements", view.format as u64));
        }
        Ok(Output { layout })
    }

    /// Number of elements that the view takes.
    pub fn count(&self) -> usize {
        self.layout.count
    }

    /// Writes as many elements as both have.
    ///
    /// # Safety
    /// The view's memory is writable.
    pub unsafe fn write(&self, column: &Column) {
        let layout = &self.layout;
        let count = layout.count.min(column.len());
        for index in 0..count {
            for lane in 0..layout.lanes {
                let place = layout.at(index, layout.lane(lane)).cast_mut();
                let from = index * layout.lanes + lane;
                // SAFETY: within the view; formats agree, see `new`.
                unsafe {
                    match (column, layout.scalar) {
                        (Column::Floats(_, data), Scalar::F32) => {
                            place.cast::<f32>().write_unaligned(data[from] as f32);
                        }
                        (Column::Floats(_, data), _) => place.cast::<f64>().write_unaligned(data[from]),
                        (Column::Integers(_, data), Scalar::U32) => {
                            place.cast::<u32>().write_unaligned(data[from] as u32);
                        }
                        (Column::Integers(_, data), _) => place.cast::<u64>().write_unaligned(data[from]),
                    }
                }
            }
        }
    }
}

/// Writes exactly as many elements as there are; a view of another count is refused.
///
/// # Safety
/// The view's memory is writable.
pub(super) unsafe fn write_all(view: &SgnViewMut, what: &str, column: &Column) -> Result<(), Failure> {
    let output = Output::new(view, what, column)?;
    if output.count() != column.len() {
        let problem = format!("{} elements are there to be written", column.len());
        return Err(layout_error(what, &problem, view.count));
    }
    // SAFETY: passed on.
    unsafe { output.write(column) };
    Ok(())
}

/// The components of vectors, one after the other.
pub(super) fn flat(vectors: &[Vec3]) -> &[f64] {
    vectors.as_flattened()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view<T>(data: &[T], format: SgnFormat, stride: u64, count: u64) -> SgnView {
        SgnView { format, ptr: data.as_ptr().cast(), byte_stride: stride, count, ..SgnView::EMPTY }
    }

    fn code<T>(result: Result<T, Failure>) -> i32 {
        result.err().map_or(0, |failure| failure.code)
    }

    #[test]
    fn strided_and_unaligned_elements_are_found() {
        let mut bytes = vec![0xaau8; 1 + 3 * 20];
        for i in 0..3usize {
            for k in 0..3usize {
                let place = 1 + 20 * i + 4 * k;
                bytes[place..place + 4].copy_from_slice(&((10 * i + k) as f32).to_ne_bytes());
            }
        }
        let mut given = view(&bytes, SGN_FORMAT_F32X3, 20, 3);
        given.byte_offset = 1;
        // SAFETY: within the vector.
        let read = unsafe { floats::<3>(&given, "x") }.unwrap();
        assert_eq!(read, [[0.0, 1.0, 2.0], [10.0, 11.0, 12.0], [20.0, 21.0, 22.0]]);
        // SAFETY: wrong lanes are refused before anything is read.
        assert_eq!(code(unsafe { floats::<4>(&given, "x") }), SGN_ERROR_BUFFER_LAYOUT);
    }

    #[test]
    fn columns_are_turned_into_rows() {
        let data: [f64; 9] = std::array::from_fn(|i| i as f64);
        // SAFETY: within the array.
        let read = unsafe { blocks(&view(&data, SGN_FORMAT_F64_3X3_COLUMNS, 0, 1), "a") }.unwrap();
        assert_eq!(read, [[[0.0, 3.0, 6.0], [1.0, 4.0, 7.0], [2.0, 5.0, 8.0]]]);
    }

    #[test]
    fn extents_that_overflow_are_refused() {
        let data = [0.0f64; 9];
        // SAFETY: refused before anything is read.
        unsafe {
            for (stride, count, offset) in
                [(u64::MAX, 2, 0), (24, u64::MAX / 8, 0), (24, 3, u64::MAX - 60), (8, 3, 0), (24, 1 << 62, 0)]
            {
                let mut given = view(&data, SGN_FORMAT_F64X3, stride, count);
                given.byte_offset = offset;
                assert_eq!(code(floats::<3>(&given, "x")), SGN_ERROR_BUFFER_LAYOUT, "{stride} {count} {offset}");
            }
            let mut null = view(&data, SGN_FORMAT_F64X3, 0, 1);
            null.ptr = std::ptr::null();
            assert_eq!(code(floats::<3>(&null, "x")), super::super::SGN_ERROR_NULL_ARGUMENT);
        }
    }

    #[test]
    fn indices_beyond_32_bits_and_numbers_that_are_not_finite_are_named() {
        let data = [1u64, 2, 3, 4, 1 << 32, 6];
        // SAFETY: within the arrays.
        unsafe {
            let failure = indices::<3>(&view(&data, SGN_FORMAT_U64X3, 0, 2), "t").unwrap_err();
            assert_eq!((failure.code, failure.index, failure.value), (SGN_ERROR_BAD_TOPOLOGY, 1, 4294967296.0));
            let data = [1.0, f64::INFINITY];
            let failure = scalars(&view(&data, SGN_FORMAT_F64, 0, 2), "m").unwrap_err();
            assert_eq!((failure.code, failure.index), (SGN_ERROR_NON_FINITE_INPUT, 1));
        }
    }
}
