//! Fail-safes alone: with one round and no division, rigid zones keep momentum, hold takes it, and every end is clean.

use crate::support::shapes::Triangles;
use crate::world::*;
use signorini::constraint::Metric;
use signorini::contact_search::{BodyFilter, CandidateSearch, Passing, intersections};
use signorini::fail_safe::{Sweep, ZoneOutcome, ZoneResponse, hold, resolve_zones};
use signorini::math::{norm, sub};
use signorini::model::{FailSafe, Method, Segment, StepError, ZoneFriction};
use signorini::parallel::Par;

fn crude(world: &mut World) {
    world.settings.rounds_max = 1;
    world.settings.halvings_max = 0;
}

/// A sheet that flies at a spinning ball.
fn sheet_and_ball(seed: u64, fail_safe: FailSafe) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.4);
    let cloth = sheet(10, 0.6);
    plan.cloth(&cloth, moved(&cloth, [0.0; 3], &mut jitter, 0.003), 0.5, &[], [0.0, 0.3, 6.0]);
    plan.last().self_collision = true;
    plan.rigid(&ball(0.1), at([0.02, 0.01, 0.15]), 0.4, diagonal(0.0016), [0.0; 3], [2.0, 3.0, 1.0]);
    let mut world = plan.build();
    crude(&mut world);
    world.settings.fail_safe = fail_safe;
    world
}

#[test]
fn zones_keep_momentum_and_leave_no_intersection() {
    use FailSafe::*;
    for fail_safe in [UnilateralProjection, InelasticProjection, RigidZone] {
        let (mut projected, mut rigid) = (0, 0);
        for seed in 0..4 {
            let mut world = sheet_and_ball(seed, fail_safe);
            for step in 0..10 {
                let before = momentum(&world, &world.velocities);
                let report = world.step();
                projected += report.projected_zones;
                rigid += report.rigid_zones;
                // Nothing is scripted: zones keep what they have, to rounding.
                let change = sub(momentum(&world, &world.result.velocities), before);
                let change = norm(sub(change, report.momentum_taken.map(|c| -c)));
                assert!(change < 1e-9 * norm(before), "seed {seed} step {step}: {change:e}, {report:?}");
                if report.held_vertices == 0 {
                    assert!(norm(report.momentum_taken) < 1e-9 * norm(before), "seed {seed} step {step}: {report:?}");
                }
                let filter = BodyFilter::new(&world.model);
                let found = intersections(&world.model, &filter, &world.state, Par::Serial);
                assert!(found.witnesses.is_empty(), "seed {seed} step {step}: {:?}", found.witnesses);
            }
        }
        let own = if fail_safe == RigidZone { rigid } else { projected };
        assert!(own > 0, "{fail_safe:?}: no zone was needed");
    }
}

#[test]
fn infinite_masses_take_the_momentum_that_is_reported() {
    for on_mesh in [false, true] {
        let mut plan = Plan::rubbing(0.4);
        plan.rigid(&block([0.2; 3]), at([0.0, 0.0, 0.12]), 3.0, diagonal(0.02), [1.0, 0.0, -4.0], [0.0; 3]);
        if on_mesh {
            plan.scripted(&block([3.0, 3.0, 0.2]), at([0.0, 0.0, -0.1]));
        } else {
            plan.half_space([0.0, 0.0, 1.0], 0.0);
        }
        let mut world = plan.build();
        world.gravity = [0.0, 0.0, -9.81];
        let mut total = 0.0;
        for _ in 0..10 {
            world.prepare();
            let free = momentum(&world, &world.drives.velocities);
            let report = world.advance(Par::Serial).unwrap();
            let lost = sub(free, momentum(&world, &world.result.velocities));
            assert!(norm(sub(lost, report.momentum_taken)) < 1e-10 * (1.0 + norm(free)), "{lost:?} {report:?}");
            total += norm(report.momentum_taken);
        }
        assert!(total > 10.0, "it must strike: {total}");
    }
}

