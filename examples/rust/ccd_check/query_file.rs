//! Query files: 16 bytes of header, then 216 bytes a query; little-endian.
//!
//! Header: `CCDQ0001`, u32 kind (0 vertex-face, 1 edge-edge), u32 number of queries. Query: 24 f64 (eight points: four
//! at the start, four at the end), `toi_lo`, `toi_hi`, then eight bytes: published label, exact answer, flags, zeros.

use std::path::Path;

type Points = [[f64; 3]; 4];

/// One query with its exact answer.
pub struct Query {
    pub x0: Points,
    pub x1: Points,
    /// The double at or below the exact time of contact; NaN without contact.
    pub toi_lo: f64,
    pub hit: bool,
}

pub struct QueryFile {
    pub edge_edge: bool,
    pub queries: Vec<Query>,
}

const HEADER: usize = 16;
const RECORD: usize = 216;

fn number(bytes: &[u8], at: usize) -> f64 {
    let mut b = [0; 8];
    b.copy_from_slice(&bytes[at..at + 8]);
    f64::from_le_bytes(b)
}

fn count(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Reads a file; errors name the file and the byte offset.
pub fn read(path: &Path) -> Result<QueryFile, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    parse(&bytes).map_err(|(offset, what)| format!("{}: at byte {offset}: {what}", path.display()))
}

fn parse(bytes: &[u8]) -> Result<QueryFile, (usize, String)> {
    if bytes.len() < HEADER {
        return Err((bytes.len(), format!("header ends early, {HEADER} bytes wanted")));
    }
    if &bytes[..8] != b"CCDQ0001" {
        return Err((0, "not a query file: it must begin with CCDQ0001".into()));
    }
    let kind = count(bytes, 8);
    if kind > 1 {
        return Err((8, format!("kind is {kind}, must be 0 (vertex-face) or 1 (edge-edge)")));
    }
    let queries = count(bytes, 12) as usize;
    let wanted = HEADER + RECORD * queries;
    if bytes.len() != wanted {
        let offset = bytes.len().min(wanted);
        return Err((offset, format!("{queries} queries need {wanted} bytes, the file has {}", bytes.len())));
    }
    let queries = (0..queries).map(|i| parse_query(bytes, HEADER + RECORD * i)).collect::<Result<_, _>>()?;
    Ok(QueryFile { edge_edge: kind == 1, queries })
}

fn parse_query(bytes: &[u8], at: usize) -> Result<Query, (usize, String)> {
    let points = |start: usize| -> Points {
        std::array::from_fn(|i| std::array::from_fn(|c| number(bytes, start + 8 * (3 * i + c))))
    };
    if let Some(k) = (0..24).find(|k| !number(bytes, at + 8 * k).is_finite()) {
        return Err((at + 8 * k, "a coordinate is not finite".into()));
    }
    let (toi_lo, exact) = (number(bytes, at + 192), bytes[at + 209]);
    if exact > 1 {
        return Err((at + 209, format!("the exact answer is {exact}, must be 0 or 1")));
    }
    if (exact == 1) != (0.0..=1.0).contains(&toi_lo) {
        return Err((at + 192, format!("time {toi_lo} does not go with the answer {exact}")));
    }
    Ok(Query { x0: points(at), x1: points(at + 96), toi_lo, hit: exact == 1 })
}
