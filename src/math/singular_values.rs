//! Eigenvectors of symmetric 3x3 matrices and singular values with rotations, for polar decompositions.

use super::vector::{
    IDENTITY, Mat3, Vec3, add_scaled, cross, determinant, dot, mat_mul, mat_vec, norm_squared, scale, transpose, unit,
};

/// Sweeps of the Jacobi iteration; each squares what is off the diagonal, so four or five do.
const SWEEPS: usize = 12;

/// A vector whose length has fallen to this share of the longest has no direction of its own.
const DEGENERATE: f64 = 1e-10;

/// Eigenvalues, descending, and eigenvectors (the columns of a rotation) of a symmetric matrix, by cyclic Jacobi
/// rotations [Golub96, §8.4]. Orthonormal to rounding whatever the matrix.
pub fn symmetric_eigenvectors(m: &Mat3) -> (Vec3, Mat3) {
    let mut a = *m;
    let mut v = IDENTITY;
    for _ in 0..SWEEPS {
        if a[0][1] == 0.0 && a[0][2] == 0.0 && a[1][2] == 0.0 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let values = [a[0][0], a[1][1], a[2][2]];
    let mut order = [0, 1, 2];
    order.sort_by(|i, j| values[*j].total_cmp(&values[*i]));
    let mut columns = transpose(&v);
    columns = order.map(|i| columns[i]);
    if determinant(&columns) < 0.0 {
        columns[2] = scale(-1.0, columns[2]);
    }
    (order.map(|i| values[i]), transpose(&columns))
}

/// One Jacobi rotation that clears entry `(p, q)`.
fn rotate(a: &mut Mat3, v: &mut Mat3, p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t =
        if theta.abs() > 1e150 { 0.5 / theta } else { theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt()) };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for k in 0..3 {
        let (x, y) = (a[k][p], a[k][q]);
        (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..3 {
        let (x, y) = (a[p][k], a[q][k]);
        (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
    }
    (a[p][q], a[q][p]) = (0.0, 0.0);
    for row in v.iter_mut() {
        let (x, y) = (row[p], row[q]);
        (row[p], row[q]) = (c * x - s * y, s * x + c * y);
    }
}

/// `F = U diag(sigma) V^T` with rotations `U` and `V`: `sigma[0] >= sigma[1] >= |sigma[2]|`, the last one negative where
/// `F` inverts [Irving04, inversion].
#[derive(Clone, Copy, Debug)]
pub struct SignedSingularValues {
    /// Left rotation.
    pub u: Mat3,
    /// Singular values, the last one signed.
    pub sigma: Vec3,
    /// Right rotation.
    pub v: Mat3,
}

impl SignedSingularValues {
    /// Of any finite matrix: where singular values vanish, the directions left free are a fixed choice.
    pub fn new(f: &Mat3) -> SignedSingularValues {
        let (_, v) = symmetric_eigenvectors(&mat_mul(&transpose(f), f));
        let [v0, v1, v2] = transpose(&v);
        let images = [mat_vec(f, v0), mat_vec(f, v1), mat_vec(f, v2)];
        let u0 = unit(images[0]).unwrap_or(v0);
        let across = add_scaled(images[1], -dot(u0, images[1]), u0);
        let least = DEGENERATE * DEGENERATE * norm_squared(images[0]);
        let u1 = unit(across).filter(|_| norm_squared(across) > least);
        let u1 = u1.unwrap_or_else(|| closest_across(u0, v1, v2));
        // Once more, so that rounding in a short vector does not tilt the frame.
        let u1 = unit(add_scaled(u1, -dot(u0, u1), u0)).unwrap_or(u1);
        let u2 = cross(u0, u1);
        let sigma = [dot(u0, images[0]), dot(u1, images[1]), dot(u2, images[2])];
        SignedSingularValues { u: transpose(&[u0, u1, u2]), sigma, v }
    }

    /// The rotation `R = U V^T` of the polar decomposition `F = R S`, the closest rotation to `F`.
    pub fn rotation(&self) -> Mat3 {
        mat_mul(&self.u, &transpose(&self.v))
    }
}

/// The unit vector across `n` that is closest to `wanted`, or to `other` where that is nearly along `n`; the two are
/// orthonormal.
fn closest_across(n: Vec3, wanted: Vec3, other: Vec3) -> Vec3 {
    let across = |v: Vec3| add_scaled(v, -dot(n, v), n);
    let chosen = if norm_squared(across(wanted)) > 0.25 { across(wanted) } else { across(other) };
    unit(chosen).unwrap_or(other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::math::{ZERO_MATRIX, mat_add, mat_scale};

    fn largest_difference(a: &Mat3, b: &Mat3) -> f64 {
        mat_add(a, &mat_scale(-1.0, b)).iter().flatten().fold(0.0, |m, x| m.max(x.abs()))
    }

    fn check(f: &Mat3) {
        let s = SignedSingularValues::new(f);
        let size = s.sigma[0].abs().max(f64::MIN_POSITIVE);
        let diagonal = [[s.sigma[0], 0.0, 0.0], [0.0, s.sigma[1], 0.0], [0.0, 0.0, s.sigma[2]]];
        let product = mat_mul(&mat_mul(&s.u, &diagonal), &transpose(&s.v));
        assert!(largest_difference(&product, f) < 1e-7 * size, "{f:?} {product:?}");
        for r in [&s.u, &s.v] {
            assert!(largest_difference(&mat_mul(r, &transpose(r)), &IDENTITY) < 1e-14);
            assert!(determinant(r) > 0.99);
        }
        assert!(s.sigma[0] >= 0.0 && s.sigma[1] >= -1e-9 * size && s.sigma[0] * (1.0 + 1e-9) >= s.sigma[1]);
        assert!(s.sigma[2] * determinant(f) >= -1e-12 * size.powi(4), "the sign is that of the determinant");
    }

    #[test]
    fn rotations_times_signed_values_give_the_matrix_back() {
        let mut random = Random(1);
        let mut next = || random.signed();
        for case in 0..400 {
            let mut f: Mat3 = std::array::from_fn(|_| std::array::from_fn(|_| next()));
            if case % 4 == 1 {
                f[2] = add_scaled(f[0], next(), f[1]); // flat
            }
            if case % 4 == 2 {
                f = std::array::from_fn(|i| scale(next() + i as f64, [0.3, -0.4, 1.0])); // a line
            }
            if case % 4 == 3 {
                f = mat_scale(1e-120, &f);
            }
            check(&f);
        }
        check(&IDENTITY);
        check(&mat_scale(-1.0, &IDENTITY));
        check(&ZERO_MATRIX);
        check(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]);
    }
}
