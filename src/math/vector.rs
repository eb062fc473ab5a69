//! Three-vectors and 3x3 matrices as plain arrays, so that positions are interleaved `[f64; 3]` everywhere.
//!
//! No fused multiply-add: every path gives the same bits.

/// A point, displacement, velocity, force or impulse.
pub type Vec3 = [f64; 3];
/// A 3x3 matrix, row major: `m[row][column]`.
pub type Mat3 = [[f64; 3]; 3];

/// The zero vector.
pub const ZERO: Vec3 = [0.0; 3];
/// The zero matrix.
pub const ZERO_MATRIX: Mat3 = [[0.0; 3]; 3];
/// The identity matrix.
pub const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// `a + b`
#[inline(always)]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`
#[inline(always)]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `s a`
#[inline(always)]
pub fn scale(s: f64, a: Vec3) -> Vec3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// `a + s b`
#[inline(always)]
pub fn add_scaled(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// `(1 - t) a + t b`, exact at both ends.
#[inline(always)]
pub fn lerp(a: Vec3, b: Vec3, t: f64) -> Vec3 {
    let s = 1.0 - t;
    [s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]]
}

/// `a · b`
#[inline(always)]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x b`
#[inline(always)]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `|a|^2`
#[inline(always)]
pub fn norm_squared(a: Vec3) -> f64 {
    dot(a, a)
}

/// `|a|`
#[inline(always)]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// `a / |a|`, or `None` where the length is zero or not finite.
#[inline]
pub fn unit(a: Vec3) -> Option<Vec3> {
    // Scaled first, so that neither very short nor very long vectors lose their direction.
    let largest = a[0].abs().max(a[1].abs()).max(a[2].abs());
    if largest == 0.0 || !largest.is_finite() {
        return None;
    }
    let a = [a[0] / largest, a[1] / largest, a[2] / largest];
    Some(scale(1.0 / norm(a), a))
}

/// Whether all three components are finite.
#[inline(always)]
pub fn is_finite(a: Vec3) -> bool {
    a[0].is_finite() && a[1].is_finite() && a[2].is_finite()
}

/// Two unit vectors that complete the unit vector `n` to a right-handed frame `(n, t1, t2)`; a fixed choice per `n`.
#[inline]
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let axis = if n[0].abs() <= n[1].abs() && n[0].abs() <= n[2].abs() {
        [1.0, 0.0, 0.0]
    } else if n[1].abs() <= n[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let t1 = add_scaled(axis, -dot(axis, n), n);
    let t1 = scale(1.0 / norm(t1), t1);
    (t1, cross(n, t1))
}

/// `m a`
#[inline(always)]
pub fn mat_vec(m: &Mat3, a: Vec3) -> Vec3 {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// `m^T a`
#[inline(always)]
pub fn mat_transpose_vec(m: &Mat3, a: Vec3) -> Vec3 {
    [
        m[0][0] * a[0] + m[1][0] * a[1] + m[2][0] * a[2],
        m[0][1] * a[0] + m[1][1] * a[1] + m[2][1] * a[2],
        m[0][2] * a[0] + m[1][2] * a[1] + m[2][2] * a[2],
    ]
}

/// `a b`
#[inline(always)]
pub fn mat_mul(a: &Mat3, b: &Mat3) -> Mat3 {
    let mut c = ZERO_MATRIX;
    for i in 0..3 {
        for j in 0..3 {
            c[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
        }
    }
    c
}

/// `m^T`
#[inline(always)]
pub fn transpose(m: &Mat3) -> Mat3 {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

/// `a + b`
#[inline(always)]
pub fn mat_add(a: &Mat3, b: &Mat3) -> Mat3 {
    [add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])]
}

/// `a b^T`
#[inline(always)]
pub fn outer(a: Vec3, b: Vec3) -> Mat3 {
    [scale(a[0], b), scale(a[1], b), scale(a[2], b)]
}

/// `s m`
#[inline(always)]
pub fn mat_scale(s: f64, m: &Mat3) -> Mat3 {
    [scale(s, m[0]), scale(s, m[1]), scale(s, m[2])]
}

/// The cross-product matrix: `skew(a) b = a x b`.
#[inline(always)]
pub fn skew(a: Vec3) -> Mat3 {
    [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]]
}

