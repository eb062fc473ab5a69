//! Candidate pairs by a tree of boxes: the same sets as [`super::brute_force`], in the same order.
//!
//! The tree stands over *elements*: faces, edges of no face, vertices of no edge. Each vertex and each edge is owned
//! by one element, so a pair of leaves yields every vertex-face and edge-edge pair between them exactly once, in one
//! traversal.

use super::bvh::{Bvh, Frame, LEAF, MIXED, Overlap, PackedBox, item_boxes};
use super::ownership::{Ownership, own};
use super::pair_lists::{PairLists, merge};
use super::primitives::{Candidates, Filter, Motion, Primitives};
use crate::geometry::Aabb;
use crate::math::{Vec3, lerp};
use crate::mesh::share_vertex;
use crate::parallel::Par;

/// Leaves per task of a parallel traversal.
const TASK: usize = 64;
/// Vertices, edges or faces of one leaf at most: three an element.
const ITEMS: usize = 3 * LEAF;
/// The tree is rebuilt when its branches have grown this much against the boxes of its leaves.
const DECAY: f64 = 1.5;

/// Primitives of one kind in the order of the leaves.
#[derive(Clone, Debug, Default)]
struct Items<const N: usize> {
    /// Vertex index, edge number or face number.
    numbers: Vec<u32>,
    /// Vertices of each.
    corners: Vec<[u32; N]>,
    boxes: Vec<PackedBox>,
    /// Start of each leaf, and the end.
    offsets: Vec<u32>,
}

impl<const N: usize> Items<N> {
    fn arrange(numbers: Vec<u32>, offsets: Vec<u32>, corners: impl Fn(u32) -> [u32; N]) -> Self {
        let corners = numbers.iter().map(|n| corners(*n)).collect();
        Items { numbers, corners, boxes: Vec::new(), offsets }
    }

    #[inline(always)]
    fn leaf(&self, leaf: u32) -> std::ops::Range<usize> {
        self.offsets[leaf as usize] as usize..self.offsets[leaf as usize + 1] as usize
    }

    /// The items of a leaf that overlap a box: their places, and how many.
    #[inline(always)]
    fn near(&self, leaf: u32, b: &PackedBox, out: &mut [u32; ITEMS]) -> usize {
        let mut count = 0;
        for i in self.leaf(leaf) {
            out[count] = i as u32;
            count += usize::from(self.boxes[i].overlaps(b));
        }
        count
    }
}

/// Items of one kind near a box.
struct Near {
    places: [u32; ITEMS],
    count: usize,
}

impl Near {
    #[inline(always)]
    fn of<const N: usize>(items: &Items<N>, leaf: u32, b: &PackedBox) -> Near {
        let mut near = Near { places: [0; ITEMS], count: 0 };
        near.count = items.near(leaf, b, &mut near.places);
        near
    }

    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = usize> {
        self.places[..self.count].iter().map(|p| *p as usize)
    }
}

