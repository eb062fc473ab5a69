//! The matrix and right side of a deformable body's step.

use crate::energy::{Blocks, Elements, Forces, HessianForm, Pattern, Places, Stencil, TargetSpring};
use crate::linalg::BlockMatrix;
use crate::math::{IDENTITY, Mat3, Vec3, ZERO_MATRIX, add_scaled, mat_add, mat_scale, mat_vec};
use crate::parallel::Par;

/// Stencils whose blocks are held at once where work is shared.
const CHUNK: usize = 4096;

/// What acts on a body from outside, uniform over it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Acceleration of gravity `[m/s^2]`.
    pub gravity: Vec3,
    /// Velocity of the air `[m/s]`.
    pub wind: Vec3,
}

/// `A v = b` of a body's step, over its nodes.
#[derive(Clone, Debug, Default)]
pub struct Assembled {
    /// A `[kg]`.
    pub matrix: BlockMatrix,
    /// b `[kg m/s]`.
    pub right: Vec<Vec3>,
}

/// Assembles `A = M - dt dF/dv - dt^2 dF/dx` and `b = dt F(x, v) + (M - dt dF/dv) v` [Otaduy09, Eq. 3].
///
/// Hessians are projected element by element, damping and drag are taken with their secants, so A is symmetric and at
/// least M: positive definite. Linear damping cancels in b. `targets` holds where each attachment pulls to.
/// Sums run in the order of the stencils whatever the threads. Cost: one pass over the stencils.
pub fn assemble(
    forces: &Forces,
    pattern: &Pattern,
    masses: &[f64],
    (x, v): (&[Vec3], &[Vec3]),
    targets: &[Vec3],
    around: &Surroundings,
    dt: f64,
    out: &mut Assembled,
    par: Par,
) {
    let Assembled { matrix, right } = out;
    matrix.clone_from(&pattern.matrix);
    matrix.values.resize(matrix.columns.len(), ZERO_MATRIX);
    let BlockMatrix { values, diagonal, .. } = matrix;
    right.clear();
    right.resize(masses.len(), [0.0; 3]);
    forces.add_elastic_forces(x, right);
    let damping = forces.damping;
    let (stretch, bend) = (dt * damping.stretch_time, dt * damping.bending_time);
    add_matrices(&forces.springs, &pattern.springs, x, (dt * dt, stretch), values, par);
    add_matrices(&forces.membranes, &pattern.membranes, x, (dt * dt, stretch), values, par);
    add_matrices(&forces.hinges, &pattern.hinges, x, (dt * dt, bend), values, par);
    add_matrices(&forces.tetrahedra, &pattern.tetrahedra, x, (dt * dt, stretch), values, par);
    add_drag(forces, pattern, (x, v), around.wind, dt, values, right);
    for (attachment, target) in forces.attachments.iter().zip(targets) {
        let node = attachment.node as usize;
        let spring = TargetSpring { stiffness: attachment.stiffness, target: *target };
        right[node] = add_scaled(right[node], 1.0, spring.force(&[x[node]])[0]);
        let factor = dt * dt * attachment.stiffness + dt * attachment.damping;
        add_to(&mut values[diagonal[node]], factor, &IDENTITY);
    }
    for (node, mass) in masses.iter().enumerate() {
        add_to(&mut values[diagonal[node]], mass * (1.0 + dt * damping.mass_rate), &IDENTITY);
        let weight = add_scaled(right[node], *mass, around.gravity);
        right[node] = add_scaled(crate::math::scale(*mass, v[node]), dt, weight);
    }
}

fn add_to(block: &mut Mat3, factor: f64, m: &Mat3) {
    *block = mat_add(block, &mat_scale(factor, m));
}

/// Adds `stiff H + viscous V` of every stencil.
fn add_matrices<S: Stencil<N> + Sync, const N: usize>(
    elements: &Elements<S, N>,
    places: &[Places<N>],
    x: &[Vec3],
    (stiff, viscous): (f64, f64),
    values: &mut [Mat3],
    par: Par,
) {
    let local = |i: usize| {
        let corners = elements.gather(i, x);
        let mut blocks = elements.stencils[i].hessian(&corners, HessianForm::Projected);
        let damping = if viscous > 0.0 { Some(elements.stencils[i].viscosity(&corners)) } else { None };
        for a in 0..N {
            for b in 0..N {
                blocks[a][b] = mat_scale(stiff, &blocks[a][b]);
                if let Some(damping) = &damping {
                    add_to(&mut blocks[a][b], viscous, &damping[a][b]);
                }
            }
        }
        blocks
    };
    if let Par::Serial = par {
        (0..elements.len()).for_each(|i| scatter(&places[i], &local(i), values));
        return;
    }
    let mut start = 0;
    while start < elements.len() {
        let count = CHUNK.min(elements.len() - start);
        let blocks: Vec<Blocks<N>> = par.map_indexed(count, |i| local(start + i));
        (0..count).for_each(|i| scatter(&places[start + i], &blocks[i], values));
        start += count;
    }
}

fn scatter<const N: usize>(places: &Places<N>, blocks: &Blocks<N>, values: &mut [Mat3]) {
    for a in 0..N {
        for b in 0..N {
            let value = &mut values[places[a][b] as usize];
            *value = mat_add(value, &blocks[a][b]);
        }
    }
}

/// Drag `-D (v - wind)`: `dt D` into A, `D wind` into the forces.
fn add_drag(
    forces: &Forces,
    pattern: &Pattern,
    (x, v): (&[Vec3], &[Vec3]),
    wind: Vec3,
    dt: f64,
    values: &mut [Mat3],
    right: &mut [Vec3],
) {
    if forces.drag.coefficient == 0.0 {
        return;
    }
    for (nodes, places) in forces.drag_faces.iter().zip(&pattern.drag) {
        let gather = |a: &[Vec3]| nodes.map(|node| a[node as usize]);
        let blocks = forces.drag.secant(&gather(x), &gather(v), wind);
        for a in 0..3 {
            for b in 0..3 {
                add_to(&mut values[places[a][b] as usize], dt, &blocks[a][b]);
                let node = nodes[a] as usize;
                right[node] = add_scaled(right[node], 1.0, mat_vec(&blocks[a][b], wind));
            }
        }
    }
}
