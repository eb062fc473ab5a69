//! A run that is stopped, by its number of steps or by a signal, goes on with the same bits.

use crate::command::{Folder, SMALL, command, report, text};
use std::process::Stdio;

/// The columns that do not measure time.
fn facts(csv: &str) -> Vec<String> {
    let columns: Vec<&str> = csv.lines().next().expect("a header").split(',').collect();
    let first = columns.iter().position(|c| *c == "seconds").expect("the first column of times");
    csv.lines().map(|line| line.split(',').take(first).collect::<Vec<_>>().join(",")).collect()
}

#[test]
fn a_resumed_run_has_the_same_bits_and_files() {
    let folder = Folder::new("resume");
    folder.file("scene.toml", SMALL);
    let whole = report(&folder, &["scene.toml", "--out", "whole"]);
    let half = report(&folder, &["scene.toml", "--out", "half", "--steps", "17"]);
    assert_ne!(whole["hash"], half["hash"]);
    let resumed = report(&folder, &["scene.toml", "--out", "half", "--resume", "half/last.snapshot", "--threads", "2"]);
    assert_eq!(whole["hash"], resumed["hash"]);
    for name in ["steps", "steps_counted", "contacts_max", "cmr_rounds_histogram", "residual_max", "frames"] {
        assert_eq!(whole[name], resumed[name], "{name}");
    }
    assert_eq!(facts(&folder.read("whole/stats.csv")), facts(&folder.read("half/stats.csv")));
    assert_eq!(folder.read("whole/animation.usda"), folder.read("half/animation.usda"));
    assert_eq!(folder.read("whole/frames/frame_000040.obj"), folder.read("half/frames/frame_000040.obj"));
    assert_eq!(folder.read("whole/frames/frame_000020.obj"), folder.read("half/frames/frame_000020.obj"));

    // Elsewhere, without the rows of the first part, the state is the same and the figures are over the rest.
    let apart = report(&folder, &["scene.toml", "--out", "apart", "--resume", "half/last.snapshot"]);
    assert_eq!((apart["hash"].clone(), apart["steps_counted"].as_u64()), (whole["hash"].clone(), Some(0)));

    // A snapshot belongs to its scene.
    folder.file("other.toml", &SMALL.replace("0.45]", "0.46]"));
    let output = crate::command::run(&folder, &["other.toml", "--resume", "half/last.snapshot"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("another scene"), "{}", text(&output.stderr));
}

#[test]
fn jitter_and_threads() {
    let folder = Folder::new("jitter");
    folder.file("scene.toml", SMALL);
    let hash = |extra: &[&str]| report(&folder, &[&["scene.toml", "--steps", "20"], extra].concat())["hash"].clone();
    assert_eq!(hash(&[]), hash(&["--threads", "2"]));
    assert_eq!(hash(&["--jitter", "3"]), hash(&["--jitter", "3"]));
    assert_ne!(hash(&[]), hash(&["--jitter", "3"]));
    assert_ne!(hash(&["--jitter", "4"]), hash(&["--jitter", "3"]));
}

/// The velocity filter by its name: another motion, as clean, and resumed with the same bits; the method is part of the
/// run.
#[test]
fn the_filter_runs_and_goes_on_with_the_same_bits() {
    let folder = Folder::new("filter");
    folder.file("scene.toml", &SMALL.replace("[output]", "[settings]\nrestitution = 0.4\n\n[output]"));
    let filter = ["scene.toml", "--method", "filter"];
    let run = |more: &[&str]| report(&folder, &[&filter[..], more].concat());
    let whole = run(&[]);
    assert_eq!((whole["method"].as_str(), whole["intersections"].as_u64()), (Some("filter"), Some(0)));
    assert!(whole["contacts_max"].as_u64() > Some(10), "{whole}");
    assert_ne!(whole["hash"], report(&folder, &["scene.toml"])["hash"]);
    run(&["--out", "half", "--steps", "17"]);
    assert_eq!(run(&["--resume", "half/last.snapshot", "--threads", "2"])["hash"], whole["hash"]);
    let output = crate::command::run(&folder, &["scene.toml", "--resume", "half/last.snapshot"]);
    assert!(text(&output.stderr).contains("another scene file, method"), "{}", text(&output.stderr));
    folder.file("bad.toml", &SMALL.replace("[output]", "[settings]\nrestitution = 1.4\n\n[output]"));
    let output = crate::command::run(&folder, &["bad.toml"]);
    assert!(text(&output.stderr).contains("settings.restitution"), "{}", text(&output.stderr));
}

#[test]
fn an_interrupt_leaves_a_snapshot_to_go_on_from() {
    let folder = Folder::new("interrupt");
    // As long as it takes: it is stopped when the third frame is there.
    folder.file("scene.toml", &SMALL.replace("duration = 0.4", "duration = 4000.0"));
    let mut child = command(&folder.0, &["scene.toml", "--out", "out", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the runner starts");
    let third = folder.0.join("out/frames/frame_000010.obj");
    let began = std::time::Instant::now();
    while !third.exists() {
        assert!(began.elapsed().as_secs() < 60, "no frames");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130));
    let stopped: serde_json::Value = serde_json::from_str(&folder.read("out/report.json")).expect("JSON");
    assert_eq!(stopped["interrupted"], true);
    let step = stopped["steps"].as_u64().expect("a number");
    assert!((10..400_000).contains(&step), "{step}");

    let goal = (step + 5).to_string();
    let resumed =
        report(&folder, &["scene.toml", "--out", "out", "--resume", "out/last.snapshot", "--steps", goal.as_str()]);
    let whole = report(&folder, &["scene.toml", "--steps", goal.as_str()]);
    assert_eq!(resumed["hash"], whole["hash"]);
    assert_eq!(resumed["steps_counted"], whole["steps_counted"]);
}
