//! Continuous detection as a fail-safe sees it: velocities in, hits out.

use crate::contact_search::{
    BodyFilter, CandidateSearch, Contact, Hit, Passing, near_contacts, renewed_hits, swept_hits,
};
use crate::math::Vec3;
use crate::model::{Segment, State};
use crate::parallel::Par;

/// A segment with all that is needed to test an end of it.
pub struct Sweep<'a> {
    /// The segment.
    pub segment: Segment<'a>,
    /// Which bodies may touch.
    pub filter: &'a BodyFilter,
    /// Tangled vertices.
    pub passing: &'a Passing,
    /// Thickening of swept boxes, in half thicknesses.
    pub factor: f64,
    /// Where work runs.
    pub par: Par<'a>,
}

impl Sweep<'_> {
    /// End state after `share` of the segment with these velocities, rounded to the hosts' formats, and its hits.
    pub fn test(&self, velocities: &[Vec3], share: f64, candidates: &mut CandidateSearch) -> (State, Vec<Hit>) {
        let mut end = State::default();
        self.segment.end_state(velocities, share, true, &mut end);
        let start = self.segment.start;
        let (model, par) = (self.segment.model, self.par);
        let found = candidates.update(model, self.filter, &start.positions, &end.positions, self.factor, par);
        let hits = swept_hits(model, self.filter, self.passing, found, start, &end, par);
        (end, hits)
    }

    /// Contacts that are closer than their thickness at the start, as [`near_contacts`].
    pub fn near(&self, end: &State, candidates: &mut CandidateSearch) -> Vec<Contact> {
        let (start, model, par) = (self.segment.start, self.segment.model, self.par);
        let found = candidates.update(model, self.filter, &start.positions, &end.positions, self.factor, par);
        near_contacts(model, self.filter, self.passing, found, start, end, 1.0, par)
    }

    /// [`Sweep::test`] of the whole segment where the hits of another end are known: what ends where it ended is not tested
    /// again. The same hits.
    pub fn test_again(
        &self,
        velocities: &[Vec3],
        (known, hits): (&State, &[Hit]),
        candidates: &mut CandidateSearch,
    ) -> (State, Vec<Hit>) {
        let mut end = State::default();
        self.segment.end_state(velocities, 1.0, true, &mut end);
        let (start, model, par) = (self.segment.start, self.segment.model, self.par);
        let moved: Vec<bool> = end.positions.iter().zip(&known.positions).map(|(a, b)| a != b).collect();
        let found = candidates.update(model, self.filter, &start.positions, &end.positions, self.factor, par);
        let hits = renewed_hits(model, self.filter, self.passing, found, (start, &end), hits, &moved, par);
        (end, hits)
    }
}
