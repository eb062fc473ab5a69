//! What a run writes: the final line, OBJ frames, the animated cache.

use crate::command::{Folder, SMALL, report};
use signorini::detection::Primitives;
use signorini::detection::intersection::find;
use signorini::mesh::Surface;
use signorini::parallel::Par;

#[test]
fn the_final_line_has_what_was_promised() {
    let folder = Folder::new("line");
    folder.file("scene.toml", SMALL);
    let line = report(&folder, &["scene.toml", "--out", "out"]);
    for (field, value) in [("scene", "scene"), ("method", "implicit"), ("up", "z")] {
        assert_eq!(line[field], value, "{field}");
    }
    for name in "vertices tets steps dt contacts_max divisions failsafes pinched intersections residual_max threads \
                 bodies not_converged kinetic_energy_end elastic_energy_end bytes_max"
        .split_whitespace()
    {
        assert!(line[name].is_number(), "{name}: {}", line[name]);
    }
    for name in ["mean", "median", "p95", "max"] {
        assert!(line["seconds_per_step"][name].as_f64().is_some_and(|x| x > 0.0), "{name}");
        // Of the processor: counted in ticks of some milliseconds, a short step may have none.
        assert!(line["processor_seconds_per_step"][name].as_f64().is_some_and(|x| x >= 0.0), "{name}");
    }
    for name in ["dynamics", "search", "rows", "solve", "detection", "fail_safe", "certificate", "total"] {
        assert!(line["seconds_by_stage"][name].is_number(), "{name}");
    }
    // Vertices: 100 of the cloth, the two shapes by their files, 20 of the box with 1 x 4 x 1 cells.
    assert_eq!((line["tets"].as_u64(), line["steps"].as_u64(), line["bodies"].as_u64()), (Some(6), Some(40), Some(6)));
    assert_eq!(line["intersections"].as_u64(), Some(0));
    assert_eq!(line["hash"].as_str().map(str::len), Some(16));
    assert_eq!(line["floor"].as_f64(), Some(0.0));

    let rows: Vec<Vec<f64>> = folder
        .read("out/stats.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|word| word.parse().expect("a number")).collect())
        .collect();
    assert_eq!(rows.len(), 40);
    let header = folder.read("out/stats.csv");
    let column =
        |name: &str| header.lines().next().and_then(|h| h.split(',').position(|c| c == name)).expect("a column");
    let most = rows.iter().map(|row| row[column("contacts")]).fold(0.0, f64::max);
    assert_eq!(line["contacts_max"].as_f64(), Some(most));
    assert!(most > 10.0, "something touches: {most}");
    let histogram: u64 =
        line["cmr_rounds_histogram"].as_object().expect("a table").values().filter_map(|n| n.as_u64()).sum();
    assert_eq!(histogram, rows.iter().filter(|row| row[column("contacts")] > 0.0).count() as u64);
    let last = rows.last().expect("rows");
    assert_eq!(line["kinetic_energy_end"].as_f64(), Some(last[column("kinetic_energy")]));
    assert!(last[column("kinetic_energy")] > 0.0 && last[column("elastic_energy")] > 0.0);
}

/// Bodies of an OBJ file: name, positions, faces from 0 over all positions of the file.
pub type Group = (String, Vec<[f64; 3]>, Vec<[u32; 3]>);

pub fn read_obj(text: &str) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[0] {
            "o" => groups.push((words[1].to_string(), Vec::new(), Vec::new())),
            "v" => groups.last_mut().unwrap().1.push([1, 2, 3].map(|k| words[k].parse().unwrap())),
            "f" => groups.last_mut().unwrap().2.push([1, 2, 3].map(|k| words[k].parse::<u32>().unwrap() - 1)),
            other => panic!("{other}"),
        }
    }
    groups
}

