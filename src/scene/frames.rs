//! OBJ frames: one file a frame, one group a body, coordinates with all their digits.

use super::build::Scene;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// Writes the surfaces of all bodies with triangles, one `o` each; a number is the shortest text that reads back as the
/// same double. Cost: linear.
pub fn write_obj(scene: &Scene, path: &Path) -> io::Result<()> {
    let mut text = String::new();
    let mut first = 1;
    for body in scene.bodies.iter().filter(|body| !body.triangles.is_empty()) {
        let positions = scene.world.positions(body.id).map_err(|e| io::Error::other(e.message))?;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "o {}", body.name);
        for [x, y, z] in positions {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for face in &body.triangles {
            let [a, b, c] = face.map(|v| v as usize + first);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        first += positions.len();
    }
    write_whole(path, text.as_bytes())
}

/// Writes beside and renames, so that nobody sees half a file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let beside = path.with_extension("part");
    std::fs::write(&beside, bytes)?;
    std::fs::rename(&beside, path)
}
