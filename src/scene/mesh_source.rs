//! Meshes from formulas and files.

use super::fault::FieldFault;
use super::file::positive;
use crate::math::{Vec3, cross, dot, norm, scale, sub};
use crate::mesh::{Shape, TetMesh};
use serde::Deserialize;
use std::path::Path;

/// Where a mesh comes from.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MeshSource {
    /// A sheet in the plane z = 0 about the origin, its diagonals alternating.
    Grid { cells: [usize; 2], size: [f64; 2] },
    /// A sheet rolled up about the y axis, open at both ends.
    Tube { cells: [usize; 2], radius: f64, height: f64 },
    /// Points (distance from the axis, height), turned about the y axis: funnels, cups, vases. Ends on the axis close it.
    Revolved { profile: Vec<[f64; 2]>, segments: usize },
    /// Points (x, y), drawn out along z about the origin: troughs, steps, plates bent along lines.
    Extruded { profile: Vec<[f64; 2]>, length: f64, cells: usize },
    /// A box about the origin; faces are two triangles, or `cells` squares of two triangles along each axis.
    Box { size: Vec3, cells: Option<[usize; 3]> },
    /// A sphere about the origin, no farther from the true one than `tolerance`.
    Sphere { radius: f64, tolerance: f64 },
    /// A cylinder about the y axis, no farther from the true one than `tolerance`.
    Cylinder { radius: f64, height: f64, tolerance: f64 },
    /// A ring about the y axis: `radius` to the middle of the tube, segments around the axis and around the tube.
    Torus { radius: f64, tube: f64, segments: [usize; 2] },
    /// A four-sided pyramid with its tip at the origin, its base `height` above it along y.
    Needle { width: f64, height: f64 },
    /// Triangles and polygons of an OBJ file.
    Obj { file: String },
    /// A box of tetrahedra about the origin, six to a cell.
    BoxTetrahedra { cells: [usize; 3], size: Vec3 },
    /// A cylinder of tetrahedra about the y axis: cells across, along.
    CylinderTetrahedra { cells: [usize; 2], radius: f64, height: f64 },
    /// Tetrahedra of a Gmsh file, version 2.2, text.
    Gmsh { file: String },
    /// Coarse tetrahedra around the surface that a solid carries, in cells of at most this size.
    Cage { cell: Vec3 },
    /// A part of a ring about the y axis, `degrees` wide around +x: `radius` to the middle of its thickness.
    Voussoir { radius: f64, thickness: f64, degrees: f64, depth: f64 },
}

/// A mesh: triangles or tetrahedra.
#[derive(Clone, Debug, Default)]
pub struct SourceMesh {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub tetrahedra: Vec<[u32; 4]>,
}

