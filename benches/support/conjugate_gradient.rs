//! Preconditioned conjugate gradients, on any operator.

use signorini::linalg::BlockMatrix;
use signorini::math::{Mat3, Vec3, add_scaled, dot, inverse, mat_vec, sub};
use signorini::parallel::Par;

/// Inner product.
pub fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| dot(*a, *b)).sum()
}

/// Inverses of the diagonal blocks.
pub fn inverse_diagonal(a: &BlockMatrix) -> Vec<Mat3> {
    a.diagonal.iter().map(|&k| inverse(&a.values[k]).unwrap_or([[0.0; 3]; 3])).collect()
}

/// Solves `apply(x) = b` from the start `x` until the preconditioned residual has shrunk by `tolerance` (or `limit`
/// iterations); returns the iterations done.
pub fn solve_operator(
    apply: impl Fn(&[Vec3], &mut [Vec3]),
    precondition: &[Mat3],
    b: &[Vec3],
    x: &mut [Vec3],
    tolerance: f64,
    limit: usize,
) -> usize {
    let n = b.len();
    let mut ax = vec![[0.0; 3]; n];
    apply(x, &mut ax);
    let mut r: Vec<Vec3> = (0..n).map(|i| sub(b[i], ax[i])).collect();
    let mut z: Vec<Vec3> = (0..n).map(|i| mat_vec(&precondition[i], r[i])).collect();
    let scale: f64 = (0..n).map(|i| dot(b[i], mat_vec(&precondition[i], b[i]))).sum();
    let mut p = z.clone();
    let mut rz = inner(&r, &z);
    for iteration in 0..limit {
        if rz <= tolerance * tolerance * scale {
            return iteration;
        }
        apply(&p, &mut ax);
        let step = rz / inner(&p, &ax);
        for i in 0..n {
            x[i] = add_scaled(x[i], step, p[i]);
            r[i] = add_scaled(r[i], -step, ax[i]);
            z[i] = mat_vec(&precondition[i], r[i]);
        }
        let next = inner(&r, &z);
        for i in 0..n {
            p[i] = add_scaled(z[i], next / rz, p[i]);
        }
        rz = next;
    }
    limit
}

/// Solves `a x = b` with the inverse diagonal blocks as preconditioner.
pub fn solve(a: &BlockMatrix, b: &[Vec3], x: &mut [Vec3], tolerance: f64) -> usize {
    let apply = |x: &[Vec3], y: &mut [Vec3]| a.product(x, y, Par::Serial);
    solve_operator(apply, &inverse_diagonal(a), b, x, tolerance, 20_000)
}
