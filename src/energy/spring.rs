//! A spring between two nodes: stretch, shear and bend springs of cloth alike [Provot95; Bridson02].

use super::side_by_side::{Block, LANES, Number, SideBySide, Vector, ZERO, gather};
use super::stencil::{Blocks, HessianForm, Stencil, zero_blocks};
use crate::math::simd::Lanes;
use crate::math::simd::points::{self, Point, dot, if_positive, largest};
use crate::math::{IDENTITY, Mat3, Vec3, ZERO_MATRIX, mat_add, mat_scale, norm, outer, scale, sub, unit};

/// `E = k/2 (|x1 - x0| - L)^2`.
///
/// Where both nodes coincide a spring has no direction: force and second derivatives are zero there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Stiffness k `[N/m]`, not negative.
    pub stiffness: f64,
    /// Rest length L `[m]`, not negative.
    pub rest_length: f64,
}

impl Spring {
    /// Blocks `[[m, -m], [-m, m]]`.
    fn opposed(m: &Mat3) -> Blocks<2> {
        let negative = mat_scale(-1.0, m);
        [[*m, negative], [negative, *m]]
    }
}

impl Stencil<2> for Spring {
    fn energy(&self, x: &[Vec3; 2]) -> f64 {
        let stretch = norm(sub(x[1], x[0])) - self.rest_length;
        0.5 * self.stiffness * stretch * stretch
    }

    fn force(&self, x: &[Vec3; 2]) -> [Vec3; 2] {
        let along = sub(x[1], x[0]);
        let Some(direction) = unit(along) else { return [[0.0; 3]; 2] };
        let f = scale(self.stiffness * (norm(along) - self.rest_length), direction);
        [f, scale(-1.0, f)]
    }

    /// Projected: the part across the spring, negative under compression, is left out there [Choi02, compression].
    fn hessian(&self, x: &[Vec3; 2], form: HessianForm) -> Blocks<2> {
        let along = sub(x[1], x[0]);
        let Some(direction) = unit(along) else { return zero_blocks() };
        let mut across = 1.0 - self.rest_length / norm(along);
        if form == HessianForm::Projected {
            across = across.max(0.0);
        }
        let projector = outer(direction, direction);
        let m = mat_add(&mat_scale(across, &IDENTITY), &mat_scale(1.0 - across, &projector));
        Spring::opposed(&mat_scale(self.stiffness, &m))
    }

    fn viscosity(&self, x: &[Vec3; 2]) -> Blocks<2> {
        let m = unit(sub(x[1], x[0])).map_or(ZERO_MATRIX, |d| mat_scale(self.stiffness, &outer(d, d)));
        Spring::opposed(&m)
    }

    /// The same bits as one by one.
    #[inline(always)]
    fn side_by_side(four: [&Self; LANES], x: &[Point<LANES>; 2], stiff: f64, viscous: f64) -> SideBySide<2> {
        let [k, rest] = [gather(four, |s: &Spring| s.stiffness), gather(four, |s| s.rest_length)];
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let along = points::sub(&x[1], &x[0]);
        let size = largest(&along);
        let shorter = along.map(|c| c / size);
        let direction = points::scale(one / dot(&shorter, &shorter).sqrt(), &shorter);
        let length = dot(&along, &along).sqrt();
        let force = if_positive(size, &points::scale(k * (length - rest), &direction), &ZERO);
        let across = (one - rest / length).max(zero);
        let whole = direction.map(|a| direction.map(|b| a * b));
        let mut stretch = [ZERO; 3];
        for (r, c) in (0..9).map(|i| (i / 3, i % 3)) {
            let identity = Lanes::splat(IDENTITY[r][c]);
            stretch[r][c] = k * (across * identity + (one - across) * whole[r][c]);
        }
        let parts = (stretch, whole.map(|row| row.map(|c| k * c)));
        let block = |sign: f64| sum(&parts, size, Lanes::splat(sign), (stiff, viscous));
        let (same, other) = (block(1.0), block(-1.0));
        SideBySide {
            forces: [force, points::scale(Lanes::splat(-1.0), &force)],
            blocks: [[same, ZERO_BLOCK], [other, same]],
        }
    }

    fn stiffness_bound(&self, _x: &[Vec3; 2]) -> f64 {
        2.0 * self.stiffness
    }
}

const ZERO_BLOCK: Block = [ZERO; 3];

/// `stiff sign H + viscous sign V` where there is a `size`, zero elsewhere.
#[inline(always)]
fn sum((h, v): &(Block, Block), size: Number, sign: Number, (stiff, viscous): (f64, f64)) -> Block {
    let row = |r: usize| -> Vector {
        std::array::from_fn(|c| {
            let damping = Lanes::splat(if viscous > 0.0 { viscous } else { 0.0 }) * (sign * v[r][c]);
            size.if_positive(Lanes::splat(stiff) * (sign * h[r][c]) + damping, Lanes::splat(0.0))
        })
    };
    [row(0), row(1), row(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn four_springs_have_the_bits_of_each_alone() {
        let mut random = Random(3);
        for case in 0..2000 {
            let springs: [Spring; LANES] = std::array::from_fn(|_| Spring {
                stiffness: 50.0 * (1.0 + random.signed()),
                rest_length: 0.6 * (1.0 + random.signed()),
            });
            let mut x: [Point<LANES>; 2] =
                std::array::from_fn(|_| std::array::from_fn(|_| Lanes(std::array::from_fn(|_| random.signed()))));
            if case % 5 == 0 {
                // Both ends of one of them coincide, another one lies along an axis.
                let (first, second) = (case % LANES, (case + 1) % LANES);
                (0..3).for_each(|c| x[1][c].0[first] = x[0][c].0[first]);
                (1..3).for_each(|c| x[1][c].0[second] = x[0][c].0[second]);
            }
            let viscous = [0.0, 0.3][case % 2];
            let four = [&springs[0], &springs[1], &springs[2], &springs[3]];
            let (wide, alone) =
                (Spring::side_by_side(four, &x, 2.0, viscous), SideBySide::one_by_one(four, &x, (2.0, viscous)));
            // Zeros may differ in their sign.
            for (a, b) in [(0, 0), (1, 0), (1, 1)] {
                assert_eq!(wide.blocks[a][b], alone.blocks[a][b], "{case} {springs:?} {x:?}");
            }
            assert_eq!(wide.forces, alone.forces, "{case}");
        }
    }
}