/// Which pairs a traversal collects.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Contacts,
    EdgeFace,
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
    leaf_vertices: Items<1>,
    leaf_edges: Items<2>,
    leaf_faces: Items<3>,
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
            leaf_vertices: Items::default(),
            leaf_edges: Items::default(),
            leaf_faces: Items::default(),
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
        // Blocks as in `Par::sum`; a union does not depend on the order.
        let bounds = self.boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(b));
        let frame = Frame::of(&bounds);
        self.packed.resize(x0.len(), PackedBox::EMPTY);
        let boxes = &self.boxes;
        par.map_into(&mut self.packed, |v| frame.packed(&boxes[v]));
        if !self.built {
            self.rebuild(&motion);
        }
        let quality = self.fit(par);
        if self.quality == 0.0 {
            self.quality = quality;
        } else if quality > DECAY * self.quality {
            self.rebuild(&motion);
            self.quality = self.fit(par);
        }
    }

    /// Orders the elements anew about the middle of their motion.
    fn rebuild(&mut self, motion: &Motion) {
        let middle = |v: u32| lerp(motion.x0[v as usize], motion.x1[v as usize], 0.5);
        let centre = |corners: &[u32]| {
            // Half the sum of the first and the last corner: any point of the element serves.
            lerp(middle(corners[0]), middle(corners[corners.len() - 1]), 0.5)
        };
        let (edges, faces) = (&self.edges, &self.faces);
        let owned = &self.ownership;
        let mut centres: Vec<Vec3> = Vec::with_capacity(owned.elements());
        centres.extend(faces.iter().map(|f| centre(f)));
        centres.extend(owned.loose_edges.iter().map(|e| centre(&edges[*e as usize])));
        centres.extend(owned.loose_vertices.iter().map(|v| centre(&[*v])));
        let (tree, order) = Bvh::build(&centres, &owned.components);
        let leaf_order = |lists: &super::ownership::Lists| lists.gather(&order, LEAF);
        let (numbers, offsets) = leaf_order(&owned.vertices);
        self.leaf_vertices = Items::arrange(numbers, offsets, |v| [v]);
        let (numbers, offsets) = leaf_order(&owned.edges);
        self.leaf_edges = Items::arrange(numbers, offsets, |e| edges[e as usize]);
        let mut offsets = vec![0];
        let mut numbers = Vec::with_capacity(faces.len());
        for leaf in order.chunks(LEAF) {
            numbers.extend(leaf.iter().copied().filter(|e| (*e as usize) < faces.len()));
            offsets.push(numbers.len() as u32);
        }
        self.leaf_faces = Items::arrange(numbers, offsets, |f| faces[f as usize]);
        self.tree = tree;
        self.built = true;
    }

    /// New boxes of items, leaves and branches. Returns the extent of the branches against that of the leaves.
    fn fit(&mut self, par: Par) -> f64 {
        item_boxes(&self.leaf_vertices.corners, &self.packed, &mut self.leaf_vertices.boxes, par);
        item_boxes(&self.leaf_edges.corners, &self.packed, &mut self.leaf_edges.boxes, par);
        item_boxes(&self.leaf_faces.corners, &self.packed, &mut self.leaf_faces.boxes, par);
        let count = self.tree.components.len();
        self.leaves.resize(count, PackedBox::EMPTY);
        let (vertices, edges, faces) = (&self.leaf_vertices, &self.leaf_edges, &self.leaf_faces);
        par.map_into(&mut self.leaves, |leaf| {
            let leaf = leaf as u32;
            let all = vertices.boxes[vertices.leaf(leaf)].iter();
            let all = all.chain(&edges.boxes[edges.leaf(leaf)]).chain(&faces.boxes[faces.leaf(leaf)]);
            all.fold(PackedBox::EMPTY, |a, b| a.union(b))
        });
        self.tree.refit(&self.leaves)
    }

    /// Vertex-face and edge-edge pairs whose boxes overlap, that share no vertex, and that the filter lets pass.
    ///
    /// Sorted; the same for every tree and number of threads. Cost: `n log n` plus the pairs.
    pub fn candidates(&self, filter: &Filter, out: &mut Candidates, par: Par) {
        let [vertex_face, edge_edge] = self.traverse(Wanted::Contacts, filter, par);
        merge(vertex_face, self.boxes.len(), &mut out.vertex_face, par);
        merge(edge_edge, self.edges.len(), &mut out.edge_edge, par);
    }

    /// Edge-face pairs whose boxes overlap, that share no vertex, and that the filter lets pass; sorted.
    pub fn edge_face_candidates(&self, filter: &Filter, out: &mut Candidates, par: Par) {
        let [edge_face, _] = self.traverse(Wanted::EdgeFace, filter, par);
        merge(edge_face, self.edges.len(), &mut out.edge_face, par);
    }

    /// One vertex of a component, for the filter.
    fn representative(&self, component: u32) -> u32 {
        self.ownership.representatives[component as usize]
    }

    fn traverse(&self, wanted: Wanted, filter: &Filter, par: Par) -> [PairLists; 2] {
        let count = self.leaves.len();
        let mut tasks: Vec<(usize, Found)> = (0..count).step_by(TASK).map(|i| (i, Found::default())).collect();
        par.for_each_task(&mut tasks, |(start, found)| {
            for leaf in *start..count.min(*start + TASK) {
                self.leaf(leaf as u32, wanted, filter, found);
            }
        });
        let (mut first, mut second) = (Vec::with_capacity(tasks.len()), Vec::with_capacity(tasks.len()));
        for (_, found) in tasks {
            first.push(found.first);
            second.push(found.second);
        }
        [first, second]
    }

    /// All pairs of one leaf with itself and the leaves behind it.
    fn leaf(&self, a: u32, wanted: Wanted, filter: &Filter, found: &mut Found) {
        let own = self.tree.components[a as usize];
        let passes =
            |other: u32| own == MIXED || other == MIXED || filter(self.representative(own), self.representative(other));
        self.tree.visit(&self.leaves[a as usize], a, passes, |b| {
            // Within one component on each side the filter has been asked already.
            let mixed = own == MIXED || self.tree.components[b as usize] == MIXED;
            let pass = |v: u32, w: u32| !mixed || filter(v, w);
            match wanted {
                Wanted::Contacts => self.contacts(a, b, &pass, found),
                Wanted::EdgeFace => self.edge_faces(a, b, &pass, found),
            }
        });
    }

    fn contacts(&self, a: u32, b: u32, pass: &impl Fn(u32, u32) -> bool, found: &mut Found) {
        let (box_a, box_b) = (&self.leaves[a as usize], &self.leaves[b as usize]);
        let (vertices, edges, faces) = (&self.leaf_vertices, &self.leaf_edges, &self.leaf_faces);
        let near_faces = Near::of(faces, b, box_a);
        if near_faces.count > 0 {
            self.pairs(vertices, &Near::of(vertices, a, box_b), faces, &near_faces, pass, &mut found.first);
        }
        let near_edges = Near::of(edges, a, box_b);
        if a == b {
            for i in near_edges.iter() {
                for j in i + 1..edges.leaf(a).end {
                    self.pair(edges, i, edges, j, pass, &mut found.second);
                }
            }
            return;
        }
        let near_vertices = Near::of(vertices, b, box_a);
        if near_vertices.count > 0 {
            self.pairs(vertices, &near_vertices, faces, &Near::of(faces, a, box_b), pass, &mut found.first);
        }
        if near_edges.count > 0 {
            self.pairs(edges, &near_edges, edges, &Near::of(edges, b, box_a), pass, &mut found.second);
        }
    }

    fn edge_faces(&self, a: u32, b: u32, pass: &impl Fn(u32, u32) -> bool, found: &mut Found) {
        let (box_a, box_b) = (&self.leaves[a as usize], &self.leaves[b as usize]);
        let (edges, faces) = (&self.leaf_edges, &self.leaf_faces);
        self.pairs(edges, &Near::of(edges, a, box_b), faces, &Near::of(faces, b, box_a), pass, &mut found.first);
        if a != b {
            self.pairs(edges, &Near::of(edges, b, box_a), faces, &Near::of(faces, a, box_b), pass, &mut found.first);
        }
    }

    #[inline(always)]
    fn pairs<const N: usize, const M: usize>(
        &self,
        first: &Items<N>,
        near_first: &Near,
        second: &Items<M>,
        near_second: &Near,
        pass: &impl Fn(u32, u32) -> bool,
        out: &mut Vec<[u32; 2]>,
    ) {
        for i in near_first.iter() {
            for j in near_second.iter() {
                self.pair(first, i, second, j, pass, out);
            }
        }
    }

    #[inline(always)]
    fn pair<const N: usize, const M: usize>(
        &self,
        first: &Items<N>,
        i: usize,
        second: &Items<M>,
        j: usize,
        pass: &impl Fn(u32, u32) -> bool,
        out: &mut Vec<[u32; 2]>,
    ) {
        let overlap = first.boxes[i].compare(&second.boxes[j]);
        if overlap == Overlap::None {
            return;
        }
        let (a, b) = (&first.corners[i], &second.corners[j]);
        if share_vertex(a, b) || overlap == Overlap::Tie && !self.exact_box(a).overlaps(&self.exact_box(b)) {
            return;
        }
        if pass(a[0], b[0]) {
            let (m, n) = (first.numbers[i], second.numbers[j]);
            // Edge-edge: the smaller first. The other kinds have their fixed order.
            out.push(if N == M && n < m { [n, m] } else { [m, n] });
        }
    }

    fn exact_box<const N: usize>(&self, corners: &[u32; N]) -> Aabb {
        corners.iter().fold(Aabb::EMPTY, |b, v| b.union(&self.boxes[*v as usize]))
    }
}

/// Pairs found by one task.
#[derive(Default)]
struct Found {
    first: Vec<[u32; 2]>,
    second: Vec<[u32; 2]>,
}
