//! What the user asks for.

use signorini::model::FailSafe;
use std::path::PathBuf;

pub const USAGE: &str = "usage: clean_trajectory IN OUT [options]
  IN   folder of recorded frames: OBJ files in the order of their names, all with the vertices of the first
  OUT  folder for the frames without collisions, same names
  --mode displacement|position  add the recorded displacements to what has become of the frame before (default), or aim
                    at the recorded positions again in every frame: closer, and dear where these have much crossed
  --return S        in displacement mode: what contact changed fades by 1/e in S seconds, as far as contact lets it;
                    default 0.2; inf: it stays
  --scripted NAME   the object (`o NAME`) goes where it was recorded; may be given again
  --density NAME=D  mass per area of an object against the others' 1; may be given again
  --thickness M     distance that surfaces keep, metres; default: a fifth of the mean edge of the two
  --friction MU     Coulomb coefficient; default 0
  --fps N           frames a second, which thickness that was lost comes back by; default 60
  --rest FILE       OBJ of the same mesh that intersects nowhere; default: the first such frame
  --fail-safe unilateral|inelastic|rigid   what resolves zones of collisions; default unilateral
  --single          positions are certified as single precision numbers, for programs that keep such";

/// What follows a recorded trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    Position,
    Displacement,
}

#[derive(Debug)]
pub struct Options {
    pub source: PathBuf,
    pub target: PathBuf,
    pub mode: Mode,
    /// Seconds in which a distance from the recorded positions fades by 1/e; infinite: it does not.
    pub return_time: f64,
    pub scripted: Vec<String>,
    pub densities: Vec<(String, f64)>,
    pub thickness: Option<f64>,
    pub friction: f64,
    pub frames_per_second: f64,
    pub rest: Option<PathBuf>,
    pub fail_safe: FailSafe,
    pub single: bool,
}

/// The options of a command line. Errors: what is wrong.
pub fn parse(mut words: impl Iterator<Item = String>) -> Result<Options, String> {
    let mut folders = Vec::new();
    let mut options = Options {
        source: PathBuf::new(),
        target: PathBuf::new(),
        mode: Mode::Displacement,
        return_time: 0.2,
        scripted: Vec::new(),
        densities: Vec::new(),
        thickness: None,
        friction: 0.0,
        frames_per_second: 60.0,
        rest: None,
        fail_safe: FailSafe::UnilateralProjection,
        single: false,
    };
    while let Some(word) = words.next() {
        let name = word.clone();
        let mut value = || words.next().ok_or_else(|| format!("{name} needs a value"));
        match word.as_str() {
            "--mode" => {
                options.mode = match value()?.as_str() {
                    "position" => Mode::Position,
                    "displacement" => Mode::Displacement,
                    other => return Err(format!("there is no mode {other}")),
                }
            }
            "--fail-safe" => {
                options.fail_safe = match value()?.as_str() {
                    "unilateral" => FailSafe::UnilateralProjection,
                    "inelastic" => FailSafe::InelasticProjection,
                    "rigid" => FailSafe::RigidZone,
                    other => return Err(format!("there is no fail-safe {other}")),
                }
            }
            "--return" => {
                let word = value()?;
                options.return_time = if word == "inf" { f64::INFINITY } else { positive("--return", &word)? };
            }
            "--scripted" => options.scripted.push(value()?),
            "--density" => {
                let pair = value()?;
                let (object, density) = pair.rsplit_once('=').ok_or_else(|| format!("{pair} is not NAME=D"))?;
                options.densities.push((object.to_string(), positive("--density", density)?));
            }
            "--thickness" => options.thickness = Some(positive("--thickness", &value()?)?),
            "--friction" => options.friction = not_negative("--friction", &value()?)?,
            "--fps" => options.frames_per_second = positive("--fps", &value()?)?,
            "--rest" => options.rest = Some(value()?.into()),
            "--single" => options.single = true,
            other if other.starts_with("--") => return Err(format!("there is no option {other}")),
            _ => folders.push(PathBuf::from(word)),
        }
    }
    [options.source, options.target] = folders.try_into().map_err(|_| "two folders are needed, IN and OUT")?;
    Ok(options)
}

fn not_negative(name: &str, word: &str) -> Result<f64, String> {
    let value = word.parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0);
    value.ok_or_else(|| format!("{name}: {word} is not a number of at least 0"))
}

fn positive(name: &str, word: &str) -> Result<f64, String> {
    let value = not_negative(name, word)?;
    if value > 0.0 { Ok(value) } else { Err(format!("{name}: {word} is not above 0")) }
}
