//! Incomplete block Cholesky factor without fill, in single precision: a preconditioner [Meijerink77].

use super::BlockMatrix;
use crate::math::{Mat3, Vec3, mat_add, mat_mul, mat_scale, transpose};

/// Relative shifts of the diagonal tried in turn; then the factor does not exist as far as we care.
const SHIFTS: [f64; 3] = [0.0, 0.02, 0.2];

type Single3 = [[f32; 3]; 3];

/// `L L^T ~ A` on the pattern of A's lower triangle; diagonal blocks hold inverses.
#[derive(Clone, Debug, Default)]
pub struct IncompleteCholesky {
    row_offsets: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<Single3>,
    inverse_diagonal: Vec<Single3>,
    /// The factor is that of `A / scale`.
    scale: f64,
}

impl IncompleteCholesky {
    /// Factor of `matrix + blockdiag(extra)`; rows whose diagonal block is not used (`fixed`) act as zero.
    ///
    /// `None` where pivots stay indefinite under the largest shift. Cost: the blocks times the blocks of a row.
    pub fn new(matrix: &BlockMatrix, extra: &[Mat3], fixed: impl Fn(usize) -> bool) -> Option<IncompleteCholesky> {
        SHIFTS.iter().find_map(|shift| Self::with_shift(matrix, extra, &fixed, *shift))
    }

    fn with_shift(
        matrix: &BlockMatrix,
        extra: &[Mat3],
        fixed: &impl Fn(usize) -> bool,
        shift: f64,
    ) -> Option<IncompleteCholesky> {
        let n = matrix.rows();
        let scale = (0..n).filter(|i| !fixed(*i)).map(|i| trace(matrix.diagonal_block(i))).fold(0.0, f64::max);
        if !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let lower = matrix.diagonal.iter().zip(&matrix.row_offsets).map(|(d, o)| d - o).sum::<usize>();
        let mut factor =
            Factor { offsets: vec![0], columns: Vec::with_capacity(lower), values: Vec::with_capacity(lower) };
        let mut inverse: Vec<Mat3> = Vec::with_capacity(n);
        for i in 0..n {
            let start = matrix.row_offsets[i];
            let mut pivot = mat_scale((1.0 + shift) / scale, matrix.diagonal_block(i));
            if let Some(e) = extra.get(i) {
                pivot = mat_add(&pivot, &mat_scale(1.0 / scale, e));
            }
            if !fixed(i) {
                for k in start..matrix.diagonal[i] {
                    let j = matrix.columns[k] as usize;
                    if fixed(j) {
                        continue;
                    }
                    let block = factor.eliminate(i, j, &mat_scale(1.0 / scale, &matrix.values[k]), &inverse[j]);
                    pivot = mat_add(&pivot, &mat_scale(-1.0, &mat_mul(&block, &transpose(&block))));
                    factor.columns.push(j as u32);
                    factor.values.push(block);
                }
            }
            factor.offsets.push(factor.columns.len());
            // A pivot that lost nearly all of its block is as bad as a negative one: the factor grows.
            let least = 1e-4 * trace(matrix.diagonal_block(i)) / scale;
            inverse.push(if fixed(i) { [[0.0; 3]; 3] } else { inverse_factor(&pivot, least)? });
        }
        Some(IncompleteCholesky {
            row_offsets: factor.offsets.iter().map(|o| *o as u32).collect(),
            columns: factor.columns,
            values: factor.values.iter().map(single).collect(),
            inverse_diagonal: inverse.iter().map(single).collect(),
            scale,
        })
    }

    /// `out = (L L^T)^-1 r`. Cost: two passes over half the blocks.
    pub fn apply(&self, r: &[Vec3], out: &mut [Vec3], buffer: &mut Vec<[f32; 3]>) {
        let n = self.inverse_diagonal.len();
        let largest = r.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
        if largest == 0.0 || !largest.is_finite() {
            out.copy_from_slice(r);
            return;
        }
        let down = 1.0 / largest;
        buffer.clear();
        buffer.extend(r.iter().map(|v| [(down * v[0]) as f32, (down * v[1]) as f32, (down * v[2]) as f32]));
        let y = buffer.as_mut_slice();
        for i in 0..n {
            let mut t = y[i];
            for k in self.row_offsets[i] as usize..self.row_offsets[i + 1] as usize {
                let (m, x) = (&self.values[k], y[self.columns[k] as usize]);
                for c in 0..3 {
                    t[c] -= m[c][0] * x[0] + m[c][1] * x[1] + m[c][2] * x[2];
                }
            }
            y[i] = times(&self.inverse_diagonal[i], t);
        }
        for i in (0..n).rev() {
            let x = times_transposed(&self.inverse_diagonal[i], y[i]);
            y[i] = x;
            for k in self.row_offsets[i] as usize..self.row_offsets[i + 1] as usize {
                let (m, t) = (&self.values[k], &mut y[self.columns[k] as usize]);
                for c in 0..3 {
                    t[c] -= m[0][c] * x[0] + m[1][c] * x[1] + m[2][c] * x[2];
                }
            }
        }
        let up = largest / self.scale;
        for (o, y) in out.iter_mut().zip(y) {
            *o = [up * f64::from(y[0]), up * f64::from(y[1]), up * f64::from(y[2])];
        }
    }

