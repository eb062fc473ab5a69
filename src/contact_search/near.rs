//! Contacts near the start positions of a segment [Otaduy09, §3.2 (i)].

use super::candidates::Found;
use super::contact::{Contact, half_space_contact, mesh_contact};
use super::distinct::distinct;
use super::pair::{BodyFilter, ClosestPoints, Pair, PairKind, gather};
use super::passing::Passing;
use crate::detection::Candidates;
use crate::geometry::wide_closest_points::{self, WideClosestPoints};
use crate::math::Vec3;
use crate::math::simd::{Kernel, points, run_wide};
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
    contacts.clear();
    par.extend_by_ranges(contacts, open.len(), |range, out| {
        run_wide(NearPairs { model, passing, candidates, numbers: &open[range], x, factor, out });
    });
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

/// Pairs whose closest points are found side by side.
const WIDTH: usize = 4;

/// The contacts of some candidates, by number.
struct NearPairs<'a> {
    model: &'a Model,
    passing: &'a Passing,
    candidates: &'a Candidates,
    numbers: &'a [u32],
    x: &'a [Vec3],
    factor: f64,
    out: &'a mut Vec<Contact>,
}

impl Kernel for NearPairs<'_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let faces = self.candidates.vertex_face.len();
        let (vertex_face, edge_edge) =
            self.numbers.split_at(self.numbers.partition_point(|number| (*number as usize) < faces));
        for numbers in vertex_face.chunks(WIDTH) {
            let (pairs, at) = self.gather(numbers);
            self.take(&pairs[..numbers.len()], &wide_closest_points::point_triangle(&at));
        }
        for numbers in edge_edge.chunks(WIDTH) {
            let (pairs, at) = self.gather(numbers);
            self.take(&pairs[..numbers.len()], &wide_closest_points::edge_edge(&at));
        }
    }
}

impl NearPairs<'_> {
    /// The pairs of some numbers with their vertices; lanes beyond the last repeat it.
    #[inline(always)]
    fn gather(&self, numbers: &[u32]) -> ([Pair; WIDTH], [points::Point<WIDTH>; 4]) {
        let mut pairs = [candidate(self.candidates, numbers[0] as usize); WIDTH];
        let mut vertices = [[0; 4]; WIDTH];
        for l in 0..WIDTH {
            pairs[l] = candidate(self.candidates, numbers[l.min(numbers.len() - 1)] as usize);
            vertices[l] = pairs[l].vertices(self.model).map(|v| v as usize);
        }
        (pairs, points::gather(self.x, &vertices))
    }

    #[inline(always)]
    fn take(&mut self, pairs: &[Pair], closest: &WideClosestPoints<WIDTH>) {
        for (l, pair) in pairs.iter().enumerate() {
            let at = gather(pair.vertices(self.model), self.x);
            let closest = if closest.in_range[l] {
                ClosestPoints {
                    weights: closest.weights.map(|w| w.0[l]),
                    separation: closest.separation.map(|c| c.0[l]),
                    distance_squared: closest.distance_squared.0[l],
                }
            } else {
                pair.closest_points(&at)
            };
            self.out.extend(near_mesh_pair(self.model, self.passing, *pair, &at, &closest, self.factor));
        }
    }
}

fn near_mesh_pair(
    model: &Model,
    passing: &Passing,
    pair: Pair,
    at: &[Vec3; 4],
    closest: &ClosestPoints,
    factor: f64,
) -> Option<Contact> {
    if passing.touches(&pair.vertices(model)) {
        return None;
    }
    let [a, b] = pair.bodies(model);
    let reach = factor * (model.bodies[a].half_thickness + model.bodies[b].half_thickness);
    if closest.distance_squared >= reach * reach || closest.distance_squared == 0.0 {
        return None;
    }
    let thickness = pair.thickness(model)?;
    let contact = mesh_contact(model, pair, 0, closest, at, at, thickness);
    (contact.start_gap < factor * thickness).then_some(contact)
}
