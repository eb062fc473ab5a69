//! Structs that grow: read and written by the size that the caller gives.

use super::status::{Failure, SGN_ERROR_BAD_STRUCT, SGN_ERROR_UNSUPPORTED_STRUCT, SGN_OK, Status};
use std::mem::MaybeUninit;

/// Larger than any struct will get; what is beyond is garbage and not read.
const SIZE_MAX: usize = 4096;

/// A struct that begins with `uint32_t struct_size` and only grows at its end.
///
/// # Safety
/// `repr(C)`, first field `u32`, no padding, every bit pattern valid.
pub(super) unsafe trait Growing: Copy {
    /// Name in the header.
    const NAME: &'static str;
    /// Size in the first version that had it.
    const FIRST_SIZE: usize;
    /// What its init function fills in; `struct_size` is set by the caller.
    fn defaults() -> Self;
}

/// The body of an init function: the defaults, as far as `size` reaches, the rest zero.
///
/// # Safety
/// `out` is NULL or points to `size` writable bytes.
pub(super) unsafe fn init<T: Growing>(out: *mut T, size: usize) -> Status {
    if out.is_null() {
        return Err(Failure::null("the struct"));
    }
    if size < T::FIRST_SIZE || size > SIZE_MAX {
        return Err(Failure::new(SGN_ERROR_BAD_STRUCT, format!("{size} is not a size of {}", T::NAME)));
    }
    let value = T::defaults();
    // SAFETY: the caller vouches for `size` bytes; `T` has no padding.
    unsafe {
        std::ptr::write_bytes(out.cast::<u8>(), 0, size);
        let known = size.min(size_of::<T>());
        std::ptr::copy_nonoverlapping((&raw const value).cast::<u8>(), out.cast::<u8>(), known);
        out.cast::<u32>().write_unaligned(size as u32);
    }
    Ok(SGN_OK)
}

/// Checks `struct_size` of a struct of the caller's and returns it.
///
/// # Safety
/// `given` is NULL or points to at least four readable bytes and to as many as they say.
pub(super) unsafe fn checked_size<T: Growing>(given: *const T) -> Result<usize, Failure> {
    if given.is_null() {
        return Err(Failure::null(T::NAME));
    }
    // SAFETY: the caller vouches for four bytes.
    let size = unsafe { given.cast::<u32>().read_unaligned() } as usize;
    if size < T::FIRST_SIZE || size > SIZE_MAX {
        let message = format!("struct_size {size} is not a size of {}: call its init function", T::NAME);
        return Err(Failure::new(SGN_ERROR_BAD_STRUCT, message).value(size as f64));
    }
    Ok(size)
}

/// Reads a struct of the caller's: fields beyond its size take their defaults; bytes beyond what is known must be zero.
///
/// # Safety
/// As for [`checked_size`].
pub(super) unsafe fn read<T: Growing>(given: *const T) -> Result<T, Failure> {
    // SAFETY: passed on.
    let size = unsafe { checked_size(given) }?;
    let known = size.min(size_of::<T>());
    for i in known..size {
        // SAFETY: within the size that the caller gives.
        if unsafe { given.cast::<u8>().add(i).read() } != 0 {
            let message = format!("byte {i} of {} is set and not known to this version", T::NAME);
            return Err(Failure::new(SGN_ERROR_UNSUPPORTED_STRUCT, message).index(i));
        }
    }
    let mut value = MaybeUninit::new(T::defaults());
    // SAFETY: `known` bytes are readable, and every bit pattern is a `T`.
    unsafe {
        std::ptr::copy_nonoverlapping(given.cast::<u8>(), value.as_mut_ptr().cast::<u8>(), known);
        Ok(value.assume_init())
    }
}

/// Writes an output struct as far as the caller's size reaches, keeping its `struct_size`.
///
/// # Safety
/// `out` has passed [`checked_size`] with `size`, and is writable.
pub(super) unsafe fn write<T: Growing>(out: *mut T, size: usize, value: &T) {
    let known = size.min(size_of::<T>());
    // SAFETY: the caller vouches for `size` bytes; `T` has no padding.
    unsafe {
        std::ptr::copy_nonoverlapping((value as *const T).cast::<u8>(), out.cast::<u8>(), known);
        out.cast::<u32>().write_unaligned(size as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use super::*;

    #[test]
    fn no_struct_has_another_size_than_its_first_version() {
        fn check<T: Growing>(wrong: &mut Vec<String>) {
            // Until a struct has grown, its size is the first one.
            if size_of::<T>() != T::FIRST_SIZE {
                wrong.push(format!("{}: {} was {}", T::NAME, size_of::<T>(), T::FIRST_SIZE));
            }
        }
        let mut wrong = Vec::new();
        check::<SgnApi>(&mut wrong);
        check::<SgnBodyInfo>(&mut wrong);
        check::<SgnCheckReport>(&mut wrong);
        check::<SgnContextDesc>(&mut wrong);
        check::<SgnDeformableDesc>(&mut wrong);
        check::<SgnErrorInfo>(&mut wrong);
        check::<SgnFilterDesc>(&mut wrong);
        check::<SgnHalfSpaceDesc>(&mut wrong);
        check::<SgnKinematicDesc>(&mut wrong);
        check::<SgnMaterialDesc>(&mut wrong);
        check::<SgnRigidDesc>(&mut wrong);
        check::<SgnShapeDesc>(&mut wrong);
        check::<SgnStepDesc>(&mut wrong);
        check::<SgnStepReport>(&mut wrong);
        check::<SgnSystemDesc>(&mut wrong);
        check::<SgnVersion>(&mut wrong);
        check::<SgnWorldDesc>(&mut wrong);
        assert!(wrong.is_empty(), "{wrong:#?}");
    }

    #[test]
    fn older_and_newer_callers_are_understood() {
        let mut bytes = [0u64; 64];
        let given = bytes.as_mut_ptr().cast::<SgnStepDesc>();
        let known = size_of::<SgnStepDesc>();
        // SAFETY: the array is larger than every size used.
        unsafe {
            assert!(init(given, 3).is_err() && init(given, 5000).is_err());
            assert!(init(given, known + 16).is_ok());
            assert!(read(given).is_ok(), "a newer caller with nothing set");
            given.cast::<u64>().add(known / 8 + 1).write(1 << 40);
            let error = read(given).map(|_| ()).unwrap_err();
            assert_eq!((error.code, error.index), (SGN_ERROR_UNSUPPORTED_STRUCT, known as u64 + 8 + 5));
            given.cast::<u32>().write(u32::MAX);
            assert_eq!(read(given).map(|_| ()).unwrap_err().code, SGN_ERROR_BAD_STRUCT);
        }
    }
}