#[test]
fn frames_are_certified_by_the_library() {
    let folder = Folder::new("frames");
    folder.file("scene.toml", SMALL);
    report(&folder, &["scene.toml", "--out", "out"]);
    let mut frames: Vec<_> =
        std::fs::read_dir(folder.0.join("out/frames")).unwrap().map(|e| e.unwrap().path()).collect();
    frames.sort();
    // 20 a second over 0.4 s, and the start.
    assert_eq!(frames.len(), 9);
    let mut heights = Vec::new();
    for path in &frames {
        let groups = read_obj(&std::fs::read_to_string(path).unwrap());
        let names: Vec<&str> = groups.iter().map(|g| g.0.as_str()).collect();
        assert_eq!(names, ["paddle", "cloth", "carrier", "ball_0", "ball_1"]);
        assert_eq!(groups[0].1.len(), 20);
        let positions: Vec<[f64; 3]> = groups.iter().flat_map(|g| g.1.iter().copied()).collect();
        let faces = groups.iter().flat_map(|g| g.2.iter().copied()).collect();
        let surface = Surface::from_triangles(positions, faces).unwrap();
        let primitives = Primitives { vertices: &surface.vertices, edges: &surface.edges, faces: &surface.faces };
        assert!(find(&primitives, &surface.rest, &|_, _| true, Par::Serial).is_empty(), "{path:?}");
        heights.push((groups[1].1[0], groups[0].1[0]));
    }
    // The pin stands for 0.1 s, rises by 0.1 m and stands; the paddle moves by 0.09 m and turns by 0.15.
    let rise = |i: usize| heights[i].0[2] - heights[0].0[2];
    assert!(rise(2).abs() < 1e-12 && (rise(4) - 0.05).abs() < 1e-9 && (rise(8) - 0.1).abs() < 1e-9, "{heights:?}");
    let (start, end) = (heights[0].1, heights[8].1);
    let arm = [start[0] + 0.3, start[1]];
    let (s, c) = 0.15f64.sin_cos();
    let expected = [-0.21 + c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]];
    assert!((0..2).all(|k| (end[k] - expected[k]).abs() < 1e-9), "{end:?} {expected:?}");
}

/// The list in brackets after `key`, split at commas, without parentheses.
fn list<'a>(text: &'a str, key: &str) -> Vec<&'a str> {
    let from = text.find(key).unwrap_or_else(|| panic!("no {key}")) + key.len();
    let text = &text[from..];
    let (open, close) = (text.find('[').unwrap(), text.find(']').unwrap());
    text[open + 1..close].split(',').map(|word| word.trim_matches(|c| " ()".contains(c))).collect()
}

#[test]
fn the_animated_cache_reads_back_as_the_frames() {
    let folder = Folder::new("usd");
    folder.file("scene.toml", SMALL);
    report(&folder, &["scene.toml", "--out", "out"]);
    let text = folder.read("out/animation.usda");
    assert!(text.starts_with("#usda 1.0\n"));
    for line in
        ["metersPerUnit = 1", "upAxis = \"Z\"", "timeCodesPerSecond = 20", "startTimeCode = 0", "endTimeCode = 8"]
    {
        assert!(text.lines().any(|l| l.trim() == line), "{line}");
    }
    assert!(!folder.0.join("out/animation.samples").exists());
    let count = |c: char| text.matches(c).count();
    assert_eq!((count('{'), count('('), count('[')), (count('}'), count(')'), count(']')));
    let meshes: Vec<&str> = text.split("    def Mesh ").skip(1).collect();
    for frame in [0u32, 3, 8] {
        let groups = read_obj(&folder.read(&format!("out/frames/frame_{:06}.obj", 5 * frame)));
        assert_eq!(meshes.len(), groups.len());
        let mut first = 0;
        for (mesh, (name, positions, faces)) in meshes.iter().zip(&groups) {
            assert!(mesh.starts_with(&format!("\"{name}\"\n")), "{name}");
            assert_eq!(list(mesh, "faceVertexCounts = "), vec!["3"; faces.len()]);
            let corners: Vec<u32> = list(mesh, "faceVertexIndices = ").iter().map(|w| w.parse().unwrap()).collect();
            let expected: Vec<u32> = faces.iter().flatten().map(|v| v - first).collect();
            assert_eq!(corners, expected);
            let points: Vec<f32> = list(mesh, &format!(" {frame}: ")).iter().map(|w| w.parse().unwrap()).collect();
            let expected: Vec<f32> = positions.iter().flatten().map(|c| *c as f32).collect();
            assert_eq!(points, expected, "{name} at {frame}");
            first += positions.len() as u32;
        }
    }
}

