//! Stacks rest.

use crate::world::*;
use signorini::math::{norm, sub};

#[test]
fn a_stack_of_blocks_rests() {
    for seed in 0..3 {
        let mut jitter = Jitter(seed);
        let mut plan = Plan::rubbing(0.6);
        let side = 0.2;
        let mut keys = Vec::new();
        for level in 0..4 {
            let z = (f64::from(level) + 0.5) * side + 2.0 * HALF_THICKNESS * f64::from(level + 1);
            let place = [jitter.next() * 0.02, jitter.next() * 0.02, z];
            let inertia = diagonal(side * side / 6.0);
            keys.push((plan.rigid(&block([side; 3]), at(place), 1.0, inertia, [0.0; 3], [0.0; 3]), place));
        }
        plan.half_space([0.0, 0.0, 1.0], 0.0);
        let mut world = plan.build();
        world.gravity = [0.0, 0.0, -9.81];
        for step in 0..100 {
            let report = world.step();
            assert_eq!((report.parts, report.rigid_zones, report.held_vertices), (1, 0, 0), "seed {seed} step {step}");
        }
        // Impulses remembered by key start the next solve at its solution; without them it is found anew.
        let mut iterations = [0, 0];
        let (state, memory, velocities) = (world.state.clone(), world.memory.clone(), world.velocities.clone());
        for (forgets, count) in iterations.iter_mut().enumerate() {
            (world.state, world.memory, world.velocities) = (state.clone(), memory.clone(), velocities.clone());
            if forgets == 1 {
                world.memory.contacts.clear();
            }
            *count = world.step().iterations;
        }
        assert!(2 * iterations[0] <= iterations[1], "seed {seed}: {iterations:?} iterations with and without memory");
        for (key, place) in keys {
            let moved = norm(sub(world.pose(key).position, place));
            assert!(moved < 2e-3, "seed {seed}: block {key} moved {moved}");
        }
        let speed = world.velocities.iter().map(|v| norm(*v)).fold(0.0, f64::max);
        assert!(speed < 1e-2, "seed {seed}: still at {speed} m/s");
    }
}
