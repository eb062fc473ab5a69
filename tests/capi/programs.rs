//! Programs in C and C++ that use the library as a host does. Each prints what it found wrong and says so by its status.

use super::build::{Standard, build, compiler, library_folder, root, run, succeed};
use std::process::Command;

#[test]
fn the_header_compiles_alone() {
    for standard in [Standard::C99, Standard::C11, Standard::Cxx11, Standard::Cxx17] {
        let mut command = compiler(standard);
        command.args(["-fsyntax-only", "-Wconversion", "-Wshadow", "-Wcast-qual"]);
        command.args(["-x", if standard.is_cpp() { "c++" } else { "c" }]);
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

#[test]
fn a_cloth_that_the_library_drives_drapes_over_a_soft_ball() {
    let text = run("examples/c/model_cloth.c", Standard::C99, &[]);
    assert_eq!(text.lines().last(), Some("intersections: 0"), "{text}");
    assert_eq!(text.lines().count(), 7, "{text}");
}

#[test]
fn bodies_of_the_library_through_the_c_abi() {
    passes("model.c", Standard::C99);
}

#[test]
fn a_recorded_cloth_is_kept_above_a_roof() {
    let text = run("examples/c/filter.c", Standard::C99, &[]);
    assert_eq!(text.lines().count(), 6, "{text}");
    assert!(text.lines().all(|line| line.ends_with(" 0 intersections")), "{text}");
    assert!(text.contains("frame 15: recorded 0.300, filtered 0.5"), "{text}");
}

#[test]
fn the_filter_alone_through_the_c_abi() {
    passes("filter.c", Standard::C99);
}

fn passes(name: &str, standard: Standard) {
    let text = run(&format!("tests/capi/programs/{name}"), standard, &[]);
    assert!(text.lines().any(|line| line == "PASS"), "{name}:\n{text}");
}

#[test]
fn misuse_is_a_status_and_changes_nothing() {
    passes("misuse.c", Standard::C99);
}

#[test]
fn views_of_every_layout_are_read_and_written() {
    passes("buffers.c", Standard::C99);
}

#[test]
fn lives_leave_nothing_behind_and_callbacks_find_the_world_busy() {
    passes("lifetimes.c", Standard::C99);
}

#[test]
fn every_executor_and_floating_point_environment_gives_the_same_bits() {
    passes("determinism.c", Standard::C99);
}

#[test]
fn physics_through_the_c_abi() {
    passes("physics.c", Standard::C99);
}

/// Random calls; SIGNORINI_ALL=1 tries more of them.
#[test]
fn random_calls_give_statuses_and_refusals_change_nothing() {
    let worlds = if all() { "2000" } else { "60" };
    let text = run("tests/capi/programs/sequences.c", Standard::C99, &[worlds, "1"]);
    assert!(text.lines().any(|line| line == "PASS"), "{text}");
}

/// Worlds that once were refused by every call (an inertia too small), and that panicked (recovery dropped in the last
/// round).
#[test]
fn random_calls_that_once_failed() {
    for [seed, first] in [["1", "153"], ["7", "1370"]] {
        let text = run("tests/capi/programs/sequences.c", Standard::C99, &["1", seed, first]);
        assert!(text.lines().any(|line| line == "PASS"), "{text}");
    }
}

#[test]
fn the_cpp_wrapper_drives_a_hammock() {
    passes("wrapper.cpp", Standard::Cxx17);
}

#[test]
fn a_host_loads_the_library_and_its_table() {
    let library = library_folder().join("libsignorini.so");
    let text = run("tests/capi/programs/loader.c", Standard::C99, &[&library.to_string_lossy()]);
    assert_eq!(text, "PASS\n");
}

/// Programs that try every call and every layout of memory, with their arguments.
const MEMORY_PROGRAMS: [(&str, &[&str]); 3] = [("misuse.c", &[]), ("buffers.c", &[]), ("sequences.c", &["20", "3"])];
/// Programs that run long as well, under the sanitizers with SIGNORINI_ALL=1.
const LONG_PROGRAMS: [(&str, &[&str]); 3] = [("physics.c", &[]), ("lifetimes.c", &[]), ("sequences.c", &["300", "4"])];

fn all() -> bool {
    std::env::var_os("SIGNORINI_ALL").is_some()
}

/// No bad access to the host's memory, no undefined behaviour in the host, nothing lost.
#[test]
fn sanitizers_find_nothing() {
    let long: &[_] = if all() { &LONG_PROGRAMS } else { &[] };
    for (source, arguments) in MEMORY_PROGRAMS.iter().chain(long) {
        let text = run(&format!("tests/capi/programs/{source}"), Standard::C99Sanitized, arguments);
        assert!(text.lines().any(|line| line == "PASS"), "{source}:\n{text}");
    }
}

/// The same under valgrind, which sees the library's own accesses too. Slow, so only with SIGNORINI_ALL=1.
#[test]
fn valgrind_finds_nothing() {
    if !all() {
        println!("skipped without SIGNORINI_ALL=1");
        return;
    }
    for (source, arguments) in MEMORY_PROGRAMS {
        let program = build(&format!("tests/capi/programs/{source}"), Standard::C99);
        let mut command = Command::new("valgrind");
        command.args([
            "--quiet",
            "--error-exitcode=9",
            "--leak-check=full",
            "--show-leak-kinds=definite",
            "--errors-for-leak-kinds=definite",
        ]);
        command.arg(program).args(arguments).env_remove("LD_LIBRARY_PATH");
        let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
        let said = String::from_utf8_lossy(&output.stderr);
        // Valgrind 3.19 announces AVX2 and does not know `vmovq` between registers, which ends the program. What it said
        // up to there counts: errors are printed when they are seen.
        if said.contains("Illegal opcode") && !said.contains("Invalid ") && !said.contains("uninitialised") {
            println!("{source}: this valgrind does not know an instruction of this processor");
            continue;
        }
        let passed = output.status.success() && String::from_utf8_lossy(&output.stdout).contains("PASS");
        assert!(passed, "{source}:\n{said}");
    }
}
