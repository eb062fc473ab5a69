//! Same inputs, same bits: for any number of threads, with and without scratch kept from earlier steps.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

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
        ("crumple", || scenes::crumple(36, 0), 90),
        ("drape", || scenes::drape(34, 0), 60),
        ("ball", || scenes::catch_ball(16, 1.0, 1.0, 0), 60),
        ("boxes", || scenes::boxes(1, 3, 0), 30),
    ]
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for (name, make, steps) in worlds() {
        let serial = hashes(make(), steps, Par::Serial, false);
        for threads in [1, 2, 3, 5] {
            let pool = Pool::new(threads).expect("threads");
            let pooled = hashes(make(), steps, Par::Pool(&pool), false);
            let first = (0..steps).find(|&i| serial[i] != pooled[i]);
            assert_eq!(first, None, "{name}: step differs on {threads} threads");
        }
    }
}

#[test]
fn emptied_scratch_changes_no_bit() {
    for (name, make, steps) in worlds() {
        let kept = hashes(make(), steps, Par::Serial, false);
        let emptied = hashes(make(), steps, Par::Serial, true);
        assert_eq!((0..steps).find(|&i| kept[i] != emptied[i]), None, "{name}");
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
