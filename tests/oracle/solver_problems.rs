//! Contact problems made here: random, but of the kinds that hurt.

use super::random::Random;
use signorini::constraint::{Angular, RowSet};
use signorini::implicit_contact::{ContactProblem, SolverReport, SolverScratch, solve};
use signorini::linalg::BlockMatrix;
use signorini::math::{Mat3, Vec3, add_scaled, cross, dot, inverse, norm, scale, sub, tangents, unit};
use signorini::model::{Settings, SolverChoice};
use signorini::parallel::Par;

/// A problem under construction, then owned.
#[derive(Clone, Default)]
pub struct Made {
    /// Lower and upper blocks alike: `entries[i]` maps a column to a block.
    entries: Vec<std::collections::BTreeMap<u32, Mat3>>,
    pub matrix: BlockMatrix,
    pub inverse: Vec<Mat3>,
    pub rows: RowSet,
    /// v*
    pub velocities: Vec<Vec3>,
}

impl Made {
    pub fn new() -> Made {
        let rows = RowSet { offsets: vec![0], angular_offsets: vec![0], ..RowSet::default() };
        Made { rows, ..Made::default() }
    }

    /// A block with this diagonal; zero for infinite mass.
    pub fn block(&mut self, diagonal: Mat3, velocity: Vec3) -> u32 {
        let b = self.entries.len() as u32;
        self.entries.push([(b, diagonal)].into());
        self.velocities.push(velocity);
        b
    }

    pub fn couple(&mut self, i: u32, j: u32, m: Mat3) {
        let e = self.entries[i as usize].entry(j).or_insert([[0.0; 3]; 3]);
        for r in 0..3 {
            e[r] = add_scaled(e[r], 1.0, m[r]);
        }
    }

    /// `k q q^T` with weights times a direction: a rank-one element.
    pub fn element(&mut self, stencil: &[(u32, Vec3)], k: f64) {
        for (i, a) in stencil {
            for (j, b) in stencil {
                self.couple(*i, *j, [0, 1, 2].map(|r| scale(k * a[r], *b)));
            }
        }
    }

    pub fn finish(&mut self) {
        self.matrix = BlockMatrix { row_offsets: vec![0], ..BlockMatrix::default() };
        for (i, row) in self.entries.iter().enumerate() {
            for (j, m) in row {
                if *j as usize == i {
                    self.matrix.diagonal.push(self.matrix.columns.len());
                }
                self.matrix.columns.push(*j);
                self.matrix.values.push(*m);
            }
            self.matrix.row_offsets.push(self.matrix.columns.len());
        }
        self.inverse =
            (0..self.entries.len()).map(|b| inverse(self.matrix.diagonal_block(b)).unwrap_or([[0.0; 3]; 3])).collect();
    }

    /// A contact that demands `n · u >= bound`, `u` being the relative velocity of the entries with v* included.
    pub fn contact(
        &mut self,
        linear: &[(u32, f64)],
        angular: &[(u32, Vec3)],
        normal: Vec3,
        (bound, friction): (f64, f64),
    ) {
        let rows = &mut self.rows;
        for (b, w) in linear {
            rows.blocks.push(*b);
            rows.weights.push(*w);
        }
        for (b, lever) in angular {
            rows.angular.push(Angular { block: *b, lever: *lever });
        }
        rows.offsets.push(rows.blocks.len() as u32);
        rows.angular_offsets.push(rows.angular.len() as u32);
        let i = rows.frames.len();
        let n = unit(normal).unwrap();
        rows.frames.push([n; 3]);
        let u = rows.relative_velocity(i, &self.velocities);
        let sliding = add_scaled(u, -dot(n, u), n);
        let t1 = unit(sliding).filter(|_| norm(sliding) > 1e-9 * norm(u)).unwrap_or(tangents(n).0);
        let t2 = cross(n, t1);
        rows.frames[i] = [n, t1, t2];
        rows.normal_targets.push(bound - dot(n, u));
        rows.sliding_velocities.push([dot(t1, u), dot(t2, u)]);
        rows.friction.push(friction);
    }

