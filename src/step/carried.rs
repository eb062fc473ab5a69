//! What every method carries from step to step, and the check of the start state.

use super::whole::Step;
use crate::contact_search::{BodyFilter, CandidateSearch, Passing, intersections_with};
use crate::dynamics::Accelerations;
use crate::math::Vec3;
use crate::model::{HalfSpace, Model, StartPolicy, State, StepError, StepReport};

/// What every method carries from step to step; its accelerations are part of a snapshot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// What the unconstrained solves of the last step found: where the next ones start.
    pub accelerations: Accelerations,
    /// Topology and positions that were certified last.
    pub certified: Option<Certified>,
}

/// A state known to be free of intersections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certified {
    /// Which topology.
    pub topology: u64,
    /// Which filter, [`BodyFilter::fingerprint`].
    pub filter: u64,
    /// Positions of all vertices.
    pub positions: Vec<Vec3>,
    /// Half-spaces of all bodies.
    pub half_spaces: Vec<HalfSpace>,
}

impl Carried {
    /// Whether this very state was certified, for the same topology and filter.
    pub fn knows(&self, model: &Model, filter: &BodyFilter, state: &State) -> bool {
        self.certified.as_ref().is_some_and(|c| {
            c.topology == model.topology_hash
                && c.filter == filter.fingerprint()
                && c.positions == state.positions
                && c.half_spaces == state.half_spaces
        })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.accelerations.iter().map(|(_, v)| 24 * v.len() + 32).sum::<usize>()
            + self.certified.as_ref().map_or(0, |c| 24 * c.positions.len() + 32 * c.half_spaces.len())
    }
}

/// The start state: nothing to do for one that the last step certified; else an exact search for intersections.
///
/// Errors: `IntersectingStart` under the policy REFUSE.
pub(super) fn start_state(
    step: &Step,
    filter: &BodyFilter,
    carried: &Carried,
    report: &mut StepReport,
    search: &mut CandidateSearch,
) -> Result<Passing, StepError> {
    if carried.knows(step.model, filter, step.state) {
        return Ok(Passing::default());
    }
    let tangle = intersections_with(search, step.model, filter, step.state, step.par);
    if !tangle.witnesses.is_empty() && step.settings.start_policy == StartPolicy::Refuse {
        return Err(StepError::IntersectingStart(tangle.witnesses));
    }
    report.tangled_pairs = tangle.witnesses.len() as u32;
    Ok(tangle.passing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{BodyDescription, Kind, Material, Materials, Precision, Surface};
    use std::sync::Arc;

    fn model() -> Model {
        let body = |key, surface: Surface, kind| BodyDescription {
            key,
            surface: Arc::new(surface),
            kind,
            half_thickness: Some(0.1),
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: false,
            precision: Precision::Double,
            embedding: None,
            dynamics: None,
        };
        let point = Surface { rest: vec![[0.0; 3]], vertices: vec![0], ..Surface::default() };
        let plane = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 };
        let bodies = vec![
            body(1, point, Kind::Deformable { masses: vec![1.0], pinned: vec![false] }),
            body(2, Surface::default(), Kind::HalfSpace(plane)),
        ];
        let material = Material { friction_coefficient: 0.5, combine_rule: Default::default(), restitution: 0.0 };
        Model::build(bodies, Materials { list: vec![material], overrides: vec![] }, vec![]).unwrap()
    }

    #[test]
    fn only_the_very_state_is_known() {
        let model = model();
        let mut state = model.rest_state();
        let filter = BodyFilter::new(&model);
        let certified = Certified {
            topology: model.topology_hash,
            filter: filter.fingerprint(),
            positions: state.positions.clone(),
            half_spaces: state.half_spaces.clone(),
        };
        let carried = Carried { certified: Some(certified), ..Carried::default() };
        assert!(carried.knows(&model, &filter, &state));
        state.positions[0][2] = f64::MIN_POSITIVE;
        assert!(!carried.knows(&model, &filter, &state));
        state.positions[0][2] = 0.0;
        state.half_spaces[1].offset = -1.0;
        assert!(!carried.knows(&model, &filter, &state));
    }
}
