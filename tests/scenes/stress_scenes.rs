//! Small nasty scenes by number: every seed is another mix of bodies, sizes, speeds, masses, thickness and settings.

use super::stress_parts::{Drive, Part, ball, block, cloth, plane, wire};
use super::stress_world::{Scene, assemble};
use super::support::random::Random;
use signorini::math::{Vec3, add, add_scaled, norm, scale, sub};
use signorini::model::{FrictionCone, Settings, SolverChoice};

pub const FAMILIES: usize = 16;

/// Scene number `seed`.
pub fn scene(seed: u64) -> Scene {
    let mut r = Random::for_stress(seed);
    let family = (seed % FAMILIES as u64) as usize;
    let (name, mut parts) = parts(family, &mut r);
    let fast = r.power(-3.0, 1.0);
    let throw = r.within(1.0);
    let thickness = match r.next() % 6 {
        0 => 0.0,
        1 => 1e-9,
        2 => 1e-4,
        3 => 0.3,
        _ => 0.01,
    };
    let spread = r.choose(&[0.0, 0.0, 1.0, 4.0]);
    let friction_family = r.next();
    for (number, p) in parts.iter_mut().enumerate() {
        p.half_thickness *= thickness / 0.01;
        let light = r.power(-spread, spread);
        p.masses.iter_mut().for_each(|m| *m *= light * r.power(-0.3 * spread, 0.3 * spread));
        if p.drive == Drive::Soft || p.drive == Drive::Rigid {
            let own = r.within(0.3);
            p.motion = add(p.motion, scale(fast, if number % 2 == 0 { add(throw, own) } else { sub(own, throw) }));
            p.noise = if p.drive == Drive::Soft { fast * r.choose(&[0.0, 0.05, 0.5]) } else { 0.0 };
        }
        p.single = r.chance(0.2);
        p.material = (r.next() % 2) as u32;
        if r.chance(0.05) {
            p.mask = r.choose(&[0, 2, 3]);
        }
        if r.chance(0.05) {
            p.groups = r.choose(&[0, 2, 3]);
        }
    }
    let length = r.choose(&[1.0, 1.0, 1.0, 1e-6, 1e-3, 1e4]);
    let centre = match r.next() % 6 {
        0 => r.within(1e6 * length),
        1 => r.within(1e3 * length),
        _ => [0.0; 3],
    };
    // A single-precision grid far from the origin would be coarser than the scene.
    if norm(centre) > 0.0 {
        parts.iter_mut().for_each(|p| p.single &= norm(centre) < 2e3 * length && thickness > 1e-3);
    }
    let frictions = match friction_family % 4 {
        0 => [0.0, 0.0],
        1 => [1.0, 0.2],
        2 => [1e6, 0.5],
        _ => [0.3, 0.3],
    };
    let mut settings = Settings { certify: true, ..Settings::default() };
    settings.friction_cone = r.choose(&[FrictionCone::Disc, FrictionCone::Disc, FrictionCone::Pyramid]);
    settings.solver = r.choose(&[
        SolverChoice::Automatic,
        SolverChoice::Automatic,
        SolverChoice::Automatic,
        SolverChoice::Automatic,
        SolverChoice::LightAnticipation,
        SolverChoice::IterativeAnticipation,
        SolverChoice::AugmentedLagrangian,
        SolverChoice::AcceleratedRelaxation,
        SolverChoice::FullAnticipation,
    ]);
    settings.rounds_max = r.choose(&[5, 5, 5, 1, 12]);
    settings.halvings_max = r.choose(&[2, 2, 2, 0, 4]);
    settings.recovery_fraction = r.choose(&[0.1, 0.1, 0.0, 1.0]);
    settings.proximity_factor = r.choose(&[1.0, 1.0, 2.0, 0.0]);
    // What the promise may not depend on. The full cap is for slow runs.
    settings.iterations_max = match r.next() % 5 {
        0 => r.choose(&[0, 1, 10]),
        _ => 80,
    };
    if std::env::var("SIGNORINI_STRESS_SLOW").is_ok() {
        settings.iterations_max = Settings::default().iterations_max;
    }
    let dt = r.power(-4.0, 0.0);
    let stiffness = if r.chance(0.4) { r.power(-2.0, 6.0) } else { 0.0 };
    let definite = !r.chance(0.1);
    let gravity = scale(r.choose(&[0.0, 0.01, 0.1]), [0.0, 0.0, -1.0]);
    let damping = r.choose(&[1.0, 0.9, 0.0]);
    let steps = if family == 12 { 6 } else { 12 };
    assemble(
        name,
        parts,
        frictions,
        settings,
        (length, centre, dt),
        (gravity, damping),
        (stiffness, definite),
        steps,
        seed,
    )
}

