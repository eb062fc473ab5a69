//! The scripts of `ci/` that check files, as a user runs them: what they print, and their exit status.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod ccd_check;
mod certify;
mod clean_trajectory;

use std::path::{Path, PathBuf};
use std::process::Command;

/// What a script said.
struct Answer {
    status: i32,
    out: String,
    errors: String,
}

/// Runs a script of `ci/` from `folder`.
fn run(script: &str, folder: &Path, arguments: &[&str]) -> Answer {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("ci").join(script);
    let output = Command::new(&script).current_dir(folder).args(arguments).output();
    let output = output.unwrap_or_else(|e| panic!("{}: {e}", script.display()));
    Answer {
        status: output.status.code().expect("an exit status"),
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        errors: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// An empty folder of this name.
fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}
