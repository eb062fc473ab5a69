//! Candidate pairs of a segment, kept while the tentative end positions stay near those they were found for.

use super::pair::BodyFilter;
use crate::detection::{BroadPhase, Candidates, Primitives};
use crate::math::{Vec3, sub};
use crate::model::Model;
use crate::parallel::Par;

/// Broad phase and candidates. A cache: emptying it changes no bit, since candidates are sorted and then tested
/// exactly.
#[derive(Default)]
pub struct CandidateSearch {
    broad_phase: Option<(u64, BroadPhase)>,
    candidates: Candidates,
    anchor: Option<Anchor>,
    /// Only its edge-face pairs are used.
    certificate: Candidates,
}

/// What the present candidates were found for.
struct Anchor {
    topology: u64,
    filter: u64,
    x0: Vec<Vec3>,
    x1: Vec<Vec3>,
    factor: f64,
}

impl CandidateSearch {
    /// Vertex-face and edge-edge pairs whose boxes, swept from `x0` to `x1` and thickened by `factor` times the half
    /// thicknesses, overlap; a superset of them when kept from an earlier call.
    ///
    /// Boxes are thickened by one half thickness more. Continuous detection needs half of one, so that candidates are
    /// kept while no end position moves by more than `factor + 1/2` half thicknesses along an axis.
    pub fn update(
        &mut self,
        model: &Model,
        filter: &BodyFilter,
        x0: &[Vec3],
        x1: &[Vec3],
        factor: f64,
        par: Par,
    ) -> &Candidates {
        if self.anchor.as_ref().is_some_and(|anchor| anchor.holds(model, filter, x0, x1, factor)) {
            return &self.candidates;
        }
        let radius = half_thicknesses(model, factor + 1.0);
        let broad_phase = tree(&mut self.broad_phase, model);
        broad_phase.refit(x0, x1, &radius, par);
        broad_phase.candidates(&|a, b| allowed(model, filter, a, b), &mut self.candidates, par);
        self.anchor = Some(Anchor {
            topology: model.topology_hash,
            filter: filter.fingerprint(),
            x0: x0.to_vec(),
            x1: x1.to_vec(),
            factor,
        });
        &self.candidates
    }

    /// Edge-face pairs whose boxes overlap at `x`, by the same tree.
    pub fn edge_faces(&mut self, model: &Model, filter: &BodyFilter, x: &[Vec3], par: Par) -> &[[u32; 2]] {
        let broad_phase = tree(&mut self.broad_phase, model);
        broad_phase.refit(x, x, &[], par);
        broad_phase.edge_face_candidates(&|a, b| allowed(model, filter, a, b), &mut self.certificate, par);
        &self.certificate.edge_face
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let c = &self.candidates;
        8 * (c.vertex_face.capacity() + c.edge_edge.capacity() + self.certificate.edge_face.capacity())
            + self.anchor.as_ref().map_or(0, |a| 24 * (a.x0.capacity() + a.x1.capacity()))
    }
}

/// The tree of a model, built where there is none of this topology.
fn tree<'a>(kept: &'a mut Option<(u64, BroadPhase)>, model: &Model) -> &'a mut BroadPhase {
    if kept.as_ref().is_some_and(|(topology, _)| *topology != model.topology_hash) {
        *kept = None;
    }
    &mut kept.get_or_insert_with(|| (model.topology_hash, BroadPhase::build(&primitives(model)))).1
}

fn allowed(model: &Model, filter: &BodyFilter, a: u32, b: u32) -> bool {
    filter.allows(model.vertex_body[a as usize] as usize, model.vertex_body[b as usize] as usize)
}

impl Anchor {
    fn holds(&self, model: &Model, filter: &BodyFilter, x0: &[Vec3], x1: &[Vec3], factor: f64) -> bool {
        let near = |(i, (a, b)): (usize, (&Vec3, &Vec3))| {
            let margin = (factor + 0.5) * model.bodies[model.vertex_body[i] as usize].half_thickness;
            sub(*a, *b).iter().all(|d| d.abs() <= margin)
        };
        self.topology == model.topology_hash
            && self.filter == filter.fingerprint()
            && self.factor == factor
            && self.x0 == x0
            && self.x1.len() == x1.len()
            && self.x1.iter().zip(x1).enumerate().all(near)
    }
}

/// The collision primitives of a model.
pub fn primitives(model: &Model) -> Primitives<'_> {
    Primitives { vertices: &model.contact_vertices, edges: &model.edges, faces: &model.faces }
}

/// `factor` times the half thickness of every vertex's body `[m]`.
pub(super) fn half_thicknesses(model: &Model, factor: f64) -> Vec<f64> {
    model.vertex_body.iter().map(|b| factor * model.bodies[*b as usize].half_thickness).collect()
}
