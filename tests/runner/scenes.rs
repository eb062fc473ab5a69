//! The scenes of `examples/scenes` keep their bounds: the first steps of each, from two starts; with `SIGNORINI_ALL=1` the
//! whole of each, from ten.

use crate::command::{Folder, report};
use std::path::Path;

fn check(name: &str, short: u32) {
    let folder = Folder::new(name);
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes").join(name).with_extension("toml");
    let scene = scene.display().to_string();
    let all = std::env::var("SIGNORINI_ALL").is_ok_and(|v| v == "1");
    let short = short.to_string();
    for seed in 0..if all { 10 } else { 2 } {
        let seed = seed.to_string();
        let mut arguments = vec![scene.as_str(), "--jitter", seed.as_str()];
        if !all {
            arguments.extend(["--steps", short.as_str()]);
        }
        let line = report(&folder, &arguments);
        assert_eq!(line["intersections"].as_u64(), Some(0), "{name} {seed}");
        assert!(line["contacts_max"].as_u64() > Some(0), "{name} {seed}: nothing touches");
        println!("{name} {seed}: {line}");
    }
}

macro_rules! scenes {
    ($($name:ident $short:expr,)*) => {
        $(#[test]
        fn $name() {
            check(stringify!($name), $short);
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

scenes! {
    bars 100,
    crumple 25,
    drape 35,
    falling_cloth 30,
    falling_cloth_rough 30,
    incline 200,
    incline_sticking 200,
    layered_dress 20,
    needle 30,
    pile 30,
    ring_shot 12,
    rolling_sphere 60,
    soft_pile 6,
    stack 60,
    twisted_column 60,
    two_bar 100,
}
