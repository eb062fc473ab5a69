//! The drivers over candidate lists against the kernels called one by one.

use crate::ccd_separation::Random;
use signorini::detection::{BroadPhase, Candidates, Primitives, ccd};
use signorini::parallel::{Par, Pool};

type Point = [f64; 3];

/// Start, end, faces, edges.
type Soup = (Vec<Point>, Vec<Point>, Vec<[u32; 3]>, Vec<[u32; 2]>);

/// Loose triangles in a box, each moving on its own.
fn soup(count: usize) -> Soup {
    let mut random = Random(20_091_122);
    let mut point = |size: f64| -> Point { std::array::from_fn(|_| random.uniform(-size, size)) };
    let (mut x0, mut x1) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let (centre, shift) = (point(1.0), point(0.3));
        for _ in 0..3 {
            let (a, b) = (point(0.1), point(0.05));
            let p: Point = std::array::from_fn(|c| centre[c] + a[c]);
            x0.push(p);
            x1.push(std::array::from_fn(|c| p[c] + shift[c] + b[c]));
        }
    }
    let faces: Vec<[u32; 3]> = (0..count as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let edges = faces.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*a, *c]]).collect();
    (x0, x1, faces, edges)
}

#[test]
fn drivers_agree_with_kernels_on_any_number_of_threads() {
    let (x0, x1, faces, edges) = soup(700);
    let vertices: Vec<u32> = (0..x0.len() as u32).collect();
    let primitives = Primitives { vertices: &vertices, edges: &edges, faces: &faces };
    let mut tree = BroadPhase::build(&primitives);
    tree.refit(&x0, &x1, &vec![0.01; x0.len()], Par::Serial);
    let mut all = Candidates::default();
    tree.candidates(&|_, _| true, &mut all, Par::Serial);
    assert!(all.vertex_face.len() > 5000 && all.edge_edge.len() > 20_000);
    let per_pair = |n: usize| -> Vec<f64> { (0..n).map(|i| [0.0, 1e-3, 1e-2][i % 3]).collect() };
    let (s_vf, s_ee) = (per_pair(all.vertex_face.len()), per_pair(all.edge_edge.len()));
    let separations = [
        ccd::Separation::Uniform(0.0),
        ccd::Separation::Uniform(5e-3),
        ccd::Separation::PerPair { vertex_face: &s_vf, edge_edge: &s_ee },
    ];
    for separation in separations {
        let (of_vf, of_ee): (Vec<f64>, Vec<f64>) = match separation {
            ccd::Separation::Uniform(s) => (vec![s; s_vf.len()], vec![s; s_ee.len()]),
            ccd::Separation::PerPair { .. } => (s_vf.clone(), s_ee.clone()),
        };
        let corners = |v: [u32; 4]| (v.map(|v| x0[v as usize]), v.map(|v| x1[v as usize]));
        let mut expected = Vec::new();
        for (pair, s) in all.vertex_face.iter().zip(&of_vf) {
            let [a, b, c] = faces[pair[1] as usize];
            let (y0, y1) = corners([pair[0], a, b, c]);
            let time = if *s > 0.0 {
                ccd::point_triangle::time_of_impact_with_separation(&y0, &y1, *s, 1.0)
            } else {
                ccd::point_triangle::time_of_impact(&y0, &y1, 1.0)
            };
            expected.extend(time.map(|time| ccd::Hit { pair: ccd::Pair::VertexFace(*pair), time }));
        }
        for (pair, s) in all.edge_edge.iter().zip(&of_ee) {
            let ([a, b], [c, d]) = (edges[pair[0] as usize], edges[pair[1] as usize]);
            let (y0, y1) = corners([a, b, c, d]);
            let time = if *s > 0.0 {
                ccd::edge_edge::time_of_impact_with_separation(&y0, &y1, *s, 1.0)
            } else {
                ccd::edge_edge::time_of_impact(&y0, &y1, 1.0)
            };
            expected.extend(time.map(|time| ccd::Hit { pair: ccd::Pair::EdgeEdge(*pair), time }));
        }
        assert!(expected.len() > 100);
        let run = |par: Par| ccd::hits(&x0, &x1, &primitives, &all, separation, par);
        let earliest = |par: Par| ccd::earliest_time_of_impact(&x0, &x1, &primitives, &all, separation, par);
        assert_eq!(run(Par::Serial), expected);
        let first = earliest(Par::Serial).expect("there are hits");
        let least = expected.iter().fold(1.0, |t: f64, hit| t.min(hit.time));
        assert!((first.time - least).abs() <= 1e-6, "{first:?} against {least}");
        for threads in [2, 3] {
            let pool = Pool::new(threads).expect("threads start");
            assert_eq!(run(Par::Pool(&pool)), expected);
            assert_eq!(earliest(Par::Pool(&pool)), Some(first));
        }
    }
}

#[test]
fn coordinates_that_are_not_finite_are_hits() {
    let (mut x0, x1, faces, edges) = soup(2);
    x0[0][1] = f64::NAN;
    let vertices: Vec<u32> = (0..6).collect();
    let primitives = Primitives { vertices: &vertices, edges: &edges, faces: &faces };
    let all = Candidates { vertex_face: vec![[0, 1], [3, 0]], edge_edge: vec![[0, 3]], edge_face: vec![] };
    for s in [0.0, 0.1] {
        let found = ccd::hits(&x0, &x1, &primitives, &all, ccd::Separation::Uniform(s), Par::Serial);
        assert_eq!(found.len(), 3);
        assert!(found.iter().all(|hit| hit.time == 0.0));
    }
}
