//! Contacts near the start and hits of a sweep, against brute force over all pairs and against sampling in time.

use crate::world::*;
use signorini::contact_search::{
    BodyFilter, CandidateSearch, Contact, Pair, PairKind, Passing, gather, minimum_separation, near_contacts,
    renewed_hits, swept_free, swept_hits,
};
use signorini::math::{Vec3, add, lerp, norm, sub};
use signorini::model::{Model, State};
use signorini::parallel::Par;

/// A crumpled sheet around a ball over a half-space, and where everything wants to go.
fn scene(seed: u64) -> (World, State) {
    let mut jitter = Jitter(seed);
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(7, 0.12);
    plan.cloth(&cloth, moved(&cloth, [0.0, 0.0, 0.03], &mut jitter, 0.006), 0.1, &[], [0.0; 3]);
    plan.last().self_collision = true;
    plan.last().half_thickness = Some(0.004);
    plan.rigid(&ball(0.03), at([0.0, 0.0, 0.07]), 1.0, diagonal(0.01), [0.0; 3], [0.0; 3]);
    plan.last().half_thickness = Some(0.003);
    plan.half_space([0.0, 0.0, 1.0], 0.02);
    let world = plan.build();
    let mut end = world.state.clone();
    end.positions.iter_mut().for_each(|x| *x = add(*x, jitter.vector(0.03)));
    (world, end)
}

fn all_pairs(model: &Model, filter: &BodyFilter) -> Vec<Pair> {
    let mut pairs = Vec::new();
    let mut take = |kind: PairKind, a: u32, b: u32| {
        let pair = Pair { kind, features: [a, b] };
        let v = pair.vertices(model);
        let shares = match kind {
            PairKind::EdgeEdge => v[2..].iter().any(|k| v[..2].contains(k)),
            _ => v[1..].contains(&v[0]),
        };
        let [x, y] = pair.bodies(model);
        if !shares && filter.allows(x, y) {
            pairs.push(pair);
        }
    };
    for v in &model.contact_vertices {
        (0..model.faces.len()).for_each(|f| take(PairKind::VertexFace, *v, f as u32));
    }
    for e in 0..model.edges.len() {
        (e + 1..model.edges.len()).for_each(|f| take(PairKind::EdgeEdge, e as u32, f as u32));
    }
    pairs
}

/// Vertices with weight, and the weights.
fn stencil(vertices: [u32; 4], weights: [f64; 4]) -> Vec<(u32, f64)> {
    let mut all: Vec<_> = vertices.into_iter().zip(weights).filter(|(_, w)| *w != 0.0).collect();
    all.sort_unstable_by_key(|(v, _)| *v);
    all
}

fn same(a: &[(u32, f64)], b: &[(u32, f64)]) -> bool {
    // A reduced contact may be told from either side: signs are compared up to a common one.
    let close = |s: f64| a.iter().zip(b).all(|((v, x), (w, y))| v == w && (x - s * y).abs() < 1e-12);
    a.len() == b.len() && (close(1.0) || close(-1.0))
}

