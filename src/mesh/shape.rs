//! Shapes as meshes. The only file that names parry: its hulls, rings and mass properties, checked here.

use super::mass_properties::check_density;
use super::surface::MeshError;
use super::{MassProperties, Surface, open_half_edges};
use crate::geometry::{edge_edge, point_edge, point_triangle};
use crate::math::{Mat3, Vec3, add, cross, dot, norm, norm_squared, scale, sub};
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{Ball, Capsule, Cone, Cuboid, Cylinder, Shape as _};
use parry3d_f64::transformation::try_convex_hull;

/// A shape in its own frame; the axis of round shapes is y.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A sphere about the origin.
    Sphere {
        /// Radius `[m]`.
        radius: f64,
    },
    /// A box about the origin.
    Box {
        /// Half of each side `[m]`.
        half_extents: Vec3,
    },
    /// All points within `radius` of the segment from `(0, -half_height, 0)` to `(0, half_height, 0)`.
    Capsule {
        /// Radius `[m]`.
        radius: f64,
        /// Half of the segment; 0 gives a sphere `[m]`.
        half_height: f64,
    },
    /// A cylinder about the origin.
    Cylinder {
        /// Radius `[m]`.
        radius: f64,
        /// Half of the height `[m]`.
        half_height: f64,
    },
    /// A cone with its tip at `(0, half_height, 0)` and its base at `y = -half_height`.
    Cone {
        /// Radius of the base `[m]`.
        radius: f64,
        /// Half of the height `[m]`.
        half_height: f64,
    },
    /// The convex hull of points `[m]`.
    ConvexHull(
        /// At least four points that do not lie in a plane.
        Vec<Vec3>,
    ),
    /// A height field over the rectangle `size` about the origin, up being y. A surface, not a solid: it has no mass.
    HeightField {
        /// Heights `[m]`, row after row; rows follow each other along z, the values of a row along x.
        heights: Vec<f64>,
        /// Number of rows, at least 2; `heights` divides into them.
        rows: usize,
        /// Sides along x and z `[m]`.
        size: [f64; 2],
    },
}

/// Vertices of a tessellation at most; a tolerance that needs more is refused.
const VERTICES_MAX: usize = 1 << 22;

impl Shape {
    /// A mesh of the shape in its frame: vertices on the shape, no point of a face farther from the shape than
    /// `tolerance` `[m]`, nor any point of the shape farther from the mesh; closed and wound outward, except for the
    /// height field, which is open and wound upward. Boxes, hulls and height fields are exact.
    ///
    /// Errors: a size or tolerance that is not positive and finite, a hull without volume, a height field without
    /// rows, a tolerance so fine that it needs more than four million vertices. Cost: linear in the mesh.
    pub fn tessellate(&self, tolerance: f64) -> Result<Surface, MeshError> {
        self.check()?;
        positive(tolerance, "a tolerance must be positive and finite")?;
        match self {
            Shape::Sphere { radius } => sphere(*radius, tolerance),
            Shape::Capsule { radius, half_height } if *half_height == 0.0 => sphere(*radius, tolerance),
            Shape::Capsule { radius, half_height } => capsule(*radius, *half_height, tolerance),
            Shape::Box { half_extents } => outward(Cuboid::new(vector(*half_extents)).to_trimesh()),
            Shape::Cylinder { radius, half_height } => {
                outward(Cylinder::new(*half_height, *radius).to_trimesh(sides(*radius, tolerance)?))
            }
            Shape::Cone { radius, half_height } => {
                outward(Cone::new(*half_height, *radius).to_trimesh(sides(*radius, tolerance)?))
            }
            Shape::ConvexHull(points) => hull(points),
            Shape::HeightField { heights, rows, size } => height_field(heights, *rows, *size),
        }
    }

