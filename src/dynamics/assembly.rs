//! The matrix and right side of a deformable body's step.

use crate::energy::{Elements, Forces, LANES, Pattern, Places, SideBySide, Stencil, TargetSpring};
use crate::linalg::BlockMatrix;
use crate::math::simd::points::gather;
use crate::math::simd::{Kernel, run_wide};
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
    let BlockMatrix { row_offsets, columns, diagonal, .. } = &pattern.matrix;
    matrix.row_offsets.clone_from(row_offsets);
    matrix.columns.clone_from(columns);
    matrix.diagonal.clone_from(diagonal);
    matrix.values.clear();
    matrix.values.resize(columns.len(), ZERO_MATRIX);
    let BlockMatrix { values, diagonal, .. } = matrix;
    right.clear();
    right.resize(masses.len(), [0.0; 3]);
    let damping = forces.damping;
    let (stretch, bend) = (dt * damping.stretch_time, dt * damping.bending_time);
    add_stencils(&forces.springs, &pattern.springs, x, (dt * dt, stretch), (values, right), par);
    add_stencils(&forces.membranes, &pattern.membranes, x, (dt * dt, stretch), (values, right), par);
    add_stencils(&forces.hinges, &pattern.hinges, x, (dt * dt, bend), (values, right), par);
    add_stencils(&forces.tetrahedra, &pattern.tetrahedra, x, (dt * dt, stretch), (values, right), par);
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

/// Adds the forces of every stencil, and `stiff H + viscous V`, in the order of the stencils.
fn add_stencils<S: Stencil<N> + Sync, const N: usize>(
    elements: &Elements<S, N>,
    places: &[Places<N>],
    x: &[Vec3],
    factors: (f64, f64),
    (values, right): (&mut [Mat3], &mut [Vec3]),
    par: Par,
) {
    if let Par::Serial = par {
        run_wide(AddAll { elements, places, x, factors, values, right });
        return;
    }
    let mut start = 0;
    while start < elements.len() {
        let count = CHUNK.min(elements.len() - start);
        let groups: Vec<SideBySide<N>> = par
            .map_indexed(count.div_ceil(LANES), |i| run_wide(Four { elements, x, factors, first: start + LANES * i }));
        for (i, four) in groups.iter().enumerate() {
            scatter(elements, places, start + LANES * i, four, values, right);
        }
        start += count;
    }
}

struct Four<'a, S, const N: usize> {
    elements: &'a Elements<S, N>,
    x: &'a [Vec3],
    factors: (f64, f64),
    first: usize,
}

impl<S: Stencil<N>, const N: usize> Kernel for Four<'_, S, N> {
    type Output = SideBySide<N>;
    #[inline(always)]
    fn run(self) -> SideBySide<N> {
        let Four { elements, x, factors, first } = self;
        // Lanes beyond the last stencil repeat it.
        let of_lane: [usize; LANES] = std::array::from_fn(|lane| (first + lane).min(elements.len() - 1));
        let nodes = of_lane.map(|i| elements.nodes[i].map(|node| node as usize));
        S::side_by_side(of_lane.map(|i| &elements.stencils[i]), &gather(x, &nodes), factors.0, factors.1)
    }
}

struct AddAll<'a, S, const N: usize> {
    elements: &'a Elements<S, N>,
    places: &'a [Places<N>],
    x: &'a [Vec3],
    factors: (f64, f64),
    values: &'a mut [Mat3],
    right: &'a mut [Vec3],
}

impl<S: Stencil<N>, const N: usize> Kernel for AddAll<'_, S, N> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let AddAll { elements, places, x, factors, values, right } = self;
        for first in (0..elements.len()).step_by(LANES) {
            let four = Four { elements, x, factors, first }.run();
            scatter(elements, places, first, &four, values, right);
        }
    }
}

#[inline(always)]
fn scatter<S, const N: usize>(
    elements: &Elements<S, N>,
    places: &[Places<N>],
    first: usize,
    four: &SideBySide<N>,
    values: &mut [Mat3],
    right: &mut [Vec3],
) {
    for (lane, (nodes, places)) in elements.nodes[first..].iter().zip(&places[first..]).take(LANES).enumerate() {
        for a in 0..N {
            let force = &mut right[nodes[a] as usize];
            (0..3).for_each(|c| force[c] += four.forces[a][c].0[lane]);
            for b in 0..a {
                let block = four.blocks[a][b].map(|row| row.map(|x| x.0[lane]));
                let value = &mut values[places[a][b] as usize];
                (0..3).for_each(|r| (0..3).for_each(|c| value[r][c] += block[r][c]));
                let value = &mut values[places[b][a] as usize];
                (0..3).for_each(|r| (0..3).for_each(|c| value[r][c] += block[c][r]));
            }
            let value = &mut values[places[a][a] as usize];
            (0..3).for_each(|r| (0..3).for_each(|c| value[r][c] += four.blocks[a][a][r][c].0[lane]));
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
