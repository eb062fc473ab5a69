//! The motion of a part while it is filtered: velocities with the impulses that made them.

use super::row_response::inverse_mass;
use super::stage_rows::StageRows;
use crate::constraint::{BuiltRows, Linearisation, Metric, build_rows};
use crate::contact_search::{Contact, Hit};
use crate::math::{Vec3, add, mat_vec, sub};
use crate::model::{Precision, Segment, State};
use crate::step::{PartEnd, Solved, SolvedContact};

/// Velocities `v = v* + M^-1 Lambda` over lumped masses, the impulses Lambda, and the contacts that gave them.
pub struct FilteredMotion<'a> {
    segment: &'a Segment<'a>,
    metric: &'a Metric,
    /// Mean velocity over the part, per block.
    pub velocities: Vec<Vec3>,
    /// Impulse per block `[N s]`.
    pub impulses: Vec<Vec3>,
    /// Velocities before impulses over lumped masses: unconstrained, with what a matrix made of springs.
    base: Vec<Vec3>,
    /// Impulses over lumped masses `[N s]`.
    lumped: Vec<Vec3>,
    /// End of the motion as the host will get it.
    pub end: State,
    /// Contacts in the order in which they were treated.
    pub contacts: Vec<SolvedContact>,
}

impl<'a> FilteredMotion<'a> {
    /// The motion without contact.
    pub fn new(segment: &'a Segment, metric: &'a Metric) -> FilteredMotion<'a> {
        let velocities = segment.drives.velocities.clone();
        let mut end = State::default();
        segment.end_state(&velocities, 1.0, true, &mut end);
        let impulses = vec![[0.0; 3]; velocities.len()];
        let (base, lumped) = (velocities.clone(), impulses.clone());
        FilteredMotion { segment, metric, velocities, impulses, base, lumped, end, contacts: Vec::new() }
    }

    /// The rows of contacts about the motion as it is.
    pub fn rows(&self, contacts: &[Contact]) -> StageRows {
        StageRows::new(self.built_rows(contacts), self.metric)
    }

    /// Takes over the impulses of a stage and moves by them; books its contacts with `ordinal`. How many were pushed.
    pub fn take(&mut self, contacts: &[Contact], ordinal: u32, stage: StageRows) -> u32 {
        let rows = &stage.built.rows;
        let mut row_of = vec![None; contacts.len()];
        stage.built.contact.iter().enumerate().for_each(|(row, contact)| row_of[*contact as usize] = Some(row));
        let mut pushed = 0;
        for (contact, row) in contacts.iter().zip(row_of) {
            let contact = Contact { ordinal, ..*contact };
            let mut booked = SolvedContact {
                contact,
                required_gap: contact.start_gap,
                solved: Solved::default(),
                is_row: row.is_some(),
            };
            if let Some(row) = row.filter(|row| stage.impulses[*row] != [0.0; 3]) {
                let impulse = rows.impulse(row, stage.impulses[row]);
                rows.scatter(row, impulse, &mut self.impulses);
                if stage.coupled_change().is_none() {
                    rows.scatter(row, impulse, &mut self.lumped);
                }
                booked.required_gap += self.segment.dt * stage.separations[row];
                booked.solved = Solved { impulse, tangent: rows.frames[row][1], sticks: stage.sticks[row] };
                pushed += 1;
            }
            self.contacts.push(booked);
        }
        if let Some(change) = stage.coupled_change() {
            self.base.iter_mut().zip(change).for_each(|(v, dv)| *v = add(*v, *dv));
        }
        if pushed > 0 {
            self.follow();
        }
        pushed
    }

    /// Takes over velocities that a fail-safe found, as impulses over lumped masses.
    pub fn replace(&mut self, velocities: &[Vec3]) {
        for (block, (new, old)) in velocities.iter().zip(&self.velocities).enumerate() {
            if !self.metric.fixed[block] && new != old {
                let f = mat_vec(&self.metric.lumped[block], sub(*new, *old));
                self.lumped[block] = add(self.lumped[block], f);
                self.impulses[block] = add(self.impulses[block], f);
            }
        }
        self.follow();
    }

    /// The end of the part, with what still collides.
    pub fn into_part(self, hits: Vec<Hit>) -> PartEnd {
        PartEnd {
            velocities: self.velocities,
            block_impulses: self.impulses,
            end: self.end,
            contacts: self.contacts,
            hits,
        }
    }

    /// Velocities and end of the impulses given so far: to rounding those, whatever the order they came in.
    fn follow(&mut self) {
        self.velocities.clone_from(&self.base);
        for (block, f) in self.lumped.iter().enumerate().filter(|(_, f)| **f != [0.0; 3]) {
            self.velocities[block] = add(self.base[block], mat_vec(&inverse_mass(self.metric, block), *f));
        }
        self.segment.end_state(&self.velocities, 1.0, true, &mut self.end);
    }

    /// Their targets are what keeps the gap of the start, so that these and the sliding are the motion's own.
    fn built_rows(&self, contacts: &[Contact]) -> BuiltRows {
        let mut unrounded = State::default();
        let single = self.segment.model.bodies.iter().any(|b| b.description.precision == Precision::Single);
        if single {
            self.segment.end_state(&self.velocities, 1.0, false, &mut unrounded);
        }
        let about = Linearisation {
            start: self.segment.start,
            end: if single { &unrounded } else { &self.end },
            velocities: &self.velocities,
            unconstrained: &self.velocities,
            dt: self.segment.dt,
        };
        let gaps: Vec<f64> = contacts.iter().map(|c| c.start_gap).collect();
        build_rows(self.segment.model, self.metric, contacts, &gaps, &vec![None; contacts.len()], &about)
    }
}
