//! Small nasty scenes by number: every seed is another mix of bodies, sizes, speeds, masses, thickness and settings.

use super::support::shapes::{cloth_grid, sphere};
use signorini::kinematics::Pose;
use signorini::math::{IDENTITY, Mat3, Vec3, add, add_scaled, mat_add, mat_scale, mat_vec, norm, scale, sub, unit};
use signorini::model::{
    BodyDescription, CombineRule, Drives, FrictionCone, HalfSpace, Kind, Material, Materials, Model, Precision,
    Settings, SolverChoice, State, Surface, System, SystemDescription,
};
use std::sync::Arc;

/// splitmix64
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5bf0_3635)
    }
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.between(low, high))
    }
    pub fn vector(&mut self, size: f64) -> Vec3 {
        [0; 3].map(|_| self.between(-size, size))
    }
    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[(self.next() % list.len() as u64) as usize]
    }
    pub fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }
    pub fn rotation(&mut self) -> [f64; 4] {
        loop {
            let q = [0; 4].map(|_| self.between(-1.0, 1.0));
            let n = q.iter().map(|c| c * c).sum::<f64>().sqrt();
            if n > 0.1 && n < 1.0 {
                return q.map(|c| c / n);
            }
        }
    }
}

/// What moves a part.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Drive {
    Soft,
    Rigid,
    Posed,
    Scripted,
    Plane,
}

/// A body before it is built: lengths in units of the scene, motion as displacement per step.
#[derive(Clone)]
pub struct Part {
    pub points: Vec<Vec3>,
    pub edges: Vec<[u32; 2]>,
    pub faces: Vec<[u32; 3]>,
    pub drive: Drive,
    pub pose: Pose,
    pub motion: Vec3,
    pub spin: Vec3,
    pub noise: f64,
    /// Steps after which a script turns back.
    pub period: usize,
    pub pinned: Vec<bool>,
    pub masses: Vec<f64>,
    pub half_thickness: f64,
    pub itself: bool,
    pub single: bool,
    pub groups: u64,
    pub mask: u64,
    pub material: u32,
}

impl Part {
    pub fn new(points: Vec<Vec3>, faces: Vec<[u32; 3]>, drive: Drive) -> Part {
        let n = points.len();
        Part {
            points,
            edges: Vec::new(),
            faces,
            drive,
            pose: Pose::IDENTITY,
            motion: [0.0; 3],
            spin: [0.0; 3],
            noise: 0.0,
            period: usize::MAX,
            pinned: vec![false; n],
            masses: vec![1.0; n],
            half_thickness: 0.01,
            itself: drive == Drive::Soft,
            single: false,
            groups: 1,
            mask: 1,
            material: 0,
        }
    }
    pub fn at(mut self, position: Vec3) -> Part {
        self.pose.position = position;
        self
    }
    pub fn turned(mut self, orientation: [f64; 4]) -> Part {
        self.pose.orientation = orientation;
        self
    }
    pub fn moving(mut self, motion: Vec3) -> Part {
        self.motion = motion;
        self
    }
}

/// A scene ready to run.
pub struct Scene {
    pub family: &'static str,
    pub model: Model,
    pub state: State,
    pub parts: Vec<Part>,
    pub settings: Settings,
    pub dt: f64,
    pub steps: usize,
    pub length: f64,
    pub gravity: Vec3,
    pub damping: f64,
    pub stiffness: f64,
    pub definite: bool,
    pub seed: u64,
}

pub fn cloth(n: usize, size: f64) -> Part {
    let grid = cloth_grid(n, size);
    Part::new(grid.positions, grid.faces, Drive::Soft)
}

pub fn ball(radius: f64, level: usize, drive: Drive) -> Part {
    let mesh = sphere([0.0; 3], radius, level);
    Part::new(mesh.positions, mesh.faces, drive)
}

pub fn block(half: Vec3, drive: Drive) -> Part {
    let points = (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { half[k] } else { -half[k] })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    Part::new(points, faces, drive)
}

fn wire(n: usize, length: f64) -> Part {
    let points = (0..n).map(|i| [length * (i as f64 / (n - 1) as f64 - 0.5), 0.0, 0.0]).collect();
    let mut part = Part::new(points, Vec::new(), Drive::Soft);
    part.edges = (0..n as u32 - 1).map(|i| [i, i + 1]).collect();
    part
}

