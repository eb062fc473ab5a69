//! The friction law of one contact: projection onto its limit, and the local solve of the inner relaxation
//! [Otaduy09, §5.4-5.5].

use crate::math::Vec3;
use crate::model::FrictionCone;

/// Effective inverse mass of one contact in its own frame, `G = C S^-1 C^T` for a block-diagonal metric S, with what
/// the local solve needs of it. Zero where nothing at the contact can move.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LocalMetric {
    /// `G` by rows of its upper triangle: nn, n1, n2, 11, 12, 22 `[1/kg]`.
    pub entries: [f64; 6],
    /// `1 / G_nn`, or 0.
    pub normal_inverse: f64,
    /// Inverse of the tangential 2x2 block (11, 12, 22), or 0 where it is singular.
    pub tangent_inverse: [f64; 3],
    /// `1 /` the largest eigenvalue of the tangential block, or 0.
    pub tangent_step: f64,
}

impl LocalMetric {
    /// Prepares the local solve for `G`.
    pub fn new(entries: [f64; 6]) -> LocalMetric {
        let [nn, _, _, a, b, c] = entries;
        let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
        let largest = mean + (half * half + b * b).sqrt();
        let determinant = a * c - b * b;
        // Relative to the square of its scale: a tangent plane with one direction that cannot move is singular.
        let regular = determinant > 1e-12 * largest * largest;
        let r = if regular { 1.0 / determinant } else { 0.0 };
        LocalMetric {
            entries,
            normal_inverse: if nn > 0.0 { 1.0 / nn } else { 0.0 },
            tangent_inverse: [r * c, -r * b, r * a],
            tangent_step: if largest > 0.0 { 1.0 / largest } else { 0.0 },
        }
    }

    /// `G dp`.
    #[inline(always)]
    pub fn apply(&self, dp: Vec3) -> Vec3 {
        let [nn, n1, n2, a, b, c] = self.entries;
        [nn * dp[0] + n1 * dp[1] + n2 * dp[2], n1 * dp[0] + a * dp[1] + b * dp[2], n2 * dp[0] + b * dp[1] + c * dp[2]]
    }
}

/// The nearest `(g1, g2)` within the friction limit `bound = mu lambda >= 0`.
#[inline(always)]
pub(super) fn project_tangent(cone: FrictionCone, bound: f64, g: [f64; 2]) -> [f64; 2] {
    match cone {
        FrictionCone::Pyramid => [g[0].clamp(-bound, bound), g[1].clamp(-bound, bound)],
        FrictionCone::Disc => {
            let length_squared = g[0] * g[0] + g[1] * g[1];
            if length_squared <= bound * bound {
                g
            } else {
                let r = bound / length_squared.sqrt();
                [r * g[0], r * g[1]]
            }
        }
    }
}

/// Multipliers brought within their limits: `lambda >= 0`, friction within `mu lambda`; not a number becomes zero.
pub(super) fn project(cone: FrictionCone, friction: f64, p: Vec3) -> Vec3 {
    if !(p[0] > 0.0 && p[0].is_finite() && p[1].is_finite() && p[2].is_finite()) {
        return [0.0; 3];
    }
    let [g1, g2] = project_tangent(cone, friction * p[0], [p[1], p[2]]);
    [p[0], g1, g2]
}

