//! Near pairs against brute force in the definition of distance.

use crate::random::Random;
use crate::scenes::{Scene, scenes};
use signorini::detection::proximity::{NearPair, PairKind, distinct, search, search_brute_force};
use signorini::detection::{BroadPhase, Primitives};
use signorini::math::{Vec3, add_scaled, dot, norm, sub};
use signorini::parallel::{Par, Pool};

fn thickened(mut scene: Scene) -> Scene {
    let extent = scene.x0.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut r = Random::new(31);
    scene.radius.iter_mut().for_each(|radius| *radius = 0.04 * extent * r.unit());
    scene
}

/// Weights add up to zero, name points of the primitives, and `normal · sum w x = distance`.
fn is_a_contact(pair: &NearPair, x: &[Vec3]) {
    let extent = pair.vertices.iter().flat_map(|v| x[*v as usize]).fold(0.0_f64, |m, c| m.max(c.abs()));
    let [w0, w1, w2, w3] = pair.weights;
    let sums = match pair.kind {
        PairKind::VertexFace => [w0, -(w1 + w2 + w3)],
        PairKind::EdgeEdge => [w0 + w1, -(w2 + w3)],
    };
    assert!(sums.iter().all(|s| (s - 1.0).abs() < 1e-15), "{pair:?}");
    let separation = (0..4).fold([0.0; 3], |s, k| add_scaled(s, pair.weights[k], x[pair.vertices[k] as usize]));
    assert!((norm(pair.normal) - 1.0).abs() < 1e-14, "{pair:?}");
    assert!(pair.distance >= 0.0);
    assert!((dot(pair.normal, separation) - pair.distance).abs() <= 1e-14 * extent, "{pair:?}");
    // The normal points along the separation where that is not all rounding.
    if pair.distance > 1e-6 * extent {
        assert!((norm(separation) - pair.distance).abs() <= 1e-9 * extent, "{pair:?}");
    }
}

#[test]
fn same_pairs_as_brute_force() {
    let pool = Pool::new(3).unwrap();
    let mut total = 0;
    // Sizes at which the squares of all distances are numbers.
    for scene in scenes().into_iter().filter(|s| !s.name.contains("300")).map(thickened) {
        let p = scene.primitives();
        let mut tree = BroadPhase::build(&p);
        for filter in [&|_: u32, _: u32| true, &|a: u32, b: u32| scene.body[a as usize] != scene.body[b as usize]]
            as [&(dyn Fn(u32, u32) -> bool + Sync); 2]
        {
            let expected = search_brute_force(&p, &scene.x0, &scene.radius, filter);
            let found = search(&mut tree, &p, &scene.x0, &scene.radius, filter, Par::Serial);
            assert!(found == expected, "{}: {} and {}", scene.name, found.len(), expected.len());
            let pooled = search(&mut tree, &p, &scene.x0, &scene.radius, filter, Par::Pool(&pool));
            assert!(pooled == expected, "{}", scene.name);
            expected.iter().for_each(|pair| is_a_contact(pair, &scene.x0));
            total += expected.len();
        }
    }
    assert!(total > 2000, "{total}");
}

/// The closest points of a sampled pair are never closer than the reported distance: sampling is an upper bound.
#[test]
fn no_sampled_points_are_closer() {
    let mut r = Random::new(32);
    let scene = thickened(scenes().into_iter().find(|s| s.name == "soup").unwrap());
    let p = scene.primitives();
    let pairs = search_brute_force(&p, &scene.x0, &scene.radius, &|_, _| true);
    assert!(pairs.len() > 100);
    for pair in &pairs {
        let x = pair.vertices.map(|v| scene.x0[v as usize]);
        for _ in 0..200 {
            let (s, t) = (r.unit(), r.unit());
            let (a, b) = match pair.kind {
                PairKind::VertexFace => {
                    let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
                    (x[0], add_scaled(add_scaled(x[1], s, sub(x[2], x[1])), t, sub(x[3], x[1])))
                }
                PairKind::EdgeEdge => (add_scaled(x[0], s, sub(x[1], x[0])), add_scaled(x[2], t, sub(x[3], x[2]))),
            };
            assert!(norm(sub(a, b)) >= pair.distance * (1.0 - 1e-12), "{pair:?}");
        }
    }
}

/// A small box over a large one, corner over face, edge over edge: dropping repeats drops no row.
#[test]
fn distinct_pairs_keep_every_row() {
    let mut r = Random::new(33);
    for scene in scenes().into_iter().filter(|s| ["sheets", "thick sheets", "mixed"].contains(&s.name.as_str())) {
        let mut scene = thickened(scene);
        // Off the lattice, so that closest points are unique.
        scene.x0.iter_mut().for_each(|x| *x = add_scaled(*x, 0.01, r.vector()));
        let all = search_brute_force(&scene.primitives(), &scene.x0, &scene.radius, &|_, _| true);
        let kept = distinct(all.clone());
        assert!(kept.len() < all.len() && !kept.is_empty(), "{}: {} of {}", scene.name, kept.len(), all.len());
        assert!(kept.iter().all(|pair| all.contains(pair)));
        let row = |pair: &NearPair| {
            let mut row: Vec<(u32, f64)> = pair.vertices.into_iter().zip(pair.weights).filter(|w| w.1 != 0.0).collect();
            row.sort_by_key(|a| a.0);
            row
        };
        // Up to its sign, each dropped row is one of the kept ones.
        for pair in &all {
            let r = row(pair);
            let same = kept.iter().any(|k| {
                let other = row(k);
                let sign = dot(k.normal, pair.normal).signum();
                other.len() == r.len()
                    && other.iter().zip(&r).all(|(a, b)| a.0 == b.0 && (a.1 - sign * b.1).abs() < 1e-9)
                    && (k.distance - pair.distance).abs() < 1e-9
            });
            assert!(same, "{}: {pair:?}", scene.name);
        }
    }
}

#[test]
fn neighbours_and_filtered_pairs_are_never_near() {
    let x = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let edges = [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]];
    let p = Primitives { vertices: &[0, 1, 2, 3], edges: &edges, faces: &[[0, 1, 2], [1, 3, 2]] };
    // Only pairs without a common vertex: 0 and the second face, 3 and the first, 0-1 with 2-3, 0-2 with 1-3.
    assert_eq!(search_brute_force(&p, &x, &[9.0; 4], &|_, _| true).len(), 4);
    assert_eq!(search_brute_force(&p, &x, &[9.0; 4], &|_, _| false).len(), 0);
}
