//! The velocity filter: what must hold in every step of it.

use crate::world::*;
use signorini::contact_search::{BodyFilter, intersections};
use signorini::math::{Vec3, dot, norm, sub};
use signorini::model::{FilterSettings, Kind, Method, StartPolicy, StepError};
use signorini::parallel::{Par, Pool};

fn filtered(mut world: World) -> World {
    world.settings.method = Method::VelocityFilter;
    world
}

/// Cloths with self-contact, rigid bodies, a turning script, a half-space: no two seeds alike.
fn jumble(seed: u64) -> (World, u64) {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3 + 0.3 * jitter.next());
    for layer in 0..2 {
        let cloth = sheet(9, 0.5);
        let height = 0.1 + 0.05 * f64::from(layer);
        let start = moved(&cloth, [0.0, 0.0, height], &mut jitter, 0.004);
        plan.cloth(&cloth, start, 0.2, &[], [0.3 * jitter.next(), 0.0, -1.0 - 4.0 * f64::from(layer)]);
        plan.last().self_collision = true;
    }
    let spin = jitter.vector(6.0);
    plan.rigid(&ball(0.07), at([0.05, 0.02, 0.3]), 0.6, diagonal(0.0012), [0.0, 0.5, -6.0], spin);
    let turn = jitter.vector(4.0);
    plan.rigid(&block([0.12; 3]), at([-0.06, -0.05, 0.45]), 1.0, diagonal(0.0024), [0.4, 0.0, -8.0], turn);
    let script = plan.scripted(&block([0.3, 0.06, 0.06]), at([0.0, 0.0, 0.045]));
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    let mut world = filtered(plan.build());
    world.gravity = [0.0, 0.0, -9.81];
    world.settings.filter.restitution = 0.5 + 0.5 * jitter.next();
    (world, script)
}

/// Zones, held vertices and steps that were refused.
fn tumble(seed: u64, steps: usize, par: Par, fresh: bool) -> (World, u32) {
    let (mut world, script) = jumble(seed);
    let mut fail_safes = 0;
    for step in 0..steps {
        if fresh {
            world.filter_scratch = Default::default();
        }
        world.prepare();
        let pose = world.pose(script).advanced([0.0, 0.1, 0.0], [0.0, 0.0, 3.0], world.dt);
        world.script(script, pose);
        match world.advance(par) {
            Ok(report) => {
                assert_eq!(report.intersections, Some(0), "seed {seed} step {step}");
                fail_safes += report.projected_zones + report.rigid_zones + report.held_vertices;
            }
            Err(StepError::Pinched { report, .. }) => assert!(report.certified_fraction < 1.0),
            Err(other) => panic!("seed {seed} step {step}: {other:?}"),
        }
        let found = intersections(&world.model, &BodyFilter::new(&world.model), &world.state, Par::Serial);
        assert!(found.witnesses.is_empty(), "seed {seed} step {step}: {:?}", found.witnesses);
    }
    (world, fail_safes)
}

#[test]
fn everything_that_starts_clean_ends_clean() {
    let mut fail_safes = 0;
    for seed in 0..6 {
        let (world, used) = tumble(seed, 50, Par::Serial, false);
        fail_safes += used;
        // It has come down, and it is still there.
        for body in world.model.bodies.iter().filter(|b| matches!(b.description.kind, Kind::Rigid { .. })) {
            let height = world.pose(body.description.key).position[2];
            assert!((0.03..0.5).contains(&height), "seed {seed}: {height}");
        }
    }
    assert!(fail_safes > 0, "impulses alone were enough: a dull scene");
}

#[test]
fn threads_and_scratch_change_no_bit_of_the_filter() {
    let serial = tumble(4, 30, Par::Serial, false).0.hash();
    assert_eq!(tumble(4, 30, Par::Serial, true).0.hash(), serial, "emptied scratch");
    for threads in [1, 2, 3] {
        let pool = Pool::new(threads).unwrap();
        assert_eq!(tumble(4, 30, Par::Pool(&pool), false).0.hash(), serial, "{threads} threads");
    }
}

