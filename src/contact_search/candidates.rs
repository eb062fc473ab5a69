//! Candidate pairs of a segment, kept over rounds and steps while every vertex stays in the box they were found for.

use super::distinct::Borders;
use super::pair::BodyFilter;
use super::vicinity::Vicinity;
use crate::detection::intersection::{Intersection, find_with};
use crate::detection::screening::Lists;
use crate::detection::{BroadPhase, Candidates, Primitives, Stars, screening};
use crate::geometry::Aabb;
use crate::math::{Vec3, is_finite};
use crate::model::Model;
use crate::parallel::Par;

/// Broad phase and candidates. A cache: emptying it changes no bit, since candidates are sorted and then tested
/// exactly.
#[derive(Default)]
pub struct CandidateSearch {
    meshes: Option<Meshes>,
    candidates: Candidates,
    /// Number of the search that found them.
    search: u64,
    anchor: Option<Anchor>,
    /// Vertices outside their boxes, of the call that runs.
    outside: Vec<bool>,
    buffers: Buffers,
}

/// Candidates, with buffers for what is asked about them.
pub struct Found<'a> {
    /// The pairs.
    pub candidates: &'a Candidates,
    /// Number of the search that found them; 0 for others.
    pub search: u64,
    /// Capacity only.
    pub buffers: &'a mut Buffers,
}

/// Buffers of near contacts and of sweeps: capacity only, emptying them changes no bit.
#[derive(Default)]
pub struct Buffers {
    /// By vertex, factor times half thickness `[m]`.
    reach: Vec<f64>,
    screening: screening::Buffers,
    vicinity: Vicinity,
    borders: Borders,
}

impl Found<'_> {
    /// The same candidates once more.
    pub fn again(&mut self) -> Found<'_> {
        Found { candidates: self.candidates, search: self.search, buffers: self.buffers }
    }

    /// Numbers of those that may be nearer at `x` than `factor` times their thickness, ascending; and the buffers of what
    /// is next.
    pub(super) fn near(&mut self, model: &Model, x: &[Vec3], factor: f64, par: Par) -> (&[u32], &mut Borders) {
        let Buffers { reach, screening, vicinity, borders } = &mut *self.buffers;
        let lists = Lists { primitives: &primitives(model), candidates: self.candidates };
        if vicinity.list(model, self.search, &[x], factor).is_none() {
            let farther = vicinity.next_reach(model, x, factor);
            half_thicknesses(model, farther, reach);
            vicinity.assign(model, self.search, x, farther, screening::near(x, lists, None, reach, screening, par));
        }
        if vicinity.reach() == factor {
            return (vicinity.numbers(), borders);
        }
        half_thicknesses(model, factor, reach);
        (screening::near(x, lists, Some(vicinity.numbers()), reach, screening, par), borders)
    }

    /// Numbers of those that may come closer than continuous detection allows on the way from `x0` to `x1`, ascending.
    pub(super) fn approaching(&mut self, model: &Model, x0: &[Vec3], x1: &[Vec3], par: Par) -> &[u32] {
        let Buffers { reach, screening, vicinity, .. } = &mut *self.buffers;
        half_thicknesses(model, 1.0, reach);
        let among = vicinity.list(model, self.search, &[x0, x1], SWEPT_REACH);
        let lists = Lists { primitives: &primitives(model), candidates: self.candidates };
        screening::approaching(x0, x1, lists, among, reach, screening, par)
    }
}

/// What the meshes of a model are searched by.
struct Meshes {
    topology: u64,
    tree: BroadPhase,
    stars: Stars,
}

/// What the present candidates were found for.
struct Anchor {
    topology: u64,
    filter: u64,
    factor: f64,
    /// The boxes searched, by vertex.
    boxes: Vec<Aabb>,
    /// Whether the tree is fitted to them.
    fitted: bool,
    /// Pairs found when all of them were searched, and how often boxes were widened since.
    pairs: usize,
    widened: u32,
}

/// Boxes are widened this often at most before all are searched anew.
const WIDENED_MAX: u32 = 4;

/// All boxes are searched anew where more than one vertex in so many has left its own.
const FEW: usize = 8;

/// Continuous detection keeps half the thickness at most, and may raise an alarm a thousandth farther away: boxes that
/// are thickened by this many half thicknesses hold all it can find.
const SWEPT_REACH: f64 = 0.51;

