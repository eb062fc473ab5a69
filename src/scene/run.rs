//! The loop: steps, rows, frames, the snapshot, the report.

use super::build::Scene;
use super::energy::Centre;
use super::fault::{FieldFault, Places, SceneFault};
use super::file::SceneFile;
use super::frames::{surfaces, write_obj, write_whole};
use super::report::{Facts, Report};
use super::statistics::{StepRow, processor_seconds};
use super::subdivide::subdivided;
use super::usd::UsdCache;
use crate::math::dot;
use crate::model::{Method, Settings, StepReport};
use crate::parallel::{Par, Pool};
use crate::world::{Fault, World};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What the command line asks for.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Scene file.
    pub scene: PathBuf,
    /// Contact method: `implicit` or `filter`.
    pub method: String,
    /// Step to stop at; `None`: the end of the scene.
    pub steps: Option<u64>,
    /// Threads; 0 and 1 run on the calling one.
    pub threads: usize,
    /// Folder for frames, rows, snapshot and report.
    pub out: Option<PathBuf>,
    /// Snapshot to go on from.
    pub resume: Option<PathBuf>,
    /// Seed that moves the starts a little; 0 moves nothing.
    pub jitter: u64,
    /// Levels of subdivision of the finer frames; 0: there are none.
    pub subdivide: u32,
}

/// Why there is no report.
#[derive(Debug)]
pub enum Failure {
    /// The scene file, with line and field.
    Scene(SceneFault),
    /// The options.
    Usage(String),
    /// A file that cannot be read or written.
    Io(String),
    /// A step that was refused, with its number. A snapshot of the state before it is left.
    Step(u64, String),
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Failure::Scene(fault) => write!(f, "{fault}"),
            Failure::Usage(message) | Failure::Io(message) => write!(f, "{message}"),
            Failure::Step(step, message) => write!(f, "step {step}: {message}"),
        }
    }
}

impl std::error::Error for Failure {}

/// A run that ended as it should, or was asked to.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The report as one line of JSON.
    pub json: String,
    /// A few lines for people.
    pub summary: String,
    /// The bounds that were broken.
    pub broken: Vec<String>,
    /// Whether it was stopped before its last step.
    pub interrupted: bool,
    /// The snapshot that was left.
    pub snapshot: Option<PathBuf>,
}

/// Runs a scene. `watch` hears the step that is done and the last one, and says whether to go on.
///
/// Errors: the scene, the options, files, a step that was refused. A pinched step is counted and the run goes on.
pub fn run(options: &Options, watch: &mut dyn FnMut(u64, u64) -> bool) -> Result<Finished, Failure> {
    let method = method(options)?;
    let name = options.scene.display().to_string();
    let text = std::fs::read_to_string(&options.scene).map_err(|e| Failure::Io(format!("{name}: {e}")))?;
    let file = SceneFile::parse(&name, &text).map_err(Failure::Scene)?;
    let places = Places::new(&name, &text);
    let located = |fault: FieldFault| Failure::Scene(places.fault(fault));
    let folder = options.scene.parent().unwrap_or(Path::new(""));
    let scene = Scene::build(&file, folder, options.jitter).map_err(located)?;
    let pool = match options.threads {
        0 | 1 => None,
        threads => Some(Pool::new(threads).map_err(Failure::Usage)?),
    };
    let key = run_key(&text, options);
    let settings = file.settings.settings(method);
    let mut run = Run::new(&file, scene, options, settings, key)?;
    let last = options.steps.unwrap_or(file.steps());
    let par = pool.as_ref().map_or(Par::Serial, Par::Pool);
    run.frame(false, par)?;
    let mut interrupted = !watch(run.step, last) && run.step < last;
    while run.step < last && !interrupted {
        run.advance(par)?;
        run.frame(run.step == last, par)?;
        interrupted = !watch(run.step, last) && run.step < last;
    }
    run.finish(interrupted, last)
}

/// The contact method by its name.
fn method(options: &Options) -> Result<Method, Failure> {
    match options.method.as_str() {
        "implicit" => Ok(Method::ImplicitContact),
        "filter" => Ok(Method::VelocityFilter),
        other => Err(Failure::Usage(format!("there is no method '{other}': implicit, filter"))),
    }
}