    /// Mass, centre and inertia of the shape itself, not of a mesh of it, for a density `[kg/m^3]`.
    ///
    /// Errors: those of [`Shape::tessellate`]; a density that is not positive and finite; a height field.
    pub fn mass_properties(&self, density: f64) -> Result<MassProperties, MeshError> {
        self.check()?;
        check_density(density)?;
        let found = match self {
            Shape::Sphere { radius } => Ball::new(*radius).mass_properties(density),
            Shape::Box { half_extents } => Cuboid::new(vector(*half_extents)).mass_properties(density),
            Shape::Capsule { radius, half_height } => Capsule::new_y(*half_height, *radius).mass_properties(density),
            Shape::Cylinder { radius, half_height } => Cylinder::new(*half_height, *radius).mass_properties(density),
            Shape::Cone { radius, half_height } => Cone::new(*half_height, *radius).mass_properties(density),
            Shape::ConvexHull(points) => return MassProperties::of_closed_mesh(&hull(points)?, density),
            Shape::HeightField { .. } => {
                return Err(MeshError::new(0, f64::NAN, "a height field bounds no volume and has no mass"));
            }
        };
        let m = found.reconstruct_inertia_matrix();
        let row = |i: usize| -> Vec3 { [m.x_axis[i], m.y_axis[i], m.z_axis[i]] };
        let inertia: Mat3 = [row(0), row(1), row(2)];
        Ok(MassProperties { mass: found.mass(), centre: plain(&found.local_com), inertia })
    }

    /// Sizes positive and finite, arrays of the right length.
    fn check(&self) -> Result<(), MeshError> {
        let size = |value: f64| positive(value, "a size must be positive and finite");
        match self {
            Shape::Sphere { radius } => size(*radius),
            Shape::Box { half_extents } => half_extents.iter().try_for_each(|h| size(*h)),
            Shape::Capsule { radius, half_height } if *half_height == 0.0 => size(*radius),
            Shape::Capsule { radius, half_height }
            | Shape::Cylinder { radius, half_height }
            | Shape::Cone { radius, half_height } => size(*radius).and(size(*half_height)),
            Shape::ConvexHull(points) => finite(points.iter().flatten(), 3),
            Shape::HeightField { heights, rows, size: sides } => {
                if *rows < 2 || heights.len() < 2 * rows || heights.len() % rows != 0 {
                    let message = "heights must divide into at least two rows of at least two";
                    return Err(MeshError::new(heights.len(), *rows as f64, message));
                }
                sides.iter().try_for_each(|s| size(*s))?;
                finite(heights.iter(), 1)
            }
        }
    }
}

fn positive(value: f64, message: &'static str) -> Result<(), MeshError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(MeshError::new(0, value, message)) }
}

fn finite<'a>(values: impl Iterator<Item = &'a f64>, width: usize) -> Result<(), MeshError> {
    for (i, value) in values.enumerate() {
        if !value.is_finite() {
            return Err(MeshError::new(i / width, *value, "a value is not finite"));
        }
    }
    Ok(())
}

fn vector(x: Vec3) -> Vector {
    Vector::new(x[0], x[1], x[2])
}

fn plain(x: &Vector) -> Vec3 {
    [x.x, x.y, x.z]
}

/// A closed surface, turned so that it bounds a positive volume.
fn outward((vertices, mut faces): (Vec<Vector>, Vec<[u32; 3]>)) -> Result<Surface, MeshError> {
    let rest: Vec<Vec3> = vertices.iter().map(plain).collect();
    if let Some(edge) = open_half_edges(&faces).first() {
        return Err(MeshError::new(edge[0] as usize, f64::from(edge[1]), "the hull of these points is not closed"));
    }
    let inside = rest.iter().fold([0.0; 3], |s, x| add(s, scale(1.0 / rest.len() as f64, *x)));
    let volume = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| sub(rest[v as usize], inside));
        dot(a, cross(b, c))
    };
    if faces.iter().map(volume).sum::<f64>() < 0.0 {
        faces.iter_mut().for_each(|f| f.swap(0, 1));
    }
    Surface::from_triangles(rest, faces)
}

const TOO_FINE: &str = "the tolerance needs too many vertices";

