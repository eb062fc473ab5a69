//! OBJ frames: one file a frame, one group a body, coordinates with all their digits.

use super::build::Scene;
use crate::math::Vec3;
use crate::world::WorldError;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// A surface with its name.
pub struct NamedSurface {
    pub name: String,
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// The surfaces of all bodies with triangles.
pub fn surfaces(scene: &Scene) -> Result<Vec<NamedSurface>, WorldError> {
    let bodies = scene.bodies.iter().filter(|body| !body.triangles.is_empty());
    bodies
        .map(|body| {
            let positions = scene.world.positions(body.id)?.to_vec();
            Ok(NamedSurface { name: body.name.clone(), positions, triangles: body.triangles.clone() })
        })
        .collect()
}

/// Writes surfaces, one `o` each; a number is the shortest text that reads back as the same double. Cost: linear.
pub fn write_obj(surfaces: &[NamedSurface], path: &Path) -> io::Result<()> {
    let mut text = String::new();
    let mut first = 1;
    for surface in surfaces {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "o {}", surface.name);
        for [x, y, z] in &surface.positions {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for face in &surface.triangles {
            let [a, b, c] = face.map(|v| v as usize + first);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        first += surface.positions.len();
    }
    write_whole(path, text.as_bytes())
}

/// Writes beside and renames, so that nobody sees half a file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let beside = path.with_extension("part");
    std::fs::write(&beside, bytes)?;
    std::fs::rename(&beside, path)
}
