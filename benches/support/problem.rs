//! A contact problem as a value: assembled from close pairs, written to and read from little-endian files.
//!
//! File layout, all little-endian: `SGNP`, then `u32` version 1, then six `u64` counts: block rows n, blocks z,
//! contacts m, linear entries e, angular entries a, warm (0 or 1). Then, without padding:
//!
//! | data | type | count |
//! |---|---|---|
//! | row offsets | u64 | n + 1 |
//! | columns | u32 | z |
//! | blocks, row major | f64 | 9 z |
//! | unconstrained velocities v* `[m/s]` | f64 | 3 n |
//! | contact offsets | u32 | m + 1 |
//! | blocks of the linear entries | u32 | e |
//! | signed weights of the linear entries | f64 | e |
//! | angular offsets | u32 | m + 1 |
//! | blocks of the angular entries | u32 | a |
//! | weighted levers of the angular entries `[m]` | f64 | 3 a |
//! | frames n, t1, t2 | f64 | 9 m |
//! | normal targets c, in J dv >= c `[m/s]` | f64 | m |
//! | sliding velocities H v* `[m/s]` | f64 | 2 m |
//! | friction coefficients | f64 | m |
//! | if warm: start impulses (lambda, gamma1, gamma2) | f64 | 3 m |
//! | if warm: start dv | f64 | 3 n |

use super::conjugate_gradient::inverse_diagonal;
use super::nearby::Pair;
use signorini::constraint::{Angular, RowSet};
use signorini::implicit_contact::ContactProblem;
use signorini::linalg::BlockMatrix;
use signorini::math::{Mat3, Vec3, add_scaled, cross, dot, norm, scale, tangents, unit};
use std::io::{Error, ErrorKind, Read, Result, Write};

/// Everything a solver needs, owned.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    pub matrix: BlockMatrix,
    /// Inverse of the diagonal blocks, derived.
    pub inverse_diagonal: Vec<Mat3>,
    /// Unconstrained velocities v* `[m/s]`.
    pub velocities: Vec<Vec3>,
    pub rows: RowSet,
    /// Start values of the multipliers and of dv, where recorded.
    pub warm: Option<(Vec<Vec3>, Vec<Vec3>)>,
}

/// What makes rows of pairs.
#[derive(Clone, Copy, Debug)]
pub struct RowChoice {
    /// Pair thickness `[m]`; the offset is the smaller of it and the distance.
    pub thickness: f64,
    /// Friction coefficient.
    pub friction: f64,
    /// Step `[s]`.
    pub dt: f64,
}

impl Problem {
    /// The problem of `pairs` over a system; pairs name vertices, and vertices from `matrix.rows()` on do not move.
    pub fn new(matrix: BlockMatrix, velocities: Vec<Vec3>, pairs: &[Pair], choice: RowChoice) -> Problem {
        let mut rows = RowSet { offsets: vec![0], angular_offsets: vec![0], ..RowSet::default() };
        for pair in pairs {
            for (v, w) in pair.vertices.iter().zip(pair.weights) {
                if (*v as usize) < velocities.len() && w != 0.0 {
                    rows.blocks.push(*v);
                    rows.weights.push(w);
                }
            }
            rows.offsets.push(rows.blocks.len() as u32);
            rows.angular_offsets.push(0);
            let i = rows.frames.len();
            rows.frames.push([pair.normal; 3]);
            let u = rows.relative_velocity(i, &velocities);
            let along = dot(pair.normal, u);
            let sliding = add_scaled(u, -along, pair.normal);
            // A sliding velocity that is only rounding has no direction.
            let clear = norm(sliding) > 1e-12 * norm(u);
            let t1 = if clear { unit(sliding) } else { None }.unwrap_or(tangents(pair.normal).0);
            let t2 = cross(pair.normal, t1);
            rows.frames[i] = [pair.normal, t1, t2];
            let offset = choice.thickness.min(pair.distance);
            rows.normal_targets.push((offset - pair.distance) / choice.dt - along);
            rows.sliding_velocities.push([dot(t1, u), dot(t2, u)]);
            rows.friction.push(choice.friction);
        }
        let inverse_diagonal = inverse_diagonal(&matrix);
        Problem { matrix, inverse_diagonal, velocities, rows, warm: None }
    }

    /// The largest of `|v*|` `[m/s]`.
    pub fn velocity_scale(&self) -> f64 {
        self.velocities.iter().map(|v| norm(*v)).fold(0.0, f64::max)
    }

