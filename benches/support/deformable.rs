//! Elastic bodies with lumped masses, and one linearised backward Euler step of them.

use super::bending::Bending;
use super::conjugate_gradient;
use super::membrane::Membrane;
use super::shapes::{Tetrahedra, Triangles};
use super::tetrahedra::Corotational;
use signorini::linalg::BlockMatrix;
use signorini::math::{Mat3, Vec3, add_scaled, mat_scale, scale};
use signorini::parallel::Par;

/// Material numbers of a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// Mass per area `[kg/m^2]`.
    pub density: f64,
    /// Two-dimensional Young modulus `[N/m]`.
    pub young: f64,
    /// Poisson ratio.
    pub poisson: f64,
    /// Plate stiffness `[N m]`.
    pub rigidity: f64,
}

/// The cloth of the comparison scenes.
pub const CLOTH: Sheet = Sheet { density: 0.2, young: 1e3, poisson: 0.3, rigidity: 1e-5 };

/// Material numbers of a solid.
#[derive(Clone, Copy, Debug)]
pub struct Solid {
    /// Mass per volume `[kg/m^3]`.
    pub density: f64,
    /// Young modulus `[Pa]`.
    pub young: f64,
    /// Poisson ratio.
    pub poisson: f64,
}

/// One or more elastic bodies over one vertex list.
#[derive(Clone, Debug)]
pub struct Deformable {
    /// Lumped masses `[kg]`.
    pub masses: Vec<f64>,
    /// Stiffness-proportional damping: the time that multiplies the stiffness `[s]`.
    pub damping_time: f64,
    membrane: Option<Membrane>,
    bending: Bending,
    solid: Option<Corotational>,
    pattern: BlockMatrix,
    /// Constant part of the stiffness, per block of the pattern.
    constant: Vec<Mat3>,
    /// Block of the pattern per entry of the varying element stiffness, in order.
    slots: Vec<u32>,
}

/// `A v = b`, backward Euler linearised at the start of the step [Otaduy09, Eq. 3].
#[derive(Clone, Debug)]
pub struct LinearStep {
    pub matrix: BlockMatrix,
    pub right_hand_side: Vec<Vec3>,
    /// `v* = A^-1 b`.
    pub velocities: Vec<Vec3>,
}

impl Deformable {
    /// A sheet, flat at rest.
    pub fn sheet(rest: &Triangles, material: Sheet) -> Deformable {
        let membrane = Membrane::new(&rest.positions, &rest.faces, material.young, material.poisson);
        let bending = Bending::new(&rest.positions, &rest.faces, material.rigidity);
        let mut masses = vec![0.0; rest.positions.len()];
        membrane.add_masses(material.density, &mut masses);
        Self::with_pattern(masses, Some(membrane), bending, None)
    }

    /// Solids.
    pub fn solid(rest: &Tetrahedra, material: Solid) -> Deformable {
        let solid = Corotational::new(&rest.positions, &rest.tetrahedra, material.young, material.poisson);
        let mut masses = vec![0.0; rest.positions.len()];
        solid.add_masses(material.density, &mut masses);
        Self::with_pattern(masses, None, Bending::default(), Some(solid))
    }

    fn with_pattern(
        masses: Vec<f64>,
        membrane: Option<Membrane>,
        bending: Bending,
        solid: Option<Corotational>,
    ) -> Deformable {
        let mut varying: Vec<[u32; 2]> = Vec::new();
        let pairs = |s: &[u32], out: &mut Vec<[u32; 2]>| {
            out.extend(s.iter().flat_map(|&a| s.iter().map(move |&b| [a, b])));
        };
        membrane.iter().flat_map(|m| m.stencils()).for_each(|s| pairs(&s, &mut varying));
        solid.iter().flat_map(|m| m.stencils()).for_each(|s| pairs(&s, &mut varying));
        let mut bent: Vec<[u32; 2]> = Vec::new();
        bending.stencils().for_each(|s| pairs(&s, &mut bent));
        let n = masses.len() as u32;
        let mut all: Vec<[u32; 2]> = (0..n).map(|i| [i, i]).chain(varying.iter().chain(&bent).copied()).collect();
        all.sort_unstable();
        all.dedup();
        let mut pattern = BlockMatrix { row_offsets: vec![0; n as usize + 1], ..BlockMatrix::default() };
        for (k, [i, j]) in all.iter().enumerate() {
            pattern.row_offsets[*i as usize + 1] = k + 1;
            pattern.columns.push(*j);
            if i == j {
                pattern.diagonal.push(k);
            }
        }
        pattern.values = vec![[[0.0; 3]; 3]; all.len()];
        let slot = |pair: &[u32; 2]| all.binary_search(pair).unwrap_or(usize::MAX) as u32;
        let slots = varying.iter().map(slot).collect();
        let mut constant = pattern.values.clone();
        let mut next = bent.iter().map(slot);
        bending.add_stiffness(|_, _, _, s| {
            if let Some(k) = next.next() {
                for (i, row) in constant[k as usize].iter_mut().enumerate() {
                    row[i] += s;
                }
            }
        });
        Deformable { masses, damping_time: 0.0, membrane, bending, solid, pattern, constant, slots }
    }

