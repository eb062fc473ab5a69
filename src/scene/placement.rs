//! Where bodies and their copies stand.

use super::fault::FieldFault;
use super::file::{finite, positive};
use crate::kinematics::Pose;
use crate::math::{Vec3, add, norm, scale};
use serde::Deserialize;

/// Scale, then turns in their order, then the shift to a position.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    #[serde(default)]
    pub position: Vec3,
    #[serde(default)]
    pub rotation: Vec<Turn>,
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

impl Default for Placement {
    fn default() -> Self {
        Placement { position: [0.0; 3], rotation: Vec::new(), scale: 1.0 }
    }
}

/// A turn about an axis through the origin.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    pub axis: Vec3,
    pub degrees: f64,
}

/// Copies of a body on the slots of a grid around its placement, layer upon layer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Copies {
    /// Number of slots.
    pub count: usize,
    /// Slots of a layer along the first two axes; the third goes on.
    pub grid: [usize; 2],
    /// From slot to slot `[m]`.
    pub spacing: Vec3,
    /// The axes that the slots run along: the layers along the last.
    #[serde(default = "xyz")]
    pub axes: [usize; 3],
    /// Which slots are taken.
    #[serde(default)]
    pub slots: Slots,
    /// Turns by random angles drawn from this seed; without: none.
    pub turns_seed: Option<u64>,
    /// How much farther than the slot before each is turned about the placement.
    pub turn: Option<Turn>,
    /// Words that take the place of `*` in the names of the mesh files, slot after slot in their order, over and over.
    #[serde(default)]
    pub variants: Vec<String>,
    /// Of how many variants these are the copies of which.
    #[serde(skip)]
    pub variant: Option<(usize, usize)>,
}

fn xyz() -> [usize; 3] {
    [0, 1, 2]
}

/// Slots by the parity of the sum of their three numbers: two bodies share a grid as the fields of a chess board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slots {
    #[default]
    All,
    Even,
    Odd,
}

impl Turn {
    fn check(&self, at: &str) -> Result<(), FieldFault> {
        finite(self.axis, at, "axis")?;
        finite([self.degrees, 0.0, 0.0], at, "degrees")?;
        if norm(self.axis) == 0.0 {
            return Err(FieldFault::new(format!("{at}.axis"), "an axis is not zero"));
        }
        Ok(())
    }

    /// The pose after it has been turned so many times.
    fn of(&self, pose: &Pose, times: f64) -> Pose {
        let rate = times * self.degrees.to_radians() / norm(self.axis);
        pose.advanced([0.0; 3], scale(rate, self.axis), 1.0)
    }
}

impl Placement {
    pub fn check(&self, at: &str) -> Result<(), FieldFault> {
        finite(self.position, at, "position")?;
        positive(self.scale, at, "scale")?;
        for (i, turn) in self.rotation.iter().enumerate() {
            turn.check(&format!("{at}.rotation[{i}]"))?;
        }
        Ok(())
    }

    /// Position and turn, without the scale.
    pub fn pose(&self) -> Pose {
        let turned = self.rotation.iter().fold(Pose::IDENTITY, |pose, turn| turn.of(&pose, 1.0));
        Pose { position: self.position, ..turned }
    }
}

impl Copies {
    pub fn check(&self, at: &str) -> Result<(), FieldFault> {
        finite(self.spacing, at, "spacing")?;
        if self.count == 0 {
            return Err(FieldFault::new(format!("{at}.count"), "at least one slot"));
        }
        if let Some(i) = self.grid.iter().position(|side| *side == 0) {
            return Err(FieldFault::new(format!("{at}.grid[{i}]"), "at least one slot each way"));
        }
        if let Some(turn) = &self.turn {
            turn.check(&format!("{at}.turn"))?;
        }
        let mut axes = self.axes;
        axes.sort_unstable();
        if axes != xyz() {
            return Err(FieldFault::new(format!("{at}.axes"), "the numbers 0, 1 and 2 in some order"));
        }
        Ok(())
    }

