//! Certifies meshes: which edges and faces of an OBJ file intersect, decided exactly.
//!
//! `cargo run --release --example certify -- FILE.obj...` prints one line per file and the first witnesses of each.
//! Exit status: 0 all clean, 1 intersections, 2 a file that cannot be read (named with its line).

use signorini::detection::Primitives;
use signorini::detection::intersection::find;
use signorini::math::Vec3;
use signorini::mesh::Surface;
use signorini::parallel::Par;
use std::process::ExitCode;

/// Witnesses printed per file.
const SHOWN: usize = 5;

/// Vertices and faces of an OBJ file; polygons are cut into fans, everything else is passed over.
///
/// Errors: line number (from 1; 0 for the whole file) and what is wrong there.
fn read_obj(text: &str) -> Result<Surface, (usize, String)> {
    let (mut positions, mut faces, mut lines) = (Vec::<Vec3>::new(), Vec::new(), Vec::new());
    for (index, line) in text.lines().enumerate() {
        let fail = |message: String| (index + 1, message);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut x = [0.0; 3];
                for coordinate in &mut x {
                    let word = words.next().ok_or_else(|| fail("a vertex needs three coordinates".to_string()))?;
                    *coordinate = word.parse().map_err(|_| fail(format!("'{word}' is not a number")))?;
                }
                positions.push(x);
            }
            Some("f") => {
                let corners = words.map(|word| corner(word, positions.len())).collect::<Result<Vec<u32>, String>>();
                let corners = corners.map_err(fail)?;
                if corners.len() < 3 {
                    return Err(fail("a face needs three vertices".to_string()));
                }
                for k in 2..corners.len() {
                    faces.push([corners[0], corners[k - 1], corners[k]]);
                    lines.push(index + 1);
                }
            }
            _ => {}
        }
    }
    Surface::from_triangles(positions, faces).map_err(|error| {
        let line = if error.message.starts_with("a face") { lines[error.index] } else { 0 };
        (line, error.to_string())
    })
}

/// Vertex index of a face corner `v`, `v/t` or `v/t/n`, counted from 1, or backwards from -1.
fn corner(word: &str, count: usize) -> Result<u32, String> {
    let number = word.split('/').next().unwrap_or(word);
    let value: i64 = number.parse().map_err(|_| format!("'{word}' is not a vertex"))?;
    let index = if value < 0 { value + count as i64 } else { value - 1 };
    u32::try_from(index).map_err(|_| format!("'{word}' is not a vertex"))
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
