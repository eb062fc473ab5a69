//! The unconstrained solve against a direct factor.

use crate::random::Random;
use signorini::dynamics::{Assembled, FreeSolver, Surroundings, assemble};
use signorini::energy::{Damping, Forces, Pattern, SheetMaterial, SolidMaterial, Spring};
use signorini::linalg::{BlockMatrix, EnvelopeCholesky};
use signorini::math::{Vec3, add, add_scaled, dot, sub};
use signorini::mesh::TetMesh;
use signorini::parallel::{Par, Pool};

fn norm_of(matrix: &BlockMatrix, v: &[Vec3]) -> f64 {
    (0..v.len()).map(|i| dot(v[i], matrix.row_product(i, v))).sum::<f64>().sqrt()
}

/// A strained sheet of 31 by 31 nodes, some of them pinned: its matrix, right side and pattern, and the old velocities.
fn sheet(young_modulus: f64, damping: Damping) -> (Pattern, Assembled, Vec<Vec3>, Vec<bool>) {
    let n = 31_u32;
    let rest: Vec<Vec3> = (0..n * n).map(|i| [0.02 * f64::from(i % n), 0.02 * f64::from(i / n), 0.0]).collect();
    let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
    let up = n;
    let faces: Vec<[u32; 3]> = cells.flat_map(|k| [[k, k + 1, k + 1 + up], [k, k + 1 + up, k + up]]).collect();
    let material = SheetMaterial {
        density: 200.0,
        thickness: 1e-3,
        young_modulus,
        poisson_ratio: 0.3,
        bending_stiffness: Some(1e-5),
        flat: true,
        rest_scale: 1.0,
        damping,
    };
    let forces = material.shell(&rest, &faces).unwrap();
    let masses = material.lumped_masses(&rest, &faces).unwrap();
    let pattern = Pattern::new(&forces, rest.len());
    let mut random = Random::new(9);
    let x: Vec<Vec3> = rest.iter().map(|p| add_scaled(*p, 2e-3, random.vector())).collect();
    let v: Vec<Vec3> = x.iter().map(|_| random.vector()).collect();
    let mut out = Assembled::default();
    let around = Surroundings { gravity: [0.0, 0.0, -9.81], wind: [0.0; 3] };
    assemble(&forces, &pattern, &masses, (&x, &v), &[], &around, 0.004, &mut out, Par::Serial);
    let pinned = (0..v.len()).map(|i| i % 200 == 7).collect();
    (pattern, out, v, pinned)
}

#[test]
fn what_conjugate_gradients_leave_is_below_the_contact_solvers_tolerance() {
    for (young, stretch_time) in [(1e5, 0.0), (1e6, 0.0), (1e7, 1e-3)] {
        let damping = Damping { mass_rate: 0.1, stretch_time, bending_time: 1e-3 };
        let (pattern, system, old, pinned) = sheet(young, damping);
        let (matrix, right) = (&system.matrix, &system.right);
        let mut change: Vec<Vec3> = (0..old.len())
            .map(|i| if pinned[i] { [0.0; 3] } else { sub(right[i], matrix.row_product(i, &old)) })
            .collect();
        let factor = EnvelopeCholesky::new(matrix, &pattern.envelope, &pinned).unwrap();
        factor.solve(&pattern.envelope, &mut change, &mut Vec::new());
        let exact: Vec<Vec3> = old.iter().zip(&change).map(|(v, d)| add(*v, *d)).collect();
        let mut v = old.clone();
        let guess = |i: usize| add_scaled(old[i], 0.004, [0.0, 0.0, -9.81]);
        let mut solver = FreeSolver::default();
        let (iterated, steps, met) = solver.solve(&pattern, matrix, right, &pinned, guess, &mut v, Par::Serial);
        assert!(iterated && met && steps > 10, "{steps}");
        let error: Vec<Vec3> = v.iter().zip(&exact).map(|(v, e)| sub(*v, *e)).collect();
        let relative = norm_of(matrix, &error) / norm_of(matrix, &change);
        println!("E {young}: {steps} steps, error {relative:.1e}");
        assert!(relative < 5e-3, "E {young}: {relative}");
        assert!((0..v.len()).filter(|i| pinned[*i]).all(|i| v[i] == old[i]));
        // From the answer there is nothing left to do, and the bits are those of the answer.
        let known = v.clone();
        v.clone_from(&old);
        let again = solver.solve(&pattern, matrix, right, &pinned, |i| known[i], &mut v, Par::Serial);
        assert!(again == (true, 0, true) && v == known);
    }
}