#[test]
fn crude_settings_still_end_clean_between_scripted_jaws() {
    let (mut zones, mut pinched) = (0, 0);
    for seed in 0..6 {
        let mut jitter = Jitter(seed);
        let mut plan = Plan::rubbing(0.3);
        let cloth = sheet(8, 0.3);
        plan.cloth(&cloth, moved(&cloth, [0.0; 3], &mut jitter, 0.002), 0.1, &[], [0.3, 0.0, 1.0]);
        plan.last().self_collision = true;
        plan.rigid(&ball(0.05), at([0.0, 0.0, 0.06]), 0.3, diagonal(0.0003), [0.0, 0.0, -1.0], [5.0, 0.0, 3.0]);
        let upper = plan.scripted(&block([0.3, 0.3, 0.05]), at([0.0, 0.01, 0.16]));
        let lower = plan.scripted(&block([0.3, 0.3, 0.05]), at([0.01, 0.0, -0.05]));
        let mut world = plan.build();
        crude(&mut world);
        for step in 0..14 {
            world.prepare();
            let way = if step < 9 { 1.0 } else { -1.0 };
            for (key, sign) in [(upper, -1.0), (lower, 1.0)] {
                let mut pose = world.pose(key).advanced([0.0; 3], [0.0, 0.3 * way, 0.2], world.dt);
                pose.position[2] += sign * way * 0.006;
                world.script(key, pose);
            }
            match world.advance(Par::Serial) {
                Ok(report) => zones += report.zones(),
                Err(StepError::Pinched { report, .. }) => {
                    pinched += 1;
                    assert!(report.certified_fraction < 1.0);
                }
                Err(other) => panic!("seed {seed} step {step}: {other:?}"),
            }
            let filter = BodyFilter::new(&world.model);
            let found = intersections(&world.model, &filter, &world.state, Par::Serial);
            assert!(found.witnesses.is_empty(), "seed {seed} step {step}: {:?}", found.witnesses);
        }
    }
    assert!(zones > 0 && pinched > 0, "zones {zones}, pinched {pinched}");
}

#[test]
fn holding_grows_until_nothing_is_hit_and_held_parts_keep_their_bits() {
    let mut jitter = Jitter(3);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(8, 0.4);
    // Two sheets and a ball fly at each other; a third sheet is aside and free.
    plan.cloth(&cloth, moved(&cloth, [0.0; 3], &mut jitter, 0.002), 0.1, &[], [0.0, 0.0, 8.0]);
    plan.cloth(&cloth, moved(&cloth, [0.01, 0.02, 0.05], &mut jitter, 0.002), 0.1, &[], [0.0, 0.0, -8.0]);
    plan.rigid(&ball(0.05), at([0.0, 0.0, 0.13]), 0.3, diagonal(0.0003), [0.0, 0.0, -9.0], [5.0, 0.0, 3.0]);
    plan.cloth(&cloth, moved(&cloth, [2.0, 0.0, 0.0], &mut jitter, 0.002), 0.1, &[], [0.0, 0.0, 8.0]);
    let mut world = plan.build();
    world.prepare();
    let filter = BodyFilter::new(&world.model);
    let segment = Segment {
        model: &world.model,
        drives: &world.drives,
        step_start: &world.state,
        start: &world.state,
        from: 0.0,
        to: 1.0,
        dt: world.dt,
    };
    let passing = Passing::default();
    let sweep = Sweep { segment, filter: &filter, passing: &passing, factor: 1.0, par: Par::Serial };
    let metric = Metric::new(&world.model, &world.state, &world.drives).unwrap();
    let mut candidates = CandidateSearch::default();
    let (_, hits) = sweep.test(&world.drives.velocities, 1.0, &mut candidates);
    assert!(!hits.is_empty());
    let outcome = hold(&sweep, &metric, &world.drives.velocities, &hits, &mut candidates);
    assert!(outcome.hits.is_empty());
    assert!(outcome.held.len() > 10);
    let ball = world.model.body_index(3).unwrap();
    assert_eq!(outcome.end.poses[ball], world.state.poses[ball], "the whole rigid body is held");
    for node in outcome.held.iter().filter(|n| **n < world.model.rest.len()) {
        assert_eq!(outcome.end.positions[*node], world.state.positions[*node]);
    }
    let aside = world.body(4).vertices.start;
    assert!(outcome.end.positions[aside][2] > world.state.positions[aside][2] + 0.07, "what is free moves on");
    let found = intersections(&world.model, &filter, &outcome.end, Par::Serial);
    assert!(found.witnesses.is_empty());
}

/// Zones of the first step of a prepared world, from its unconstrained velocities.
fn zones_of(world: &World, fail_safe: FailSafe, friction: ZoneFriction) -> ZoneOutcome {
    let (filter, passing) = (BodyFilter::new(&world.model), Passing::default());
    let (start, drives) = (&world.state, &world.drives);
    let segment = Segment { model: &world.model, drives, step_start: start, start, from: 0.0, to: 1.0, dt: world.dt };
    let sweep = Sweep { segment, filter: &filter, passing: &passing, factor: 1.0, par: Par::Serial };
    let metric = Metric::new(&world.model, start, drives).unwrap();
    let mut candidates = CandidateSearch::default();
    let (_, hits) = sweep.test(&drives.velocities, 1.0, &mut candidates);
    assert!(!hits.is_empty(), "nothing collides");
    let response = ZoneResponse { fail_safe, friction };
    let outcome = resolve_zones(&sweep, &metric, &drives.velocities, &hits, &mut candidates, &response);
    let (_, left) = sweep.test(&outcome.velocities, 1.0, &mut candidates);
    assert_eq!(left, outcome.hits, "what is tested again is what a whole test finds");
    outcome
}