/// Sides of a polygon inscribed in a circle that strays at most `tolerance` from it; at least eight.
fn sides(radius: f64, tolerance: f64) -> Result<u32, MeshError> {
    let relative = (tolerance / radius).min(1.0);
    // 1 - cos(pi/n) <= relative, by the half angle: no digits are lost for fine tolerances.
    let half = (0.5 * relative).sqrt().asin();
    let count = (0.5 * std::f64::consts::PI / half).ceil().max(8.0);
    if count > (VERTICES_MAX / 2) as f64 {
        return Err(MeshError::new(0, tolerance, TOO_FINE));
    }
    Ok(count as u32)
}

/// The icosahedron with each face divided into `f^2`, pushed out to the sphere; the smallest `f` that keeps the
/// tolerance, give or take a thirtieth.
fn sphere(radius: f64, tolerance: f64) -> Result<Surface, MeshError> {
    let relative = (tolerance / radius).min(1.0);
    // A whole face of the icosahedron spans an angle of 0.652 from its centre.
    let mut f = (0.652 / (2.0 * (0.5 * relative).sqrt().asin())).floor().max(2.0);
    loop {
        if 10.0 * f * f > VERTICES_MAX as f64 {
            return Err(MeshError::new(0, tolerance, TOO_FINE));
        }
        let (points, faces) = geodesic(f as usize);
        // The centre's distance from the plane of a face bounds both the face's distance from the sphere and that of
        // the part of the sphere above it. Rounding is left out of the tolerance.
        let depth = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            let n = cross(sub(b, a), sub(c, a));
            1.0 - dot(n, a) / norm(n)
        };
        if faces.iter().map(depth).fold(0.0, f64::max) <= relative * (1.0 - 1e-6) || relative == 1.0 {
            return Surface::from_triangles(points.iter().map(|x| scale(radius, *x)).collect(), faces);
        }
        f += (f / 32.0).floor().max(1.0);
    }
}

/// Unit vectors and outward faces of the icosahedron with divided faces.
fn geodesic(f: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::with_capacity(12);
    for k in 0..3 {
        for (s, t) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
            let mut x = [0.0; 3];
            (x[k], x[(k + 1) % 3]) = (s, t);
            corners.push(x);
        }
    }
    let edge = |i: usize, j: usize| norm_squared(sub(corners[i], corners[j])) < 4.5 && i != j;
    let mut numbers = std::collections::BTreeMap::new();
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for (i, j, k) in (0..12).flat_map(|i| (i + 1..12).flat_map(move |j| (j + 1..12).map(move |k| (i, j, k)))) {
        if !(edge(i, j) && edge(j, k) && edge(i, k)) {
            continue;
        }
        let outward = dot(corners[i], cross(corners[j], corners[k])) > 0.0;
        let [a, b, c] = if outward { [i, j, k] } else { [i, k, j] };
        // Points of neighbouring faces are the same by their integer weights on the twelve corners.
        let mut number = |u: usize, v: usize| {
            let mut key = [(a, f - u - v), (b, u), (c, v)];
            key.sort_unstable();
            let key = key.map(|(corner, weight)| if weight == 0 { (0, 0) } else { (corner + 1, weight) });
            let mut key = key;
            key.sort_unstable();
            *numbers.entry(key).or_insert_with(|| {
                let sum = key
                    .iter()
                    .filter(|(corner, _)| *corner > 0)
                    .fold([0.0; 3], |s, (corner, weight)| add(s, scale(*weight as f64, corners[*corner - 1])));
                points.push(scale(1.0 / norm(sum), sum));
                points.len() as u32 - 1
            })
        };
        for u in 0..f {
            for v in 0..f - u {
                faces.push([number(u, v), number(u + 1, v), number(u, v + 1)]);
                if u + v + 2 <= f {
                    faces.push([number(u + 1, v), number(u + 1, v + 1), number(u, v + 1)]);
                }
            }
        }
    }
    (points, faces)
}

