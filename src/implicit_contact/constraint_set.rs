//! The set of constraints of a segment, which grows from round to round [Otaduy09, §4].

use super::Memory;
use super::friction::project;
use crate::constraint::BuiltRows;
use crate::contact_search::{Contact, Hit, Pair};
use crate::math::{Vec3, dot};
use crate::model::{FrictionCone, Model, Settings};
use crate::step::Solved;

/// Share of the required gap that an existing row may miss before a hit of its pair is blamed on the solver.
const MISSED_SHARE: f64 = 0.05;

/// Contacts closer than this multiple of their thickness are rows from the start, so that a resting contact does not
/// drop out by what its solve left over. Beyond, they are watched.
const RESTING_SHARE: f64 = 1.1;

/// Share of the friction limit within which a contact sticks.
const WELL_WITHIN: f64 = 1.0 - 1e-6;

/// Contacts, the gaps they must keep, and what is known of their impulses.
#[derive(Debug, Default)]
pub struct ConstraintSet {
    /// Contacts: first those near the start in pair order, then those found by continuous detection.
    pub contacts: Vec<Contact>,
    /// Gap required at the end of the segment `[m]`.
    pub required_gaps: Vec<f64>,
    /// First tangent to keep.
    pub kept_tangents: Vec<Option<Vec3>>,
    /// Impulse of the last solve, or the warm start.
    pub solved: Vec<Solved>,
    /// Near pairs beyond their thickness that no tentative motion has brought within it yet.
    pub watched: Vec<Contact>,
}

/// How a round of continuous detection changed the set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Growth {
    /// Rows added.
    pub added: usize,
    /// Hits of pairs whose rows the solver had missed.
    pub missed: usize,
}

impl ConstraintSet {
    /// Makes this the set of the contacts near the start, which are the ones `watched` now, warm-started by key; those
    /// beyond their thickness stay watched.
    pub fn begin(&mut self, model: &Model, memory: &Memory, settings: &Settings, dt: f64) {
        let ConstraintSet { contacts, required_gaps, kept_tangents, solved, watched } = self;
        let rests = |c: &Contact| c.start_gap < RESTING_SHARE * c.thickness;
        let resting = watched.iter().filter(|c| rests(c)).count();
        contacts.clear();
        contacts.reserve(resting);
        required_gaps.clear();
        required_gaps.reserve(resting);
        kept_tangents.clear();
        kept_tangents.reserve(resting);
        solved.clear();
        solved.reserve(resting);
        self.take(rests, model, memory, settings, dt);
    }

    /// Whether a watched contact is at less than `share` of its thickness at `end`.
    pub fn would_admit(&self, end: &[Vec3], share: f64) -> bool {
        self.watched.iter().any(|c| c.gap(end) < share * c.thickness)
    }

    /// Takes in the watched contacts that a motion to `end` brings to less than `share` of their thickness; how many.
    ///
    /// This keeps a resting contact at its gap: it would otherwise drop out one rounding above it, fall to half of it
    /// before continuous detection sees it, and be pushed up again.
    pub fn admit(
        &mut self,
        model: &Model,
        end: &[Vec3],
        share: f64,
        memory: &Memory,
        settings: &Settings,
        dt: f64,
    ) -> usize {
        self.take(|c| c.gap(end) < share * c.thickness, model, memory, settings, dt)
    }

    /// Makes rows of the watched contacts that `which` names; how many.
    fn take(
        &mut self,
        which: impl Fn(&Contact) -> bool,
        model: &Model,
        memory: &Memory,
        settings: &Settings,
        dt: f64,
    ) -> usize {
        let (all, mut left) = (self.watched.len(), 0);
        for i in 0..all {
            let contact = self.watched[i];
            if which(&contact) {
                self.push(model, contact, memory, settings, dt);
            } else {
                self.watched[left] = contact;
                left += 1;
            }
        }
        self.watched.truncate(left);
        all - left
    }

