//! Four co-rotational tetrahedra at a time: the projected Hessian by the singular vectors, as `corotational_tetrahedron`
//! has it element by element.

use super::CorotationalTetrahedron;
use super::damping::GREEN_STRETCH_SQUARED;
use super::side_by_side::{
    Block, LANES, SideBySide, Vector, ZERO, across, add_outer, diagonal, gather, projected, unit_or,
};
use crate::math::simd::Lanes;
use crate::math::simd::points::{add, cross, dot, if_positive, scale, sub};

/// Sweeps of the Jacobi iteration at most.
const SWEEPS: usize = 8;

/// Sum of the squared entries off the diagonal, relative to the squared trace, at which it ends.
const DIAGONAL: f64 = 1e-30;

/// As for single elements: a vector this much shorter than the longest has no direction of its own.
const DEGENERATE_SQUARED: f64 = 1e-20;

/// Singular vectors by rows, and signed singular values.
struct Parts {
    u: [Vector; 3],
    v: [Vector; 3],
    sigma: Vector,
}

/// `stiff H + viscous V` and forces.
#[inline(always)]
pub(super) fn evaluate(
    four: [&CorotationalTetrahedron; LANES],
    x: &[Vector; 4],
    (stiff, viscous): (f64, f64),
) -> SideBySide<4> {
    let b = [1, 2, 3].map(|i| [0, 1, 2].map(|c| gather(four, |t: &CorotationalTetrahedron| t.gradients[i][c])));
    let [volume, lambda, mu] = [gather(four, |t| t.volume), gather(four, |t| t.lambda), gather(four, |t| t.mu)];
    let mut f = [ZERO; 3];
    for i in 0..3 {
        add_outer(&mut f, Lanes::splat(1.0), &sub(&x[i + 1], &x[0]), &b[i]);
    }
    let parts = parts(&f);
    let two_mu = mu + mu;
    let dilation = parts.sigma[0] + parts.sigma[1] + parts.sigma[2] - Lanes::splat(3.0);
    let pressure = lambda * dilation - two_mu;
    // Gradients in the frame of the right singular vectors, carried by F and by R.
    let inner = b.map(|b| [0, 1, 2].map(|k| dot(&parts.v[k], &b)));
    let carried = b.map(|b| [0, 1, 2].map(|r| dot(&f[r], &b)));
    let turned = inner.map(|w| combination(&parts.u, &w));
    let half = volume * Lanes::splat(0.5 * stiff);
    let mut twists = [(Lanes::splat(0.0), [ZERO; 3]); 3];
    for (k, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        let sum = parts.sigma[i] + parts.sigma[j];
        let softening = projected((pressure + pressure).negate(), sum, two_mu);
        let image = inner.map(|w| sub(&scale(w[i], &parts.u[j]), &scale(w[j], &parts.u[i])));
        twists[k] = ((half * softening).negate(), image);
    }
    let mut out = SideBySide::EMPTY;
    let (stiff, viscous_volume) = (volume * Lanes::splat(stiff), volume * Lanes::splat(viscous));
    let spread: Block = [0, 1, 2].map(|r| [0, 1, 2].map(|c| dot(&f[r], &f[c])));
    let squares = (spread[0][0] + spread[1][1] + spread[2][2]) * Lanes::splat(1.0 / (3.0 * GREEN_STRETCH_SQUARED));
    let viscous_volume = viscous_volume / squares.max(Lanes::splat(1.0));
    for i in 0..3 {
        let stress = add(&scale(two_mu, &carried[i]), &scale(pressure, &turned[i]));
        out.forces[i + 1] = scale(volume.negate(), &stress);
        for j in 0..=i {
            let along = dot(&b[i], &b[j]);
            let mut block = diagonal(stiff * two_mu * along);
            add_outer(&mut block, stiff * lambda, &turned[i], &turned[j]);
            for (softening, t) in &twists {
                add_outer(&mut block, *softening, &t[i], &t[j]);
            }
            if viscous > 0.0 {
                let factor = viscous_volume * mu;
                (0..3).for_each(|r| block[r] = add(&block[r], &scale(factor * along, &spread[r])));
                add_outer(&mut block, factor, &carried[j], &carried[i]);
                add_outer(&mut block, viscous_volume * lambda, &carried[i], &carried[j]);
            }
            out.blocks[i + 1][j + 1] = block;
        }
    }
    out.complete();
    out
}

