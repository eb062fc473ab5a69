//! Whole steps of whole scenes: what they cost, what they did, and how far the velocities are from a tight solve.
//!
//! `cargo bench --bench step -- [SCENE...] [steps=N] [seed=S] [threads=T] [tight=N] [frames=DIR] [record=STEP,STEP:DIR]
//! [range=M] [contact=T] [velocity=T] [trace]`
//!
//! Scenes: drape, crumple, pile, cube, ball, boxes, tower. `tight=N` solves every Nth step again to a tolerance far
//! below the default and compares; `frames=DIR` writes the elastic vertices of every tenth step as `f64`; `record=`
//! writes the contact problems before those steps, pairs nearer than `range` (0.004); `contact=` and `velocity=` set
//! the tolerances; `trace` prints a line per step. Times are processor seconds of the calling thread, so give threads=0
//! (serial, the default) for figures.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
mod support;

use signorini::math::{Vec3, sub};
use signorini::model::Settings;
use signorini::parallel::{Par, Pool};
use support::host::{Facts, Host, quantile};
use support::scenes;

struct Choice {
    steps: Option<usize>,
    seed: u64,
    threads: usize,
    tight: usize,
    frames: Option<String>,
    record: Option<(Vec<usize>, String)>,
    range: f64,
    trace: bool,
    vertices: usize,
    tolerances: [Option<f64>; 2],
}

fn main() {
    // Cargo adds `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with("--")).collect();
    let value = |name: &str| words.iter().find_map(|w| w.strip_prefix(name)?.strip_prefix('=').map(str::to_string));
    let number = |name: &str| value(name).map(|v| v.parse::<usize>().expect("a whole number"));
    let choice = Choice {
        steps: number("steps"),
        seed: number("seed").unwrap_or(0) as u64,
        threads: number("threads").unwrap_or(0),
        tight: number("tight").unwrap_or(0),
        frames: value("frames"),
        record: value("record").map(|text| {
            let (steps, folder) = text.split_once(':').expect("record=STEP,STEP:FOLDER");
            (steps.split(',').map(|s| s.parse().expect("a step")).collect(), folder.to_string())
        }),
        range: value("range").map_or(0.004, |v| v.parse().expect("a length")),
        trace: words.iter().any(|w| w == "trace"),
        vertices: number("n").unwrap_or(50),
        tolerances: ["contact", "velocity"].map(|name| value(name).map(|v| v.parse().expect("a tolerance"))),
    };
    let mut names: Vec<&str> = words.iter().map(String::as_str).filter(|w| !w.contains('=') && *w != "trace").collect();
    if names.is_empty() {
        names = vec!["drape", "crumple", "cube", "ball", "boxes"];
    }
    println!(
        "scene | steps | contacts max | active max | rounds 0-1/2/3/4-5/more | divided | zones | held | iterations \
         median/p95/max | not converged | ms median/p95/max | host ms | intersections | energy gain | momentum | balance | \
         velocity error median/p95/max"
    );
    for name in names {
        run(name, &choice);
    }
}

fn scene(name: &str, n: usize, seed: u64) -> (Host, usize) {
    match name {
        "drape" => (scenes::drape(n, seed), 250),
        "crumple" => (scenes::crumple(n, seed), 200),
        "pile" => (scenes::crumple(n, seed), 600),
        "cube" => (scenes::cover_cube(n, seed), 150),
        "ball" => (scenes::catch_ball(n, 1.0, 1.0, seed), 200),
        "boxes" => (scenes::boxes(2, 5, seed), 80),
        "tower" => (scenes::boxes(1, 3, seed), 45),
        other => panic!("no scene {other}"),
    }
}

fn run(name: &str, choice: &Choice) {
    let (mut host, usual) = scene(name, choice.vertices, choice.seed);
    let [contact, velocity] = choice.tolerances;
    host.settings.contact_tolerance = contact.unwrap_or(host.settings.contact_tolerance);
    host.settings.velocity_tolerance = velocity.unwrap_or(host.settings.velocity_tolerance);
    let pool = Pool::new(choice.threads.max(1)).expect("threads");
    let par = if choice.threads > 0 { Par::Pool(&pool) } else { Par::Serial };
    let (mut all, mut errors) = (Vec::new(), Vec::new());
    for number in 0..choice.steps.unwrap_or(usual) {
        if choice.tight > 0 && number % choice.tight == 0 {
            errors.extend(velocity_error(&mut host, par));
        }
        if let Some((steps, folder)) = &choice.record
            && steps.contains(&number)
        {
            let path = format!("{folder}/{name}_{number}.bin");
            let problem = support::record::problem(&mut host, choice.range);
            problem.save(std::path::Path::new(&path)).expect("a writable file");
            println!("{path}: {} contacts", problem.rows.len());
        }
        match host.step(par) {
            Ok(facts) => {
                if choice.trace {
                    trace(number, &facts);
                }
                all.push(facts);
            }
            Err(error) => {
                println!("{name}: step {number} refused: {error:?}");
                break;
            }
        }
        if let Some(folder) = &choice.frames
            && number % 10 == 0
        {
            write_frame(&host, folder, name, number);
        }
    }
    summary(name, &all, &mut errors);
}

