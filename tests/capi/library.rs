//! The shared library as a file: its symbols, its name, what it needs.

use super::build::{library_folder, root, succeed};
use std::process::Command;

fn lines(command: &str, arguments: &[&str]) -> Vec<String> {
    let mut command = Command::new(command);
    command.args(arguments).arg(library_folder().join("libsignorini.so"));
    String::from_utf8_lossy(&succeed(command).stdout).lines().map(str::to_string).collect()
}

#[test]
fn exported_symbols_are_those_of_the_list() {
    let mut exported: Vec<String> = lines("nm", &["-D", "--defined-only", "--format=just-symbols"]);
    exported.sort();
    let list = std::fs::read_to_string(root().join("include/signorini.symbols")).expect("the list");
    assert_eq!(exported, list.lines().collect::<Vec<_>>());
}

#[test]
fn the_library_has_a_soname_and_stays_mapped() {
    let dynamic = lines("readelf", &["-d"]).join("\n");
    let version: Vec<&str> = env!("CARGO_PKG_VERSION").split('.').collect();
    assert!(dynamic.contains(&format!("[libsignorini.so.{}.{}]", version[0], version[1])), "{dynamic}");
    assert!(dynamic.contains("NODELETE"), "{dynamic}");
}