pub fn plane(normal: Vec3, offset: f64) -> Part {
    let mut part = Part::new(Vec::new(), Vec::new(), Drive::Plane);
    part.pose.position = unit(normal).unwrap();
    part.spin = [offset, 0.0, 0.0];
    part
}

pub const FAMILIES: usize = 16;

/// Scene number `seed`.
pub fn scene(seed: u64) -> Scene {
    let mut r = Random::new(seed);
    let family = (seed % FAMILIES as u64) as usize;
    let (name, mut parts) = parts(family, &mut r);
    let fast = r.power(-3.0, 1.0);
    let throw = r.vector(1.0);
    let thickness = match r.next() % 6 {
        0 => 0.0,
        1 => 1e-9,
        2 => 1e-4,
        3 => 0.3,
        _ => 0.01,
    };
    let spread = r.pick(&[0.0, 0.0, 1.0, 4.0]);
    let friction_family = r.next();
    for (number, p) in parts.iter_mut().enumerate() {
        p.half_thickness *= thickness / 0.01;
        let light = r.power(-spread, spread);
        p.masses.iter_mut().for_each(|m| *m *= light * r.power(-0.3 * spread, 0.3 * spread));
        if p.drive == Drive::Soft || p.drive == Drive::Rigid {
            let own = r.vector(0.3);
            p.motion = add(p.motion, scale(fast, if number % 2 == 0 { add(throw, own) } else { sub(own, throw) }));
            p.noise = if p.drive == Drive::Soft { fast * r.pick(&[0.0, 0.05, 0.5]) } else { 0.0 };
        }
        p.single = r.chance(0.2);
        p.material = (r.next() % 2) as u32;
        if r.chance(0.05) {
            p.mask = r.pick(&[0, 2, 3]);
        }
        if r.chance(0.05) {
            p.groups = r.pick(&[0, 2, 3]);
        }
    }
    let length = r.pick(&[1.0, 1.0, 1.0, 1e-6, 1e-3, 1e4]);
    let centre = match r.next() % 6 {
        0 => r.vector(1e6 * length),
        1 => r.vector(1e3 * length),
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
    settings.friction_cone = r.pick(&[FrictionCone::Disc, FrictionCone::Disc, FrictionCone::Pyramid]);
    settings.solver = r.pick(&[
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
    settings.rounds_max = r.pick(&[5, 5, 5, 1, 12]);
    settings.halvings_max = r.pick(&[2, 2, 2, 0, 4]);
    settings.recovery_fraction = r.pick(&[0.1, 0.1, 0.0, 1.0]);
    settings.proximity_factor = r.pick(&[1.0, 1.0, 2.0, 0.0]);
    // What the promise may not depend on. The full cap is for slow runs.
    settings.iterations_max = match r.next() % 5 {
        0 => r.pick(&[0, 1, 10]),
        _ => 80,
    };
    if std::env::var("SIGNORINI_STRESS_SLOW").is_ok() {
        settings.iterations_max = Settings::default().iterations_max;
    }
    let dt = r.power(-4.0, 0.0);
    let stiffness = if r.chance(0.4) { r.power(-2.0, 6.0) } else { 0.0 };
    let definite = !r.chance(0.1);
    let gravity = scale(r.pick(&[0.0, 0.01, 0.1]), [0.0, 0.0, -1.0]);
    let damping = r.pick(&[1.0, 0.9, 0.0]);
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
                    let p = add(cell, r.vector(0.22));
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
            let points: Vec<Vec3> = (0..40).map(|_| add([0.0, 0.0, 0.6], r.vector(0.4))).collect();
            let mut cloud = Part::new(points, vec![], Drive::Soft);
            cloud.motion = [0.0, 0.0, -0.3];
            let under = if r.chance(0.5) { cloth(5, 1.2) } else { ball(0.15, 1, Drive::Rigid) };
            ("points", vec![cloud, under, ball(0.1, 0, Drive::Rigid).at([0.0, 0.0, -0.5])])
        }
        4 => {
            let spin = r.vector(3.0);
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
                    jaw.motion = [0.0, 0.0, -side * r.pick(&[0.03, 0.05, 0.11])];
                    jaw.period = 5;
                    jaw
                })
                .collect();
            jaws[0].spin = scale(r.pick(&[0.0, 0.0, 0.1]), [0.0, 0.0, 1.0]);
            let inside = if r.chance(0.3) { ball(0.08, 0, Drive::Rigid) } else { cloth(5, 0.9) };
            jaws.push(inside);
            ("jaws", jaws)
        }
        7 => {
            let mut body = ball(0.3, 1, Drive::Scripted).at([0.0, 0.0, 0.5]).moving([0.0, 0.0, -0.15]);
            body.noise = r.pick(&[0.0, 0.02, 0.1]);
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
            floor.motion = [0.0, 0.0, r.pick(&[0.0, 0.02, 0.2])];
            floor.period = 4;
            let mut lid = plane([0.0, r.between(-0.1, 0.1), -1.0], -0.5);
            lid.motion = [0.0, 0.0, -r.pick(&[0.0, 0.02, 0.1])];
            lid.period = 4;
            let mut c = cloth(5, 0.8).at([0.0, 0.0, 0.2]);
            c.pose.orientation = [0.1, 0.0, 0.0, 0.995];
            let rigid = posed(block([0.1; 3], Drive::Rigid), r).at([0.0, 0.0, 0.0]);
            ("half-spaces", vec![floor, lid, c, rigid])
        }
        10 => {
            let mut wall = ball(1.0, 1, Drive::Posed);
            wall.motion = r.vector(0.05);
            wall.spin = r.vector(0.2);
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
            let gap = r.pick(&[1e-6, 0.001, 0.015, 0.03]);
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
            let gap = r.pick(&[0.001, 0.01, 0.05]);
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
                part.spin = if part.drive == Drive::Rigid { r.vector(1.0) } else { [0.0; 3] };
                all.push(part);
            }
            ("crowd", all)
        }
    }
}