    /// As the solvers take it.
    pub fn view(&self) -> ContactProblem<'_> {
        ContactProblem {
            matrix: &self.matrix,
            inverse_diagonal: &self.inverse_diagonal,
            rows: &self.rows,
            translations: None,
            velocity_scale: self.velocity_scale(),
        }
    }

    /// Reads a file.
    pub fn load(path: &std::path::Path) -> Result<Problem> {
        Self::read(&mut std::io::BufReader::new(std::fs::File::open(path)?))
    }

    /// Writes a file.
    pub fn save(&self, path: &std::path::Path) -> Result<()> {
        self.write(&mut std::io::BufWriter::new(std::fs::File::create(path)?))
    }

    /// Reads the layout of this module's page.
    pub fn read(input: &mut impl Read) -> Result<Problem> {
        let bad = |what: &str| Error::new(ErrorKind::InvalidData, what.to_string());
        let mut magic = [0u8; 4];
        input.read_exact(&mut magic)?;
        if &magic != b"SGNP" || read_u32(input, 1)? != [1] {
            return Err(bad("not a version 1 problem file"));
        }
        let counts = read_u64(input, 6)?;
        let [n, z, m, e, a] = [0, 1, 2, 3, 4].map(|i| counts[i] as usize);
        let row_offsets: Vec<usize> = read_u64(input, n + 1)?.into_iter().map(|v| v as usize).collect();
        let columns = read_u32(input, z)?;
        let values = read_vectors(input, 3 * z)?.chunks_exact(3).map(|r| [r[0], r[1], r[2]]).collect();
        let mut diagonal = Vec::with_capacity(n);
        for i in 0..n {
            let row = columns.get(row_offsets[i]..row_offsets[i + 1]).ok_or_else(|| bad("row offsets"))?;
            let k = row.binary_search(&(i as u32)).map_err(|_| bad("a diagonal block is missing"))?;
            diagonal.push(row_offsets[i] + k);
        }
        let matrix = BlockMatrix { row_offsets, columns, values, diagonal };
        let velocities = read_vectors(input, n)?;
        let offsets = read_u32(input, m + 1)?;
        let blocks = read_u32(input, e)?;
        let weights = read_f64(input, e)?;
        let angular_offsets = read_u32(input, m + 1)?;
        let angular_blocks = read_u32(input, a)?;
        let levers = read_vectors(input, a)?;
        let angular = angular_blocks.into_iter().zip(levers).map(|(block, lever)| Angular { block, lever }).collect();
        let frames = read_vectors(input, 3 * m)?.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
        let normal_targets = read_f64(input, m)?;
        let sliding_velocities = read_f64(input, 2 * m)?.chunks_exact(2).map(|s| [s[0], s[1]]).collect();
        let friction = read_f64(input, m)?;
        let warm = if counts[5] == 1 { Some((read_vectors(input, m)?, read_vectors(input, n)?)) } else { None };
        let rows = RowSet {
            offsets,
            blocks,
            weights,
            angular_offsets,
            angular,
            frames,
            normal_targets,
            sliding_velocities,
            friction,
        };
        let inverse_diagonal = inverse_diagonal(&matrix);
        Ok(Problem { matrix, inverse_diagonal, velocities, rows, warm })
    }

    /// Writes the layout of this module's page.
    pub fn write(&self, out: &mut impl Write) -> Result<()> {
        let (a, rows) = (&self.matrix, &self.rows);
        out.write_all(b"SGNP")?;
        out.write_all(&1u32.to_le_bytes())?;
        let warm = usize::from(self.warm.is_some());
        for count in [a.rows(), a.columns.len(), rows.len(), rows.blocks.len(), rows.angular.len(), warm] {
            out.write_all(&(count as u64).to_le_bytes())?;
        }
        for offset in &a.row_offsets {
            out.write_all(&(*offset as u64).to_le_bytes())?;
        }
        write_u32(out, a.columns.iter())?;
        write_f64(out, a.values.iter().flatten().flatten())?;
        write_f64(out, self.velocities.iter().flatten())?;
        write_u32(out, rows.offsets.iter())?;
        write_u32(out, rows.blocks.iter())?;
        write_f64(out, rows.weights.iter())?;
        write_u32(out, rows.angular_offsets.iter())?;
        write_u32(out, rows.angular.iter().map(|g| &g.block))?;
        write_f64(out, rows.angular.iter().flat_map(|g| &g.lever))?;
        write_f64(out, rows.frames.iter().flatten().flatten())?;
        write_f64(out, rows.normal_targets.iter())?;
        write_f64(out, rows.sliding_velocities.iter().flatten())?;
        write_f64(out, rows.friction.iter())?;
        if let Some((impulses, dv)) = &self.warm {
            write_f64(out, impulses.iter().flatten())?;
            write_f64(out, dv.iter().flatten())?;
        }
        out.flush()
    }
}