/// Error of the step's velocity changes in the norm of A, against a tight solve from the same state, where there is
/// contact.
fn velocity_error(host: &mut Host, par: Par) -> Option<f64> {
    let linear = host.prepare();
    let mut ends = [Vec::new(), Vec::new()];
    let tight = Settings {
        contact_tolerance: 1e-6,
        velocity_tolerance: 1e-4,
        iterations_max: 20_000,
        certify: false,
        ..host.settings
    };
    for (settings, end) in [host.settings, tight].iter().zip(&mut ends) {
        host.step_of_a_copy(settings, par).ok()?;
        *end = host.result.velocities.clone();
    }
    let distance = |a: &[Vec3], b: &[Vec3]| {
        let difference: Vec<Vec3> = a.iter().zip(b).map(|(a, b)| sub(*a, *b)).collect();
        host.metric_energy(&linear, &difference).sqrt()
    };
    let change = distance(&ends[1], &host.drives.velocities);
    (change > 0.0).then(|| distance(&ends[0], &ends[1]) / change)
}

fn trace(number: usize, f: &Facts) {
    let r = &f.report;
    println!(
        "{number}: {:.1} ms (search {:.1} rows {:.1} solve {:.1} detection {:.1} fail-safe {:.1} certificate {:.1}), \
         contacts {} active {} rounds {} parts {} iterations {}{} zones {} held {} residuals {:.1e} {:.1e} {:.1e}, \
         speed {:.2} kinetic {:.2e} gain {:.1e} momentum {:.0e} balance {:.0e} recovery {:.1e} intersections {:?}",
        1e3 * f.seconds,
        1e-3 * r.times.search,
        1e-3 * r.times.rows,
        1e-3 * r.times.solve,
        1e-3 * r.times.detection,
        1e-3 * r.times.fail_safe,
        1e-3 * r.times.certificate,
        r.contacts,
        r.active_contacts,
        r.rounds,
        r.parts,
        r.iterations,
        if r.not_converged { " NOT CONVERGED" } else { "" },
        r.zones(),
        r.held_vertices,
        r.complementarity_residual,
        r.friction_residual,
        r.dynamics_residual,
        f.speed,
        f.kinetic,
        f.energy_gain,
        f.momentum_error,
        f.balance_error,
        r.recovery_work,
        r.intersections,
    );
}

fn summary(name: &str, all: &[Facts], errors: &mut [f64]) {
    let count = |f: &dyn Fn(&Facts) -> bool| all.iter().filter(|x| f(x)).count();
    let most = |f: &dyn Fn(&Facts) -> f64| all.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
    // The first step builds trees and buffers; it counts in the simulation but not in the times.
    let later = &all[1.min(all.len())..];
    let mut times: Vec<f64> = later.iter().map(|x| 1e3 * x.seconds).collect();
    let mut host: Vec<f64> = later.iter().map(|x| 1e3 * x.host_seconds).collect();
    let touching: Vec<&Facts> = all.iter().filter(|x| x.report.contacts > 0).collect();
    let mut iterations: Vec<f64> = touching.iter().map(|x| f64::from(x.report.iterations)).collect();
    let rounds = |low: u32, high: u32| {
        touching.iter().filter(|x| (low..=high).contains(&(x.report.rounds / x.report.parts.max(1)))).count()
    };
    println!(
        "{name} | {} | {} | {} | {}/{}/{}/{}/{} | {} | {} | {} | {:.0}/{:.0}/{:.0} | {} | {:.1}/{:.1}/{:.1} | {:.1} | {} | \
         {:.1e} | {:.1e} | {:.1e} | {:.1e}/{:.1e}/{:.1e}",
        all.len(),
        most(&|x| f64::from(x.report.contacts)),
        most(&|x| f64::from(x.report.active_contacts)),
        rounds(0, 1),
        rounds(2, 2),
        rounds(3, 3),
        rounds(4, 5),
        rounds(6, u32::MAX),
        count(&|x| x.report.parts > 1),
        count(&|x| x.report.zones() > 0),
        count(&|x| x.report.held_vertices > 0),
        quantile(&mut iterations, 0.5),
        quantile(&mut iterations, 0.95),
        quantile(&mut iterations, 1.0),
        count(&|x| x.report.not_converged),
        quantile(&mut times, 0.5),
        quantile(&mut times, 0.95),
        quantile(&mut times, 1.0),
        quantile(&mut host, 0.5),
        count(&|x| x.report.intersections.unwrap_or(0) > 0),
        most(&|x| x.energy_gain / x.energy_free.max(f64::MIN_POSITIVE)),
        most(&|x| x.momentum_error),
        most(&|x| x.balance_error),
        quantile(errors, 0.5),
        quantile(errors, 0.95),
        quantile(errors, 1.0),
    );
}

fn write_frame(host: &Host, folder: &str, name: &str, number: usize) {
    let bytes: Vec<u8> = host.state.positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::create_dir_all(folder).expect("a folder for frames");
    std::fs::write(format!("{folder}/{name}_{number:04}.f64"), bytes).expect("a writable frame");
}
