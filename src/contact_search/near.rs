//! Contacts near the start positions of a segment [Otaduy09, §3.2 (i)].

use super::candidates::Found;
use super::contact::{Contact, half_space_contact, mesh_contact};
use super::distinct::distinct;
use super::pair::{BodyFilter, Pair, PairKind, gather};
use super::passing::Passing;
use crate::detection::Candidates;
use crate::math::Vec3;
use crate::model::{Kind, Model, State};
use crate::parallel::Par;

/// All contacts of candidate pairs closer than `factor` times their thickness at `start`, sorted by pair, and of
/// vertices near half-spaces.
///
/// Pairs whose closest points lie on vertices or edges describe the same contact many times; one is kept, and none where
/// a face is nearer. Cost: linear in candidates, plus a sort of these; `contacts` is written over.
pub fn near_contacts(
    model: &Model,
    filter: &BodyFilter,
    passing: &Passing,
    mut found: Found,
    start: &State,
    end: &State,
    factor: f64,
    contacts: &mut Vec<Contact>,
    par: Par,
) {
    let (x, candidates) = (&start.positions, found.candidates);
    let (open, borders) = found.near(model, x, factor, par);
    let near = |i: usize| near_mesh_pair(model, passing, candidate(candidates, open[i] as usize), x, factor);
    contacts.clear();
    par.extend_filtered(contacts, open.len(), near);
    distinct(contacts, borders, par);
    for plane in half_spaces(model) {
        par.extend_filtered(contacts, model.contact_vertices.len(), |i| {
            let pair = half_space_pair(model, filter, i, plane)?;
            near_half_space(model, passing, pair, start, end, factor)
        });
    }
}

/// Candidate number `i`, vertex-face pairs first.
#[inline]
pub(super) fn candidate(candidates: &Candidates, i: usize) -> Pair {
    match candidates.vertex_face.get(i) {
        Some(features) => Pair { kind: PairKind::VertexFace, features: *features },
        None => Pair { kind: PairKind::EdgeEdge, features: candidates.edge_edge[i - candidates.vertex_face.len()] },
    }
}

/// The bodies that are half-spaces.
pub(super) fn half_spaces(model: &Model) -> impl Iterator<Item = usize> + '_ {
    (0..model.bodies.len()).filter(|b| matches!(model.bodies[*b].description.kind, Kind::HalfSpace(_)))
}

/// Contact vertex number `i` and a half-space, if the filter allows it.
#[inline]
pub(super) fn half_space_pair(model: &Model, filter: &BodyFilter, i: usize, plane: usize) -> Option<Pair> {
    let v = model.contact_vertices[i];
    let allowed = filter.allows(model.vertex_body[v as usize] as usize, plane);
    allowed.then_some(Pair { kind: PairKind::VertexHalfSpace, features: [v, plane as u32] })
}

fn near_half_space(
    model: &Model,
    passing: &Passing,
    pair: Pair,
    start: &State,
    end: &State,
    factor: f64,
) -> Option<Contact> {
    if passing.touches(&pair.features[..1]) {
        return None;
    }
    let [body, plane] = pair.bodies(model);
    let thickness = model.bodies[body].half_thickness + model.bodies[plane].half_thickness;
    let x0 = start.positions[pair.features[0] as usize];
    let contact = half_space_contact(pair, &start.half_spaces[plane], &end.half_spaces[plane], x0, thickness);
    (contact.start_gap < factor * thickness).then_some(contact)
}

fn near_mesh_pair(model: &Model, passing: &Passing, pair: Pair, x: &[Vec3], factor: f64) -> Option<Contact> {
    let vertices = pair.vertices(model);
    if passing.touches(&vertices) {
        return None;
    }
    let [a, b] = pair.bodies(model);
    let reach = factor * (model.bodies[a].half_thickness + model.bodies[b].half_thickness);
    let at = gather(vertices, x);
    let closest = pair.closest_points(&at);
    if closest.distance_squared >= reach * reach || closest.distance_squared == 0.0 {
        return None;
    }
    let thickness = pair.thickness(model)?;
    let contact = mesh_contact(model, pair, 0, &closest, &at, &at, thickness);
    (contact.start_gap < factor * thickness).then_some(contact)
}