    /// Elastic energy `[J]`.
    pub fn elastic_energy(&self, x: &[Vec3]) -> f64 {
        let membrane = self.membrane.as_ref().map_or(0.0, |m| m.energy(x));
        membrane + self.bending.energy(x) + self.solid.as_ref().map_or(0.0, |m| m.energy(x))
    }

    /// Elastic forces `[N]`.
    pub fn elastic_forces(&self, x: &[Vec3]) -> Vec<Vec3> {
        let mut forces = vec![[0.0; 3]; x.len()];
        self.membrane.iter().for_each(|m| m.add_forces(x, &mut forces));
        self.bending.add_forces(x, &mut forces);
        self.solid.iter().for_each(|m| m.add_forces(x, &mut forces));
        forces
    }

    /// Positive semi-definite stiffness `[N/m]`.
    pub fn stiffness(&self, x: &[Vec3]) -> BlockMatrix {
        let mut k = BlockMatrix { values: self.constant.clone(), ..self.pattern.clone() };
        let mut slots = self.slots.iter();
        let mut add = |block: &Mat3| {
            if let Some(&slot) = slots.next() {
                let target = &mut k.values[slot as usize];
                *target = signorini::math::mat_add(target, block);
            }
        };
        self.membrane.iter().for_each(|m| m.add_stiffness(x, |_, _, _, block| add(block)));
        self.solid.iter().for_each(|m| m.add_stiffness(x, |_, _, _, block| add(block)));
        k
    }

    /// `A = M + dt (dt + damping) K`, `b = dt F + M v0 + dt damping K v0` and its solution.
    pub fn linear_step(&self, x: &[Vec3], v: &[Vec3], gravity: Vec3, dt: f64) -> LinearStep {
        self.linear_step_with(x, v, gravity, dt, &[])
    }

    /// The same with some vertices held: zero velocity, coupled to nothing.
    pub fn linear_step_with(&self, x: &[Vec3], v: &[Vec3], gravity: Vec3, dt: f64, held: &[usize]) -> LinearStep {
        let mut matrix = self.stiffness(x);
        let mut b = self.elastic_forces(x);
        let mut damped = vec![[0.0; 3]; x.len()];
        if self.damping_time > 0.0 {
            matrix.product(v, &mut damped, Par::Serial);
        }
        let factor = dt * (dt + self.damping_time);
        matrix.values.iter_mut().for_each(|block| *block = mat_scale(factor, block));
        let mut velocities = Vec::with_capacity(x.len());
        for (i, &mass) in self.masses.iter().enumerate() {
            let diagonal = &mut matrix.values[matrix.diagonal[i]];
            for (c, row) in diagonal.iter_mut().enumerate() {
                row[c] += mass;
            }
            let falling = add_scaled(v[i], dt, gravity);
            velocities.push(falling);
            b[i] = add_scaled(add_scaled(scale(dt, b[i]), mass, falling), dt * self.damping_time, damped[i]);
        }
        hold(&mut matrix, held);
        for &i in held {
            b[i] = [0.0; 3];
            velocities[i] = [0.0; 3];
        }
        conjugate_gradient::solve(&matrix, &b, &mut velocities, 1e-11);
        LinearStep { matrix, right_hand_side: b, velocities }
    }
}

