//! Small scenes for detection: meshes, wires, points, degenerate and extreme ones.

use crate::random::Random;
use signorini::detection::Primitives;
use signorini::math::{Vec3, add_scaled, scale};

pub struct Scene {
    pub name: String,
    pub vertices: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub faces: Vec<[u32; 3]>,
    pub body: Vec<u32>,
    pub x0: Vec<Vec3>,
    pub x1: Vec<Vec3>,
    pub radius: Vec<f64>,
}

impl Scene {
    pub fn primitives(&self) -> Primitives<'_> {
        Primitives { vertices: &self.vertices, edges: &self.edges, faces: &self.faces }
    }

    fn empty(name: &str) -> Scene {
        let name = name.to_string();
        Scene {
            name,
            vertices: vec![],
            edges: vec![],
            faces: vec![],
            body: vec![],
            x0: vec![],
            x1: vec![],
            radius: vec![],
        }
    }

    /// Adds a body by its faces; edges are theirs.
    fn add(&mut self, x: &[Vec3], faces: &[[u32; 3]], motion: impl FnMut(Vec3) -> Vec3) {
        let offset = self.x0.len() as u32;
        let body = self.body.last().map_or(0, |b| b + 1);
        self.body.extend(x.iter().map(|_| body));
        self.vertices.extend((0..x.len() as u32).map(|v| v + offset));
        self.faces.extend(faces.iter().map(|f| f.map(|v| v + offset)));
        let mut edges: Vec<[u32; 2]> = faces
            .iter()
            .flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        self.edges.extend(edges.iter().map(|e| e.map(|v| v + offset)));
        self.x0.extend_from_slice(x);
        self.x1.extend(x.iter().copied().map(motion));
        self.radius.resize(self.x0.len(), 0.0);
    }
}

/// `layers` flat sheets of n x n vertices over one another, that fall onto each other.
pub fn grid(name: &str, n: usize, layers: usize) -> Scene {
    let mut scene = Scene::empty(name);
    let mut faces = vec![];
    for i in 0..n as u32 - 1 {
        for j in 0..n as u32 - 1 {
            let v = i * n as u32 + j;
            faces.extend([[v, v + 1, v + n as u32], [v + 1, v + 1 + n as u32, v + n as u32]]);
        }
    }
    for layer in 0..layers {
        let at = |k: usize| [(k / n) as f64 * 0.1, (k % n) as f64 * 0.1, layer as f64 * 0.05];
        let x: Vec<Vec3> = (0..n * n).map(at).collect();
        scene.add(&x, &faces, |x| [x[0], x[1], x[2] - 0.06 * layer as f64]);
    }
    scene
}

fn soup(name: &str, seed: u64, faces: usize, size: f64, mut place: impl FnMut(&mut Random) -> Vec3) -> Scene {
    let mut r = Random::new(seed);
    let mut scene = Scene::empty(name);
    for _ in 0..faces {
        let centre = place(&mut r);
        let x = [0; 3].map(|_| add_scaled(centre, size, r.vector()));
        let step = scale(size, r.vector());
        scene.add(&x, &[[0, 1, 2]], |x| add_scaled(x, 1.0, step));
    }
    scene
}

/// Random numbers of vertices, edges and faces over common vertices.
fn mixed(name: &str, seed: u64, vertices: usize, edges: usize, faces: usize) -> Scene {
    let mut r = Random::new(seed);
    let mut scene = Scene::empty(name);
    scene.x0 = (0..vertices).map(|_| r.vector()).collect();
    scene.x1 = scene.x0.iter().map(|x| add_scaled(*x, 0.1, r.vector())).collect();
    scene.radius = (0..vertices).map(|_| if r.pick(2) == 0 { 0.0 } else { 0.05 * r.unit() }).collect();
    // One body: primitives of different bodies share no vertices.
    scene.body = vec![0; vertices];
    scene.vertices = (0..vertices as u32).filter(|v| v % 7 != 3).collect();
    let mut near = |count: usize| -> u32 { r.pick(count) as u32 };
    scene.edges = (0..edges).map(|_| [near(vertices), near(vertices)]).collect();
    scene.faces = (0..faces).map(|_| [near(vertices), near(vertices), near(vertices)]).collect();
    scene
}

pub fn scenes() -> Vec<Scene> {
    let mut out = vec![
        Scene::empty("nothing"),
        grid("sheets", 12, 3),
        grid("one face", 2, 1),
        mixed("mixed", 1, 60, 40, 30),
        mixed("points", 2, 300, 0, 0),
        mixed("wires", 3, 200, 120, 0),
        mixed("faces without edges", 4, 90, 0, 60),
        mixed("points and faces", 5, 300, 0, 10),
        soup("soup", 6, 200, 0.2, |r| r.vector()),
        soup("far from the origin", 7, 100, 1e-9, |r| add_scaled([1e6, -1e6, 1e6], 4e-9, r.vector())),
        soup("two scales", 8, 100, 0.3, |r| if r.pick(3) == 0 { scale(1e9, r.vector()) } else { r.vector() }),
        soup("all in one place", 9, 60, 0.0, |_| [0.25; 3]),
        // Small integers: most boxes touch without overlapping.
        soup("lattice", 10, 120, 1e-300, |r| [0; 3].map(|_| r.pick(4) as f64)),
    ];
    let mut line = soup("on a line", 11, 100, 0.0, |r| [r.unit(), 0.0, 0.0]);
    line.x1 = line.x0.iter().map(|x| [x[0], x[0], 0.0]).collect();
    out.push(line);
    let mut thick = grid("thick sheets", 10, 2);
    thick.radius.iter_mut().enumerate().for_each(|(v, r)| *r = 0.01 + 0.003 * (v % 5) as f64);
    out.push(thick);
    for exponent in [-300.0, -150.0, 150.0, 300.0] {
        let mut extreme = soup("extreme", 12, 60, 0.3, Random::vector);
        let size = 10_f64.powf(exponent);
        extreme.name = format!("extreme 1e{exponent}");
        for x in extreme.x0.iter_mut().chain(&mut extreme.x1) {
            *x = scale(size, *x);
        }
        extreme.radius.iter_mut().for_each(|r| *r = 0.1 * size);
        out.push(extreme);
    }
    out
}
