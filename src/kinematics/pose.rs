//! Position and orientation of a rigid body about its centre of mass.

use crate::math::{Mat3, Vec3, add, add_scaled, cross, mat_vec, norm, scale};

/// Pose of a rigid body: `x = position + R(orientation) X`, `X` in the body frame about the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre of mass `[m]`.
    pub position: Vec3,
    /// Unit quaternion, order `x y z w`.
    pub orientation: [f64; 4],
}

impl Pose {
    /// The identity pose.
    pub const IDENTITY: Pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };

    /// Rotation matrix of the orientation, which need not be exactly of unit length.
    pub fn rotation(&self) -> Mat3 {
        let [x, y, z, w] = self.orientation;
        let s = 2.0 / (x * x + y * y + z * z + w * w);
        [
            [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
        ]
    }

    /// World position of the body-frame point `local`.
    pub fn transform(&self, local: Vec3) -> Vec3 {
        add(self.position, mat_vec(&self.rotation(), local))
    }

    /// The pose after moving with `linear` [m/s] and the world-frame `angular` [rad/s] for `dt`: the exponential map,
    /// the quaternion renormalised.
    pub fn advanced(&self, linear: Vec3, angular: Vec3, dt: f64) -> Pose {
        let turn = scale(dt, angular);
        let angle = norm(turn);
        // sin(a/2)/a, by its series where the quotient loses digits.
        let (half_sine, half_cosine) = if angle < 1e-4 {
            (0.5 - angle * angle / 48.0, 1.0 - angle * angle / 8.0)
        } else {
            ((0.5 * angle).sin() / angle, (0.5 * angle).cos())
        };
        let v = scale(half_sine, turn);
        let q = [self.orientation[0], self.orientation[1], self.orientation[2]];
        let w = self.orientation[3];
        let vector = add_scaled(add_scaled(cross(v, q), half_cosine, q), w, v);
        let scalar = half_cosine * w - (v[0] * q[0] + v[1] * q[1] + v[2] * q[2]);
        let [x, y, z] = vector;
        let inverse_length = 1.0 / (x * x + y * y + z * z + scalar * scalar).sqrt();
        Pose {
            position: add_scaled(self.position, dt, linear),
            orientation: [x * inverse_length, y * inverse_length, z * inverse_length, scalar * inverse_length],
        }
    }

    /// The linear and angular velocity that take this pose to `end` within `dt`: the inverse of [`Pose::advanced`],
    /// the shorter way round.
    pub fn velocity_to(&self, end: &Pose, dt: f64) -> (Vec3, Vec3) {
        let linear = scale(1.0 / dt, crate::math::sub(end.position, self.position));
        let [ax, ay, az, aw] = self.orientation;
        let a = [-ax, -ay, -az];
        let b = [end.orientation[0], end.orientation[1], end.orientation[2]];
        let bw = end.orientation[3];
        // end * conjugate(start)
        let mut v = add_scaled(add_scaled(cross(b, a), bw, a), aw, b);
        let mut w = bw * aw - crate::math::dot(b, a);
        if w < 0.0 {
            v = scale(-1.0, v);
            w = -w;
        }
        let sine = norm(v);
        let factor = if sine < 1e-8 * w { 2.0 / w } else { 2.0 * sine.atan2(w) / sine };
        (linear, scale(factor / dt, v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sub;

    #[test]
    fn velocity_to_undoes_advanced() {
        let start = Pose { position: [1.0, 2.0, 3.0], orientation: [0.5, -0.5, 0.5, 0.5] };
        for angular in [[0.0, 0.0, 0.0], [1e-7, 0.0, 2e-7], [0.3, -2.0, 1.0], [9.0, 3.0, -1.0]] {
            let (linear, dt) = ([0.1, -4.0, 2.0], 0.25);
            let end = start.advanced(linear, angular, dt);
            let (l, a) = start.velocity_to(&end, dt);
            assert!(norm(sub(l, linear)) < 1e-13);
            assert!(norm(sub(a, angular)) < 1e-12, "{angular:?} {a:?}");
        }
    }

    #[test]
    fn quarter_turn_about_z_takes_x_to_y() {
        let pose = Pose::IDENTITY.advanced([0.0; 3], [0.0, 0.0, std::f64::consts::FRAC_PI_2], 1.0);
        assert!(norm(sub(pose.transform([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0])) < 1e-15);
    }
}
