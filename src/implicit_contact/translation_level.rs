//! A second level of the relaxation's metric: rigid translations of what A couples, the softest modes, which steps from
//! block to block find last.
//!
//! The metric of an iteration has the inverse `S^-1 + P T M^-1 P^T`: block by block, and with the columns of P translating
//! a component, of mass `M = P^T A P`. Contacts are relaxed in it, so a component gives way as a whole while they hold.
//! The shares T keep one pass over the contacts close to a projection: with T = 1 all contacts of a component would act on
//! each other more than on themselves.

use crate::constraint::{RowSet, Translations};
use crate::math::simd::Quad;
use crate::math::{Mat3, ZERO_MATRIX, add_scaled, mat_scale};

/// No component on this side of a contact.
const NONE: u32 = u32::MAX;

/// Weights that cancel up to this are those of a contact within a component.
const CANCELS: f64 = 1e-6;

/// A share is taken anew once it is off by these factors: then all local metrics are.
const OFF: (f64, f64) = (0.5, 4.0);

/// A component, its velocity in the present prediction, and sums over its blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Component {
    inverse_mass: Mat3,
    share: f64,
    /// Columns of the inverse mass times the share.
    inverse: [Quad; 3],
    /// What contacts have changed since the prediction; the velocity with it, and that of the prediction before.
    change: Quad,
    shift: Quad,
    before: Quad,
    /// Sums of `A dv'`, `A dv` and `A z`.
    a_u: Quad,
    a_dv: Quad,
    a_z: Quad,
}

/// The components of a metric; capacity is kept.
#[derive(Clone, Debug, Default)]
pub(super) struct TranslationLevel {
    /// Component of each block; those that belong to none share the last one, which stays where it is.
    component: Vec<u32>,
    components: Vec<Component>,
    /// Blocks that follow each other in one component: from, to, component.
    stretches: Vec<[u32; 3]>,
    /// Number of contacts of each component and the sum of their compliances.
    sums: Vec<(f64, f64)>,
    /// What rounded masses are relative to.
    mass: f64,
}

/// The components on both sides of a contact, and the sums of its weights there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides {
    components: [u32; 2],
    weights: [f32; 2],
}

impl Default for Sides {
    fn default() -> Sides {
        Sides { components: [NONE; 2], weights: [0.0; 2] }
    }
}

impl TranslationLevel {
    /// Takes the components of `translations`, none without or where there is but one (a cloth alone waits for its
    /// stretching); rounded masses are relative to `mass`.
    pub fn assign(&mut self, translations: Option<&Translations>, blocks: usize, mass: f64) {
        let TranslationLevel { component, components, stretches, .. } = self;
        let translations = translations.filter(|t| t.inverse_masses().len() > 1);
        let masses = translations.map_or(&[][..], |t| t.inverse_masses());
        let of = |b: usize| translations.and_then(|t| t.component(b)).unwrap_or(masses.len()) as u32;
        components.clear();
        components.extend(masses.iter().map(|m| Component { inverse_mass: *m, ..Component::default() }));
        components.iter_mut().for_each(|c| c.take(1.0, mass));
        components.push(Component::default());
        component.clear();
        component.extend((0..blocks).map(of));
        stretches.clear();
        let mut start = 0;
        for same in component.chunk_by(|a, b| a == b) {
            let end = start + same.len() as u32;
            if (same[0] as usize) < masses.len() {
                stretches.push([start, end, same[0]]);
            }
            start = end;
        }
        self.mass = mass;
    }

    /// The sides of row `i`.
    pub fn sides(&self, rows: &RowSet, i: usize) -> Sides {
        let none = self.components.len() as u32 - 1;
        let mut sides = [(NONE, 0.0f64); 2];
        for k in rows.offsets[i] as usize..rows.offsets[i + 1] as usize {
            let component = self.component[rows.blocks[k] as usize];
            if component == none {
                continue;
            }
            if let Some(side) = sides.iter_mut().find(|s| s.0 == component || s.0 == NONE) {
                *side = (component, side.1 + rows.weights[k]);
            }
        }
        // A component does not feel contacts within it.
        let sides = sides.map(|s| if s.1.abs() > CANCELS { s } else { (NONE, 0.0) });
        Sides { components: sides.map(|s| s.0), weights: sides.map(|s| s.1 as f32) }
    }