/// A number with the name of its field.
type Named<T> = (&'static str, T);

impl MeshSource {
    pub fn check(&self, at: &str) -> Result<(), FieldFault> {
        let (kind, lengths, counts): (&str, Vec<Named<f64>>, Vec<Named<usize>>) = match self {
            MeshSource::Grid { cells, size } => {
                ("grid", size.map(|s| ("size", s)).to_vec(), cells.map(|c| ("cells", c)).to_vec())
            }
            MeshSource::Tube { cells, radius, height } => {
                let counts = vec![("cells", cells[0] / 3), ("cells", cells[1])];
                ("tube", vec![("radius", *radius), ("height", *height)], counts)
            }
            MeshSource::Revolved { profile, segments } => {
                let last = profile.len().saturating_sub(1);
                let fits = |(i, [r, y]): (usize, &[f64; 2])| {
                    r.is_finite() && y.is_finite() && (*r > 0.0 || *r == 0.0 && (i == 0 || i == last))
                };
                if let Some(i) = profile.iter().enumerate().position(|(i, point)| !fits((i, point))) {
                    let field = format!("{at}.revolved.profile[{i}]");
                    return Err(FieldFault::new(field, "finite and off the axis, which only ends may touch"));
                }
                ("revolved", vec![], vec![("profile", last), ("segments", segments / 3)])
            }
            MeshSource::Extruded { profile, length, cells } => {
                if let Some(i) = profile.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
                    return Err(FieldFault::new(format!("{at}.extruded.profile[{i}]"), "not finite"));
                }
                let counts = vec![("profile", profile.len().saturating_sub(1)), ("cells", *cells)];
                ("extruded", vec![("length", *length)], counts)
            }
            MeshSource::Box { size, cells } => {
                ("box", size.map(|s| ("size", s)).to_vec(), cells.iter().flatten().map(|c| ("cells", *c)).collect())
            }
            MeshSource::Sphere { radius, tolerance } => {
                ("sphere", vec![("radius", *radius), ("tolerance", *tolerance)], vec![])
            }
            MeshSource::Cylinder { radius, height, tolerance } => {
                ("cylinder", vec![("radius", *radius), ("height", *height), ("tolerance", *tolerance)], vec![])
            }
            MeshSource::Torus { radius, tube, segments } => {
                let lengths = vec![("tube", *tube), ("radius", *radius), ("radius", radius - tube)];
                ("torus", lengths, segments.map(|s| ("segments", s / 3)).to_vec())
            }
            MeshSource::Needle { width, height } => ("needle", vec![("width", *width), ("height", *height)], vec![]),
            MeshSource::BoxTetrahedra { cells, size } => {
                ("box_tetrahedra", size.map(|s| ("size", s)).to_vec(), cells.map(|c| ("cells", c)).to_vec())
            }
            MeshSource::CylinderTetrahedra { cells, radius, height } => {
                let counts = cells.map(|c| ("cells", c)).to_vec();
                ("cylinder_tetrahedra", vec![("radius", *radius), ("height", *height)], counts)
            }
            MeshSource::Cage { cell } => ("cage", cell.map(|c| ("cell", c)).to_vec(), vec![]),
            MeshSource::Voussoir { radius, thickness, degrees, depth } => {
                let lengths = vec![
                    ("radius", *radius),
                    ("thickness", *thickness),
                    ("thickness", 2.0 * radius - thickness),
                    ("degrees", *degrees),
                    ("degrees", 180.0 - degrees),
                    ("depth", *depth),
                ];
                ("voussoir", lengths, vec![])
            }
            MeshSource::Obj { .. } | MeshSource::Gmsh { .. } => return Ok(()),
        };
        let at = format!("{at}.{kind}");
        for (name, value) in lengths {
            positive(value, &at, name)?;
        }
        match counts.iter().find(|(_, count)| *count == 0) {
            Some((name, _)) => Err(FieldFault::new(format!("{at}.{name}"), "too few to make a mesh")),
            None => Ok(()),
        }
    }

    /// The mesh; files are sought from `folder`. Errors name the field below `at`, and for files their line.
    pub fn mesh(&self, folder: &Path, at: &str) -> Result<SourceMesh, FieldFault> {
        let shape = |shape: Shape, tolerance: f64, field: &str| {
            let surface =
                shape.tessellate(tolerance).map_err(|e| FieldFault::new(format!("{at}.{field}"), e.to_string()))?;
            Ok(triangles(surface.rest, surface.faces))
        };
        match self {
            MeshSource::Grid { cells, size } => Ok(grid(*cells, *size)),
            MeshSource::Tube { cells, radius, height } => Ok(tube(*cells, *radius, *height)),
            MeshSource::Revolved { profile, segments } => Ok(revolved(profile, *segments)),
            MeshSource::Extruded { profile, length, cells } => Ok(extruded(profile, *length, *cells)),
            MeshSource::Box { size, cells: None } => {
                shape(Shape::Box { half_extents: scale(0.5, *size) }, norm(*size), "box")
            }
            MeshSource::Box { size, cells: Some(cells) } => {
                let solid = box_tetrahedra(*cells, *size);
                let boundary = TetMesh::new(solid.positions.clone(), solid.tetrahedra).and_then(|mesh| mesh.boundary());
                let boundary = boundary.map_err(|e| FieldFault::new(format!("{at}.box"), e.to_string()))?;
                Ok(without_loose_vertices(solid.positions, boundary))
            }
            MeshSource::Sphere { radius, tolerance } => shape(Shape::Sphere { radius: *radius }, *tolerance, "sphere"),
            MeshSource::Cylinder { radius, height, tolerance } => {
                shape(Shape::Cylinder { radius: *radius, half_height: 0.5 * height }, *tolerance, "cylinder")
            }
            MeshSource::Torus { radius, tube, segments } => Ok(torus(*radius, *tube, *segments)),
            MeshSource::Needle { width, height } => Ok(needle(*width, *height)),
            MeshSource::Obj { file } => read(folder, file, &format!("{at}.obj.file"), parse_obj),
            MeshSource::BoxTetrahedra { cells, size } => Ok(box_tetrahedra(*cells, *size)),
            MeshSource::CylinderTetrahedra { cells, radius, height } => {
                Ok(cylinder_tetrahedra(*cells, *radius, *height))
            }
            MeshSource::Gmsh { file } => read(folder, file, &format!("{at}.gmsh.file"), parse_gmsh),
            MeshSource::Cage { .. } => Err(FieldFault::new(
                format!("{at}.cage"),
                "a cage goes around the surface of a solid, and there is none",
            )),
            MeshSource::Voussoir { radius, thickness, degrees, depth } => {
                let (inner, outer) = (radius - 0.5 * thickness, radius + 0.5 * thickness);
                let place = |u: Vec3| {
                    let (s, c) = ((u[0] - 0.5) * degrees).to_radians().sin_cos();
                    let r = inner + u[2] * (outer - inner);
                    [r * c, (u[1] - 0.5) * depth, -r * s]
                };
                let solid = lattice([1, 1, 1], place);
                let boundary = TetMesh::new(solid.positions.clone(), solid.tetrahedra).and_then(|mesh| mesh.boundary());
                let boundary = boundary.map_err(|e| FieldFault::new(format!("{at}.voussoir"), e.to_string()))?;
                Ok(triangles(solid.positions, boundary))
            }
        }
    }

    /// The source with `word` in the place of `*` in its file's name.
    pub fn with_word(&self, word: &str) -> MeshSource {
        match self {
            MeshSource::Obj { file } => MeshSource::Obj { file: file.replace('*', word) },
            MeshSource::Gmsh { file } => MeshSource::Gmsh { file: file.replace('*', word) },
            other => other.clone(),
        }
    }
}

