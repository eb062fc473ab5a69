//! The velocity filter alone: what a call costs with 0, 1, 5 and 20 % of the vertices colliding, from 1e3 to 3e5 vertices.
//!
//! `cargo bench --bench filter`: processor milliseconds of a call on one thread, start check and certificate included, the
//! tree kept from call to call; the best, the median and the 95th percentile of the calls after the first, counts and stages of
//! the best one. A share of a flat cloth is sent through scripted
//! cloth right below it, the rest freely down; everything drifts, so that no box of the call before holds.
//! Words: `quick` (to 1e4 vertices), `recorded` (displacement mode: the start is known to be clean), `projections` (no
//! passes of impulses), `inelastic`, `rigid`, `vertices=N share=S` for one scene, 40 calls; `write=DIR`: the motions of
//! 10,000 vertices and what becomes of them, for `benches/peers/step_size.py`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
mod support;

use signorini::math::{Vec3, add};
use signorini::model::{FailSafe, Precision, Settings, StepReport, Watch};
use signorini::parallel::Par;
use signorini::world::{Motion, MotionFilter, MotionFilterDescription, Topology};
use std::path::Path;
use support::clock::thread_seconds;
use support::random::Random;
use support::shapes::{Triangles, cloth_grid};

const DT: f64 = 1.0 / 60.0;

/// Length of an edge; everything else follows.
const EDGE: f64 = 0.01;

struct Scene {
    x: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    masses: Vec<f64>,
    groups: Vec<u32>,
    /// Way of each vertex in a call.
    way: Vec<Vec3>,
}

/// A cloth of about `count` vertices over scripted cloth that a share of them is sent through.
fn scene(count: usize, share: f64) -> Scene {
    let n = (count as f64).sqrt().round() as usize;
    let size = EDGE * (n - 1) as f64;
    let mut random = Random::new(1);
    let mut scene = Scene { x: vec![], triangles: vec![], masses: vec![], groups: vec![], way: vec![] };
    let mut push = |part: &Triangles, at: Vec3, mass: f64, way: Vec3| {
        let first = scene.x.len() as u32;
        for x in &part.positions {
            scene.x.push(add(add(*x, at), random.within(0.02 * EDGE)));
            scene.way.push(add(way, random.within(0.02 * EDGE)));
        }
        scene.triangles.extend(part.faces.iter().map(|f| f.map(|v| v + first)));
        scene.masses.resize(scene.x.len(), mass);
        scene.groups.resize(scene.x.len(), u32::from(mass == 0.0));
    };
    push(&cloth_grid(n, size), [0.0; 3], 1e-3, [0.05 * EDGE, 0.0, -0.6 * EDGE]);
    let below = (share * (n * n) as f64).sqrt().round() as usize;
    if below > 1 {
        // Shifted by a part of an edge, so that faces meet vertices and edges cross.
        let at = [0.31 * EDGE, 0.17 * EDGE, -0.4 * EDGE];
        push(&cloth_grid(below, EDGE * (below - 1) as f64), at, 0.0, [0.0; 3]);
    }
    scene
}

/// What calls on a scene came to.
struct Measured {
    /// Processor seconds of the calls, ascending, and the report of the first of them.
    seconds: Vec<f64>,
    report: StepReport,
    /// Positions before, wished and found of the last call.
    motion: [Vec<Vec3>; 3],
}

fn measure(scene: &Scene, settings: &Settings, calls: usize, recorded: bool) -> Measured {
    let mut filter = MotionFilter::new(MotionFilterDescription {
        rest: scene.x.clone(),
        topology: Topology { triangles: scene.triangles.clone(), ..Topology::default() },
        masses: scene.masses.clone(),
        groups: scene.groups.clone(),
        half_thickness: Some(0.05 * EDGE),
        friction_coefficient: 0.2,
        self_collision: true,
        precision: Precision::Double,
    })
    .unwrap();
    let mut seconds = Vec::new();
    let mut last = StepReport::default();
    let mut motion = Default::default();
    for call in 0..calls {
        let drift = [0.3 * EDGE * call as f64, 0.2 * EDGE * call as f64, 0.0];
        let x0: Vec<Vec3> = scene.x.iter().map(|x| add(*x, drift)).collect();
        let x1: Vec<Vec3> = x0.iter().zip(&scene.way).map(|(x, w)| add(*x, *w)).collect();
        let from = thread_seconds();
        let wish = if recorded { Motion::Displacement(&x0, &x1) } else { Motion::Between(&x0, &x1) };
        let report = filter.run(wish, settings, DT, Par::Serial, Watch::default());
        seconds.push(thread_seconds() - from);
        let report = report.unwrap_or_else(|failure| panic!("{:?}", failure.error));
        assert_eq!(report.intersections, Some(0));
        let best = seconds[1..].iter().copied().fold(f64::INFINITY, f64::min);
        if call > 0 && seconds[call] <= best {
            last = report;
        }
        motion = [x0, x1, filter.positions()];
    }
    seconds.remove(0);
    seconds.sort_by(f64::total_cmp);
    Measured { seconds, report: last, motion }
}

