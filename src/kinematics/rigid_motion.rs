//! Rigid motion of vertices: placing them by a pose, interpolating poses, the lever of a chord, the best rigid fit.

use super::Pose;
use crate::math::{
    Mat3, Vec3, add, add_scaled, cross, mat_transpose_vec, mat_vec, norm, norm_squared, scale, sub,
    symmetric_eigenvectors,
};

/// A principal moment of this share of the largest one is rounding.
const NO_INERTIA: f64 = 1e-12;

/// The vector with every component rounded to `f32`.
#[inline]
pub fn rounded_to_single(a: Vec3) -> Vec3 {
    a.map(|c| f64::from(c as f32))
}

/// World positions of the body-frame points `rest`, rounded to `f32` if `single`. Cost: linear.
pub fn place_vertices(pose: &Pose, rest: &[Vec3], single: bool, out: &mut [Vec3]) {
    let rotation = pose.rotation();
    for (x, r) in out.iter_mut().zip(rest) {
        let placed = add(pose.position, mat_vec(&rotation, *r));
        *x = if single { rounded_to_single(placed) } else { placed };
    }
}

impl Pose {
    /// The pose with position and quaternion rounded to `f32`.
    pub fn rounded_to_single(&self) -> Pose {
        Pose { position: rounded_to_single(self.position), orientation: self.orientation.map(|c| f64::from(c as f32)) }
    }

    /// The pose at `fraction` of the way to `end`: straight centre, constant angular velocity, the shorter way round.
    /// Exact at both ends.
    pub fn interpolated(&self, end: &Pose, fraction: f64) -> Pose {
        if fraction <= 0.0 {
            return *self;
        }
        if fraction >= 1.0 {
            return *end;
        }
        let (linear, angular) = self.velocity_to(end, 1.0);
        self.advanced(linear, angular, fraction)
    }
}

/// Lever `l` of a vertex that turns from the arm `r0` to the arm `r1` by `angle` `[rad]`: `omega x l` is the mean velocity
/// of its chord, so that a row with this lever is exact at the motion it was made for.
///
/// From the identity `r1 - r0 = 2 tan(angle/2) axis x (r0 + r1)/2`. Beyond two radians, where the tangent runs away,
/// the mean arm without the factor; rows carry an offset that makes them exact there too.
#[inline]
pub fn chord_lever(r0: Vec3, r1: Vec3, angle: f64) -> Vec3 {
    let half = 0.5 * angle;
    let factor = if half < 1e-4 {
        1.0 + half * half / 3.0
    } else if half < 1.0 {
        half.tan() / half
    } else {
        1.0
    };
    scale(0.5 * factor, add(r0, r1))
}

/// A rigid motion about a centre: linear velocity of the centre [m/s] and angular velocity [rad/s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    /// Centre at the start `[m]`.
    pub centre: Vec3,
    /// Velocity of the centre `[m/s]`.
    pub linear: Vec3,
    /// Angular velocity `[rad/s]`, world frame.
    pub angular: Vec3,
}

impl RigidMotion {
    /// Where the point `x` stands after `dt`.
    pub fn moved(&self, x: Vec3, dt: f64) -> Vec3 {
        let turn = Pose::IDENTITY.advanced([0.0; 3], self.angular, dt);
        let arm = mat_vec(&turn.rotation(), sub(x, self.centre));
        add_scaled(add(self.centre, arm), dt, self.linear)
    }
}

/// A body or a point with momentum: what a rigid fit sums over.
#[derive(Clone, Copy, Debug)]
pub struct MassElement {
    /// Mass `[kg]`.
    pub mass: f64,
    /// Inertia about its own centre, world frame `[kg m^2]`; zero for a point.
    pub inertia: Mat3,
    /// Centre `[m]`.
    pub position: Vec3,
    /// Velocity of the centre `[m/s]`.
    pub linear: Vec3,
    /// Angular velocity `[rad/s]`; zero for a point.
    pub angular: Vec3,
}

