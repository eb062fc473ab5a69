//! Rows against finite differences of the true gap, and their exactness at the motion they were made for.

use crate::world::*;
use signorini::constraint::{Linearisation, Metric, build_rows};
use signorini::contact_search::{BodyFilter, CandidateSearch, Contact, Passing, near_contacts};
use signorini::math::{Vec3, add, dot, norm, sub};
use signorini::model::{Segment, State};
use signorini::parallel::Par;

struct Setting {
    world: World,
    contacts: Vec<Contact>,
    metric: Metric,
}

fn setting(seed: u64) -> Setting {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(6, 0.2);
    plan.cloth(&cloth, moved(&cloth, [0.0, 0.0, 0.003], &mut jitter, 0.002), 0.1, &[7], [0.0; 3]);
    let pose = at([0.0, 0.0, 0.058]).advanced([0.0; 3], [0.2, 0.3, 0.1], 0.1);
    plan.rigid(&block([0.1; 3]), pose, 1.0, diagonal(0.002), [0.0; 3], [0.0; 3]);
    plan.last().half_thickness = Some(0.01);
    plan.half_space([0.0, 0.0, 1.0], 0.0);
    let mut world = plan.build();
    world.velocities.iter_mut().for_each(|v| *v = jitter.vector(2.0));
    let rigid = world.body(2).blocks.start;
    world.velocities[rigid + 1] = [20.0 + jitter.next(), 10.0, -15.0];
    world.prepare();
    let filter = BodyFilter::new(&world.model);
    let mut search = CandidateSearch::default();
    let x0 = &world.state.positions;
    let found = search.update(&world.model, &filter, x0, x0, 1.0, Par::Serial);
    let passing = Passing::default();
    let (start, mut contacts) = (&world.state, Vec::new());
    near_contacts(&world.model, &filter, &passing, found, start, start, 1.0, &mut contacts, Par::Serial);
    let metric = Metric::new(&world.model, &world.state, &world.drives).unwrap();
    Setting { contacts, metric, world }
}

fn end_of(world: &World, v: &[Vec3]) -> State {
    let mut end = State::default();
    let segment = Segment {
        model: &world.model,
        drives: &world.drives,
        step_start: &world.state,
        start: &world.state,
        from: 0.0,
        to: 1.0,
        dt: world.dt,
    };
    segment.end_state(v, 1.0, false, &mut end);
    end
}

#[test]
fn rows_are_exact_at_their_motion_and_follow_the_true_gap_around_it() {
    for seed in 1..4 {
        let Setting { world, contacts, metric } = setting(seed);
        assert!(contacts.len() > 10);
        let mut jitter = Jitter(seed + 50);
        let free = world.drives.velocities.clone();
        let tentative: Vec<Vec3> = free.iter().map(|v| add(*v, jitter.vector(0.5))).collect();
        let end = end_of(&world, &tentative);
        let required: Vec<f64> = contacts.iter().map(|c| c.required_gap(0.1)).collect();
        let about = Linearisation {
            start: &world.state,
            end: &end,
            velocities: &tentative,
            unconstrained: &free,
            dt: world.dt,
        };
        let frames = vec![None; contacts.len()];
        let built = build_rows(&world.model, &metric, &contacts, &required, &frames, &about);
        let response: Vec<Vec3> = tentative
            .iter()
            .zip(&free)
            .enumerate()
            .map(|(b, (v, f))| if metric.fixed[b] { [0.0; 3] } else { sub(*v, *f) })
            .collect();
        let mut turning = 0;
        for (row, index) in built.contact.iter().enumerate() {
            let contact = &contacts[*index as usize];
            let excess = built.rows.velocity(row, &response)[0] - built.rows.normal_targets[row];
            let truth = (contact.gap(&end.positions) - required[*index as usize]) / world.dt;
            // The pinned vertex moves with its velocity, whatever the tentative one said: rows leave it out.
            let touches_pin = contact.vertices.iter().zip(contact.weights).any(|(v, w)| *v == 7 && w != 0.0);
            if !touches_pin {
                assert!((excess - truth).abs() < 1e-9 * (1.0 + truth.abs()), "row {row}: {excess} {truth}");
            }
            let rigid = built.rows.angular_offsets[row] != built.rows.angular_offsets[row + 1];
            turning += usize::from(rigid);
            for block in 0..world.model.block_count {
                for axis in 0..3 {
                    let step = 1e-4;
                    let mut other = tentative.clone();
                    other[block][axis] += step;
                    let gap = contact.gap(&end_of(&world, &other).positions);
                    let slope = (gap - contact.gap(&end.positions)) / (step * world.dt);
                    let mut unit = vec![[0.0; 3]; world.model.block_count];
                    unit[block][axis] = 1.0;
                    let row_slope = built.rows.velocity(row, &unit)[0];
                    let lever = 0.1;
                    let angular = block == world.body(2).blocks.start + 1;
                    // Half the turn, times the lever, bounds what a chord lever misses of the derivative.
                    let allowed = if angular { 0.5 * lever * 0.27 } else { 1e-8 };
                    if !metric.fixed[block] {
                        assert!((slope - row_slope).abs() < allowed, "row {row} block {block}: {slope} {row_slope}");
                    }
                }
            }
            let [n, t1, t2] = built.rows.frames[row];
            let orthonormal = [dot(n, t1), dot(n, t2), dot(t1, t2), norm(n) - 1.0, norm(t1) - 1.0, norm(t2) - 1.0];
            assert!(orthonormal.iter().all(|v| v.abs() < 1e-12));
        }
        assert!(turning > 3);
    }
}
