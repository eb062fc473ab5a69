//! Writes contact problems from recorded cloth states, and of soft boxes heaped up.
//!
//! `cargo bench --bench problems -- boxes ACROSS STEPS OUT [dt=0.03]` lets ACROSS x ACROSS x 5 boxes fall for STEPS
//! steps of 5 ms; the problem lists pairs nearer than 40 mm, thickness 10 mm, friction 0.4.
//!
//! `cargo bench --bench problems -- sandwich SIDE OUT [speed=0.5]` presses three sheets of SIDE x SIDE vertices between the
//! ground and a ceiling that comes down at that speed: every layer hands the load on.
//!
//! `cargo bench --bench problems -- STATE OUT [sphere] [young=1000] [dt=0.004]`: STATE holds, little-endian, the `u64`
//! number of vertices of a square 1 m cloth, its positions and its velocities as `f64`. The problem lists every pair
//! nearer than 4 mm, thickness 2 mm, friction 0.3, the ground z = 0 and, on request, the sphere of the comparison scenes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
mod support;

use signorini::math::{Vec3, add, mat_vec};
use support::boxes::{Boxes, RUBBER, rotation};
use support::deformable::{CLOTH, Deformable, Sheet};
use support::nearby::{Surfaces, pairs};
use support::problem::{Problem, RowChoice, half_space_pairs};
use support::shapes::{Triangles, cloth_grid, edges_of, sphere};

fn read_state(path: &str) -> (Vec<Vec3>, Vec<Vec3>) {
    let bytes = std::fs::read(path).expect("a readable state file");
    let n = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let numbers: Vec<f64> = bytes[8..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let vectors: Vec<Vec3> = numbers.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
    assert_eq!(vectors.len(), 2 * n, "positions and velocities");
    (vectors[..n].to_vec(), vectors[n..].to_vec())
}

fn boxes(across: usize, steps: usize, out: &str, dt: f64) {
    let boxes = Boxes::new(across, 5, 7);
    let solids = Deformable::solid(&boxes.rest, RUBBER);
    let (x, v) = boxes.heaped(&solids, steps, 0.005);
    let step = solids.linear_step(&x, &v, [0.0, 0.0, -9.81], dt);
    let close = boxes.pairs(&x, 0.04);
    write(Problem::new(step.matrix, step.velocities, &close, RowChoice { thickness: 0.01, friction: 0.4, dt }), out);
}

/// Three wavy sheets 3 mm apart, turned against each other, thickness 2 mm, under a falling ceiling.
fn sandwich(side: usize, out: &str, speed: f64) {
    let one = cloth_grid(side, 0.5);
    let (mut rest, mut x) = (Triangles::default(), Vec::new());
    let mut body = Vec::new();
    for layer in 0..3u32 {
        let turn = rotation(0.0, 0.0, 0.3 * f64::from(layer));
        let first = x.len() as u32;
        rest.positions.extend(&one.positions);
        rest.faces.extend(one.faces.iter().map(|f| f.map(|v| v + first)));
        let height = 0.003 * f64::from(layer + 1);
        x.extend(one.positions.iter().map(|p| {
            let wave = 0.0004 * ((20.0 * p[0]).sin() + (17.0 * p[1] + f64::from(layer)).cos());
            add(mat_vec(&turn, *p), [0.0, 0.0, height + wave])
        }));
        body.resize(x.len(), layer);
    }
    let sheets = Deformable::sheet(&rest, CLOTH);
    let (dt, range, ceiling) = (0.004, 0.004, 0.012);
    let step = sheets.linear_step(&x, &vec![[0.0; 3]; x.len()], [0.0, 0.0, -9.81], dt);
    let edges = edges_of(&rest.faces);
    let surfaces =
        Surfaces { faces: &rest.faces, edges: &edges, body: &body, self_contact: &[false; 3], prescribed: &[false; 3] };
    let mut close = half_space_pairs(&x, [0.0, 0.0, 1.0], 0.0, range);
    close.extend(pairs(&x, &surfaces, range));
    let pressed = close.len();
    close.extend(half_space_pairs(&x, [0.0, 0.0, -1.0], -ceiling, range));
    let mut problem =
        Problem::new(step.matrix, step.velocities, &close, RowChoice { thickness: 0.002, friction: 0.3, dt });
    for target in &mut problem.rows.normal_targets[pressed..] {
        *target += speed;
    }
    write(problem, out);
}

fn write(problem: Problem, out: &str) {
    problem.save(std::path::Path::new(out)).expect("a writable file");
    println!(
        "{out}: {} block rows, {} blocks, {} contacts, |v*| {:.3} m/s",
        problem.matrix.rows(),
        problem.matrix.columns.len(),
        problem.rows.len(),
        problem.velocity_scale()
    );
}

fn main() {
    // Cargo adds `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    if let [kind, across, steps, out, options @ ..] = words.as_slice()
        && kind == "boxes"
    {
        let dt = options.iter().find_map(|o| o.strip_prefix("dt=")).map_or(0.03, |s| s.parse().expect("a number"));
        return boxes(across.parse().expect("a count"), steps.parse().expect("a count"), out, dt);
    }
    if let [kind, side, out, options @ ..] = words.as_slice()
        && kind == "sandwich"
    {
        let speed = options.iter().find_map(|o| o.strip_prefix("speed=")).map_or(0.5, |s| s.parse().expect("a speed"));
        return sandwich(side.parse().expect("a count"), out, speed);
    }
    let [state, out, options @ ..] = words.as_slice() else {
        println!("usage: cargo bench --bench problems -- STATE OUT [sphere] [young=N/m] [dt=s]");
        return;
    };
    let number = |name: &str, otherwise: f64| {
        let given = options.iter().find_map(|o| o.strip_prefix(name)?.strip_prefix('='));
        given.map_or(otherwise, |value| value.parse().expect("a number"))
    };
    let (dt, young, range) = (number("dt", 0.004), number("young", CLOTH.young), number("range", 0.004));
    let (mut x, v) = read_state(state);
    let n = x.len();
    let rest = cloth_grid((n as f64).sqrt().round() as usize, 1.0);
    let cloth = Deformable::sheet(&rest, Sheet { young, ..CLOTH });
    let step = cloth.linear_step(&x, &v, [0.0, 0.0, -9.81], dt);
    let mut faces = rest.faces.clone();
    let mut close = half_space_pairs(&x, [0.0, 0.0, 1.0], 0.0, range);
    if options.iter().any(|o| o == "sphere") {
        let ball = sphere([0.02, 0.03, 0.25], 0.25, 4);
        faces.extend(ball.faces.iter().map(|f| f.map(|v| v + n as u32)));
        x.extend(ball.positions);
    }
    let body: Vec<u32> = (0..x.len()).map(|i| u32::from(i >= n)).collect();
    let edges = edges_of(&faces);
    let surfaces = Surfaces {
        faces: &faces,
        edges: &edges,
        body: &body,
        self_contact: &[true, false],
        prescribed: &[false, true],
    };
    close.extend(pairs(&x, &surfaces, range));
    write(Problem::new(step.matrix, step.velocities, &close, RowChoice { thickness: 0.002, friction: 0.3, dt }), out);
}
