//! The animated cache: USD as text, one mesh per body, its points sampled over time.
//!
//! Samples are appended to a file per body while the run goes on; the cache is put together from them at its end. So
//! memory does not grow with the run, and a run that is resumed goes on where the samples end.

use super::build::Scene;
use super::file::Up;
use std::fmt::Write as _;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

/// The cache of a run.
pub struct UsdCache {
    samples: PathBuf,
    target: PathBuf,
}

impl UsdCache {
    /// A cache in `folder` that holds frames before frame `first`, if they were written there, and no others.
    pub fn new(scene: &Scene, folder: &Path, first: u64) -> io::Result<UsdCache> {
        let cache = UsdCache { samples: folder.join("animation.samples"), target: folder.join("animation.usda") };
        fs::create_dir_all(&cache.samples)?;
        for index in 0..scene.bodies.len() {
            let path = cache.sample_file(index);
            if first == 0 || !path.exists() {
                File::create(&path)?;
                continue;
            }
            let mut kept = String::new();
            for line in BufReader::new(File::open(&path)?).lines() {
                let line = line?;
                let frame: Option<u64> = line.split(':').next().and_then(|frame| frame.trim().parse().ok());
                if frame.is_some_and(|frame| frame < first) {
                    kept.push_str(&line);
                    kept.push('\n');
                }
            }
            fs::write(&path, kept)?;
        }
        Ok(cache)
    }

    fn sample_file(&self, index: usize) -> PathBuf {
        self.samples.join(format!("{index:05}.txt"))
    }

    /// Adds the points of every body at a frame, as the nearest single precision numbers: that is what the format holds.
    pub fn add_frame(&self, scene: &Scene, frame: u64) -> io::Result<()> {
        for (index, body) in scene.bodies.iter().enumerate().filter(|(_, body)| !body.triangles.is_empty()) {
            let positions = scene.world.positions(body.id).map_err(|e| io::Error::other(e.message))?;
            let mut line = format!("            {frame}: [");
            for (i, x) in positions.iter().enumerate() {
                let [x, y, z] = x.map(|c| c as f32);
                let _ = write!(line, "{}({x}, {y}, {z})", if i > 0 { ", " } else { "" });
            }
            line.push_str("],\n");
            OpenOptions::new().append(true).open(self.sample_file(index))?.write_all(line.as_bytes())?;
        }
        Ok(())
    }

    /// Puts the cache together; frames `0..frames` at a rate `[1/s]`. With `done`, removes the samples.
    pub fn finish(&self, scene: &Scene, title: &str, up: Up, frames: u64, rate: f64, done: bool) -> io::Result<()> {
        let beside = self.target.with_extension("part");
        let mut out = BufWriter::new(File::create(&beside)?);
        let up = if up == Up::Y { "Y" } else { "Z" };
        let title = title.replace(['"', '\\', '\n'], " ");
        writeln!(out, "#usda 1.0\n(\n    defaultPrim = \"scene\"\n    doc = \"{title}\"\n    metersPerUnit = 1")?;
        writeln!(out, "    startTimeCode = 0\n    endTimeCode = {}", frames.saturating_sub(1))?;
        writeln!(out, "    timeCodesPerSecond = {rate}\n    framesPerSecond = {rate}\n    upAxis = \"{up}\"\n)\n")?;
        writeln!(out, "def Xform \"scene\"\n{{")?;
        for (index, body) in scene.bodies.iter().enumerate().filter(|(_, body)| !body.triangles.is_empty()) {
            writeln!(out, "    def Mesh \"{}\"\n    {{", prim_name(&body.name, index))?;
            writeln!(out, "        uniform bool doubleSided = 1\n        uniform token subdivisionScheme = \"none\"")?;
            let counts = vec!["3"; body.triangles.len()].join(", ");
            let corners: Vec<String> = body.triangles.iter().flatten().map(u32::to_string).collect();
            writeln!(out, "        int[] faceVertexCounts = [{counts}]")?;
            writeln!(out, "        int[] faceVertexIndices = [{}]", corners.join(", "))?;
            writeln!(out, "        point3f[] points.timeSamples = {{")?;
            io::copy(&mut File::open(self.sample_file(index))?, &mut out)?;
            writeln!(out, "        }}\n    }}\n")?;
        }
        writeln!(out, "}}")?;
        out.into_inner().map_err(|e| e.into_error())?.sync_data()?;
        fs::rename(beside, &self.target)?;
        if done { fs::remove_dir_all(&self.samples) } else { Ok(()) }
    }
}

/// An identifier, unique by the number of the body where the name had to change.
fn prim_name(name: &str, index: usize) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if name.chars().all(plain) && !name.starts_with(|c: char| c.is_ascii_digit()) {
        return name.to_string();
    }
    let changed: String = name.chars().map(|c| if plain(c) { c } else { '_' }).collect();
    format!("_{index}_{changed}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prim_names_are_identifiers() {
        assert_eq!(prim_name("cloth_2", 7), "cloth_2");
        assert_eq!(prim_name("2 cloths", 7), "_7_2_cloths");
        assert_eq!(prim_name("Hülle", 0), "_0_H_lle");
    }
}
