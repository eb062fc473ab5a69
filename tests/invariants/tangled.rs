//! Start states that intersect: refused with witnesses, or passed until they have separated.

use crate::world::*;
use signorini::math::norm;
use signorini::model::{StartPolicy, StepError, Witness};
use signorini::parallel::Par;

/// A ball half way through one corner of a loose sheet, and a second sheet above it that is clean.
fn tangled(seed: u64) -> World {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.2);
    let cloth = sheet(9, 0.8);
    let start = moved(&cloth, [0.0; 3], &mut jitter, 0.002);
    plan.cloth(&cloth, start, 0.3, &[], [0.0; 3]);
    plan.rigid(&ball(0.1), at([0.3, 0.3, 0.02]), 1.0, diagonal(0.004), [0.0, 0.0, 2.0], [0.0; 3]);
    plan.rigid(&ball(0.1), at([-0.25, -0.25, 0.12]), 1.0, diagonal(0.004), [0.0, 0.0, -2.0], [0.0; 3]);
    plan.build()
}

#[test]
fn an_intersecting_start_is_refused_with_witnesses_and_nothing_changes() {
    let mut world = tangled(0);
    world.prepare();
    let before = world.state.positions.clone();
    let memory = world.memory.clone();
    match world.advance(Par::Serial) {
        Err(StepError::IntersectingStart(witnesses)) => {
            assert!(!witnesses.is_empty());
            assert!(witnesses.iter().all(|w| w.kind == Witness::EDGE_FACE && w.bodies.contains(&2)));
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(world.state.positions, before);
    assert_eq!(world.memory, memory);
}

#[test]
fn tangled_pairs_pass_until_they_have_separated_and_the_rest_keeps_its_promise() {
    for seed in 0..3 {
        let mut world = tangled(seed);
        world.settings.start_policy = StartPolicy::Pass;
        world.settings.certify = true;
        let mut separated = None;
        for step in 0..20 {
            world.prepare();
            let report = world.advance(Par::Serial).expect("a passing step");
            if report.tangled_pairs == 0 && separated.is_none() {
                separated = Some(step);
            }
            if separated.is_some() {
                assert_eq!(report.intersections, Some(0), "seed {seed} step {step}");
            }
            // The clean ball presses on the sheet all the while and never gets through.
            let index = world.model.body_index(3).unwrap();
            let filter = signorini::contact_search::BodyFilter::new(&world.model);
            let found =
                signorini::contact_search::intersections(&world.model, &filter, &world.state, Par::Serial).witnesses;
            let key = world.model.bodies[index].description.key;
            assert!(found.iter().all(|w| !w.bodies.contains(&key)), "seed {seed} step {step}");
        }
        assert!(separated.is_some_and(|s| s > 0), "seed {seed}: {separated:?}");
        assert!(norm(world.velocities[world.body(2).blocks.start]) > 1.0, "the tangled ball was not held back");
    }
}

#[test]
fn a_vertex_behind_a_half_space_is_a_witness() {
    let mut plan = Plan::default();
    plan.rigid(&block([0.2; 3]), at([0.0, 0.0, 0.05]), 1.0, diagonal(0.01), [0.0; 3], [0.0; 3]);
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    let mut world = plan.build();
    world.prepare();
    match world.advance(Par::Serial) {
        Err(StepError::IntersectingStart(w)) => {
            assert_eq!(w.len(), 4);
            assert!(w.iter().all(|w| w.kind == Witness::VERTEX_HALF_SPACE && w.bodies == [1, 2]));
        }
        other => panic!("{other:?}"),
    }
}