    /// Blocks below the diagonal.
    pub fn entries(&self) -> usize {
        self.values.len()
    }
}

/// Rows of the factor below the diagonal, while it is made.
struct Factor {
    offsets: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<Mat3>,
}

impl Factor {
    /// `L_ij = (A_ij - sum_k L_ik L_jk^T) L_jj^-T`; row i holds its entries before column j.
    fn eliminate(&self, i: usize, j: usize, a: &Mat3, inverse: &Mat3) -> Mat3 {
        let mut block = *a;
        let (mut p, mut q) = (self.offsets[i], self.offsets[j]);
        let (p_end, q_end) = (self.columns.len(), self.offsets[j + 1]);
        while p < p_end && q < q_end {
            match self.columns[p].cmp(&self.columns[q]) {
                std::cmp::Ordering::Less => p += 1,
                std::cmp::Ordering::Greater => q += 1,
                std::cmp::Ordering::Equal => {
                    let product = mat_mul(&self.values[p], &transpose(&self.values[q]));
                    block = mat_add(&block, &mat_scale(-1.0, &product));
                    (p, q) = (p + 1, q + 1);
                }
            }
        }
        mat_mul(&block, &transpose(inverse))
    }
}

fn trace(m: &Mat3) -> f64 {
    m[0][0] + m[1][1] + m[2][2]
}

/// Inverse of the lower Cholesky factor of `m`, or `None` where a pivot is not above `least`.
fn inverse_factor(m: &Mat3, least: f64) -> Option<Mat3> {
    let positive = |x: f64| (x > least).then(|| x.sqrt());
    let a = positive(m[0][0])?;
    let (b, c) = (m[1][0] / a, m[2][0] / a);
    let d = positive(m[1][1] - b * b)?;
    let e = (m[2][1] - c * b) / d;
    let f = positive(m[2][2] - c * c - e * e)?;
    let (ia, id, ifl) = (1.0 / a, 1.0 / d, 1.0 / f);
    let ib = -b * ia * id;
    Some([[ia, 0.0, 0.0], [ib, id, 0.0], [-(c * ia + e * ib) * ifl, -e * id * ifl, ifl]])
}

fn single(m: &Mat3) -> Single3 {
    m.map(|row| row.map(|x| x as f32))
}

#[inline(always)]
fn times(m: &Single3, x: [f32; 3]) -> [f32; 3] {
    m.map(|r| r[0] * x[0] + r[1] * x[1] + r[2] * x[2])
}

#[inline(always)]
fn times_transposed(m: &Single3, x: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| m[0][c] * x[0] + m[1][c] * x[1] + m[2][c] * x[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, sub};
    use crate::parallel::Par;

    fn chain(n: usize, off: f64) -> BlockMatrix {
        let mut a = BlockMatrix { row_offsets: vec![0], ..BlockMatrix::default() };
        for i in 0..n {
            for j in i.max(1) - 1..(i + 2).min(n) {
                if i == j {
                    a.diagonal.push(a.columns.len());
                }
                let s = if i == j { 2.0 } else { off };
                a.columns.push(j as u32);
                a.values.push([[s, 0.2 * s, 0.0], [0.2 * s, s, 0.0], [0.0, 0.0, 3.0 * s]]);
            }
            a.row_offsets.push(a.columns.len());
        }
        a
    }

    #[test]
    fn a_chain_has_no_fill_so_the_factor_is_exact() {
        let a = chain(40, -0.9);
        let factor = IncompleteCholesky::new(&a, &[], |_| false).unwrap();
        let x: Vec<Vec3> = (0..40).map(|i| [(i as f64).cos(), 1.0, 0.1 * i as f64]).collect();
        let (mut b, mut y) = (vec![[0.0; 3]; 40], vec![[0.0; 3]; 40]);
        a.product(&x, &mut b, Par::Serial);
        factor.apply(&b, &mut y, &mut Vec::new());
        assert!((0..40).all(|i| norm(sub(x[i], y[i])) < 1e-4), "{y:?}");
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        assert!(IncompleteCholesky::new(&chain(40, -2.0), &[], |_| false).is_none());
    }
}
