//! Preconditioned conjugate gradients on block vectors [Hestenes52].

use crate::math::{Vec3, add_scaled, dot};
use crate::parallel::Par;

/// Buffers; capacity only.
#[derive(Clone, Debug, Default)]
pub struct GradientBuffers {
    residual: Vec<Vec3>,
    preconditioned: Vec<Vec3>,
    direction: Vec<Vec3>,
    image: Vec<Vec3>,
}

/// Why the iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GradientEnding {
    /// The residual fell below the tolerance.
    Converged,
    /// The cap was reached.
    Capped,
    /// A direction without positive curvature or a number that is not finite: operator or preconditioner is not
    /// positive definite. `x` holds what was reached before.
    Breakdown,
}

/// Solves `K x = b` from the given `x`, with `apply(d, out)` for `K d` and `precondition(r, out)` for a positive
/// definite `M^-1 r`, until the residual in the norm of `M^-1` is `tolerance` times that of `b`. Returns the steps made.
///
/// `initial_zero` starts from zero whatever `x` holds, which saves a product. Cost of a step: one `apply`, one
/// `precondition`.
#[allow(clippy::too_many_arguments)]
pub fn conjugate_gradient(
    mut apply: impl FnMut(&[Vec3], &mut [Vec3]),
    mut precondition: impl FnMut(&[Vec3], &mut [Vec3]),
    b: &[Vec3],
    x: &mut [Vec3],
    initial_zero: bool,
    (tolerance, steps_max): (f64, u32),
    buffers: &mut GradientBuffers,
    par: Par,
) -> (u32, GradientEnding) {
    let n = b.len();
    let GradientBuffers { residual: r, preconditioned: z, direction: d, image: k } = buffers;
    for buffer in [&mut *r, &mut *z, &mut *d, &mut *k] {
        buffer.resize(n, [0.0; 3]);
    }
    let inner = |a: &[Vec3], b: &[Vec3]| par.sum(n, |i| dot(a[i], b[i]));
    precondition(b, z);
    let scale = inner(b, z);
    if scale == 0.0 {
        x.fill([0.0; 3]);
        return (0, GradientEnding::Converged);
    }
    if initial_zero {
        x.fill([0.0; 3]);
        r.copy_from_slice(b);
    } else {
        apply(x, k);
        par.map_into(r, |i| add_scaled(b[i], -1.0, k[i]));
        precondition(r, z);
    }
    d.copy_from_slice(z);
    let mut rho = inner(r, z);
    let target = tolerance * tolerance * scale;
    for step in 0..steps_max {
        if rho <= target {
            return (step, GradientEnding::Converged);
        }
        apply(d, k);
        let curvature = inner(d, k);
        if !(curvature > 0.0 && rho.is_finite()) {
            return (step, GradientEnding::Breakdown);
        }
        let alpha = rho / curvature;
        add_to(x, alpha, d, par);
        add_to(r, -alpha, k, par);
        precondition(r, z);
        let next = inner(r, z);
        if next.is_nan() || next < 0.0 {
            return (step + 1, GradientEnding::Breakdown);
        }
        let beta = next / rho;
        rho = next;
        let z = &*z;
        par.for_each_block(d, |start, part| {
            for (i, d) in part.iter_mut().enumerate() {
                *d = add_scaled(z[start + i], beta, *d);
            }
        });
    }
    let ending = if rho <= target { GradientEnding::Converged } else { GradientEnding::Capped };
    (steps_max, ending)
}

/// `y += s x`
fn add_to(y: &mut [Vec3], s: f64, x: &[Vec3], par: Par) {
    par.for_each_block(y, |start, part| {
        for (i, y) in part.iter_mut().enumerate() {
            *y = add_scaled(*y, s, x[start + i]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, sub};

    #[test]
    fn solves_a_chain_and_names_what_is_indefinite() {
        let n = 200;
        let at = |x: &[Vec3], i: usize, j: i64| x.get((i as i64 + j) as usize).copied().unwrap_or([0.0; 3]);
        let apply = |x: &[Vec3], y: &mut [Vec3]| {
            for i in 0..n {
                y[i] = std::array::from_fn(|c| 2.01 * x[i][c] - at(x, i, -1)[c] - at(x, i, 1)[c]);
            }
        };
        let exact: Vec<Vec3> = (0..n).map(|i| [(i as f64).sin(), 1.0, -(i as f64)]).collect();
        let mut b = vec![[0.0; 3]; n];
        apply(&exact, &mut b);
        let mut x = vec![[0.0; 3]; n];
        let mut buffers = GradientBuffers::default();
        let copy = |r: &[Vec3], z: &mut [Vec3]| z.copy_from_slice(r);
        let (_, ending) = conjugate_gradient(apply, copy, &b, &mut x, true, (1e-12, 500), &mut buffers, Par::Serial);
        assert_eq!(ending, GradientEnding::Converged);
        assert!((0..n).all(|i| norm(sub(x[i], exact[i])) < 1e-7));
        let negative = |x: &[Vec3], y: &mut [Vec3]| (0..n).for_each(|i| y[i] = x[i].map(|c| -c));
        let (steps, ending) =
            conjugate_gradient(negative, copy, &b, &mut x, true, (1e-12, 500), &mut buffers, Par::Serial);
        assert_eq!((steps, ending), (0, GradientEnding::Breakdown));
    }
}
