//! `ci/certify FILE.obj...`

use super::{Answer, empty_folder, run};

/// Two triangles side by side.
const CLEAN: &str = "# a comment\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 0 1\nf 1 2 3\nf 2/1/1 4//1 -2\n";
/// An upright triangle, one of whose edges pierces a flat one at (1/4, 1/4, 0), another of them at (1/2, 1/4, 0).
const PIERCED: &str = "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0.25 0.25 -1\nv 0.25 0.25 1\nv 0.75 0.25 1\nf 1 2 3\nf 4 5 6\n";
/// A quad that is cut into two triangles, and a triangle that touches it in one point: exactly a touch, nothing more.
const TOUCHING: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.25 0\nv 0.5 0 1\nv 0.5 1 1\nf 1 2 3 4\nf 5 6 7\n";
/// The same, a denormal number above.
const ABOVE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.25 5e-324\nv 0.5 0 1\nv 0.5 1 1\nf 1 2 3 4\nf 5 6 7\n";

/// Writes the files and runs the script on them.
fn certify(folder: &str, files: &[(&str, &str)]) -> Answer {
    let folder = empty_folder(folder);
    for (name, text) in files {
        std::fs::write(folder.join(name), text).expect("written");
    }
    // Names relative to where the user stands.
    run("certify", &folder, &files.iter().map(|(name, _)| *name).collect::<Vec<_>>())
}

#[test]
fn clean_meshes_pass() {
    let answer = certify("certify clean", &[("a mesh.obj", CLEAN), ("above.obj", ABOVE)]);
    assert_eq!(answer.status, 0, "{}{}", answer.out, answer.errors);
    let lines: Vec<&str> = answer.out.lines().collect();
    assert_eq!(lines.len(), 2, "{}", answer.out);
    assert!(lines[0].ends_with("a mesh.obj: 4 vertices, 2 faces, 0 intersections"), "{}", answer.out);
    assert!(lines[1].ends_with("above.obj: 7 vertices, 3 faces, 0 intersections"), "{}", answer.out);
}

#[test]
fn intersections_are_shown_with_witnesses() {
    let answer = certify("certify pierced", &[("pierced.obj", PIERCED)]);
    assert_eq!((answer.status, answer.errors.as_str()), (1, ""));
    let lines: Vec<&str> = answer.out.lines().collect();
    assert!(lines[0].ends_with("pierced.obj: 6 vertices, 2 faces, 2 intersections"), "{}", answer.out);
    let mut witnesses = lines[1..].to_vec();
    witnesses.sort_unstable();
    let wanted = ["  edge 4-5 and face 1 at 0.25 0.25 0", "  edge 4-6 and face 1 at 0.5 0.25 0"];
    assert_eq!(witnesses, wanted, "{}", answer.out);
}

#[test]
fn a_touch_counts() {
    let answer = certify("certify touching", &[("touching.obj", TOUCHING)]);
    assert_eq!(answer.status, 1, "{}{}", answer.out, answer.errors);
}

#[test]
fn one_bad_mesh_of_several_decides_the_status() {
    let answer = certify("certify several", &[("a.obj", CLEAN), ("b.obj", PIERCED), ("c.obj", CLEAN)]);
    assert_eq!(answer.status, 1);
    let counts: Vec<&str> = answer.out.lines().filter_map(|l| l.rsplit_once(", ").map(|p| p.1)).collect();
    assert_eq!(counts, ["0 intersections", "2 intersections", "0 intersections"], "{}", answer.out);
}

#[test]
fn what_cannot_be_read_is_named_with_its_line() {
    let broken: [(&str, String, &str); 6] = [
        ("number.obj", CLEAN.replace("v 1 1 0", "v 1 one 0"), "number.obj:5: 'one' is not a number"),
        ("short.obj", CLEAN.replace("v 1 1 0", "v 1 1"), "short.obj:5: a vertex needs three coordinates"),
        ("far.obj", CLEAN.replace("f 1 2 3", "f 1 2 9"), "far.obj:7:"),
        ("zero.obj", CLEAN.replace("f 1 2 3", "f 0 2 3"), "zero.obj:7: '0' is not a vertex"),
        ("corners.obj", CLEAN.replace("f 1 2 3", "f 1 2"), "corners.obj:7: a face needs three vertices"),
        ("infinite.obj", CLEAN.replace("v 1 1 0", "v 1 inf 0"), "infinite.obj:"),
    ];
    for (name, text, message) in &broken {
        // The others are certified all the same.
        let answer = certify("certify broken", &[(name, text), ("clean.obj", CLEAN), ("pierced.obj", PIERCED)]);
        assert_eq!(answer.status, 2, "{name}: {}{}", answer.out, answer.errors);
        assert!(answer.errors.contains(message), "{name}: {}", answer.errors);
        assert!(answer.out.contains("clean.obj: 4 vertices, 2 faces, 0 intersections"), "{name}: {}", answer.out);
        assert!(answer.out.contains("pierced.obj: 6 vertices, 2 faces, 2 intersections"), "{name}: {}", answer.out);
    }
    let nothing = run("certify", &empty_folder("certify nothing"), &["missing.obj"]);
    assert!(nothing.status == 2 && nothing.errors.contains("missing.obj"), "{}", nothing.errors);
    assert_eq!(run("certify", &empty_folder("certify nothing"), &[]).status, 2);
}