    /// Weighs the components by their contacts, each with its sides and its compliance [1/kg] in S: what the contacts of
    /// a component give each other through it shall not be more than what one gives by itself. Returns whether anything
    /// changed.
    pub fn weigh<'a>(&mut self, contacts: impl Iterator<Item = (&'a Sides, f64)>) -> bool {
        let TranslationLevel { components, sums, mass, .. } = self;
        sums.clear();
        sums.resize(components.len(), (0.0, 0.0));
        for (sides, compliance) in contacts {
            for c in sides.components.iter().filter(|c| **c != NONE) {
                let (count, sum) = &mut sums[*c as usize];
                *count += 1.0;
                *sum += compliance;
            }
        }
        let mut changed = false;
        for (c, (count, sum)) in components.iter_mut().zip(sums).filter(|(_, sums)| sums.0 > 0.0) {
            let m = &c.inverse_mass;
            let own = (m[0][0] + m[1][1] + m[2][2]) / 3.0;
            let share = (*sum / *count / (*count * own)).min(1.0);
            if share < OFF.0 * c.share || share > OFF.1 * c.share {
                c.take(share, *mass);
                changed = true;
            }
        }
        changed
    }

    /// What the components add to `W S^-1 W^T` of a contact.
    pub fn metric(&self, sides: &Sides) -> Mat3 {
        let mut g = ZERO_MATRIX;
        for (c, w) in sides.components.iter().zip(sides.weights).filter(|(c, _)| **c != NONE) {
            let component = &self.components[*c as usize];
            for (sum, row) in g.iter_mut().zip(&component.inverse_mass) {
                *sum = add_scaled(*sum, f64::from(w) * f64::from(w) * component.share, *row);
            }
        }
        g
    }

    /// What a contact sees of the changes.
    #[inline(always)]
    pub fn seen(&self, sides: &Sides) -> Quad {
        let mut sum = Quad::default();
        for k in 0..2 {
            if sides.components[k] != NONE {
                sum = sum.add_scaled(sides.weights[k], self.components[sides.components[k] as usize].change);
            }
        }
        sum
    }

    /// Lets the components follow an impulse of a contact.
    #[inline(always)]
    pub fn respond(&mut self, sides: &Sides, f: Quad) {
        for k in 0..2 {
            if sides.components[k] != NONE {
                let c = &mut self.components[sides.components[k] as usize];
                c.change = c.change.add_scaled(sides.weights[k], Quad::combine(&c.inverse, f));
            }
        }
    }

    /// Puts the changes into the blocks.
    pub fn settle(&mut self, u: &mut [Quad]) {
        for [start, end, c] in &self.stretches {
            let change = self.components[*c as usize].change;
            u[*start as usize..*end as usize].iter_mut().for_each(|u| *u = *u + change);
        }
        for c in &mut self.components {
            c.shift = c.shift + std::mem::take(&mut c.change);
        }
    }

    /// Takes note of `A dv'`.
    pub fn observe(&mut self, a_u: &[Quad]) {
        self.sum(a_u, |c| &mut c.a_u);
    }

    fn sum(&mut self, f: &[Quad], place: impl Fn(&mut Component) -> &mut Quad) {
        self.components.iter_mut().for_each(|c| *place(c) = Quad::default());
        for [start, end, c] in &self.stretches {
            let sum = place(&mut self.components[*c as usize]);
            *sum = f[*start as usize..*end as usize].iter().fold(*sum, |sum, f| sum + *f);
        }
    }

    /// What was relaxed is the base from now on.
    pub fn renew(&mut self) {
        for c in &mut self.components {
            (c.a_dv, c.a_z, c.a_u) = (c.a_dv - c.a_u, c.a_z - c.a_u, Quad::default());
        }
    }

    /// Velocities of the next prediction, extrapolated by `beta`: they follow from the last one, or from `gradient`, which
    /// is `C^T p - A base`, where that is known.
    pub fn predict(&mut self, beta: f32, gradient: Option<&[Quad]>) {
        if let Some(gradient) = gradient {
            self.sum(gradient, |c| &mut c.before);
        }
        for c in &mut self.components {
            let a_z = c.a_u.add_scaled(beta, c.a_u - c.a_dv);
            let shift = match gradient {
                Some(_) => Quad::combine(&c.inverse, c.before - a_z),
                None => c.shift + Quad::combine(&c.inverse, c.a_z - a_z),
            };
            (c.before, c.shift) = (c.shift, shift);
            (c.a_dv, c.a_z) = (c.a_u, a_z);
        }
    }

    /// Velocity of the component of block `b`.
    #[inline(always)]
    pub fn shift(&self, b: usize) -> Quad {
        self.components[self.component[b] as usize].shift
    }

    /// The same in the prediction before.
    #[inline(always)]
    pub fn before(&self, b: usize) -> Quad {
        self.components[self.component[b] as usize].before
    }
}

impl Component {
    fn take(&mut self, share: f64, mass: f64) {
        let m = mat_scale(share, &self.inverse_mass);
        self.share = share;
        self.inverse = [0, 1, 2].map(|c| Quad::round([m[0][c], m[1][c], m[2][c]], mass));
    }
}
