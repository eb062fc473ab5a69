//! A recorded trajectory: frames of one mesh.

use crate::obj_file::{self, Obj};
use crate::options::Options;
use signorini::detection::Primitives;
use signorini::detection::intersection::find;
use signorini::math::{Vec3, cross, norm, sub};
use signorini::mesh::Surface;
use signorini::parallel::Par;
use std::path::{Path, PathBuf};

/// The mesh that all frames share.
pub struct Mesh {
    pub surface: Surface,
    /// Object of every vertex, counted from 1 in the order of first mention; 0: of none.
    pub groups: Vec<u32>,
    /// Whether a vertex goes where it was recorded.
    pub scripted: Vec<bool>,
    /// Mass of every vertex by area; 0 where it is scripted.
    pub masses: Vec<f64>,
}

/// OBJ files of a folder in the order of their names.
pub fn frame_paths(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let fail = |error: std::io::Error| format!("{}: {error}", folder.display());
    let entries: Result<Vec<_>, _> = std::fs::read_dir(folder).map_err(fail)?.collect();
    let mut paths: Vec<PathBuf> = entries.map_err(fail)?.into_iter().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "obj"));
    paths.sort();
    if paths.is_empty() { Err(format!("{}: no OBJ files", folder.display())) } else { Ok(paths) }
}

/// Text and geometry of a file. Errors name the file and the line.
pub fn read(path: &Path, single: bool) -> Result<(String, Obj), String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let obj = obj_file::parse(&text).map_err(|(line, message)| format!("{}:{line}: {message}", path.display()));
    let mut obj = obj?;
    if let Some(index) = obj.positions.iter().position(|x| x.iter().any(|c| !c.is_finite())) {
        return Err(format!("{}: vertex {} is not finite", path.display(), index + 1));
    }
    if single {
        obj.positions.iter_mut().for_each(|x| *x = x.map(|c| f64::from(c as f32)));
    }
    Ok((text, obj))
}

/// Positions of a file that must have as many vertices as the mesh.
pub fn read_positions(path: &Path, single: bool, count: usize) -> Result<Vec<Vec3>, String> {
    let (_, obj) = read(path, single)?;
    if obj.positions.len() != count {
        return Err(format!("{}: {} vertices, the first frame has {count}", path.display(), obj.positions.len()));
    }
    Ok(obj.positions)
}

/// The text of a frame with other vertices: everything else stays as it was recorded. A number is the shortest text that
/// reads back as the same double.
pub fn with_positions(text: &str, positions: &[Vec3]) -> String {
    let mut positions = positions.iter();
    let mut out = String::with_capacity(2 * text.len());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match (words.next() == Some("v")).then(|| positions.next()).flatten() {
            Some(x) => {
                out.push('v');
                // A vertex may have colours after its coordinates.
                let rest = words.skip(3).map(String::from);
                x.iter().map(f64::to_string).chain(rest).for_each(|w| out.extend([" ", &w]));
            }
            None => out.push_str(line),
        }
        out.push('\n');
    }
    out
}

impl Mesh {
    /// The mesh of the first frame. Errors: objects that options name and that are not there, bad faces.
    pub fn new(obj: Obj, options: &Options) -> Result<Mesh, String> {
        let mut names: Vec<&str> = Vec::new();
        let mut groups = vec![0; obj.positions.len()];
        for (name, first) in &obj.objects {
            let group = names.iter().position(|n| n == name).unwrap_or(names.len());
            if group == names.len() {
                names.push(name);
            }
            groups[*first..].fill(group as u32 + 1);
        }
        let mentioned = options.scripted.iter().chain(options.densities.iter().map(|(name, _)| name));
        if let Some(name) = mentioned.into_iter().find(|name| !names.contains(&name.as_str())) {
            return Err(format!("no object is named {name}; there are: {}", names.join(", ")));
        }
        let name_of = |group: u32| group.checked_sub(1).map_or("", |g| names[g as usize]);
        let scripted: Vec<bool> = groups.iter().map(|g| options.scripted.iter().any(|s| s == name_of(*g))).collect();
        let density = |v: usize| {
            let named = options.densities.iter().find(|(name, _)| name == name_of(groups[v]));
            named.map_or(1.0, |(_, density)| *density)
        };
        let mut masses = vec![0.0; groups.len()];
        for face in &obj.faces {
            let [a, b, c] = face.map(|v| obj.positions.get(v as usize).copied().unwrap_or_default());
            let area = 0.5 * norm(cross(sub(b, a), sub(c, a)));
            for v in face.map(|v| v as usize).into_iter().filter(|v| *v < groups.len()) {
                masses[v] += area / 3.0 * density(v);
            }
        }
        // What has no area weighs as much as the rest does on average; only ratios count.
        let weighty: Vec<f64> = masses.iter().copied().filter(|m| *m > 0.0).collect();
        let mean = if weighty.is_empty() { 1.0 } else { weighty.iter().sum::<f64>() / weighty.len() as f64 };
        masses.iter_mut().filter(|m| **m == 0.0).for_each(|m| *m = mean);
        masses.iter_mut().zip(&scripted).filter(|(_, s)| **s).for_each(|(m, _)| *m = 0.0);
        let lines = obj.face_lines;
        let surface = Surface::from_triangles(obj.positions, obj.faces).map_err(|error| {
            let line = error.message.starts_with("a face").then(|| format!("line {}: ", lines[error.index]));
            format!("{}{error}", line.unwrap_or_default())
        })?;
        Ok(Mesh { surface, groups, scripted, masses })
    }

    /// Edges and faces that intersect, decided exactly; what scripts alone do is not counted.
    pub fn intersections(&self, x: &[Vec3]) -> usize {
        let surface = &self.surface;
        let primitives = Primitives { vertices: &surface.vertices, edges: &surface.edges, faces: &surface.faces };
        let free = |a: u32, b: u32| !(self.scripted[a as usize] && self.scripted[b as usize]);
        find(&primitives, x, &free, Par::Serial).len()
    }
}