#[test]
fn a_pin_follows_a_scripted_body() {
    let folder = Folder::new("follow");
    let moving = "motion = [{ until = 0.1 }, { until = 0.3, velocity = [0.0, 0.0, 0.5] }] }]";
    folder.file("scene.toml", &SMALL.replace(moving, "follow = \"paddle\" }]"));
    report(&folder, &["scene.toml", "--out", "out"]);
    let at = |frame: &str| {
        let groups = read_obj(&folder.read(&format!("out/frames/{frame}.obj")));
        (groups[1].1[0], groups[0].1.clone())
    };
    let ((pin, paddle), (later, moved)) = (at("frame_000000"), at("frame_000040"));
    // As a part of the paddle, which moves and turns: its distance to every vertex stays.
    let distance = |x: &[f64; 3], y: &[f64; 3]| (0..3).map(|k| (x[k] - y[k]).powi(2)).sum::<f64>().sqrt();
    for (from, to) in paddle.iter().zip(&moved) {
        assert!((distance(&pin, from) - distance(&later, to)).abs() < 1e-9, "{later:?}");
    }
    assert!(later[0] > pin[0] + 0.05);
}

/// Two frames of a square: its left half stays, its right half rises by 0.1 m. All of it turns by a quarter about z.
#[test]
fn frames_are_carried_along_and_pins_follow_their_mean() {
    let folder = Folder::new("carried");
    folder.file("square.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
    let square = [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut bytes: Vec<u8> = [2u32, 4].iter().flat_map(|n| n.to_le_bytes()).collect();
    for rise in [0.0, 0.1] {
        let points = square.iter().flat_map(|x| [x[0], x[1], rise * x[0]]);
        bytes.extend(points.flat_map(f32::to_le_bytes));
    }
    std::fs::write(folder.0.join("square.frames"), bytes).unwrap();
    let scene = r#"
title = "A square that bends and turns"
dt = 0.1
duration = 1.0
gravity = [0.0, 0.0, 0.0]
[output]
frames_per_second = 10.0
[[sheet]]
name = "cloth"
mesh.grid = { cells = [2, 1], size = [1.0, 0.5] }
placement.position = [0.5, 0.5, 0.5]
material = { density = 300.0, thickness = 0.001, young_modulus = 1e3 }
pins = [{ vertices = [0, 2, 4], follow = "square", follow_within = 0.8 }]
[[kinematic]]
name = "square"
mesh.obj.file = "square.obj"
frames = { file = "square.frames", seconds_per_frame = 1.0 }
motion = [{ until = 1.0, angular_velocity = [0.0, 0.0, 1.5707963267948966] }]
"#;
    folder.file("scene.toml", scene);
    report(&folder, &["scene.toml", "--out", "out"]);
    let groups = read_obj(&folder.read("out/frames/frame_000010.obj"));
    let near = |x: [f64; 3], y: [f64; 3]| assert!((0..3).all(|k| (x[k] - y[k]).abs() < 1e-7), "{x:?} {y:?}");
    near(groups[0].1[1], [0.0, 1.0, 0.1]);
    near(groups[0].1[2], [-1.0, 1.0, 0.1]);
    // Within 0.8 of the first pin, at (0, 0.25, 0.5), is one vertex, which stays; of the second, at (0.5, 0.25, 0.5),
    // that one and one that rises, as far; of the third the one that rises.
    near(groups[1].1[0], [-0.25, 0.0, 0.5]);
    near(groups[1].1[2], [-0.25, 0.5, 0.55]);
    near(groups[1].1[4], [-0.25, 1.0, 0.6]);
}