/// Two cloths and a spinning box in free space: nothing has infinite mass.
fn free(seed: u64, restitution: f64) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.5);
    let cloth = sheet(8, 0.4);
    for (height, speed) in [(0.0, 2.0), (0.02, -3.0)] {
        plan.cloth(&cloth, moved(&cloth, [0.0, 0.0, height], &mut jitter, 0.003), 0.3, &[], [0.2, 0.0, speed]);
        plan.last().self_collision = true;
    }
    let spin = [3.0 + jitter.next(), -5.0, 2.0];
    plan.rigid(&block([0.2; 3]), at([0.02, 0.01, 0.2]), 0.5, diagonal(0.003), [0.0, 0.0, -2.0], spin);
    let mut world = filtered(plan.build());
    world.settings.filter.restitution = restitution;
    world
}

#[test]
fn linear_momentum_is_kept_and_energy_falls_but_for_the_work_of_springs() {
    let (mut touched, mut repelled, mut zones) = (0, 0.0, 0);
    for seed in 0..3 {
        for restitution in [0.0, 0.6, 1.0] {
            for stiffness in [0.0, 1.0] {
                let mut world = free(seed, restitution);
                world.settings.filter.repulsion_stiffness = stiffness;
                // One of them leaves everything to the zones.
                world.settings.filter.passes_max = if seed == 2 { 0 } else { 10 };
                for step in 0..12 {
                    world.prepare();
                    let masses = world.masses();
                    let before =
                        (momentum(&world, &world.drives.velocities), kinetic(&masses, &world.drives.velocities));
                    let report = world.advance(Par::Serial).unwrap();
                    touched += report.active_contacts;
                    let at = format!("seed {seed} e {restitution} k {stiffness} step {step}: {report:?}");
                    let after = &world.result.end_velocities;
                    let lost = norm(sub(momentum(&world, after), before.0));
                    // Momenta of the parts, which cancel in the sum, set the scale of rounding.
                    let scale: f64 = masses.iter().zip(after).map(|(m, v)| m[0][0] * norm(*v)).sum();
                    assert!(lost < 1e-12 * scale, "{lost:e} of {scale}, {at}");
                    assert!(norm(report.momentum_taken) < 1e-12 * scale, "{at}");
                    let gained = kinetic(&masses, after) - before.1;
                    assert!(gained <= report.recovery_work + 1e-12 * before.1, "{gained:e}, {at}");
                    assert!(stiffness > 0.0 || report.recovery_work == 0.0, "{at}");
                    repelled += report.recovery_work;
                    zones += report.zones();
                }
            }
        }
    }
    assert!(touched > 0 && repelled > 0.0 && zones > 0, "{touched} {repelled} {zones}");
}

#[test]
fn springs_add_at_most_their_cap() {
    // Two flat cloths at rest, half their thickness apart, far from anything else.
    let cloth = sheet(6, 0.3);
    let gap = HALF_THICKNESS;
    for (stiffness, recovery) in [(1.0, 0.1), (0.05, 0.1), (1.0, 0.3), (0.0, 0.1)] {
        let (mut world, cap) = (filtered(plan_of(&cloth, gap)), recovery * HALF_THICKNESS);
        world.settings.filter.repulsion_stiffness = stiffness;
        world.settings.recovery_fraction = recovery;
        let report = world.step();
        let lower: f64 =
            world.state.positions[..cloth.positions.len()].iter().map(|x| x[2]).fold(f64::NEG_INFINITY, f64::max);
        let upper = world.state.positions[cloth.positions.len()..].iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
        let regained = upper - lower - gap;
        let most = cap.min(stiffness * HALF_THICKNESS);
        assert!(regained <= most * (1.0 + 1e-9), "k {stiffness}: regained {regained:e}, cap {cap:e}");
        if stiffness == 1.0 {
            assert!(regained > 0.5 * cap, "k {stiffness}: regained {regained:e}, cap {cap:e}");
        }
        assert_eq!(report.projected_zones + report.rigid_zones, 0);
    }
}

fn plan_of(cloth: &crate::support::shapes::Triangles, gap: f64) -> World {
    let mut plan = Plan::rubbing(0.0);
    for height in [0.0, gap] {
        plan.cloth(cloth, moved(cloth, [0.0, 0.0, height], &mut Jitter(0), 0.0), 0.1, &[], [0.0; 3]);
    }
    plan.build()
}

