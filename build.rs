//! Gives the shared library its SONAME: before 1.0 every minor version is a break.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        let version = |part: &str| std::env::var(format!("CARGO_PKG_VERSION_{part}")).unwrap_or_default();
        let (major, minor) = (version("MAJOR"), version("MINOR"));
        let name = if major == "0" { format!("0.{minor}") } else { major };
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libsignorini.so.{name}");
        // A library with thread-local destructors stays mapped anyway; marked, that is the same everywhere.
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
