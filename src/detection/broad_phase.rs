//! Candidate pairs by a tree of boxes: the same sets as [`super::brute_force`], in the same order.
//!
//! The tree stands over *elements*: faces, edges of no face, vertices of no edge. Each vertex and each edge is owned
//! by one element, so a pair of leaves yields every vertex-face and edge-edge pair between them exactly once, in one
//! traversal.

use super::bvh::{Bvh, Frame, LEAF, MIXED, PackedBox};
use super::leaf_blocks::LeafBlocks;
use super::leaf_pairs::Side;
use super::ownership::{Ownership, own};
use super::pair_lists::{PairBuffer, PairLists, merge, unite};
use super::primitives::{Candidates, Filter, Motion, Primitives};
use crate::geometry::Aabb;
use crate::math::Vec3;
use crate::math::simd::{Eight, EightKernel, run_eight};
use crate::parallel::Par;
use std::ops::Range;

/// Leaves per task of a parallel traversal.
const TASK: usize = 64;
/// The tree is rebuilt when its branches have grown this much against the boxes of its leaves.
const DECAY: f64 = 1.5;

/// Moves the pairs to keep to the front of a list and says how many they are.
pub type Screen<'a> = dyn Fn(&mut [[u32; 2]]) -> usize + Sync + 'a;

/// Which pairs a traversal collects.
#[derive(Clone, Copy)]
enum Wanted<'a> {
    Contacts,
    /// Those that the second screen keeps, of the edges of faces that meet in no clear star, see [`super::Stars`], and that
    /// the first keeps.
    EdgeFace(&'a [bool], [&'a Screen<'a>; 2]),
}

/// What a tree is fitted for.
#[derive(Clone, Copy)]
enum Fit {
    Contacts,
    /// Faces, and edges of no face.
    EdgesOfFaces,
}

/// A tree over the primitives of a model: built once, refitted to every motion.
#[derive(Clone, Debug)]
pub struct BroadPhase {
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    ownership: Ownership,
    tree: Bvh,
    built: bool,
    /// Extent of the branches against that of the leaves when the tree was built.
    quality: f64,
    leaf_vertices: LeafBlocks<1>,
    leaf_edges: LeafBlocks<2>,
    leaf_faces: LeafBlocks<3>,
    /// Edges of no face alone.
    leaf_wires: LeafBlocks<2>,
    leaves: Vec<PackedBox>,
    /// By vertex index.
    boxes: Vec<Aabb>,
    frame: Frame,
    packed: Vec<PackedBox>,
}

impl BroadPhase {
    /// Takes over the primitives. Cost: linear.
    ///
    /// Indices are trusted (see [`crate::mesh::Surface`]): a vertex index beyond the positions of a later
    /// [`BroadPhase::refit`] is a programming error.
    pub fn build(primitives: &Primitives) -> BroadPhase {
        BroadPhase {
            edges: primitives.edges.to_vec(),
            faces: primitives.faces.to_vec(),
            ownership: own(primitives),
            tree: Bvh::default(),
            built: false,
            quality: 0.0,
            leaf_vertices: LeafBlocks::default(),
            leaf_edges: LeafBlocks::default(),
            leaf_faces: LeafBlocks::default(),
            leaf_wires: LeafBlocks::default(),
            leaves: Vec::new(),
            boxes: Vec::new(),
            frame: Frame::of(&Aabb::EMPTY),
            packed: Vec::new(),
        }
    }

    /// Fits the tree to a motion, with `radius >= 0` around each vertex (empty: none). Positions are finite, and there
    /// is one for every vertex index.
    ///
    /// The first call builds the tree, a later one rebuilds it when the old one no longer suits. Either way the
    /// candidates are the same. Cost: linear; `n log n` when built.
    pub fn refit(&mut self, x0: &[Vec3], x1: &[Vec3], radius: &[f64], par: Par) {
        let motion = Motion { x0, x1, radius };
        self.boxes.resize(x0.len(), Aabb::EMPTY);
        par.map_into(&mut self.boxes, |v| motion.vertex_box(v as u32));
        self.fit_boxes(Fit::Contacts, par);
    }

    /// Fits the tree to boxes, one for every vertex index. Cost and candidates as of [`BroadPhase::refit`].
    pub fn refit_to(&mut self, boxes: &[Aabb], par: Par) {
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        self.fit_boxes(Fit::Contacts, par);
    }

