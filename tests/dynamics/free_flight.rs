//! Bodies torn far out of shape and let go, with nothing to push them: what happens to their energy.

use crate::random::Random;
use crate::scenes::{NO_DAMPING, block, grid, sheet_material, solid_material};
use signorini::dynamics::{Assembled, FreeSolver, Surroundings, assemble};
use signorini::energy::{Damping, Forces, Pattern, SheetMaterial, SolidMaterial};
use signorini::math::{Vec3, add_scaled, norm_squared};
use signorini::mesh::TetMesh;
use signorini::parallel::Par;

const DT: f64 = 1.0 / 480.0;

/// Kinetic and elastic energy `[J]` from rest, before each of the steps and after the last.
fn flight(forces: &Forces, masses: &[f64], start: Vec<Vec3>, steps: usize) -> Vec<f64> {
    let pattern = Pattern::new(forces, start.len());
    let (mut x, mut v, free) = (start, vec![[0.0; 3]; masses.len()], vec![false; masses.len()]);
    let (mut solver, mut system) = (FreeSolver::default(), Assembled::default());
    let around = Surroundings { gravity: [0.0; 3], wind: [0.0; 3] };
    let energy = |x: &[Vec3], v: &[Vec3]| {
        let kinetic: f64 = masses.iter().zip(v).map(|(m, v)| 0.5 * m * norm_squared(*v)).sum();
        kinetic + forces.elastic_energy(x)
    };
    let mut out = vec![energy(&x, &v)];
    for step in 0..steps {
        assemble(forces, &pattern, masses, (&x, &v), &[], &around, DT, &mut system, Par::Serial);
        let old = v.clone();
        let (matrix, right) = (&system.matrix, &system.right);
        let (.., met) = solver.solve(&pattern, matrix, right, &free, |i| old[i], &mut v, Par::Serial);
        assert!(met, "step {step}");
        x.iter_mut().zip(&v).for_each(|(x, v)| *x = add_scaled(*x, DT, *v));
        out.push(energy(&x, &v));
    }
    out
}

/// Largest growth in a step, as a share of the first.
fn largest_growth(energies: &[f64]) -> f64 {
    energies.windows(2).map(|e| (e[1] - e[0]) / energies[0]).fold(f64::NEG_INFINITY, f64::max)
}

fn cloth(poisson_ratio: f64, stretch_time: f64) -> (Vec<Vec3>, Forces, Vec<f64>) {
    let material = SheetMaterial {
        density: 300.0,
        young_modulus: 1e5,
        poisson_ratio,
        bending_stiffness: Some(1e-6),
        damping: Damping { stretch_time, ..NO_DAMPING },
        ..sheet_material()
    };
    let (rest, faces) = grid(8, 8, 0.1, 0.1);
    let (forces, masses) = (material.shell(&rest, &faces).unwrap(), material.lumped_masses(&rest, &faces).unwrap());
    (rest, forces, masses)
}

/// One step is one Newton iteration, so that a sheet that snaps back through itself may gain a little where it folds.
#[test]
fn a_sheet_stretched_forty_times_snaps_back() {
    for (stretch, poisson_ratio, least) in
        [(1.5, 0.3, 0.0), (6.0, 0.3, 0.0), (40.0, 0.0, 1e-3), (40.0, 0.3, 1e-3), (40.0, 0.45, 1e-3)]
    {
        let (rest, forces, masses) = cloth(poisson_ratio, 0.0);
        let mut random = Random::new(3);
        let start = rest.iter().map(|p| add_scaled([stretch * p[0], p[1], p[2]], 1e-3, random.vector())).collect();
        let energies = flight(&forces, &masses, start, 100);
        let growth = largest_growth(&energies);
        println!(
            "stretched {stretch}, Poisson's ratio {poisson_ratio}: {growth:.1e}, in the end {:.1e}",
            energies[100]
        );
        assert!(growth <= least && energies[100] < 1e-3 * energies[0], "{stretch} {poisson_ratio}: {growth}");
    }
}

/// A vertex drawn out of its neighbourhood by thirty edges: damping that grew with the square of the stretch kept the
/// faces about it drawn out for hundreds of times tau.
#[test]
fn damping_does_not_hold_what_is_far_stretched() {
    let tau = 2e-3;
    let solid = SolidMaterial { damping: Damping { stretch_time: tau, ..NO_DAMPING }, ..solid_material() };
    let (nodes, tetrahedra) = block([3, 3, 3], [0.1; 3], [0.0; 3]);
    let mesh = TetMesh::new(nodes.clone(), tetrahedra).unwrap();
    let (forces, masses) = (solid.solid(&mesh).unwrap(), mesh.lumped_masses(solid.density));
    let (rest, cloth_forces, cloth_masses) = cloth(0.3, tau);
    for (name, mut start, forces, masses) in
        [("cloth", rest, cloth_forces, cloth_masses), ("solid", nodes, forces, masses)]
    {
        let middle = start.len() / 2;
        start[middle] = add_scaled(start[middle], 0.4, [0.6, 0.0, 0.8]);
        let energies = flight(&forces, &masses, start, 20);
        let growth = largest_growth(&energies);
        println!("{name}: {:.1e} J, after 20 steps {:.1e}; growth {growth:.1e}", energies[0], energies[20]);
        assert!(growth <= 0.0 && energies[20] < 0.05 * energies[0], "{name}: {energies:?}");
    }
}
