//! Candidate sets of the tree against brute force.

use crate::random::Random;
use crate::scenes::{Scene, grid, scenes};
use signorini::detection::{BroadPhase, Candidates, Filter, Motion, brute_force};
use signorini::parallel::{Par, Pool};

fn compare(scene: &Scene, tree: &mut BroadPhase, filter: &Filter, par: Par) -> usize {
    let p = scene.primitives();
    let motion = Motion { x0: &scene.x0, x1: &scene.x1, radius: &scene.radius };
    let expected = brute_force::candidates(&p, &motion, filter);
    let mut found = Candidates::default();
    tree.refit(&scene.x0, &scene.x1, &scene.radius, par);
    tree.candidates(filter, &mut found, par);
    assert!(
        found == expected,
        "{}: {} {} instead of {} {}",
        scene.name,
        found.vertex_face.len(),
        found.edge_edge.len(),
        expected.vertex_face.len(),
        expected.edge_edge.len()
    );
    compare_edges_with_faces(scene, tree, filter, par);
    found.vertex_face.len() + found.edge_edge.len()
}

/// All edge-face pairs with overlapping boxes are found; what else is found shares no vertex, passes the filter, and is found
/// once.
fn compare_edges_with_faces(scene: &Scene, tree: &mut BroadPhase, filter: &Filter, par: Par) {
    let p = scene.primitives();
    for x in [&scene.x0, &scene.x1] {
        let motion = Motion { x0: x, x1: x, radius: &[] };
        let expected = brute_force::edge_face_candidates(&p, &motion, filter).edge_face;
        let found = tree.edge_face_candidates(x, &[], filter, [&|pairs| pairs.len(); 2], par);
        assert!(expected.iter().all(|pair| found.binary_search(pair).is_ok()), "{}", scene.name);
        for [edge, face] in &found {
            let (edge, face) = (p.edges[*edge as usize], p.faces[*face as usize]);
            assert!(filter(edge[0], face[0]) && !edge.iter().any(|v| face.contains(v)), "{}", scene.name);
        }
        assert!(found.windows(2).all(|two| two[0] < two[1]), "{}", scene.name);
    }
}

#[test]
fn same_candidates_as_brute_force() {
    let pool = Pool::new(3).unwrap();
    let mut total = 0;
    for scene in scenes() {
        let mut tree = BroadPhase::build(&scene.primitives());
        let all = compare(&scene, &mut tree, &|_, _| true, Par::Serial);
        assert_eq!(all, compare(&scene, &mut tree, &|_, _| true, Par::Pool(&pool)), "{}", scene.name);
        let between = |a: u32, b: u32| scene.body[a as usize] != scene.body[b as usize];
        let some = compare(&scene, &mut tree, &between, Par::Serial);
        assert!(some <= all);
        assert_eq!(0, compare(&scene, &mut tree, &|_, _| false, Par::Serial));
        tree.rebuild(&scene.x0, &scene.x1, &scene.radius, Par::Serial);
        assert_eq!(all, compare(&scene, &mut tree, &|_, _| true, Par::Serial), "{}", scene.name);
        total += all;
    }
    assert!(total > 10_000, "the scenes have only {total} candidates");
}

#[test]
fn same_candidates_after_refits_and_rebuilds() {
    let mut r = Random::new(7);
    let mut scene = grid("moving", 17, 2);
    let mut tree = BroadPhase::build(&scene.primitives());
    for step in 0..12 {
        compare(&scene, &mut tree, &|_, _| true, Par::Serial);
        // Ever larger jumps: the tree of the first state ends up useless and is rebuilt.
        let size = 0.02 * 2_f64.powi(step);
        for (x0, x1) in scene.x0.iter_mut().zip(&mut scene.x1) {
            *x0 = *x1;
            *x1 = signorini::math::add_scaled(*x1, if step % 3 == 0 { size } else { 0.01 }, r.vector());
        }
    }
}

#[test]
fn same_candidates_with_the_boxes_of_any_thread_count() {
    let scene = grid("large", 60, 2);
    let filter: &Filter = &|_, _| true;
    let mut expected = Candidates::default();
    let mut tree = BroadPhase::build(&scene.primitives());
    tree.refit(&scene.x0, &scene.x1, &scene.radius, Par::Serial);
    tree.candidates(filter, &mut expected, Par::Serial);
    assert!(expected.edge_edge.is_sorted() && expected.vertex_face.is_sorted());
    for threads in [1, 2, 5] {
        let pool = Pool::new(threads).unwrap();
        let mut found = Candidates::default();
        let mut tree = BroadPhase::build(&scene.primitives());
        tree.refit(&scene.x0, &scene.x1, &scene.radius, Par::Pool(&pool));
        tree.candidates(filter, &mut found, Par::Pool(&pool));
        assert!(found == expected);
    }
}

/// Some vertices go farther: what they meet is added, and nothing is listed twice.
#[test]
fn what_woken_vertices_meet_is_added() {
    let mut r = Random::new(31);
    let pool = Pool::new(3).unwrap();
    let mut added = 0;
    for name in ["few", "more", "most"] {
        let scene = grid(name, 23, 2);
        let p = scene.primitives();
        let mut tree = BroadPhase::build(&p);
        tree.refit(&scene.x0, &scene.x1, &scene.radius, Par::Serial);
        let between = |a: u32, b: u32| scene.body[a as usize] != scene.body[b as usize];
        let filters: [&Filter; 2] = [&|_, _| true, &between];
        let mut kept = [Candidates::default(), Candidates::default()];
        for (filter, out) in filters.iter().zip(&mut kept) {
            tree.candidates(filter, out, Par::Serial);
        }
        let share = match name {
            "few" => 0.01,
            "more" => 0.1,
            _ => 0.9,
        };
        let woken: Vec<bool> = scene.x0.iter().map(|_| r.chance(share)).collect();
        let mut x1 = scene.x1.clone();
        for v in (0..x1.len()).filter(|v| woken[*v]) {
            // Sideways too, where it went straight down: the new box holds the old one.
            let [a, b, _] = r.vector();
            x1[v] = signorini::math::add_scaled(x1[v], 0.3, [a, b, 0.0]);
        }
        let motion = Motion { x0: &scene.x0, x1: &x1, radius: &scene.radius };
        let boxes: Vec<_> = (0..x1.len() as u32).map(|v| motion.vertex_box(v)).collect();
        let mut partly = tree.clone();
        partly.refit_woken(&woken, &boxes);
        tree.refit_to(&boxes, Par::Serial);
        for (filter, out) in filters.iter().zip(&mut kept) {
            let before = out.clone();
            let (mut serial, mut pooled, mut by_part) = (out.clone(), out.clone(), out.clone());
            tree.add_candidates(&woken, filter, &mut serial, Par::Serial);
            partly.add_candidates(&woken, filter, &mut by_part, Par::Serial);
            tree.add_candidates(&woken, filter, &mut pooled, Par::Pool(&pool));
            let expected = brute_force::candidates(&p, &motion, filter);
            assert!(serial == expected && pooled == expected && by_part == expected, "{name}");
            added += serial.edge_edge.len() - before.edge_edge.len();
        }
    }
    assert!(added > 100, "{added}");
}
