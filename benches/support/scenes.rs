//! The worlds of tests and measurements.

use super::boxes::{BOX_VERTICES, Boxes, RUBBER, Sequence, rotation};
use super::deformable::{CLOTH, Deformable};
use super::host::{Host, Plan};
use super::shapes::{Triangles, cloth_grid, sphere};
use signorini::kinematics::Pose;
use signorini::math::{Mat3, Vec3, add, mat_vec, scale};
use signorini::model::HalfSpace;

const GROUND: HalfSpace = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 };

/// Moves every start position by up to `amount`, by the numbers of `seed`; seed 0 moves nothing.
fn jitter(x: &mut [Vec3], seed: u64, amount: f64) {
    if seed > 0 {
        let mut random = Sequence(seed);
        x.iter_mut().for_each(|p| *p = add(*p, scale(amount, [random.next(), random.next(), random.next()])));
    }
}

fn at(position: Vec3) -> Pose {
    Pose { position, ..Pose::IDENTITY }
}

fn sheet(n: usize, size: f64, seed: u64, place: impl Fn(Vec3) -> Vec3) -> (Plan, Triangles) {
    let rest = cloth_grid(n, size);
    let mut start: Vec<Vec3> = rest.positions.iter().map(|p| place(*p)).collect();
    jitter(&mut start, seed, 1e-4);
    (Plan::sheet(Deformable::sheet(&rest, CLOTH), start, &rest.faces), rest)
}

/// A 1 m cloth of `n` x `n` vertices falls flat on a fixed sphere of 0.25 m and pools on the ground.
pub fn drape(n: usize, seed: u64) -> Host {
    let (mut plan, rest) = sheet(n, 1.0, seed, |p| add(p, [0.0, 0.0, 0.56]));
    plan.obstacles.push((sphere([0.0; 3], 0.25, 4), at([0.02, 0.03, 0.25])));
    plan.half_spaces.push(GROUND);
    plan.build(&rest.positions)
}

/// The same cloth stands 10 degrees off vertical, 2 cm above the ground: it falls on its edge, folds and heaps up.
pub fn crumple(n: usize, seed: u64) -> Host {
    let turn = rotation(80f64.to_radians(), 0.0, 0.0);
    let lowest = 0.5 * 80f64.to_radians().sin();
    let (mut plan, rest) = sheet(n, 1.0, seed, |p| add(mat_vec(&turn, p), [0.0, 0.0, 0.02 + lowest]));
    plan.half_spaces.push(GROUND);
    plan.build(&rest.positions)
}

/// A cloth pinned at its corners catches a rigid ball of `mass`.
pub fn catch_ball(n: usize, mass: f64, speed: f64, seed: u64) -> Host {
    let (mut plan, rest) = sheet(n, 1.0, seed, |p| p);
    plan.pinned = vec![0, n - 1, n * (n - 1), n * n - 1];
    for i in &plan.pinned {
        plan.start[*i] = rest.positions[*i];
    }
    let radius = 0.15;
    let inertia = diagonal(0.4 * mass * radius * radius);
    plan.rigid.push((sphere([0.0; 3], radius, 2), at([0.03, 0.02, radius + 0.01]), mass, inertia));
    let mut host = plan.build(&rest.positions);
    let block = n * n;
    host.velocities[block] = [0.0, 0.0, -speed];
    host
}

/// A cloth falls on a rigid cube that stands on the ground, off its middle.
pub fn cover_cube(n: usize, seed: u64) -> Host {
    let (mut plan, rest) = sheet(n, 1.0, seed, |p| add(p, [0.11, 0.07, 0.35]));
    let (mass, side) = (5.0, 0.3);
    let inertia = diagonal(mass * side * side / 6.0);
    plan.rigid.push((cube(side), at([0.0, 0.0, 0.5 * side + 0.002]), mass, inertia));
    plan.half_spaces.push(GROUND);
    plan.build(&rest.positions)
}

/// Soft boxes fall into a container; `dt` 30 ms.
pub fn boxes(across: usize, layers: usize, seed: u64) -> Host {
    let boxes = Boxes::new(across, layers, 7 + seed);
    let count = boxes.start.len() / BOX_VERTICES;
    let elastic = Deformable::solid(&boxes.rest, RUBBER);
    let range = |b: usize| b * BOX_VERTICES..(b + 1) * BOX_VERTICES;
    let faces_of = |b: usize| {
        let mine = |f: &&[u32; 3]| boxes.body[f[0] as usize] as usize == b;
        boxes.faces.iter().filter(mine).copied().collect()
    };
    let mut plan = Plan::sheet(elastic, boxes.start.clone(), &[]);
    plan.elastic_bodies = (0..count).map(|b| (range(b), faces_of(b))).collect();
    plan.half_spaces =
        boxes.walls.iter().map(|(normal, offset)| HalfSpace { normal: *normal, offset: *offset }).collect();
    (plan.friction, plan.half_thickness, plan.dt, plan.self_collision) = (0.4, 0.005, 0.03, false);
    plan.build(&boxes.rest.positions)
}

fn diagonal(value: f64) -> Mat3 {
    [[value, 0.0, 0.0], [0.0, value, 0.0], [0.0, 0.0, value]]
}

/// A cube about the origin, two triangles per side.
pub fn cube(side: f64) -> Triangles {
    let h = 0.5 * side;
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { h } else { -h });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    Triangles { positions: (0..8).map(corner).collect(), faces }
}
