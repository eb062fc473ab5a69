//! The C ABI as hosts see it: the header, the symbols, and C and C++ programs against the shared library.

mod build;
mod header;
mod library;
mod programs;
