//! Continuous detection of a segment: which pairs come closer than their minimum separation on straight chords.

use super::candidates::{Found, primitives};
use super::contact::{Contact, half_space_contact, mesh_contact};
use super::near::{candidate, half_space_pair, half_spaces};
use super::pair::{BodyFilter, Pair, PairKind, gather};
use super::passing::Passing;
use crate::detection::Candidates;
use crate::detection::ccd::{self, Separation};
use crate::math::predicates::plane_side;
use crate::math::{Vec3, lerp};
use crate::model::{Model, State, Witness};
use crate::parallel::Par;

/// A pair that comes too close, at a fraction `time` of the segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The pair.
    pub pair: Pair,
    /// Fraction of the segment, never later than the true one.
    pub time: f64,
    /// The contact with normal and weights at that time, gap at the start.
    pub contact: Contact,
}

impl Hit {
    /// The pair as a witness, with its contact point at the positions `x`.
    pub fn witness(&self, model: &Model, x: &[Vec3]) -> Witness {
        Witness {
            kind: match self.pair.kind {
                PairKind::VertexFace => Witness::VERTEX_FACE,
                PairKind::EdgeEdge => Witness::EDGE_EDGE,
                PairKind::VertexHalfSpace => Witness::VERTEX_HALF_SPACE,
            },
            bodies: self.pair.bodies(model).map(|b| model.bodies[b].description.key),
            features: self.pair.local_features(model),
            point: self.contact.point(x),
        }
    }
}

/// All pairs that come closer than half of `min(thickness, start distance)` between `start` and `end`, in pair order.
///
/// Conservative: nothing is missed. Pairs that touch a tangled vertex pass. Cost: linear in candidates.
pub fn swept_hits(
    model: &Model,
    filter: &BodyFilter,
    passing: &Passing,
    mut found: Found,
    start: &State,
    end: &State,
    par: Par,
) -> Vec<Hit> {
    let (x0, x1) = (&start.positions[..], &end.positions[..]);
    let candidates = found.candidates;
    let open = found.approaching(model, x0, x1, par);
    let ask = |i: usize| question(model, passing, candidate(candidates, open[i] as usize), x0, x1);
    let questions = par.filter_indexed(open.len(), ask);
    let mut hits = mesh_hits(model, &questions, x0, x1, par);
    for plane in half_spaces(model) {
        let hit = |i: usize| half_space_hit(model, passing, half_space_pair(model, filter, i, plane)?, start, end);
        par.extend_filtered(&mut hits, model.contact_vertices.len(), hit);
    }
    hits
}

/// The hits of a motion of which a test knew another end, by testing only pairs of which a vertex has `moved` since: the
/// same as [`swept_hits`], in the same order.
///
/// `before` are the hits of that test, from the same start. Cost: a pass over the candidates, and continuous detection of
/// those that touch a moved vertex.
pub fn renewed_hits(
    model: &Model,
    filter: &BodyFilter,
    passing: &Passing,
    found: Found,
    (start, end): (&State, &State),
    before: &[Hit],
    moved: &[bool],
    par: Par,
) -> Vec<Hit> {
    let touches = |vertices: &[u32]| vertices.iter().any(|v| moved[*v as usize]);
    let faces = par.map_indexed(model.faces.len(), |f| touches(&model.faces[f]));
    let edges = par.map_indexed(model.edges.len(), |e| touches(&model.edges[e]));
    let pairs = |list: &[[u32; 2]], first: &[bool], second: &[bool]| -> Vec<[u32; 2]> {
        let touched = |[a, b]: [u32; 2]| first[a as usize] || second[b as usize];
        par.filter_indexed(list.len(), |i| touched(list[i]).then_some(list[i]))
    };
    let Found { candidates, buffers, .. } = found;
    let open = Candidates {
        vertex_face: pairs(&candidates.vertex_face, moved, &faces),
        edge_edge: pairs(&candidates.edge_edge, &edges, &edges),
        ..Candidates::default()
    };
    let mut hits = swept_hits(model, filter, passing, Found { candidates: &open, search: 0, buffers }, start, end, par);
    // Half-spaces are all tested anew: that costs less than to sort them out.
    let on_mesh = |hit: &Hit| hit.pair.kind != PairKind::VertexHalfSpace;
    let half_spaces = hits.split_off(hits.partition_point(on_mesh));
    hits.extend(before.iter().filter(|hit| on_mesh(hit) && !touches(&hit.pair.vertices(model))));
    hits.sort_unstable_by_key(|hit| hit.pair);
    hits.extend(half_spaces);
    hits
}

