//! Candidate search of moving steps, one thread: CPU seconds, medians.
//!
//! Usage: `cargo bench --bench broad_phase -- [DIR] [REPEATS]`. `DIR` holds `NAME_t0.npy`, `NAME_t1.npy` (float64, n x 3)
//! and `NAME_f.npy` (int32, m x 3) for any number of scenes; without it two waved sheets made here are measured.
//! One JSON line per figure.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use signorini::detection::{BroadPhase, Candidates};
use signorini::math::Vec3;
use signorini::mesh::Surface;
use signorini::parallel::Par;
use std::path::Path;

/// CPU time of the process in seconds: what counts on a machine that does other work too.
fn cpu_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the call fills the structure it is given.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The numbers of an .npy file, C order, of the given type and three columns.
fn read_npy<const BYTES: usize, T>(path: &Path, kind: &str, number: impl Fn([u8; BYTES]) -> T) -> Vec<[T; 3]> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let length = u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
    let header = String::from_utf8_lossy(&bytes[10..10 + length]).to_string();
    assert!(bytes.starts_with(b"\x93NUMPY\x01") && header.contains(kind), "{}: {header}", path.display());
    assert!(header.contains("'fortran_order': False") && header.contains(", 3)"), "{}: {header}", path.display());
    let numbers = bytes[10 + length..].chunks_exact(BYTES).map(|c| number(c.try_into().unwrap()));
    let mut numbers = numbers.collect::<Vec<T>>().into_iter();
    std::iter::from_fn(|| Some([numbers.next()?, numbers.next()?, numbers.next()?])).collect()
}

struct Scene {
    name: String,
    x0: Vec<Vec3>,
    x1: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
}

fn scenes_of(folder: &Path) -> Vec<Scene> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .filter_map(|entry| Some(entry.ok()?.file_name().to_str()?.strip_suffix("_f.npy")?.to_string()))
        .collect();
    names.sort();
    let load = |name: String| {
        let path = |part: &str| folder.join(format!("{name}_{part}.npy"));
        let x = |part: &str| read_npy(&path(part), "'<f8'", f64::from_le_bytes);
        let faces = read_npy(&path("f"), "'<i4'", u32::from_le_bytes);
        Scene { x0: x("t0"), x1: x("t1"), faces, name }
    };
    names.into_iter().map(load).collect()
}

/// Two waved sheets of n x n vertices; the upper one falls through the lower one.
fn sheets(n: usize) -> Scene {
    let mut scene = Scene { name: "sheets".to_string(), x0: vec![], x1: vec![], faces: vec![] };
    for layer in 0..2 {
        let first = (layer * n * n) as u32;
        for k in 0..n * n {
            let (x, y) = ((k / n) as f64 / n as f64, (k % n) as f64 / n as f64);
            let z = 0.03 * (9.0 * x).sin() * (7.0 * y).cos() + 0.005 * layer as f64;
            scene.x0.push([x, y, z]);
            scene.x1.push([x + 0.003 * layer as f64, y, z - 0.008 * layer as f64]);
            if k / n + 1 < n && k % n + 1 < n {
                let (v, w) = (first + k as u32, first + (k + n) as u32);
                scene.faces.extend([[v, w, v + 1], [w, w + 1, v + 1]]);
            }
        }
    }
    scene
}

/// Median CPU seconds of a run.
fn median(repeats: usize, mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..repeats)
        .map(|_| {
            let start = cpu_seconds();
            run();
            cpu_seconds() - start
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[repeats / 2]
}

fn measure(scene: Scene, repeats: usize) {
    let surface = Surface::from_triangles(scene.x0.clone(), scene.faces).unwrap();
    let primitives =
        signorini::detection::Primitives { vertices: &surface.vertices, edges: &surface.edges, faces: &surface.faces };
    let (x0, x1) = (&scene.x0, &scene.x1);
    let mut found = Candidates::default();
    let everything = median(repeats, || {
        let mut tree = BroadPhase::build(&primitives);
        tree.refit(x0, x1, &[], Par::Serial);
        tree.candidates(&|_, _| true, &mut found, Par::Serial);
    });
    let mut tree = BroadPhase::build(&primitives);
    let anew = median(repeats, || {
        tree.rebuild(x0, x1, &[], Par::Serial);
        tree.candidates(&|_, _| true, &mut found, Par::Serial);
    });
    let refit = median(repeats, || tree.refit(x0, x1, &[], Par::Serial));
    let traversal = median(repeats, || tree.candidates(&|_, _| true, &mut found, Par::Serial));
    println!(
        "{{\"name\": \"signorini\", \"part\": \"broad_moving\", \"scene\": \"{}\", \"threads\": 1, \"vertices\": {}, \
         \"faces\": {}, \"cpu_s\": {everything:.5}, \"cpu_s_rebuilt\": {anew:.5}, \"cpu_s_refit\": {refit:.5}, \"cpu_s_traversal\": {traversal:.5}, \
         \"fv\": {}, \"ee\": {}}}",
        scene.name,
        x0.len(),
        surface.faces.len(),
        found.vertex_face.len(),
        found.edge_edge.len()
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let repeats = arguments.get(1).and_then(|r| r.parse().ok()).unwrap_or(21);
    let scenes = match arguments.first() {
        Some(folder) => scenes_of(Path::new(folder)),
        None => vec![sheets(100)],
    };
    for scene in scenes {
        measure(scene, repeats);
    }
}
