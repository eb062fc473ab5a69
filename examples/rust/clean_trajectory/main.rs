//! Takes the collisions out of a recorded trajectory: a folder of OBJ frames in, the same frames without intersections out.
//!
//! `ci/clean-trajectory IN OUT [options]`; options in [`options::USAGE`]. Whatever recorded it: each frame is the velocity
//! filter's motion from the frame before, with masses by area, certified. It starts at the first frame that intersects
//! nowhere and works from there to both ends, or at the mesh of `--rest`, where no frame is clean. Only vertex lines of
//! the files change. One row per frame on standard output, as it comes, then what it came to. Exit status: 0 all frames are clean;
//! 1 scripted objects left no room somewhere (such frames stand at the certified part of their motion, and are clean, too);
//! 2 something cannot be read or written.

use signorini::math::{Vec3, add_scaled, norm, sub};
use signorini::model::{Precision, Settings, StepReport, Watch};
use signorini::parallel::Par;
use signorini::world::{Fault, Motion, MotionFilter, MotionFilterDescription, Topology};
use std::path::PathBuf;
use std::process::ExitCode;

#[path = "../../../benches/support/clock.rs"]
mod clock;
#[path = "../obj_file.rs"]
mod obj_file;
mod options;
mod recording;

use options::{Mode, Options};
use recording::{Mesh, frame_paths, read, read_positions, with_positions};

/// A recording that is being cleaned.
struct Cleaning<'a> {
    options: &'a Options,
    paths: &'a [PathBuf],
    mesh: &'a Mesh,
    /// Intersections of each recorded frame.
    recorded: &'a [usize],
    filter: MotionFilter,
    settings: Settings,
}

/// What became of a frame.
#[derive(Clone, Debug, Default)]
struct Row {
    left: usize,
    report: StepReport,
    milliseconds: f64,
    /// Largest and root mean square distance from the recorded positions, of what is not scripted `[m]`.
    off: [f64; 2],
}

impl Row {
    const HEADER: &str = "frame,recorded_intersections,intersections,milliseconds,contacts,projected_zones,rigid_zones,\
                          held_vertices,certified_fraction,off_largest,off_mean_square";

    fn text(&self, name: &str, recorded: usize) -> String {
        let (Row { left, milliseconds, off: [largest, mean], .. }, r) = (self, &self.report);
        let zones = format!("{},{},{}", r.projected_zones, r.rigid_zones, r.held_vertices);
        let fraction = r.certified_fraction;
        format!("{name},{recorded},{left},{milliseconds:.2},{},{zones},{fraction},{largest:.3e},{mean:.3e}", r.contacts)
    }
}

/// A mesh that intersects nowhere, and the frame that it is, unless it comes from elsewhere.
fn clean_start(
    options: &Options,
    mesh: &Mesh,
    recorded: &[usize],
    paths: &[PathBuf],
) -> Result<(Vec<Vec3>, Option<usize>), String> {
    let count = mesh.groups.len();
    if let Some(path) = &options.rest {
        let rest = read_positions(path, options.single, count)?;
        return match mesh.intersections(&rest) {
            0 => Ok((rest, None)),
            n => Err(format!("{}: {n} intersections; --rest wants a mesh without", path.display())),
        };
    }
    let frame = recorded.iter().position(|n| *n == 0);
    let frame = frame.ok_or("no frame is without intersections: give such a mesh by --rest")?;
    Ok((read_positions(&paths[frame], options.single, count)?, Some(frame)))
}

