//! Contact never adds energy: with no thickness to regain and nothing scripted, `|v|_A <= |v*|_A` and the contact
//! impulses do no positive work.

use crate::support::scenes;
use crate::world::*;
use signorini::math::dot;
use signorini::parallel::Par;

#[test]
fn host_matrix_scenes_never_gain_energy() {
    for seed in 0..2 {
        let hosts = [scenes::drape(14, seed), scenes::crumple(14, seed), scenes::cover_cube(14, seed)];
        for (number, mut host) in hosts.into_iter().enumerate() {
            host.settings.recovery_fraction = 0.0;
            let mut touched = 0;
            for step in 0..90 {
                let facts = host.step(Par::Serial).expect("a step");
                assert_eq!(facts.report.intersections, Some(0));
                touched += u32::from(facts.report.active_contacts > 0);
                let tolerance = 1e-9 + 2.0 * facts.report.complementarity_residual.max(1e-3);
                assert!(
                    facts.energy_gain <= tolerance * facts.energy_free,
                    "scene {number} seed {seed} step {step}: {:e} of {:e}",
                    facts.energy_gain,
                    facts.energy_free
                );
                if facts.report.parts == 1 {
                    let work: f64 =
                        host.result.impulses.iter().zip(&host.result.velocities).map(|(p, v)| dot(*p, *v)).sum();
                    assert!(work <= tolerance * facts.energy_free, "step {step}: contact work {work:e}");
                }
            }
            assert!(touched > 10, "scene {number} must touch");
        }
    }
}

#[test]
fn lumped_cloth_on_a_ball_loses_energy() {
    for seed in 0..3 {
        let mut jitter = Jitter(seed);
        let mut plan = Plan::rubbing(0.3);
        let cloth = sheet(10, 0.6);
        let start = moved(&cloth, [0.0; 3], &mut jitter, 0.002);
        plan.cloth(&cloth, start, 0.2, &[], [0.5, 0.0, 3.0]);
        plan.rigid(&ball(0.15), at([0.0, 0.01, 0.17]), 1.0, diagonal(0.009), [0.0; 3], [0.0; 3]);
        let mut world = plan.build();
        world.settings.recovery_fraction = 0.0;
        for step in 0..10 {
            world.prepare();
            let masses = world.masses();
            let free = kinetic(&masses, &world.drives.velocities);
            world.advance(Par::Serial).unwrap();
            let after = kinetic(&masses, &world.result.end_velocities);
            assert!(after <= free * (1.0 + 1e-9), "seed {seed} step {step}: {after} > {free}");
        }
    }
}
