//! Candidate pairs by a tree of boxes: the same sets as [`super::brute_force`], in the same order.
//!
//! The tree stands over *elements*: faces, edges of no face, vertices of no edge. Each vertex and each edge is owned
//! by one element, so a pair of leaves yields every vertex-face and edge-edge pair between them exactly once, in one
//! traversal.

use super::bvh::{Bvh, Frame, LEAF, MIXED, PackedBox};
use super::leaf_blocks::{Block, LeafBlocks};
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
    /// Those that the screen keeps.
    EdgeFace(&'a Screen<'a>),
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
    leaves: Vec<PackedBox>,
    /// By vertex index.
    boxes: Vec<Aabb>,
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
            leaves: Vec::new(),
            boxes: Vec::new(),
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
        self.fit_boxes(par);
    }

    /// Fits the tree to boxes, one for every vertex index. Cost and candidates as of [`BroadPhase::refit`].
    pub fn refit_to(&mut self, boxes: &[Aabb], par: Par) {
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        self.fit_boxes(par);
    }

    fn fit_boxes(&mut self, par: Par) {
        // A union does not depend on the order.
        let bounds = self.boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(b));
        let frame = Frame::of(&bounds);
        self.packed.resize(self.boxes.len(), PackedBox::EMPTY);
        let boxes = &self.boxes;
        par.map_into(&mut self.packed, |v| frame.packed(&boxes[v]));
        if !self.built {
            self.arrange();
        }
        let quality = self.fit(par);
        if self.quality == 0.0 {
            self.quality = quality;
        } else if quality > DECAY * self.quality {
            self.arrange();
            self.quality = self.fit(par);
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
        let (edges, faces, packed, owned) = (&self.edges, &self.faces, &self.packed, &self.ownership);
        let bounds = |corners: &[u32]| {
            corners[1..].iter().fold(packed[corners[0] as usize], |b, v| b.union(&packed[*v as usize]))
        };
        let of_faces = faces.iter().map(|f| bounds(f));
        let of_edges = owned.loose_edges.iter().map(|e| bounds(&edges[*e as usize]));
        let of_vertices = owned.loose_vertices.iter().map(|v| packed[*v as usize]);
        let (tree, order) = Bvh::build(of_faces.chain(of_edges).chain(of_vertices), &owned.components);
        self.leaf_vertices.arrange(order.chunks(LEAF), &owned.vertices, |v| [v]);
        self.leaf_edges.arrange(order.chunks(LEAF), &owned.edges, |e| edges[e as usize]);
        self.leaf_faces.arrange(order.chunks(LEAF), &owned.faces, |f| faces[f as usize]);
        self.tree = tree;
        self.built = true;
    }

    /// New boxes of items, leaves and branches. Returns the extent of the branches against that of the leaves.
    fn fit(&mut self, par: Par) -> f64 {
        self.leaf_vertices.refit(&self.packed, par);
        self.leaf_edges.refit(&self.packed, par);
        self.leaf_faces.refit(&self.packed, par);
        self.leaves.resize(self.tree.components.len(), PackedBox::EMPTY);
        let (vertices, edges, faces) = (&self.leaf_vertices, &self.leaf_edges, &self.leaf_faces);
        par.map_into(&mut self.leaves, |leaf| {
            let leaf = leaf as u32;
            let all = vertices.leaf(leaf).iter().map(Block::bounds);
            let all = all.chain(edges.leaf(leaf).iter().map(Block::bounds));
            all.chain(faces.leaf(leaf).iter().map(Block::bounds)).fold(PackedBox::EMPTY, |a, b| a.union(&b))
        });
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
        let awake: Vec<bool> = (0..self.leaves.len() as u32)
            .map(|leaf| {
                self.leaf_vertices.holds(leaf, woken)
                    || self.leaf_edges.holds(leaf, woken)
                    || self.leaf_faces.holds(leaf, woken)
            })
            .collect();
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

    /// Edge-face pairs whose boxes overlap, that share no vertex, and that the filter lets pass: what the screen keeps of
    /// them, sorted. It sees each pair once, in lists that depend on the tree alone.
    pub fn edge_face_candidates(&self, filter: &Filter, screen: &Screen, par: Par) -> Vec<[u32; 2]> {
        let [edge_face, _] = self.traverse(Wanted::EdgeFace(screen), None, filter, par);
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
        par.for_each_task(&mut tasks, |(task, found)| {
            *found = run_eight(task.clone());
            // While the pairs are in the processor's cache.
            if let Wanted::EdgeFace(screen) = wanted {
                found.0.keep(screen);
            }
        });
        tasks.into_iter().map(|(_, found)| found).unzip().into()
    }
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
                    Wanted::EdgeFace(_) => self.edge_faces(eight, a, *b, &mut found),
                }
            }
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
        let mut side = Side { eight, boxes: &t.boxes, filter: self.open_filter(a, b), out: &mut found.0 };
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

    #[inline(always)]
    fn edge_faces<E: Eight>(&self, eight: E, a: u32, b: u32, found: &mut Found) {
        let t = self.tree;
        let (box_a, box_b) = (t.leaves[a as usize].query(), t.leaves[b as usize].query());
        let (edges, faces) = (&t.leaf_edges, &t.leaf_faces);
        let mut side = Side { eight, boxes: &t.boxes, filter: self.open_filter(a, b), out: &mut found.0 };
        side.pairs::<2, 3, false>(edges.leaf(a), &box_b, faces.leaf(b), &box_a);
        if a != b {
            side.pairs::<2, 3, false>(edges.leaf(b), &box_a, faces.leaf(a), &box_b);
        }
    }
}