/// A pair of a vertex and the half-space `normal · x >= offset`, for vertices nearer than `range`.
pub fn half_space_pairs(x: &[Vec3], normal: Vec3, offset: f64, range: f64) -> Vec<Pair> {
    let near = |(v, p): (usize, &Vec3)| {
        let distance = dot(normal, *p) - offset;
        (distance < range).then_some(Pair {
            vertices: [v as u32, 0, 0, 0],
            weights: [1.0, 0.0, 0.0, 0.0],
            normal,
            distance,
        })
    };
    x.iter().enumerate().filter_map(near).collect()
}

/// `J dv - c` per contact and the sliding velocity `H (v* + dv)`: what the contact conditions are about.
pub fn contact_velocities(problem: &Problem, dv: &[Vec3]) -> Vec<Vec3> {
    let rows = &problem.rows;
    (0..rows.len())
        .map(|i| {
            let w = rows.velocity(i, dv);
            let h = rows.sliding_velocities[i];
            [w[0] - rows.normal_targets[i], w[1] + h[0], w[2] + h[1]]
        })
        .collect()
}

/// `C^T p`.
pub fn scattered(rows: &RowSet, impulses: &[Vec3], blocks: usize) -> Vec<Vec3> {
    let mut out = vec![[0.0; 3]; blocks];
    for (i, p) in impulses.iter().enumerate() {
        rows.scatter(i, rows.impulse(i, *p), &mut out);
    }
    out
}

fn read_bytes(input: &mut impl Read, count: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if input.take(count as u64).read_to_end(&mut bytes)? != count {
        return Err(Error::new(ErrorKind::UnexpectedEof, "the file is cut"));
    }
    Ok(bytes)
}

fn read_u32(input: &mut impl Read, count: usize) -> Result<Vec<u32>> {
    let bytes = read_bytes(input, 4 * count)?;
    Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

fn read_u64(input: &mut impl Read, count: usize) -> Result<Vec<u64>> {
    let halves = read_u32(input, 2 * count)?;
    Ok(halves.chunks_exact(2).map(|h| u64::from(h[0]) | u64::from(h[1]) << 32).collect())
}

fn read_f64(input: &mut impl Read, count: usize) -> Result<Vec<f64>> {
    Ok(read_u64(input, count)?.into_iter().map(f64::from_bits).collect())
}

fn read_vectors(input: &mut impl Read, count: usize) -> Result<Vec<Vec3>> {
    Ok(read_f64(input, 3 * count)?.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect())
}

fn write_u32<'a>(out: &mut impl Write, values: impl Iterator<Item = &'a u32>) -> Result<()> {
    values.into_iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
}

fn write_f64<'a>(out: &mut impl Write, values: impl Iterator<Item = &'a f64>) -> Result<()> {
    values.into_iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
}

/// `s a` for every entry: used to scale starts.
pub fn scaled(s: f64, a: &[Vec3]) -> Vec<Vec3> {
    a.iter().map(|v| scale(s, *v)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_give_back_every_bit() {
        let pair = |v, normal: Vec3, distance| Pair {
            vertices: [v, 1, 2, 7],
            weights: [1.0, -0.25, -0.25, -0.5],
            normal,
            distance,
        };
        let matrix = BlockMatrix::from_diagonal(&[[[2.0, 0.1, 0.0], [0.1, 3.0, 0.0], [0.0, 0.0, 4.0]]; 4]);
        let velocities = vec![[0.1, 0.2, -0.3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
        let choice = RowChoice { thickness: 0.002, friction: 0.3, dt: 0.004 };
        let pairs = [pair(0, [0.0, 0.0, 1.0], 0.001), pair(3, [0.6, 0.0, 0.8], 0.003)];
        let mut problem = Problem::new(matrix, velocities, &pairs, choice);
        problem.rows.angular.push(Angular { block: 2, lever: [0.5, 0.25, 0.125] });
        problem.rows.angular_offsets = vec![0, 0, 1];
        problem.warm = Some((vec![[1.0, 2.0, 3.0]; 2], vec![[4.0, 5.0, 6.0]; 4]));
        assert_eq!(problem.rows.offsets, [0, 3, 6]);
        // 1 mm apart: may not come nearer. 3 mm apart: may lose 1 mm in 4 ms.
        let along = [-0.3, 0.6 * -0.25 - 0.8];
        assert!((problem.rows.normal_targets[0] + along[0]).abs() < 1e-15);
        assert!((problem.rows.normal_targets[1] + along[1] + 0.25).abs() < 1e-15);
        let mut bytes = Vec::new();
        problem.write(&mut bytes).unwrap();
        let back = Problem::read(&mut bytes.as_slice()).unwrap();
        assert_eq!(format!("{problem:?}"), format!("{back:?}"));
        assert!(Problem::read(&mut &bytes[..bytes.len() - 1]).is_err());
        bytes[4] = 9;
        assert!(Problem::read(&mut bytes.as_slice()).is_err());
    }
}
