//! The solver trial: time to a velocity error, cold and warm, on problem files.
//!
//! `cargo bench --bench solvers -- [--solvers a,b] [--warm] [--curve] [--velocity 0.05] [--start 6] FILE...`; a file is
//! what `benches/problems.rs` writes. References are tight solves, kept beside the files as `NAME.reference`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
#[path = "support/mod.rs"]
mod support;

use signorini::implicit_contact::{SolverReport, SolverScratch, solve};
use signorini::math::{Vec3, dot, sub};
use signorini::model::{Settings, SolverChoice};
use signorini::parallel::Par;
use std::path::{Path, PathBuf};
use support::problem::Problem;

const SOLVERS: [(&str, SolverChoice); 5] = [
    ("automatic", SolverChoice::Automatic),
    ("relaxation", SolverChoice::AcceleratedRelaxation),
    ("lagrangian", SolverChoice::AugmentedLagrangian),
    ("light", SolverChoice::LightAnticipation),
    ("paper", SolverChoice::IterativeAnticipation),
];
/// Nothing that takes longer is followed further `[ms]`.
const PATIENCE: f64 = 1500.0;

struct Options {
    solvers: Vec<String>,
    warm: bool,
    curve: bool,
    settings: Settings,
    files: Vec<PathBuf>,
}

fn options() -> Options {
    let mut o =
        Options { solvers: Vec::new(), warm: false, curve: false, settings: Settings::default(), files: Vec::new() };
    let mut arguments = std::env::args().skip(1);
    while let Some(a) = arguments.next() {
        match a.as_str() {
            "--bench" => {}
            "--warm" => o.warm = true,
            "--curve" => o.curve = true,
            "--solvers" => o.solvers = arguments.next().unwrap_or_default().split(',').map(String::from).collect(),
            "--velocity" => {
                o.settings.velocity_tolerance = arguments.next().and_then(|t| t.parse().ok()).expect("a tolerance")
            }
            "--start" => {
                o.settings.splitting_iterations = arguments.next().and_then(|t| t.parse().ok()).expect("iterations")
            }
            file => o.files.push(file.into()),
        }
    }
    o
}

fn main() {
    let options = options();
    for file in &options.files {
        let problem = Problem::load(file).expect("problem file");
        let reference = reference(&problem, file);
        let n = problem.matrix.rows();
        let (m, z) = (problem.rows.len(), problem.matrix.values.len());
        let product = product_time(&problem);
        println!("\n{} blocks {n} nonzeros {z} contacts {m}; a product with A: {product:.3} ms", file.display());
        for (name, solver) in SOLVERS {
            if options.solvers.is_empty() || options.solvers.iter().any(|s| s == name) {
                converged_run(&problem, &reference, name, solver, &options);
                if options.curve {
                    curve(&problem, &reference, name, solver, options.warm);
                }
            }
        }
    }
}

/// Fastest of a hundred products with A in f64: what times on a shared machine can be compared by.
fn product_time(problem: &Problem) -> f64 {
    let mut y = vec![[0.0; 3]; problem.matrix.rows()];
    let mut fastest = f64::INFINITY;
    for _ in 0..100 {
        let clock = thread_time();
        problem.matrix.product(&problem.velocities, &mut y, Par::Serial);
        fastest = fastest.min(thread_time() - clock);
    }
    std::hint::black_box(&y);
    fastest
}

fn start(problem: &Problem, warm: bool) -> (Vec<Vec3>, Vec<Vec3>) {
    match (&problem.warm, warm) {
        (Some(start), true) => start.clone(),
        _ => (vec![[0.0; 3]; problem.rows.len()], vec![[0.0; 3]; problem.matrix.rows()]),
    }
}

/// CPU time of this thread `[ms]`: other programs on the machine do not count.
fn thread_time() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live timespec.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut t) };
    t.tv_sec as f64 * 1e3 + t.tv_nsec as f64 * 1e-6
}

fn run(problem: &Problem, settings: &Settings, warm: bool) -> (f64, Vec<Vec3>, SolverReport) {
    let (mut p, mut dv) = start(problem, warm);
    let mut scratch = SolverScratch::default();
    let view = problem.view();
    let clock = thread_time();
    let report = solve(&view, &mut p, &mut dv, settings, &mut scratch, Par::Serial);
    (thread_time() - clock, dv, report)
}

