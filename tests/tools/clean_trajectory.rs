//! `ci/clean-trajectory IN OUT [options]`

use super::{Answer, empty_folder, run};
use std::path::{Path, PathBuf};

/// Frames that a penalty method recorded: cloth through itself and through the ground.
fn folding() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/trajectories/folding")
}

/// Names of the OBJ files of a folder, in order.
fn frames(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().into_string().expect("text")).collect();
    names.retain(|name| name.ends_with(".obj"));
    names.sort();
    names
}

fn vertices(path: &Path) -> Vec<[f64; 3]> {
    let text = std::fs::read_to_string(path).expect("a frame");
    let row = |line: &str| {
        let mut words = line.split_whitespace().skip(1).map(|w| w.parse().expect("a number"));
        [0; 3].map(|_| words.next().expect("three numbers"))
    };
    text.lines().filter(|line| line.starts_with("v ")).map(row).collect()
}

/// Lines that are no vertices.
fn rest(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).expect("a frame");
    text.lines().filter(|line| !line.starts_with("v ")).map(String::from).collect()
}

fn clean(folder: &Path, source: &str, options: &[&str]) -> Answer {
    run("clean-trajectory", folder, &[&[source, "out", "--thickness", "0.004"], options].concat())
}

/// The certificate of all frames of `out`, by a program of its own.
fn certify(folder: &Path) -> Answer {
    let names: Vec<String> = frames(&folder.join("out")).iter().map(|name| format!("out/{name}")).collect();
    run("certify", folder, &names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The cells of a row of the answer.
fn cells(answer: &Answer, name: &str) -> Vec<f64> {
    let row =
        answer.out.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name}: {}", answer.out));
    row.split(',').skip(1).map(|cell| cell.parse().expect("a number")).collect()
}

#[test]
fn what_was_recorded_crossing_comes_out_clean_in_every_mode() {
    let source = folding();
    let names = frames(&source);
    let mut distances = Vec::new();
    for options in [&["--mode", "position"][..], &["--return", "0.1"], &["--return", "inf", "--single"]] {
        let folder = empty_folder("clean folding");
        let answer = clean(&folder, &source.to_string_lossy(), &[&["--scripted", "ground"], options].concat());
        assert_eq!(answer.status, 0, "{options:?}: {}{}", answer.out, answer.errors);
        assert_eq!(frames(&folder.join("out")), names);
        let certificate = certify(&folder);
        assert_eq!(certificate.status, 0, "{options:?}: {}", certificate.out);
        let crossing = names.iter().filter(|name| cells(&answer, name)[0] > 0.0).count();
        assert!(crossing >= 8, "the recording crosses: {crossing}");
        let mut worst: f64 = 0.0;
        for (i, name) in names.iter().enumerate() {
            let (mut recorded, end) = (vertices(&source.join(name)), vertices(&folder.join("out").join(name)));
            let rounded = |x: &[f64; 3]| x.map(|c| f64::from(c as f32));
            if options.contains(&"--single") {
                recorded.iter_mut().for_each(|x| *x = rounded(x));
                assert!(end.iter().all(|x| rounded(x) == *x), "{name}: no single precision numbers");
            }
            assert_eq!(rest(&source.join(name)), rest(&folder.join("out").join(name)), "everything else stays");
            assert_eq!(recorded.len(), end.len());
            assert!(recorded[256..] == end[256..], "scripted vertices are where they were recorded");
            let off = recorded.iter().zip(&end).map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
            let off = off.fold(0.0, f64::max);
            let said = cells(&answer, name)[8];
            assert!((off - said).abs() <= 1e-3 * off + 1e-30, "{name}: {off} {said}");
            assert!(i > 0 || off == 0.0, "the first frame is clean and stays: {off}");
            worst = worst.max(off);
        }
        assert!(worst < 0.15, "{options:?}: a cloth of a metre is off by {worst}");
        distances.push(worst);
    }
    assert!(distances[0] < distances[2], "positions are followed more closely than displacements: {distances:?}");
}

#[test]
fn frames_before_the_first_clean_one_are_worked_out_backwards() {
    let (folder, source) = (empty_folder("clean backwards"), folding());
    let names = frames(&source);
    std::fs::create_dir(folder.join("in")).expect("a folder");
    for (a, b) in names.iter().zip(names.iter().rev()) {
        std::fs::copy(source.join(a), folder.join("in").join(b)).expect("a copy");
    }
    let answer = clean(&folder, "in", &["--scripted", "ground"]);
    assert_eq!(answer.status, 0, "{}{}", answer.out, answer.errors);
    assert_eq!(certify(&folder).status, 0);
    assert_eq!(frames(&folder.join("out")), names);
    let start = names.iter().find(|name| cells(&answer, name)[0] == 0.0).expect("a clean frame");
    assert!(start > &names[0], "there are crossing frames before the first clean one");
    assert!(vertices(&folder.join("in").join(start)) == vertices(&folder.join("out").join(start)));
}

/// A triangle that pierces another, as two objects, and the same apart.
fn pierced(height: f64) -> String {
    let at = |z: f64| height + z;
    format!(
        "o a\nv 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\no b\nv 0.25 0.25 {}\nv 0.25 0.25 {}\nv 0.75 0.25 {}\nf 4 5 6\n",
        at(-1.0),
        at(1.0),
        at(1.0)
    )
}

fn written(folder: &str, files: &[(&str, String)]) -> PathBuf {
    let folder = empty_folder(folder);
    std::fs::create_dir(folder.join("in")).expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.join(name), text).expect("written");
    }
    folder
}

