//! A scene file with a fault is named with its line and field; so is what cannot be read beside it.

use crate::command::{Folder, SMALL, run, text};

/// Line, from 1, of the first that contains `part`.
fn line_of(scene: &str, part: &str) -> usize {
    1 + scene.lines().position(|line| line.contains(part)).unwrap_or_else(|| panic!("no line with {part}"))
}

/// Replaces once, checking that there was something to replace.
fn with(from: &str, to: &str) -> String {
    assert!(SMALL.contains(from), "{from}");
    SMALL.replacen(from, to, 1)
}

#[test]
fn faults_of_scene_files_are_named() {
    let folder = Folder::new("faults");
    // What is changed, a part of the line at fault, the field, a part of the message.
    let cases: &[(&str, &str, &str, &str, &str)] = &[
        ("dt = 0.01", "dt = -0.01", "dt = -0.01", "dt", "positive and finite, not -0.01"),
        ("dt = 0.01", "dt = \"ten\"", "dt = \"ten\"", "dt", "invalid type"),
        ("duration = 0.4", "duration = nan", "duration = nan", "duration", "positive"),
        ("dt = 0.01", "dt = 0.01\ncolour = 3", "colour", "colour", "unknown field"),
        ("title = ", "tilte = ", "tilte", "tilte", "unknown field"),
        (
            "density = 300.0, thickness",
            "density = -3.0, thickness",
            "density = -3",
            "sheet[0].material.density",
            "not -3",
        ),
        (
            "poisson_ratio = 0.3, b",
            "poisson_ratio = 0.5, b",
            "poisson_ratio = 0.5",
            "sheet[0].material.poisson_ratio",
            "0.5",
        ),
        ("young_modulus = 1e4", "youngs = 1e4", "youngs", "solid[0].material.youngs", "unknown field"),
        ("[9, 9], size", "[9, 0], size", "[9, 0]", "sheet[0].mesh.grid.cells", "too few"),
        ("mesh.grid", "mesh.gird", "mesh.gird", "sheet[0].mesh.gird", "unknown variant"),
        (
            "vertices = [0, 9]",
            "vertices = [0, 900]",
            "[0, 900]",
            "sheet[0].pins[0].vertices",
            "no vertex 900 among 100",
        ),
        (
            "until = 0.3, velocity = [0.0, 0.0, 0.5]",
            "until = 0.05",
            "until = 0.05",
            "sheet[0].pins[0].motion[1].until",
            "not after 0.1",
        ),
        ("density = 300.0\nfriction", "density = 0.0\nfriction", "density = 0.0", "rigid[0].density", "positive"),
        ("grid = [2, 1]", "grid = [2, 0]", "grid = [2, 0]", "rigid[0].copies.grid[1]", "at least one"),
        ("[0.02, 0.6, 0.1]", "[0.02, 0.6]", "[0.02, 0.6]", "kinematic[0].mesh.box.size", "invalid length"),
        ("normal = [0.0, 0.0, 2.0]", "normal = [0.0, 0.0, 0.0]", "normal", "half_space[0].normal", "not zero"),
        ("name = \"carrier\"", "name = \"cloth\"", "dummy", "solid[0].name", "'cloth' is taken"),
        ("surface.sphere = { radius = 0.09", "surface.sphere = { radius = 0.9", "[[solid]]", "solid[0]", "outside"),
        (
            "mesh.sphere = { radius = 0.08, tolerance = 0.004 }",
            "mesh.obj.file = \"none.obj\"",
            "none.obj",
            "rigid[0].mesh.obj.file",
            "none.obj: No such file",
        ),
        (
            "mesh.sphere = { radius = 0.08, tolerance = 0.004 }",
            "mesh.obj.file = \"bad.obj\"",
            "bad.obj",
            "rigid[0].mesh.obj.file",
            "bad.obj:2: 'x' is not such a number",
        ),
        (
            "mesh.sphere = { radius = 0.08, tolerance = 0.004 }",
            "mesh.obj.file = \"open.obj\"",
            "open.obj",
            "rigid[0].mesh",
            "not closed",
        ),
        (
            "motion = [{ until = 0.1 }, { until = 0.3, velocity = [0.0, 0.0, 0.5] }] }]",
            "follow = \"nobody\" }]",
            "nobody",
            "sheet[0].pins[0].follow",
            "no kinematic body is named 'nobody'",
        ),
        (
            "mesh.sphere = { radius = 0.08, tolerance = 0.004 }",
            "mesh.revolved = { profile = [[0.0, 0.0], [0.1, 0.1], [0.0, 0.2], [0.1, 0.3]], segments = 8 }",
            "mesh.revolved",
            "rigid[0].mesh.revolved.profile[2]",
            "off the axis",
        ),
        (
            "mesh.sphere = { radius = 0.08, tolerance = 0.004 }",
            "mesh.extruded = { profile = [[0.0, 0.0]], length = 1.0, cells = 2 }",
            "mesh.extruded",
            "rigid[0].mesh.extruded.profile",
            "too few",
        ),
        (
            "duration = 0.4",
            "duration = 0.4\nsettings.method = \"exact\"",
            "exact",
            "settings.method",
            "unknown variant",
        ),
        ("dt = 0.01", "dt = = 1", "dt = = 1", "", ""),
    ];
    folder.file("bad.obj", "v 0 0 0\nv 1 x 0\n");
    folder.file("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (from, to, part, field, message) in cases {
        let scene = with(from, to);
        folder.file("scene.toml", &scene);
        let output = run(&folder, &["scene.toml", "--steps", "1"]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{to}: {said}");
        let line = if *part == "dummy" { line_of(&scene, "[[solid]]") + 1 } else { line_of(&scene, part) };
        // A table stands in the line of its header, or of its first key where the parser says so.
        let at = format!("scene.toml:{line}: ");
        assert!(said.contains(&at), "{to}: wanted {at}, got {said}");
        assert!(said.contains(&format!("{at}{field}")) && said.contains(message), "{to}: {said}");
        assert_eq!(text(&output.stdout), "");
    }
}

#[test]
fn faults_of_the_command_line_are_named() {
    let folder = Folder::new("usage");
    folder.file("scene.toml", SMALL);
    folder.file("bad.snapshot", "SGNRUN");
    for (arguments, message) in [
        (&["scene.toml", "--method", "explicit"][..], "'explicit'"),
        (&["scene.toml", "--fail-safe", "hope"], "there is no fail-safe 'hope'"),
        (&["scene.toml", "--friction", "-1"], "friction: finite and not negative"),
        (&["scene.toml", "--steps", "many"], "many"),
        (&["scene.toml", "--colour"], "--colour"),
        (&["scene.toml", "other.toml"], "other.toml"),
        (&[], "no scene file"),
        (&["none.toml"], "none.toml"),
        (&["scene.toml", "--resume", "none.snapshot"], "none.snapshot"),
        (&["scene.toml", "--resume", "bad.snapshot"], "not a snapshot"),
        (&["scene.toml", "--out", "scene.toml/below"], "scene.toml/below"),
    ] {
        let output = run(&folder, arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(message), "{arguments:?}: {said}");
    }
    assert!(text(&run(&folder, &["--help"]).stdout).contains("--resume"));
}

#[test]
fn a_start_that_intersects_is_refused_and_a_broken_bound_is_named() {
    let folder = Folder::new("refused");
    folder.file("scene.toml", &with("placement.position = [0.0, 0.0, 0.45]", "placement.position = [0.0, 0.0, 0.3]"));
    let output = run(&folder, &["scene.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("step 1: the start state intersects"), "{}", text(&output.stderr));

    let bounds = "[bounds]\ncontacts_max = 0\nkinetic_energy_end_max = 0.0\n[[bounds.body]]\nname = \"ball\"\n\
                  direction = [0.0, 0.0, 1.0]\ntravel_min = 1.0\n[[sheet]]";
    folder.file("scene.toml", &with("[[sheet]]", bounds));
    let output = run(&folder, &["scene.toml"]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    for name in ["contacts_max", "kinetic_energy_end_max", "ball travel_min"] {
        assert!(said.contains(&format!("bound broken: {name}: ")), "{said}");
    }
    // Short of the end, bounds on the end do not count.
    let said = text(&run(&folder, &["scene.toml", "--steps", "1"]).stderr);
    assert!(!said.contains("travel_min"), "{said}");
}
