//! Meshes of whole steps.

use std::path::Path;

pub struct Mesh {
    pub points: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
}

fn line(bytes: &[u8], at: &mut usize) -> Option<String> {
    let length = bytes[*at..].iter().position(|b| *b == b'\n')?;
    let text = String::from_utf8_lossy(&bytes[*at..*at + length]).trim().to_owned();
    *at += length + 1;
    Some(text)
}

/// Binary little-endian PLY with double coordinates and triangles (`uchar` count, `int` or `uint` indices).
pub fn read_ply(path: &Path) -> Result<Mesh, String> {
    let fail = |at: usize, what: &str| format!("{}: at byte {at}: {what}", path.display());
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (mut at, mut vertices, mut faces, mut little_endian) = (0, 0_usize, 0_usize, false);
    loop {
        let text = line(&bytes, &mut at).ok_or_else(|| fail(at, "header does not end"))?;
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            ["format", "binary_little_endian", ..] => little_endian = true,
            ["element", "vertex", n] => vertices = n.parse().map_err(|_| fail(at, "bad vertex count"))?,
            ["element", "face", n] => faces = n.parse().map_err(|_| fail(at, "bad face count"))?,
            ["property", "float", _] => return Err(fail(at, "coordinates must be double")),
            ["end_header"] => break,
            _ => {}
        }
    }
    if !little_endian || bytes.len() != at + 24 * vertices + 13 * faces {
        return Err(fail(at, "not a little-endian PLY of double coordinates and triangles of the stated size"));
    }
    let number = |i: usize| f64::from_le_bytes(std::array::from_fn(|k| bytes[i + k]));
    let index = |i: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[i + k]));
    let points = (0..vertices).map(|i| std::array::from_fn(|c| number(at + 24 * i + 8 * c))).collect();
    let start = at + 24 * vertices;
    let faces: Vec<[u32; 3]> = (0..faces).map(|i| std::array::from_fn(|c| index(start + 13 * i + 1 + 4 * c))).collect();
    if let Some(i) = faces.iter().position(|f| f.iter().any(|v| *v as usize >= vertices)) {
        return Err(fail(start + 13 * i, "face with a vertex that is not there"));
    }
    Ok(Mesh { points, faces })
}
