//! Scripted jaws that leave no room: PINCHED with a valid state, opening again, and the policy that passes.

use crate::world::*;
use signorini::model::{StartPolicy, StepError, StepReport};
use signorini::parallel::Par;

struct Jaws {
    world: World,
    upper: u64,
    lower: u64,
}

fn jaws(seed: u64) -> Jaws {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(9, 0.4);
    let start = moved(&cloth, [0.0; 3], &mut jitter, 0.001);
    plan.cloth(&cloth, start, 0.1, &[], [0.0; 3]);
    let upper = plan.scripted(&block([0.2, 0.2, 0.1]), at([0.01, 0.005, 0.07]));
    let lower = plan.scripted(&block([0.2, 0.2, 0.1]), at([0.0, 0.0, -0.07]));
    Jaws { world: plan.build(), upper, lower }
}

impl Jaws {
    /// Moves both jaws by `dz` towards each other.
    fn close(&mut self, dz: f64) -> Result<StepReport, StepError> {
        self.world.prepare();
        for (key, sign) in [(self.upper, -1.0), (self.lower, 1.0)] {
            let mut pose = self.world.pose(key);
            pose.position[2] += sign * dz;
            self.world.script(key, pose);
        }
        self.world.advance(Par::Serial)
    }

    fn gap(&self) -> f64 {
        self.world.pose(self.upper).position[2] - self.world.pose(self.lower).position[2] - 0.1
    }
}

fn certified(world: &World) -> usize {
    let filter = signorini::contact_search::BodyFilter::new(&world.model);
    signorini::contact_search::intersections(&world.model, &filter, &world.state, Par::Serial).witnesses.len()
}

#[test]
fn closing_jaws_are_pinched_at_a_certified_fraction_and_open_again() {
    for seed in 0..3 {
        let mut jaws = jaws(seed);
        let mut pinched = 0;
        for step in 0..8 {
            let before = jaws.gap();
            match jaws.close(0.004) {
                Ok(report) => assert_eq!(report.intersections, Some(0), "seed {seed} step {step}"),
                Err(StepError::Pinched { witnesses, report }) => {
                    pinched += 1;
                    assert!(!witnesses.is_empty());
                    let f = report.certified_fraction;
                    assert!((0.0..1.0).contains(&f), "{f}");
                    // Scripted bodies stand at the same fraction.
                    assert!((jaws.gap() - (before - 0.008 * f)).abs() < 1e-12, "seed {seed}: gap {}", jaws.gap());
                }
                Err(other) => panic!("seed {seed} step {step}: {other:?}"),
            }
            assert_eq!(certified(&jaws.world), 0, "seed {seed} step {step}");
            assert!(jaws.gap() > 0.0);
        }
        assert!(pinched > 0, "the jaws must meet the cloth from both sides");
        for step in 0..5 {
            let report = jaws.close(-0.004).unwrap_or_else(|e| panic!("seed {seed} opening {step}: {e:?}"));
            assert_eq!(report.certified_fraction, 1.0);
            assert_eq!(certified(&jaws.world), 0);
        }
    }
}

#[test]
fn with_the_passing_policy_a_pinch_lets_its_pairs_pass_and_the_rest_keeps_apart() {
    let mut jaws = jaws(1);
    jaws.world.settings.start_policy = StartPolicy::Pass;
    let mut tangled = 0;
    for _ in 0..8 {
        let report = jaws.close(0.004).expect("passing never pinches");
        assert_eq!(report.certified_fraction, 1.0);
        tangled += report.tangled_pairs;
    }
    assert!(tangled > 0);
    assert!(jaws.gap() < 0.0, "the script went on");
    for _ in 0..25 {
        jaws.close(-0.004).expect("opening");
    }
    assert_eq!(certified(&jaws.world), 0, "nothing is tangled once the jaws are open");
    let report = jaws.close(0.0).expect("a clean step");
    assert_eq!(report.tangled_pairs, 0);
}

#[test]
fn passing_ends_however_far_the_script_goes_in_one_step() {
    let mut jaws = jaws(2);
    jaws.world.settings.start_policy = StartPolicy::Pass;
    jaws.world.settings.rounds_max = 2;
    // Both jaws cross the cloth and each other at once.
    let report = jaws.close(0.09).expect("passing never pinches");
    assert_eq!(report.certified_fraction, 1.0);
    assert!(report.tangled_pairs > 0);
    let report = jaws.close(-0.12).expect("and out again");
    assert_eq!(report.certified_fraction, 1.0);
}