/// What a snapshot must agree with: the scene, its method and its jitter.
fn run_key(text: &str, options: &Options) -> u64 {
    // FNV-1a; not for adversaries.
    let bytes = text.bytes().chain(options.method.bytes()).chain(options.jitter.to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

struct Run<'a> {
    file: &'a SceneFile,
    settings: Settings,
    scene: Scene,
    options: &'a Options,
    key: u64,
    step: u64,
    steps_per_frame: u64,
    rows: Vec<StepRow>,
    usd: Option<UsdCache>,
    starts: Vec<Centre>,
}

impl<'a> Run<'a> {
    fn new(
        file: &'a SceneFile,
        scene: Scene,
        options: &'a Options,
        settings: Settings,
        key: u64,
    ) -> Result<Run<'a>, Failure> {
        let per_frame = (1.0 / (file.dt * file.output.frames_per_second)).round().max(1.0);
        let mut run = Run {
            file,
            settings,
            scene,
            options,
            key,
            step: 0,
            steps_per_frame: per_frame as u64,
            rows: Vec::new(),
            usd: None,
            starts: Vec::new(),
        };
        run.starts = run.centres()?;
        if let Some(path) = &options.resume {
            let bytes = std::fs::read(path).map_err(|e| Failure::Io(format!("{}: {e}", path.display())))?;
            run.step = load(&mut run.scene.world, &bytes, key)
                .map_err(|message| Failure::Io(format!("{}: {message}", path.display())))?;
        }
        let Some(out) = &options.out else { return Ok(run) };
        let io = |e: io::Error| Failure::Io(format!("{}: {e}", out.display()));
        for folder in ["frames", "subdivided"].into_iter().take(1 + options.subdivide.min(1) as usize) {
            std::fs::create_dir_all(out.join(folder)).map_err(io)?;
            run.drop_later_frames(&out.join(folder)).map_err(io)?;
        }
        run.rows = run.earlier_rows(&out.join("stats.csv"));
        let mut text = StepRow::COLUMNS.join(",") + "\n";
        run.rows.iter().for_each(|row| text += &(row.to_csv() + "\n"));
        write_whole(&out.join("stats.csv"), text.as_bytes()).map_err(io)?;
        if file.output.usd {
            let first = run.step.div_ceil(run.steps_per_frame);
            run.usd = Some(UsdCache::new(&run.scene, out, first).map_err(io)?);
        }
        Ok(run)
    }

    /// Rows of the steps before this one, when they are all there.
    fn earlier_rows(&self, path: &Path) -> Vec<StepRow> {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let rows: Vec<StepRow> =
            text.lines().skip(1).map_while(StepRow::from_csv).take_while(|row| row.step <= self.step).collect();
        if rows.len() as u64 == self.step { rows } else { Vec::new() }
    }

    /// Removes frames of an earlier run that this one does not reach back to.
    fn drop_later_frames(&self, folder: &Path) -> io::Result<()> {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            let step: Option<u64> = name.strip_prefix("frame_").and_then(|number| number.parse().ok());
            if step.is_some_and(|step| step > self.step || self.step == 0) {
                std::fs::remove_file(path)?;
            }
        }
        Ok(())
    }

    fn advance(&mut self, par: Par) -> Result<(), Failure> {
        let number = self.step + 1;
        let time = number as f64 * self.file.dt;
        let failed = |message: String| Failure::Step(number, message);
        self.scene.push_targets(time).map_err(|e| failed(e.message))?;
        let (clock, processor) = (std::time::Instant::now(), processor_seconds());
        let outcome = self.scene.world.step(&self.settings, self.file.dt, par);
        let seconds = clock.elapsed().as_secs_f64();
        let used = processor.and_then(|before| processor_seconds().map(|after| after - before));
        let report: StepReport = match outcome {
            Ok(report) => report,
            Err(failure) => match (failure.error.fault, failure.report) {
                (Fault::Pinched, Some(report)) => *report,
                _ => {
                    let left = self.save()?;
                    return Err(failed(format!(
                        "{}; the state before it is in {}",
                        failure.error.message,
                        left.display()
                    )));
                }
            },
        };
        let mut row =
            StepRow { seconds, processor_seconds: used.unwrap_or(seconds), ..StepRow::new(number, time, &report) };
        for body in &self.scene.bodies {
            row.kinetic_energy += body.energies.kinetic(&self.scene.world, body.id).map_err(|e| failed(e.message))?;
            row.elastic_energy += body.energies.elastic(&self.scene.world, body.id).map_err(|e| failed(e.message))?;
        }
        self.step = number;
        if let Some(out) = &self.options.out {
            let path = out.join("stats.csv");
            let append = |path: &Path| {
                let mut file = std::fs::OpenOptions::new().append(true).open(path)?;
                file.write_all((row.to_csv() + "\n").as_bytes())
            };
            append(&path).map_err(|e| Failure::Io(format!("{}: {e}", path.display())))?;
        }
        self.rows.push(row);
        Ok(())
    }

    /// Writes the frame of this step if it has one; the last step always has an OBJ frame.
    fn frame(&mut self, last: bool, par: Par) -> Result<(), Failure> {
        let Some(out) = &self.options.out else { return Ok(()) };
        let io = |e: io::Error| Failure::Io(format!("{}: {e}", out.display()));
        let due = self.step.is_multiple_of(self.steps_per_frame);
        let path = out.join("frames").join(format!("frame_{:06}.obj", self.step));
        if self.file.output.obj && (due || last) && !path.exists() {
            let surfaces = surfaces(&self.scene).map_err(|e| io(io::Error::other(e.message)))?;
            write_obj(&surfaces, &path).map_err(io)?;
        }
        let finer = out.join("subdivided").join(format!("frame_{:06}.obj", self.step));
        if self.options.subdivide > 0 && (due || last) && !finer.exists() {
            let settings = self.file.settings.settings(Method::ImplicitContact);
            let surfaces = subdivided(&self.scene, self.options.subdivide, &settings, par)
                .map_err(|message| Failure::Step(self.step, message))?;
            write_obj(&surfaces, &finer).map_err(io)?;
        }
        if let Some(usd) = &self.usd
            && due
        {
            usd.add_frame(&self.scene, self.step / self.steps_per_frame).map_err(io)?;
        }
        Ok(())
    }

    fn centres(&self) -> Result<Vec<Centre>, Failure> {
        let find = |name: &str| {
            let first = format!("{name}_0");
            self.scene.bodies.iter().find(|body| body.name == name || body.name == first)
        };
        let centre = |bound: &super::file::BodyBound| match find(&bound.name) {
            None => Ok(Centre::default()),
            Some(body) => body.energies.centre(&self.scene.world, body.id),
        };
        self.file
            .bounds
            .body
            .iter()
            .map(centre)
            .collect::<Result<_, _>>()
            .map_err(|e| Failure::Step(self.step, e.message))
    }

    /// Leaves a snapshot in the folder of the run, or beside the caller.
    fn save(&self) -> Result<PathBuf, Failure> {
        let name = self.options.scene.file_stem().unwrap_or_default().to_string_lossy().to_string();
        let path = match &self.options.out {
            Some(out) => out.join("last.snapshot"),
            None => PathBuf::from(format!("{name}.snapshot")),
        };
        let io = |e: io::Error| Failure::Io(format!("{}: {e}", path.display()));
        let bytes = save(&self.scene.world, self.step, self.key).map_err(|e| io(io::Error::other(e)))?;
        write_whole(&path, &bytes).map_err(io)?;
        Ok(path)
    }

    fn finish(mut self, interrupted: bool, last: u64) -> Result<Finished, Failure> {
        let snapshot = if interrupted || self.options.out.is_some() { Some(self.save()?) } else { None };
        let rate = 1.0 / (self.file.dt * self.steps_per_frame as f64);
        let frames = self.step / self.steps_per_frame + 1;
        let ends = self.centres()?;
        let facts = Facts {
            scene: self.options.scene.file_stem().unwrap_or_default().to_string_lossy().to_string(),
            title: self.file.title.clone(),
            about: self.file.about.clone(),
            method: self.options.method.clone(),
            vertices: self.scene.vertices,
            tets: self.scene.tetrahedra,
            bodies: self.scene.bodies.len(),
            steps: self.step,
            whole: self.step >= self.file.steps(),
            dt: self.file.dt,
            mass: self.scene.bodies.iter().map(|body| body.energies.mass()).sum(),
            threads: self.options.threads.max(1),
            jitter: self.options.jitter,
            up: self.file.up,
            floor: floor(self.file),
            frames: if self.options.out.is_some() { frames } else { 0 },
            frames_per_second: rate,
            hash: self.scene.world.state_hash(),
            interrupted,
            centres: self.starts.drain(..).zip(ends).map(|(start, end)| [start, end]).collect(),
        };
        let report = Report::new(facts, &self.rows, &self.file.bounds);
        let json = serde_json::to_string(&report).map_err(|e| Failure::Io(e.to_string()))?;
        if let Some(out) = &self.options.out {
            let io = |e: io::Error| Failure::Io(format!("{}: {e}", out.display()));
            write_whole(&out.join("report.json"), (json.clone() + "\n").as_bytes()).map_err(io)?;
            if let Some(usd) = &self.usd {
                let done = !interrupted && self.step >= last.max(self.file.steps());
                usd.finish(&self.scene, &self.file.title, self.file.up, frames, rate, done).map_err(io)?;
            }
        }
        let summary = summary(&report);
        Ok(Finished { json, summary, broken: report.bounds_broken, interrupted, snapshot })
    }
}

