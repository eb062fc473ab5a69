//! Programs in C and C++ that use the library as a host does. Each prints what it found wrong and says so by its status.

use super::build::{Standard, compiler, root, run, succeed};

#[test]
fn the_header_compiles_alone() {
    for standard in [Standard::C99, Standard::C11, Standard::Cxx11, Standard::Cxx17] {
        let mut command = compiler(standard);
        command.args(["-fsyntax-only", "-Wconversion", "-Wshadow", "-Wcast-qual"]);
        command.args(["-x", if matches!(standard, Standard::C99 | Standard::C11) { "c" } else { "c++" }]);
        command.arg(root().join("tests/capi/programs/header_alone.c"));
        succeed(command);
    }
}

#[test]
fn the_smallest_host_puts_a_cloth_on_the_ground() {
    let text = run("examples/c/minimal.c", Standard::C99, &[]);
    let last = text.lines().last().unwrap_or_default();
    assert!(last.starts_with("t = 0.50 s: height 0.0"), "{text}");
}

fn passes(name: &str, standard: Standard) {
    let text = run(&format!("tests/capi/programs/{name}"), standard, &[]);
    assert!(text.lines().any(|line| line == "PASS"), "{name}:\n{text}");
}

#[test]
fn misuse_is_a_status_and_changes_nothing() {
    passes("misuse.c", Standard::C99);
}
