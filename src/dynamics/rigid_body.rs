//! Free rigid motion with its gyroscopic torque, implicitly.

use crate::kinematics::Pose;
use crate::math::{Mat3, Vec3, inverse, mat_add, mat_scale, mat_vec, norm, skew, sub};

/// Newton iterations at most; four or five do for turns below a radian.
const ITERATIONS: u32 = 30;

/// Residual at which the iteration ends, relative to the angular momentum.
const TOLERANCE: f64 = 1e-15;

/// The angular velocity w `[rad/s]` that takes a body of world inertia `I0` at the start of the step and angular momentum
/// `L` to a pose at which its momentum is `L` again: `R I0 R^T w = L` with `R = exp(dt w)`.
///
/// As the turn leaves its own axis alone this is `I0 w = exp(-dt w) L`. Both the pose and the velocity at the end are those
/// of `w`, so a free body keeps its angular momentum to rounding for any step; its energy falls slowly, towards the
/// turn about the axis of largest inertia, and never grows. Where Newton's iteration does not converge (turns of several
/// radians) the velocity without gyroscopic torque is given, `I0 w = L`.
pub fn free_angular_velocity(inertia: &Mat3, momentum: Vec3, dt: f64) -> Vec3 {
    let Some(inverse_inertia) = inverse(inertia) else { return [0.0; 3] };
    let straight = mat_vec(&inverse_inertia, momentum);
    let scale = norm(momentum);
    let mut w = straight;
    for _ in 0..ITERATIONS {
        let carried = Pose::IDENTITY.advanced([0.0; 3], w, -dt).transform(momentum);
        let residual = sub(mat_vec(inertia, w), carried);
        if norm(residual) <= TOLERANCE * scale {
            return w;
        }
        // Symmetric positive definite plus skew: never singular.
        let jacobian = mat_add(inertia, &mat_scale(-dt, &skew(carried)));
        let Some(solve) = inverse(&jacobian) else { return straight };
        let next = sub(w, mat_vec(&solve, residual));
        if next == w {
            return w;
        }
        w = next;
    }
    let carried = Pose::IDENTITY.advanced([0.0; 3], w, -dt).transform(momentum);
    let settled = norm(sub(mat_vec(inertia, w), carried)) <= 1e-9 * scale;
    if settled { w } else { straight }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::world_inertia;
    use crate::math::{IDENTITY, dot};

    const INERTIA: Mat3 = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];

    /// Free motion: pose, angular velocity, and the largest drift of the angular momentum, relative.
    fn fly(start: Vec3, dt: f64, steps: usize, mut each: impl FnMut(&Pose, Vec3)) -> f64 {
        let mut pose = Pose::IDENTITY.advanced([0.0; 3], [0.3, 0.2, -0.5], 1.0);
        let mut w = mat_vec(&pose.rotation(), start);
        let first = mat_vec(&world_inertia(&pose, &INERTIA), w);
        let mut drift = 0.0_f64;
        for _ in 0..steps {
            let inertia = world_inertia(&pose, &INERTIA);
            w = free_angular_velocity(&inertia, mat_vec(&inertia, w), dt);
            pose = pose.advanced([0.0; 3], w, dt);
            let momentum = mat_vec(&world_inertia(&pose, &INERTIA), w);
            drift = drift.max(norm(sub(momentum, first)) / norm(first));
            each(&pose, w);
        }
        drift
    }

    #[test]
    fn angular_momentum_is_kept_to_rounding_and_energy_never_grows() {
        for dt in [1e-3, 1e-2, 0.1] {
            let mut last = f64::INFINITY;
            let drift = fly([0.01, 5.0, 0.01], dt, 2000, |pose, w| {
                let energy = 0.5 * dot(w, mat_vec(&world_inertia(pose, &INERTIA), w));
                assert!(energy <= last * (1.0 + 1e-12), "{dt}: {energy} after {last}");
                last = energy;
            });
            assert!(drift < 1e-11, "{dt}: {drift}");
        }
    }

    #[test]
    fn a_body_that_turns_about_its_middle_axis_flips_as_eulers_equations_say() {
        // The reference: Euler's equations in the body frame by a fine Runge-Kutta.
        let derivative = |w: Vec3| {
            let [a, b, c] = w;
            [(2.0 - 3.0) / 1.0 * b * c, (3.0 - 1.0) / 2.0 * c * a, (1.0 - 2.0) / 3.0 * a * b]
        };
        let start = [0.01, 5.0, 0.01];
        let (mut w, h) = (start, 1e-4);
        let along = |w: Vec3, s: f64, k: Vec3| crate::math::add_scaled(w, s, k);
        let mut flip = 0.0;
        for step in 0..100_000 {
            let k1 = derivative(w);
            let k2 = derivative(along(w, 0.5 * h, k1));
            let k3 = derivative(along(w, 0.5 * h, k2));
            let k4 = derivative(along(w, h, k3));
            let sum = along(along(along(k1, 2.0, k2), 2.0, k3), 1.0, k4);
            w = along(w, h / 6.0, sum);
            if w[1] < 0.0 {
                flip = h * f64::from(step);
                break;
            }
        }
        assert!(flip > 0.5, "the reference flips");
        let (mut found, mut time) = (0.0, 0.0);
        let dt = 2e-5;
        fly(start, dt, 150_000, |pose, w| {
            time += dt;
            if found == 0.0 && crate::math::mat_transpose_vec(&pose.rotation(), w)[1] < 0.0 {
                found = time;
            }
        });
        assert!((found - flip).abs() < 0.01 * flip, "{found} against {flip}");
    }

    #[test]
    fn a_sphere_turns_evenly_and_rest_stays_rest() {
        let w = free_angular_velocity(&IDENTITY, [1.0, 2.0, 3.0], 0.5);
        assert!(norm(sub(w, [1.0, 2.0, 3.0])) < 1e-14);
        assert_eq!(free_angular_velocity(&INERTIA, [0.0; 3], 0.1), [0.0; 3]);
        let wild = free_angular_velocity(&INERTIA, [300.0, -200.0, 500.0], 0.1);
        assert!(wild.iter().all(|c| c.is_finite()));
    }
}
