//! Divided steps: A(v - v*) equals the mean impulse, and the parts add up to the whole path.

use crate::support::scenes;
use signorini::math::{add, norm, sub};
use signorini::parallel::Par;

#[test]
fn a_divided_host_step_keeps_its_matrix_equation() {
    for seed in 0..2 {
        let mut host = scenes::crumple(12, seed);
        // One round only, so that steps with new contacts must be divided.
        host.settings.rounds_max = 1;
        host.settings.contact_tolerance = 1e-8;
        host.settings.velocity_tolerance = 1e-8;
        host.settings.iterations_max = 20_000;
        let mut divided = 0;
        for step in 0..70 {
            let x0 = host.state.positions.clone();
            let facts = host.step(Par::Serial).expect("a step");
            assert_eq!(facts.report.intersections, Some(0), "seed {seed} step {step}");
            let (v, free) = (&host.result.velocities, &host.drives.velocities);
            for (i, x) in x0.iter().enumerate() {
                let expected = add(*x, v[i].map(|c| c * host.dt));
                assert!(norm(sub(expected, host.state.positions[i])) < 1e-14, "velocity is the mean of the path");
            }
            if facts.report.parts == 1 || facts.report.zones() + facts.report.held_vertices > 0 {
                continue;
            }
            divided += 1;
            let matrix = &host.drives.systems[0];
            let change: Vec<_> = v.iter().zip(free).map(|(v, f)| sub(*v, *f)).collect();
            let (mut error, mut size) = (0.0_f64, 0.0_f64);
            for row in 0..change.len() {
                let mut product = [0.0; 3];
                for k in matrix.description.row_offsets[row]..matrix.description.row_offsets[row + 1] {
                    let column = matrix.description.columns[k] as usize;
                    product = add(product, signorini::math::mat_vec(&matrix.values[k], change[column]));
                }
                error = error.max(norm(sub(product, host.result.impulses[row])));
                size = size.max(norm(host.result.impulses[row]));
            }
            assert!(error < 1e-4 * size, "seed {seed} step {step}: {error:e} of {size:e}");
        }
        assert!(divided > 0, "seed {seed}: no step was divided");
    }
}