/// The separation that continuous detection keeps for a pair: half of `min(thickness, start distance)`.
#[inline]
pub fn minimum_separation(thickness: f64, start_distance: f64) -> f64 {
    0.5 * thickness.min(start_distance)
}

/// A pair that may come closer than a separation.
struct Question {
    pair: Pair,
    thickness: f64,
    separation: f64,
}

/// What to ask continuous detection about a pair; `None` for one that may pass or that stands still.
fn question(model: &Model, passing: &Passing, pair: Pair, x0: &[Vec3], x1: &[Vec3]) -> Option<Question> {
    let vertices = pair.vertices(model);
    if passing.touches(&vertices) {
        return None;
    }
    let p0 = gather(vertices, x0);
    if p0 == gather(vertices, x1) {
        return None;
    }
    let distance = pair.closest_points(&p0).distance_squared.sqrt();
    let thickness = pair.thickness(model)?;
    Some(Question { pair, thickness, separation: minimum_separation(thickness, distance) })
}

/// The questions, vertex-face pairs first, that continuous detection answers with a hit.
fn mesh_hits(model: &Model, questions: &[Question], x0: &[Vec3], x1: &[Vec3], par: Par) -> Vec<Hit> {
    if questions.is_empty() {
        return Vec::new();
    }
    let (vertex_face, edge_edge) =
        questions.split_at(questions.partition_point(|q| q.pair.kind == PairKind::VertexFace));
    let features = |list: &[Question]| list.iter().map(|q| q.pair.features).collect();
    let separations = |list: &[Question]| -> Vec<f64> { list.iter().map(|q| q.separation).collect() };
    let pairs =
        Candidates { vertex_face: features(vertex_face), edge_edge: features(edge_edge), ..Candidates::default() };
    let separation = Separation::PerPair { vertex_face: &separations(vertex_face), edge_edge: &separations(edge_edge) };
    // Hits come in the order of the questions.
    let mut rest = questions.iter();
    let times = ccd::hits(x0, x1, &primitives(model), &pairs, separation, par);
    let hit = times.into_iter().filter_map(|found| {
        let (kind, features) = match found.pair {
            ccd::Pair::VertexFace(features) => (PairKind::VertexFace, features),
            ccd::Pair::EdgeEdge(features) => (PairKind::EdgeEdge, features),
        };
        let Question { pair, thickness, .. } = rest.find(|q| q.pair == Pair { kind, features })?;
        let vertices = pair.vertices(model);
        let (p0, p1) = (gather(vertices, x0), gather(vertices, x1));
        let at = std::array::from_fn(|k| lerp(p0[k], p1[k], found.time));
        let contact = mesh_contact(model, *pair, 0, &pair.closest_points(&at), &at, &p0, *thickness);
        Some(Hit { pair: *pair, time: found.time, contact })
    });
    hit.collect()
}

fn half_space_hit(model: &Model, passing: &Passing, pair: Pair, start: &State, end: &State) -> Option<Hit> {
    let vertex = pair.features[0] as usize;
    if passing.touches(&pair.features[..1]) {
        return None;
    }
    let [body, plane] = pair.bodies(model);
    let (x0, x1) = (start.positions[vertex], end.positions[vertex]);
    let (h0, h1) = (&start.half_spaces[plane], &end.half_spaces[plane]);
    if x0 == x1 && h0 == h1 {
        return None;
    }
    let thickness = model.bodies[body].half_thickness + model.bodies[plane].half_thickness;
    let contact = half_space_contact(pair, h0, h1, x0, thickness);
    let separation = minimum_separation(thickness, contact.start_gap);
    let end_gap = contact.gap(&end.positions);
    // The rounded gap decides the separation, the exact side of the plane the rest.
    if end_gap >= separation && plane_side(h1.normal, h1.offset, x1) >= 0 {
        return None;
    }
    let approach = contact.start_gap - end_gap;
    let time = if approach > 0.0 { ((contact.start_gap - separation) / approach).clamp(0.0, 1.0) } else { 0.0 };
    Some(Hit { pair, time, contact })
}