#[test]
fn every_near_pair_is_covered_by_a_contact_and_every_contact_is_near() {
    let mut total = 0;
    for seed in 1..5 {
        let (world, end) = scene(seed);
        let (model, x0) = (&world.model, &world.state.positions);
        let filter = BodyFilter::new(model);
        let mut search = CandidateSearch::default();
        let candidates = search.update(model, &filter, x0, &end.positions, 1.0, Par::Serial);
        let passing = Passing::default();
        let mut contacts = Vec::new();
        near_contacts(model, &filter, &passing, candidates, &world.state, &end, 1.0, &mut contacts, Par::Serial);
        let mesh: Vec<&Contact> = contacts.iter().filter(|c| c.pair.kind != PairKind::VertexHalfSpace).collect();
        let mut near = 0;
        for pair in all_pairs(model, &filter) {
            let vertices = pair.vertices(model);
            let closest = pair.closest_points(&gather(vertices, x0));
            let thickness = pair.thickness(model).unwrap();
            if closest.distance_squared.sqrt() >= thickness {
                continue;
            }
            near += 1;
            let own = stencil(vertices, closest.weights);
            let cover = mesh.iter().find(|c| same(&own, &stencil(c.vertices, c.weights)));
            // Closest points on a border may slide off into a face that is nearer and has its own row.
            let nearer = mesh.iter().any(|c| {
                let known = |v: &(u32, f64)| c.vertices.contains(&v.0);
                own.iter().all(known) && c.start_gap < closest.distance_squared.sqrt()
            });
            let Some(cover) = cover else {
                assert!(own.len() < 4 && nearer, "seed {seed}: {pair:?} is near and has no contact");
                continue;
            };
            assert!((cover.start_gap - closest.distance_squared.sqrt()).abs() < 1e-12);
            assert!(cover.thickness >= thickness);
        }
        total += near;
        assert!(mesh.len() <= near, "repeats are dropped");
        for c in &contacts {
            assert!(c.start_gap < c.thickness && (norm(c.normal) - 1.0).abs() < 1e-12);
            assert!((c.gap(x0) - c.start_gap).abs() < 1e-12);
        }
        let below = model.contact_vertices.iter().filter(|v| {
            let h = if model.vertex_body[**v as usize] == 0 { 0.004 } else { 0.003 };
            x0[**v as usize][2] - 0.02 < h + HALF_THICKNESS
        });
        assert_eq!(contacts.len() - mesh.len(), below.count());
    }
    assert!(total > 30, "{total} near pairs");
}

/// Contacts of a triangle that stands on its tip over a sheet of 3 x 3 vertices, 0.2 apart.
fn contacts_of_a_tip_at(x: f64, y: f64) -> Vec<Contact> {
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(3, 0.4);
    plan.cloth(&cloth, cloth.positions.clone(), 0.1, &[], [0.0; 3]);
    let standing = crate::support::shapes::Triangles {
        positions: vec![[x, y, HALF_THICKNESS], [x + 0.05, y, 0.3], [x, y + 0.05, 0.3]],
        faces: vec![[0, 1, 2]],
    };
    plan.cloth(&standing, standing.positions.clone(), 0.1, &[], [0.0; 3]);
    let world = plan.build();
    let filter = BodyFilter::new(&world.model);
    let mut search = CandidateSearch::default();
    let x0 = &world.state.positions;
    let candidates = search.update(&world.model, &filter, x0, x0, 1.0, Par::Serial);
    let (start, passing) = (&world.state, Passing::default());
    let mut contacts = Vec::new();
    near_contacts(&world.model, &filter, &passing, candidates, start, start, 1.0, &mut contacts, Par::Serial);
    contacts
}

#[test]
fn a_tip_has_one_contact_wherever_it_stands() {
    // Inside a face, by an edge, over an edge, over a vertex, over a corner and a border of the sheet.
    let places = [(0.03, 0.07), (0.1, 1e-4), (0.1, 0.0), (0.0, 0.0), (-0.2, -0.2), (0.05, 0.2), (0.1, 0.1)];
    for (x, y) in places {
        let contacts = contacts_of_a_tip_at(x, y);
        assert_eq!(contacts.len(), 1, "at {x} {y}: {contacts:?}");
        assert!((contacts[0].start_gap - HALF_THICKNESS).abs() < 1e-15);
        assert!(norm(sub(contacts[0].normal.map(f64::abs), [0.0, 0.0, 1.0])) < 1e-12);
    }
}

#[test]
fn detection_keeps_half_of_the_smaller_of_thickness_and_start_distance() {
    let delta = 2.0 * HALF_THICKNESS;
    for (distance, kept) in [(3.0 * delta, 0.5 * delta), (delta, 0.5 * delta), (0.4 * delta, 0.2 * delta)] {
        let mut plan = Plan::rubbing(0.3);
        let cloth = sheet(3, 0.4);
        for z in [0.0, distance] {
            plan.cloth(&cloth, moved(&cloth, [0.3 * z, 0.2 * z, z], &mut Jitter(0), 0.0), 0.1, &[], [0.0; 3]);
        }
        plan.half_space([0.0, 0.0, 1.0], -distance);
        let world = plan.build();
        let filter = BodyFilter::new(&world.model);
        for (share, hit) in [(0.98, true), (1.02, false)] {
            // The upper sheet comes down on the lower, the lower on the half-space.
            for sheet in [0..9, 9..18] {
                let mut end = world.state.clone();
                end.positions[sheet].iter_mut().for_each(|x| x[2] -= distance - share * kept);
                let free = swept_free(&world.model, &filter, &world.state, &end, Par::Serial).is_empty();
                assert_eq!(free, !hit, "from {distance} to {share} of {kept}");
            }
        }
    }
}

