//! Continuous detection: rates on all candidate pairs of whole steps, on the hits alone, the earliest time of a step,
//! and the cost of single queries by family.
//!
//! `cargo bench --bench ccd -- DIR...`: every directory may hold steps (`NAME_t0.npy`, `NAME_t1.npy`, `NAME_f.npy`, or
//! `NAME-t0.ply`, `NAME-t1.ply`) and query families (`vf_queries.npy`, `vf_kind.npy`, `ee_...`). One line of JSON per
//! figure. One thread; medians of repeated runs.

use signorini::detection::{BroadPhase, Candidates, Primitives, ccd};
use signorini::parallel::Par;
use std::path::{Path, PathBuf};

#[path = "../../examples/rust/ccd_check/mesh_file.rs"]
mod mesh_file;
mod npy;

type Point = [f64; 3];
type Detector<'a> = dyn Fn(&[Point; 4], &[Point; 4]) -> Option<f64> + 'a;

struct Step {
    name: String,
    x0: Vec<Point>,
    x1: Vec<Point>,
    faces: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
}

fn step(name: String, x0: Vec<Point>, x1: Vec<Point>, faces: Vec<[u32; 3]>) -> Step {
    let mut edges: Vec<[u32; 2]> =
        faces.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]].map(|[p, q]| [*p.min(q), *p.max(q)])).collect();
    edges.sort_unstable();
    edges.dedup();
    Step { name, x0, x1, faces, edges }
}