    /// Whether a row asks for more than its gap at the start.
    pub fn recovers(&self) -> bool {
        self.contacts.iter().zip(&self.required_gaps).any(|(c, required)| *required > c.required_gap(0.0))
    }

    /// Lets every row keep just the gap of the start, and forgets the impulses that were to regain more.
    pub fn drop_recovery(&mut self) {
        for (contact, required) in self.contacts.iter().zip(&mut self.required_gaps) {
            *required = contact.required_gap(0.0);
        }
        self.solved.fill(Solved::default());
    }

    fn push(&mut self, model: &Model, contact: Contact, memory: &Memory, settings: &Settings, dt: f64) {
        let (impulse, tangent) = memory.warm_start(model, &contact, dt);
        let pushes = dot(contact.normal, impulse) > 0.0;
        let position_level = settings.ablation.position_level;
        let required =
            if position_level { contact.required_gap(settings.recovery_fraction) } else { contact.start_gap };
        self.required_gaps.push(required);
        self.kept_tangents.push(tangent);
        self.solved.push(Solved { impulse: if pushes { impulse } else { [0.0; 3] }, ..Solved::default() });
        self.contacts.push(contact);
    }

    /// Adds a row for each hit, unless a row of its pair was missed by the solver: then a tighter solve is due.
    ///
    /// A pair that is hit a second time although its rows hold gets another row, with the normal of the new impact.
    /// Rows from number `solved` on were admitted after the solve, which cannot have missed them.
    pub fn grow(
        &mut self,
        model: &Model,
        hits: &[Hit],
        end: &[Vec3],
        solved: usize,
        memory: &Memory,
        settings: &Settings,
        dt: f64,
        tightened: bool,
    ) -> Growth {
        let mut growth = Growth::default();
        let mut by_pair: Vec<(Pair, usize)> = self.contacts.iter().enumerate().map(|(i, c)| (c.pair, i)).collect();
        by_pair.sort_unstable();
        for hit in hits {
            let first = by_pair.partition_point(|(pair, _)| *pair < hit.pair);
            let own = by_pair[first..].iter().take_while(|(pair, _)| *pair == hit.pair);
            let (mut ordinal, mut missed, mut fresh) = (0, false, false);
            for (_, i) in own {
                fresh |= *i >= solved;
                ordinal = ordinal.max(self.contacts[*i].ordinal + 1);
                let required = self.required_gaps[*i];
                missed |= self.contacts[*i].gap(end) < required - MISSED_SHARE * required.abs();
            }
            if fresh {
                growth.added += 1;
                continue;
            }
            if missed {
                growth.missed += 1;
            }
            if !missed || tightened {
                growth.added += 1;
                self.push(model, Contact { ordinal, ..hit.contact }, memory, settings, dt);
            }
        }
        growth
    }

    /// Writes the warm start of the rows, in their own frames.
    pub fn row_impulses(&self, built: &BuiltRows, out: &mut Vec<Vec3>) {
        let in_frame = |(row, contact): (usize, &u32)| {
            let f = self.solved[*contact as usize].impulse;
            built.rows.frames[row].map(|axis| dot(axis, f))
        };
        out.clear();
        out.extend(built.contact.iter().enumerate().map(in_frame));
    }

    /// Takes over the multipliers of a solve.
    pub fn keep(&mut self, cone: FrictionCone, built: &BuiltRows, impulses: &[Vec3]) {
        self.solved.iter_mut().for_each(|s| *s = Solved::default());
        for (row, contact) in built.contact.iter().enumerate() {
            let (p, mu) = (impulses[row], built.rows.friction[row]);
            self.solved[*contact as usize] = Solved {
                impulse: built.rows.impulse(row, p),
                tangent: built.rows.frames[row][1],
                sticks: p[0] > 0.0 && mu > 0.0 && project(cone, WELL_WITHIN * mu, p) == p,
            };
        }
    }
}