/// Two pairs of sheets that fly at each other, far apart.
fn two_pairs(seed: u64) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(7, 0.3);
    for x in [0.0, 2.0] {
        plan.cloth(&cloth, moved(&cloth, [x, 0.0, 0.0], &mut jitter, 0.002), 0.1, &[], [0.3, 0.0, 6.0]);
        plan.cloth(&cloth, moved(&cloth, [x + 0.01, 0.02, 0.03], &mut jitter, 0.002), 0.3, &[], [0.0, 0.2, -6.0]);
    }
    plan.build()
}

#[test]
fn each_zone_keeps_its_momentum_and_rigid_ones_their_angular_momentum() {
    for seed in 1..5 {
        for fail_safe in [FailSafe::UnilateralProjection, FailSafe::InelasticProjection, FailSafe::RigidZone] {
            for friction in [ZoneFriction::PerContact, ZoneFriction::PerZone] {
                let mut world = two_pairs(seed);
                world.prepare();
                let outcome = zones_of(&world, fail_safe, friction);
                let what = format!("seed {seed} {fail_safe:?} {friction:?}: {:?}", outcome.reports);
                assert!(outcome.hits.is_empty() && outcome.reports.len() >= 2, "{what}");
                let old = &world.drives.velocities;
                // Sheets 1 and 2 share no zone with 3 and 4.
                for pair in [[1, 2], [3, 4]] {
                    let (mut change, mut size, mut energy) = ([0.0; 3], 0.0, 0.0);
                    for key in pair {
                        let body = world.body(key);
                        let signorini::model::Kind::Deformable { masses, .. } = &body.description.kind else {
                            panic!()
                        };
                        for (block, m) in body.blocks.clone().zip(masses) {
                            let (new, old) = (outcome.velocities[block], old[block]);
                            change = signorini::math::add_scaled(change, *m, sub(new, old));
                            size += m * norm(old);
                            energy += m * (norm(new).powi(2) - norm(old).powi(2));
                        }
                    }
                    assert!(norm(change) < 1e-12 * size, "{what}: {:e}", norm(change) / size);
                    assert!(energy <= 1e-12 * size, "{what}: {energy:e}");
                }
                for report in &outcome.reports {
                    let angular = norm(report.angular_momentum_change);
                    if report.fail_safe == FailSafe::RigidZone {
                        assert!(angular < 1e-13, "{what}");
                        assert_eq!(report.residual, 0.0, "{what}");
                    } else {
                        // Normals at impact are not those at the start: an error, which is reported.
                        assert!(angular > 0.0 && angular < 0.05 && report.converged, "{what}");
                        assert!(report.residual < 1e-6 && report.rank > 0, "{what}");
                    }
                }
            }
        }
    }
}

#[test]
fn rigid_zones_break_down_between_scripts_that_disagree_where_projections_do_not() {
    // Two scripted plates slide past each other, a cloth between them touches both.
    let between = |fail_safe| {
        let mut plan = Plan::rubbing(0.0);
        let cloth = sheet(8, 0.3);
        plan.cloth(&cloth, moved(&cloth, [0.0; 3], &mut Jitter(2), 1e-4), 0.1, &[], [0.0, 0.0, 0.09]);
        let upper = plan.scripted(&block([0.5, 0.5, 0.02]), at([0.0, 0.003, 0.018]));
        let lower = plan.scripted(&block([0.5, 0.5, 0.02]), at([0.002, 0.0, -0.018]));
        let mut world = plan.build();
        world.prepare();
        for (key, x) in [(upper, 0.02), (lower, -0.02)] {
            let mut pose = world.pose(key);
            pose.position[0] += x;
            pose.position[2] -= x.signum() * 0.0067;
            world.script(key, pose);
        }
        zones_of(&world, fail_safe, ZoneFriction::Frictionless)
    };
    let rigid = between(FailSafe::RigidZone);
    let misfit = rigid.reports.iter().map(|r| r.residual).fold(0.0, f64::max);
    assert!(misfit > 1.0 && !rigid.hits.is_empty(), "misfit {misfit} m/s, {} hits left", rigid.hits.len());
    let projected = between(FailSafe::UnilateralProjection);
    assert!(projected.hits.is_empty() && projected.rigid == 0, "{:?}", projected.reports);
}

