//! Certifies meshes: which edges and faces of an OBJ file intersect, decided exactly.
//!
//! `cargo run --release --example certify -- FILE.obj...` prints one line per file and the first witnesses of each.
//! Exit status: 0 all clean, 1 intersections, 2 a file that cannot be read (named with its line).

use signorini::detection::Primitives;
use signorini::detection::intersection::find;
use signorini::mesh::Surface;
use signorini::parallel::Par;
use std::process::ExitCode;

#[allow(dead_code)]
mod obj_file;

/// Witnesses printed per file.
const SHOWN: usize = 5;

/// The surface of an OBJ file. Errors: line number (from 1; 0 for the whole file) and what is wrong there.
fn read_obj(text: &str) -> Result<Surface, (usize, String)> {
    let obj = obj_file::parse(text)?;
    Surface::from_triangles(obj.positions, obj.faces).map_err(|error| {
        let line = if error.message.starts_with("a face") { obj.face_lines[error.index] } else { 0 };
        (line, error.to_string())
    })
}

/// Prints the findings for one file; whether it is clean.
fn certify(path: &str) -> Result<bool, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    let surface = read_obj(&text).map_err(|(line, message)| format!("{path}:{line}: {message}"))?;
    let primitives = Primitives { vertices: &surface.vertices, edges: &surface.edges, faces: &surface.faces };
    let found = find(&primitives, &surface.rest, &|_, _| true, Par::Serial);
    let (vertices, faces) = (surface.rest.len(), surface.faces.len());
    println!("{path}: {vertices} vertices, {faces} faces, {} intersections", found.len());
    for witness in found.iter().take(SHOWN) {
        let [x, y, z] = witness.point;
        let [a, b] = surface.edges[witness.edge as usize].map(|v| v + 1);
        println!("  edge {a}-{b} and face {} at {x} {y} {z}", witness.face + 1);
    }
    Ok(found.is_empty())
}

fn main() -> ExitCode {
    let mut status = 0;
    for path in std::env::args().skip(1) {
        match certify(&path) {
            Ok(true) => {}
            Ok(false) => status = status.max(1),
            Err(message) => {
                eprintln!("{message}");
                status = 2;
            }
        }
    }
    ExitCode::from(status)
}