#[test]
fn what_comes_too_close_at_a_sampled_time_is_hit_and_hits_are_close() {
    let mut total = 0;
    for seed in 1..5 {
        let (world, end) = scene(seed);
        let (model, x0, x1) = (&world.model, &world.state.positions, &end.positions);
        let filter = BodyFilter::new(model);
        let mut search = CandidateSearch::default();
        let candidates = search.update(model, &filter, x0, x1, 1.0, Par::Serial);
        let hits = swept_hits(model, &filter, &Passing::default(), candidates, &world.state, &end, Par::Serial);
        let mesh: Vec<_> = hits.iter().filter(|h| h.pair.kind != PairKind::VertexHalfSpace).collect();
        let distance = |pair: &Pair, t: f64| {
            let v = pair.vertices(model);
            let at: [Vec3; 4] = std::array::from_fn(|k| lerp(x0[v[k] as usize], x1[v[k] as usize], t));
            pair.closest_points(&at).distance_squared.sqrt()
        };
        for pair in all_pairs(model, &filter) {
            let separation = minimum_separation(pair.thickness(model).unwrap(), distance(&pair, 0.0));
            let first = (0..=60).map(|i| f64::from(i) / 60.0).find(|t| distance(&pair, *t) < separation);
            let hit = mesh.iter().find(|h| h.pair == pair);
            if let Some(t) = first {
                let hit = hit.unwrap_or_else(|| panic!("seed {seed}: {pair:?} is missed at {t}"));
                assert!(hit.time <= t);
            }
            if let Some(hit) = hit {
                total += 1;
                // Conservative, and no further from the separation than the detector's stated tolerance.
                assert!(distance(&pair, hit.time) <= separation * (1.0 + 2e-3) + 1e-12);
                assert!(hit.contact.start_gap >= 0.0);
            }
        }
        let by_plane = |v: &&u32| {
            let h = if model.vertex_body[**v as usize] == 0 { 0.004 } else { 0.003 };
            let gap = |x: &[Vec3]| sub(x[**v as usize], [0.0, 0.0, 0.02])[2];
            gap(x1) < minimum_separation(h + HALF_THICKNESS, gap(x0))
        };
        assert_eq!(hits.len() - mesh.len(), model.contact_vertices.iter().filter(by_plane).count());
    }
    assert!(total > 100);
}

/// What moved is tested again, the rest is remembered: the same hits as a test of everything.
#[test]
fn hits_are_renewed_as_if_all_were_tested() {
    let (mut renewed_any, mut kept_any, mut gone_any) = (0, 0, 0);
    for seed in 1..6 {
        let (world, end) = scene(seed);
        let (model, filter) = (&world.model, BodyFilter::new(&world.model));
        let mut jitter = Jitter(seed + 77);
        let mut search = CandidateSearch::default();
        let test = |end: &State, search: &mut CandidateSearch| {
            let x = (&world.state.positions, &end.positions);
            let candidates = search.update(model, &filter, x.0, x.1, 2.0, Par::Serial);
            swept_hits(model, &filter, &Passing::default(), candidates, &world.state, end, Par::Serial)
        };
        let mut before = (end.clone(), test(&end, &mut search));
        for _ in 0..5 {
            let mut next = before.0.clone();
            for x in next.positions.iter_mut() {
                if jitter.next() > 0.7 {
                    *x = add(*x, jitter.vector(0.02));
                }
            }
            let all = test(&next, &mut search);
            let moved: Vec<bool> = next.positions.iter().zip(&before.0.positions).map(|(a, b)| a != b).collect();
            let candidates = search.update(model, &filter, &world.state.positions, &next.positions, 2.0, Par::Serial);
            let (passing, ends) = (Passing::default(), (&world.state, &next));
            let renewed = renewed_hits(model, &filter, &passing, candidates, ends, &before.1, &moved, Par::Serial);
            assert_eq!(renewed, all, "seed {seed}");
            kept_any += all.iter().filter(|hit| before.1.contains(hit)).count();
            renewed_any += all.iter().filter(|hit| !before.1.contains(hit)).count();
            gone_any += before.1.iter().filter(|hit| !all.contains(hit)).count();
            before = (next, all);
        }
    }
    assert!(renewed_any > 0 && kept_any > 0 && gone_any > 0, "{renewed_any} {kept_any} {gone_any}");
}