/// `sum w_k rows_k`
#[inline(always)]
fn combination(rows: &[Vector; 3], w: &Vector) -> Vector {
    add(&add(&scale(w[0], &rows[0]), &scale(w[1], &rows[1])), &scale(w[2], &rows[2]))
}

/// Signed singular values of `f`, given by rows, with rotations on both sides.
#[inline(always)]
fn parts(f: &Block) -> Parts {
    let v = right_vectors(f);
    let images = v.map(|v| [0, 1, 2].map(|r| dot(&f[r], &v)));
    let u0 = unit_or(&images[0], &v[0]);
    let second = across(&u0, &images[1]);
    let least = Lanes::splat(DEGENERATE_SQUARED) * dot(&images[0], &images[0]);
    // Of two vectors across v0 one at least has half of its square across any direction.
    let (a, b) = (across(&u0, &v[1]), across(&u0, &v[2]));
    let chosen = if_positive(dot(&a, &a) - Lanes::splat(0.25), &a, &b);
    let u1 = unit_or(&if_positive(dot(&second, &second) - least, &second, &chosen), &chosen);
    // Once more, so that rounding in a short vector does not tilt the frame.
    let u1 = unit_or(&across(&u0, &u1), &u1);
    let u = [u0, u1, cross(&u0, &u1)];
    Parts { u, v, sigma: [0, 1, 2].map(|k| dot(&u[k], &images[k])) }
}

/// Eigenvectors of `f^T f`, by rows, a rotation, those of the larger values first.
#[inline(always)]
fn right_vectors(f: &Block) -> [Vector; 3] {
    let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
    let mut a: Block = [[zero; 3]; 3];
    for r in 0..3 {
        for c in 0..3 {
            a[r][c] = f[0][r] * f[0][c] + f[1][r] * f[1][c] + f[2][r] * f[2][c];
        }
    }
    let trace = a[0][0] + a[1][1] + a[2][2];
    let factor = trace.if_positive(one / trace, one);
    a = a.map(|row| row.map(|x| x * factor));
    let mut v = diagonal(one);
    for _ in 0..SWEEPS {
        let off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
        if off.0.iter().all(|x| *x <= DIAGONAL) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let mut values = [a[0][0], a[1][1], a[2][2]];
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let larger = values[j] - values[i];
        (values[i], values[j]) = (values[i].max(values[j]), values[j].min(values[i]));
        (v[i], v[j]) = (if_positive(larger, &v[j], &v[i]), if_positive(larger, &v[i], &v[j]));
    }
    v[2] = cross(&v[0], &v[1]);
    v
}

/// One Jacobi rotation that clears entry `(p, q)`; eigenvectors are rows.
#[inline(always)]
fn rotate(a: &mut Block, v: &mut [Vector; 3], p: usize, q: usize) {
    let (d, h) = (a[q][q] - a[p][p], a[p][q] + a[p][q]);
    let long = d.abs() + (d * d + h * h).sqrt();
    let one = Lanes::splat(1.0);
    // The tangent of the smaller angle; none where there is nothing to clear.
    let t = long.if_positive(d.if_positive(h, h.negate()) / long, Lanes::splat(0.0));
    let c = one / (t * t + one).sqrt();
    let s = t * c;
    let r = 3 - p - q;
    let turn = t * a[p][q];
    (a[p][p], a[q][q]) = (a[p][p] - turn, a[q][q] + turn);
    let (x, y) = (a[r][p], a[r][q]);
    (a[r][p], a[r][q]) = (c * x - s * y, s * x + c * y);
    (a[p][r], a[q][r]) = (a[r][p], a[r][q]);
    (a[p][q], a[q][p]) = (Lanes::splat(0.0), Lanes::splat(0.0));
    let (x, y) = (v[p], v[q]);
    v[p] = sub(&scale(c, &x), &scale(s, &y));
    v[q] = add(&scale(s, &x), &scale(c, &y));
}