impl CandidateSearch {
    /// All vertex-face and edge-edge pairs closer at `x0` than `factor` times their thickness along every axis, or closer
    /// than half their thickness on the way to `x1`; a superset of them, which depends on earlier calls.
    ///
    /// Boxes are swept from `x0` to `x1` and thickened by `factor + 1` half thicknesses. The pairs are kept over rounds
    /// and steps as long as each vertex stays within its box: at `x0` with `factor`, on its way with half of one to spare.
    pub fn update(
        &mut self,
        model: &Model,
        filter: &BodyFilter,
        x0: &[Vec3],
        x1: &[Vec3],
        factor: f64,
        par: Par,
    ) -> Found<'_> {
        self.find(model, filter, x0, x1, factor, par);
        Found { candidates: &self.candidates, search: self.search, buffers: &mut self.buffers }
    }

    fn find(&mut self, model: &Model, filter: &BodyFilter, x0: &[Vec3], x1: &[Vec3], factor: f64, par: Par) {
        if let Some(anchor) = self.anchor.as_mut().filter(|anchor| anchor.is_for(model, filter, factor, x0.len())) {
            let outside = &mut self.outside;
            outside.resize(x0.len(), false);
            par.map_into(outside, |v| anchor.is_left(v, model, x0[v], x1[v], factor));
            let count = outside.iter().filter(|left| **left).count();
            if count == 0 {
                return;
            }
            self.search += 1;
            let pairs = self.candidates.vertex_face.len() + self.candidates.edge_edge.len();
            let grown = pairs > anchor.pairs + anchor.pairs / 4;
            let finite = (0..x0.len()).all(|v| !outside[v] || (is_finite(x0[v]) && is_finite(x1[v])));
            if anchor.widened < WIDENED_MAX && count * FEW <= x0.len() && !grown && finite {
                // What has left its box is searched again, within a box that holds both ways.
                anchor.widened += 1;
                for v in (0..x0.len()).filter(|v| outside[*v]) {
                    let radius = (factor + 1.0) * model.bodies[model.vertex_body[v] as usize].half_thickness;
                    anchor.boxes[v] = anchor.boxes[v].union(&Aabb::swept(x0[v], x1[v], radius));
                }
                let broad_phase = &mut meshes(&mut self.meshes, model).tree;
                if anchor.fitted {
                    broad_phase.refit_woken(outside, &anchor.boxes);
                } else {
                    broad_phase.refit_to(&anchor.boxes, par);
                }
                anchor.fitted = true;
                let allowed = |a, b| allowed(model, filter, a, b);
                broad_phase.add_candidates(outside, &allowed, &mut self.candidates, par);
                return;
            }
        }
        self.search += 1;
        let radius = &mut self.buffers.reach;
        half_thicknesses(model, factor + 1.0, radius);
        let broad_phase = &mut meshes(&mut self.meshes, model).tree;
        broad_phase.refit(x0, x1, radius, par);
        broad_phase.candidates(&|a, b| allowed(model, filter, a, b), &mut self.candidates, par);
        let mut boxes = self.anchor.take().map(|anchor| anchor.boxes).unwrap_or_default();
        boxes.clear();
        boxes.extend_from_slice(broad_phase.boxes());
        let (topology, filter) = (model.topology_hash, filter.fingerprint());
        let pairs = self.candidates.vertex_face.len() + self.candidates.edge_edge.len();
        self.anchor = Some(Anchor { topology, filter, factor, boxes, fitted: true, pairs, widened: 0 });
    }

    /// Edges and faces that share a point at `x`, by the same tree and exactly.
    pub fn crossings(&mut self, model: &Model, filter: &BodyFilter, x: &[Vec3], par: Par) -> Vec<Intersection> {
        let allowed = |a, b| allowed(model, filter, a, b);
        if let Some(anchor) = &mut self.anchor {
            anchor.fitted = false;
        }
        let meshes = meshes(&mut self.meshes, model);
        find_with((&mut meshes.tree, &meshes.stars), &primitives(model), x, &allowed, par)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let c = &self.candidates;
        8 * (c.vertex_face.capacity() + c.edge_edge.capacity())
            + self.anchor.as_ref().map_or(0, |a| 48 * a.boxes.capacity())
    }
}

