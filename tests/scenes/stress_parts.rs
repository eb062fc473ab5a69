//! Bodies of stress scenes before they are built.

use super::support::shapes::{cloth_grid, sphere};
use signorini::kinematics::Pose;
use signorini::math::{Vec3, unit};

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

pub fn wire(n: usize, length: f64) -> Part {
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
