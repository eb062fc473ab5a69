//! Values as bytes: every field by itself, little-endian, in the order of the struct; a sequence with its length first.
//!
//! The bytes depend neither on the machine nor on the compiler. Reading trusts nothing: an end that comes too early, a
//! number that names no variant and a length beyond the rest are faults with their place, and memory grows only with
//! bytes that were really there.

use super::{Fault, WorldError};

/// Where bytes go.
pub(super) trait Sink {
    /// Takes the next bytes.
    fn put(&mut self, bytes: &[u8]);
}

/// Counts bytes.
#[derive(Default)]
pub(super) struct Count(pub usize);

impl Sink for Count {
    fn put(&mut self, bytes: &[u8]) {
        self.0 += bytes.len();
    }
}

/// Writes into memory that the host gave; what does not fit is dropped, and `written` goes on counting.
pub(super) struct Room<'a> {
    pub bytes: &'a mut [u8],
    pub written: usize,
}

impl Sink for Room<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let end = self.written.saturating_add(bytes.len());
        if let Some(room) = self.bytes.get_mut(self.written..end) {
            room.copy_from_slice(bytes);
        }
        self.written = end;
    }
}

/// A multiply-and-rotate hash over the bytes, eight at a time. Not for adversaries.
pub(super) struct Hash {
    value: u64,
}

impl Hash {
    pub fn new() -> Hash {
        Hash { value: 0x243f_6a88_85a3_08d3 }
    }

    pub fn value(&self) -> u64 {
        self.value
    }
}

impl Sink for Hash {
    fn put(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0u8; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.value = (self.value ^ u64::from_le_bytes(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            self.value ^= self.value >> 29;
        }
    }
}

/// Bytes to read, and how far they have been.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Source<'a> {
    pub fn new(bytes: &'a [u8]) -> Source<'a> {
        Source { bytes, at: 0 }
    }

    pub fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next bytes. Errors: there are fewer.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], WorldError> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| self.mismatch("the snapshot ends too early", count as f64))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    /// A fault at this place.
    pub fn mismatch(&self, message: &str, value: f64) -> WorldError {
        WorldError::new(Fault::SnapshotMismatch, message).index(self.at).value(value)
    }
}

/// A value that can be written as bytes and read back.
pub(super) trait Archive: Sized {
    /// Writes the value.
    fn save(&self, out: &mut dyn Sink);
    /// Reads a value. Errors: what the bytes cannot mean, with their place.
    fn load(source: &mut Source) -> Result<Self, WorldError>;
}

macro_rules! archive_numbers {
    ($($number:ty),*) => { $(
        impl Archive for $number {
            fn save(&self, out: &mut dyn Sink) {
                out.put(&self.to_le_bytes());
            }

            fn load(source: &mut Source) -> Result<Self, WorldError> {
                let mut bytes = [0; size_of::<$number>()];
                bytes.copy_from_slice(source.take(size_of::<$number>())?);
                Ok(<$number>::from_le_bytes(bytes))
            }
        }
    )* };
}
archive_numbers!(u8, u16, u32, u64, f64);

impl Archive for usize {
    fn save(&self, out: &mut dyn Sink) {
        (*self as u64).save(out);
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        let value = u64::load(source)?;
        usize::try_from(value).map_err(|_| source.mismatch("a number is too large for this machine", value as f64))
    }
}

impl Archive for bool {
    fn save(&self, out: &mut dyn Sink) {
        u8::from(*self).save(out);
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        match u8::load(source)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(source.mismatch("a truth value is neither 0 nor 1", f64::from(other))),
        }
    }
}

impl<T: Archive + Copy + Default, const N: usize> Archive for [T; N] {
    fn save(&self, out: &mut dyn Sink) {
        self.iter().for_each(|value| value.save(out));
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = T::load(source)?;
        }
        Ok(values)
    }
}