fn edges_of(part: &Part) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = part
        .faces
        .iter()
        .flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]])
        .chain(part.edges.iter().copied())
        .map(|e| [e[0].min(e[1]), e[0].max(e[1])])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Builds a scene; lengths times `length`, then moved to `centre`.
#[allow(clippy::too_many_arguments)]
pub fn assemble(
    family: &'static str,
    parts: Vec<Part>,
    frictions: [f64; 2],
    settings: Settings,
    (length, centre, dt): (f64, Vec3, f64),
    (gravity, damping): (Vec3, f64),
    (stiffness, definite): (f64, bool),
    steps: usize,
    seed: u64,
) -> Scene {
    let place = |p: &Part, x: Vec3| add(centre, scale(length, p.pose.transform(x)));
    let rigid = |p: &Part| matches!(p.drive, Drive::Rigid | Drive::Posed);
    let single = |p: &Part, x: Vec3| if p.single { x.map(|c| f64::from(c as f32)) } else { x };
    let mut descriptions = Vec::new();
    for (number, p) in parts.iter().enumerate() {
        let rest: Vec<Vec3> =
            p.points.iter().map(|x| if rigid(p) { scale(length, *x) } else { single(p, place(p, *x)) }).collect();
        let mass: f64 = p.masses.iter().sum();
        let radius = p.points.iter().fold(0.05, |m: f64, x| m.max(norm(*x))) * length;
        let kind = match p.drive {
            Drive::Soft => Kind::Deformable { masses: p.masses.clone(), pinned: p.pinned.clone() },
            Drive::Rigid => Kind::Rigid { mass, inertia: mat_scale(0.4 * mass * radius * radius, &IDENTITY) },
            Drive::Posed => Kind::Kinematic { posed: true },
            Drive::Scripted => Kind::Kinematic { posed: false },
            Drive::Plane => {
                let offset = p.spin[0] * length + signorini::math::dot(p.pose.position, centre);
                Kind::HalfSpace(HalfSpace { normal: p.pose.position, offset })
            }
        };
        descriptions.push(BodyDescription {
            key: 10 + 7 * number as u64,
            surface: Arc::new(Surface {
                rest,
                vertices: (0..p.points.len() as u32).collect(),
                edges: edges_of(p),
                faces: p.faces.clone(),
            }),
            kind,
            half_thickness: Some(p.half_thickness * length),
            material: p.material,
            groups: p.groups,
            mask: p.mask,
            self_collision: p.itself,
            precision: if p.single { Precision::Single } else { Precision::Double },
        });
    }
    let list =
        frictions.iter().map(|f| Material { friction_coefficient: *f, combine_rule: CombineRule::default() }).collect();
    let mut systems = Vec::new();
    if stiffness > 0.0 {
        systems.extend(pattern(&descriptions));
    }
    let model = Model::build(descriptions, Materials { list, overrides: vec![] }, systems).unwrap();
    let mut state = model.rest_state();
    for (index, p) in parts.iter().enumerate().filter(|(_, p)| rigid(p)) {
        let position = place(p, [0.0; 3]);
        model.set_pose(&mut state, index, Pose { position, orientation: p.pose.orientation });
    }
    Scene { family, model, state, parts, settings, dt, steps, length, gravity, damping, stiffness, definite, seed }
}

