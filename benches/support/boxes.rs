//! Soft boxes falling into a container: a mesh of many solids, and a rough penalty simulation that heaps them up.

use super::conjugate_gradient::{inverse_diagonal, solve_operator};
use super::deformable::{Deformable, Solid};
use super::nearby::{Pair, Surfaces, pairs};
use super::problem::half_space_pairs;
use super::shapes::{Tetrahedra, boundary_faces, edges_of, solid_box};
use signorini::math::{Mat3, Vec3, add, add_scaled, dot, mat_mul, mat_vec, scale};
use signorini::parallel::Par;

/// Rubber of the comparison scenes.
pub const RUBBER: Solid = Solid { density: 1000.0, young: 5e5, poisson: 0.3 };

/// Boxes of 2 x 3 x 4 cubes of 0.1 m, 60 vertices and 144 tetrahedra each, over one vertex list.
pub struct Boxes {
    /// Undeformed shapes, each about the origin.
    pub rest: Tetrahedra,
    /// Start positions.
    pub start: Vec<Vec3>,
    /// Surface triangles.
    pub faces: Vec<[u32; 3]>,
    /// Surface edges.
    pub edges: Vec<[u32; 2]>,
    /// Box of each vertex.
    pub body: Vec<u32>,
    /// Walls: unit normal and offset of half-spaces.
    pub walls: Vec<(Vec3, f64)>,
}

/// Vertices per box.
pub const BOX_VERTICES: usize = 60;

impl Boxes {
    /// `across` x `across` boxes per layer, turned by a fixed sequence of angles, in a container that just holds them.
    pub fn new(across: usize, layers: usize, seed: u64) -> Boxes {
        let one = solid_box([-0.1, -0.15, -0.2], [2, 3, 4], 0.1);
        let one_faces = boundary_faces(&one.tetrahedra);
        let spacing = 0.55;
        let half = 0.5 * spacing * across as f64;
        let mut boxes = Boxes {
            rest: Tetrahedra::default(),
            start: Vec::new(),
            faces: Vec::new(),
            edges: Vec::new(),
            body: Vec::new(),
            walls: vec![([0.0, 0.0, 1.0], 0.0)],
        };
        for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
            let mut normal = [0.0; 3];
            normal[axis] = sign;
            boxes.walls.push((normal, -half));
        }
        let mut random = Sequence(seed);
        for number in 0..across * across * layers {
            let (layer, i, j) = (number / (across * across), number / across % across, number % across);
            let place = |k: usize| spacing * (k as f64 + 0.5) - half;
            let centre = [place(i), place(j), 0.32 + 0.5 * layer as f64];
            let turn = rotation(0.5 * random.next(), 0.5 * random.next(), 3.0 * random.next());
            let first = boxes.start.len() as u32;
            boxes.start.extend(one.positions.iter().map(|p| add(centre, mat_vec(&turn, *p))));
            boxes.rest.positions.extend(&one.positions);
            boxes.rest.tetrahedra.extend(one.tetrahedra.iter().map(|t| t.map(|v| v + first)));
            boxes.faces.extend(one_faces.iter().map(|f| f.map(|v| v + first)));
            boxes.body.resize(boxes.start.len(), number as u32);
        }
        boxes.edges = edges_of(&boxes.faces);
        boxes
    }

    /// Pairs of boxes, and of boxes and walls, nearer than `range`.
    pub fn pairs(&self, x: &[Vec3], range: f64) -> Vec<Pair> {
        let count = self.body.last().map_or(0, |b| *b as usize + 1);
        let (no, never) = (vec![false; count], vec![false; count]);
        let surfaces = Surfaces {
            faces: &self.faces,
            edges: &self.edges,
            body: &self.body,
            self_contact: &no,
            prescribed: &never,
        };
        let mut out = pairs(x, &surfaces, range);
        for (normal, offset) in &self.walls {
            out.extend(half_space_pairs(x, *normal, *offset, range));
        }
        out
    }

    /// Positions and velocities after `steps` steps of `dt` with springs in place of contact: a start for problems.
    pub fn heaped(&self, body: &Deformable, steps: usize, dt: f64) -> (Vec<Vec3>, Vec<Vec3>) {
        let (mut x, mut v) = (self.start.clone(), vec![[0.0; 3]; self.start.len()]);
        let (thickness, spring) = (0.02, 3e5);
        for _ in 0..steps {
            let step = body.linear_step(&x, &v, [0.0, 0.0, -9.81], dt);
            let mut close = self.pairs(&x, 0.08);
            close.retain(|p| p.distance + dt * dot(p.normal, relative(p, &step.velocities)) < thickness);
            let mut b = step.right_hand_side.clone();
            for p in &close {
                spread(p, dt * spring * (thickness - p.distance), &mut b);
            }
            let apply = |u: &[Vec3], out: &mut [Vec3]| {
                step.matrix.product(u, out, Par::Serial);
                for p in &close {
                    spread(p, dt * dt * spring * dot(p.normal, relative(p, u)), out);
                }
            };
            v = step.velocities.clone();
            solve_operator(apply, &inverse_diagonal(&step.matrix), &b, &mut v, 1e-4, 500);
            for (x, v) in x.iter_mut().zip(&v) {
                *x = add_scaled(*x, dt, *v);
            }
        }
        (x, v)
    }
}

fn relative(pair: &Pair, v: &[Vec3]) -> Vec3 {
    let entries = pair.vertices.iter().zip(pair.weights).filter(|(_, w)| *w != 0.0);
    entries.fold([0.0; 3], |u, (i, w)| add_scaled(u, w, v[*i as usize]))
}

fn spread(pair: &Pair, size: f64, out: &mut [Vec3]) {
    for (i, w) in pair.vertices.iter().zip(pair.weights).filter(|(_, w)| *w != 0.0) {
        out[*i as usize] = add(out[*i as usize], scale(size * w, pair.normal));
    }
}

/// Numbers in [-1, 1) from a 64-bit mixing sequence.
pub struct Sequence(pub u64);

impl Sequence {
    /// The next number.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Turn about x, then y, then z.
pub fn rotation(a: f64, b: f64, c: f64) -> Mat3 {
    let about = |axis: usize, angle: f64| {
        let (s, k) = angle.sin_cos();
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut m = [[0.0; 3]; 3];
        m[axis][axis] = 1.0;
        (m[i][i], m[j][j], m[i][j], m[j][i]) = (k, k, -s, s);
        m
    };
    mat_mul(&about(2, c), &mat_mul(&about(1, b), &about(0, a)))
}