#[test]
fn zones_that_share_a_script_only_are_apart() {
    let mut plan = Plan::rubbing(0.0);
    let cloth = sheet(4, 0.2);
    for x in [-0.5, 0.5] {
        plan.cloth(&cloth, moved(&cloth, [x, 0.0, 0.05], &mut Jitter(1), 0.001), 0.1, &[], [0.0, 0.0, -9.0]);
    }
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    for (fail_safe, count) in [(FailSafe::UnilateralProjection, 32), (FailSafe::RigidZone, 32)] {
        let mut world = plan.clone().build();
        world.prepare();
        let outcome = zones_of(&world, fail_safe, ZoneFriction::Frictionless);
        assert_eq!(outcome.reports.len(), count, "every vertex strikes the ground on its own: {:?}", outcome.reports);
        assert!(outcome.hits.is_empty() && outcome.reports.iter().all(|r| r.scripted == 1 && r.nodes == 1));
    }
}

#[test]
fn holding_keeps_zones_that_came_clean() {
    // A cloth between plates that slide past each other, where rigid zones break down; aside, two sheets that one resolves.
    let mut cases = 0;
    for dz in [0.004, 0.005, 0.006, 0.0067] {
        let mut plan = Plan::rubbing(0.0);
        let cloth = sheet(8, 0.3);
        plan.cloth(&cloth, moved(&cloth, [0.0; 3], &mut Jitter(2), 1e-4), 0.1, &[], [0.0, 0.0, 0.09]);
        let upper = plan.scripted(&block([0.5, 0.5, 0.02]), at([0.0, 0.003, 0.018]));
        let lower = plan.scripted(&block([0.5, 0.5, 0.02]), at([0.002, 0.0, -0.018]));
        let mut pair = Vec::new();
        for (z, v) in [(0.0, 6.0), (0.03, -6.0)] {
            let start = moved(&cloth, [2.0, 0.0, z], &mut Jitter(3), 0.002);
            pair.push(plan.cloth(&cloth, start, 0.1, &[], [0.3, 0.0, v]));
        }
        let mut world = plan.build();
        world.settings.method = Method::VelocityFilter;
        world.settings.filter.passes_max = 0;
        world.settings.fail_safe = FailSafe::RigidZone;
        world.prepare();
        for (key, x) in [(upper, 0.02), (lower, -0.02)] {
            let mut pose = world.pose(key);
            pose.position[0] += x;
            pose.position[2] -= x.signum() * dz;
            world.script(key, pose);
        }
        let Ok(report) = world.advance(Par::Serial) else { continue };
        if report.held_vertices == 0 {
            continue;
        }
        cases += 1;
        assert!(report.rigid_zones > 0 && report.held_vertices <= cloth.positions.len() as u32, "{dz}: {report:?}");
        for key in pair {
            for block in world.body(key).blocks.clone() {
                let v = world.result.velocities[block];
                assert!(v[0] > 0.1 && v[2].abs() < 7.0, "{dz}: the sheets aside move on: {v:?}");
            }
        }
    }
    assert!(cases > 0, "nothing was held");
}

#[test]
fn a_rigid_zone_that_spins_fast_turns_by_a_radian_at_most() {
    // A vertex falls on the middle of a triangle that turns by 2.5 radians in the step: chords of that turn would bring the
    // two within a third of their distance.
    let mut plan = Plan::rubbing(0.0);
    let corners = vec![[0.1, 0.0, 0.0], [-0.05, 0.08, 0.0], [-0.05, -0.08, 0.0]];
    let triangle = Triangles { positions: corners.clone(), faces: vec![[0, 1, 2]] };
    let first = plan.cloth(&triangle, corners.clone(), 0.3, &[], [0.0; 3]);
    let point = Triangles { positions: vec![[0.0; 3]], faces: Vec::new() };
    let second = plan.cloth(&point, vec![[0.0, 0.0, 0.004]], 0.1, &[], [0.0; 3]);
    let mut world = plan.build();
    let turn = 2.5 / world.dt;
    for (block, x) in world.body(first).blocks.clone().zip(&corners) {
        world.velocities[block] = [0.0, 0.0, turn * x[1]];
    }
    let block = world.body(second).blocks.start;
    world.velocities[block] = [0.0, 0.0, -0.02 / world.dt];
    world.prepare();
    let outcome = zones_of(&world, FailSafe::RigidZone, ZoneFriction::Frictionless);
    assert!(outcome.hits.is_empty() && outcome.reports.len() == 1, "{:?}", outcome.reports);
    // What the shorter turn leaves out is told.
    assert!(norm(outcome.reports[0].angular_momentum_change) > 1e-3, "{:?}", outcome.reports);
}