/// The rigid motion with the same linear and angular momentum as the elements [Bridson02, §7.4; Harmon10, Algorithm 2].
///
/// It does not turn about axes without inertia (collinear points): these hold no angular momentum. No elements or no mass:
/// `None`.
pub fn momentum_fit(elements: &[MassElement]) -> Option<RigidMotion> {
    let mass: f64 = elements.iter().map(|e| e.mass).sum();
    if mass <= 0.0 || !mass.is_finite() {
        return None;
    }
    let mut centre = [0.0; 3];
    let mut linear = [0.0; 3];
    for e in elements {
        centre = add_scaled(centre, e.mass / mass, e.position);
        linear = add_scaled(linear, e.mass / mass, e.linear);
    }
    let mut inertia = [[0.0; 3]; 3];
    let mut momentum = [0.0; 3];
    for e in elements {
        let arm = sub(e.position, centre);
        momentum = add_scaled(momentum, e.mass, cross(arm, sub(e.linear, linear)));
        momentum = add(momentum, mat_vec(&e.inertia, e.angular));
        for (i, row) in inertia.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let identity = if i == j { norm_squared(arm) } else { 0.0 };
                *entry += e.mass * (identity - arm[i] * arm[j]) + e.inertia[i][j];
            }
        }
    }
    let (moments, axes) = symmetric_eigenvectors(&inertia);
    let along = mat_transpose_vec(&axes, momentum);
    let rates = std::array::from_fn(|k| if moments[k] > NO_INERTIA * moments[0] { along[k] / moments[k] } else { 0.0 });
    let angular = mat_vec(&axes, rates);
    Some(RigidMotion { centre, linear, angular })
}

/// The rigid motion that fits displacements of points best to first order, within `dt`; `None` without points.
///
/// Least squares over `velocity + omega x arm`; exact for translations, and for turns to second order in the angle.
pub fn displacement_fit(points: &[(Vec3, Vec3)], dt: f64) -> Option<RigidMotion> {
    let elements: Vec<MassElement> = points
        .iter()
        .map(|(x0, x1)| MassElement {
            mass: 1.0,
            inertia: [[0.0; 3]; 3],
            position: *x0,
            linear: scale(1.0 / dt, sub(*x1, *x0)),
            angular: [0.0; 3],
        })
        .collect();
    momentum_fit(&elements)
}

/// Turn of `angular` [rad/s] over `dt`, in radians.
#[inline]
pub fn turn(angular: Vec3, dt: f64) -> f64 {
    norm(angular) * dt
}

/// Inertia in the world frame: `R I R^T`.
pub fn world_inertia(pose: &Pose, inertia: &Mat3) -> Mat3 {
    let rotation = pose.rotation();
    let turned = crate::math::mat_mul(&rotation, inertia);
    let world = crate::math::mat_mul(&turned, &crate::math::transpose(&rotation));
    // Exactly symmetric, whatever the rounding.
    crate::math::mat_scale(0.5, &crate::math::mat_add(&world, &crate::math::transpose(&world)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chord_lever_reproduces_the_displacement() {
        let r0 = [0.4, -0.2, 0.7];
        for angle in [1e-6, 0.1, 0.5, 1.5] {
            let axis = crate::math::unit([1.0, 2.0, -0.5]).unwrap_or([0.0; 3]);
            let omega = scale(angle / 0.01, axis);
            let r1 = Pose::IDENTITY.advanced([0.0; 3], omega, 0.01).transform(r0);
            let chord = scale(1.0 / 0.01, sub(r1, r0));
            let error = norm(sub(chord, cross(omega, chord_lever(r0, r1, angle)))) / norm(chord);
            assert!(error < 1e-9, "{angle}: {error}");
        }
    }

    #[test]
    fn momentum_fit_recovers_a_rigid_motion_and_keeps_momentum() {
        let (omega, v) = ([0.3, -1.0, 2.0], [1.0, 0.0, -3.0]);
        let elements: Vec<MassElement> = (0..5)
            .map(|i| {
                let f = f64::from(i);
                let position = [f, f * f * 0.3, (1.0 + f).sqrt()];
                MassElement {
                    mass: 1.0 + f,
                    inertia: [[0.0; 3]; 3],
                    position,
                    linear: add(v, cross(omega, position)),
                    angular: omega,
                }
            })
            .collect();
        let motion =
            momentum_fit(&elements).unwrap_or(RigidMotion { centre: [0.0; 3], linear: [0.0; 3], angular: [0.0; 3] });
        assert!(norm(sub(motion.angular, omega)) < 1e-6);
        let expected = add(v, cross(omega, motion.centre));
        assert!(norm(sub(motion.linear, expected)) < 1e-12);
    }

    #[test]
    fn interpolation_is_exact_at_both_ends() {
        let a = Pose { position: [1.0, 2.0, 3.0], orientation: [0.5, -0.5, 0.5, 0.5] };
        let b = a.advanced([1.0, 0.0, 0.0], [0.1, 0.4, 0.0], 1.0);
        assert_eq!(a.interpolated(&b, 0.0), a);
        assert_eq!(a.interpolated(&b, 1.0), b);
        let half = a.interpolated(&b, 0.5);
        let twice = half.interpolated(&b, 1.0);
        assert_eq!(twice, b);
        assert!(norm(sub(half.position, [1.5, 2.0, 3.0])) < 1e-15);
    }
}
