//! Division of a step in time: equal parts when something turns far, halves when a part does not come clean.

use crate::kinematics::turn;
use crate::model::{Drives, Kind, Model, Settings, State};

/// Equal parts that a turning body may divide a step into at most. Beyond, chords are coarser, and still safe.
const PARTS_MAX: u32 = 64;

/// A part of a step still to be done: fractions of the step, and how often it was halved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Fraction at the start.
    pub from: f64,
    /// Fraction at the end.
    pub to: f64,
    /// Halvings so far.
    pub depth: u32,
}

impl Part {
    /// First and second half, one halving deeper.
    pub fn halves(&self) -> [Part; 2] {
        let middle = 0.5 * (self.from + self.to);
        let depth = self.depth + 1;
        [Part { from: self.from, to: middle, depth }, Part { from: middle, to: self.to, depth }]
    }
}

/// The parts of a step, last one first: as many as keep every rigid or scripted turn within `settings.turn_max`. `parts`
/// is written over.
pub fn parts_of_step(
    model: &Model,
    state: &State,
    drives: &Drives,
    settings: &Settings,
    dt: f64,
    parts: &mut Vec<Part>,
) {
    let mut largest = 0.0_f64;
    for (index, body) in model.bodies.iter().enumerate() {
        let angle = match body.description.kind {
            Kind::Rigid { .. } => turn(drives.velocities[body.blocks.start + 1], dt),
            Kind::Kinematic { posed: true } => {
                turn(state.poses[index].velocity_to(&drives.target_poses[index], dt).1, dt)
            }
            Kind::HalfSpace(_) => {
                let (a, b) = (state.half_spaces[index].normal, drives.target_half_spaces[index].normal);
                crate::math::norm(crate::math::cross(a, b)).atan2(crate::math::dot(a, b))
            }
            _ => 0.0,
        };
        largest = largest.max(angle);
    }
    let wanted = (largest / settings.turn_max).ceil();
    let count = if wanted >= f64::from(PARTS_MAX) { PARTS_MAX } else { (wanted as u32).max(1) };
    let fraction = |i: u32| f64::from(i) / f64::from(count);
    parts.clear();
    parts.extend((0..count).rev().map(|i| Part { from: fraction(i), to: fraction(i + 1), depth: 0 }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_cover_the_part() {
        let part = Part { from: 0.25, to: 0.5, depth: 1 };
        let [a, b] = part.halves();
        assert_eq!((a.from, a.to, b.to, b.depth), (0.25, b.from, 0.5, 2));
    }
}