    /// Fits the tree to boxes that differ from those of the last fit for `woken` vertices alone.
    ///
    /// Candidates as of [`BroadPhase::refit_to`]. Cost: linear, and little where few are woken.
    pub fn refit_woken(&mut self, woken: &[bool], boxes: &[Aabb]) {
        for v in (0..boxes.len()).filter(|v| woken[*v]) {
            self.boxes[v] = boxes[v];
            self.packed[v] = self.frame.packed(&boxes[v]);
        }
        for leaf in self.holding(woken) {
            self.leaf_vertices.refit_leaf(leaf, &self.packed);
            self.leaf_edges.refit_leaf(leaf, &self.packed);
            self.leaf_faces.refit_leaf(leaf, &self.packed);
            self.leaves[leaf as usize] = bounds(&self.leaf_vertices, &self.leaf_edges, &self.leaf_faces, leaf);
        }
        self.tree.refit(&self.leaves);
    }

    /// The leaves with a vertex for which `woken` says yes.
    fn holding(&self, woken: &[bool]) -> Vec<u32> {
        let holds = |leaf: &u32| {
            self.leaf_vertices.holds(*leaf, woken)
                || self.leaf_edges.holds(*leaf, woken)
                || self.leaf_faces.holds(*leaf, woken)
        };
        (0..self.leaves.len() as u32).filter(holds).collect()
    }

    fn fit_boxes(&mut self, fit: Fit, par: Par) {
        // A union does not depend on the order.
        self.frame = Frame::of(&self.boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(b)));
        self.packed.resize(self.boxes.len(), PackedBox::EMPTY);
        let (boxes, frame) = (&self.boxes, &self.frame);
        par.map_into(&mut self.packed, |v| frame.packed(&boxes[v]));
        if !self.built {
            self.arrange();
        }
        let quality = self.fit(fit, par);
        if self.quality == 0.0 {
            self.quality = quality;
        } else if quality > DECAY * self.quality {
            self.arrange();
            self.quality = self.fit(fit, par);
        }
    }

    /// [`BroadPhase::refit`] with a tree built anew.
    pub fn rebuild(&mut self, x0: &[Vec3], x1: &[Vec3], radius: &[f64], par: Par) {
        (self.built, self.quality) = (false, 0.0);
        self.refit(x0, x1, radius, par);
    }

    /// The boxes of the vertices in the last motion, by vertex index.
    pub fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    /// Orders the elements anew by their boxes.
    fn arrange(&mut self) {
        let (edges, faces, owned) = (&self.edges, &self.faces, &self.ownership);
        let of_faces = faces.iter().map(|f| self.bounds(f));
        let of_edges = owned.loose_edges.iter().map(|e| self.bounds(&edges[*e as usize]));
        let of_vertices = owned.loose_vertices.iter().map(|v| self.packed[*v as usize]);
        let (tree, order) = Bvh::build(of_faces.chain(of_edges).chain(of_vertices), &owned.components);
        self.leaf_vertices.arrange(order.chunks(LEAF), &owned.vertices, |v| [v]);
        self.leaf_edges.arrange(order.chunks(LEAF), &owned.edges, |e| edges[e as usize]);
        self.leaf_faces.arrange(order.chunks(LEAF), &owned.faces, |f| faces[f as usize]);
        self.leaf_wires.arrange(order.chunks(LEAF), &owned.wires, |e| edges[e as usize]);
        self.tree = tree;
        self.built = true;
    }

    /// The box of a primitive.
    #[inline(always)]
    fn bounds<const N: usize>(&self, corners: &[u32; N]) -> PackedBox {
        corners[1..].iter().fold(self.packed[corners[0] as usize], |b, v| b.union(&self.packed[*v as usize]))
    }

    /// New boxes of items, leaves and branches. Returns the extent of the branches against that of the leaves.
    fn fit(&mut self, fit: Fit, par: Par) -> f64 {
        match fit {
            Fit::Contacts => {
                self.leaf_vertices.refit(&self.packed, par);
                self.leaf_edges.refit(&self.packed, par);
            }
            Fit::EdgesOfFaces => self.leaf_wires.refit(&self.packed, par),
        }
        self.leaf_faces.refit(&self.packed, par);
        self.leaves.resize(self.tree.components.len(), PackedBox::EMPTY);
        let (vertices, edges, faces) = (&self.leaf_vertices, &self.leaf_edges, &self.leaf_faces);
        let wires = &self.leaf_wires;
        match fit {
            Fit::Contacts => par.map_into(&mut self.leaves, |i| bounds(vertices, edges, faces, i as u32)),
            Fit::EdgesOfFaces => {
                par.map_into(&mut self.leaves, |i| wires.bounds(i as u32).union(&faces.bounds(i as u32)))
            }
        }
        self.tree.refit(&self.leaves)
    }

    /// Vertex-face and edge-edge pairs whose boxes overlap, that share no vertex, and that the filter lets pass.
    ///
    /// Sorted; the same for every tree and number of threads. Cost: `n log n` plus the pairs.
    pub fn candidates(&self, filter: &Filter, out: &mut Candidates, par: Par) {
        let [vertex_face, edge_edge] = self.traverse(Wanted::Contacts, None, filter, par);
        merge(vertex_face, self.boxes.len(), &mut out.vertex_face, par);
        merge(edge_edge, self.edges.len(), &mut out.edge_edge, par);
    }

    /// Adds to `out` the pairs of [`BroadPhase::candidates`] that have a vertex for which `woken` says yes, so that it
    /// stays sorted and has each pair once.
    ///
    /// Cost: linear, plus what the leaves with such vertices meet.
    pub fn add_candidates(&self, woken: &[bool], filter: &Filter, out: &mut Candidates, par: Par) {
        let mut awake = vec![false; self.leaves.len()];
        self.holding(woken).into_iter().for_each(|leaf| awake[leaf as usize] = true);
        let [vertex_face, edge_edge] = self.traverse(Wanted::Contacts, Some(&awake), filter, par);
        let any = |corners: &[u32]| corners.iter().any(|v| woken[*v as usize]);
        let edge = |e: u32| any(&self.edges[e as usize]);
        let mut found = Vec::new();
        merge(vertex_face, self.boxes.len(), &mut found, par);
        found.retain(|[v, f]| woken[*v as usize] || any(&self.faces[*f as usize]));
        unite(&mut out.vertex_face, &mut found);
        merge(edge_edge, self.edges.len(), &mut found, par);
        found.retain(|[a, b]| edge(*a) || edge(*b));
        unite(&mut out.edge_edge, &mut found);
    }

    /// Edge-face pairs that share no vertex, that the filter lets pass, and whose boxes overlap at `x`: what the screens keep
    /// of them, sorted. The first one sees pairs of faces, of which edges and faces follow, the second edge-face pairs; each
    /// pair once, in lists that depend on the tree alone, and some whose boxes do not quite overlap.
    ///
    /// Left out are edges of faces that have a vertex in common with the other face at which `clear` says that the star does
    /// not cross itself, see [`super::Stars`]; none beyond its end. The tree is fitted to `x` for this search alone: for
    /// contacts it has to be refitted. Cost: as of [`BroadPhase::refit`] and [`BroadPhase::candidates`].
    pub fn edge_face_candidates(
        &mut self,
        x: &[Vec3],
        clear: &[bool],
        filter: &Filter,
        screens: [&Screen; 2],
        par: Par,
    ) -> Vec<[u32; 2]> {
        self.boxes.resize(x.len(), Aabb::EMPTY);
        par.map_into(&mut self.boxes, |v| Aabb { low: x[v], high: x[v] });
        self.fit_boxes(Fit::EdgesOfFaces, par);
        let [edge_face, _] = self.traverse(Wanted::EdgeFace(clear, screens), None, filter, par);
        let mut pairs: Vec<[u32; 2]> = edge_face.iter().flat_map(PairBuffer::pairs).copied().collect();
        pairs.sort_unstable();
        pairs
    }

    /// One vertex of a component, for the filter.
    fn representative(&self, component: u32) -> u32 {
        self.ownership.representatives[component as usize]
    }

    /// All pairs of leaves, or those with a leaf that is `awake`.
    fn traverse<'a>(&'a self, wanted: Wanted<'a>, awake: Option<&[bool]>, filter: &Filter, par: Par) -> [PairLists; 2] {
        let count = self.leaves.len();
        let task = |start: usize| Task { tree: self, wanted, awake, filter, leaves: start..count.min(start + TASK) };
        let mut tasks: Vec<_> = (0..count).step_by(TASK).map(|i| (task(i), Found::default())).collect();
        par.for_each_task(&mut tasks, |(task, found)| *found = run_eight(task.clone()));
        tasks.into_iter().map(|(_, found)| found).unzip().into()
    }
}