/// Rings and caps; the number of rings grows until the tolerance is kept.
fn capsule(radius: f64, half_height: f64, tolerance: f64) -> Result<Surface, MeshError> {
    let mut quarter = sides(radius, tolerance)?.div_ceil(4).max(2);
    let (low, high) = ([0.0, -half_height, 0.0], [0.0, half_height, 0.0]);
    loop {
        if 8 * (quarter as usize).pow(2) > VERTICES_MAX {
            return Err(MeshError::new(0, tolerance, TOO_FINE));
        }
        let mesh = outward(Capsule::new_y(half_height, radius).to_trimesh(4 * quarter, 2 * quarter))?;
        let nearest = mesh.faces.iter().map(|f| {
            let [a, b, c] = f.map(|v| mesh.rest[v as usize]);
            axis_distance(low, high, a, b, c)
        });
        if radius - nearest.fold(f64::INFINITY, f64::min) <= tolerance || tolerance >= radius {
            return Ok(mesh);
        }
        quarter += (quarter / 32).max(1);
    }
}

/// Distance of the segment `low high` and a triangle that it does not pierce.
fn axis_distance(low: Vec3, high: Vec3, a: Vec3, b: Vec3, c: Vec3) -> f64 {
    let ends = [low, high].map(|p| point_triangle::distance_squared(p, a, b, c));
    let edges = [(a, b), (b, c), (c, a)].map(|(u, v)| edge_edge::distance_squared(low, high, u, v));
    ends.into_iter().chain(edges).fold(f64::INFINITY, f64::min).sqrt()
}

fn hull(points: &[Vec3]) -> Result<Surface, MeshError> {
    let flat = "a hull needs four points that do not lie in a plane";
    let mut distinct = points.to_vec();
    distinct.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2])));
    distinct.dedup();
    let extent = match (distinct.first(), distinct.last()) {
        (Some(a), Some(_)) => distinct.iter().fold(0.0, |m: f64, x| m.max(norm(sub(*x, *a)))),
        _ => 0.0,
    };
    if distinct.len() < 4 || thickness(&distinct) <= 1e-9 * extent {
        return Err(MeshError::new(points.len(), extent, flat));
    }
    let vectors: Vec<Vector> = distinct.iter().map(|x| vector(*x)).collect();
    let mesh = outward(try_convex_hull(&vectors).map_err(|_| MeshError::new(points.len(), extent, flat))?)?;
    // The hull is trusted only as far as every point is inside all of its planes.
    for f in &mesh.faces {
        let [a, b, c] = f.map(|v| mesh.rest[v as usize]);
        let n = cross(sub(b, a), sub(c, a));
        if let Some(i) = points.iter().position(|p| dot(n, sub(*p, a)) > 1e-9 * extent * norm(n)) {
            let outside = dot(n, sub(points[i], a)) / norm(n);
            return Err(MeshError::new(i, outside, "a point is left outside its hull"));
        }
    }
    Ok(mesh)
}

/// How far the points reach out of the plane through a far pair and the point farthest from their line.
fn thickness(points: &[Vec3]) -> f64 {
    let farthest = |key: &dyn Fn(Vec3) -> f64| {
        points.iter().copied().fold(points[0], |best, x| if key(x) > key(best) { x } else { best })
    };
    let a = points[0];
    let b = farthest(&|x| norm(sub(x, a)));
    let c = farthest(&|x| norm(point_edge::closest_points(x, a, b).separation));
    let n = cross(sub(b, a), sub(c, a));
    let size = norm(n);
    if size == 0.0 {
        return 0.0;
    }
    points.iter().map(|x| (dot(n, sub(*x, a)) / size).abs()).fold(0.0, f64::max)
}

