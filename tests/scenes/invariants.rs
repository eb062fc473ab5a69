//! What has to hold in every step of every scene.

use crate::support::host::{Facts, Host};
use signorini::parallel::Par;

/// Whether long versions are asked for; says so when they are not.
pub fn long(what: &str) -> bool {
    let all = std::env::var("SIGNORINI_ALL").is_ok_and(|v| v == "1");
    if !all {
        println!("skipped without SIGNORINI_ALL=1: {what}");
    }
    all
}

/// Runs `steps` steps, checks each, and returns what they did.
pub fn run(name: &str, host: &mut Host, steps: usize, speed_limit: f64) -> Vec<Facts> {
    let mut all = Vec::with_capacity(steps);
    for number in 0..steps {
        let facts = match host.step(Par::Serial) {
            Ok(facts) => facts,
            Err(error) => panic!("{name}: step {number} refused: {error:?}"),
        };
        check(name, number, &facts, speed_limit);
        all.push(facts);
    }
    all
}

fn check(name: &str, number: usize, facts: &Facts, speed_limit: f64) {
    let r = &facts.report;
    assert_eq!(r.intersections, Some(0), "{name}: step {number}");
    assert!(r.certified_fraction == 1.0, "{name}: step {number} stands at {}", r.certified_fraction);
    assert!(facts.speed.is_finite() && facts.speed < speed_limit, "{name}: step {number}: {} m/s", facts.speed);
    // Equal and opposite, to rounding.
    assert!(facts.balance_error < 1e-10, "{name}: step {number}: {}", facts.balance_error);
    // |v|_A <= |v*|_A up to the residual and the reported recovery work [ALGORITHMS: what is true of energy]. Held
    // vertices and zones leave the metric solution, and are counted by the scenes instead.
    if r.held_vertices == 0 && r.zones() == 0 {
        let slack = 0.02 * facts.energy_free + r.recovery_work.max(0.0);
        assert!(
            facts.energy_gain <= slack,
            "{name}: step {number} gains {} J of {}",
            facts.energy_gain,
            facts.energy_free
        );
        assert!(facts.momentum_error <= 0.1, "{name}: step {number}: {}", facts.momentum_error);
    }
}

/// Fraction of steps with contact that took at most three rounds of manifold refinement.
pub fn few_rounds(all: &[Facts]) -> f64 {
    let touching: Vec<&Facts> = all.iter().filter(|f| f.report.contacts > 0).collect();
    let few = touching.iter().filter(|f| f.report.parts <= 1 && f.report.rounds <= 3).count();
    few as f64 / touching.len().max(1) as f64
}

/// Steps that needed a division, a zone or a held vertex.
pub fn fail_safes(all: &[Facts]) -> [usize; 3] {
    let count = |f: fn(&Facts) -> bool| all.iter().filter(|x| f(x)).count();
    [count(|f| f.report.parts > 1), count(|f| f.report.zones() > 0), count(|f| f.report.held_vertices > 0)]
}