    /// Poses of the copies of a body placed at `pose`: layers stand on it, rows and columns around it.
    pub fn poses(&self, pose: &Pose) -> Vec<Pose> {
        let mut out = Vec::new();
        for slot in 0..self.count {
            let [columns, rows] = self.grid;
            let place = [slot % columns, slot / columns % rows, slot / (columns * rows)];
            let even = place.iter().sum::<usize>() % 2 == 0;
            let other = self.variant.is_some_and(|(which, of)| slot % of != which);
            if other || (self.slots == Slots::Even && !even) || (self.slots == Slots::Odd && even) {
                continue;
            }
            let middle = [0.5 * (columns as f64 - 1.0), 0.5 * (rows as f64 - 1.0), 0.0];
            let mut shift = [0.0; 3];
            for k in 0..3 {
                shift[self.axes[k]] = self.spacing[self.axes[k]] * (place[k] as f64 - middle[k]);
            }
            let start = match self.turns_seed {
                None => *pose,
                Some(seed) => Pose { orientation: Sequence::new(seed, slot as u64).turn(), ..*pose },
            };
            let turned = self.turn.as_ref().map_or(start, |turn| turn.of(&start, slot as f64));
            out.push(Pose { position: add(pose.position, shift), ..turned });
        }
        out
    }
}

/// Random numbers: the splitmix sequence.
pub struct Sequence(u64);

impl Sequence {
    /// Sequence `number` of a seed.
    pub fn new(seed: u64, number: u64) -> Sequence {
        let mut first = Sequence(seed);
        let mixed = first.next();
        Sequence(mixed ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [-1, 1).
    pub fn number(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A vector in the unit ball.
    pub fn in_ball(&mut self) -> Vec3 {
        loop {
            let v = [self.number(), self.number(), self.number()];
            if norm(v) <= 1.0 {
                return v;
            }
        }
    }

    /// A unit quaternion; all turns are as likely.
    fn turn(&mut self) -> [f64; 4] {
        loop {
            let q = [self.number(), self.number(), self.number(), self.number()];
            let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
            if (0.1..=1.0).contains(&length) {
                return q.map(|c| c / length);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_follow_each_other_and_copies_share_a_grid() {
        let quarter = |axis| Turn { axis, degrees: 90.0 };
        let placement =
            Placement { rotation: vec![quarter([0.0, 0.0, 2.0]), quarter([1.0, 0.0, 0.0])], ..Placement::default() };
        // x goes to y, then y to z.
        let x = placement.pose().transform([1.0, 0.0, 0.0]);
        assert!(norm(crate::math::sub(x, [0.0, 0.0, 1.0])) < 1e-15, "{x:?}");

        let copies = |slots, turns_seed| Copies {
            count: 7,
            grid: [2, 2],
            spacing: [1.0, 2.0, 3.0],
            axes: xyz(),
            slots,
            turns_seed,
            turn: None,
            variants: Vec::new(),
            variant: None,
        };
        let at = |slots| copies(slots, None).poses(&Pose::IDENTITY).iter().map(|p| p.position).collect::<Vec<_>>();
        assert_eq!(at(Slots::All)[6], [-0.5, 1.0, 3.0]);
        assert_eq!(at(Slots::Even), [[-0.5, -1.0, 0.0], [0.5, 1.0, 0.0], [0.5, -1.0, 3.0], [-0.5, 1.0, 3.0]]);
        assert_eq!(at(Slots::Odd).len(), 3);
        let turned = copies(Slots::All, Some(1)).poses(&Pose::IDENTITY);
        assert!(turned.windows(2).all(|w| w[0].orientation != w[1].orientation));
        assert_eq!(turned, copies(Slots::All, Some(1)).poses(&Pose::IDENTITY));

        let second = Copies { variant: Some((1, 3)), ..copies(Slots::All, None) };
        let of_all = copies(Slots::All, None).poses(&Pose::IDENTITY);
        assert_eq!(second.poses(&Pose::IDENTITY), [of_all[1], of_all[4]]);

        // Around a quarter in three turns of 30 degrees.
        let around =
            Copies { turn: Some(Turn { degrees: 30.0, ..quarter([0.0, 0.0, 1.0]) }), ..copies(Slots::All, None) };
        let (first, fourth) = (around.poses(&Pose::IDENTITY)[0], around.poses(&Pose::IDENTITY)[3]);
        let x = |pose: Pose| crate::math::sub(pose.transform([1.0, 0.0, 0.0]), pose.position);
        assert!(norm(crate::math::sub(x(first), [1.0, 0.0, 0.0])) < 1e-15);
        assert!(norm(crate::math::sub(x(fourth), [0.0, 1.0, 0.0])) < 1e-15);
    }
}