impl<T: Archive> Archive for Vec<T> {
    fn save(&self, out: &mut dyn Sink) {
        self.len().save(out);
        self.iter().for_each(|value| value.save(out));
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        let count = usize::load(source)?;
        let mut values = Vec::new();
        // No more than the bytes that are there could fill: a length alone allocates nothing.
        let room = count.min(source.remaining() / size_of::<T>().max(1));
        values.try_reserve(room).map_err(|_| WorldError::out_of_memory("no memory for the snapshot"))?;
        for _ in 0..count {
            values.push(T::load(source)?);
        }
        Ok(values)
    }
}

impl<T: Archive> Archive for Option<T> {
    fn save(&self, out: &mut dyn Sink) {
        self.is_some().save(out);
        if let Some(value) = self {
            value.save(out);
        }
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        Ok(if bool::load(source)? { Some(T::load(source)?) } else { None })
    }
}

macro_rules! archive_tuple {
    ($($name:ident $place:tt),*) => {
        impl<$($name: Archive),*> Archive for ($($name,)*) {
            fn save(&self, out: &mut dyn Sink) {
                $(self.$place.save(out);)*
            }

            fn load(source: &mut Source) -> Result<Self, WorldError> {
                Ok(($($name::load(source)?,)*))
            }
        }
    };
}
archive_tuple!(A 0, B 1);
archive_tuple!(A 0, B 1, C 2);

/// Archives a struct by its fields, in the order given.
macro_rules! archive_struct {
    ($name:ty { $($field:ident),* $(,)? }) => {
        impl Archive for $name {
            fn save(&self, out: &mut dyn Sink) {
                $(self.$field.save(out);)*
            }

            fn load(source: &mut Source) -> Result<Self, WorldError> {
                Ok(Self { $($field: Archive::load(source)?),* })
            }
        }
    };
}

/// Archives an enum without fields by the numbers given.
macro_rules! archive_enum {
    ($name:ty { $($number:literal => $variant:path),* $(,)? }) => {
        impl Archive for $name {
            fn save(&self, out: &mut dyn Sink) {
                let number: u8 = match self { $($variant => $number),* };
                number.save(out);
            }

            fn load(source: &mut Source) -> Result<Self, WorldError> {
                match u8::load(source)? {
                    $($number => Ok($variant),)*
                    other => Err(source.mismatch("a number names no variant", f64::from(other))),
                }
            }
        }
    };
}

pub(super) use {archive_enum, archive_struct};

#[cfg(test)]
mod tests {
    use super::*;

    type Nested = Vec<(u16, Option<Vec<[f64; 3]>>)>;

    fn bytes<T: Archive>(value: &T) -> Vec<u8> {
        let mut count = Count::default();
        value.save(&mut count);
        let mut room = vec![0; count.0];
        let mut out = Room { bytes: &mut room, written: 0 };
        value.save(&mut out);
        assert_eq!(out.written, count.0);
        room
    }

    #[test]
    fn what_is_written_is_read_back() {
        let value: Nested = vec![(7, None), (8, Some(vec![[1.0, -0.0, f64::MIN_POSITIVE]])), (9, Some(vec![]))];
        let written = bytes(&value);
        assert_eq!(Nested::load(&mut Source::new(&written)), Ok(value));
        assert_eq!(bytes(&0x0102_0304u32), [4, 3, 2, 1], "little-endian");
    }

    #[test]
    fn every_cut_is_a_fault() {
        let written = bytes(&vec![(7u16, Some(vec![[1.0f64; 3]]))]);
        for length in 0..written.len() {
            let error = Nested::load(&mut Source::new(&written[..length])).unwrap_err();
            assert_eq!(error.fault, Fault::SnapshotMismatch);
        }
    }

    #[test]
    fn a_length_alone_takes_no_memory() {
        let hostile = bytes(&u64::MAX);
        assert_eq!(<Vec<[f64; 3]>>::load(&mut Source::new(&hostile)).unwrap_err().fault, Fault::SnapshotMismatch);
        let unreal = bytes(&3u8);
        assert_eq!(bool::load(&mut Source::new(&unreal)).unwrap_err().value, 3.0);
    }
}
