//! Minimum separation against distances sampled densely in time: no miss, and alarms only near the separation.

use crate::ccd_distance::{Point, at, edge_edge, point_triangle};
use signorini::detection::ccd;

/// A small generator of its own, so that failures can be repeated.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    pub fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn points(&mut self, size: f64) -> [Point; 4] {
        std::array::from_fn(|_| std::array::from_fn(|_| self.uniform(-size, size)))
    }
}

type Distance = fn(&[Point; 4]) -> f64;
type Detector = fn(&[Point; 4], &[Point; 4], f64, f64) -> Option<f64>;

const KINDS: [(&str, Distance, Detector); 2] = [
    ("vertex-face", point_triangle, ccd::point_triangle::time_of_impact_with_separation),
    ("edge-edge", edge_edge, ccd::edge_edge::time_of_impact_with_separation),
];

/// Motions of several families around configurations of unit size.
fn motion(random: &mut Random, family: u64) -> ([Point; 4], [Point; 4]) {
    let x0 = random.points(1.0);
    let moved = |random: &mut Random, size: f64, x: &[Point; 4]| -> [Point; 4] {
        let d = random.points(size);
        std::array::from_fn(|i| std::array::from_fn(|c| x[i][c] + d[i][c]))
    };
    match family {
        0 => {
            let x1 = moved(random, 1.0, &x0);
            (x0, x1)
        }
        1 => {
            // One rotation for all, with a little noise.
            let (sin, cos) = random.uniform(-2.0, 2.0).sin_cos();
            let x1 = x0.map(|[x, y, z]| [cos * x - sin * y, sin * x + cos * y, z]);
            let x1 = moved(random, 1e-3, &x1);
            (x0, x1)
        }
        2 => {
            // Nearly flat: sliding past each other.
            let x0 = x0.map(|[x, y, z]| [x, y, 1e-3 * z]);
            let d = random.points(1.0);
            (x0, std::array::from_fn(|i| [x0[i][0] + d[i][0], x0[i][1] + d[i][1], x0[i][2] + 1e-3 * d[i][2]]))
        }
        _ => {
            // Nearly collapsed onto a line.
            let x0 = x0.map(|[x, y, z]| [x, 1e-6 * y + 0.1 * x, 1e-3 * z]);
            let x1 = moved(random, 0.3, &x0);
            (x0, x1)
        }
    }
}

fn check(
    name: &str,
    distance: Distance,
    detect: Detector,
    x0: &[Point; 4],
    x1: &[Point; 4],
    offset: f64,
    s: f64,
) -> bool {
    let far = |x: &[Point; 4]| x.map(|p| p.map(|c| c + offset));
    let (y0, y1) = (far(x0), far(x1));
    // What the detector sees, brought back to the origin exactly, is what the oracle measures.
    let back = |y: &[Point; 4]| y.map(|p| p.map(|c| c - offset));
    let (x0, x1) = (back(&y0), back(&y1));
    let found = detect(&y0, &y1, s, 1.0);
    let until = found.unwrap_or(1.0);
    let mut least = f64::INFINITY;
    for i in 0..=400 {
        let t = until * f64::from(i) / 400.0;
        least = least.min(distance(&at(&x0, &x1, t)));
    }
    if until > 0.0 {
        assert!(least >= s, "{name}: missed {least} < {s} before {until}: {x0:?} {x1:?}");
    }
    if let Some(t) = found {
        let reached = distance(&at(&x0, &x1, t));
        assert!(
            reached <= s * (1.0 + 1.0 / 1024.0) + 1e-13,
            "{name}: false alarm at {t}: {reached} against {s}: {x0:?} {x1:?}"
        );
    }
    found.is_some()
}

#[test]
fn separation_is_never_missed_and_alarms_are_near_it() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (mut alarms, mut total) = (0, 0);
    for round in 0..4000 {
        let (x0, x1) = motion(&mut random, round % 4);
        for (name, distance, detect) in KINDS {
            let d0 = distance(&x0);
            let start = [0.9, 0.5, 1e-3, 1e-6][(round / 4 % 4) as usize] * d0;
            let offset = if round % 3 == 0 { 65536.0 } else { 0.0 };
            alarms += usize::from(check(name, distance, detect, &x0, &x1, offset, start));
            total += 1;
        }
    }
    // Both outcomes are well represented, so neither assertion above is idle.
    assert!(alarms > total / 10 && alarms < total * 9 / 10, "{alarms} of {total}");
}

#[test]
fn start_below_the_separation_is_reported_at_zero() {
    let x0 = [[0.2, 0.2, 0.1], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut x1 = x0;
    x1[0][2] = 1.0;
    let detect = ccd::point_triangle::time_of_impact_with_separation;
    assert_eq!(detect(&x0, &x1, 0.2, 1.0), Some(0.0));
    assert_eq!(detect(&x0, &x1, 0.05, 1.0), None);
    let mut bad = x0;
    bad[1][0] = f64::NAN;
    assert_eq!(detect(&bad, &x1, 0.05, 1.0), Some(0.0));
}
