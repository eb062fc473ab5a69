//! Bending of a discrete shell at one of its edges [Grinspun03].

use super::side_by_side::{LANES, SideBySide};
use super::stencil::{Blocks, HessianForm, Stencil, zero_blocks};
use crate::math::simd::points::Point;
use crate::math::{Vec3, add, add_scaled, cross, dot, mat_scale, norm, norm_squared, outer, scale, sub};
use std::f64::consts::PI;

/// A triangle whose height over the edge is less than this share of the edge has no normal to bend.
const DEGENERATE: f64 = 1e-7;

/// `E = k/2 (theta - theta0)^2` of the angle between the normals of two triangles that share the edge 0 1; vertex 2
/// completes the triangle on its left, vertex 3 the one on its right. The angle is zero when flat and negative when
/// vertices 2 and 3 rise towards the normals.
///
/// While one of the triangles is pressed to a line, force and Hessian are zero. The difference of angles is taken the
/// short way round, so a fold over more than half a turn from rest springs back the other way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// Stiffness k `[N m]`, not negative.
    pub stiffness: f64,
    /// Rest angle theta0 `[rad]`.
    pub rest_angle: f64,
}

/// Derivatives of the angle by the four vertices, and what they are made of.
struct Bend {
    angle: f64,
    gradient: [Vec3; 4],
    edge: Vec3,
    length: f64,
    /// Area vectors of the triangles of vertices 2 and 3.
    areas: [Vec3; 2],
    /// Where vertices 2 and 3 stand along the edge, 0 to 1.
    feet: [f64; 2],
}

impl Bend {
    fn new(x: &[Vec3; 4]) -> Option<Bend> {
        let edge = sub(x[1], x[0]);
        let (left, right) = (sub(x[2], x[0]), sub(x[3], x[0]));
        let areas = [cross(edge, left), cross(right, edge)];
        let length = norm(edge);
        if areas.iter().any(|a| norm(*a) <= DEGENERATE * length * length) {
            return None;
        }
        let angle = (dot(cross(areas[0], areas[1]), edge) / length).atan2(dot(areas[0], areas[1]));
        let [g2, g3] = areas.map(|a| scale(-length / norm_squared(a), a));
        let feet = [left, right].map(|arm| dot(arm, edge) / (length * length));
        let g0 = add(scale(feet[0] - 1.0, g2), scale(feet[1] - 1.0, g3));
        let g1 = add(scale(-feet[0], g2), scale(-feet[1], g3));
        Some(Bend { angle, gradient: [g0, g1, g2, g3], edge, length, areas, feet })
    }

    /// How the gradient changes as the vertices move by `d`.
    fn second(&self, x: &[Vec3; 4], d: &[Vec3; 4]) -> [Vec3; 4] {
        let arms = [sub(x[2], x[0]), sub(x[3], x[0])];
        let de = sub(d[1], d[0]);
        let stretch = dot(self.edge, de) / self.length;
        let mut changes = [[0.0; 3]; 2];
        let mut feet = [0.0; 2];
        for side in 0..2 {
            let (arm, darm) = (arms[side], sub(d[2 + side], d[0]));
            let sign = if side == 0 { 1.0 } else { -1.0 };
            let darea = scale(sign, add(cross(de, arm), cross(self.edge, darm)));
            let (area, squared) = (self.areas[side], norm_squared(self.areas[side]));
            let lengthened = scale(-stretch / squared, area);
            let turned = add_scaled(scale(1.0 / squared, darea), -2.0 * dot(area, darea) / (squared * squared), area);
            changes[side] = add_scaled(lengthened, -self.length, turned);
            feet[side] = (dot(darm, self.edge) + dot(arm, de) - 2.0 * self.feet[side] * self.length * stretch)
                / (self.length * self.length);
        }
        let (mut d0, mut d1) = ([0.0; 3], [0.0; 3]);
        for side in 0..2 {
            let g = self.gradient[2 + side];
            d0 = add(d0, add(scale(self.feet[side] - 1.0, changes[side]), scale(feet[side], g)));
            d1 = add(d1, add(scale(-self.feet[side], changes[side]), scale(-feet[side], g)));
        }
        [d0, d1, changes[0], changes[1]]
    }
}

