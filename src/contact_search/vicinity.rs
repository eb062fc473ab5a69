//! The candidates that can count while no vertex goes far, so that what rests or is slow screens these alone.

use crate::math::{Vec3, norm_squared, sub};
use crate::model::Model;

/// Where vertices are slow, a list reaches so many half thicknesses farther than asked, to be of use again.
const SLACK: f64 = 0.5;

/// Share of what a list reaches farther that vertices may move; the rest covers the rounding of distances.
const MOVED: f64 = 0.9;

/// That rounding, relative to the largest coordinate.
const ROUNDING: f64 = 1e-12;

/// Numbers of candidates, ascending: those left out were farther apart than `reach` half thicknesses of both sides when
/// vertices were `at`. A cache: emptying it changes no bit.
#[derive(Default)]
pub(super) struct Vicinity {
    /// The search that the candidates are of; 0 where there is no list.
    search: u64,
    numbers: Vec<u32>,
    at: Vec<Vec3>,
    reach: f64,
    /// Largest coordinate and smallest half thickness that is not zero `[m]`.
    largest: f64,
    thinnest: f64,
}

impl Vicinity {
    /// The list, if it holds all that come closer than `reach` half thicknesses of both sides at each of `positions` and on
    /// straight lines between them. Cost: linear in vertices.
    pub fn list(&self, model: &Model, search: u64, positions: &[&[Vec3]], reach: f64) -> Option<&[u32]> {
        let farther = self.reach - reach;
        let resolved = ROUNDING * self.largest <= (1.0 - MOVED) * farther * self.thinnest;
        let holds = |x: &&[Vec3]| x.len() == self.at.len() && is_within(model, &self.at, x, MOVED * farther);
        (search != 0 && search == self.search && resolved && positions.iter().all(holds)).then_some(&self.numbers)
    }

    /// How far the next list, at `x`, is to reach that must reach `reach` half thicknesses: farther where vertices have come
    /// so short a way since the last one that it would be of use again.
    pub fn next_reach(&self, model: &Model, x: &[Vec3], reach: f64) -> f64 {
        let slow = x.len() == self.at.len() && is_within(model, &self.at, x, MOVED * SLACK);
        if slow { reach + SLACK } else { reach }
    }

    /// The list last taken.
    pub fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// How far it reaches where it was taken, in half thicknesses.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Takes a list that reaches `reach` half thicknesses around `at`.
    pub fn assign(&mut self, model: &Model, search: u64, at: &[Vec3], reach: f64, numbers: &[u32]) {
        (self.search, self.reach) = (search, reach);
        self.numbers.clear();
        self.numbers.extend_from_slice(numbers);
        self.at.clear();
        self.at.extend_from_slice(at);
        self.largest = at.iter().flatten().fold(0.0, |largest, c| c.abs().max(largest));
        let thick = model.bodies.iter().map(|b| b.half_thickness).filter(|h| *h > 0.0);
        self.thinnest = thick.fold(f64::INFINITY, f64::min);
    }
}

/// Whether no vertex is farther from where it was than so many of its half thicknesses.
fn is_within(model: &Model, was: &[Vec3], is: &[Vec3], half_thicknesses: f64) -> bool {
    was.iter().zip(is).zip(&model.vertex_body).all(|((p, q), body)| {
        let limit = half_thicknesses * model.bodies[*body as usize].half_thickness;
        norm_squared(sub(*q, *p)) <= limit * limit
    })
}