#[test]
fn where_no_frame_is_clean_a_clean_mesh_is_asked_for() {
    let files =
        [("in/1.obj", pierced(0.0)), ("in/2.obj", pierced(0.1)), ("rest.obj", pierced(1.5)), ("bad.obj", pierced(0.2))];
    let folder = written("clean nowhere", &files);
    let answer = clean(&folder, "in", &[]);
    assert!(answer.status == 2 && answer.errors.contains("give such a mesh by --rest"), "{}", answer.errors);
    assert!(frames(&folder).len() == 2 && !folder.join("out").exists(), "nothing is written");
    let answer = clean(&folder, "in", &["--rest", "bad.obj"]);
    assert!(answer.status == 2 && answer.errors.contains("--rest wants a mesh without"), "{}", answer.errors);
    let answer = clean(&folder, "in", &["--rest", "rest.obj"]);
    assert_eq!(answer.status, 0, "{}{}", answer.out, answer.errors);
    assert_eq!(certify(&folder).status, 0);
}

#[test]
fn scripts_that_leave_no_room_are_said() {
    let files = [("in/1.obj", pierced(1.5)), ("in/2.obj", pierced(0.0))];
    let folder = written("clean pinched", &files);
    let answer = clean(&folder, "in", &["--scripted", "a", "--scripted", "b"]);
    // Nothing is free: what scripts alone do is not judged.
    assert_eq!(answer.status, 0, "{}{}", answer.out, answer.errors);
    let plate = |z: f64| format!("v -1 -1 {z}\nv 1 -1 {z}\nv 1 1 {z}\nv -1 1 {z}\n");
    let frame = |gap: f64| {
        let middle = "o cloth\nv -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0 0.5 0\nf 1 2 3\n";
        format!("{middle}o lower\n{}f 4 5 6 7\no upper\n{}f 8 9 10 11\n", plate(-gap), plate(gap))
    };
    let folder =
        written("clean pinched", &[("in/1.obj", frame(0.5)), ("in/2.obj", frame(-0.5)), ("in/3.obj", frame(0.4))]);
    let answer = clean(&folder, "in", &["--scripted", "lower", "--scripted", "upper"]);
    assert_eq!(answer.status, 1, "{}{}", answer.out, answer.errors);
    assert!(cells(&answer, "2.obj")[7] < 1.0 && cells(&answer, "3.obj")[7] == 1.0, "{}", answer.out);
    assert_eq!(certify(&folder).status, 0);
}

#[test]
fn what_does_not_fit_is_named() {
    let files = [("in/1.obj", pierced(1.5)), ("in/2.obj", pierced(0.0).replace("v 2 0 0\n", ""))];
    let folder = written("clean broken", &files);
    let said = |options: &[&str], message: &str| {
        let answer = clean(&folder, "in", options);
        assert!(answer.status == 2 && answer.errors.contains(message), "{message}: {}", answer.errors);
    };
    said(&[], "2.obj");
    said(&["--scripted", "c"], "no object is named c; there are: a, b");
    said(&["--density", "a=0"], "--density: 0 is not above 0");
    said(&["--mode", "sideways"], "there is no mode sideways");
    said(&["--thickness"], "--thickness needs a value");
    said(&["--loud"], "there is no option --loud");
    let answer = run("clean-trajectory", &folder, &["nowhere", "out"]);
    assert!(answer.status == 2 && answer.errors.contains("nowhere"), "{}", answer.errors);
    assert!(run("clean-trajectory", &folder, &[]).errors.contains("usage: "));
}
