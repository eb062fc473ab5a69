//! Stacks rest.

use crate::world::*;
use signorini::math::{norm, sub};

#[test]
fn a_stack_of_blocks_rests() {
    let mut of_other_durations = [0; 2];
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
            assert_eq!((report.parts, report.zones(), report.held_vertices), (1, 0, 0), "seed {seed} step {step}");
        }
        // Impulses remembered by key start the next solve at its solution; without them it is found anew.
        let [kept, forgotten] = [|_: &mut World| {}, |world: &mut World| world.memory.contacts.clear()]
            .map(|change| iterations_after(&mut world, change));
        assert!(3 * kept <= 2 * forgotten, "seed {seed}: {kept} and {forgotten} iterations with and without memory");
        for dt in [0.0025, 0.02, 0.04] {
            let shorter = |world: &mut World| world.dt = dt;
            let unscaled = |world: &mut World| (world.dt, world.memory.dt) = (dt, dt);
            of_other_durations[0] += iterations_after(&mut world, shorter);
            of_other_durations[1] += iterations_after(&mut world, unscaled);
        }
        for (key, place) in keys {
            let moved = norm(sub(world.pose(key).position, place));
            assert!(moved < 2e-3, "seed {seed}: block {key} moved {moved}");
        }
        let speed = world.velocities.iter().map(|v| norm(*v)).fold(0.0, f64::max);
        assert!(speed < 1e-6, "seed {seed}: still at {speed} m/s");
    }
    let [scaled, unscaled] = of_other_durations;
    assert!(3 * scaled <= 2 * unscaled, "impulses of a step of another duration: {scaled} and {unscaled} iterations");
}

/// Iterations of a step after a change of the world, which is then put back.
fn iterations_after(world: &mut World, change: impl Fn(&mut World)) -> u32 {
    let (state, memory, velocities) = (world.state.clone(), world.memory.clone(), world.velocities.clone());
    let dt = world.dt;
    change(world);
    let iterations = world.step().iterations;
    (world.state, world.memory, world.velocities, world.dt) = (state, memory, velocities, dt);
    iterations
}

/// Ten blocks, a little out of line: tall for passes over the contacts, and their rows share the load. Within three
/// seconds they are quiet, by the solver alone, and stay so, at the default tolerance and at a third of it.
#[test]
fn a_tall_stack_goes_quiet() {
    for (seed, share) in [(0, 1.0), (1, 1.0), (2, 1.0), (3, 1.0), (0, 1.0 / 3.0), (3, 1.0 / 3.0)] {
        let mut jitter = Jitter(seed);
        let mut plan = Plan::rubbing(0.5);
        let side = 0.2;
        for level in 0..10 {
            let z = (f64::from(level) + 0.5) * side + 2.0 * HALF_THICKNESS * f64::from(level + 1);
            let place = [jitter.next() * 2e-4, jitter.next() * 2e-4, z + 1e-4 * jitter.next().abs()];
            plan.rigid(&block([side; 3]), at(place), 1.0, diagonal(side * side / 6.0), [0.0; 3], [0.0; 3]);
        }
        plan.half_space([0.0, 0.0, 1.0], 0.0);
        let mut world = plan.build();
        world.gravity = [0.0, 0.0, -9.81];
        world.settings.contact_tolerance *= share;
        let tolerance = world.settings.contact_tolerance;
        let masses = world.masses();
        for step in 0..500 {
            let report = world.step();
            assert!(report.complementarity_residual <= tolerance, "seed {seed} step {step}: {report:?}");
            assert!(report.parts == 1 && report.rounds <= 3, "seed {seed} step {step}: {report:?}");
            assert!(!report.not_converged, "seed {seed} step {step}: {report:?}");
            let energy = kinetic(&masses, &world.velocities) / 10.0;
            assert!(step < 300 || energy < 1e-10, "seed {seed} step {step}: {energy:e} J/kg");
        }
    }
}
