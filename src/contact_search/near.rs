//! Contacts near the start positions of a segment [Otaduy09, §3.2 (i)].

use super::candidates::{half_thicknesses, primitives};
use super::contact::{Contact, half_space_contact, mesh_contact};
use super::pair::{BodyFilter, Pair, PairKind, gather};
use super::passing::Passing;
use crate::detection::{Candidates, screening};
use crate::math::{Vec3, dot, scale};
use crate::model::{Kind, Model, State};
use crate::parallel::Par;

/// All contacts of candidate pairs closer than `factor` times their thickness at `start`, sorted by pair, and of
/// vertices near half-spaces.
///
/// Pairs whose closest points lie on vertices or edges describe the same contact many times; one is kept, and none where
/// a face is nearer. Cost: linear in candidates, plus a sort of these.
pub fn near_contacts(
    model: &Model,
    filter: &BodyFilter,
    passing: &Passing,
    candidates: &Candidates,
    start: &State,
    end: &State,
    factor: f64,
    par: Par,
) -> Vec<Contact> {
    let x = &start.positions;
    let open = screening::near(x, &primitives(model), candidates, &half_thicknesses(model, factor), par);
    let found = par.map_indexed(open.len(), |i| {
        near_mesh_pair(model, passing, candidate(candidates, open[i] as usize), x, factor)
    });
    let mut contacts = distinct(found.into_iter().flatten().collect());
    for pair in half_space_pairs(model, filter) {
        if passing.touches(&pair.features[..1]) {
            continue;
        }
        let [body, plane] = pair.bodies(model);
        let thickness = model.bodies[body].half_thickness + model.bodies[plane].half_thickness;
        let x0 = start.positions[pair.features[0] as usize];
        let contact = half_space_contact(pair, &start.half_spaces[plane], &end.half_spaces[plane], x0, thickness);
        if contact.start_gap < factor * thickness {
            contacts.push(contact);
        }
    }
    contacts
}

/// Candidate number `i`, vertex-face pairs first.
#[inline]
pub(super) fn candidate(candidates: &Candidates, i: usize) -> Pair {
    match candidates.vertex_face.get(i) {
        Some(features) => Pair { kind: PairKind::VertexFace, features: *features },
        None => Pair { kind: PairKind::EdgeEdge, features: candidates.edge_edge[i - candidates.vertex_face.len()] },
    }
}

/// All vertex-half-space pairs that the filter allows.
pub(super) fn half_space_pairs<'a>(model: &'a Model, filter: &'a BodyFilter) -> impl Iterator<Item = Pair> + 'a {
    let planes = model.bodies.iter().enumerate().filter(|(_, b)| matches!(b.description.kind, Kind::HalfSpace(_)));
    planes.flat_map(move |(plane, _)| {
        let allowed = move |v: &&u32| filter.allows(model.vertex_body[**v as usize] as usize, plane);
        model
            .contact_vertices
            .iter()
            .filter(allowed)
            .map(move |v| Pair { kind: PairKind::VertexHalfSpace, features: [*v, plane as u32] })
    })
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

/// Keeps one contact per geometrically distinct one: drops what repeats an earlier contact, and what is no closest point.
///
/// Closest points on a border, `(p, edge)` or `(p, vertex)`, are found with every pair that shares that border; the
/// first pair is kept, with the largest thickness. They are no contact of their own where a face at that border is
/// strictly nearer to `p`: then the point slides off the border into the face, which has its own row. A vertex that is
/// nearest to an edge or a corner keeps that row. Of two vertices both must have something nearer.
fn distinct(mut contacts: Vec<Contact>) -> Vec<Contact> {
    let mut borders: Vec<Border> = contacts.iter().enumerate().filter_map(|(i, c)| Border::of(c, i)).collect();
    borders.sort_unstable_by_key(|b| (b.key, b.contact));
    let mut kept = vec![true; contacts.len()];
    let mut last = 0;
    for i in 1..borders.len() {
        let (earlier, this) = (&borders[last], &borders[i]);
        // The same vertices may carry two contacts on opposite sides only if the normals differ.
        let same = earlier.key == this.key && dot(earlier.normal, this.normal) > 0.5;
        if same {
            let (first, repeat) = (earlier.contact, this.contact);
            contacts[first].thickness = contacts[first].thickness.max(contacts[repeat].thickness);
            kept[repeat] = false;
        } else {
            last = i;
        }
    }
    borders.retain(|b| kept[b.contact]);
    for contact in contacts.iter().filter(|c| c.pair.kind == PairKind::VertexFace) {
        let [p, face @ ..] = contact.vertices;
        for k in 0..3 {
            let mut edge = [face[k], face[(k + 1) % 3]];
            edge.sort_unstable();
            for key in [[p, edge[0], edge[1]], [p.min(face[k]), p.max(face[k]), u32::MAX]] {
                let first = borders.partition_point(|b| b.key < key);
                for border in borders[first..].iter_mut().take_while(|b| b.key == key) {
                    if contact.start_gap < contacts[border.contact].start_gap {
                        border.nearer[usize::from(key[2] == u32::MAX && p > face[k])] = true;
                    }
                }
            }
        }
    }
    borders.iter().filter(|b| b.nearer == [true; 2]).for_each(|b| kept[b.contact] = false);
    let mut keep = kept.into_iter();
    contacts.retain(|_| keep.next().unwrap_or(true));
    contacts
}

/// A contact between a vertex and an edge or another vertex.
struct Border {
    /// The vertex and the ends of the edge, in order; or both vertices in order and [`u32::MAX`].
    key: [u32; 3],
    contact: usize,
    /// Unit normal, towards the first vertex of the key.
    normal: Vec3,
    /// Whether a face is nearer to the first vertex of the key, and to the second.
    nearer: [bool; 2],
}

impl Border {
    /// The border that the closest points of a contact lie on; `None` inside a face or where two edges cross.
    fn of(contact: &Contact, index: usize) -> Option<Border> {
        let carries = |second: bool| {
            let mut ends = [u32::MAX; 4];
            let own = (0..4).filter(|k| contact.weights[*k] != 0.0 && contact.on_second(*k) == second);
            let count = own.zip(&mut ends).map(|(k, end)| *end = contact.vertices[k]).count();
            ends.sort_unstable();
            (count, ends)
        };
        let ((m, a), (n, b)) = (carries(false), carries(true));
        let (key, nearer) = match (m, n) {
            (1, 1) => ([a[0].min(b[0]), a[0].max(b[0]), u32::MAX], [false; 2]),
            (1, 2) => ([a[0], b[0], b[1]], [false, true]),
            (2, 1) => ([b[0], a[0], a[1]], [false, true]),
            _ => return None,
        };
        let normal = if key[0] == a[0] && m == 1 { contact.normal } else { scale(-1.0, contact.normal) };
        Some(Border { key, contact: index, normal, nearer })
    }
}
