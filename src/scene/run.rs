//! The loop: steps, rows, frames, the snapshot, the report.

use super::build::Scene;
use super::energy::Centre;
use super::fault::{FieldFault, Places, SceneFault};
use super::file::{SceneFile, not_negative};
use super::frames::{surfaces, write_obj, write_whole};
use super::report::{Facts, Pinch, Report};
use super::statistics::{StepRow, processor_seconds};
use super::subdivide::subdivided;
use super::usd::UsdCache;
use crate::math::dot;
use crate::model::{Method, Settings, StepReport};
use crate::parallel::{Par, Pool};
use crate::world::{Fault, World};
use serde::de::{DeserializeOwned, IntoDeserializer};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What the command line asks for.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Scene file.
    pub scene: PathBuf,
    /// Contact method in place of the scene's: `implicit` or `filter`.
    pub method: Option<String>,
    /// Fail-safe in place of the scene's: `unilateral_projection`, `inelastic_projection` or `rigid_zone`.
    pub fail_safe: Option<String>,
    /// Two passes of the filter, whatever the scene says.
    pub two_pass: bool,
    /// Passes of the filter's impulses in place of the scene's; none: what collides after its springs goes to zones.
    pub passes: Option<u32>,
    /// Friction coefficient of every body in place of the scene's.
    pub friction: Option<f64>,
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

