//! Prescribed motion: velocities that stay for a while, or frames from a file.

use super::fault::FieldFault;
use crate::kinematics::Pose;
use crate::math::{Vec3, add_scaled, lerp};
use serde::Deserialize;
use std::path::Path;

/// A phase of a motion: a velocity and an angular velocity about the moving centre. After the last phase all stands.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Twist {
    /// When the phase ends `[s]`; it begins where the one before ends, the first at zero.
    pub until: f64,
    #[serde(default)]
    pub velocity: Vec3,
    #[serde(default)]
    pub angular_velocity: Vec3,
}

/// Where `start`, moved by the phases, stands at time `t`.
pub fn moved(start: Pose, motion: &[Twist], t: f64) -> Pose {
    let (mut pose, mut from) = (start, 0.0);
    for twist in motion {
        if t <= from {
            break;
        }
        pose = pose.advanced(twist.velocity, twist.angular_velocity, twist.until.min(t) - from);
        from = twist.until;
    }
    pose
}

/// How far something has been carried at time `t`.
pub fn shifted(motion: &[Twist], t: f64) -> Vec3 {
    let (mut shift, mut from) = ([0.0; 3], 0.0);
    for twist in motion {
        if t <= from {
            break;
        }
        shift = add_scaled(shift, twist.until.min(t) - from, twist.velocity);
        from = twist.until;
    }
    shift
}

/// Positions of vertices from a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramesTable {
    /// Beside the scene file: little-endian, u32 number of frames, u32 number of vertices, then x, y, z as f32 for each
    /// vertex of each frame.
    pub file: String,
    /// `[s]`
    pub seconds_per_frame: f64,
    /// Whether to run back and forth; without, the last frame stays.
    #[serde(default)]
    pub back_and_forth: bool,
}

/// Frames between which vertices move straight.
#[derive(Clone, Debug)]
pub struct Frames {
    frames: Vec<Vec<Vec3>>,
    seconds_per_frame: f64,
    back_and_forth: bool,
}

impl Frames {
    /// Reads frames of `vertices` vertices. Errors name the field `at`.
    pub fn read(table: &FramesTable, folder: &Path, vertices: usize, at: &str) -> Result<Frames, FieldFault> {
        let fault = |message: String| FieldFault::new(format!("{at}.file"), message);
        let path = folder.join(&table.file);
        let bytes = std::fs::read(&path).map_err(|error| fault(format!("{}: {error}", path.display())))?;
        let mut words = bytes.chunks_exact(4).map(|b| [b[0], b[1], b[2], b[3]]);
        let mut count = || words.next().map_or(0, u32::from_le_bytes) as usize;
        let (frames, each) = (count(), count());
        if frames == 0 || each != vertices || bytes.len() != 8 + 12 * frames * each {
            let length = bytes.len();
            let message = format!("{length} bytes, {frames} frames of {each} vertices; the mesh has {vertices}");
            return Err(fault(message));
        }
        let numbers: Vec<f64> = words.map(|b| f64::from(f32::from_le_bytes(b))).collect();
        let points: Vec<Vec3> = numbers.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
        if let Some(i) = points.iter().position(|x| !crate::math::is_finite(*x)) {
            return Err(fault(format!("vertex {} of frame {} is not finite", i % each, i / each)));
        }
        Ok(Frames {
            frames: points.chunks_exact(each).map(<[Vec3]>::to_vec).collect(),
            seconds_per_frame: table.seconds_per_frame,
            back_and_forth: table.back_and_forth,
        })
    }

    /// Multiplies every position.
    pub fn scaled(mut self, factor: f64) -> Frames {
        self.frames.iter_mut().flatten().for_each(|x| *x = crate::math::scale(factor, *x));
        self
    }

    /// Positions at time `t`, at `pose`.
    pub fn at(&self, t: f64, pose: &Pose) -> Vec<Vec3> {
        let last = (self.frames.len() - 1) as f64;
        let mut place = t / self.seconds_per_frame;
        if self.back_and_forth && last > 0.0 {
            place %= 2.0 * last;
            place = place.min(2.0 * last - place);
        }
        let place = place.clamp(0.0, last);
        let (i, j) = (place.floor() as usize, place.ceil() as usize);
        let share = place - place.floor();
        let between = |(a, b): (&Vec3, &Vec3)| pose.transform(lerp(*a, *b, share));
        self.frames[i].iter().zip(&self.frames[j]).map(between).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, sub};

    #[test]
    fn phases_follow_each_other_and_then_all_stands() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let motion = [
            Twist { until: 1.0, velocity: [0.0; 3], angular_velocity: [0.0; 3] },
            Twist { until: 3.0, velocity: [0.5, 0.0, 0.0], angular_velocity: [0.0, 0.0, quarter] },
        ];
        let start = Pose { position: [1.0, 0.0, 0.0], ..Pose::IDENTITY };
        assert_eq!(moved(start, &motion, 0.5), start);
        // After a quarter turn and half a metre, and at the end of the half turn.
        let x = |t| moved(start, &motion, t).transform([1.0, 0.0, 0.0]);
        assert!(norm(sub(x(2.0), [1.5, 1.0, 0.0])) < 1e-14);
        assert!(norm(sub(x(9.0), [1.0, 0.0, 0.0])) < 1e-14);
        assert_eq!(shifted(&motion, 2.0), [0.5, 0.0, 0.0]);
    }

    #[test]
    fn frames_run_back_and_forth() {
        let frames = |back_and_forth| Frames {
            frames: [0.0, 1.0, 4.0].map(|x| vec![[x, 0.0, 0.0]]).to_vec(),
            seconds_per_frame: 0.5,
            back_and_forth,
        };
        let x = |f: &Frames, t| f.at(t, &Pose::IDENTITY)[0][0];
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0, 7.0].map(|t| x(&frames(false), t)), [0.0, 0.5, 1.0, 2.5, 4.0, 4.0]);
        assert_eq!([1.25, 1.5, 2.0, 2.25].map(|t| x(&frames(true), t)), [2.5, 1.0, 0.0, 0.5]);
    }
}
