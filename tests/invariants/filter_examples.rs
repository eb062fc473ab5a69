//! The velocity filter against closed forms, and the figures of [Harmon10] that show where it errs.

use crate::support::shapes::Triangles;
use crate::world::*;
use signorini::math::{norm, sub};
use signorini::model::{Material, Method};
use signorini::parallel::Par;

fn particle() -> Triangles {
    Triangles { positions: vec![[0.0; 3]], faces: Vec::new() }
}

/// Balls of mass 1 and 3 that meet head on: `v1' = v1 + m2/(m1 + m2) (1 + e) (v2 - v1)`.
#[test]
fn two_balls_part_as_restitution_says() {
    for restitution in [0.0, 0.25, 0.8, 1.0] {
        let mut plan = Plan::rubbing(0.5);
        let ball = ball(0.05);
        // The mesh of a ball has vertices on its axes: it meets the other vertex to vertex.
        let a = plan.rigid(&ball, at([-0.08, 0.0, 0.0]), 1.0, diagonal(0.001), [4.0, 0.0, 0.0], [0.0; 3]);
        let b = plan.rigid(&ball, at([0.08, 0.0, 0.0]), 3.0, diagonal(0.003), [-2.0, 0.0, 0.0], [0.0; 3]);
        let mut world = plan.build();
        world.settings.method = Method::VelocityFilter;
        world.settings.filter.restitution = restitution;
        let report = world.step();
        assert!(
            report.rounds == 2 && report.projected_zones + report.rigid_zones + report.held_vertices == 0,
            "{report:?}"
        );
        let speed = |key: u64| world.result.end_velocities[world.body(key).blocks.start][0];
        let expected = [4.0 - 0.75 * (1.0 + restitution) * 6.0, -2.0 + 0.25 * (1.0 + restitution) * 6.0];
        for (got, want) in [speed(a), speed(b)].into_iter().zip(expected) {
            assert!((got - want).abs() < 1e-9, "e {restitution}: {got} against {want}");
        }
    }
}

/// [Harmon10, Fig. 2.4]: a fixed particle, struck by two that move together. Every second impulse halves the velocities:
/// impulses alone never end, and the step does.
#[test]
fn two_particles_against_a_fixed_one_are_more_than_impulses_can_do() {
    let build = |passes_max: u32| {
        let mut plan = Plan::rubbing(0.0);
        // Plates that do not turn, of which only the middle one is in the way of both others.
        plan.scripted(&block([0.1, 0.1, 0.02]), at([-0.1, 0.0, 0.0]));
        for (width, place) in [(0.3, [0.0, 0.0, 0.0245]), (0.1, [0.1, 0.0, 0.049])] {
            plan.rigid(&block([width, 0.1, 0.02]), at(place), 1.0, diagonal(1e12), [0.0, 0.0, -1e4], [0.0; 3]);
        }
        let mut world = plan.build();
        world.settings.method = Method::VelocityFilter;
        world.settings.filter.passes_max = passes_max;
        world
    };
    for passes in [4, 9, 16] {
        let mut world = build(passes);
        let report = world.step();
        assert_eq!(report.rounds, passes + 1, "the series has ended");
        assert!(report.projected_zones + report.rigid_zones > 0, "{report:?}");
        // What the script took by impulses: half of what was left in every second pass.
        let taken = 1e4 * 2.0 * (1.0 - 0.5_f64.powi(passes.div_ceil(2) as i32));
        let impulses: f64 =
            world.result.contacts.iter().filter(|c| c.bodies.contains(&1)).map(|c| c.impulse[2].abs()).sum();
        assert!((impulses - taken).abs() < 1e-6 * taken, "{passes} passes: {impulses} against {taken}");
    }
}