fn triangles(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> SourceMesh {
    SourceMesh { positions, triangles, tetrahedra: Vec::new() }
}

/// Two triangles per cell over `(columns + 1) x (rows + 1)` vertices, row after row, diagonals alternating.
fn cell_faces(columns: usize, rows: usize, at: impl Fn(usize, usize) -> u32) -> Vec<[u32; 3]> {
    let mut faces = Vec::with_capacity(2 * columns * rows);
    for i in 0..columns {
        for j in 0..rows {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            faces.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    faces
}

fn grid(cells: [usize; 2], size: [f64; 2]) -> SourceMesh {
    let [columns, rows] = cells;
    let place = |i: usize, n: usize, length: f64| length * (i as f64 / n as f64 - 0.5);
    let mut positions = Vec::with_capacity((columns + 1) * (rows + 1));
    for i in 0..=columns {
        for j in 0..=rows {
            positions.push([place(i, columns, size[0]), place(j, rows, size[1]), 0.0]);
        }
    }
    triangles(positions, cell_faces(columns, rows, |i, j| (i * (rows + 1) + j) as u32))
}

fn tube(cells: [usize; 2], radius: f64, height: f64) -> SourceMesh {
    let [around, along] = cells;
    let mut positions = Vec::with_capacity(around * (along + 1));
    for i in 0..around {
        let (s, c) = (std::f64::consts::TAU * i as f64 / around as f64).sin_cos();
        positions.extend((0..=along).map(|j| [radius * c, height * (j as f64 / along as f64 - 0.5), -radius * s]));
    }
    // Seen from outside, y goes up where the angle goes to the right: first along, then around would wind inward.
    triangles(positions, cell_faces(around, along, |i, j| (i % around * (along + 1) + j) as u32))
}

/// Around the axis, and along the profile as it is given: seen from outside where its heights rise.
fn revolved(profile: &[[f64; 2]], segments: usize) -> SourceMesh {
    let mut positions = Vec::new();
    let mut first = Vec::new();
    for [r, y] in profile {
        first.push(positions.len());
        for i in 0..if *r > 0.0 { segments } else { 1 } {
            let (s, c) = (std::f64::consts::TAU * i as f64 / segments as f64).sin_cos();
            positions.push([r * c, *y, -r * s]);
        }
    }
    let at = |i: usize, j: usize| (first[j] + if profile[j][0] > 0.0 { i % segments } else { 0 }) as u32;
    let mut faces = cell_faces(segments, profile.len() - 1, at);
    // Cells at a point on the axis have one face only.
    faces.retain(|[a, b, c]| a != b && b != c && c != a);
    triangles(positions, faces)
}

fn extruded(profile: &[[f64; 2]], length: f64, cells: usize) -> SourceMesh {
    let along = |k: usize| length * (k as f64 / cells as f64 - 0.5);
    let row = |[x, y]: &[f64; 2]| (0..=cells).map(|k| [*x, *y, along(k)]).collect::<Vec<Vec3>>();
    let positions = profile.iter().flat_map(row).collect();
    triangles(positions, cell_faces(profile.len() - 1, cells, |i, j| (i * (cells + 1) + j) as u32))
}

fn torus(radius: f64, tube: f64, segments: [usize; 2]) -> SourceMesh {
    let [around, along] = segments;
    let mut positions = Vec::with_capacity(around * along);
    for i in 0..around {
        let (s, c) = (std::f64::consts::TAU * i as f64 / around as f64).sin_cos();
        for j in 0..along {
            let (t, k) = (std::f64::consts::TAU * j as f64 / along as f64).sin_cos();
            let r = radius + tube * k;
            positions.push([r * c, tube * t, -r * s]);
        }
    }
    triangles(positions, cell_faces(around, along, |i, j| (i % around * along + j % along) as u32))
}

fn needle(width: f64, height: f64) -> SourceMesh {
    let h = 0.5 * width;
    let positions = vec![[0.0; 3], [h, height, h], [h, height, -h], [-h, height, -h], [-h, height, h]];
    triangles(positions, vec![[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [1, 2, 3], [1, 3, 4]])
}

/// Kuhn's division: a tetrahedron per order in which the three axes are walked from corner to corner.
fn kuhn(cells: [usize; 3], at: impl Fn([usize; 3]) -> u32, positions: &[Vec3]) -> Vec<[u32; 4]> {
    let mut tetrahedra = Vec::with_capacity(6 * cells.iter().product::<usize>());
    for cell in 0..cells.iter().product::<usize>() {
        let corner = [cell / (cells[1] * cells[2]), cell / cells[2] % cells[1], cell % cells[2]];
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let (mut here, mut walk) = (corner, [at(corner); 4]);
            for (step, axis) in order.into_iter().enumerate() {
                here[axis] += 1;
                walk[step + 1] = at(here);
            }
            let edge = |n: usize| sub(positions[walk[n] as usize], positions[walk[0] as usize]);
            if dot(cross(edge(1), edge(2)), edge(3)) < 0.0 {
                walk.swap(2, 3);
            }
            tetrahedra.push(walk);
        }
    }
    tetrahedra
}

/// Vertices of a lattice of cells, each placed by `f` of its three fractions.
pub fn lattice(cells: [usize; 3], f: impl Fn(Vec3) -> Vec3) -> SourceMesh {
    let mut positions = Vec::new();
    for i in 0..=cells[0] {
        for j in 0..=cells[1] {
            for k in 0..=cells[2] {
                let share = |n: usize, of: usize| n as f64 / of as f64;
                positions.push(f([share(i, cells[0]), share(j, cells[1]), share(k, cells[2])]));
            }
        }
    }
    let at = |c: [usize; 3]| ((c[0] * (cells[1] + 1) + c[1]) * (cells[2] + 1) + c[2]) as u32;
    let tetrahedra = kuhn(cells, at, &positions);
    SourceMesh { positions, triangles: Vec::new(), tetrahedra }
}

fn box_tetrahedra(cells: [usize; 3], size: Vec3) -> SourceMesh {
    lattice(cells, |u| [0, 1, 2].map(|k| size[k] * (u[k] - 0.5)))
}

/// Squares within squares are drawn out to circles within circles.
fn cylinder_tetrahedra(cells: [usize; 2], radius: f64, height: f64) -> SourceMesh {
    lattice([cells[0], cells[1], cells[0]], |u| {
        let (x, z) = (2.0 * u[0] - 1.0, 2.0 * u[2] - 1.0);
        let length = x.hypot(z);
        let stretch = if length > 0.0 { radius * x.abs().max(z.abs()) / length } else { 0.0 };
        [stretch * x, height * (u[1] - 0.5), stretch * z]
    })
}

fn without_loose_vertices(positions: Vec<Vec3>, mut faces: Vec<[u32; 3]>) -> SourceMesh {
    let kept = used(&positions, faces.iter_mut().flatten());
    triangles(kept, faces)
}

/// The positions that corners name, in their order; the corners are numbered anew.
pub fn used<'a>(positions: &[Vec3], corners: impl Iterator<Item = &'a mut u32>) -> Vec<Vec3> {
    let corners: Vec<&mut u32> = corners.collect();
    let mut place = vec![u32::MAX; positions.len()];
    corners.iter().for_each(|v| place[**v as usize] = 0);
    let mut kept = Vec::new();
    for (x, place) in positions.iter().zip(&mut place).filter(|(_, place)| **place == 0) {
        *place = kept.len() as u32;
        kept.push(*x);
    }
    corners.into_iter().for_each(|v| *v = place[*v as usize]);
    kept
}

type Parser = fn(&str) -> Result<SourceMesh, (usize, String)>;

fn read(folder: &Path, file: &str, at: &str, parse: Parser) -> Result<SourceMesh, FieldFault> {
    let path = folder.join(file);
    let fault = |message: String| FieldFault::new(at, format!("{}{message}", path.display()));
    let text = std::fs::read_to_string(&path).map_err(|error| fault(format!(": {error}")))?;
    let mesh = parse(&text).map_err(|(line, message)| fault(format!(":{line}: {message}")))?;
    if mesh.positions.is_empty() {
        return Err(fault(": no vertices".to_string()));
    }
    Ok(mesh)
}

fn number<T: std::str::FromStr>(word: Option<&str>, line: usize) -> Result<T, (usize, String)> {
    let word = word.ok_or_else(|| (line, "a number is missing".to_string()))?;
    word.parse().map_err(|_| (line, format!("'{word}' is not such a number")))
}

/// Vertices and faces; polygons are cut into fans. Errors: line and what is wrong there.
pub fn parse_obj(text: &str) -> Result<SourceMesh, (usize, String)> {
    let mut mesh = SourceMesh::default();
    for (index, line) in text.lines().enumerate() {
        let line_number = index + 1;
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut x = [0.0; 3];
                for c in &mut x {
                    *c = number(words.next(), line_number)?;
                }
                mesh.positions.push(x);
            }
            Some("f") => {
                let mut corners = Vec::new();
                for word in words {
                    let value: i64 = number(word.split('/').next(), line_number)?;
                    let count = mesh.positions.len() as i64;
                    let place = if value < 0 { value + count } else { value - 1 };
                    if !(0..count).contains(&place) {
                        return Err((line_number, format!("there is no vertex {value}")));
                    }
                    corners.push(place as u32);
                }
                if corners.len() < 3 {
                    return Err((line_number, "a face needs three vertices".to_string()));
                }
                mesh.triangles.extend((2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]]));
            }
            _ => {}
        }
    }
    Ok(mesh)
}

