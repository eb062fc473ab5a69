//! Continuous detection as a fail-safe sees it: velocities in, hits out.

use crate::contact_search::{
    BodyFilter, CandidateSearch, Contact, Found, Hit, Passing, near_contacts, renewed_hits, swept_hits,
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
    /// Hits of the motion to `end`.
    pub fn hits(&self, end: &State, candidates: &mut CandidateSearch) -> Vec<Hit> {
        let found = self.candidates(end, candidates);
        swept_hits(self.segment.model, self.filter, self.passing, found, self.segment.start, end, self.par)
    }

    /// [`Sweep::hits`] where those to other end positions are known: what ends where it ended is not tested again. The
    /// same hits.
    pub fn hits_again(
        &self,
        end: &State,
        (known, hits): (&[Vec3], &[Hit]),
        candidates: &mut CandidateSearch,
    ) -> Vec<Hit> {
        let moved: Vec<bool> = end.positions.iter().zip(known).map(|(a, b)| a != b).collect();
        let (start, model) = (self.segment.start, self.segment.model);
        let found = self.candidates(end, candidates);
        renewed_hits(model, self.filter, self.passing, found, (start, end), hits, &moved, self.par)
    }

    /// End state after `share` of the segment with these velocities, rounded to the hosts' formats, and its hits.
    pub fn test(&self, velocities: &[Vec3], share: f64, candidates: &mut CandidateSearch) -> (State, Vec<Hit>) {
        let mut end = State::default();
        self.segment.end_state(velocities, share, true, &mut end);
        let hits = self.hits(&end, candidates);
        (end, hits)
    }

    /// Contacts that are closer than `factor` times their thickness at the start, as [`near_contacts`].
    pub fn near(&self, end: &State, factor: f64, candidates: &mut CandidateSearch, out: &mut Vec<Contact>) {
        let Segment { model, start, .. } = self.segment;
        let found = self.candidates(end, candidates);
        near_contacts(model, self.filter, self.passing, found, start, end, factor, out, self.par);
    }

    fn candidates<'a>(&self, end: &State, candidates: &'a mut CandidateSearch) -> Found<'a> {
        let Segment { model, start, .. } = self.segment;
        candidates.update(model, self.filter, &start.positions, &end.positions, self.factor, self.par)
    }
}
