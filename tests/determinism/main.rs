//! Same inputs, same bits: for any number of threads, with and without scratch kept from earlier steps.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod snapshot;
#[allow(dead_code, unused_imports)]
#[path = "../../benches/support/mod.rs"]
mod support;

use signorini::implicit_contact::Scratch;
use signorini::parallel::{Par, Pool};
use support::host::Host;
use support::scenes;

/// Hashes after every step.
fn hashes(mut host: Host, steps: usize, par: Par, empty_scratch: bool) -> Vec<u64> {
    let mut out = Vec::with_capacity(steps);
    for _ in 0..steps {
        if empty_scratch {
            host.scratch = Scratch::default();
        }
        host.step(par).expect("a step");
        out.push(host.hash());
    }
    out
}

/// Name, start and number of steps of a world.
type World = (&'static str, fn() -> Host, usize);

fn worlds() -> Vec<World> {
    vec![
        ("crumple", || scenes::crumple(34, 0), 80),
        ("drape", || scenes::drape(34, 0), 40),
        ("ball", || scenes::catch_ball(12, 1.0, 1.0, 0), 40),
        ("boxes", || scenes::boxes(1, 3, 0), 25),
    ]
}

#[test]
fn threads_and_scratch_change_no_bit() {
    let all = std::env::var("SIGNORINI_ALL").is_ok_and(|v| v == "1");
    if !all {
        println!("skipped without SIGNORINI_ALL=1: one and five threads");
    }
    let counts: &[usize] = if all { &[1, 2, 3, 5] } else { &[2, 3] };
    for (name, make, steps) in worlds() {
        let serial = hashes(make(), steps, Par::Serial, false);
        let differs = |other: &[u64]| (0..steps).find(|&i| serial[i] != other[i]);
        assert_eq!(differs(&hashes(make(), steps, Par::Serial, true)), None, "{name}: emptied scratch");
        for &threads in counts {
            let pool = Pool::new(threads).expect("threads");
            assert_eq!(differs(&hashes(make(), steps, Par::Pool(&pool), false)), None, "{name}: {threads} threads");
        }
    }
}

#[test]
fn the_hash_sees_a_single_bit() {
    let mut host = scenes::crumple(6, 0);
    let before = host.hash();
    let x = &mut host.state.positions[7][1];
    *x = f64::from_bits(x.to_bits() ^ 1);
    assert_ne!(before, host.hash());
}