/// Nodes and tetrahedra (elements of type 4) of a Gmsh 2.2 text file; nodes of none are left out.
///
/// Errors: line and what is wrong there.
fn parse_gmsh(text: &str) -> Result<SourceMesh, (usize, String)> {
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let (mut nodes, mut tetrahedra): (Vec<(u64, Vec3)>, Vec<[u32; 4]>) = (Vec::new(), Vec::new());
    while let Some((at, line)) = lines.next() {
        match line {
            "$MeshFormat" => {
                let (at, format) = lines.next().unwrap_or((at, ""));
                if !format.starts_with("2.2 0") {
                    return Err((at, format!("version 2.2, text, not '{format}'")));
                }
            }
            "$Nodes" => {
                for (at, line) in section(&mut lines, at)? {
                    let mut words = line.split_whitespace();
                    let tag = number(words.next(), at)?;
                    let mut x = [0.0; 3];
                    for c in &mut x {
                        *c = number(words.next(), at)?;
                    }
                    nodes.push((tag, x));
                }
                nodes.sort_by_key(|node| node.0);
            }
            "$Elements" => {
                for (at, line) in section(&mut lines, at)? {
                    let mut words = line.split_whitespace().skip(1);
                    let (kind, tags): (u32, usize) = (number(words.next(), at)?, number(words.next(), at)?);
                    if kind != 4 {
                        continue;
                    }
                    let mut words = words.skip(tags);
                    let mut corners = [0u32; 4];
                    for corner in &mut corners {
                        let tag: u64 = number(words.next(), at)?;
                        let place = nodes.binary_search_by_key(&tag, |node| node.0);
                        *corner = place.map_err(|_| (at, format!("there is no node {tag}")))? as u32;
                    }
                    tetrahedra.push(corners);
                }
            }
            _ => {}
        }
    }
    if tetrahedra.is_empty() {
        return Err((text.lines().count(), "no tetrahedra".to_string()));
    }
    let mut used = vec![u32::MAX; nodes.len()];
    let mut positions = Vec::new();
    for corner in tetrahedra.iter_mut().flatten() {
        let place = &mut used[*corner as usize];
        if *place == u32::MAX {
            *place = positions.len() as u32;
            positions.push(nodes[*corner as usize].1);
        }
        *corner = *place;
    }
    Ok(SourceMesh { positions, triangles: Vec::new(), tetrahedra })
}

