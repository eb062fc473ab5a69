//! Arrays as numpy writes them: version 1, C order, f64 or i32.

use std::path::Path;

/// The numbers of an array; integers as f64, which holds every i32.
pub fn read(path: &Path) -> Result<Vec<f64>, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let fail = |what: &str| format!("{}: {what}", path.display());
    if bytes.len() < 10 || &bytes[..8] != b"\x93NUMPY\x01\x00" {
        return Err(fail("not an array file of version 1"));
    }
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = String::from_utf8_lossy(bytes.get(10..start).ok_or_else(|| fail("header ends early"))?).into_owned();
    if !header.contains("'fortran_order': False") {
        return Err(fail("not in C order"));
    }
    let body = &bytes[start..];
    if header.contains("'<f8'") {
        Ok(body.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|k| b[k]))).collect())
    } else if header.contains("'<i4'") {
        Ok(body.chunks_exact(4).map(|b| f64::from(i32::from_le_bytes(std::array::from_fn(|k| b[k])))).collect())
    } else {
        Err(fail("neither f64 nor i32"))
    }
}

/// Rows of three.
pub fn points(path: &Path) -> Result<Vec<[f64; 3]>, String> {
    Ok(read(path)?.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}