fn parts(family: usize, r: &mut Random) -> (&'static str, Vec<Part>) {
    let posed = |part: Part, r: &mut Random| part.turned(r.rotation());
    match family {
        0 => {
            // A soup: loose triangles on a jittered lattice.
            let side = 3 + (r.next() % 2) as i32;
            let mut all = vec![Part::new(vec![], vec![], Drive::Soft), Part::new(vec![], vec![], Drive::Soft)];
            for i in 0..side * side * side {
                let cell = [i % side, i / side % side, i / side / side].map(|c| f64::from(c) * 0.5);
                let which = &mut all[(r.next() % 2) as usize];
                let first = which.points.len() as u32;
                for _ in 0..3 {
                    let p = add(cell, r.within(0.22));
                    which.points.push(p);
                    which.pinned.push(r.chance(0.05));
                    which.masses.push(1.0);
                }
                which.faces.push([first, first + 1, first + 2]);
            }
            all.iter_mut().for_each(|p| p.noise = 1.0);
            ("soup", all)
        }
        1 => {
            let gap = r.power(-9.0, -0.5);
            let count = 2 + (r.next() % 3) as usize;
            let sheets = (0..count).map(|i| {
                let n = 3 + (r.next() % 4) as usize;
                let mut c = cloth(n, 1.0).at([r.between(-0.1, 0.1), r.between(-0.1, 0.1), gap * i as f64]);
                if i % 2 == 1 {
                    c.pose.orientation = [0.0, 0.0, 0.38, 0.924_986_5];
                }
                c
            });
            ("sheets", sheets.collect())
        }
        2 => {
            let wires = (0..5).map(|i| {
                let angle = r.between(0.0, 3.0);
                let n = 2 + (r.next() % 6) as usize;
                let mut w = wire(n, 1.0).at([0.0, 0.0, 0.05 * f64::from(i)]);
                w.pose.orientation = [0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()];
                w.motion = [0.0, 0.0, if i % 2 == 0 { 0.1 } else { -0.1 }];
                w
            });
            ("wires", wires.collect())
        }
        3 => {
            let points: Vec<Vec3> = (0..40).map(|_| add([0.0, 0.0, 0.6], r.within(0.4))).collect();
            let mut cloud = Part::new(points, vec![], Drive::Soft);
            cloud.motion = [0.0, 0.0, -0.3];
            let under = if r.chance(0.5) { cloth(5, 1.2) } else { ball(0.15, 1, Drive::Rigid) };
            ("points", vec![cloud, under, ball(0.1, 0, Drive::Rigid).at([0.0, 0.0, -0.5])])
        }
        4 => {
            let spin = r.within(3.0);
            let mut solid =
                if r.chance(0.5) { block([0.2, 0.2, 0.2], Drive::Rigid) } else { ball(0.2, 1, Drive::Rigid) };
            solid = posed(solid, r).at([0.0, 0.0, 0.4]).moving([0.0, 0.0, -0.2]);
            solid.spin = spin;
            let mut c = cloth(6, 1.0);
            if r.chance(0.5) {
                c.pinned = (0..36).map(|i| [0, 5, 30, 35].contains(&i)).collect();
            }
            ("spinning", vec![solid, c, posed(block([0.1, 0.3, 0.05], Drive::Rigid), r).at([0.0, 0.0, -0.5])])
        }
        5 => {
            let needle = vec![[0.0, 0.0, -0.5], [0.01, 0.0, 0.5], [-0.005, 0.008, 0.5], [-0.005, -0.008, 0.5]];
            let faces = vec![[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]];
            let mut n = Part::new(needle, faces, Drive::Rigid).at([0.03, 0.02, 0.6]).moving([0.0, 0.0, -0.4]);
            n.masses = vec![r.power(-2.0, 3.0); 4];
            let mut c = cloth(5, 1.0);
            c.pinned[0] = true;
            c.pinned[24] = true;
            ("needle", vec![n, c])
        }
        6 => {
            let width = 0.7;
            let mut jaws: Vec<Part> = [1.0, -1.0]
                .iter()
                .map(|side| {
                    let mut jaw = block([width, width, 0.1], Drive::Posed).at([0.0, 0.0, side * 0.3]);
                    jaw.motion = [0.0, 0.0, -side * r.choose(&[0.03, 0.05, 0.11])];
                    jaw.period = 5;
                    jaw
                })
                .collect();
            jaws[0].spin = scale(r.choose(&[0.0, 0.0, 0.1]), [0.0, 0.0, 1.0]);
            let inside = if r.chance(0.3) { ball(0.08, 0, Drive::Rigid) } else { cloth(5, 0.9) };
            jaws.push(inside);
            ("jaws", jaws)
        }
        7 => {
            let mut body = ball(0.3, 1, Drive::Scripted).at([0.0, 0.0, 0.5]).moving([0.0, 0.0, -0.15]);
            body.noise = r.choose(&[0.0, 0.02, 0.1]);
            body.period = 6;
            let mut c = cloth(6, 1.2);
            if r.chance(0.5) {
                c.pinned = (0..36).map(|i| !(6..30).contains(&i)).collect();
            }
            ("deforming", vec![body, c])
        }
        8 => {
            let mut a = cloth(5, 1.0);
            a.pinned = (0..25).map(|_| r.chance(0.3)).collect();
            let mut b = cloth(5, 1.0).at([0.05, 0.02, 0.1]);
            b.pinned = (0..25).map(|_| r.chance(0.2)).collect();
            a.motion = [0.0, 0.0, r.between(0.0, 0.1)];
            ("pinned", vec![a, b])
        }
        9 => {
            let mut floor = plane([r.between(-0.3, 0.3), 0.1, 1.0], -0.3);
            floor.motion = [0.0, 0.0, r.choose(&[0.0, 0.02, 0.2])];
            floor.period = 4;
            let mut lid = plane([0.0, r.between(-0.1, 0.1), -1.0], -0.5);
            lid.motion = [0.0, 0.0, -r.choose(&[0.0, 0.02, 0.1])];
            lid.period = 4;
            let mut c = cloth(5, 0.8).at([0.0, 0.0, 0.2]);
            c.pose.orientation = [0.1, 0.0, 0.0, 0.995];
            let rigid = posed(block([0.1; 3], Drive::Rigid), r).at([0.0, 0.0, 0.0]);
            ("half-spaces", vec![floor, lid, c, rigid])
        }
        10 => {
            let mut wall = ball(1.0, 1, Drive::Posed);
            wall.motion = r.within(0.05);
            wall.spin = r.within(0.2);
            wall.period = 4;
            let inside = vec![
                wall,
                posed(block([0.2, 0.1, 0.3], Drive::Rigid), r).at([0.0, 0.0, 0.35]),
                cloth(4, 0.8).at([0.0, 0.0, -0.1]),
                ball(0.15, 0, Drive::Soft).at([0.2, 0.0, -0.4]),
            ];
            ("closed", inside)
        }
        11 => {
            // Zero areas, zero lengths, vertices twice.
            let mut c = cloth(4, 1.0);
            c.points[5] = c.points[6];
            c.points[9] = add_scaled(c.points[8], 0.5, sub(c.points[10], c.points[8]));
            let copy = c.points[0];
            c.points.push(copy);
            c.points.push(copy);
            c.faces.push([0, 16, 17]);
            c.faces.push([0, 1, 16]);
            c.masses.extend([1.0, 1.0]);
            c.pinned.extend([false, false]);
            let flat = vec![[0.0, 0.0, 0.2], [0.5, 0.0, 0.2], [1.0, 0.0, 0.2], [0.2, 0.1, 0.3]];
            let mut sliver = Part::new(flat, vec![[0, 1, 2], [0, 1, 3]], Drive::Soft);
            sliver.edges = vec![[2, 3]];
            sliver.motion = [0.0, 0.0, -0.2];
            let mut dot = Part::new(vec![[0.1, 0.0, 0.5]; 3], vec![[0, 1, 2]], Drive::Soft);
            dot.motion = [0.0, 0.0, -0.3];
            ("degenerate", vec![c, sliver, dot])
        }
        12 => {
            let count = 12 + (r.next() % 9) as usize;
            let gap = r.choose(&[1e-6, 0.001, 0.015, 0.03]);
            let mut stack: Vec<Part> = (0..count)
                .map(|i| cloth(3, 1.0).at([0.01 * (i % 3) as f64, 0.0, gap * i as f64]).moving([0.0, 0.0, -0.02]))
                .collect();
            stack.push(if r.chance(0.5) {
                plane([0.0, 0.0, 1.0], -0.02)
            } else {
                block([1.0, 1.0, 0.1], Drive::Posed).at([0.0, 0.0, -0.12])
            });
            ("stack", stack)
        }
        13 => {
            // Folded on itself, with the rest distance below the thickness.
            let n = 6;
            let mut c = cloth(n, 1.0);
            let gap = r.choose(&[0.001, 0.01, 0.05]);
            let mut folded = c.points.clone();
            for p in folded.iter_mut().filter(|p| p[0] > 0.05) {
                *p = [0.1 - p[0], p[1], gap + 0.3 * (p[0] - 0.05).min(0.05)];
            }
            c.points = folded;
            ("folded", vec![c, ball(0.2, 0, Drive::Rigid).at([0.0, 0.0, 0.5])])
        }
        14 => {
            // Tangled: bodies start through each other.
            let a = cloth(5, 1.0);
            let mut b = cloth(5, 1.0).at([0.3, 0.0, 0.02]);
            b.pose.orientation = [0.5, 0.5, 0.5, 0.5];
            b.motion = [0.0, 0.0, 0.15];
            ("tangled", vec![a, b, ball(0.2, 0, Drive::Rigid).at([0.0, 0.4, 0.1]).moving([0.0, 0.0, 0.1])])
        }
        _ => {
            let mut all = Vec::new();
            for i in 0..8 {
                let position = [f64::from(i % 2), f64::from(i / 2 % 2), f64::from(i / 4)].map(|c| c * 0.7 - 0.35);
                let part = match r.next() % 5 {
                    0 => ball(0.2, 0, Drive::Rigid),
                    1 => ball(0.2, 0, Drive::Soft),
                    2 => wire(5, 0.5),
                    3 => cloth(4, 0.5),
                    _ => block([0.15, 0.2, 0.1], Drive::Rigid),
                };
                let mut part = posed(part, r).at(position);
                part.motion = scale(-r.unit(), position);
                part.spin = if part.drive == Drive::Rigid { r.within(1.0) } else { [0.0; 3] };
                all.push(part);
            }
            ("crowd", all)
        }
    }
}
