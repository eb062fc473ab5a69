//! Exact intersections of a state with witnesses, the tangled components they make, and the sweep between two states.

use super::candidates::CandidateSearch;
use super::near::{half_space_pair, half_spaces};
use super::pair::BodyFilter;
use super::passing::Passing;
use super::swept::{Hit, swept_hits};
use crate::geometry::{edge_edge, point_triangle};
use crate::math::predicates::{plane_side, segment_meets_triangle};
use crate::math::{Vec3, add_scaled, dot};
use crate::model::{Model, State, Witness};
use crate::parallel::Par;

/// Intersections of a state and the vertices of the features involved.
#[derive(Clone, Debug, Default)]
pub struct Tangle {
    /// Edges that cross or touch faces, and vertices beyond half-spaces.
    pub witnesses: Vec<Witness>,
    /// Their vertices: the tangled components.
    pub passing: Passing,
}

/// All intersections of a state between features that the filter lets collide, by exact predicates.
///
/// Features of one surface that touch at rest already do not count. Cost: a broad phase and an exact test per
/// edge-face pair with overlapping boxes that no direction separates.
pub fn intersections(model: &Model, filter: &BodyFilter, state: &State, par: Par) -> Tangle {
    intersections_with(&mut CandidateSearch::default(), model, filter, state, par)
}

/// [`intersections`] with the tree and the buffers of an earlier search.
pub fn intersections_with(
    search: &mut CandidateSearch,
    model: &Model,
    filter: &BodyFilter,
    state: &State,
    par: Par,
) -> Tangle {
    let mut tangle = Tangle::default();
    let body_of = |v: u32| model.vertex_body[v as usize] as usize;
    for found in search.crossings(model, filter, &state.positions, par) {
        let (edge, face) = (model.edges[found.edge as usize], model.faces[found.face as usize]);
        let bodies = [body_of(edge[0]), body_of(face[0])];
        if bodies[0] == bodies[1] && touches_at_rest(model, edge, face) {
            continue;
        }
        let [a, b] = bodies.map(|i| &model.bodies[i]);
        tangle.witnesses.push(Witness {
            kind: Witness::EDGE_FACE,
            bodies: [a.description.key, b.description.key],
            features: [found.edge - a.edges.start as u32, found.face - b.faces.start as u32],
            point: found.point,
        });
        edge.iter().chain(&face).for_each(|v| tangle.passing.insert(*v, model.rest.len()));
    }
    for plane in half_spaces(model) {
        let h = &state.half_spaces[plane];
        let beyond = par.filter_indexed(model.contact_vertices.len(), |i| {
            let vertex = half_space_pair(model, filter, i, plane)?.features[0];
            (plane_side(h.normal, h.offset, state.positions[vertex as usize]) < 0).then_some(vertex)
        });
        for vertex in beyond {
            let x = state.positions[vertex as usize];
            let on_plane = add_scaled(x, h.offset - dot(h.normal, x), h.normal);
            tangle.witnesses.push(half_space_witness(model, vertex, [body_of(vertex), plane], on_plane));
            tangle.passing.insert(vertex, model.rest.len());
        }
    }
    tangle
}

fn half_space_witness(model: &Model, vertex: u32, bodies: [usize; 2], point: Vec3) -> Witness {
    Witness {
        kind: Witness::VERTEX_HALF_SPACE,
        bodies: bodies.map(|b| model.bodies[b].description.key),
        features: [vertex - model.bodies[bodies[0]].vertices.start as u32, 0],
        point,
    }
}

/// Whether an edge and a face of one surface meet in the rest shape, so that their meeting says nothing: they cross, or
/// one of the pairs that contacts are made of is at distance zero and never counts as contact.
fn touches_at_rest(model: &Model, edge: [u32; 2], face: [u32; 3]) -> bool {
    let [p, q] = edge.map(|v| model.rest[v as usize]);
    let [a, b, c] = face.map(|v| model.rest[v as usize]);
    let at_vertex = |x| point_triangle::distance_squared(x, a, b, c) == 0.0;
    let at_edge = |u, v| edge_edge::distance_squared(p, q, u, v) == 0.0;
    segment_meets_triangle(p, q, a, b, c)
        || at_vertex(p)
        || at_vertex(q)
        || at_edge(a, b)
        || at_edge(b, c)
        || at_edge(c, a)
}

/// Hits on straight chords from `before` to `after`: empty when nothing tunnels between two states that a host pushes.
///
/// Cost: a broad phase over the sweep and continuous detection of its candidates.
pub fn swept_free(model: &Model, filter: &BodyFilter, before: &State, after: &State, par: Par) -> Vec<Hit> {
    let mut search = CandidateSearch::default();
    let found = search.update(model, filter, &before.positions, &after.positions, 1.0, par);
    swept_hits(model, filter, &Passing::default(), found, before, after, par)
}
