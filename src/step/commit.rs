//! The last stage: state, memory and result, all at once.

use super::account::{StepAccount, lap};
use super::carried::{Carried, Certified};
use super::fall_back::witnesses;
use crate::contact_search::{BodyFilter, CandidateSearch, Hit, Passing, intersections_with};
use crate::model::{Model, Settings, State, StepError, StepReport, StepResult};
use crate::parallel::Par;
use std::time::Instant;

/// Writes state, result and what is carried, and certifies the end if asked to.
pub fn commit(
    (filter, settings, par): (&BodyFilter, &Settings, Par),
    model: &Model,
    state: &mut State,
    carried: &mut Carried,
    dt: f64,
    result: &mut StepResult,
    passing: &Passing,
    search: &mut CandidateSearch,
    account: &mut StepAccount,
) {
    let mut clock = Instant::now();
    *result = account.result(model, state, dt);
    std::mem::swap(state, &mut account.state);
    carried.certified = passing.is_empty().then(|| Certified {
        topology: model.topology_hash,
        filter: filter.fingerprint(),
        positions: state.positions.clone(),
        half_spaces: state.half_spaces.clone(),
    });
    if settings.certify {
        let found = intersections_with(search, model, filter, state, par).witnesses.len();
        account.report.intersections = Some(found as u32);
        if found > 0 {
            carried.certified = None;
        }
    }
    account.report.times.certificate += lap(&mut clock);
}

/// The answer of a step whose state stands: the report, or `Pinched` with witnesses of the pairs that left no room.
pub fn answer(
    model: &Model,
    state: &State,
    pinch: Option<Vec<Hit>>,
    report: StepReport,
) -> Result<StepReport, StepError> {
    match pinch {
        None => Ok(report),
        Some(hits) => Err(StepError::Pinched { witnesses: witnesses(model, &hits, state), report: Box::new(report) }),
    }
}