/// The box of a leaf, from those of its primitives.
fn bounds(vertices: &LeafBlocks<1>, edges: &LeafBlocks<2>, faces: &LeafBlocks<3>, leaf: u32) -> PackedBox {
    vertices.bounds(leaf).union(&edges.bounds(leaf)).union(&faces.bounds(leaf))
}

/// The leaves of one task.
#[derive(Clone)]
struct Task<'a> {
    tree: &'a BroadPhase,
    wanted: Wanted<'a>,
    awake: Option<&'a [bool]>,
    filter: &'a Filter<'a>,
    leaves: Range<usize>,
}

/// Pairs found by one task.
type Found = (PairBuffer, PairBuffer);

impl EightKernel for Task<'_> {
    type Output = Found;

    #[inline(always)]
    fn run<E: Eight>(self, eight: E) -> Found {
        let mut found = Found::default();
        let mut near = Vec::new();
        let sleeps = |leaf: u32| self.awake.is_some_and(|awake| !awake[leaf as usize]);
        for a in self.leaves.start as u32..self.leaves.end as u32 {
            if sleeps(a) {
                continue;
            }
            // A leaf meets those behind it, and those before it that sleep.
            self.list(eight, a, if self.awake.is_some() { 0 } else { a }, &mut near);
            for b in near.iter().filter(|b| **b >= a || sleeps(**b)) {
                match self.wanted {
                    Wanted::Contacts => self.contacts(eight, a, *b, &mut found),
                    Wanted::EdgeFace(clear, _) => self.edge_faces(eight, a, *b, clear, &mut found),
                }
            }
            if let Wanted::EdgeFace(_, [of_faces, of_edges]) = self.wanted {
                let last = a + 1 == self.leaves.end as u32;
                if last || found.1.is_many() {
                    found.1.screen(of_faces);
                    self.expand(&mut found);
                    found.0.screen(of_edges);
                }
            }
        }
        if let Wanted::EdgeFace(..) = self.wanted {
            found.0.shrink();
        }
        found
    }
}

