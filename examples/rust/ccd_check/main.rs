//! Runs continuous detection on every query file of a folder and compares with the exact answers stored in them.
//!
//! `ccd_check DIR`: for each `NAME.ccdq` one line: queries, hits, false negatives, false alarms, late times, times more
//! than 1e-6 early, mean and worst microseconds. Where `DIR/frames` holds whole-mesh steps (`NAME-t0.ply`,
//! `NAME-t1.ply`, `NAME-vf-hits.csv`, `NAME-ee-hits.csv`), every pair with overlapping swept boxes is tested and the
//! list of hits compared. Exit status 1 on any false negative or late time, 2 on a file that cannot be read.

use signorini::detection::ccd;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

mod mesh_file;
mod query_file;
mod whole_step;

fn paths_with_extension(dir: &Path, extension: &str) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| format!("{}: {e}", dir.display()))?.path();
        if path.extension().is_some_and(|x| x == extension) {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

#[derive(Default)]
struct Tally {
    hits: usize,
    false_negatives: usize,
    false_alarms: usize,
    late: usize,
    early: usize,
    microseconds: f64,
    worst: f64,
}

fn check_file(path: &Path) -> Result<(usize, Tally), String> {
    let file = query_file::read(path)?;
    let detect = if file.edge_edge { ccd::edge_edge::time_of_impact } else { ccd::point_triangle::time_of_impact };
    let mut tally = Tally::default();
    for query in &file.queries {
        // The least of three runs: what the query costs, not what else the machine did meanwhile.
        let mut found = None;
        let mut least = f64::INFINITY;
        for _ in 0..3 {
            let start = Instant::now();
            found = detect(&query.x0, &query.x1, 1.0);
            least = least.min(start.elapsed().as_secs_f64() * 1e6);
        }
        tally.microseconds += least;
        tally.worst = tally.worst.max(least);
        tally.hits += usize::from(query.hit);
        match found {
            None => tally.false_negatives += usize::from(query.hit),
            Some(_) if !query.hit => tally.false_alarms += 1,
            Some(t) => {
                tally.late += usize::from(t > query.toi_lo);
                tally.early += usize::from(t < query.toi_lo - 1e-6);
            }
        }
    }
    Ok((file.queries.len(), tally))
}

fn run(dir: &Path) -> Result<bool, String> {
    let paths = paths_with_extension(dir, "ccdq")?;
    if paths.is_empty() {
        return Err(format!("{}: no .ccdq file", dir.display()));
    }
    println!(
        "{:32} {:>8} {:>7} {:>9} {:>9} {:>6} {:>6} {:>9} {:>9}",
        "file", "queries", "hits", "misses", "alarms", "late", "early", "mean us", "worst us"
    );
    let mut clean = true;
    for path in paths {
        let (count, t) = check_file(&path)?;
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        println!(
            "{name:32} {count:8} {:7} {:9} {:9} {:6} {:6} {:9.3} {:9.1}",
            t.hits,
            t.false_negatives,
            t.false_alarms,
            t.late,
            t.early,
            t.microseconds / count.max(1) as f64,
            t.worst
        );
        clean &= t.false_negatives == 0 && t.late == 0;
    }
    let frames = dir.join("frames");
    if frames.is_dir() {
        for start in paths_with_extension(&frames, "ply")? {
            let stem = start.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            if let Some(name) = stem.strip_suffix("-t0") {
                clean &= whole_step::check(&frames, name)?;
            }
        }
    }
    Ok(clean)
}

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(dir), None) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: ccd_check DIR");
        return ExitCode::from(2);
    };
    match run(Path::new(&dir)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("ccd_check: {message}");
            ExitCode::from(2)
        }
    }
}