/// Uncouples the held vertices.
fn hold(matrix: &mut BlockMatrix, held: &[usize]) {
    if held.is_empty() {
        return;
    }
    for row in 0..matrix.rows() {
        for k in matrix.row_offsets[row]..matrix.row_offsets[row + 1] {
            let column = matrix.columns[k] as usize;
            if column != row && (held.contains(&row) || held.contains(&column)) {
                matrix.values[k] = [[0.0; 3]; 3];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{cloth_grid, solid_box};
    use super::*;
    use signorini::math::{add, dot, norm, sub};

    fn ruffled(rest: &[Vec3], amount: f64) -> Vec<Vec3> {
        let wave = |i: usize, k: f64| amount * (k * i as f64 + 0.3 * k).sin();
        rest.iter().enumerate().map(|(i, p)| add(*p, [wave(i, 1.7), wave(i, 2.9), wave(i, 0.8)])).collect()
    }

    fn bodies() -> Vec<(Deformable, Vec<Vec3>)> {
        let cloth = cloth_grid(6, 0.3);
        let block = solid_box([0.0; 3], [1, 2, 1], 0.1);
        let rubber = Solid { density: 1000.0, young: 5e5, poisson: 0.3 };
        vec![
            (Deformable::sheet(&cloth, Sheet { rigidity: 0.05, ..CLOTH }), cloth.positions),
            (Deformable::solid(&block, rubber), block.positions),
        ]
    }

    #[test]
    fn forces_are_the_negative_gradient_of_the_energy() {
        for (body, rest) in bodies() {
            let x = ruffled(&rest, 0.01);
            let forces = body.elastic_forces(&x);
            let largest = forces.iter().map(|f| norm(*f)).fold(0.0, f64::max);
            let h = 1e-6;
            for i in 0..x.len() {
                for c in 0..3 {
                    let (mut low, mut high) = (x.clone(), x.clone());
                    low[i][c] -= h;
                    high[i][c] += h;
                    let slope = (body.elastic_energy(&high) - body.elastic_energy(&low)) / (2.0 * h);
                    assert!((slope + forces[i][c]).abs() < 1e-6 * largest, "{i} {c} {slope} {}", forces[i][c]);
                }
            }
        }
    }

    #[test]
    fn stiffness_is_the_derivative_of_the_forces_where_nothing_is_projected() {
        for (body, rest) in bodies() {
            // A stretched sheet has no compressive stress; a rotated solid at rest has no stress at all.
            let turn = |p: &Vec3| [1.0 + p[1], 2.0 - p[0], p[2]];
            let stretched: Vec<Vec3> = ruffled(&rest, 0.002).iter().map(|p| scale(1.2, *p)).collect();
            let x = if body.membrane.is_some() { stretched } else { rest.iter().map(turn).collect() };
            let k = body.stiffness(&x);
            let w = ruffled(&vec![[0.0; 3]; x.len()], 1.0);
            let h = 1e-7;
            let moved = |s: f64| -> Vec<Vec3> { (0..x.len()).map(|i| add_scaled(x[i], s, w[i])).collect() };
            let (low, high) = (body.elastic_forces(&moved(-h)), body.elastic_forces(&moved(h)));
            let mut product = vec![[0.0; 3]; x.len()];
            k.product(&w, &mut product, Par::Serial);
            let largest = product.iter().map(|f| norm(*f)).fold(0.0, f64::max);
            for i in 0..x.len() {
                let slope = scale(-1.0 / (2.0 * h), sub(high[i], low[i]));
                assert!(norm(sub(slope, product[i])) < 1e-5 * largest, "{i} {slope:?} {:?}", product[i]);
            }
        }
    }

    #[test]
    fn stiffness_is_symmetric_and_not_negative_under_compression() {
        for (body, rest) in bodies() {
            let x: Vec<Vec3> = ruffled(&rest, 0.004).iter().map(|p| scale(0.8, *p)).collect();
            let k = body.stiffness(&x);
            let mut product = vec![[0.0; 3]; x.len()];
            for frequency in 1..20 {
                let w = ruffled(&vec![[0.0; 3]; x.len()], 1.0 / f64::from(frequency));
                let u: Vec<Vec3> = (0..x.len()).map(|i| [(i * frequency as usize) as f64 % 3.0, 0.0, 1.0]).collect();
                k.product(&w, &mut product, Par::Serial);
                let (ww, uw) = (conjugate_gradient::inner(&w, &product), conjugate_gradient::inner(&u, &product));
                assert!(ww >= 0.0);
                k.product(&u, &mut product, Par::Serial);
                let wu = conjugate_gradient::inner(&w, &product);
                assert!((uw - wu).abs() <= 1e-11 * uw.abs().max(wu.abs()).max(ww));
            }
        }
    }

    #[test]
    fn a_linear_step_solves_its_system_and_keeps_momentum() {
        for (mut body, rest) in bodies() {
            body.damping_time = 0.003;
            let x = ruffled(&rest, 0.003);
            let v = ruffled(&vec![[0.1, 0.2, 0.3]; x.len()], 0.5);
            let step = body.linear_step(&x, &v, [0.0, 0.0, -9.81], 0.004);
            let mut av = vec![[0.0; 3]; x.len()];
            step.matrix.product(&step.velocities, &mut av, Par::Serial);
            let size: f64 = step.right_hand_side.iter().map(|b| dot(*b, *b)).sum();
            let left: f64 = (0..x.len()).map(|i| norm(sub(av[i], step.right_hand_side[i])).powi(2)).sum();
            assert!(left < 1e-18 * size, "{left} {size}");
            let momentum = |v: &[Vec3]| (0..x.len()).fold([0.0; 3], |s, i| add_scaled(s, body.masses[i], v[i]));
            let mass: f64 = body.masses.iter().sum();
            let expected = add_scaled(momentum(&v), 0.004 * mass, [0.0, 0.0, -9.81]);
            assert!(norm(sub(momentum(&step.velocities), expected)) < 1e-9 * mass);
        }
    }
}
