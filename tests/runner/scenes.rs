//! The scenes of `examples/scenes` keep their bounds: the first steps of each, from two starts; with `SIGNORINI_ALL=1` as
//! many steps and starts as an hour has room for. What whole runs came to is in docs/measurements/scenes.md.

use crate::command::{Folder, report};
use std::path::Path;

/// Runs a scene for `short` steps from two starts, or for as many steps and from as many starts as `all` says.
fn check(name: &str, short: u32, all: [u32; 2]) {
    let folder = Folder::new(name);
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes").join(name).with_extension("toml");
    let scene = scene.display().to_string();
    let slow = std::env::var("SIGNORINI_ALL").is_ok_and(|v| v == "1");
    let [starts, steps] = if slow { all } else { [2, short] };
    for seed in 0..starts {
        let (seed, steps) = (seed.to_string(), steps.to_string());
        let line = report(&folder, &[scene.as_str(), "--jitter", &seed, "--steps", &steps]);
        assert_eq!(line["intersections"].as_u64(), Some(0), "{name} {seed}");
        assert!(line["contacts_max"].as_u64() > Some(0), "{name} {seed}: nothing touches");
        println!("{name} {seed}: {line}");
    }
}

macro_rules! scenes {
    ($($name:ident $short:literal, all: $starts:literal x $steps:literal;)*) => {
        $(#[test]
        fn $name() {
            check(stringify!($name), $short, [$starts, $steps]);
        })*

        #[test]
        fn every_scene_is_listed() {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
            let mut found: Vec<String> = std::fs::read_dir(folder)
                .expect("examples/scenes")
                .map(|e| e.expect("an entry").path())
                .filter(|path| path.extension().is_some_and(|e| e == "toml"))
                .map(|path| path.file_stem().expect("a name").to_string_lossy().to_string())
                .collect();
            found.sort();
            let mut listed = vec![$(stringify!($name)),*];
            listed.sort_unstable();
            assert_eq!(found, listed);
        }
    };
}

// Steps by default; starts and steps of all.
scenes! {
    arch 100, all: 10 x 400;
    arch_falling 100, all: 10 x 400;
    bars 100, all: 10 x 100;
    cape 100, all: 3 x 450;
    card_house 100, all: 10 x 400;
    card_pair 100, all: 10 x 400;
    card_pair_sliding 100, all: 10 x 400;
    crumple 25, all: 3 x 150;
    crushed_cylinder 250, all: 10 x 1000;
    drape 35, all: 4 x 300;
    falling_cloth 30, all: 2 x 200;
    falling_cloth_rough 30, all: 2 x 200;
    funnel 12, all: 1 x 150;
    funnel_coarse 25, all: 1 x 500;
    hand 100, all: 3 x 350;
    incline 200, all: 10 x 200;
    incline_sticking 200, all: 10 x 200;
    layered_dress 20, all: 1 x 200;
    layered_dress_six 3, all: 1 x 140;
    letters 12, all: 1 x 100;
    needle 30, all: 4 x 500;
    pile 30, all: 3 x 200;
    ribbon 150, all: 3 x 1000;
    ring_shot 12, all: 4 x 100;
    rolling_sphere 60, all: 10 x 500;
    sheets 30, all: 1 x 300;
    soft_pile 6, all: 2 x 100;
    soft_pile_soft 6, all: 1 x 100;
    soft_pile_stiff 6, all: 1 x 100;
    spot_pressed 20, all: 4 x 300;
    squares_incline 144, all: 10 x 144;
    squares_plane 40, all: 10 x 144;
    stack 60, all: 10 x 300;
    twisted_column 60, all: 2 x 500;
    two_bar 100, all: 10 x 100;
}