impl Measured {
    /// Milliseconds: the best, the median, the 95th percentile.
    fn milliseconds(&self) -> [f64; 3] {
        let last = (self.seconds.len() - 1) as f64;
        [0.0, 0.5, 0.95].map(|share| 1e3 * self.seconds[(share * last).round() as usize])
    }
}

/// The last motion of a scene as OBJ files, and milliseconds of the best call.
fn write(folder: &Path, scene: &Scene, measured: &Measured) {
    std::fs::create_dir_all(folder).expect("a folder");
    for (name, positions) in ["start", "wish", "end"].into_iter().zip(&measured.motion) {
        let mut text = String::new();
        for (v, [x, y, z]) in positions.iter().enumerate() {
            if v == 0 || scene.groups[v] != scene.groups[v - 1] {
                text.push_str(&format!("o part{}\n", scene.groups[v]));
            }
            text.push_str(&format!("v {x} {y} {z}\n"));
        }
        scene.triangles.iter().for_each(|t| text.push_str(&format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
        std::fs::write(folder.join(format!("{name}.obj")), text).expect("written");
    }
    std::fs::write(folder.join("milliseconds"), format!("{}\n", measured.milliseconds()[0])).expect("written");
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let has = |word: &str| words.iter().any(|w| w == word);
    let fail_safe = if has("inelastic") {
        FailSafe::InelasticProjection
    } else if has("rigid") {
        FailSafe::RigidZone
    } else {
        FailSafe::UnilateralProjection
    };
    let mut settings = Settings { certify: true, fail_safe, ..Settings::default() };
    if has("projections") {
        settings.filter.passes_max = 0;
    }
    println!(
        "vertices,share,milliseconds,median,p95,contacts,active,passes,projected,rigid,held,start+certificate,search,detection,response,fail_safe"
    );
    let number = |name: &str| words.iter().find_map(|w| w.strip_prefix(name)?.parse::<f64>().ok());
    if let (Some(count), Some(share)) = (number("vertices="), number("share=")) {
        let measured = measure(&scene(count as usize, share), &settings, 40, has("recorded"));
        let [best, median, p95] = measured.milliseconds();
        println!("{best:.2} ms of the processor, median {median:.2}, p95 {p95:.2}, {:?}", measured.report);
        return;
    }
    if let Some(out) = words.iter().find_map(|w| w.strip_prefix("write=")) {
        for share in [0.01, 0.05, 0.2] {
            let scene = scene(10_000, share);
            let folder = format!("{:.0} % colliding", 100.0 * share);
            write(&Path::new(out).join(folder), &scene, &measure(&scene, &settings, 10, has("recorded")));
        }
        return;
    }
    let counts = if has("quick") { &[1_000, 10_000][..] } else { &[1_000, 3_000, 10_000, 30_000, 100_000, 300_000] };
    for share in [0.0, 0.01, 0.02, 0.05, 0.2] {
        let mut first = None;
        let mut line = (0, 0.0);
        for count in counts {
            let scene = scene(*count, share);
            let calls = if *count > 50_000 { 4 } else { 10 };
            let measured = measure(&scene, &settings, calls, has("recorded"));
            let ([best, median, p95], r) = (measured.milliseconds(), &measured.report);
            let ms = |microseconds: f64| 1e-3 * microseconds;
            println!(
                "{},{share},{best:.2},{median:.2},{p95:.2},{},{},{},{},{},{},{:.1},{:.1},{:.1},{:.1},{:.1}",
                scene.x.len(),
                r.contacts,
                r.active_contacts,
                r.rounds,
                r.projected_zones,
                r.rigid_zones,
                r.held_vertices,
                ms(r.times.certificate),
                ms(r.times.search),
                ms(r.times.detection),
                ms(r.times.solve),
                ms(r.times.fail_safe),
            );
            line = (scene.x.len(), best);
            first = first.or(Some(line));
        }
        if let Some((count, of_first)) = first.filter(|(count, _)| *count != line.0) {
            let slope = (line.1 / of_first).ln() / (line.0 as f64 / count as f64).ln();
            println!("share {share}: slope {slope:.2}");
        }
    }
}
