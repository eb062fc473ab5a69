//! What a contact takes from one body it gives to the other.

use crate::world::*;
use signorini::math::{Vec3, add, cross, mat_vec, norm, norm_squared, sub};

fn strike(seed: u64) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.4);
    let cloth = sheet(12, 1.0);
    let start = moved(&cloth, [0.0; 3], &mut jitter, 0.003);
    plan.cloth(&cloth, start, 0.5, &[], [0.0, 0.3, 4.0]);
    let inertia = diagonal(0.4 * 2.0 * 0.04);
    plan.rigid(&ball(0.2), at(add([0.05, 0.02, 0.24], jitter.vector(0.01))), 2.0, inertia, [0.0; 3], [0.0, 3.0, 1.0]);
    plan.build()
}

#[test]
fn linear_momentum_is_exchanged_to_rounding() {
    for seed in 0..4 {
        let mut world = strike(seed);
        let mut struck = 0;
        for _ in 0..12 {
            let before = momentum(&world, &world.velocities);
            world.step();
            let scale: f64 = world.result.impulses.iter().map(|p| norm(*p)).sum::<f64>() + norm(before);
            let change = sub(momentum(&world, &world.result.velocities), before);
            assert!(norm(change) <= 1e-12 * scale, "seed {seed}: {:e}", norm(change) / scale);
            struck += usize::from(world.result.impulses.iter().any(|p| norm(*p) > 0.0));
        }
        assert!(struck > 3, "the cloth must strike the ball");
    }
}

/// A host's matrix: the masses gain what contacts give, at any accuracy of the solve.
#[test]
fn linear_momentum_holds_with_a_host_matrix_at_any_tolerance() {
    for (tolerance, iterations_max) in [(1e-3, 2000), (1e-1, 2000), (1e-3, 10)] {
        let mut host = crate::support::scenes::crumple(12, 1);
        host.settings.contact_tolerance = tolerance;
        host.settings.velocity_tolerance = 20.0 * tolerance;
        host.settings.iterations_max = iterations_max;
        let mut touched = 0;
        for step in 0..70 {
            let facts = host.step(signorini::parallel::Par::Serial).expect("a step");
            let error = facts.momentum_error;
            assert!(error < 1e-9, "tolerance {tolerance} step {step}: {error:e}, {:?}", facts.report);
            touched += u32::from(facts.report.active_contacts > 0);
        }
        assert!(touched > 10, "the sheet must touch");
    }
}

#[test]
fn impulses_pulled_are_masses_times_velocity_changes() {
    let mut world = strike(5);
    for _ in 0..6 {
        world.prepare();
        let masses = world.masses();
        let free = world.drives.velocities.clone();
        world.advance(signorini::parallel::Par::Serial).unwrap();
        for (block, impulse) in world.result.impulses.iter().enumerate() {
            let expected = mat_vec(&masses[block], sub(world.result.velocities[block], free[block]));
            assert!(norm(sub(expected, *impulse)) <= 1e-10 * (1.0 + norm(*impulse)));
        }
    }
}

/// Angular momentum about the origin by positions and velocities at the start of a step.
fn angular_momentum(world: &World, x: &[Vec3], centre: Vec3, v: &[Vec3]) -> Vec3 {
    let masses = world.masses();
    let rigid = world.model.bodies[1].blocks.start;
    let mut sum = mat_vec(&masses[rigid + 1], v[rigid + 1]);
    sum = add(sum, cross(centre, mat_vec(&masses[rigid], v[rigid])));
    for block in world.model.bodies[0].blocks.clone() {
        sum = add(sum, cross(x[block], mat_vec(&masses[block], v[block])));
    }
    sum
}

#[test]
fn the_error_in_angular_momentum_is_the_reported_one() {
    for seed in 0..3 {
        let mut world = strike(seed);
        for _ in 0..8 {
            let (x, centre) = (world.state.positions.clone(), world.pose(2).position);
            let before_world_inertia = world.masses();
            world.prepare();
            let free = world.drives.velocities.clone();
            let before = angular_momentum(&world, &x, centre, &free);
            let rigid = world.model.bodies[1].blocks.start;
            let report = world.advance(signorini::parallel::Par::Serial).unwrap();
            // Inertia at the start on both sides: the solve uses it for the whole step.
            let spin = mat_vec(&before_world_inertia[rigid + 1], world.result.end_velocities[rigid + 1]);
            let now = mat_vec(&world.masses()[rigid + 1], world.result.end_velocities[rigid + 1]);
            let after = angular_momentum(&world, &x, centre, &world.result.end_velocities);
            let change = norm(sub(add(sub(after, now), spin), before));
            let push: f64 = world.result.impulses.iter().map(|p| norm(*p)).sum();
            // Levers of turning bodies are those of the mean motion: off by the turn within the step.
            let turn = world.dt * norm_squared(world.result.end_velocities[rigid + 1]).sqrt();
            let allowed = report.angular_momentum_error + 0.2 * turn * push + 1e-12;
            assert!(change <= allowed, "seed {seed}: {change:e} > {allowed:e}");
        }
    }
}
