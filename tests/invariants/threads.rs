//! The same bits for any number of threads.

use crate::support::scenes;
use crate::world::*;
use signorini::parallel::{Par, Pool};

fn hash(threads: usize, steps: usize) -> u64 {
    let pool = (threads > 0).then(|| Pool::new(threads).unwrap());
    let par = pool.as_ref().map_or(Par::Serial, Par::Pool);
    let mut host = scenes::crumple(36, 1);
    for _ in 0..steps {
        host.step(par).expect("a step");
    }
    host.hash()
}

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    let serial = hash(0, 22);
    for threads in [1, 2, 3, 5] {
        assert_eq!(hash(threads, 22), serial, "{threads} threads");
    }
}

#[test]
fn empty_scratch_changes_no_bit() {
    let run = |fresh: bool| {
        let mut jitter = Jitter(3);
        let mut plan = Plan::rubbing(0.4);
        let cloth = sheet(12, 0.8);
        let start = moved(&cloth, [0.0, 0.0, 0.05], &mut jitter, 0.002);
        plan.cloth(&cloth, start, 0.3, &[], [0.0, 0.0, -2.0]);
        plan.rigid(&ball(0.1), at([0.0, 0.0, 0.2]), 1.0, diagonal(0.004), [0.0, 0.0, -4.0], [0.0; 3]);
        plan.half_space([0.0, 0.0, 1.0], 0.0);
        let mut world = plan.build();
        world.gravity = [0.0, 0.0, -9.81];
        for _ in 0..15 {
            if fresh {
                world.scratch = Default::default();
            }
            world.step();
        }
        world.hash()
    };
    assert_eq!(run(false), run(true));
}