/// Candidates that are kept and widened from motion to motion find what a search from nothing finds.
#[test]
fn widened_candidates_miss_nothing() {
    let mut hits_any = 0;
    for seed in 1..5 {
        let (world, end) = scene(seed);
        let (model, filter) = (&world.model, BodyFilter::new(&world.model));
        let mut jitter = Jitter(seed + 5);
        let mut search = CandidateSearch::default();
        let mut next = end.clone();
        for round in 0..12 {
            for x in next.positions.iter_mut() {
                if jitter.next() > 0.96 {
                    *x = add(*x, jitter.vector(0.05));
                }
            }
            let found = |search: &mut CandidateSearch| {
                let x = (&world.state.positions, &next.positions);
                let passing = Passing::default();
                let mut found = search.update(model, &filter, x.0, x.1, 2.0, Par::Serial);
                let (start, mut near) = (&world.state, Vec::new());
                near_contacts(model, &filter, &passing, found.again(), start, &next, 2.0, &mut near, Par::Serial);
                (swept_hits(model, &filter, &passing, found, start, &next, Par::Serial), near)
            };
            let (kept, fresh) = (found(&mut search), found(&mut CandidateSearch::default()));
            assert!(kept == fresh, "seed {seed} round {round}: {} {}", kept.0.len(), fresh.0.len());
            hits_any += fresh.0.len();
        }
    }
    assert!(hits_any > 100, "{hits_any}");
}

/// What is found while vertices go a little, so that short lists of candidates are kept, is what a search from nothing
/// finds; and so when they go farther.
#[test]
fn short_lists_of_candidates_miss_nothing() {
    let (mut near_any, mut hits_any) = (0, 0);
    for seed in 1..5 {
        let (world, _) = scene(seed);
        let (model, filter) = (&world.model, BodyFilter::new(&world.model));
        let mut jitter = Jitter(seed + 31);
        let mut search = CandidateSearch::default();
        let mut start = world.state.clone();
        for round in 0..80 {
            let mut end = start.clone();
            // Half thicknesses are 0.004 and 0.003: a few steps or many until a list is used up.
            let (way, swept) = ([1e-5, 4e-4, 1.5e-3, 0.01][round / 5 % 4], [1e-5, 4e-4, 3e-3, 8e-3][round % 4]);
            end.positions.iter_mut().for_each(|x| *x = add(*x, jitter.vector(swept)));
            let found = |search: &mut CandidateSearch| {
                let passing = Passing::default();
                let mut found = search.update(model, &filter, &start.positions, &end.positions, 2.0, Par::Serial);
                let mut near = Vec::new();
                near_contacts(model, &filter, &passing, found.again(), &start, &end, 2.0, &mut near, Par::Serial);
                (swept_hits(model, &filter, &passing, found, &start, &end, Par::Serial), near)
            };
            let (kept, fresh) = (found(&mut search), found(&mut CandidateSearch::default()));
            assert!(kept == fresh, "seed {seed} round {round}: {} {}", kept.0.len(), fresh.0.len());
            hits_any += fresh.0.len();
            near_any += fresh.1.len();
            start.positions.iter_mut().for_each(|x| *x = add(*x, jitter.vector(way)));
        }
    }
    assert!(hits_any > 100 && near_any > 10_000, "{hits_any} {near_any}");
}
