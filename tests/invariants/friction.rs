//! A block on an incline holds below the friction angle and slides above it.

use crate::world::*;
use signorini::math::{Vec3, norm, sub};

/// Distance that a block slides in half a second on ground tilted to `slope` times the friction coefficient.
fn slide(on_mesh: bool, slope: f64, seed: u64) -> (f64, f64) {
    let mu = 0.5;
    let mut plan = Plan::rubbing(mu);
    let mut jitter = Jitter(seed);
    let side = 0.2;
    let height = if on_mesh { 0.05 } else { 0.0 };
    let lift = height + 0.5 * side + 2.0 * HALF_THICKNESS;
    let inertia = diagonal(side * side / 6.0);
    let place: Vec3 = [jitter.next() * 0.02, jitter.next() * 0.02, lift];
    let key = plan.rigid(&block([side; 3]), at(place), 1.0, inertia, [0.0; 3], [0.0; 3]);
    if on_mesh {
        plan.scripted(&block([3.0, 2.0, 0.1]), at([0.0; 3]));
    } else {
        plan.half_space([0.0, 0.0, 1.0], 0.0);
    }
    let mut world = plan.build();
    let angle = (mu * slope).atan();
    world.gravity = [9.81 * angle.sin(), 0.0, -9.81 * angle.cos()];
    world.settings.contact_tolerance = 1e-6;
    world.settings.velocity_tolerance = 1e-6;
    for _ in 0..50 {
        world.step();
    }
    let acceleration = 9.81 * (angle.sin() - mu * angle.cos());
    // Backward Euler: the sum of n velocities k a dt, times dt.
    let free = 0.5 * acceleration * 0.01 * 0.01 * 50.0 * 51.0;
    (norm(sub(world.pose(key).position, place)), free)
}

#[test]
fn a_block_holds_below_the_friction_angle() {
    for on_mesh in [false, true] {
        for seed in 0..2 {
            let (distance, _) = slide(on_mesh, 0.95, seed);
            assert!(distance < 1e-3, "mesh {on_mesh}, seed {seed}: slid {distance}");
        }
    }
}

#[test]
fn a_block_slides_above_the_friction_angle() {
    for on_mesh in [false, true] {
        for seed in 0..2 {
            let (distance, free) = slide(on_mesh, 1.05, seed);
            assert!((distance - free).abs() < 0.05 * free, "mesh {on_mesh}, seed {seed}: {distance} against {free}");
        }
    }
}

/// The pyramid holds up to the square root of two times its limit along its diagonal. While a block sticks its pyramid
/// stays where it was: a load that turns into the diagonal is held, one that was there from the start is not.
#[test]
fn the_friction_frame_is_kept_while_a_block_sticks() {
    let load = 1.2 * 0.5 * 9.81 * 0.5_f64.sqrt();
    for (before, holds) in [(true, true), (false, false)] {
        let mut plan = Plan::rubbing(0.5);
        // Flat, so that its corners bear alike.
        let place: Vec3 = [0.0, 0.0, 0.01 + 2.0 * HALF_THICKNESS];
        let key = plan.rigid(&block([0.4, 0.4, 0.02]), at(place), 1.0, diagonal(0.02), [0.0; 3], [0.0; 3]);
        plan.half_space([0.0, 0.0, 1.0], 0.0);
        let mut world = plan.build();
        world.settings.friction_cone = signorini::model::FrictionCone::Pyramid;
        if before {
            world.gravity = [0.3 * 0.5 * 9.81, 0.0, -9.81];
            for _ in 0..5 {
                world.step();
            }
        }
        world.gravity = [load, load, -9.81];
        for _ in 0..20 {
            world.step();
        }
        let moved = norm(sub(world.pose(key).position, place));
        assert!(if holds { moved < 1e-4 } else { moved > 1e-2 }, "loaded before {before}: moved {moved}");
    }
}