    pub fn view(&self) -> ContactProblem<'_> {
        ContactProblem {
            matrix: &self.matrix,
            inverse_diagonal: &self.inverse,
            rows: &self.rows,
            translations: None,
            velocity_scale: self.velocities.iter().map(|v| norm(*v)).fold(0.0, f64::max),
        }
    }

    pub fn without_friction(mut self) -> Made {
        self.rows.friction.fill(0.0);
        self
    }

    pub fn zeros(&self) -> (Vec<Vec3>, Vec<Vec3>) {
        (vec![[0.0; 3]; self.rows.len()], vec![[0.0; 3]; self.matrix.rows()])
    }

    /// A cold solve: multipliers, dv, report.
    pub fn solve(&self, settings: &Settings) -> (Vec<Vec3>, Vec<Vec3>, SolverReport) {
        self.solve_on(settings, Par::Serial)
    }

    pub fn solve_on(&self, settings: &Settings, par: Par) -> (Vec<Vec3>, Vec<Vec3>, SolverReport) {
        let (mut p, mut dv) = self.zeros();
        let report = solve(&self.view(), &mut p, &mut dv, settings, &mut SolverScratch::default(), par);
        (p, dv, report)
    }

    pub fn energy(&self, v: &[Vec3]) -> f64 {
        (0..v.len()).map(|i| dot(v[i], self.matrix.row_product(i, v))).sum()
    }

    /// `|a - b|_A / |b|_A`
    pub fn error(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        let e: Vec<Vec3> = a.iter().zip(b).map(|(a, b)| sub(*a, *b)).collect();
        (self.energy(&e) / self.energy(b)).sqrt()
    }
}

pub fn isotropic(m: f64) -> Mat3 {
    [[m, 0.0, 0.0], [0.0, m, 0.0], [0.0, 0.0, m]]
}

/// A folded sheet of `n` x `n` vertices: stretch, fourth-order bending, one half falling on the other.
pub fn folded_sheet(n: usize, stretch: f64, random: &mut Random) -> Made {
    let mut made = Made::new();
    let at = |x: usize, y: usize| (y * n + x) as u32;
    for y in 0..n {
        for x in 0..n {
            let toward = if x < n / 2 { -1.0 } else { 1.0 };
            let wave = (0.7 * x as f64).sin() + (0.5 * y as f64).cos();
            let swirl = [0.3 * wave, 0.2 * (0.4 * y as f64).sin(), toward * (0.4 + 0.2 * wave)];
            made.block(isotropic(1.0), add_scaled(swirl, 0.05, random.vector()));
        }
    }
    let line = |made: &mut Made, a: u32, b: u32, c: Option<u32>, random: &mut Random| {
        let d = unit(add_scaled([1.0, 0.3, 0.0], 0.5, random.vector())).unwrap();
        made.element(&[(a, d), (b, scale(-1.0, d))], stretch);
        for axis in 0..3 {
            let mut e = [0.0; 3];
            e[axis] = 1.0;
            made.element(&[(a, e), (b, scale(-1.0, e))], 0.05 * stretch);
            if let Some(c) = c {
                // Second differences: the square is a fourth-order operator.
                made.element(&[(a, e), (b, scale(-2.0, e)), (c, e)], 0.02 * stretch);
            }
        }
    };
    for y in 0..n {
        for x in 0..n - 1 {
            line(&mut made, at(x, y), at(x + 1, y), (x + 2 < n).then(|| at(x + 2, y)), random);
            line(&mut made, at(y, x), at(y, x + 1), (x + 2 < n).then(|| at(y, x + 2)), random);
        }
    }
    made.finish();
    for y in 0..n - 1 {
        for x in 0..n / 2 - 1 {
            // A vertex of the falling half on a triangle of the lying one.
            let (mirror, a, b) = (n - 1 - x, random.unit(), random.unit());
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let triangle = [(at(mirror, y), a), (at(mirror - 1, y), b), (at(mirror, y + 1), 1.0 - a - b)];
            let mut entries = vec![(at(x, y), -1.0)];
            entries.extend(triangle);
            // The first half moves down, the second up from below: `triangle - vertex` must not grow along z.
            let normal = add_scaled([0.0, 0.0, -1.0], 0.3, random.vector());
            made.contact(&entries, &[], normal, (-0.2 * random.unit(), 0.3));
        }
    }
    made
}