/// One local step: normal response first, then friction with the new limit; `w` is the contact velocity to make
/// complementary, before the step.
///
/// A fixed point is a solution of the contact's law: `lambda = max(0, lambda - w_n / G_nn)`, and friction is what a
/// projected gradient step leaves unchanged. The disc is isotropic also where G is not: it takes the exact sticking
/// impulse when that is within the limit, else a gradient step with the largest eigenvalue, which has the same fixed
/// points.
#[inline(always)]
pub(super) fn local_step(metric: &LocalMetric, cone: FrictionCone, friction: f64, p: Vec3, w: Vec3) -> Vec3 {
    let [_, n1, n2, a, b, c] = metric.entries;
    let lambda = (p[0] - w[0] * metric.normal_inverse).max(0.0);
    let bound = friction * lambda;
    if bound == 0.0 {
        return [lambda, 0.0, 0.0];
    }
    let change = lambda - p[0];
    let (w1, w2) = (w[1] + n1 * change, w[2] + n2 * change);
    let [g1, g2] = match cone {
        FrictionCone::Pyramid => {
            let g1 = if a > 0.0 { (p[1] - w1 / a).clamp(-bound, bound) } else { 0.0 };
            let w2 = w2 + b * (g1 - p[1]);
            [g1, if c > 0.0 { (p[2] - w2 / c).clamp(-bound, bound) } else { 0.0 }]
        }
        FrictionCone::Disc => {
            let [i, j, k] = metric.tangent_inverse;
            let stick = [p[1] - (i * w1 + j * w2), p[2] - (j * w1 + k * w2)];
            if i + k > 0.0 && stick[0] * stick[0] + stick[1] * stick[1] <= bound * bound {
                stick
            } else {
                let step = metric.tangent_step;
                project_tangent(cone, bound, [p[1] - step * w1, p[2] - step * w2])
            }
        }
    };
    [lambda, g1, g2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `G = B B^T + shift` from a fixed pseudo-random B.
    fn metric(seed: u64) -> LocalMetric {
        let mut s = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = || {
            s ^= s << 13;
            s ^= s >> 7;
            s ^= s << 17;
            (s >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let b: [[f64; 3]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let g = |i: usize, j: usize| (0..3).map(|k| b[i][k] * b[j][k]).sum::<f64>() + f64::from(i == j) * 0.05;
        LocalMetric::new([g(0, 0), g(0, 1), g(0, 2), g(1, 1), g(1, 2), g(2, 2)])
    }

    #[test]
    fn repeated_local_steps_end_in_coulombs_law() {
        for cone in [FrictionCone::Disc, FrictionCone::Pyramid] {
            for seed in 1..200u64 {
                let m = metric(seed);
                let free = metric(seed + 1000).entries;
                let free = [-free[0], 3.0 * free[1], 3.0 * free[2]];
                let (mu, mut p) = (0.4, [0.0; 3]);
                let velocity = |p: Vec3| {
                    let g = m.apply(p);
                    [free[0] + g[0], free[1] + g[1], free[2] + g[2]]
                };
                for _ in 0..20_000 {
                    p = local_step(&m, cone, mu, p, velocity(p));
                }
                let w = velocity(p);
                assert!(w[0].abs() < 1e-9, "the contact is pressed: no normal velocity");
                let bound = mu * p[0];
                match cone {
                    FrictionCone::Disc => {
                        let (g, s) = ((p[1] * p[1] + p[2] * p[2]).sqrt(), (w[1] * w[1] + w[2] * w[2]).sqrt());
                        assert!(g <= bound * (1.0 + 1e-12));
                        if g < bound * (1.0 - 1e-9) {
                            assert!(s < 1e-9, "sticking has no sliding velocity: {s}");
                        } else {
                            assert!((p[1] * w[1] + p[2] * w[2] + g * s).abs() < 1e-8 * (1.0 + g * s), "opposed");
                        }
                    }
                    FrictionCone::Pyramid => {
                        for t in 1..3 {
                            let ok = if p[t] >= bound {
                                w[t] <= 1e-9
                            } else if p[t] <= -bound {
                                w[t] >= -1e-9
                            } else {
                                w[t].abs() < 1e-9
                            };
                            assert!(ok && p[t].abs() <= bound);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn what_cannot_move_takes_no_impulse_and_gives_no_nan() {
        let m = LocalMetric::new([0.0; 6]);
        for cone in [FrictionCone::Disc, FrictionCone::Pyramid] {
            let p = local_step(&m, cone, 0.5, [0.0; 3], [-1.0, 2.0, 3.0]);
            assert_eq!(p, [0.0; 3]);
        }
        assert_eq!(project(FrictionCone::Disc, 0.5, [f64::NAN, 0.0, 0.0]), [0.0; 3]);
        let p = project(FrictionCone::Disc, 0.5, [2.0, 3.0, 4.0]);
        assert!(p[0] == 2.0 && (p[1] - 0.6).abs() < 1e-15 && (p[2] - 0.8).abs() < 1e-15, "{p:?}");
    }
}
