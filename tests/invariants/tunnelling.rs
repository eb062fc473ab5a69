//! Nothing passes through anything, however fast and thin.

use crate::world::*;
use signorini::math::{Vec3, add};
use signorini::model::*;
use signorini::parallel::Par;

#[test]
fn a_fast_vertex_does_not_pass_through_thin_cloth() {
    for seed in 0..6 {
        let mut jitter = Jitter(seed);
        let mut plan = Plan::default();
        let cloth = sheet(8, 0.7);
        let border: Vec<usize> = (0..64).filter(|i| i % 8 == 0 || i % 8 == 7 || *i < 8 || *i >= 56).collect();
        plan.cloth(&cloth, cloth.positions.clone(), 0.1, &border, [0.0; 3]);
        plan.last().half_thickness = Some(1e-5);
        let place: Vec3 = add([0.013, 0.021, 0.3], jitter.vector(0.1));
        let point = crate::support::shapes::Triangles { positions: vec![place], faces: vec![] };
        let key = plan.cloth(&point, vec![place], 0.01, &[], [1.0, 2.0, -200.0]);
        plan.last().half_thickness = Some(1e-5);
        let mut world = plan.build();
        for step in 0..5 {
            let report = world.step();
            let x = world.state.positions[world.body(key).vertices.start];
            let sheet = &world.state.positions[..64];
            let highest = sheet.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
            let lowest = sheet.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
            assert!(x[2] > lowest, "seed {seed} step {step}: {x:?} below {lowest} (top {highest}), {report:?}");
        }
    }
}

/// Sheets so thin that the first tolerance of a solve is coarser than they are: what it misses is solved again, tighter,
/// and no step is divided.
#[test]
fn a_row_that_the_solver_missed_is_solved_again_more_tightly() {
    for seed in 1..9 {
        let mut plan = Plan::rubbing(0.3);
        let mut jitter = Jitter(seed);
        for layer in 0..2 {
            let (cloth, z) = (sheet(4, 0.3), 0.005 + 0.005 * f64::from(layer));
            let start = moved(&cloth, [2.0 * z - 0.01, 0.0, z], &mut jitter, 1e-3);
            plan.cloth(&cloth, start, 0.1, &[], [0.0, 0.0, -3.0]);
            plan.last().half_thickness = Some(1e-7);
        }
        plan.half_space([0.0, 0.0, 1.0], 0.0);
        plan.last().half_thickness = Some(1e-7);
        let mut world = plan.build();
        for step in 0..2 {
            let report = world.step();
            assert!(report.parts == 1 && report.zones() == 0, "seed {seed} step {step}: {report:?}");
        }
    }
}

#[test]
fn a_host_that_pushes_through_a_sheet_is_caught_by_the_sweep() {
    let mut plan = Plan::default();
    plan.cloth(&sheet(6, 1.0), sheet(6, 1.0).positions, 0.1, &[], [0.0; 3]);
    let body = plan.rigid(&ball(0.1), at([0.0, 0.0, 0.5]), 1.0, diagonal(0.004), [0.0; 3], [0.0; 3]);
    let world = plan.build();
    let filter = signorini::contact_search::BodyFilter::new(&world.model);
    let mut below = world.state.clone();
    let index = world.model.body_index(body).unwrap();
    world.model.set_pose(&mut below, index, at([0.0, 0.0, -0.5]));
    let hits = signorini::contact_search::swept_free(&world.model, &filter, &world.state, &below, Par::Serial);
    assert!(!hits.is_empty());
    let mut aside: State = world.state.clone();
    world.model.set_pose(&mut aside, index, at([0.3, 0.0, 0.4]));
    assert!(signorini::contact_search::swept_free(&world.model, &filter, &world.state, &aside, Par::Serial).is_empty());
}