/// One system over all soft bodies: every edge couples its ends; bodies tied one to the next.
fn pattern(bodies: &[BodyDescription]) -> Option<SystemDescription> {
    let mut rows: Vec<Vec<u32>> = Vec::new();
    let mut keys = Vec::new();
    for body in bodies {
        let first = rows.len() as u32;
        match body.kind {
            Kind::Deformable { .. } => {
                rows.extend((0..body.surface.rest.len() as u32).map(|v| vec![first + v]));
                for e in &body.surface.edges {
                    rows[(first + e[0]) as usize].push(first + e[1]);
                    rows[(first + e[1]) as usize].push(first + e[0]);
                }
            }
            Kind::Rigid { .. } => rows.extend([vec![first], vec![first + 1]]),
            _ => continue,
        }
        if first > 0 && !rows[first as usize].is_empty() {
            rows[first as usize].push(first - 2);
            rows[first as usize - 2].push(first);
        }
        keys.push(body.key);
    }
    if rows.is_empty() {
        return None;
    }
    let mut system = SystemDescription { bodies: keys, row_offsets: vec![0], columns: vec![], upper: false };
    for mut row in rows {
        row.sort_unstable();
        row.dedup();
        system.columns.extend(row);
        system.row_offsets.push(system.columns.len());
    }
    Some(system)
}

impl Scene {
    /// Values of the system: lumped masses plus springs along edges, stiff along and soft across, plus the ties.
    fn systems(&self, state: &State) -> Vec<System> {
        let Some(description) = self.model.systems.first() else { return Vec::new() };
        let blocks: Vec<usize> = description
            .bodies
            .iter()
            .flat_map(|k| self.model.bodies[self.model.body_index(*k).unwrap()].blocks.clone())
            .collect();
        let lumped = |b: usize| -> Mat3 {
            let body = self.model.bodies.iter().position(|x| x.blocks.contains(&b)).unwrap();
            match &self.model.bodies[body].description.kind {
                Kind::Deformable { masses, .. } => {
                    mat_scale(masses[b - self.model.bodies[body].blocks.start], &IDENTITY)
                }
                Kind::Rigid { mass, inertia } => {
                    if b == self.model.bodies[body].blocks.start {
                        mat_scale(*mass, &IDENTITY)
                    } else {
                        *inertia
                    }
                }
                _ => IDENTITY,
            }
        };
        let mut values: Vec<Mat3> = vec![[[0.0; 3]; 3]; description.columns.len()];
        let centre = |row: usize| {
            let b = blocks[row];
            let body = self.model.bodies.iter().position(|x| x.blocks.contains(&b)).unwrap();
            let body_ref = &self.model.bodies[body];
            match body_ref.description.kind {
                Kind::Deformable { .. } => state.positions[body_ref.vertices.start + b - body_ref.blocks.start],
                _ => state.poses[body].position,
            }
        };
        for row in 0..blocks.len() {
            let range = description.row_offsets[row]..description.row_offsets[row + 1];
            let mut diagonal = lumped(blocks[row]);
            for k in range.clone() {
                let column = description.columns[k] as usize;
                if column == row {
                    continue;
                }
                let along = unit(sub(centre(column), centre(row))).unwrap_or([1.0, 0.0, 0.0]);
                let mass = lumped(blocks[row])[0][0].min(lumped(blocks[column])[0][0]);
                let mut spring = [[0.0; 3]; 3];
                for i in 0..3 {
                    for j in 0..3 {
                        let isotropic = if i == j { 0.01 } else { 0.0 };
                        spring[i][j] = self.stiffness * mass * (along[i] * along[j] + isotropic);
                    }
                }
                values[k] = mat_scale(if self.definite { -1.0 } else { -2.5 }, &spring);
                diagonal = mat_add(&diagonal, &spring);
            }
            for k in range {
                if description.columns[k] as usize == row {
                    values[k] = diagonal;
                }
            }
        }
        vec![System { description: description.clone(), values }]
    }