/// Nodes of a grid of 40 by 30 by 2, in order or in any other, with everything that acts on nodes.
fn everything(number: impl Fn(u32) -> u32) -> (Forces, Vec<Vec3>) {
    let (n, m) = (40_u32, 30_u32);
    let at = |i: u32, j: u32, k: u32| number(2 * (j * n + i) + k);
    let mut rest = vec![[0.0; 3]; 2 * (n * m) as usize];
    let cells: Vec<(u32, u32)> = (0..m - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j))).collect();
    for (i, j) in (0..m).flat_map(|j| (0..n).map(move |i| (i, j))) {
        for k in 0..2 {
            rest[at(i, j, k) as usize] = [f64::from(i), f64::from(j), f64::from(k)].map(|x| 0.02 * x);
        }
    }
    let damping = Damping { mass_rate: 0.1, stretch_time: 1e-3, bending_time: 1e-3 };
    let faces: Vec<[u32; 3]> = cells
        .iter()
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(*i, *j, 0), at(i + 1, *j, 0), at(i + 1, j + 1, 0), at(*i, j + 1, 0)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let material = SheetMaterial {
        density: 200.0,
        thickness: 1e-3,
        young_modulus: 1e6,
        poisson_ratio: 0.3,
        bending_stiffness: Some(1e-5),
        flat: true,
        rest_scale: 1.0,
        damping,
    };
    let mut forces = material.shell(&rest, &faces).unwrap();
    let tetrahedra = cells.iter().flat_map(|(i, j)| {
        [
            [at(*i, *j, 0), at(i + 1, *j, 0), at(*i, j + 1, 0), at(*i, *j, 1)],
            [at(i + 1, j + 1, 1), at(i + 1, *j, 1), at(*i, j + 1, 1), at(i + 1, j + 1, 0)],
        ]
    });
    let mesh = TetMesh::new(rest.clone(), tetrahedra.collect()).unwrap();
    let solid = SolidMaterial { density: 1e3, young_modulus: 1e5, poisson_ratio: 0.3, rest_scale: 1.0, damping };
    forces.tetrahedra = solid.solid(&mesh).unwrap().tetrahedra;
    for (i, j) in &cells {
        forces.springs.push([at(*i, *j, 1), at(i + 1, j + 1, 1)], Spring { stiffness: 50.0, rest_length: 0.02 });
    }
    (forces, rest)
}

#[test]
fn a_system_has_the_same_bits_on_any_number_of_threads() {
    let mixed = |i: u32| (1009 * i) % 2400;
    for (in_order, (forces, rest)) in [(true, everything(|i| i)), (false, everything(mixed))] {
        let pattern = Pattern::new(&forces, rest.len());
        // Numbers that lie far apart would have every part compute nearly everything.
        assert_eq!(pattern.parts.len(), if in_order { 2 } else { 1 });
        let mut random = Random::new(5);
        let x: Vec<Vec3> = rest.iter().map(|p| add_scaled(*p, 2e-3, random.vector())).collect();
        let v: Vec<Vec3> = x.iter().map(|_| random.vector()).collect();
        let masses = vec![1e-3; x.len()];
        let around = Surroundings { gravity: [0.0, 0.0, -9.81], wind: [1.0, 0.0, 0.0] };
        let system = |par: Par| {
            let mut out = Assembled::default();
            assemble(&forces, &pattern, &masses, (&x, &v), &[], &around, 0.004, &mut out, par);
            let bits = |v: &Vec3| v.map(f64::to_bits);
            let values: Vec<[u64; 3]> = out.matrix.values.iter().flatten().map(bits).collect();
            (values, out.right.iter().map(bits).collect::<Vec<_>>())
        };
        let serial = system(Par::Serial);
        assert!(serial.0.iter().flatten().filter(|bits| **bits != 0).count() > 100_000);
        for threads in [1, 3] {
            let pool = Pool::new(threads).unwrap();
            assert!(serial == system(Par::Pool(&pool)), "{in_order} {threads}");
        }
    }
}