/// A block on an incline of `slope` times its friction angle, as in `friction.rs`.
fn slide(on_mesh: bool, slope: f64) -> (f64, f64) {
    let (mu, side) = (0.5, 0.2);
    let mut plan = Plan::rubbing(mu);
    let lift = 0.5 * side + if on_mesh { 0.05 } else { 0.0 } + 1.5 * HALF_THICKNESS;
    let place: Vec3 = [0.01, -0.02, lift];
    let key = plan.rigid(&block([side; 3]), at(place), 1.0, diagonal(side * side / 6.0), [0.0; 3], [0.0; 3]);
    if on_mesh {
        plan.scripted(&block([3.0, 2.0, 0.1]), at([0.0; 3]));
    } else {
        plan.half_space([0.0, 0.0, 1.0], 0.0);
    }
    let mut world = filtered(plan.build());
    let angle = (mu * slope).atan();
    world.gravity = [9.81 * angle.sin(), 0.0, -9.81 * angle.cos()];
    world.dt = 1.0 / 240.0;
    let steps = 120;
    for _ in 0..steps {
        world.step();
    }
    let acceleration = 9.81 * (angle.sin() - mu * angle.cos());
    let n = f64::from(steps);
    (sub(world.pose(key).position, place)[0], 0.5 * acceleration * world.dt * world.dt * n * (n + 1.0))
}

#[test]
fn a_block_holds_below_the_friction_angle_and_slides_above() {
    for on_mesh in [false, true] {
        let (held, _) = slide(on_mesh, 0.9);
        assert!(held.abs() < 5e-3, "mesh {on_mesh}: crept {held}");
        let (slid, free) = slide(on_mesh, 1.5);
        assert!((slid - free).abs() < 0.15 * free, "mesh {on_mesh}: {slid} against {free}");
    }
}

/// A cloth between scripted jaws.
fn jaws(seed: u64) -> (World, u64, u64) {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(9, 0.4);
    plan.cloth(&cloth, moved(&cloth, [0.0; 3], &mut jitter, 0.001), 0.1, &[], [0.0; 3]);
    let upper = plan.scripted(&block([0.2, 0.2, 0.1]), at([0.01, 0.005, 0.07]));
    let lower = plan.scripted(&block([0.2, 0.2, 0.1]), at([0.0, 0.0, -0.07]));
    (filtered(plan.build()), upper, lower)
}

fn close(world: &mut World, upper: u64, lower: u64, by: f64) {
    world.prepare();
    for (key, sign) in [(upper, -1.0), (lower, 1.0)] {
        let mut pose = world.pose(key);
        pose.position[2] += sign * by;
        world.script(key, pose);
    }
}

#[test]
fn conflicting_scripts_pinch_with_witnesses_and_open_again() {
    for seed in 0..3 {
        let (mut world, upper, lower) = jaws(seed);
        let gap = |world: &World| world.pose(upper).position[2] - world.pose(lower).position[2] - 0.1;
        let (mut pinched, mut farthest) = (0, 0.0_f64);
        for step in 0..8 {
            let before = gap(&world);
            close(&mut world, upper, lower, 0.004);
            match world.advance(Par::Serial) {
                Ok(report) => assert_eq!(report.intersections, Some(0), "seed {seed} step {step}"),
                Err(StepError::Pinched { witnesses, report }) => {
                    pinched += 1;
                    assert!(!witnesses.is_empty());
                    let f = report.certified_fraction;
                    farthest = farthest.max(f);
                    assert!((gap(&world) - (before - 0.008 * f)).abs() < 1e-12, "seed {seed} step {step}");
                }
                Err(other) => panic!("seed {seed} step {step}: {other:?}"),
            }
            // A pinched state is not what the step has certified at its end.
            let filter = BodyFilter::new(&world.model);
            let found = intersections(&world.model, &filter, &world.state, Par::Serial);
            assert!(found.witnesses.is_empty(), "seed {seed} step {step}: {:?}", found.witnesses);
        }
        assert!(pinched > 0 && gap(&world) > 0.0);
        assert!(farthest > 0.1, "seed {seed}: the scripts go on as far as there is room: {farthest}");
        for step in 0..4 {
            close(&mut world, upper, lower, -0.004);
            let report = world.advance(Par::Serial).unwrap_or_else(|e| panic!("seed {seed} opening {step}: {e:?}"));
            assert_eq!((report.intersections, report.certified_fraction), (Some(0), 1.0));
        }
    }
}