impl Hinge {
    /// The hinge of a plate of a bending stiffness `D = E h^3 / (12 (1 - nu^2))` `[N m]` that is at rest at `rest`:
    /// `k = D |e|^2 / (A2 + A3)`, which bends a regular mesh as the plate bends to a cylinder.
    ///
    /// `None` where one of the triangles has no area. `flat`: the rest angle is zero whatever the shape.
    pub fn new(rest: &[Vec3; 4], bending_stiffness: f64, flat: bool) -> Option<Hinge> {
        let bend = Bend::new(rest)?;
        let area = 0.5 * (norm(bend.areas[0]) + norm(bend.areas[1]));
        let stiffness = bending_stiffness * bend.length * bend.length / area;
        stiffness.is_finite().then_some(Hinge { stiffness, rest_angle: if flat { 0.0 } else { bend.angle } })
    }

    /// The angle at `x` `[rad]`; `None` while a triangle has no normal.
    pub fn angle(x: &[Vec3; 4]) -> Option<f64> {
        Bend::new(x).map(|bend| bend.angle)
    }

    pub(super) fn excess(&self, angle: f64) -> f64 {
        let difference = angle - self.rest_angle;
        if difference > PI {
            difference - 2.0 * PI
        } else if difference < -PI {
            difference + 2.0 * PI
        } else {
            difference
        }
    }
}

impl Stencil<4> for Hinge {
    fn energy(&self, x: &[Vec3; 4]) -> f64 {
        Bend::new(x).map_or(0.0, |bend| 0.5 * self.stiffness * self.excess(bend.angle).powi(2))
    }

    fn force(&self, x: &[Vec3; 4]) -> [Vec3; 4] {
        let Some(bend) = Bend::new(x) else { return [[0.0; 3]; 4] };
        let moment = -self.stiffness * self.excess(bend.angle);
        bend.gradient.map(|g| scale(moment, g))
    }

    /// Projected: `k grad(theta) grad(theta)^T`, the Gauss-Newton part; what the curvature of the angle adds is left out.
    fn hessian(&self, x: &[Vec3; 4], form: HessianForm) -> Blocks<4> {
        let mut blocks = self.viscosity(x);
        let (HessianForm::Exact, Some(bend)) = (form, Bend::new(x)) else { return blocks };
        let moment = self.stiffness * self.excess(bend.angle);
        for j in 0..4 {
            for c in 0..3 {
                let mut d = [[0.0; 3]; 4];
                d[j][c] = 1.0;
                for (i, change) in bend.second(x, &d).iter().enumerate() {
                    for r in 0..3 {
                        blocks[i][j][r][c] += moment * change[r];
                    }
                }
            }
        }
        blocks
    }

    #[inline(always)]
    fn side_by_side(four: [&Self; LANES], x: &[Point<LANES>; 4], stiff: f64, viscous: f64) -> SideBySide<4> {
        super::wide_shell::hinges(four, x, (stiff, viscous))
    }

    fn viscosity(&self, x: &[Vec3; 4]) -> Blocks<4> {
        let Some(bend) = Bend::new(x) else { return zero_blocks() };
        let mut blocks = zero_blocks::<4>();
        for i in 0..4 {
            for j in 0..4 {
                blocks[i][j] = mat_scale(self.stiffness, &outer(bend.gradient[i], bend.gradient[j]));
            }
        }
        blocks
    }

    fn stiffness_bound(&self, x: &[Vec3; 4]) -> f64 {
        let squared = |bend: Bend| bend.gradient.iter().map(|g| norm_squared(*g)).sum::<f64>();
        Bend::new(x).map_or(0.0, |bend| self.stiffness * squared(bend))
    }
}