/// Errors of `dv`: in the norm of A, and in the 2-norm.
fn errors(problem: &Problem, dv: &[Vec3], reference: &[Vec3]) -> [f64; 2] {
    let e: Vec<Vec3> = dv.iter().zip(reference).map(|(a, b)| sub(*a, *b)).collect();
    let energy = |v: &[Vec3]| (0..v.len()).map(|i| dot(v[i], problem.matrix.row_product(i, v))).sum::<f64>();
    let square = |v: &[Vec3]| v.iter().map(|x| dot(*x, *x)).sum::<f64>();
    [(energy(&e) / energy(reference)).sqrt(), (square(&e) / square(reference)).sqrt()]
}

fn describe(r: &SolverReport) -> String {
    format!(
        "iterations {:5} hand-overs {} converged {:5} nat {:.1e} {:.1e} dyn {:.1e} estimate {:.1e} paper {} work {:.1e}",
        r.iterations,
        r.hand_overs,
        r.converged,
        r.complementarity_residual,
        r.friction_residual,
        r.dynamics_residual,
        r.velocity_error,
        r.paper_iterations,
        r.work as f64
    )
}

/// A run with the settings of the command line, by default what a host gets.
fn converged_run(problem: &Problem, reference: &[Vec3], name: &str, solver: SolverChoice, options: &Options) {
    let warm = options.warm;
    let settings = Settings { solver, ..options.settings };
    let (ms, dv, report) = run(problem, &settings, warm);
    let [a, two] = errors(problem, &dv, reference);
    println!("{name:12} {ms:8.1} ms error A {a:.1e} 2 {two:.1e} | {}", describe(&report));
}

/// Time to an error, by runs with growing caps: a run with a cap ends where a longer one passes through.
fn curve(problem: &Problem, reference: &[Vec3], name: &str, solver: SolverChoice, warm: bool) {
    let mut left: Vec<f64> = vec![0.1, 0.05, 0.02, 0.01, 0.001];
    let mut left_two = left.clone();
    let mut line = String::new();
    let mut cap = 5u32;
    while !left.is_empty() || !left_two.is_empty() {
        let tight = Settings { contact_tolerance: 1e-12, velocity_tolerance: 1e-12, ..Settings::default() };
        let settings = Settings { solver, iterations_max: cap, ..tight };
        let (ms, dv, report) = run(problem, &settings, warm);
        let [a, two] = errors(problem, &dv, reference);
        while left.first().is_some_and(|e| a <= *e) {
            line += &format!("  A {}: {ms:.1} ms ({})", left.remove(0), report.iterations);
        }
        while left_two.first().is_some_and(|e| two <= *e) {
            line += &format!("  2 {}: {ms:.1} ms", left_two.remove(0));
        }
        if ms > PATIENCE || report.iterations < cap / 2 {
            break;
        }
        cap = (cap + 5).max((f64::from(cap) * 1.15) as u32 / 5 * 5);
    }
    println!("    {name} to error {line}");
}

/// A tight solve, cached.
fn reference(problem: &Problem, file: &Path) -> Vec<Vec3> {
    let cache = file.with_extension("reference");
    if let Ok(bytes) = std::fs::read(&cache)
        && bytes.len() == 24 * problem.matrix.rows()
    {
        let word = |c: &[u8]| f64::from_le_bytes(c.try_into().unwrap());
        return bytes.chunks(24).map(|c| [word(&c[..8]), word(&c[8..16]), word(&c[16..])]).collect();
    }
    let settings = Settings {
        solver: SolverChoice::AcceleratedRelaxation,
        contact_tolerance: 1e-8,
        velocity_tolerance: 1e-6,
        iterations_max: 20_000,
        ..Settings::default()
    };
    let (ms, dv, report) = run(problem, &settings, false);
    println!("reference of {}: {ms:.0} ms, {}", file.display(), describe(&report));
    let bytes: Vec<u8> = dv.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let _ = std::fs::write(cache, bytes);
    dv
}
