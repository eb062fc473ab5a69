//! Four membranes or four hinges at a time, as `triangle_membrane` and `discrete_shell` have them element by element.

use super::damping::GREEN_STRETCH_SQUARED;
use super::side_by_side::{
    LANES, Number, SideBySide, Vector, ZERO, across, add_outer, diagonal, gather, projected, unit_or,
};
use super::{Hinge, TriangleMembrane};
use crate::math::simd::Lanes;
use crate::math::simd::points::{add, cross, dot, if_positive, scale, sub};

/// Singular values below this share of the larger one have no direction, squared.
const FLAT_SQUARED: f64 = 1e-20;

/// A triangle whose height over the edge is less than this share of the edge has no normal to bend, squared.
const NARROW_SQUARED: f64 = 1e-14;

/// `stiff H + viscous V` and forces of membranes.
#[inline(always)]
pub(super) fn membranes(
    four: [&TriangleMembrane; LANES],
    x: &[Vector; 3],
    (stiff, viscous): (f64, f64),
) -> SideBySide<3> {
    let zero = Lanes::splat(0.0);
    let b = [1, 2].map(|i| [0, 1].map(|c| gather(four, |t: &TriangleMembrane| t.gradients[i][c])));
    let [volume, lambda, mu] = [gather(four, |t| t.volume), gather(four, |t| t.lambda), gather(four, |t| t.mu)];
    let (p, q) = (sub(&x[1], &x[0]), sub(&x[2], &x[0]));
    let f = [0, 1].map(|c| add(&scale(b[0][c], &p), &scale(b[1][c], &q)));
    let v = principal(dot(&f[0], &f[0]), dot(&f[0], &f[1]), dot(&f[1], &f[1]));
    let combine = |b: &[Number; 2]| add(&scale(b[0], &f[0]), &scale(b[1], &f[1]));
    let images = v.map(|v| combine(&v));
    let u0 = unit_or(&images[0], &[Lanes::splat(1.0), zero, zero]);
    let second = across(&u0, &images[1]);
    let wide = dot(&second, &second) - Lanes::splat(FLAT_SQUARED) * dot(&images[0], &images[0]);
    let u1 = if_positive(wide, &unit_or(&second, &ZERO), &any_across(&u0));
    let sigma = [dot(&u0, &images[0]), dot(&u1, &images[1]).max(zero)];
    let normal = cross(&u0, &u1);
    let two_mu = mu + mu;
    let pressure = lambda * (sigma[0] + sigma[1] - Lanes::splat(2.0)) - two_mu;
    let inner = b.map(|b| v.map(|v| v[0] * b[0] + v[1] * b[1]));
    let turned = inner.map(|w| add(&scale(w[0], &u0), &scale(w[1], &u1)));
    let twisted = inner.map(|w| sub(&scale(w[0], &u1), &scale(w[1], &u0)));
    let soft = pressure.negate();
    let twist = projected(soft, Lanes::splat(0.5) * (sigma[0] + sigma[1]), two_mu);
    let out_of_plane = sigma.map(|s| projected(soft, s, two_mu));
    let carried = b.map(|b| combine(&b));
    let (stiff, viscous_volume) = (volume * Lanes::splat(stiff), volume * Lanes::splat(viscous));
    let squares = (dot(&f[0], &f[0]) + dot(&f[1], &f[1])) * Lanes::splat(0.5 / GREEN_STRETCH_SQUARED);
    let viscous_volume = viscous_volume / squares.max(Lanes::splat(1.0));
    let mut out = SideBySide::EMPTY;
    for i in 0..2 {
        let stress = add(&scale(two_mu, &carried[i]), &scale(pressure, &turned[i]));
        out.forces[i + 1] = scale(volume.negate(), &stress);
        for j in 0..=i {
            let along = b[i][0] * b[j][0] + b[i][1] * b[j][1];
            let mut block = diagonal(stiff * two_mu * along);
            add_outer(&mut block, stiff * lambda, &turned[i], &turned[j]);
            add_outer(&mut block, (stiff * twist * Lanes::splat(0.5)).negate(), &twisted[i], &twisted[j]);
            let out_of = out_of_plane[0] * inner[i][0] * inner[j][0] + out_of_plane[1] * inner[i][1] * inner[j][1];
            add_outer(&mut block, (stiff * out_of).negate(), &normal, &normal);
            if viscous > 0.0 {
                let factor = viscous_volume * mu;
                add_outer(&mut block, factor * along, &f[0], &f[0]);
                add_outer(&mut block, factor * along, &f[1], &f[1]);
                add_outer(&mut block, factor, &carried[j], &carried[i]);
                add_outer(&mut block, viscous_volume * lambda, &carried[i], &carried[j]);
            }
            out.blocks[i + 1][j + 1] = block;
        }
    }
    out.complete();
    out
}