/// [Harmon10, Fig. 3.1]: the response comes before the contact. A particle that would strike the floor late in the step
/// stops where it started, however large the step: the error is the way to the floor, and halves with the step.
#[test]
fn the_response_is_early_by_the_way_to_the_contact() {
    let mut errors = Vec::new();
    for parts in [1, 2, 4, 8] {
        let mut plan = Plan::rubbing(0.0);
        plan.cloth(&particle(), vec![[0.0, 0.0, 0.1]], 1.0, &[], [0.0, 0.0, -10.0]);
        plan.half_space([0.0, 0.0, 1.0], 0.0);
        let mut world = plan.build();
        world.settings.method = Method::VelocityFilter;
        world.settings.filter.restitution = 1.0;
        // It touches at 0.8 of the time, and should end at 0.025 m.
        let separation = HALF_THICKNESS;
        let time = 0.0125;
        world.dt = time / f64::from(parts);
        for _ in 0..parts {
            world.step();
        }
        let exact = separation + 10.0 * (time - (0.1 - separation) / 10.0);
        let got = world.state.positions[0];
        assert!((world.result.end_velocities[0][2] - 10.0).abs() < 1e-9, "the velocity is right");
        errors.push(norm(sub(got, [0.0, 0.0, exact])));
    }
    // The whole step: it rises from where it started, by twice the way to the floor too far.
    assert!((errors[0] - 2.0 * (0.1 - HALF_THICKNESS)).abs() < 1e-9, "{errors:?}");
    assert!(errors.windows(2).all(|e| e[1] <= e[0]) && errors[3] < 0.2 * errors[0], "{errors:?}");
}

/// How end velocities follow: the host's own end velocity plus what the filter changed of the mean.
#[test]
fn end_velocities_follow_the_filtered_mean() {
    let mut plan = Plan::rubbing(0.2);
    let cloth = sheet(6, 0.3);
    plan.cloth(&cloth, moved(&cloth, [0.0, 0.0, 0.01], &mut Jitter(2), 0.002), 0.1, &[], [0.4, 0.0, -3.0]);
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    let mut world = plan.build();
    world.settings.method = Method::VelocityFilter;
    world.prepare();
    let (start, mean) = (world.state.positions.clone(), world.drives.velocities.clone());
    world.advance(Par::Serial).unwrap();
    for (block, v) in world.result.end_velocities.iter().enumerate() {
        // x1 = x0 + dt times the filtered mean.
        let filtered = sub(world.state.positions[block], start[block]).map(|way| way / world.dt);
        assert!(norm(sub(filtered, *v)) < 1e-12, "{filtered:?} {v:?}");
        let gained = world.result.impulses[block].map(|f| f / (0.1 / 36.0));
        assert!(norm(sub(sub(*v, mean[block]), gained)) < 1e-9);
    }
}

/// A ball that falls straight on a floor leaves it by the greatest of three: its own restitution, the floor's, the step's.
#[test]
fn a_ball_bounces_by_the_greater_restitution() {
    for (of_ball, of_floor, of_step, expected) in
        [(0.8, 0.2, 0.0, 0.8), (0.2, 0.8, 0.0, 0.8), (0.2, 0.2, 0.0, 0.2), (0.8, 0.2, 0.9, 0.9), (0.0, 0.0, 0.0, 0.0)]
    {
        let mut plan = Plan::rubbing(0.5);
        let ball = plan.rigid(&ball(0.05), at([0.0, 0.0, 0.06]), 1.0, diagonal(0.001), [0.0, 0.0, -3.0], [0.0; 3]);
        let floor = plan.half_space([0.0, 0.0, 1.0], 0.0);
        let mut world = plan.build();
        let first = world.model.materials.list[0];
        world.model.materials.list = [of_ball, of_floor].map(|e| Material { restitution: e, ..first }).to_vec();
        for (key, material) in [(ball, 0), (floor, 1)] {
            let body = world.model.body_index(key).unwrap();
            world.model.bodies[body].description.material = material;
        }
        world.settings.method = Method::VelocityFilter;
        world.settings.filter.restitution = of_step;
        let report = world.step();
        assert_eq!(report.rounds, 2, "{report:?}");
        let [x, y, z] = world.result.end_velocities[world.body(ball).blocks.start];
        let at = format!("{of_ball} on {of_floor}, {of_step}: {z}");
        assert!((z - 3.0 * expected).abs() < 1e-12 && x.hypot(y) < 1e-12, "{at}");
    }
}