/// The lines of a section that begins with their number.
fn section<'a>(
    lines: &mut impl Iterator<Item = (usize, &'a str)>,
    at: usize,
) -> Result<Vec<(usize, &'a str)>, (usize, String)> {
    let (at, count) = lines.next().unwrap_or((at, ""));
    let count: usize = number(Some(count), at)?;
    let found: Vec<(usize, &str)> = lines.by_ref().take(count).collect();
    if found.len() == count { Ok(found) } else { Err((at, format!("{count} lines announced, {} there", found.len()))) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MassProperties, Surface};

    #[test]
    fn profiles_turned_and_drawn_out() {
        // Two cones on a cylinder: closed, seen from outside; the volume of its prism of 24 sides.
        let profile = vec![[0.0, -1.0], [0.5, -0.5], [0.5, 1.5], [0.0, 2.0]];
        let source = MeshSource::Revolved { profile, segments: 24 };
        let mesh = source.mesh(Path::new(""), "").unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (50, 96));
        let surface = Surface::from_triangles(mesh.positions, mesh.triangles).unwrap();
        let volume = MassProperties::of_closed_mesh(&surface, 1.0).unwrap().mass;
        let base = 24.0 * 0.5 * 0.25 * (std::f64::consts::TAU / 24.0).sin();
        assert!((volume - base * (2.0 + 2.0 / 6.0)).abs() < 1e-14, "{volume}");

        // A gutter of three strips, 1, 2 and 1 wide.
        let profile = vec![[-1.0, 1.0], [-1.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        let mesh = MeshSource::Extruded { profile, length: 3.0, cells: 5 }.mesh(Path::new(""), "").unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (24, 30));
        let area = |[a, b, c]: [u32; 3]| {
            let at = |v: u32| mesh.positions[v as usize];
            0.5 * norm(cross(sub(at(b), at(a)), sub(at(c), at(a))))
        };
        let total: f64 = mesh.triangles.iter().map(|face| area(*face)).sum();
        assert!((total - 12.0).abs() < 1e-14, "{total}");
    }
}
