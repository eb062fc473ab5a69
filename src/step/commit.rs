//! The last stage: state, memory and result, all at once.

use super::account::{StepAccount, lap};
use super::carried::Carried;
use super::whole::Step;
use crate::contact_search::{BodyFilter, CandidateSearch, Passing, intersections_with};
use std::time::Instant;

/// Writes state, result and what is carried, and certifies the end if asked to.
pub(super) fn commit(
    step: &mut Step,
    filter: &BodyFilter,
    carried: &mut Carried,
    passing: &Passing,
    search: &mut CandidateSearch,
    account: &mut StepAccount,
) {
    let mut clock = Instant::now();
    let model = step.model;
    account.write_result(model, step.state, step.dt, step.result);
    std::mem::swap(step.state, &mut account.state);
    let state = &*step.state;
    if passing.is_empty() {
        let certified = carried.certified.get_or_insert_default();
        (certified.topology, certified.filter) = (model.topology_hash, filter.fingerprint());
        certified.positions.clone_from(&state.positions);
        certified.half_spaces.clone_from(&state.half_spaces);
    } else {
        carried.certified = None;
    }
    if step.settings.certify {
        let found = intersections_with(search, model, filter, state, step.par).witnesses.len();
        account.report.intersections = Some(found as u32);
        if found > 0 {
            carried.certified = None;
        }
    }
    account.report.times.certificate += lap(&mut clock);
}