/// Parry's own conversion repeats every inner vertex, which leaves the faces unconnected.
fn height_field(heights: &[f64], rows: usize, size: [f64; 2]) -> Result<Surface, MeshError> {
    let columns = heights.len() / rows;
    let place = |k: usize, count: usize, side: f64| side * (k as f64 / (count - 1) as f64 - 0.5);
    let at = |k: usize| [place(k % columns, columns, size[0]), heights[k], place(k / columns, rows, size[1])];
    let mut faces = Vec::with_capacity(2 * (rows - 1) * (columns - 1));
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let v = (row * columns + column) as u32;
            let below = v + columns as u32;
            faces.extend([[v, below, v + 1], [below, below + 1, v + 1]]);
        }
    }
    Surface::from_triangles((0..heights.len()).map(at).collect(), faces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lerp;

    /// Distance of a point from the surface of a round shape, 0 on it.
    fn off_surface(shape: &Shape, x: Vec3) -> f64 {
        let across = x[0].hypot(x[2]);
        match shape {
            Shape::Sphere { radius } => (norm(x) - radius).abs(),
            Shape::Capsule { radius, half_height } => {
                let y = x[1].clamp(-half_height, *half_height);
                (norm([x[0], x[1] - y, x[2]]) - radius).abs()
            }
            Shape::Cylinder { radius, half_height } => (radius - across).abs().min((half_height - x[1].abs()).abs()),
            Shape::Cone { radius, half_height } => {
                let slant = radius.hypot(2.0 * half_height);
                let side = ((radius - across) * 2.0 * half_height - radius * (x[1] + half_height)) / slant;
                side.abs().min((x[1] + half_height).abs())
            }
            _ => 0.0,
        }
    }

    fn closed_shapes() -> Vec<Shape> {
        let (radius, half_height) = (0.7, 1.3);
        let corner = |k: usize| [(k & 1) as f64, (k >> 1 & 1) as f64 * 2.0, (k >> 2) as f64 * 3.0];
        let mut cloud: Vec<Vec3> = (0..8).map(corner).collect();
        cloud.extend([[0.5, 1.0, 1.5], [0.5, 0.0, 1.0], [0.0, 0.0, 0.0]]);
        vec![
            Shape::Sphere { radius },
            Shape::Capsule { radius, half_height },
            Shape::Capsule { radius, half_height: 0.0 },
            Shape::Cylinder { radius, half_height },
            Shape::Cone { radius, half_height },
            Shape::Box { half_extents: [0.5, 1.0, 1.5] },
            Shape::ConvexHull(cloud),
        ]
    }

    #[test]
    fn meshes_are_closed_on_the_shape_and_within_tolerance() {
        for shape in closed_shapes() {
            let mut before = 0;
            for tolerance in [0.1, 0.01, 0.001] {
                let mesh = shape.tessellate(tolerance).unwrap();
                assert!(open_half_edges(&mesh.faces).is_empty(), "{shape:?}");
                assert!(mesh.degenerate_faces().is_empty() && mesh.validate().is_ok());
                assert!(mesh.rest.iter().all(|x| off_surface(&shape, *x) < 1e-13), "{shape:?}");
                let euler = mesh.rest.len() + mesh.faces.len() - mesh.edges.len();
                assert_eq!(euler, 2, "{shape:?}");
                assert!(mesh.faces.len() >= before);
                before = mesh.faces.len();
                let mut worst: f64 = 0.0;
                for f in &mesh.faces {
                    let [a, b, c] = f.map(|v| mesh.rest[v as usize]);
                    for (u, v) in [(0.5, 0.5), (0.5, 0.0), (0.0, 0.5), (1.0 / 3.0, 1.0 / 3.0), (0.2, 0.2), (0.6, 0.2)] {
                        let x = lerp(lerp(a, b, u), c, v);
                        worst = worst.max(off_surface(&shape, x));
                    }
                }
                assert!(worst <= tolerance, "{shape:?}: {worst} for {tolerance}");
            }
        }
    }

    #[test]
    fn masses_of_shapes_agree_with_closed_forms_and_with_their_meshes() {
        let (r, h) = (0.7_f64, 1.3_f64);
        let pi = std::f64::consts::PI;
        let (ball, tube) = (4.0 / 3.0 * pi * r.powi(3), 2.0 * pi * r * r * h);
        let masses = [ball, ball + tube, ball, tube, tube / 3.0, 8.0 * 0.5 * 1.0 * 1.5, 6.0];
        for (shape, volume) in closed_shapes().iter().zip(masses) {
            let density = 250.0;
            let exact = shape.mass_properties(density).unwrap();
            assert!((exact.mass / (density * volume) - 1.0).abs() < 1e-12, "{shape:?} {exact:?}");
            let tolerance = 1e-4;
            let mesh = MassProperties::of_closed_mesh(&shape.tessellate(tolerance).unwrap(), density).unwrap();
            assert!((mesh.mass / exact.mass - 1.0).abs() < 1e-3, "{shape:?} {mesh:?} {exact:?}");
            assert!(norm(sub(mesh.centre, exact.centre)) < 1e-3, "{shape:?} {mesh:?} {exact:?}");
            let largest = exact.inertia[0][0].max(exact.inertia[1][1]).max(exact.inertia[2][2]);
            for i in 0..3 {
                for j in 0..3 {
                    let difference = mesh.inertia[i][j] - exact.inertia[i][j];
                    assert!(difference.abs() < 1e-3 * largest, "{shape:?} {mesh:?} {exact:?}");
                }
            }
        }
        // Closed forms of the inertia.
        let sphere = Shape::Sphere { radius: r }.mass_properties(1.0).unwrap();
        assert!((sphere.inertia[1][1] - 0.4 * ball * r * r).abs() < 1e-12);
        let cylinder = Shape::Cylinder { radius: r, half_height: h }.mass_properties(1.0).unwrap();
        assert!((cylinder.inertia[1][1] - 0.5 * tube * r * r).abs() < 1e-12);
        assert!((cylinder.inertia[0][0] - tube * (3.0 * r * r + 4.0 * h * h) / 12.0).abs() < 1e-12);
        let cone = Shape::Cone { radius: r, half_height: h }.mass_properties(1.0).unwrap();
        assert!((cone.centre[1] + 0.5 * h).abs() < 1e-12);
        assert!((cone.inertia[1][1] - 0.3 * tube / 3.0 * r * r).abs() < 1e-12);
    }

    #[test]
    fn a_height_field_faces_up() {
        let shape = Shape::HeightField { heights: vec![0.0, 1.0, 2.0, 10.0, 11.0, 12.0], rows: 2, size: [4.0, 6.0] };
        let mesh = shape.tessellate(1.0).unwrap();
        assert_eq!((mesh.rest.len(), mesh.faces.len()), (6, 4));
        for x in &mesh.rest {
            // Along x from -2 to 2 by one each, along z from -3 to 3 by ten.
            assert!((x[1] - ((x[0] + 2.0) / 2.0 + (x[2] + 3.0) / 6.0 * 10.0)).abs() < 1e-12, "{x:?}");
        }
        for f in &mesh.faces {
            let [a, b, c] = f.map(|v| mesh.rest[v as usize]);
            assert!(cross(sub(b, a), sub(c, a))[1] > 0.0);
        }
        assert!(shape.mass_properties(1.0).is_err());
    }

    #[test]
    fn shapes_that_are_none_are_refused() {
        assert!(Shape::Sphere { radius: 0.0 }.tessellate(0.1).is_err());
        assert!(Shape::Sphere { radius: 1.0 }.tessellate(0.0).is_err());
        assert_eq!(Shape::Sphere { radius: 1.0 }.tessellate(1e-9).unwrap_err().message, TOO_FINE);
        assert!(Shape::Box { half_extents: [1.0, f64::NAN, 1.0] }.tessellate(0.1).is_err());
        let flat = (0..9).map(|k| [(k % 3) as f64, (k / 3) as f64, 0.0]).collect();
        assert!(Shape::ConvexHull(flat).tessellate(0.1).is_err());
        assert!(Shape::ConvexHull(vec![]).tessellate(0.1).is_err());
        assert!(Shape::ConvexHull(vec![[1.0; 3]; 9]).tessellate(0.1).is_err());
        let ragged = Shape::HeightField { heights: vec![0.0; 5], rows: 2, size: [1.0, 1.0] };
        assert!(ragged.tessellate(0.1).is_err());
        assert!(Shape::Cone { radius: 1.0, half_height: 1.0 }.mass_properties(f64::INFINITY).is_err());
    }
}
