//! Who may import whom: downwards only, never sideways.

use crate::File;

const LAYERS: &[&[&str]] = &[
    &["parallel", "math"],
    &["geometry", "linalg"],
    &["mesh"],
    &["energy", "detection", "kinematics"],
    &["model"],
    &["dynamics", "contact_search"],
    &["constraint"],
    &["fail_safe"],
    &["step"],
    &["implicit_contact", "velocity_filter", "asynchronous_contact"],
    &["world"],
    &["scene", "capi"],
    &["bin"],
];

/// Layer of a top module.
pub fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|row| row.contains(&module))
}

/// Top modules that a file names through `crate::` or through `super::` up to the crate.
fn named_modules(file: &File) -> Vec<(usize, String)> {
    let depth = file.path.matches('/').count(); // src/a/b.rs is two deep
    let depth = if file.path.ends_with("/mod.rs") { depth - 1 } else { depth };
    let mut prefixes = vec!["crate::".to_string()];
    for inner in 0..3 {
        // A test module inside the file adds one level or more.
        prefixes.push("super::".repeat(depth + inner));
    }
    let mut found = Vec::new();
    for (number, line) in file.text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        for (p, prefix) in prefixes.iter().enumerate() {
            for (at, _) in code.match_indices(prefix.as_str()) {
                let preceded = code[..at].ends_with("super::") || code[..at].ends_with("$");
                if preceded && p > 0 {
                    continue;
                }
                let rest = &code[at + prefix.len()..];
                let group = rest.strip_prefix('{').map(|g| g.split(',').collect()).unwrap_or(vec![rest]);
                for item in group {
                    let name: String = item.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    if p == 0 || layer(&name).is_some() {
                        found.push((number + 1, name));
                    }
                }
            }
        }
    }
    found
}

/// Imports of a file that go up or sideways.
pub fn violations(file: &File) -> Vec<String> {
    let module = file.path.split('/').nth(1).unwrap_or_default().trim_end_matches(".rs").to_string();
    let Some(own) = layer(&module) else {
        return match module.as_str() {
            "lib" => Vec::new(),
            _ => vec![format!("{}: module {module} has no layer", file.path)],
        };
    };
    named_modules(file)
        .into_iter()
        .filter(|(_, other)| *other != module && layer(other).is_some_and(|l| l >= own))
        .map(|(line, other)| format!("{}:{line}: {module} may not import {other}", file.path))
        .collect()
}

#[test]
fn finds_upward_sideways_and_grouped_imports() {
    let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
    for (path, text, count) in [
        ("src/mesh/shape.rs", "use crate::model::Body;", 1),
        ("src/geometry/aabb.rs", "use crate::linalg::dense;", 1),
        ("src/geometry/aabb.rs", "use crate::{math, linalg};", 1),
        ("src/geometry/aabb.rs", "use super::super::world::World;", 1),
        ("src/geometry/mod.rs", "use super::world::World;", 1),
        ("src/world/step.rs", "use crate::implicit_contact::advance; // crate::capi", 0),
        ("src/world/step.rs", "use crate::world::ids::Id; use super::ids;", 0),
        ("src/strange/step.rs", "", 1),
    ] {
        assert_eq!(violations(&file(path, text)).len(), count, "{path} {text}");
    }
}