impl Task<'_> {
    /// The leaves numbered `from` or higher whose boxes overlap that of `a` and which the filter lets meet it.
    #[inline(always)]
    fn list<E: Eight>(&self, eight: E, a: u32, from: u32, near: &mut Vec<u32>) {
        let t = self.tree;
        let own = t.tree.components[a as usize];
        let enter = |other: u32| own == MIXED || (self.filter)(t.representative(own), t.representative(other));
        t.tree.list(eight, &t.leaves[a as usize].query(), from, enter, near);
    }

    /// Which pairs of primitives of two leaves still have to be asked for: within one component on each side the filter
    /// has been asked already.
    #[inline(always)]
    fn open_filter(&self, a: u32, b: u32) -> Option<&Filter<'_>> {
        let components = &self.tree.tree.components;
        (components[a as usize] == MIXED || components[b as usize] == MIXED).then_some(self.filter)
    }

    #[inline(always)]
    fn contacts<E: Eight>(&self, eight: E, a: u32, b: u32, found: &mut Found) {
        let t = self.tree;
        let (box_a, box_b) = (t.leaves[a as usize].query(), t.leaves[b as usize].query());
        let (vertices, edges, faces) = (&t.leaf_vertices, &t.leaf_edges, &t.leaf_faces);
        let filter = self.open_filter(a, b);
        let mut side = Side { eight, boxes: &t.boxes, filter, apart_at: None, out: &mut found.0 };
        side.pairs::<1, 3, false>(vertices.leaf(a), &box_b, faces.leaf(b), &box_a);
        if a == b {
            side.out = &mut found.1;
            side.pairs_within(edges.leaf(a));
            return;
        }
        side.pairs::<1, 3, false>(vertices.leaf(b), &box_a, faces.leaf(a), &box_b);
        side.out = &mut found.1;
        side.pairs::<2, 2, true>(edges.leaf(a), &box_b, edges.leaf(b), &box_a);
    }

    /// Edges of no face with faces, and pairs of faces whose edges [`Task::expand`] tells.
    #[inline(always)]
    fn edge_faces<E: Eight>(&self, eight: E, a: u32, b: u32, clear: &[bool], found: &mut Found) {
        let t = self.tree;
        let (box_a, box_b) = (t.leaves[a as usize].query(), t.leaves[b as usize].query());
        let (wires, faces) = (&t.leaf_wires, &t.leaf_faces);
        let mut side =
            Side { eight, boxes: &t.boxes, filter: self.open_filter(a, b), apart_at: None, out: &mut found.0 };
        side.pairs::<2, 3, false>(wires.leaf(a), &box_b, faces.leaf(b), &box_a);
        if a != b {
            side.pairs::<2, 3, false>(wires.leaf(b), &box_a, faces.leaf(a), &box_b);
        }
        let mut side = Side { out: &mut found.1, apart_at: Some(clear), ..side };
        if a == b {
            side.pairs_within(faces.leaf(a));
        } else {
            side.pairs::<3, 3, true>(faces.leaf(a), &box_b, faces.leaf(b), &box_a);
        }
    }

    /// The edges that faces own with the faces they were found with, where their boxes overlap.
    #[inline(always)]
    fn expand(&self, (edge_face, faces): &mut Found) {
        let t = self.tree;
        for [a, b] in faces.pairs() {
            for (own, other) in [(*a, *b), (*b, *a)] {
                let corners = &t.faces[other as usize];
                let bounds = t.bounds(corners);
                for edge in t.ownership.edges.of(own) {
                    let ends = &t.edges[*edge as usize];
                    if t.bounds(ends).overlaps(&bounds) && !ends.iter().any(|v| corners.contains(v)) {
                        edge_face.push_one([*edge, other]);
                    }
                }
            }
        }
        faces.clear();
    }
}