    /// What drives step number `step` from `state`, after the velocities `last`.
    pub fn drives(&self, step: usize, state: &State, last: &[Vec3]) -> Drives {
        let mut r = Random::new(self.seed.wrapping_mul(977).wrapping_add(step as u64));
        let mut drives = self.model.idle_drives(state);
        let per_step = self.length / self.dt;
        for (index, p) in self.parts.iter().enumerate() {
            let body = &self.model.bodies[index];
            let forth = if (step / p.period.max(1)).is_multiple_of(2) { 1.0 } else { -1.0 };
            match p.drive {
                Drive::Soft | Drive::Rigid => {
                    for (i, b) in body.blocks.clone().enumerate() {
                        let angular = p.drive == Drive::Rigid && i == 1;
                        let mut v = scale(self.damping, last[b]);
                        if step.is_multiple_of(5) {
                            v = if angular {
                                scale(1.0 / self.dt, p.spin)
                            } else {
                                scale(per_step, add(p.motion, r.vector(p.noise)))
                            };
                        } else if !angular {
                            v = add_scaled(v, per_step, self.gravity);
                        }
                        if p.drive == Drive::Soft && p.pinned[i] {
                            v = scale(if step.is_multiple_of(4) { 0.05 * per_step } else { 0.0 }, r.vector(1.0));
                        }
                        drives.velocities[b] = v;
                    }
                }
                Drive::Posed => {
                    let linear = scale(forth * per_step, p.motion);
                    let pose = state.poses[index].advanced(linear, scale(forth / self.dt, p.spin), self.dt);
                    drives.target_poses[index] = if p.single { pose.rounded_to_single() } else { pose };
                }
                Drive::Scripted => {
                    for v in body.vertices.clone() {
                        let shift = scale(self.length, add(scale(forth, p.motion), r.vector(p.noise)));
                        let x = add(state.positions[v], shift);
                        drives.target_positions[v] = if p.single { x.map(|c| f64::from(c as f32)) } else { x };
                    }
                }
                Drive::Plane => {
                    let h = state.half_spaces[index];
                    let offset = h.offset + self.length * forth * signorini::math::dot(h.normal, p.motion);
                    drives.target_half_spaces[index] = HalfSpace { offset, ..h };
                }
            }
        }
        drives.systems = self.systems(state);
        drives
    }

    /// Twice the energy in the metric of the step: the system's, where there is one, else lumped.
    pub fn metric_energy(&self, drives: &Drives, start: &State, v: &[Vec3]) -> f64 {
        let Some(system) = drives.systems.first() else {
            return super::stress_oracle::lumped_energy(&self.model, start, v);
        };
        let mut free = vec![true; v.len()];
        for body in &self.model.bodies {
            if let Kind::Deformable { pinned, .. } = &body.description.kind {
                body.blocks.clone().zip(pinned).for_each(|(b, p)| free[b] = !p);
            }
        }
        let d = &system.description;
        let blocks: Vec<usize> = d
            .bodies
            .iter()
            .flat_map(|k| self.model.bodies[self.model.body_index(*k).unwrap()].blocks.clone())
            .collect();
        let mut sum = 0.0;
        for (row, b) in blocks.iter().enumerate().filter(|(_, b)| free[**b]) {
            for k in d.row_offsets[row]..d.row_offsets[row + 1] {
                let c = blocks[d.columns[k] as usize];
                if free[c] {
                    sum += signorini::math::dot(v[*b], mat_vec(&system.values[k], v[c]));
                }
            }
        }
        sum
    }
}
