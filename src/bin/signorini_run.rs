//! Runs a scene file: `signorini-run SCENE.toml [options]`. See docs/runner.md.

use indicatif::{ProgressBar, ProgressStyle};
use signorini::scene::{Failure, Options, run};
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const USAGE: &str = "usage: signorini-run SCENE.toml [options]
  --method NAME      contact method in place of the scene's: implicit, filter
  --fail-safe NAME   unilateral_projection, inelastic_projection, rigid_zone
  --two-pass         answer scripts first, then all others: a baseline of the filter
  --passes N         passes of the filter's impulses; 0: its zones answer alone what its springs leave
  --friction MU      friction coefficient of every body
  --steps N          stop after step N
  --threads N        worker threads (the results do not depend on it)
  --out DIR          write frames, animation.usda, stats.csv, report.json, last.snapshot
  --json             print the report as one line of JSON
  --resume SNAPSHOT  go on from a snapshot of the same scene
  --jitter SEED      move the starts a little, by the numbers of SEED
  --subdivide N      write finer frames too: N levels of Loop's subdivision, kept clean
status: 0 done, 1 a bound was broken or a step refused, 2 bad input, 130 interrupted";

/// Status of a process that was stopped by Ctrl-C.
const INTERRUPTED: u8 = 130;

struct Choice {
    options: Options,
    json: bool,
}

fn parse() -> Result<Option<Choice>, lexopt::Error> {
    use lexopt::prelude::*;
    let mut choice = Choice { options: Options::default(), json: false };
    let mut scene = None;
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        let options = &mut choice.options;
        match argument {
            Long("method") => options.method = Some(parser.value()?.string()?),
            Long("fail-safe") => options.fail_safe = Some(parser.value()?.string()?),
            Long("two-pass") => options.two_pass = true,
            Long("passes") => options.passes = Some(parser.value()?.parse()?),
            Long("friction") => options.friction = Some(parser.value()?.parse()?),
            Long("steps") => options.steps = Some(parser.value()?.parse()?),
            Long("threads") => options.threads = parser.value()?.parse()?,
            Long("out") => options.out = Some(parser.value()?.into()),
            Long("json") => choice.json = true,
            Long("resume") => options.resume = Some(parser.value()?.into()),
            Long("subdivide") => options.subdivide = parser.value()?.parse()?,
            Long("jitter") => options.jitter = parser.value()?.parse()?,
            Short('h') | Long("help") => return Ok(None),
            Value(value) if scene.is_none() => scene = Some(value),
            _ => return Err(argument.unexpected()),
        }
    }
    choice.options.scene = scene.ok_or("no scene file given")?.into();
    Ok(Some(choice))
}

/// A bar with the time left on a terminal, nothing elsewhere.
fn progress() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(0);
    match ProgressStyle::with_template("{bar:40} step {pos} of {len}, {per_sec}, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

fn main() -> ExitCode {
    let choice = match parse() {
        Ok(Some(choice)) => choice,
        Ok(None) => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprintln!("signorini-run: {error}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    if let Err(error) = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed)) {
        eprintln!("signorini-run: interrupts are not caught: {error}");
    }
    let bar = progress();
    let outcome = run(&choice.options, &mut |step, last| {
        bar.set_length(last);
        bar.set_position(step);
        !stop.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    match outcome {
        Ok(finished) => {
            // The run is done whether or not somebody still reads.
            let _ = writeln!(std::io::stdout(), "{}", if choice.json { &finished.json } else { &finished.summary });
            for bound in &finished.broken {
                eprintln!("bound broken: {bound}");
            }
            if finished.interrupted {
                let left = finished.snapshot.map_or(String::new(), |path| path.display().to_string());
                eprintln!("interrupted; go on with --resume {left}");
                return ExitCode::from(INTERRUPTED);
            }
            if finished.broken.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(failure) => {
            eprintln!("signorini-run: {failure}");
            match failure {
                Failure::Step(..) => ExitCode::FAILURE,
                _ => ExitCode::from(2),
            }
        }
    }
}
