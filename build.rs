//! Gives the shared library its SONAME: before 1.0 every minor version is a break.

use std::path::PathBuf;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    if variable("CARGO_CFG_TARGET_OS") != "linux" {
        return;
    }
    let (major, minor) = (variable("CARGO_PKG_VERSION_MAJOR"), variable("CARGO_PKG_VERSION_MINOR"));
    let version = if major == "0" { format!("0.{minor}") } else { major };
    let name = format!("libsignorini.so.{version}");
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,{name}");
    // A library with thread-local destructors stays mapped anyway; marked, that is the same everywhere.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    link_by_soname(&name);
}

/// Puts links of that name beside the library of `cargo build` (the profile's folder) and of `cargo test` (`deps` in it), so
/// that programs linked against either find it. An installed library has its links from the installation; a link that
/// cannot be made here is not missed there.
fn link_by_soname(name: &str) {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    let Some(profile) = out.ancestors().nth(3) else { return };
    for folder in [profile.to_path_buf(), profile.join("deps")] {
        let link = folder.join(name);
        #[cfg(unix)]
        if folder.is_dir() && link.symlink_metadata().is_err() {
            let _ = std::os::unix::fs::symlink("libsignorini.so", link);
        }
        #[cfg(not(unix))]
        let _ = link;
    }
}
