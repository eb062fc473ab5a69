//! The C ABI as hosts see it: the header, the symbols, and C and C++ programs against the shared library.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod build;
mod header;
mod library;
mod programs;