/// Offset of the half-space whose normal points up.
fn floor(file: &SceneFile) -> Option<f64> {
    let up = if file.up == super::file::Up::Y { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let planes = file.half_space.iter().map(|plane| (plane, crate::math::norm(plane.normal)));
    planes
        .filter(|(plane, length)| dot(plane.normal, up) > 0.999 * length)
        .map(|(plane, length)| plane.offset / length)
        .next()
}

fn summary(report: &Report) -> String {
    let rounds: Vec<String> = report.cmr_rounds_histogram.iter().map(|(r, n)| format!("{r}: {n}")).collect();
    let (t, p) = (&report.seconds_per_step, &report.processor_seconds_per_step);
    format!(
        "{}: {} vertices, {} tetrahedra, {} bodies, {} steps of {} s\n\
         contacts at most {}; rounds {{{}}}; {} steps divided, {} with fail-safes, {} pinched, {} not converged\n\
         {} intersections (certified, all steps); largest residual {:.2e}\n\
         seconds a step: mean {:.4}, median {:.4}, p95 {:.4}, max {:.4}; of the processor: median {:.4}, p95 {:.4}\n\
         hash {}",
        report.scene,
        report.vertices,
        report.tets,
        report.bodies,
        report.steps,
        report.dt,
        report.contacts_max,
        rounds.join(", "),
        report.divisions,
        report.failsafes,
        report.pinched,
        report.not_converged,
        report.intersections,
        report.residual_max,
        t.mean,
        t.median,
        t.p95,
        t.max,
        p.median,
        p.p95,
        report.hash,
    )
}

const MAGIC: [u8; 8] = *b"SGNRUN\0\x01";

/// Magic number, key of the run, step, then the snapshot of the world.
fn save(world: &World, step: u64, key: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(24 + world.snapshot_size());
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&key.to_le_bytes());
    bytes.extend_from_slice(&step.to_le_bytes());
    bytes.resize(24 + world.snapshot_size(), 0);
    world.save_snapshot(&mut bytes[24..]).map_err(|e| e.message)?;
    Ok(bytes)
}

/// The step of a snapshot, after its state has been loaded.
fn load(world: &mut World, bytes: &[u8], key: u64) -> Result<u64, String> {
    let word = |at: usize| {
        let mut word = [0; 8];
        word.copy_from_slice(&bytes[at..at + 8]);
        u64::from_le_bytes(word)
    };
    if bytes.len() < 24 || bytes[..8] != MAGIC {
        return Err("not a snapshot of signorini-run".to_string());
    }
    if word(8) != key {
        return Err("a snapshot of another scene file, method or jitter seed".to_string());
    }
    world.load_snapshot(&bytes[24..]).map_err(|e| e.message)?;
    Ok(word(16))
}
