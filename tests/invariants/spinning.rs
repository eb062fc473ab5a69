//! Turning bodies: rows at the start pose miss `theta^2 r / 2`; re-linearised rows do not.

use crate::world::*;
use signorini::kinematics::Pose;
use signorini::math::{add_scaled, norm};

/// A long bar spins about an axis parallel to a wall that its tip reaches within the step.
fn bar(seed: u64, on_mesh: bool) -> World {
    bar_at_speed(seed, on_mesh, 40.0)
}

fn bar_at_speed(seed: u64, on_mesh: bool, speed: f64) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.0);
    let (length, width) = (1.0, 0.05);
    let inertia = [[1e-3, 0.0, 0.0], [0.0, 1.0 / 12.0, 0.0], [0.0, 0.0, 1.0 / 12.0]];
    let height = 0.06 + 0.01 * jitter.next();
    // 0.4 radians in the step take the tip 0.2 m down, unless the wall stops it.
    let pose = Pose { position: [0.0, 0.0, height], ..Pose::IDENTITY };
    plan.rigid(&block([length, width, width]), pose, 1.0, inertia, [0.0; 3], [0.0, speed, 0.0]);
    if on_mesh {
        plan.scripted(&block([3.0, 3.0, 0.2]), at([0.0, 0.0, -0.1]));
    } else {
        plan.half_space([0.0, 0.0, 1.0], 0.0);
    }
    plan.build()
}

#[test]
fn a_spinning_bar_stops_at_the_wall_in_one_part_with_its_true_gap() {
    for on_mesh in [false, true] {
        for seed in 0..4 {
            let mut world = bar(seed, on_mesh);
            world.settings.contact_tolerance = 1e-6;
            world.settings.velocity_tolerance = 1e-6;
            let report = world.step();
            assert_eq!(report.parts, 1, "mesh {on_mesh}, seed {seed}: no division is needed, {report:?}");
            assert!(report.rounds <= 5);
            let lowest = world.state.positions[..8].iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
            let thickness = 2.0 * HALF_THICKNESS;
            assert!(
                (lowest - thickness).abs() < 0.1 * thickness,
                "mesh {on_mesh}, seed {seed}: lowest corner at {lowest}, {report:?}"
            );
        }
    }
}

/// Where the first linear rows end without a hit, but off the true gap, they are made anew about that end.
#[test]
fn a_clean_end_of_a_turning_bar_is_refined_to_its_true_gap() {
    for seed in 0..4 {
        let mut world = bar_at_speed(seed, false, 20.0);
        let report = world.step();
        let lowest = world.state.positions[..8].iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
        let share = lowest / (2.0 * HALF_THICKNESS);
        assert!(report.parts == 1 && (share - 1.0).abs() < 0.02, "seed {seed}: {share} of the gap, {report:?}");
    }
}

#[test]
fn large_turns_are_divided_in_time() {
    let mut world = bar(0, false);
    world.velocities[1] = [0.0, 300.0, 0.0];
    world.state = {
        let mut state = world.state.clone();
        world.model.set_pose(&mut state, 0, at([0.0, 0.0, 5.0]));
        state
    };
    let report = world.step();
    assert_eq!(report.parts, 6, "3 radians at half a radian each");
    let end = world.pose(1);
    let turned = Pose::IDENTITY.velocity_to(&end, world.dt);
    assert!((norm(turned.1) - 300.0).abs() < 1e-6);
}

#[test]
fn free_rigid_motion_is_exact() {
    let mut world = bar(0, false);
    let mut state = world.state.clone();
    world.model.set_pose(&mut state, 0, at([0.0, 0.0, 5.0]));
    world.state = state;
    world.velocities = vec![[1.0, -2.0, 0.5], [3.0, 20.0, 7.0]];
    let start = world.pose(1);
    world.step();
    let expected = start.advanced([1.0, -2.0, 0.5], [3.0, 20.0, 7.0], world.dt);
    let end = world.pose(1);
    assert!(norm(add_scaled(end.position, -1.0, expected.position)) < 1e-14);
    let alignment: f64 = (0..4).map(|k| end.orientation[k] * expected.orientation[k]).sum();
    assert!((alignment.abs() - 1.0).abs() < 1e-14);
}
