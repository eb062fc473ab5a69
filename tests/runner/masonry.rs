//! Arches and cards against statics: just above the bound they stand, just below they fall.

use crate::command::{Folder, report};
use std::path::Path;

/// Whether a semicircular arch of mean radius 1 can stand: whether some line of thrust, that is some thrust at some height
/// of the crown, passes through every joint. Stones are counted from joint to joint, an odd number of them; joints do not
/// slide.
fn has_line_of_thrust(thickness: f64, stones: u32) -> bool {
    let (inner, outer) = (1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness);
    let angle = std::f64::consts::PI / f64::from(stones);
    let centroid = 2.0 / 3.0 * (outer.powi(3) - inner.powi(3)) / (outer.powi(2) - inner.powi(2));
    // Of each joint, by its angle from the vertical: weight between it and the crown, and its moment about the crown.
    let mut joints = Vec::new();
    let (mut before, mut weight, mut moment) = (0.0f64, 0.0, 0.0);
    for k in 0..stones.div_ceil(2) {
        let joint = (f64::from(k) + 0.5) * angle;
        let half = 0.5 * (joint - before);
        weight += joint - before;
        moment += (joint - before) * centroid * half.sin() / half * (0.5 * (joint + before)).sin();
        joints.push((joint, weight, moment));
        before = joint;
    }
    (1..2000).map(|i| 1e-3 * f64::from(i)).any(|thrust| {
        // The line cuts the joint at the radius (moment + thrust * height) / (weight sin + thrust cos).
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (joint, weight, moment) in &joints {
            let below = weight * joint.sin() + thrust * joint.cos();
            low = low.max((inner * below - moment) / thrust);
            high = high.min((outer * below - moment) / thrust);
        }
        low <= high
    })
}

fn least_thickness(stones: u32) -> f64 {
    let (mut falls, mut stands) = (0.01, 0.5);
    for _ in 0..40 {
        let middle = 0.5 * (falls + stands);
        if has_line_of_thrust(middle, stones) { stands = middle } else { falls = middle }
    }
    stands
}

/// Runs a scene of the examples with a part of its text replaced; its bounds must hold.
fn run_with(folder: &Folder, scene: &str, from: &str, to: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes").join(scene);
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{scene}: {from}");
    folder.file(scene, &text.replace(from, to));
    let line = report(folder, &[scene]);
    assert_eq!(line["intersections"].as_u64(), Some(0));
    println!("{scene} with {to}: {line}");
}

#[test]
fn an_arch_stands_from_its_least_thickness_on() {
    // Milankovitch 1904: 0.1075 for ever more stones.
    assert!((least_thickness(101) - 0.1075).abs() < 1e-4, "{}", least_thickness(101));
    let least = least_thickness(9);
    assert!((least - 0.1021).abs() < 1e-4, "{least}");
    let folder = Folder::new("arch");
    run_with(&folder, "arch.toml", "thickness = 0.125", &format!("thickness = {}", 1.1 * least));
    run_with(&folder, "arch_falling.toml", "thickness = 0.08", &format!("thickness = {}", 0.9 * least));
}

/// What friction coefficients two leaning cards need at their feet and where they touch: cards of length 1 and of a
/// thickness, leaning by two angles, the upper edge of the second on the face of the first. In the plane.
fn needed_friction(thickness: f64, angles: [f64; 2]) -> [f64; 2] {
    let ([s0, s1], [c0, c1]) = (angles.map(f64::sin), angles.map(f64::cos));
    // The first foot is the origin.
    let touch = [c1 * s0 / c0, c1];
    let foot = touch[0] + s1;
    let centres = [0.5 * (s0 - thickness * c0), foot - 0.5 * (s1 - thickness * c1)];
    // Moments about each foot, of a card's weight 1 and of the force (x, z) that the first takes, the second gives.
    let (r, q) = (touch, [touch[0] - foot, touch[1]]);
    let (b0, b1) = (centres[0], centres[1] - foot);
    // -r_z x + r_x z = b0 and q_z x - q_x z = b1.
    let determinant = r[1] * q[0] - r[0] * q[1];
    let force = [(-b0 * q[0] - r[0] * b1) / determinant, (-r[1] * b1 - q[1] * b0) / determinant];
    assert!((-r[1] * force[0] + r[0] * force[1] - b0).abs() < 1e-14);
    assert!((q[1] * force[0] - q[0] * force[1] - b1).abs() < 1e-14);
    let feet = [force[0] / (1.0 - force[1]), force[0] / (1.0 + force[1])];
    let (along, across) = (force[0] * s0 + force[1] * c0, force[0] * c0 - force[1] * s0);
    [feet[0].abs().max(feet[1].abs()), (along / across).abs()]
}

#[test]
fn leaning_cards_stand_from_their_least_friction_on() {
    // Two equal cards: half the tangent of their angle, less what their thickness does; no friction between them.
    let angle = 20f64.to_radians();
    let [feet, edge] = needed_friction(0.02, [angle; 2]);
    assert!((feet - 0.5 * (angle.tan() - 0.02)).abs() < 1e-12 && (edge - angle.tan()).abs() < 1e-12, "{feet} {edge}");
    let [feet, edge] = needed_friction(0.02, [20.0, 22.0].map(f64::to_radians));
    assert!((feet - 0.187).abs() < 1e-3 && (edge - 0.514).abs() < 1e-3, "{feet} {edge}");
    // The pair of foot and ground has the geometric mean.
    let ground = |coefficient: f64| format!("friction = {}", coefficient * coefficient / 0.8);
    let folder = Folder::new("cards");
    run_with(&folder, "card_pair.toml", "friction = 0.05", &ground(1.03 * feet));
    run_with(&folder, "card_pair_sliding.toml", "friction = 0.0361", &ground(0.97 * feet));
}