/// Blocks in elements of four with volume-like terms: `2 D - A` is not positive definite.
pub fn tetrahedra(count: usize, random: &mut Random) -> Made {
    let mut made = Made::new();
    for _ in 0..count + 3 {
        made.block(isotropic(0.1), random.vector());
    }
    for e in 0..count as u32 {
        let stencil: Vec<(u32, Vec3)> = (0..4).map(|k| (e + k, random.vector())).collect();
        made.element(&stencil, 10.0);
    }
    made.finish();
    for _ in 0..count {
        let (a, b) = (random.pick(count) as u32, random.pick(count) as u32);
        if a != b {
            made.contact(&[(a, 1.0), (b, -1.0)], &[], random.vector(), (-0.3 * random.unit(), 0.4));
        }
    }
    made
}

/// A sheet, rigid bodies lying on it, an immovable ground, rows twice and rows that oppose each other.
pub fn mixed(n: usize, random: &mut Random) -> Made {
    let mut made = folded_sheet(n, 20.0, random);
    let sheet = made.entries.len() as u32;
    let ground = made.block([[0.0; 3]; 3], [0.0; 3]);
    for _ in 0..3 {
        let linear = made.block(isotropic(25.0), [0.1, 0.0, -0.5]);
        let angular = made.block([[0.5, 0.1, 0.0], [0.1, 0.4, 0.0], [0.0, 0.0, 0.7]], random.vector());
        made.finish();
        for _ in 0..12 {
            let lever = scale(0.3, random.vector());
            let vertex = random.pick(sheet as usize) as u32;
            let normal = add_scaled([0.0, 0.0, 1.0], 0.2, random.vector());
            made.contact(&[(linear, 1.0), (vertex, -1.0)], &[(angular, lever)], normal, (-0.1, 0.5));
            if random.unit() < 0.5 {
                // Once more, and once against it with room between.
                made.contact(&[(linear, 1.0), (vertex, -1.0)], &[(angular, lever)], normal, (-0.1, 0.5));
                let back = scale(-1.0, normal);
                made.contact(&[(linear, 1.0), (vertex, -1.0)], &[(angular, lever)], back, (-0.2, 0.5));
            }
        }
    }
    made.finish();
    for v in 0..sheet {
        if v % 7 == 0 {
            made.contact(&[(v, 1.0), (ground, -1.0)], &[], [0.0, 0.0, 1.0], (-0.05, 0.3));
        }
    }
    made
}

/// Rigid boxes in a stack on the ground, four contacts between neighbours; lumped and rigid blocks only.
pub fn rigid_stack(count: usize) -> Made {
    let mut made = Made::new();
    for k in 0..count {
        let m = 1.0 + 0.3 * k as f64;
        made.block(isotropic(m), [0.02 * k as f64, 0.01, -0.1]);
        made.block(isotropic(m / 6.0), [0.0; 3]);
    }
    made.finish();
    for k in 0..count as u32 {
        for (x, y) in [(0.5, 0.5), (-0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)] {
            let (mut linear, mut angular) = (vec![(2 * k, 1.0)], vec![(2 * k + 1, [x, y, -0.5])]);
            if k > 0 {
                linear.push((2 * k - 2, -1.0));
                angular.push((2 * k - 1, [-x, -y, -0.5]));
            }
            made.contact(&linear, &angular, [0.0, 0.0, 1.0], (0.0, 0.5));
        }
    }
    made
}

/// Tolerances as tight as the arithmetic allows.
pub fn tight(solver: SolverChoice) -> Settings {
    Settings {
        solver,
        contact_tolerance: 1e-10,
        velocity_tolerance: 1e-8,
        iterations_max: 60_000,
        ..Settings::default()
    }
}