/// Orthonormal eigenvectors of `[[a, b], [b, c]]`, that of the larger value first: half of the angle of `(a - c, 2 b)`.
#[inline(always)]
fn principal(a: Number, b: Number, c: Number) -> [[Number; 2]; 2] {
    let (d, h) = (a - c, b + b);
    let one = Lanes::splat(1.0);
    let long = (d * d + h * h).sqrt();
    let (cosine, sine) = (long.if_positive(d / long, one), long.if_positive(h / long, Lanes::splat(0.0)));
    let big = ((one + cosine.abs()) * Lanes::splat(0.5)).sqrt();
    let small = sine.abs() / (big + big);
    let swap = cosine.negate();
    let (cosine, size) = (swap.if_positive(small, big), swap.if_positive(big, small));
    let sine = sine.negate().if_positive(size.negate(), size);
    [[cosine, sine], [sine.negate(), cosine]]
}

/// A unit vector across `n`, lane by lane: rare.
fn any_across(n: &Vector) -> Vector {
    let mut out = ZERO;
    for lane in 0..LANES {
        let t = crate::math::tangents(n.map(|c| c.0[lane])).0;
        (0..3).for_each(|c| out[c].0[lane] = t[c]);
    }
    out
}

/// `stiff H + viscous V` and forces of hinges.
#[inline(always)]
pub(super) fn hinges(four: [&Hinge; LANES], x: &[Vector; 4], (stiff, viscous): (f64, f64)) -> SideBySide<4> {
    let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
    let edge = sub(&x[1], &x[0]);
    let (left, right) = (sub(&x[2], &x[0]), sub(&x[3], &x[0]));
    let areas = [cross(&edge, &left), cross(&right, &edge)];
    let squared = areas.map(|a| dot(&a, &a));
    let length_squared = dot(&edge, &edge);
    let length = length_squared.sqrt();
    let least = Lanes::splat(NARROW_SQUARED) * length_squared * length_squared;
    let bends = (squared[0].min(squared[1]) - least).min(length_squared);
    let sine = dot(&cross(&areas[0], &areas[1]), &edge) / length;
    let cosine = dot(&areas[0], &areas[1]);
    let mut moment = zero;
    for lane in 0..LANES {
        if bends.0[lane] > 0.0 {
            moment.0[lane] = -four[lane].stiffness * four[lane].excess(sine.0[lane].atan2(cosine.0[lane]));
        }
    }
    let [g2, g3] = [0, 1].map(|s| scale(bends.if_positive(length.negate() / squared[s], zero), &areas[s]));
    let [p, q] = [left, right].map(|arm| bends.if_positive(dot(&arm, &edge) / length_squared, zero));
    let g0 = add(&scale(p - one, &g2), &scale(q - one, &g3));
    let g1 = add(&scale(p.negate(), &g2), &scale(q.negate(), &g3));
    let gradient = [g0, g1, g2, g3];
    let mut out = SideBySide::EMPTY;
    let factor = gather(four, |h| h.stiffness) * Lanes::splat(stiff + viscous);
    for i in 0..4 {
        out.forces[i] = scale(moment, &gradient[i]);
        for j in 0..=i {
            add_outer(&mut out.blocks[i][j], factor, &gradient[i], &gradient[j]);
        }
    }
    out
}