impl Options {
    /// Whether the scene runs as it is written.
    fn as_written(&self) -> bool {
        let Options { method, fail_safe, two_pass, passes, friction, .. } = self;
        method.is_none() && fail_safe.is_none() && !two_pass && passes.is_none() && friction.is_none()
    }
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
    let name = options.scene.display().to_string();
    let text = std::fs::read_to_string(&options.scene).map_err(|e| Failure::Io(format!("{name}: {e}")))?;
    let mut file = SceneFile::parse(&name, &text).map_err(Failure::Scene)?;
    choose(options, &mut file)?;
    let places = Places::new(&name, &text);
    let located = |fault: FieldFault| Failure::Scene(places.fault(fault));
    let folder = options.scene.parent().unwrap_or(Path::new(""));
    let scene = Scene::build(&file, folder, options.jitter).map_err(located)?;
    let pool = match options.threads {
        0 | 1 => None,
        threads => Some(Pool::new(threads).map_err(Failure::Usage)?),
    };
    let key = run_key(&text, options);
    let mut run = Run::new(&file, scene, options, key)?;
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

/// Puts what the options choose in the place of what the scene says.
fn choose(options: &Options, file: &mut SceneFile) -> Result<(), Failure> {
    fn named<T: DeserializeOwned>(name: &str, what: &str) -> Result<T, Failure> {
        T::deserialize(IntoDeserializer::<serde::de::value::Error>::into_deserializer(name))
            .map_err(|error| Failure::Usage(format!("there is no {what} '{name}': {error}")))
    }
    if let Some(name) = &options.method {
        file.settings.method = Some(named(name, "method")?);
    }
    if let Some(name) = &options.fail_safe {
        file.settings.fail_safe = Some(named(name, "fail-safe")?);
    }
    if options.two_pass {
        file.settings.two_pass = Some(true);
    }
    file.settings.passes_max = options.passes.or(file.settings.passes_max);
    if let Some(friction) = options.friction {
        not_negative(friction, "", "friction")
            .map_err(|fault| Failure::Usage(format!("friction: {}", fault.message)))?;
        file.set_friction(friction);
    }
    Ok(())
}

/// What a snapshot must agree with: the scene, what the options chose in its place, and the jitter.
fn run_key(text: &str, options: &Options) -> u64 {
    // FNV-1a; not for adversaries.
    let mut chosen = format!("{:?}{:?}{:?}", options.method, options.fail_safe, options.friction);
    if options.two_pass {
        chosen += "TwoPass";
    }
    if let Some(passes) = options.passes {
        chosen += &format!("Passes{passes}");
    }
    let bytes = text.bytes().chain(chosen.bytes()).chain(options.jitter.to_le_bytes());
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
    pinches: Vec<Pinch>,
    usd: Option<UsdCache>,
    starts: Vec<Centre>,
}

impl<'a> Run<'a> {
    fn new(file: &'a SceneFile, scene: Scene, options: &'a Options, key: u64) -> Result<Run<'a>, Failure> {
        let per_frame = (1.0 / (file.dt * file.output.frames_per_second)).round().max(1.0);
        let mut run = Run {
            file,
            settings: file.settings.settings(),
            scene,
            options,
            key,
            step: 0,
            steps_per_frame: per_frame as u64,
            rows: Vec::new(),
            pinches: Vec::new(),
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
                (Fault::Pinched, Some(report)) => {
                    self.count_pinches(number);
                    *report
                }
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
            let settings = Settings { method: Method::ImplicitContact, ..self.settings };
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

    /// Counts the pinched step for each pair of bodies that its witnesses name.
    fn count_pinches(&mut self, step: u64) {
        let world = &self.scene.world;
        let body = |key: u64| self.scene.bodies.iter().find(|body| body.id == world.id_of_key(key));
        let name = |key: u64| body(key).map_or(String::new(), |body| body.name.clone());
        let mut pairs: Vec<[String; 2]> = world.witnesses().iter().map(|w| w.bodies.map(name)).collect();
        pairs.iter_mut().for_each(|pair| pair.sort_unstable());
        pairs.sort_unstable();
        pairs.dedup();
        for bodies in pairs {
            match self.pinches.iter_mut().find(|pinch| pinch.bodies == bodies) {
                Some(pinch) => (pinch.last_step, pinch.steps) = (step, pinch.steps + 1),
                None => self.pinches.push(Pinch { bodies, first_step: step, last_step: step, steps: 1 }),
            }
        }
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
            method: self.file.settings.method.unwrap_or_default(),
            fail_safe: self.file.settings.fail_safe.unwrap_or_default(),
            friction: self.options.friction,
            vertices: self.scene.vertices,
            free_vertices: self.scene.free_vertices,
            tets: self.scene.tetrahedra,
            bodies: self.scene.bodies.len(),
            steps: self.step,
            whole: self.step >= self.file.steps() && self.options.as_written(),
            dt: self.file.dt,
            mass: self.scene.bodies.iter().map(|body| body.energies.mass()).sum(),
            threads: self.options.threads.max(1),
            jitter: self.options.jitter,
            up: self.file.up,
            floor: floor(self.file),
            planes: planes(&self.scene),
            scripted: self.scene.bodies.iter().filter(|body| body.is_scripted()).map(|b| b.name.clone()).collect(),
            camera: self.file.output.camera,
            look_at: self.file.output.look_at,
            pinches: std::mem::take(&mut self.pinches),
            frames: if self.options.out.is_some() { frames } else { 0 },
            frames_per_second: rate,
            hash: format!("{:016x}", self.scene.world.state_hash()),
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

/// Half-spaces at the end: normal and offset.
fn planes(scene: &Scene) -> Vec<[f64; 4]> {
    let planes = scene.bodies.iter().filter_map(|body| scene.world.half_space(body.id).ok());
    planes.map(|plane| [plane.normal[0], plane.normal[1], plane.normal[2], plane.offset]).collect()
}

fn summary(report: &Report) -> String {
    let facts = &report.facts;
    let rounds: Vec<String> = report.cmr_rounds_histogram.iter().map(|(r, n)| format!("{r}: {n}")).collect();
    let pinches: Vec<String> = facts
        .pinches
        .iter()
        .map(|p| {
            format!(
                "\npinched between {}: {} steps, {} to {}",
                p.bodies.join(" and "),
                p.steps,
                p.first_step,
                p.last_step
            )
        })
        .collect();
    let ends: Vec<String> = report
        .ends
        .iter()
        .map(|end| {
            format!("\n{} has gone {:.4} m along {:?}, at {:.4} m/s", end.name, end.travel, end.direction, end.speed)
        })
        .collect();
    let (t, p) = (&report.seconds_per_step, &report.processor_seconds_per_step);
    format!(
        "{}: {} vertices, {} tetrahedra, {} bodies, {} steps of {} s\n\
         contacts at most {}; rounds {{{}}}; {} steps divided, {} with fail-safes, {} pinched, {} not converged\n\
         {} intersections (certified, all steps); largest residual {:.2e}\n\
         seconds a step: mean {:.4}, median {:.4}, p95 {:.4}, max {:.4}; of the processor: median {:.4}, p95 {:.4}{}{}\n\
         hash {}",
        facts.scene,
        facts.vertices,
        facts.tets,
        facts.bodies,
        facts.steps,
        facts.dt,
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
        pinches.concat(),
        ends.concat(),
        facts.hash,
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
