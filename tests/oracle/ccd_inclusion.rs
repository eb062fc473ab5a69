//! Continuous detection against inclusion by subdivision of (t, u, v), which shares nothing with the method under test.
//!
//! The offset between a point of one primitive and a point of the other is linear in each of time and the two
//! parameters, so over a box of them each coordinate stays between its values at the eight corners. On small integer
//! coordinates and dyadic parameters f64 holds those values exactly.

use crate::ccd_distance;
use crate::ccd_separation::Random;
use proptest::prelude::*;
use signorini::detection::ccd;

type Point = [f64; 3];
type Points = [Point; 4];

fn vertex_face(x: &Points, u: f64, v: f64) -> Point {
    std::array::from_fn(|c| x[0][c] - x[1][c] - u * (x[2][c] - x[1][c]) - v * (x[3][c] - x[1][c]))
}

fn edge_edge(x: &Points, u: f64, v: f64) -> Point {
    std::array::from_fn(|c| x[0][c] + u * (x[1][c] - x[0][c]) - x[2][c] - v * (x[3][c] - x[2][c]))
}

enum Answer {
    /// Proven: no contact.
    Apart,
    /// Boxes of the smallest size are left; none before this time.
    Perhaps(f64),
    /// Too many boxes.
    Unknown,
}

/// Depth-first with earlier times first; boxes that begin after the earliest smallest one left are dropped.
fn inclusion(edges: bool, x0: &Points, x1: &Points, depth: u32) -> Answer {
    let offset = if edges { edge_edge } else { vertex_face };
    // Corner values at time t are means of those at both ends.
    let mut stack = vec![([0.0, 0.0, 0.0], 0_u32)];
    let (mut work, mut first) = (0, f64::INFINITY);
    while let Some((low, level)) = stack.pop() {
        if low[0] >= first {
            continue;
        }
        work += 1;
        if work > 400_000 {
            return Answer::Unknown;
        }
        let width = 0.5_f64.powi(level as i32);
        let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in 0..8 {
            let [t, u, v]: Point = std::array::from_fn(|k| low[k] + width * f64::from(corner >> k & 1));
            let (a, b) = (offset(x0, u, v), offset(x1, u, v));
            for c in 0..3 {
                let value = (1.0 - t) * a[c] + t * b[c];
                least[c] = least[c].min(value);
                most[c] = most[c].max(value);
            }
        }
        let outside = !edges && low[1] + low[2] > 1.0;
        if outside || (0..3).any(|c| least[c] > 0.0 || most[c] < 0.0) {
            continue;
        }
        if level == depth {
            first = low[0];
            continue;
        }
        let half = 0.5 * width;
        // Later half first onto the stack.
        for child in (0..8).rev() {
            // The time bit is the highest, so that all earlier children come off first.
            let child_low = [
                low[0] + half * f64::from(child >> 2 & 1),
                low[1] + half * f64::from(child & 1),
                low[2] + half * f64::from(child >> 1 & 1),
            ];
            stack.push((child_low, level + 1));
        }
    }
    if first.is_finite() { Answer::Perhaps(first) } else { Answer::Apart }
}

fn detect(edges: bool, x0: &Points, x1: &Points) -> Option<f64> {
    if edges { ccd::edge_edge::time_of_impact(x0, x1, 1.0) } else { ccd::point_triangle::time_of_impact(x0, x1, 1.0) }
}

const DEPTH: u32 = 14;

/// Compares; whether the oracle had a say.
fn compare(edges: bool, x0: &Points, x1: &Points) -> bool {
    let found = detect(edges, x0, x1);
    match (inclusion(edges, x0, x1, DEPTH), found) {
        (Answer::Apart, found) => {
            assert!(found.is_none(), "false alarm at {found:?}: edges {edges} {x0:?} {x1:?}");
            true
        }
        (Answer::Perhaps(first), Some(t)) => {
            assert!(t + 1e-6 >= first, "{t} before {first}: edges {edges} {x0:?} {x1:?}");
            // At the reported time the two are as near as 1e-6 of the step allows.
            let distance = if edges { ccd_distance::edge_edge } else { ccd_distance::point_triangle };
            let left = distance(&ccd_distance::at(x0, x1, t));
            assert!(left < 1e-4, "apart by {left} at {t}: edges {edges} {x0:?} {x1:?}");
            true
        }
        // A box of the smallest size proves nothing: contact is only excluded, never shown, by inclusion. A real
        // contact keeps its boxes at every depth, a near miss loses them.
        (Answer::Perhaps(_), None) => {
            assert!(!matches!(inclusion(edges, x0, x1, 22), Answer::Perhaps(_)), "missed: edges {edges} {x0:?} {x1:?}");
            false
        }
        (Answer::Unknown, _) => false,
    }
}

fn lattice(random: &mut Random, range: f64) -> Points {
    std::array::from_fn(|_| std::array::from_fn(|_| random.uniform(-range, range).round()))
}

#[test]
fn lattice_queries_agree_with_inclusion() {
    let mut random = Random(77);
    let (mut decided, mut total) = (0, 0);
    for round in 0..3000 {
        let range = [1.0, 2.0, 4.0, 8.0][round % 4];
        let (mut x0, mut x1) = (lattice(&mut random, range), lattice(&mut random, range));
        if round % 5 == 0 {
            // In one plane for the whole step.
            for p in x0.iter_mut().chain(&mut x1) {
                p[2] = p[0] + p[1];
            }
        }
        for edges in [false, true] {
            decided += usize::from(compare(edges, &x0, &x1));
            total += 1;
        }
    }
    assert!(decided > total * 9 / 10, "{decided} of {total} decided");
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![3 => (-3..=3_i32).prop_map(f64::from), 1 => -3.0..3.0_f64]
}

fn points() -> impl Strategy<Value = Points> {
    proptest::array::uniform4(proptest::array::uniform3(coordinate()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// An exact answer does not depend on the order of vertices, of axes, of primitives, on the direction of time, on
    /// the scale, or on where the origin is (small integers and thirds of a unit stay exact when moved by 2^20).
    #[test]
    fn answers_do_not_depend_on_how_the_query_is_written(x0 in points(), x1 in points(), far in any::<bool>()) {
        let grid = |x: &Points| x.map(|p| p.map(|c| (c * 1024.0).round() / 1024.0));
        let (x0, x1) = (grid(&x0), grid(&x1));
        for edges in [false, true] {
            let found = detect(edges, &x0, &x1);
            let order = if edges { [3, 2, 1, 0] } else { [0, 2, 3, 1] };
            let rewrite = |x: &Points| -> Points {
                let y: Points = std::array::from_fn(|i| [x[order[i]][2], -x[order[i]][0], x[order[i]][1]]);
                y.map(|p| p.map(|c| 0.25 * c + if far { 1_048_576.0 } else { 0.0 }))
            };
            let other = detect(edges, &rewrite(&x0), &rewrite(&x1));
            prop_assert_eq!(found.is_some(), other.is_some(), "{:?} and {:?}", found, other);
            if let (Some(a), Some(b)) = (found, other) {
                prop_assert!((a - b).abs() <= 1e-6);
            }
            let back = detect(edges, &x1, &x0);
            prop_assert_eq!(found.is_some(), back.is_some(), "reversed: {:?} and {:?}", found, back);
            if let (Some(a), Some(b)) = (found, back) {
                // First contact forwards is not after first contact backwards.
                prop_assert!(a <= 1.0 - b + 1e-12);
            }
        }
    }
}
