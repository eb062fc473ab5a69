//! Configurations of nodes: near rest, far from it, mirrored, and nearly degenerate.

use crate::random::Random;
use signorini::kinematics::Pose;
use signorini::math::{Vec3, add, add_scaled};

pub fn pose(random: &mut Random) -> Pose {
    Pose::IDENTITY.advanced(random.vector(), random.vector().map(|c| 3.0 * c), 1.0)
}

/// The rest nodes turned, with noise of a relative size.
pub fn near<const N: usize>(rest: &[Vec3; N], noise: f64, random: &mut Random) -> [Vec3; N] {
    let pose = pose(random);
    rest.map(|p| add_scaled(pose.transform(p), noise, random.vector()))
}

/// The rest nodes mirrored in a plane, turned, with noise.
pub fn mirrored<const N: usize>(rest: &[Vec3; N], noise: f64, random: &mut Random) -> [Vec3; N] {
    near(&rest.map(|[x, y, z]| [x, y, -0.8 * z]), noise, random)
}

/// The rest nodes pressed to a share of their height over a plane that is not an axis.
pub fn pressed<const N: usize>(rest: &[Vec3; N], share: f64, random: &mut Random) -> [Vec3; N] {
    let pose = pose(random);
    let pressed = rest.map(|p| {
        let q = pose.transform(p);
        [q[0], q[1], share * q[2]]
    });
    let shift = random.vector();
    pressed.map(|p| add(p, shift))
}

pub fn tetrahedron(random: &mut Random) -> [Vec3; 4] {
    let corner = random.vector();
    let jitter = |p: Vec3, r: &mut Random| add(corner, add_scaled(p, 0.2, r.vector()));
    [
        jitter([0.0; 3], random),
        jitter([1.0, 0.0, 0.0], random),
        jitter([0.0, 1.0, 0.0], random),
        jitter([0.0, 0.0, 1.0], random),
    ]
}

pub fn triangle(random: &mut Random) -> [Vec3; 3] {
    let [a, b, c, _] = tetrahedron(random);
    [a, b, c]
}

/// Two triangles over the edge 0 1.
pub fn hinge(random: &mut Random) -> [Vec3; 4] {
    let pose = pose(random);
    let fold = random.between(-1.2, 1.2);
    let nodes = [[0.0; 3], [1.0, 0.0, 0.0], [0.4, 0.8, 0.0], [0.6, -0.7 * fold.cos(), 0.7 * fold.sin()]];
    nodes.map(|p| pose.transform(add_scaled(p, 0.15, random.vector())))
}
