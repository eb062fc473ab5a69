//! The figures of [Otaduy09, §6]: rows of numbers that `benches/figures.py` draws.
//!
//! `cargo bench --bench figures -- anticipation OUT.csv [across=4] [layers=10] [steps=120] [every=10] [contacts=6000]
//! [friction=0]`: soft boxes fall into a container with iterative anticipation; every N-th step with at most that many
//! contacts is also done from the same state with full anticipation.
//!
//! `cargo bench --bench figures -- ablation OUT.csv [steps=N]`: the scenes with parts of the method left out.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
mod support;

use signorini::model::{Ablation, Settings, SolverChoice, StepReport};
use signorini::parallel::Par;
use std::io::Write;
use support::boxes::BOX_VERTICES;
use support::host::{Host, quantile};
use support::scenes;

fn main() {
    // Cargo adds `--bench`.
    let words: Vec<String> = std::env::args().skip(1).filter(|w| !w.starts_with("--")).collect();
    let number = |name: &str, otherwise: f64| {
        let given = words.iter().find_map(|w| w.strip_prefix(name)?.strip_prefix('='));
        given.map_or(otherwise, |value| value.parse().expect("a number"))
    };
    match words.as_slice() {
        [kind, out, ..] if kind == "anticipation" => anticipation(out, &number),
        [kind, out, ..] if kind == "ablation" => ablation(out, number("steps", 0.0) as usize),
        _ => println!("usage: cargo bench --bench figures -- anticipation|ablation OUT.csv [name=number...]"),
    }
}

/// Lines of a file, flushed one by one: a run that is cut off keeps what it has.
struct Table(std::fs::File);

impl Table {
    fn new(path: &str, header: &str) -> Table {
        let mut table = Table(std::fs::File::create(path).expect("a writable file"));
        table.row(header);
        table
    }

    fn row(&mut self, line: &str) {
        writeln!(self.0, "{line}").expect("a writable file");
    }
}

fn anticipation(out: &str, number: &dyn Fn(&str, f64) -> f64) {
    let whole = |name: &str, otherwise: f64| number(name, otherwise) as usize;
    let (every, contacts_max) = (whole("every", 10.0), number("contacts", 6000.0) as u32);
    let across = whole("across", 4.0);
    let mut host = scenes::boxes(across, whole("layers", 10.0), 1);
    // Layers as far apart as a box is long: among so many, some would overlap.
    for (vertex, x) in host.state.positions.iter_mut().enumerate() {
        x[2] += 0.06 * (vertex / BOX_VERTICES / (across * across)) as f64;
    }
    host.model.materials.list.iter_mut().for_each(|m| m.friction_coefficient = number("friction", 0.0));
    let columns = "seconds,contacts,rounds,iterations,not_converged";
    let mut table = Table::new(out, &format!("step,dt,method,{columns}"));
    let line = |step: usize, dt: f64, method: &str, seconds: f64, r: &StepReport| {
        let missed = u32::from(r.not_converged);
        format!("{step},{dt},{method},{seconds},{},{},{},{missed}", r.contacts, r.rounds, r.iterations)
    };
    let with = |solver: SolverChoice, s: &Settings| Settings { solver, ..*s };
    host.settings = with(SolverChoice::IterativeAnticipation, &host.settings);
    // Full anticipation solves systems once a row: contacts, not iterations, are what it costs.
    let mut last = 0;
    for step in 0..whole("steps", 120.0) {
        if step % every == every - 1 && last > 0 && last <= contacts_max {
            let settings = with(SolverChoice::FullAnticipation, &host.settings);
            host.prepare();
            if let Ok((seconds, report)) = host.step_of_a_copy(&settings, Par::Serial) {
                table.row(&line(step, host.dt, "full", seconds, &report));
            }
        }
        let facts = match host.step(Par::Serial) {
            Ok(facts) => facts,
            Err(error) => panic!("step {step}: {error:?}"),
        };
        last = facts.report.contacts;
        table.row(&line(step, host.dt, "iterative", facts.seconds, &facts.report));
        println!("{step}: {last} contacts, {:.3} s", facts.seconds);
    }
}

fn ablation(out: &str, steps: usize) {
    let whole = Ablation::default();
    let paper = SolverChoice::IterativeAnticipation;
    let cases = [
        ("nothing left out", SolverChoice::Automatic, whole),
        ("no near contacts", SolverChoice::Automatic, Ablation { near_contacts: false, ..whole }),
        ("no position level", SolverChoice::Automatic, Ablation { position_level: false, ..whole }),
        ("three repeats", paper, whole),
        ("one repeat", paper, Ablation { repeats: 1, ..whole }),
    ];
    let mut table = Table::new(
        out,
        "scene,case,steps,touching,within_three,rounds_mean,divided,fail_safes,not_converged,intersections,seconds_median,\
         seconds_p95,contacts_max,gap_mean,gap_least,iterations_mean",
    );
    let scene = |name: &str| match name {
        "drape" => scenes::drape(50, 0),
        "crumple" => scenes::crumple(50, 0),
        _ => scenes::boxes(2, 5, 0),
    };
    for (name, usual) in [("drape", 150), ("crumple", 120), ("boxes", 80)] {
        for (case, solver, ablation) in cases {
            let mut host = scene(name);
            host.settings = Settings { solver, ablation, ..host.settings };
            let row = measured(&mut host, if steps > 0 { steps } else { usual });
            println!("{name}, {case}: {row}");
            table.row(&format!("{name},{case},{row}"));
        }
    }
}

fn measured(host: &mut Host, steps: usize) -> String {
    let thickness = 2.0 * host.model.bodies[0].half_thickness;
    let (mut reports, mut seconds): (Vec<StepReport>, Vec<f64>) = (Vec::new(), Vec::new());
    let (mut gaps, mut pushing, mut least) = (0.0, 0usize, f64::INFINITY);
    for _ in 0..steps {
        match host.step(Par::Serial) {
            Ok(facts) => {
                reports.push(facts.report);
                seconds.push(facts.seconds);
            }
            Err(error) => {
                println!("refused: {error:?}");
                break;
            }
        }
        for contact in host.result.contacts.iter().filter(|c| c.state != 0) {
            gaps += contact.distance / thickness;
            least = least.min(contact.distance / thickness);
            pushing += 1;
        }
    }
    let touching: Vec<&StepReport> = reports.iter().filter(|r| r.contacts > 0).collect();
    let count = |f: &dyn Fn(&StepReport) -> bool| reports.iter().filter(|r| f(r)).count();
    let share = |sum: f64| sum / touching.len().max(1) as f64;
    let within = touching.iter().filter(|r| r.rounds.div_ceil(r.parts.max(1)) <= 3).count();
    format!(
        "{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
        reports.len(),
        touching.len(),
        share(within as f64),
        share(touching.iter().map(|r| f64::from(r.rounds)).sum()),
        count(&|r| r.parts > 1),
        count(&|r| r.zones() + r.held_vertices > 0),
        count(&|r| r.not_converged),
        count(&|r| r.intersections.unwrap_or(0) > 0),
        quantile(&mut seconds, 0.5),
        quantile(&mut seconds, 0.95),
        reports.iter().map(|r| r.contacts).max().unwrap_or(0),
        gaps / pushing.max(1) as f64,
        least,
        share(touching.iter().map(|r| f64::from(r.iterations)).sum()),
    )
}
