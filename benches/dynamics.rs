//! The unconstrained part of a step: assembly and solve of the bodies that the library drives, without contact.
//!
//! `cargo bench --bench dynamics`: processor milliseconds per step, best of three runs; conjugate gradients against the
//! direct factor where both can be had.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[allow(dead_code, unused_imports)]
mod support;

use signorini::dynamics::{Assembled, FreeSolver, Surroundings, assemble};
use signorini::energy::{Damping, Forces, Pattern, SheetMaterial, SolidMaterial};
use signorini::linalg::{Envelope, EnvelopeCholesky};
use signorini::math::{Vec3, add_scaled};
use signorini::mesh::TetMesh;
use signorini::model::Settings;
use signorini::parallel::Par;
use signorini::world::{BodyOptions, NodeForces, SheetDescription, SheetModel, Topology, World};
use support::clock::thread_seconds;
use support::random::Random;
use support::shapes;

const DAMPING: Damping = Damping { mass_rate: 0.1, stretch_time: 1e-3, bending_time: 1e-3 };

const MATERIAL: SheetMaterial = SheetMaterial {
    density: 200.0,
    thickness: 1e-3,
    young_modulus: 1e6,
    poisson_ratio: 0.3,
    bending_stiffness: Some(1e-5),
    flat: true,
    rest_scale: 1.0,
    damping: DAMPING,
};

struct Body {
    name: &'static str,
    forces: Forces,
    masses: Vec<f64>,
    rest: Vec<Vec3>,
    dt: f64,
    copies: usize,
}

fn sheet(name: &'static str, n: usize, dt: f64, springs: bool) -> Body {
    let cloth = shapes::cloth_grid(n, 1.0);
    let material = MATERIAL;
    let forces = if springs {
        material.mass_spring(&cloth.positions, &cloth.faces, 0.01)
    } else {
        material.shell(&cloth.positions, &cloth.faces)
    };
    let masses = material.lumped_masses(&cloth.positions, &cloth.faces).unwrap();
    Body { name, forces: forces.unwrap(), masses, rest: cloth.positions, dt, copies: 1 }
}

fn block(name: &'static str, cells: [usize; 3], young_modulus: f64, copies: usize) -> Body {
    let solid = shapes::solid_box([0.0; 3], cells, 0.25);
    let material =
        SolidMaterial { density: 1000.0, young_modulus, poisson_ratio: 0.3, rest_scale: 1.0, damping: DAMPING };
    let mesh = TetMesh::new(solid.positions, solid.tetrahedra).unwrap();
    let masses = mesh.lumped_masses(material.density);
    Body { name, forces: material.solid(&mesh).unwrap(), masses, rest: mesh.rest, dt: 0.03, copies }
}

fn best(copies: usize, mut f: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let start = thread_seconds();
        (0..copies).for_each(|_| f());
        best = best.min(1e3 * (thread_seconds() - start));
    }
    best
}

fn main() {
    println!("body | nodes | blocks | envelope work / blocks | assembly ms | solve ms (steps) | direct ms");
    for body in [
        sheet("shell", 50, 0.004, false),
        sheet("mass-spring", 50, 0.004, true),
        sheet("shell, dt 10 ms", 50, 0.01, false),
        block("164 blocks, E 5e5", [4, 3, 2], 5e5, 164),
        block("164 blocks, E 5e6", [4, 3, 2], 5e6, 164),
        block("solid, E 5e5", [24, 16, 12], 5e5, 1),
    ] {
        let pattern = Pattern::new(&body.forces, body.masses.len());
        let mut random = Random::new(1);
        let x: Vec<Vec3> = body.rest.iter().map(|p| add_scaled(*p, 2e-3, random.vector())).collect();
        let v: Vec<Vec3> = x.iter().map(|_| random.vector()).collect();
        let around = Surroundings { gravity: [0.0, 0.0, -9.81], wind: [0.0; 3] };
        let mut out = Assembled::default();
        let assembly = best(body.copies, || {
            assemble(&body.forces, &pattern, &body.masses, (&x, &v), &[], &around, body.dt, &mut out, Par::Serial);
        });
        let pinned = vec![false; x.len()];
        let mut steps = (0, false);
        let mut solver = FreeSolver::default();
        let solve = best(body.copies, || {
            let v0 = &v;
            let mut v = v0.clone();
            let found = solver.solve(&pattern, &out.matrix, &out.right, &pinned, |i| v0[i], &mut v, Par::Serial);
            steps = (found.1, found.2);
        });
        let envelope = Envelope::new(&out.matrix);
        let direct = best(body.copies, || {
            let mut change = out.right.clone();
            EnvelopeCholesky::new(&out.matrix, &envelope, &pinned).unwrap().solve(
                &envelope,
                &mut change,
                &mut Vec::new(),
            );
        });
        let blocks = out.matrix.columns.len();
        println!(
            "{} | {} | {blocks} | {:.1} | {assembly:.2} | {solve:.2} ({}, {}) | {direct:.2}",
            body.name,
            x.len(),
            envelope.work() as f64 / blocks as f64,
            steps.0,
            if steps.1 { "met" } else { "missed" },
        );
    }
    whole_step();
}

/// What stages 1 and 2 cost within a step: assembly, solve and metric, as the step reports it.
fn whole_step() {
    let cloth = shapes::cloth_grid(50, 1.0);
    let mut world = World::new();
    let description = SheetDescription {
        options: BodyOptions { half_thickness: Some(1e-3), ..BodyOptions::default() },
        positions: cloth.positions,
        rest: Vec::new(),
        topology: Topology { triangles: cloth.faces, ..Topology::default() },
        material: MATERIAL,
        model: SheetModel::Shell,
        forces: NodeForces::default(),
    };
    world.add_sheet(description).unwrap();
    world.set_gravity([0.0, 0.0, -9.81]).unwrap();
    let mut best = [f64::INFINITY; 2];
    for _ in 0..8 {
        let report = world.step(&Settings::default(), 0.004, Par::Serial).unwrap();
        best = [best[0].min(report.times.dynamics), best[1].min(report.times.total)];
    }
    println!(
        "shell of 2601 nodes in a step, ms by the clock: stages 1 and 2 {:.2}, all {:.2}",
        best[0] / 1e3,
        best[1] / 1e3
    );
}
