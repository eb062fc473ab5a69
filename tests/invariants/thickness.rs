//! Thickness: standing still is feasible, what was lost comes back at a bounded speed, fine meshes do not lock, and the
//! end state is the one in the host's number format.

use crate::world::*;
use signorini::kinematics::Pose;
use signorini::math::{norm, scale, sub};
use signorini::model::Precision;

const DELTA: f64 = 2.0 * HALF_THICKNESS;

#[test]
fn a_mesh_finer_than_its_thickness_does_not_lock() {
    // All of it within its own thickness, colliding with itself.
    let fine = sheet(9, 0.7 * DELTA);
    let build = |shrink: f64| {
        let mut plan = Plan::rubbing(0.5);
        plan.cloth(&fine, fine.positions.clone(), 0.1, &[], [0.0; 3]);
        plan.last().self_collision = true;
        let mut world = plan.build();
        for (v, x) in world.velocities.iter_mut().zip(&fine.positions) {
            *v = scale(-shrink / world.dt, *x);
        }
        world
    };
    let mut still = build(0.0);
    let start = still.state.positions.clone();
    still.step();
    assert_eq!(still.state.positions, start, "nothing pushes at rest");
    let mut shrinking = build(0.2);
    let report = shrinking.step();
    assert_eq!(report.active_contacts, 0, "a fifth less in the plane is free");
    let mut collapsing = build(0.9);
    let report = collapsing.step();
    assert!(report.active_contacts > 0 && report.intersections == Some(0));
}

/// Two sheets at a share of their thickness, at rest.
fn close_sheets(share: f64, precision: Precision, seed: u64) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(6, 0.3);
    for z in [0.0, share * DELTA] {
        let start = moved(&cloth, [z * 3.0, z * 2.0, z], &mut jitter, 0.05 * share * DELTA);
        let start = start.into_iter().map(|p| p.map(|c| f64::from(c as f32))).collect();
        plan.cloth(&cloth, start, 0.1, &[], [0.0; 3]);
        plan.last().precision = precision;
    }
    plan.build()
}

fn gap(world: &World) -> f64 {
    let heights = |range: std::ops::Range<usize>| world.state.positions[range].iter().map(|x| x[2]).collect::<Vec<_>>();
    let lowest = heights(36..72).into_iter().fold(f64::INFINITY, f64::min);
    lowest - heights(0..36).into_iter().fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn lost_thickness_comes_back_at_a_bounded_speed() {
    for seed in 0..3 {
        let mut world = close_sheets(0.3, Precision::Double, seed);
        let mut work = 0.0;
        let mut previous = gap(&world);
        for step in 0..12 {
            // At rest before every step, so that only recovery moves anything.
            world.velocities.fill([0.0; 3]);
            let report = world.step();
            work += report.recovery_work;
            let now = gap(&world);
            assert!(now - previous < 0.2 * DELTA, "seed {seed} step {step}: {previous} to {now}");
            previous = now;
        }
        assert!(previous > 0.85 * DELTA, "seed {seed}: {previous}");
        assert!(work > 0.0, "recovery does work, and it is reported");
    }
}

#[test]
fn without_recovery_close_sheets_stay_where_they_are() {
    let mut world = close_sheets(0.3, Precision::Double, 1);
    world.settings.recovery_fraction = 0.0;
    let start = world.state.positions.clone();
    let report = world.step();
    assert_eq!(report.recovery_work, 0.0);
    let moved = world.state.positions.iter().zip(&start).map(|(a, b)| norm(sub(*a, *b))).fold(0.0, f64::max);
    assert!(moved < 1e-9 * DELTA, "{moved}");
}

#[test]
fn layers_squeezed_into_less_than_their_thickness_have_a_solution() {
    let mut jitter = Jitter(2);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(6, 0.3);
    // Four gaps where the thickness of three would fit.
    let step = 0.7 * DELTA;
    for layer in 1..4 {
        plan.cloth(&cloth, moved(&cloth, [0.0, 0.0, f64::from(layer) * step], &mut jitter, 1e-5), 0.1, &[], [0.0; 3]);
    }
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    plan.half_space([0.0, 0.0, -1.0], -4.0 * step);
    let mut world = plan.build();
    world.gravity = [0.0, 0.0, -9.81];
    for number in 0..20 {
        let report = world.step();
        assert_eq!((report.parts, report.zones(), report.held_vertices), (1, 0, 0), "step {number}");
        assert_eq!(report.recovery_work, 0.0, "step {number}: there is no room to recover");
        let fastest = world.result.velocities.iter().fold(0.0_f64, |a, v| a.max(norm(*v)));
        assert!(fastest * world.dt < 0.1 * DELTA, "step {number}: {fastest}");
    }
}

#[test]
fn a_single_precision_host_gets_certified_single_precision_states() {
    let is_single = |v: f64| f64::from(v as f32) == v;
    let mut world = close_sheets(1.0, Precision::Single, 3);
    world.velocities[..36].fill([0.1, 0.0, 3.0]);
    for _ in 0..10 {
        let report = world.step();
        assert_eq!(report.intersections, Some(0));
        assert!(world.state.positions.iter().flatten().all(|v| is_single(*v)));
    }
    let mut plan = Plan::rubbing(0.3);
    let pose = Pose::IDENTITY.advanced([0.0; 3], [0.3, 0.2, 0.1], 1.0);
    plan.rigid(
        &block([0.2; 3]),
        Pose { position: [0.0, 0.0, 0.3], ..pose },
        1.0,
        diagonal(0.01),
        [0.0, 0.0, -3.0],
        [3.0, 1.0, 0.0],
    );
    plan.last().precision = Precision::Single;
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    let mut world = plan.build();
    for _ in 0..10 {
        world.step();
        let pose = world.pose(1);
        assert!(pose.position.iter().chain(&pose.orientation).all(|v| is_single(*v)));
        assert!(world.state.positions.iter().flatten().all(|v| is_single(*v)));
        assert!(world.state.positions.iter().all(|x| x[2] >= 0.0));
    }
}
