//! Compiles and runs one example host.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The C files that all hosts share.
const SHARED_SOURCES: [&str; 4] = ["c/host_cloth.c", "c/host_mesh.c", "c/signorini_host.c", "c/cloth_contact.c"];

/// The engine that a host belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Bullet in double precision, C++.
    Bullet,
    /// ODE in double precision, C.
    Ode,
}

impl Engine {
    /// Name for pkg-config, Debian package.
    fn package(self) -> (&'static str, &'static str) {
        match self {
            Engine::Bullet => ("bullet-float64", "libbullet-dev"),
            Engine::Ode => ("ode", "libode-dev"),
        }
    }

    /// Compiler and linker flags, as pkg-config tells them.
    fn flags(self, kind: &str) -> Vec<String> {
        let (module, package) = self.package();
        let output = Command::new("pkg-config").args([kind, module]).output();
        let output =
            output.unwrap_or_else(|e| panic!("pkg-config: {e}; install the package pkg-config (ci/setup does)"));
        assert!(
            output.status.success(),
            "no {module}: install the package {package} (ci/setup does)\n{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8_lossy(&output.stdout).split_whitespace().map(str::to_owned).collect()
    }

    /// What runs a scene in this engine.
    fn scene_sources(self) -> &'static [&'static str] {
        match self {
            Engine::Bullet => &["c/example_run.c", "cpp/bullet_engine.cpp"],
            Engine::Ode => &["c/example_run.c", "c/ode_engine.c", "c/ode_contact.c"],
        }
    }
}

/// An example host.
pub struct Program {
    /// File with `main`, below `examples`.
    pub main: &'static str,
    /// Engine it links.
    pub engine: Engine,
    /// Whether `main` is a scene that knows no engine.
    pub is_scene: bool,
}

impl Program {
    /// Builds the host, runs it from the repository's root, and fails with its output unless it returns 0.
    pub fn run(&self, arguments: &[&str]) {
        let program = self.build();
        let mut command = Command::new(&program);
        command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
        let output = command.output().unwrap_or_else(|e| panic!("{}: {e}", program.display()));
        let text = String::from_utf8_lossy(&output.stdout);
        print!("{text}");
        assert!(
            output.status.success(),
            "{} {arguments:?}: {}\n{text}{}",
            self.main,
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
        assert!(text.lines().any(|line| line.starts_with("PASS")), "{}: no summary line\n{text}", self.main);
    }

    fn build(&self) -> PathBuf {
        let library = library_folder();
        let name = Path::new(self.main).file_stem().expect("a file name").to_string_lossy().into_owned();
        let folder = library.join("hosts").join(format!("{:?}_{name}", self.engine).to_lowercase());
        std::fs::create_dir_all(&folder).expect("a folder for objects");
        let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");

        let mut objects = Vec::new();
        let of_scene = if self.is_scene { self.engine.scene_sources() } else { &[] };
        for source in SHARED_SOURCES.iter().chain(of_scene).chain([&self.main]) {
            let source = examples.join(source);
            let object = folder.join(source.file_name().expect("a file name")).with_extension("o");
            let mut compile = compiler(is_cpp(&source));
            compile.args(self.engine.flags("--cflags").iter().map(|f| f.replacen("-I", "-isystem", 1)));
            compile.arg("-I").arg(examples.join("c")).arg("-I").arg(examples.join("../include"));
            compile.arg("-c").arg(&source).arg("-o").arg(&object);
            succeed(compile);
            objects.push(object);
        }

        // Programs ask for the library by its soname; a link beside them bears it.
        let soname = soname(&library.join("libsignorini.so"));
        let link_name = folder.join(&soname);
        let _ = std::fs::remove_file(&link_name);
        std::os::unix::fs::symlink(library.join("libsignorini.so"), &link_name).expect("a link to the library");

        let program = folder.join(&name);
        let mut link = compiler(self.engine == Engine::Bullet);
        link.args(objects).arg("-o").arg(&program);
        link.arg("-L").arg(&library).arg("-lsignorini").arg("-Wl,-rpath,$ORIGIN");
        link.args(self.engine.flags("--libs")).arg("-lm");
        succeed(link);
        program
    }
}

/// The shared library stands beside the test program.
fn library_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the path of this test");
    let folder = test.parent().expect("a folder").to_owned();
    assert!(folder.join("libsignorini.so").exists(), "no libsignorini.so in {}", folder.display());
    folder
}

/// The name that a shared library wants to be found by.
fn soname(library: &Path) -> String {
    let output = Command::new("readelf").arg("-d").arg(library).output();
    let output = output.unwrap_or_else(|e| panic!("readelf: {e}; install the package binutils"));
    let text = String::from_utf8_lossy(&output.stdout);
    let name = text.lines().find_map(|line| line.split_once("soname: [")?.1.split(']').next());
    name.unwrap_or_else(|| panic!("{} has no soname", library.display())).to_owned()
}

fn is_cpp(source: &Path) -> bool {
    source.extension().is_some_and(|e| e == "cpp")
}

/// The C or C++ compiler of the `cc` crate, all warnings errors.
fn compiler(cpp: bool) -> Command {
    let triple = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut build = cc::Build::new();
    build.target(&triple).host(&triple).opt_level(2).cargo_metadata(false).cpp(cpp);
    build.flag(if cpp { "-std=c++17" } else { "-std=c99" });
    for flag in ["-Wall", "-Wextra", "-Wpedantic", "-Werror"] {
        build.flag(flag);
    }
    build.get_compiler().to_command()
}

fn succeed(mut command: Command) {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}; install gcc and g++ (ci/setup does)"));
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
}
