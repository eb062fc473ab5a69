//! The smallest host in Rust: a cloth that it simulates itself falls on a sphere, and the library keeps it off.
//!
//! `cargo run --release --example drape [FOLDER]` prints a line per tenth of a second and writes OBJ frames to FOLDER.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
#[path = "../../benches/support/mod.rs"]
mod support;

use signorini::parallel::Par;
use support::{scenes, shapes};

fn main() {
    let side = 50;
    let mut host = scenes::drape(side, 0);
    let faces = shapes::cloth_grid(side, 1.0).faces;
    let folder = std::env::args().nth(1);
    for step in 1..=250 {
        // The host assembles its matrix and unconstrained velocities, the library answers with an end state.
        let facts = match host.step(Par::Serial) {
            Ok(facts) => facts,
            Err(error) => panic!("step {step}: {error:?}"),
        };
        if step % 25 == 0 {
            println!(
                "{:.1} s: {} contacts, {} rounds, {:.0} ms, {:?} intersections",
                host.dt * f64::from(step),
                facts.report.contacts,
                facts.report.rounds,
                1e3 * facts.seconds,
                facts.report.intersections
            );
            if let Some(folder) = &folder {
                let mut text = String::new();
                for p in &host.state.positions[..side * side] {
                    text.push_str(&format!("v {} {} {}\n", p[0], p[1], p[2]));
                }
                for f in &faces {
                    text.push_str(&format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1));
                }
                std::fs::write(format!("{folder}/drape_{step:03}.obj"), text).expect("a writable folder");
            }
        }
    }
}