fn steps_of(dir: &Path) -> Result<Vec<Step>, String> {
    let entries = std::fs::read_dir(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.sort();
    let mut steps = Vec::new();
    for path in paths {
        let file = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if let Some(name) = file.strip_suffix("_t0.npy") {
            let part = |suffix: &str| dir.join(format!("{name}_{suffix}.npy"));
            let faces =
                npy::read(&part("f"))?.chunks_exact(3).map(|f| [f[0] as u32, f[1] as u32, f[2] as u32]).collect();
            steps.push(step(name.into(), npy::points(&path)?, npy::points(&part("t1"))?, faces));
        } else if let Some(name) = file.strip_suffix("-t0.ply") {
            let (start, end) = (mesh_file::read_ply(&path)?, mesh_file::read_ply(&dir.join(format!("{name}-t1.ply")))?);
            steps.push(step(name.into(), start.points, end.points, start.faces));
        }
    }
    Ok(steps)
}

/// CPU seconds of this thread: on a shared machine the only clock that tells what the work costs.
fn cpu_seconds() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the call fills in the struct it is given.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut t) };
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Median CPU seconds of `repeat` runs and the last result.
fn median<T>(repeat: usize, mut run: impl FnMut() -> T) -> (f64, T) {
    let mut result = run();
    let mut seconds: Vec<f64> = (0..repeat)
        .map(|_| {
            let start = cpu_seconds();
            result = run();
            cpu_seconds() - start
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    (seconds[repeat / 2], result)
}

/// All pairs with overlapping swept boxes that share no vertex.
fn candidates(s: &Step, primitives: &Primitives) -> Candidates {
    let mut found = Candidates::default();
    let mut tree = BroadPhase::build(primitives);
    tree.refit(&s.x0, &s.x1, &[], Par::Serial);
    tree.candidates(&|_, _| true, &mut found, Par::Serial);
    let swept = |vertices: &[u32]| {
        let mut b = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for p in vertices.iter().flat_map(|v| [s.x0[*v as usize], s.x1[*v as usize]]) {
            for c in 0..3 {
                b[0][c] = b[0][c].min(p[c]);
                b[1][c] = b[1][c].max(p[c]);
            }
        }
        b
    };
    let overlap = |a: &[u32], b: &[u32]| {
        let (a, b) = (swept(a), swept(b));
        (0..3).all(|c| a[0][c] <= b[1][c] && b[0][c] <= a[1][c])
    };
    found.vertex_face.retain(|[v, f]| overlap(&[*v], &s.faces[*f as usize]));
    found.edge_edge.retain(|[a, b]| overlap(&s.edges[*a as usize], &s.edges[*b as usize]));
    found
}

fn bench_step(s: &Step) {
    let vertices: Vec<u32> = (0..s.x0.len() as u32).collect();
    let primitives = Primitives { vertices: &vertices, edges: &s.edges, faces: &s.faces };
    let all = candidates(s, &primitives);
    let run = |c: &Candidates, separation: f64| {
        ccd::hits(&s.x0, &s.x1, &primitives, c, ccd::Separation::Uniform(separation), Par::Serial)
    };
    let vertex_face = Candidates { vertex_face: all.vertex_face.clone(), ..Default::default() };
    let edge_edge = Candidates { edge_edge: all.edge_edge.clone(), ..Default::default() };
    for (kind, list, count) in [("vf", &vertex_face, all.vertex_face.len()), ("ee", &edge_edge, all.edge_edge.len())] {
        let repeat = if count > 1_000_000 { 3 } else { 9 };
        let (seconds, hits) = median(repeat, || run(list, 0.0));
        let rate = |n: usize, seconds: f64| n as f64 / seconds.max(1e-12) / 1e6;
        print!(
            "{{\"part\":\"pairs\",\"scene\":\"{}\",\"kind\":\"{kind}\",\"pairs\":{count},\"hits\":{},\"seconds\":{seconds:.6},\"million_per_second\":{:.3}",
            s.name,
            hits.len(),
            rate(count, seconds)
        );
        let mut only = Candidates::default();
        for hit in &hits {
            match hit.pair {
                ccd::Pair::VertexFace(p) => only.vertex_face.push(p),
                ccd::Pair::EdgeEdge(p) => only.edge_edge.push(p),
            }
        }
        let (seconds, again) = median(repeat, || run(&only, 0.0));
        assert_eq!(again.len(), hits.len());
        print!(",\"hits_million_per_second\":{:.3}", rate(hits.len(), seconds));
        // A separation of a hundredth of the mean edge length.
        let mean = s.edges.iter().map(|e| length(s, e)).sum::<f64>() / s.edges.len() as f64;
        let (seconds, near) = median(repeat, || run(list, 0.01 * mean));
        println!(",\"separated_hits\":{},\"separated_million_per_second\":{:.3}}}", near.len(), rate(count, seconds));
    }
    let (seconds, earliest) = median(9, || {
        ccd::earliest_time_of_impact(&s.x0, &s.x1, &primitives, &all, ccd::Separation::Uniform(0.0), Par::Serial)
    });
    println!(
        "{{\"part\":\"earliest\",\"scene\":\"{}\",\"pairs\":{},\"milliseconds\":{:.4},\"time\":{}}}",
        s.name,
        all.vertex_face.len() + all.edge_edge.len(),
        seconds * 1e3,
        earliest.map_or(-1.0, |hit| hit.time)
    );
}

fn length(s: &Step, e: &[u32; 2]) -> f64 {
    let (a, b) = (s.x0[e[0] as usize], s.x0[e[1] as usize]);
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

const FAMILIES: [&str; 6] = ["random", "grazing", "near_feature", "parallel_or_sliver", "rigid_close", "tiny_gap_hit"];

fn bench_families(dir: &Path, kind: &str) -> Result<(), String> {
    let numbers = npy::read(&dir.join(format!("{kind}_queries.npy")))?;
    let family = npy::read(&dir.join(format!("{kind}_kind.npy")))?;
    let detect = if kind == "vf" { ccd::point_triangle::time_of_impact } else { ccd::edge_edge::time_of_impact };
    let separated = if kind == "vf" {
        ccd::point_triangle::time_of_impact_with_separation
    } else {
        ccd::edge_edge::time_of_impact_with_separation
    };
    for (k, name) in FAMILIES.iter().enumerate() {
        let queries: Vec<([Point; 4], [Point; 4])> = numbers
            .chunks_exact(24)
            .zip(&family)
            .filter(|(_, f)| **f == k as f64)
            .map(|(q, _)| {
                let points = |s: usize| std::array::from_fn(|i| std::array::from_fn(|c| q[s + 3 * i + c]));
                (points(0), points(12))
            })
            .collect();
        let timed = |f: &Detector| {
            let (mut hits, mut total, mut worst) = (0, 0.0, 0.0_f64);
            for (x0, x1) in &queries {
                let mut least = f64::INFINITY;
                let mut hit = false;
                for _ in 0..3 {
                    let start = std::time::Instant::now();
                    hit = f(x0, x1).is_some();
                    least = least.min(start.elapsed().as_secs_f64() * 1e6);
                }
                hits += usize::from(hit);
                total += least;
                worst = worst.max(least);
            }
            (hits, total / queries.len() as f64, worst)
        };
        let (hits, mean, worst) = timed(&|x0, x1| detect(x0, x1, 1.0));
        // A separation of a hundredth and of a half of the smallest gap these families are made with.
        let (near, mean_near, worst_near) = timed(&|x0, x1| separated(x0, x1, 1e-11, 1.0));
        let (half, mean_half, worst_half) = timed(&|x0, x1| separated(x0, x1, 5e-10, 1.0));
        println!(
            "{{\"part\":\"family\",\"kind\":\"{kind}\",\"family\":\"{name}\",\"queries\":{},\"hits\":{hits},\"mean_us\":{mean:.3},\"worst_us\":{worst:.1},\"separation_1e-11\":[{near},{mean_near:.3},{worst_near:.1}],\"separation_5e-10\":[{half},{mean_half:.3},{worst_half:.1}]}}",
            queries.len()
        );
    }
    Ok(())
}

fn run() -> Result<(), String> {
    // Cargo passes `--bench`; everything else is a directory.
    let dirs: Vec<PathBuf> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).map(PathBuf::from).collect();
    if dirs.is_empty() {
        println!("usage: cargo bench --bench ccd -- DIR...");
    }
    for dir in dirs {
        for s in steps_of(&dir)? {
            bench_step(&s);
        }
        for kind in ["vf", "ee"] {
            if dir.join(format!("{kind}_queries.npy")).exists() {
                bench_families(&dir, kind)?;
            }
        }
    }
    Ok(())
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("ccd: {message}");
            std::process::ExitCode::FAILURE
        }
    }
}
