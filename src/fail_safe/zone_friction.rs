//! Friction within a projected zone: slides slow down, each within its own limit or all within one [Harmon10, §3.7].

use super::minimum_norm::minimum_norm;
use super::zone_factor::LateFactor;
use super::zone_rows::{ZoneRows, inner};
use crate::math::{Vec3, add_scaled, scale};

/// Passes over the contacts.
const PASSES: usize = 30;

/// Friction of each contact on its own: a descent of the kinetic energy of sliding over impulses within their limits.
pub(super) struct ContactFriction {
    /// Two rows per contact, along its tangents.
    rows: ZoneRows,
    /// Sliding velocity before the projection, per contact `[m/s]`.
    sliding: Vec<[f64; 2]>,
    coefficients: Vec<f64>,
    /// Impulses so far, per contact `[N s]`.
    impulses: Vec<[f64; 2]>,
    /// Inverse of the largest eigenvalue of each contact's own response `[kg]`.
    steps: Vec<f64>,
}

impl ContactFriction {
    /// Of contacts that slide at `sliding`, with their coefficients.
    pub fn new(rows: ZoneRows, sliding: Vec<[f64; 2]>, coefficients: Vec<f64>) -> ContactFriction {
        let count = sliding.len();
        let step = |i: usize| {
            let length = |k: usize| if rows.scales[k] > 0.0 { 1.0 / rows.scales[k] } else { 0.0 };
            let (a, b) = (length(2 * i), length(2 * i + 1));
            let coupling = rows.inner_product(2 * i, 2 * i + 1) * a * b;
            let (mean, half) = (0.5 * (a * a + b * b), 0.5 * (a * a - b * b));
            let largest = mean + half.hypot(coupling);
            if largest > 0.0 { 1.0 / largest } else { 0.0 }
        };
        let steps = (0..count).map(step).collect();
        ContactFriction { impulses: vec![[0.0; 2]; count], rows, sliding, coefficients, steps }
    }

    /// Slows the slides of `y`, within the coefficient times the normal impulse of each contact `[N s]`. Never raises
    /// the kinetic energy of a motion without scripted parts: each contact's step is one of descent.
    pub fn apply(&mut self, normal_impulses: &[f64], y: &mut [Vec3]) {
        for _ in 0..PASSES {
            for i in 0..self.sliding.len() {
                // What it has been given already stays allowed, so that no step is forced uphill.
                let given = self.impulses[i][0].hypot(self.impulses[i][1]);
                let limit = (self.coefficients[i] * normal_impulses[i].max(0.0)).max(given);
                if limit == 0.0 {
                    continue;
                }
                let mut wanted = self.impulses[i];
                for k in 0..2 {
                    let row = 2 * i + k;
                    if self.rows.scales[row] > 0.0 {
                        let slide = self.sliding[i][k] + self.rows.product(row, y) / self.rows.scales[row];
                        wanted[k] -= self.steps[i] * slide;
                    }
                }
                let length = wanted[0].hypot(wanted[1]);
                let share = if length > limit { limit / length } else { 1.0 };
                for k in 0..2 {
                    let (row, next) = (2 * i + k, share * wanted[k]);
                    if self.rows.scales[row] > 0.0 {
                        self.rows.add_row(row, (next - self.impulses[i][k]) / self.rows.scales[row], y);
                        self.impulses[i][k] = next;
                    }
                }
            }
        }
    }
}

/// One limit for the whole zone: `min(mu |response|, |slide|)` off the slide, in the norm of the masses
/// [Harmon10, §3.7, with the signs put right].
///
/// `rows` are normal and tangents of every contact that pushes, `relative` their velocities after the projection, in
/// `rows`' own scale. The slide is what must go for all of these to vanish; it goes in one proportion, so that no contact
/// approaches.
pub(super) fn zone_friction(rows: &ZoneRows, relative: &[f64], coefficient: f64, response: f64, y: &mut [Vec3]) {
    let against: Vec<f64> = relative.iter().map(|u| -u).collect();
    let slide = minimum_norm(rows, &against, &mut LateFactor::default()).y;
    let length = inner(&slide, &slide).sqrt();
    if length == 0.0 {
        return;
    }
    let share = (coefficient * response / length).min(1.0);
    y.iter_mut().zip(&slide).for_each(|(y, s)| *y = add_scaled(*y, 1.0, scale(share, *s)));
}
