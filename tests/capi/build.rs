//! Builds C and C++ programs against the shared library that `cargo test` has just made, and runs them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Language and standard of a program.
#[derive(Clone, Copy)]
pub enum Standard {
    C99,
    /// With the address and the undefined behaviour sanitizer, which end the program at what they find.
    C99Sanitized,
    C11,
    Cxx11,
    Cxx17,
}

impl Standard {
    pub fn is_cpp(self) -> bool {
        matches!(self, Standard::Cxx11 | Standard::Cxx17)
    }

    /// Flags of the compiler and the linker.
    fn sanitizers(self) -> &'static [&'static str] {
        match self {
            Standard::C99Sanitized => &["-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"],
            _ => &[],
        }
    }

    fn flag(self) -> &'static str {
        match self {
            Standard::C99 | Standard::C99Sanitized => "-std=c99",
            Standard::C11 => "-std=c11",
            Standard::Cxx11 => "-std=c++11",
            Standard::Cxx17 => "-std=c++17",
        }
    }
}

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// `target/release/deps`, where cargo puts the shared library beside the test.
pub fn library_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test");
    let folder = test.parent().expect("a folder").to_owned();
    assert!(folder.join("libsignorini.so").exists(), "no libsignorini.so in {}", folder.display());
    folder
}

/// The compiler of the `cc` crate with all warnings as errors.
pub fn compiler(standard: Standard) -> Command {
    let triple = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut build = cc::Build::new();
    build.target(&triple).host(&triple).opt_level(1).cargo_metadata(false).cpp(standard.is_cpp());
    for flag in [standard.flag(), "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-g"] {
        build.flag(flag);
    }
    let mut command = build.get_compiler().to_command();
    command.args(standard.sanitizers()).arg("-I").arg(root().join("include"));
    command
}

pub fn succeed(mut command: Command) -> Output {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert!(
        output.status.success(),
        "{command:?}\n{}\n{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Builds a program of one file; `source` is relative to the repository.
pub fn build(source: &str, standard: Standard) -> PathBuf {
    let library = library_folder();
    let folder = library.join("capi");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let stem = Path::new(source).file_stem().expect("a file name").to_string_lossy().into_owned();
    let program = folder.join(format!(
        "{stem}{}",
        standard.flag().replace('=', "_") + if standard.sanitizers().is_empty() { "" } else { "_sanitized" }
    ));
    let mut command = compiler(standard);
    command.arg("-I").arg(root().join("bindings/cpp"));
    command.arg(root().join(source)).arg("-o").arg(&program);
    command.arg("-L").arg(&library).arg("-lsignorini").arg(format!("-Wl,-rpath,{}", library.display()));
    command.args(["-lm", "-lpthread", "-ldl"]);
    succeed(command);
    program
}

/// Builds and runs a program; what it wrote. The library must not have written anything to standard error.
pub fn run(source: &str, standard: Standard, arguments: &[&str]) -> String {
    let program = build(source, standard);
    let mut command = Command::new(&program);
    // Cargo's search path names folders where an older library may stand; the program knows its own.
    command.args(arguments).env_remove("LD_LIBRARY_PATH");
    let output = succeed(command);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.is_empty(), "{source} wrote to standard error:\n{errors}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}