#[test]
fn what_is_pinned_and_runs_into_a_script_is_pinched_before_any_impulse() {
    let mut plan = Plan::rubbing(0.0);
    let cloth = sheet(7, 0.1);
    let all: Vec<usize> = (0..cloth.positions.len()).collect();
    // One free vertex keeps the body movable; the pinned ones are in the way.
    plan.cloth(&cloth, cloth.positions.clone(), 0.1, &all[1..], [0.0; 3]);
    let block = plan.scripted(&block([0.02; 3]), at([0.0, 0.0, 0.05]));
    let mut world = filtered(plan.build());
    world.prepare();
    world.script(block, at([0.0, 0.0, -0.05]));
    match world.advance(Par::Serial) {
        Err(StepError::Pinched { witnesses, report }) => {
            assert!(!witnesses.is_empty());
            assert_eq!(report.rounds, 1, "no pass can help");
            assert!(report.certified_fraction > 0.2 && report.certified_fraction < 0.5, "{report:?}");
        }
        other => panic!("{other:?}"),
    }
    world.settings.start_policy = StartPolicy::Pass;
    world.prepare();
    world.script(block, at([0.0, 0.0, -0.05]));
    assert!(world.advance(Par::Serial).unwrap().tangled_pairs > 0);
}

#[test]
fn errors_change_nothing() {
    let nan = f64::NAN;
    let faults = [
        FilterSettings { restitution: 1.1, ..FilterSettings::default() },
        FilterSettings { restitution: nan, ..FilterSettings::default() },
        FilterSettings { repulsion_stiffness: -1.0, ..FilterSettings::default() },
        FilterSettings { repulsion_stiffness: f64::INFINITY, ..FilterSettings::default() },
    ];
    let (mut world, _) = jumble(1);
    for _ in 0..3 {
        world.step();
    }
    let (hash, memory, good) = (world.hash(), world.memory.clone(), world.settings.filter);
    for fault in faults {
        world.settings.filter = fault;
        assert!(matches!(world.advance(Par::Serial), Err(StepError::BadInput(_))), "{fault:?}");
    }
    world.settings.filter = good;
    world.prepare();
    world.drives.velocities[3][1] = nan;
    assert!(matches!(world.advance(Par::Serial), Err(StepError::BadInput(_))));
    assert!(world.hash() == hash && world.memory == memory);
}

#[test]
fn infinite_masses_take_the_momentum_that_the_filter_reports() {
    for on_mesh in [false, true] {
        let mut plan = Plan::rubbing(0.4);
        plan.rigid(&block([0.2; 3]), at([0.0, 0.0, 0.14]), 3.0, diagonal(0.02), [1.0, 0.0, -4.0], [0.0; 3]);
        if on_mesh {
            plan.scripted(&block([3.0, 3.0, 0.2]), at([0.0, 0.0, -0.1]));
        } else {
            plan.half_space([0.0, 0.0, 1.0], 0.0);
        }
        let mut world = filtered(plan.build());
        world.gravity = [0.0, 0.0, -9.81];
        let mut total = 0.0;
        for step in 0..10 {
            world.prepare();
            let free = momentum(&world, &world.drives.velocities);
            let report = world.advance(Par::Serial).unwrap();
            let lost = sub(free, momentum(&world, &world.result.velocities));
            let missing = norm(sub(lost, report.momentum_taken));
            assert!(missing < 1e-10 * (1.0 + norm(free)), "mesh {on_mesh} step {step}: {missing:e} {report:?}");
            // What the host reads as impulses is what the masses gained.
            for (block, f) in world.result.impulses.iter().enumerate().take(1) {
                let gained = sub(world.result.end_velocities[block], world.drives.velocities[block]);
                assert!(norm(sub(gained.map(|g| 3.0 * g), *f)) < 1e-10 * (1.0 + norm(*f)));
            }
            total += dot(report.momentum_taken, [0.0, 0.0, -1.0]);
        }
        assert!(total > 10.0, "it must strike: {total}");
    }
}
