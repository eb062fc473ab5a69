//! The matrix and right side of a deformable body's step.

use crate::energy::{Elements, Forces, LANES, Part, Pattern, Places, SideBySide, Stencil, TargetSpring};
use crate::linalg::BlockMatrix;
use crate::math::simd::points::gather;
use crate::math::simd::{Kernel, run_wide};
use crate::math::{IDENTITY, Mat3, Vec3, ZERO_MATRIX, add_scaled, mat_add, mat_scale, mat_vec};
use crate::parallel::Par;

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
/// Sums run in the order of the stencils whatever the threads. Cost: one pass over the stencils; on a pool those on
/// borders between parts of [`Pattern`] are computed in each of them.
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
    match par {
        Par::Serial => {
            add_part(forces, pattern, x, dt, &mut Rows { part: &pattern.whole, first_value: 0, values, right });
        }
        Par::Pool(_) => {
            let mut tasks = rows_of_parts(&pattern.parts, row_offsets, values, right);
            par.for_each_task(&mut tasks, |rows| add_part(forces, pattern, x, dt, rows));
        }
    }
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

/// Rows of the system that one task fills.
struct Rows<'a> {
    part: &'a Part,
    /// Place of the first of their values.
    first_value: usize,
    values: &'a mut [Mat3],
    right: &'a mut [Vec3],
}

/// The rows of all parts, which follow each other.
fn rows_of_parts<'a>(
    parts: &'a [Part],
    row_offsets: &[usize],
    mut values: &'a mut [Mat3],
    mut right: &'a mut [Vec3],
) -> Vec<Rows<'a>> {
    let mut tasks = Vec::with_capacity(parts.len());
    for part in parts {
        let first_value = row_offsets[part.nodes.start];
        let own = values.split_at_mut(row_offsets[part.nodes.end] - first_value);
        let own_right = right.split_at_mut(part.nodes.len());
        tasks.push(Rows { part, first_value, values: own.0, right: own_right.0 });
        (values, right) = (own.1, own_right.1);
    }
    tasks
}

/// Adds to some rows what every stencil gives them, kind by kind.
fn add_part(forces: &Forces, pattern: &Pattern, x: &[Vec3], dt: f64, rows: &mut Rows) {
    let damping = forces.damping;
    let (stretch, bend) = ((dt * dt, dt * damping.stretch_time), (dt * dt, dt * damping.bending_time));
    let part = rows.part;
    add_stencils(&forces.springs, &pattern.springs, &part.springs, x, stretch, rows);
    add_stencils(&forces.membranes, &pattern.membranes, &part.membranes, x, stretch, rows);
    add_stencils(&forces.hinges, &pattern.hinges, &part.hinges, x, bend, rows);
    add_stencils(&forces.tetrahedra, &pattern.tetrahedra, &part.tetrahedra, x, stretch, rows);
}

/// Adds the forces of the stencils `list`, and `stiff H + viscous V`, in its order.
fn add_stencils<S: Stencil<N>, const N: usize>(
    elements: &Elements<S, N>,
    places: &[Places<N>],
    list: &[u32],
    x: &[Vec3],
    factors: (f64, f64),
    rows: &mut Rows,
) {
    run_wide(AddAll { elements, places, list, x, factors, rows });
}

struct AddAll<'a, 'r, S, const N: usize> {
    elements: &'a Elements<S, N>,
    places: &'a [Places<N>],
    list: &'a [u32],
    x: &'a [Vec3],
    factors: (f64, f64),
    rows: &'a mut Rows<'r>,
}

impl<S: Stencil<N>, const N: usize> Kernel for AddAll<'_, '_, S, N> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        // Where all rows are here none has to be asked for.
        if self.rows.right.len() == self.x.len() { self.add::<true>() } else { self.add::<false>() }
    }
}

impl<S: Stencil<N>, const N: usize> AddAll<'_, '_, S, N> {
    #[inline(always)]
    fn add<const ALL: bool>(self) {
        let AddAll { elements, places, list, x, factors, rows } = self;
        for group in list.chunks(LANES) {
            // Lanes beyond the last stencil repeat it.
            let of_lane: [usize; LANES] = std::array::from_fn(|lane| group[lane.min(group.len() - 1)] as usize);
            let nodes = of_lane.map(|i| elements.nodes[i].map(|node| node as usize));
            let stencils = of_lane.map(|i| &elements.stencils[i]);
            let four = S::side_by_side(stencils, &gather(x, &nodes), factors.0, factors.1);
            for (lane, number) in of_lane.into_iter().take(group.len()).enumerate() {
                scatter::<N, ALL>(&nodes[lane], &places[number], &four, lane, rows);
            }
        }
    }
}

/// Adds one of the stencils side by side to the rows that are here.
#[inline(always)]
fn scatter<const N: usize, const ALL: bool>(
    nodes: &[usize; N],
    places: &Places<N>,
    four: &SideBySide<N>,
    lane: usize,
    rows: &mut Rows,
) {
    let Rows { part, first_value, values, right } = rows;
    let here = nodes.map(|node| ALL || part.nodes.contains(&node));
    let place = |a: usize, b: usize| places[a][b] as usize - *first_value;
    for a in 0..N {
        for b in 0..a {
            let block = four.blocks[a][b].map(|row| row.map(|x| x.0[lane]));
            if here[a] {
                let value = &mut values[place(a, b)];
                (0..3).for_each(|r| (0..3).for_each(|c| value[r][c] += block[r][c]));
            }
            if here[b] {
                let value = &mut values[place(b, a)];
                (0..3).for_each(|r| (0..3).for_each(|c| value[r][c] += block[c][r]));
            }
        }
        if here[a] {
            let force = &mut right[nodes[a] - part.nodes.start];
            (0..3).for_each(|c| force[c] += four.forces[a][c].0[lane]);
            let value = &mut values[place(a, a)];
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
