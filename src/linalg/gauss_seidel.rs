//! Block Gauss-Seidel relaxation.

use super::BlockMatrix;
use crate::math::{Mat3, Vec3, mat_vec, sub};

/// One forward sweep of `A x = b` over the block rows in order: `(D - L) x' = U x + b` [Otaduy09, Eq. 12]. Rows whose
/// `inverse_diagonal` is zero end at zero. Cost: one pass over the blocks; serial, since each row needs those before.
pub fn gauss_seidel_sweep(matrix: &BlockMatrix, inverse_diagonal: &[Mat3], b: &[Vec3], x: &mut [Vec3]) {
    for i in 0..matrix.rows() {
        let mut r = b[i];
        for k in matrix.row_offsets[i]..matrix.row_offsets[i + 1] {
            if k != matrix.diagonal[i] {
                r = sub(r, mat_vec(&matrix.values[k], x[matrix.columns[k] as usize]));
            }
        }
        x[i] = mat_vec(&inverse_diagonal[i], r);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, scale};
    use crate::parallel::Par;

    #[test]
    fn sweeps_converge_to_the_solution() {
        // A chain: 2.5 on the diagonal, -1 to the neighbours.
        let n = 30;
        let mut a = BlockMatrix { row_offsets: vec![0], ..BlockMatrix::default() };
        let block = |s: f64| [[s, 0.1 * s, 0.0], [0.1 * s, s, 0.0], [0.0, 0.0, s]];
        for i in 0..n {
            for j in i.max(1) - 1..(i + 2).min(n) {
                if i == j {
                    a.diagonal.push(a.columns.len());
                }
                a.columns.push(j as u32);
                a.values.push(block(if i == j { 2.5 } else { -1.0 }));
            }
            a.row_offsets.push(a.columns.len());
        }
        let x: Vec<Vec3> = (0..n).map(|i| scale((i as f64).sin(), [1.0, -2.0, 0.5])).collect();
        let (mut b, mut y) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
        a.product(&x, &mut b, Par::Serial);
        let inverse: Vec<Mat3> = (0..n).map(|i| crate::math::inverse(a.diagonal_block(i)).unwrap()).collect();
        for _ in 0..100 {
            gauss_seidel_sweep(&a, &inverse, &b, &mut y);
        }
        assert!((0..n).all(|i| norm(sub(x[i], y[i])) < 1e-12));
    }
}
