//! Real hosts: Bullet and ODE keep their own worlds, push their state through the C ABI and take pairs over.
//!
//! The programs are the examples of `examples/c` and `examples/cpp`. They are compiled here with every warning an error,
//! linked to the shared library, and run ten times each with jittered start positions; each asserts its own numbers and
//! certifies every frame. A missing engine is a failure, not a skip.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod build;

use build::{Engine, Program};

/// Runs of each program; more with `SIGNORINI_ALL=1`.
fn runs() -> u32 {
    if std::env::var("SIGNORINI_ALL").is_ok_and(|v| v == "1") {
        40
    } else {
        println!("10 runs; SIGNORINI_ALL=1 makes 40");
        10
    }
}

/// Runs a scene, which knows no engine, in this one.
fn scene(main: &'static str, engine: Engine) {
    Program { main, engine, is_scene: true }.run(&[&runs().to_string()]);
}

#[test]
fn bullet_cloth_catches_box() {
    scene("c/cloth_catches_box.c", Engine::Bullet);
}

#[test]
fn ode_cloth_catches_box() {
    scene("c/cloth_catches_box.c", Engine::Ode);
}

#[test]
fn bullet_sphere_wrapped() {
    scene("c/sphere_wrapped.c", Engine::Bullet);
}

#[test]
fn ode_sphere_wrapped() {
    scene("c/sphere_wrapped.c", Engine::Ode);
}

#[test]
fn bullet_fast_sphere() {
    scene("c/fast_sphere.c", Engine::Bullet);
}

#[test]
fn ode_fast_sphere() {
    scene("c/fast_sphere.c", Engine::Ode);
}

#[test]
fn bullet_spot_demo() {
    // The first steps of the demo: the mesh is read, thrown and hits the cloth.
    Program { main: "cpp/bullet_spot_demo.cpp", engine: Engine::Bullet, is_scene: false }.run(&["--steps", "40"]);
}
