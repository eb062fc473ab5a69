//! What screening rules out is apart by exact predicates of another kind: closest points, at the start and along the way.

use crate::random::Random;
use crate::scenes::scenes;
use signorini::detection::screening::{self, Buffers, Lists};
use signorini::detection::{Candidates, Motion, brute_force};
use signorini::geometry::{edge_edge, point_triangle};
use signorini::math::{Vec3, lerp};
use signorini::parallel::{Par, Pool};

/// The four points of candidate `i` of both lists, vertex-face pairs first.
fn vertices(scene: &crate::scenes::Scene, candidates: &Candidates, i: usize) -> ([usize; 4], bool) {
    let v = match candidates.vertex_face.get(i) {
        Some([v, f]) => {
            let [a, b, c] = scene.faces[*f as usize];
            [*v, a, b, c]
        }
        None => {
            let [e, f] = candidates.edge_edge[i - candidates.vertex_face.len()].map(|e| scene.edges[e as usize]);
            [e[0], e[1], f[0], f[1]]
        }
    };
    (v.map(|v| v as usize), i < candidates.vertex_face.len())
}

fn distance(x: [Vec3; 4], vertex_face: bool) -> f64 {
    let square = if vertex_face {
        point_triangle::distance_squared(x[0], x[1], x[2], x[3])
    } else {
        edge_edge::distance_squared(x[0], x[1], x[2], x[3])
    };
    square.sqrt()
}

#[test]
fn no_near_or_approaching_pair_is_ruled_out_and_most_others_are() {
    let pool = Pool::new(2).unwrap();
    let (mut r, mut buffers) = (Random::new(71), Buffers::default());
    let (mut far, mut far_open, mut near_total, mut approaching_total) = (0, 0, 0, 0);
    for scene in scenes() {
        let p = scene.primitives();
        let extent = scene.x0.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
        for share in [0.0, 1e-3, 0.05] {
            // By body, as thickness is.
            let by_body: Vec<f64> = (0..1000).map(|_| share * extent * r.unit()).collect();
            let reach: Vec<f64> = scene.body.iter().map(|b| by_body[*b as usize]).collect();
            let motion = Motion { x0: &scene.x0, x1: &scene.x1, radius: &reach };
            let mut candidates = brute_force::candidates(&p, &motion, &|_, _| true);
            candidates.vertex_face.truncate(4000);
            candidates.edge_edge.truncate(4000);
            let (x0, x1) = (&scene.x0, &scene.x1);
            let lists = Lists { primitives: &p, candidates: &candidates };
            // The buffers of the scene before, and none.
            let [near, again] = [(Par::Serial, &mut buffers), (Par::Pool(&pool), &mut Buffers::default())]
                .map(|(par, buffers)| screening::near(x0, lists, None, &reach, buffers, par).to_vec());
            assert_eq!(near, again);
            let [approaching, again] = [(Par::Serial, &mut buffers), (Par::Pool(&pool), &mut Buffers::default())]
                .map(|(par, buffers)| screening::approaching(x0, x1, lists, None, &reach, buffers, par).to_vec());
            assert_eq!(approaching, again);
            assert!(near.is_sorted() && approaching.is_sorted());
            for i in 0..candidates.vertex_face.len() + candidates.edge_edge.len() {
                let (v, vertex_face) = vertices(&scene, &candidates, i);
                let thickness = reach[v[0]] + reach[v[if vertex_face { 1 } else { 2 }]];
                let at = |t: f64| distance(v.map(|v| lerp(x0[v], x1[v], t)), vertex_face);
                let (start, open) = (at(0.0), near.binary_search(&(i as u32)).is_ok());
                let name = &scene.name;
                assert!(open || start >= thickness, "{name}: {i} is {start:e} near and ruled out");
                near_total += usize::from(start < thickness);
                // Sizes whose squares leave the range of doubles are left open.
                if (1e-50..1e50).contains(&extent) && start > 1.001 * thickness + 1e-9 * extent {
                    far += 1;
                    far_open += usize::from(open);
                }
                let separation = 0.5 * thickness.min(start);
                if (0..=16).any(|k| at(f64::from(k) / 16.0) < separation) {
                    approaching_total += 1;
                    let open = approaching.binary_search(&(i as u32)).is_ok();
                    assert!(open, "{name}: {i} comes closer than {separation:e} and is ruled out");
                }
            }
        }
    }
    assert!(near_total > 1000 && approaching_total > 500, "{near_total} {approaching_total}");
    assert!(far > 20_000 && far_open < far / 10, "{far_open} of {far}");
}

#[test]
fn what_is_not_finite_stays_open() {
    let faces = [[0, 1, 2], [3, 4, 5]];
    let edges = [[0, 1], [3, 4]];
    let p = signorini::detection::Primitives { vertices: &[0, 1, 2, 3, 4, 5], edges: &edges, faces: &faces };
    let x: Vec<Vec3> =
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 9.0], [1.0, 0.0, 9.0], [0.0, 1.0, 9.0]];
    let candidates = Candidates { vertex_face: vec![[0, 1]], edge_edge: vec![[0, 1]], ..Candidates::default() };
    let lists = Lists { primitives: &p, candidates: &candidates };
    let reach = [0.1; 6];
    let mut buffers = Buffers::default();
    let mut both =
        |x1: &[Vec3]| screening::approaching(&x, x1, lists, None, &reach, &mut buffers, Par::Serial).to_vec();
    assert!(both(&x).is_empty());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for vertex in [0, 3, 4] {
            for k in 0..3 {
                let mut end = x.clone();
                end[vertex][k] = bad;
                let expected = [0, 1];
                assert_eq!(both(&end), expected, "{vertex} {k} {bad}");
                let near = screening::near(&end, lists, None, &reach, &mut Buffers::default(), Par::Serial).to_vec();
                assert_eq!(near, expected);
            }
        }
    }
}