/// The tree and the stars of a model, built where there are none of this topology.
fn meshes<'a>(kept: &'a mut Option<Meshes>, model: &Model) -> &'a mut Meshes {
    let topology = model.topology_hash;
    if kept.as_ref().is_some_and(|meshes| meshes.topology != topology) {
        *kept = None;
    }
    let primitives = primitives(model);
    let build = || Meshes { topology, tree: BroadPhase::build(&primitives), stars: Stars::build(&primitives) };
    kept.get_or_insert_with(build)
}

fn allowed(model: &Model, filter: &BodyFilter, a: u32, b: u32) -> bool {
    filter.allows(model.vertex_body[a as usize] as usize, model.vertex_body[b as usize] as usize)
}

impl Anchor {
    /// Whether the boxes are those of this model, filter and factor.
    fn is_for(&self, model: &Model, filter: &BodyFilter, factor: f64, vertices: usize) -> bool {
        self.topology == model.topology_hash
            && self.filter == filter.fingerprint()
            && self.factor == factor
            && self.boxes.len() == vertices
    }

    /// Whether a vertex leaves its box: at `x0` with `factor`, on its way with half of one to spare.
    fn is_left(&self, v: usize, model: &Model, x0: Vec3, x1: Vec3, factor: f64) -> bool {
        let half_thickness = model.bodies[model.vertex_body[v] as usize].half_thickness;
        !(is_finite(x0)
            && is_finite(x1)
            && holds(&self.boxes[v], x0, x1, [factor, SWEPT_REACH].map(|f| f * half_thickness)))
    }
}

/// Whether a box holds that of `x0` and that of the way from there to `x1`, thickened by `near` and by `way`, both 0 or neither,
/// and rounded outward: what lies beyond a number lies beyond its neighbour too.
#[inline(always)]
fn holds(own: &Aabb, x0: Vec3, x1: Vec3, [near, way]: [f64; 2]) -> bool {
    let beyond = |bound: f64, x: f64| bound < x || (bound == x && near == 0.0);
    let mut held = true;
    for k in 0..3 {
        let (low, high) = (x0[k].min(x1[k]), x0[k].max(x1[k]));
        held &= beyond(own.low[k], x0[k] - near) & beyond(own.low[k], low - way);
        held &= beyond(x0[k] + near, own.high[k]) & beyond(high + way, own.high[k]);
    }
    held
}

/// The collision primitives of a model.
pub fn primitives(model: &Model) -> Primitives<'_> {
    Primitives { vertices: &model.contact_vertices, edges: &model.edges, faces: &model.faces }
}

/// `factor` times the half thickness of every vertex's body `[m]`.
fn half_thicknesses(model: &Model, factor: f64, out: &mut Vec<f64>) {
    out.clear();
    out.extend(model.vertex_body.iter().map(|b| factor * model.bodies[*b as usize].half_thickness));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn a_box_holds_what_swept_boxes_cover() {
        let mut random = Random(7);
        let mut next = |n: u64| random.below(n);
        let (mut held, mut left) = (0, 0);
        for _ in 0..20_000 {
            // Few values, and their neighbours, so that bounds are often met exactly.
            let mut vector = || -> Vec3 { std::array::from_fn(|_| 0.1 * next(5) as f64 - 0.2) };
            let (x0, x1) = (vector(), vector());
            let [near, way] = [[0.0, 0.0], [0.1, 0.05], [0.05, 0.1]][next(3) as usize];
            let covered = Aabb::swept(x0, x0, near).union(&Aabb::swept(x0, x1, way));
            let mut own = covered;
            for bound in own.low.iter_mut().chain(&mut own.high) {
                *bound = match next(12) {
                    0 => bound.next_up(),
                    1 => bound.next_down(),
                    _ => *bound,
                };
            }
            let within = (0..3).all(|k| own.low[k] <= covered.low[k] && covered.high[k] <= own.high[k]);
            assert_eq!(holds(&own, x0, x1, [near, way]), within, "{own:?} {x0:?} {x1:?} {near} {way}");
            *if within { &mut held } else { &mut left } += 1;
        }
        assert!(held > 1000 && left > 1000);
    }
}