/// Determinant.
#[inline(always)]
pub fn determinant(m: &Mat3) -> f64 {
    dot(m[0], cross(m[1], m[2]))
}

/// Whether a symmetric matrix is positive definite, by its leading minors. It is scaled by its largest entry first, so
/// that products of very small or large entries neither vanish nor overflow.
pub fn is_positive_definite(m: &Mat3) -> bool {
    let size = power_of_size(m);
    let u = m.map(|row| scale_down(size, row));
    u[0][0] > 0.0 && u[0][0] * u[1][1] - u[0][1] * u[1][0] > 0.0 && determinant(&u) > 0.0
}

/// A power of two within a factor of two of the largest entry, so that scaling by it rounds nothing.
fn power_of_size(m: &Mat3) -> f64 {
    let largest = m.iter().flatten().fold(0.0, |l: f64, x| l.max(x.abs()));
    f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits()).max(f64::MIN_POSITIVE)
}

/// `v / by`; a reciprocal of a denormal would overflow.
fn scale_down(by: f64, v: Vec3) -> Vec3 {
    v.map(|x| x / by)
}

/// Inverse, or `None` where the matrix is singular or the result is not finite.
#[inline]
pub fn inverse(m: &Mat3) -> Option<Mat3> {
    let (out, determinant) = adjugate_by_determinant(m);
    if determinant.is_normal() && out.iter().all(|row| is_finite(*row)) { Some(out) } else { scaled_inverse(m) }
}

/// Inverse of a matrix whose determinant vanishes, overflows or loses digits by the size of its entries.
#[cold]
fn scaled_inverse(m: &Mat3) -> Option<Mat3> {
    let size = power_of_size(m);
    let (out, _) = adjugate_by_determinant(&m.map(|row| scale_down(size, row)));
    let out = out.map(|row| scale_down(size, row));
    out.iter().all(|row| is_finite(*row)).then_some(out)
}

#[inline]
fn adjugate_by_determinant(m: &Mat3) -> (Mat3, f64) {
    let (c0, c1, c2) = (cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    let determinant = dot(m[0], c0);
    let r = 1.0 / determinant;
    (transpose(&[scale(r, c0), scale(r, c1), scale(r, c2)]), determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_identity() {
        let m = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let p = mat_mul(&m, &inverse(&m).unwrap_or(ZERO_MATRIX));
        for i in 0..3 {
            for j in 0..3 {
                assert!((p[i][j] - IDENTITY[i][j]).abs() < 1e-14);
            }
        }
        assert!(inverse(&[[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 0.0, 1.0]]).is_none());
    }

    #[test]
    fn size_alone_makes_no_matrix_singular() {
        let m = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        for size in [1e-300, 1e-200, 1e-104, 1.0, 1e104, 1e200, 1e300] {
            let scaled = m.map(|row| scale(size, row));
            assert!(is_positive_definite(&scaled), "{size}");
            let p = mat_mul(&scaled, &inverse(&scaled).unwrap_or(ZERO_MATRIX));
            for i in 0..3 {
                for j in 0..3 {
                    assert!((p[i][j] - IDENTITY[i][j]).abs() < 1e-14, "{size}: {p:?}");
                }
            }
        }
        assert!(!is_positive_definite(&ZERO_MATRIX));
        assert!(!is_positive_definite(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]));
        assert!(!is_positive_definite(&[[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]));
        assert!(inverse(&ZERO_MATRIX).is_none());
    }

    #[test]
    fn tangents_complete_a_right_handed_frame() {
        for n in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.48, 0.6, 0.64]] {
            let (t1, t2) = tangents(n);
            assert!(dot(n, t1).abs() < 1e-15 && (norm(t1) - 1.0).abs() < 1e-15);
            assert!(norm(sub(cross(n, t1), t2)) < 1e-15);
        }
    }

    #[test]
    fn unit_keeps_tiny_and_huge_directions() {
        for s in [1e-300, 1.0, 1e300] {
            let u = unit([3.0 * s, 0.0, 4.0 * s]).unwrap_or(ZERO);
            assert!(norm(sub(u, [0.6, 0.0, 0.8])) < 1e-15);
        }
        assert!(unit(ZERO).is_none());
        assert!(unit([f64::NAN, 0.0, 0.0]).is_none());
    }
}
