//! Runs `signorini-run` in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder that is removed when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("signorini-runner-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder for the test");
        Folder(path)
    }

    /// Writes a file and returns its path.
    pub fn file(&self, name: &str, text: &str) -> String {
        let path = self.0.join(name);
        std::fs::write(&path, text).expect("a file of the test");
        path.display().to_string()
    }

    pub fn read(&self, name: &str) -> String {
        let path = self.0.join(name);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signorini-run"));
    command.current_dir(folder).args(arguments);
    command
}

pub fn run(folder: &Folder, arguments: &[&str]) -> Output {
    command(&folder.0, arguments).output().expect("the runner starts")
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).to_string()
}

/// Runs with `--json` and parses the line. The run must end with status 0.
pub fn report(folder: &Folder, arguments: &[&str]) -> serde_json::Value {
    let output = run(folder, &[arguments, &["--json"]].concat());
    let (line, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{arguments:?}: {:?}\n{line}\n{errors}", output.status);
    assert_eq!(errors, "", "quiet without a terminal");
    assert_eq!(line.lines().count(), 1, "{line}");
    serde_json::from_str(&line).expect("JSON")
}

/// A cloth with a moving pin, a ball, a soft cube that carries a ball, all kinds of bodies in one.
pub const SMALL: &str = r#"
title = "All kinds of bodies"
dt = 0.01
duration = 0.4

[output]
frames_per_second = 20.0

[[sheet]]
name = "cloth"
mesh.grid = { cells = [9, 9], size = [0.5, 0.5] }
placement.position = [0.0, 0.0, 0.3]
friction = 0.3
half_thickness = 0.002
material = { density = 300.0, thickness = 0.001, young_modulus = 1e5, poisson_ratio = 0.3, bending_stiffness = 1e-5 }
pins = [{ vertices = [0, 9], motion = [{ until = 0.1 }, { until = 0.3, velocity = [0.0, 0.0, 0.5] }] }]

[[solid]]
name = "carrier"
mesh.box_tetrahedra = { cells = [1, 1, 1], size = [0.2, 0.2, 0.2] }
surface.sphere = { radius = 0.09, tolerance = 0.005 }
placement.position = [0.0, 0.0, 0.45]
material = { density = 200.0, young_modulus = 1e4, poisson_ratio = 0.3 }
friction = 0.3
half_thickness = 0.002

[[rigid]]
name = "ball"
mesh.sphere = { radius = 0.08, tolerance = 0.004 }
placement.position = [0.05, 0.0, 0.1]
copies = { count = 2, grid = [2, 1], spacing = [0.2, 0.2, 0.2] }
density = 300.0
friction = 0.3
half_thickness = 0.002

[[kinematic]]
name = "paddle"
mesh.box = { size = [0.02, 0.6, 0.1], cells = [1, 4, 1] }
placement.position = [-0.3, 0.0, 0.06]
half_thickness = 0.002
motion = [{ until = 0.3, velocity = [0.3, 0.0, 0.0], angular_velocity = [0.0, 0.0, 0.5] }]

[[half_space]]
name = "ground"
normal = [0.0, 0.0, 2.0]
friction = 0.3
half_thickness = 0.002
motion = [{ until = 0.2, velocity = [0.0, 0.0, 0.05] }]
"#;