impl Cleaning<'_> {
    fn name(&self, frame: usize) -> String {
        self.paths[frame].file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
    }

    /// Writes a frame and its row.
    fn write(&self, frame: usize, end: &[Vec3], report: StepReport, milliseconds: f64) -> Result<Row, String> {
        let (text, obj) = read(&self.paths[frame], self.options.single)?;
        let target = self.options.target.join(self.name(frame));
        let text = with_positions(&text, end);
        std::fs::write(&target, text).map_err(|error| format!("{}: {error}", target.display()))?;
        let free = (0..end.len()).filter(|v| !self.mesh.scripted[*v]);
        let off: Vec<f64> = free.map(|v| norm(sub(end[v], obj.positions[v]))).collect();
        let largest = off.iter().copied().fold(0.0, f64::max);
        let mean = (off.iter().map(|d| d * d).sum::<f64>() / off.len().max(1) as f64).sqrt();
        let row = Row { left: self.mesh.intersections(end), report, milliseconds, off: [largest, mean] };
        println!("{}", row.text(&self.name(frame), self.recorded[frame]));
        Ok(row)
    }

    /// One motion of the filter, from where it stands; the first of a run begins at `from`.
    fn advance(&mut self, frame: usize, from: &[Vec3], to: &[Vec3], first: bool) -> Result<Row, String> {
        let dt = 1.0 / self.options.frames_per_second;
        let (x, returning);
        let motion = match (self.options.mode, self.options.return_time) {
            _ if first => Motion::Between(from, to),
            (Mode::Position, _) => Motion::Towards(to),
            (Mode::Displacement, time) if time.is_infinite() => Motion::Displacement(from, to),
            (Mode::Displacement, time) => {
                x = self.filter.positions();
                let kept = (-dt / time).exp();
                // Scripted vertices, and what has come back, arrive to the last bit.
                let target =
                    |v: usize| if x[v] == from[v] { to[v] } else { add_scaled(to[v], kept, sub(x[v], from[v])) };
                returning = (0..x.len()).map(target).collect::<Vec<Vec3>>();
                Motion::Between(&x, &returning)
            }
        };
        let clock = clock::thread_seconds();
        let outcome = self.filter.run(motion, &self.settings, dt, Par::Serial, Watch::default());
        let milliseconds = 1e3 * (clock::thread_seconds() - clock);
        let report = match outcome {
            Ok(report) => report,
            Err(failure) => match failure.report.filter(|_| failure.error.fault == Fault::Pinched) {
                Some(report) => *report,
                None => return Err(format!("{}: {}", self.name(frame), failure.error.message)),
            },
        };
        let end = self.filter.positions();
        self.write(frame, &end, report, milliseconds)
    }

    /// Filters the frames of an order one after the other, from a clean mesh.
    fn follow(&mut self, start: &[Vec3], order: &[usize], rows: &mut [Row]) -> Result<(), String> {
        self.filter.restart();
        let mut before = start.to_vec();
        for (i, frame) in order.iter().enumerate() {
            let to = read_positions(&self.paths[*frame], self.options.single, self.mesh.groups.len())?;
            rows[*frame] = self.advance(*frame, &before, &to, i == 0)?;
            before = to;
        }
        Ok(())
    }
}

fn clean(options: &Options) -> Result<bool, String> {
    let paths = frame_paths(&options.source)?;
    let (_, first) = read(&paths[0], options.single)?;
    let mesh = Mesh::new(first, options).map_err(|message| format!("{}: {message}", paths[0].display()))?;
    let count = mesh.groups.len();
    let recorded = |path: &PathBuf| Ok(mesh.intersections(&read_positions(path, options.single, count)?));
    let recorded: Vec<usize> = paths.iter().map(recorded).collect::<Result<_, String>>()?;
    let (start, start_frame) = clean_start(options, &mesh, &recorded, &paths)?;
    let filter = MotionFilter::new(MotionFilterDescription {
        rest: start.clone(),
        topology: Topology { triangles: mesh.surface.faces.clone(), ..Topology::default() },
        masses: mesh.masses.clone(),
        groups: mesh.groups.clone(),
        half_thickness: options.thickness.map(|thickness| 0.5 * thickness),
        friction_coefficient: options.friction,
        self_collision: true,
        precision: if options.single { Precision::Single } else { Precision::Double },
    });
    let filter = filter.map_err(|error| error.message)?;
    std::fs::create_dir_all(&options.target).map_err(|e| format!("{}: {e}", options.target.display()))?;
    let settings = Settings { certify: true, fail_safe: options.fail_safe, ..Settings::default() };
    let mut cleaning = Cleaning { options, paths: &paths, mesh: &mesh, recorded: &recorded, filter, settings };
    let mut rows = vec![Row::default(); paths.len()];
    println!("{}", Row::HEADER);
    let after = match start_frame {
        None => 0,
        Some(frame) => {
            rows[frame] =
                cleaning.write(frame, &start, StepReport { certified_fraction: 1.0, ..Default::default() }, 0.0)?;
            let back: Vec<usize> = (0..frame).rev().collect();
            cleaning.follow(&start, &back, &mut rows)?;
            frame + 1
        }
    };
    cleaning.follow(&start, &(after..paths.len()).collect::<Vec<_>>(), &mut rows)?;
    Ok(summary(&rows, &recorded))
}

/// Says what it came to; whether every frame arrived.
fn summary(rows: &[Row], recorded: &[usize]) -> bool {
    let pinched = rows.iter().filter(|row| row.report.certified_fraction < 1.0).count();
    let crossing = |counts: &mut dyn Iterator<Item = usize>| counts.filter(|n| *n > 0).count();
    let mut times: Vec<f64> = rows.iter().map(|row| row.milliseconds).collect();
    times.sort_unstable_by(f64::total_cmp);
    eprintln!(
        "{} frames, {} with intersections (at most {}) as recorded, {} now; {} ms a frame in the median, {} at most; off by \
         {:.2e} at most; {pinched} pinched",
        rows.len(),
        crossing(&mut recorded.iter().copied()),
        recorded.iter().max().unwrap_or(&0),
        crossing(&mut rows.iter().map(|row| row.left)),
        times[times.len() / 2].round(),
        times[times.len() - 1].round(),
        rows.iter().map(|row| row.off[0]).fold(0.0, f64::max),
    );
    pinched == 0 && rows.iter().all(|row| row.left == 0)
}

fn main() -> ExitCode {
    let outcome = options::parse(std::env::args().skip(1)).map_err(|e| format!("{e}\n{}", options::USAGE));
    match outcome.and_then(|options| clean(&options)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}
