//! Candidate pairs by a tree of boxes: the same sets as [`super::brute_force`], in the same order.
//!
//! The tree stands over *elements*: faces, edges of no face, vertices of no edge. Each vertex and each edge is owned
//! by one element, so a pair of leaves yields every vertex-face and edge-edge pair between them exactly once, in one
//! traversal.

use super::bvh::{Bvh, Frame, LEAF, MIXED, PackedBox};
use super::leaf_blocks::{Block, LeafBlocks};
use super::ownership::{Lists, Ownership, own};
use super::pair_lists::{PairLists, merge};
use super::primitives::{Candidates, Filter, Motion, Primitives};
use crate::geometry::Aabb;
use crate::math::{Vec3, lerp};
use crate::parallel::Par;

/// Leaves per task of a parallel traversal.
const TASK: usize = 64;
/// Blocks of four vertices, edges or faces of one leaf at most: three primitives an element.
const BLOCKS: usize = (3 * LEAF).div_ceil(4);
/// The tree is rebuilt when its branches have grown this much against the boxes of its leaves.
const DECAY: f64 = 1.5;

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
        let gather = |lists: &Lists| -> Vec<Vec<u32>> {
            let of = |leaf: &[u32]| leaf.iter().flat_map(|e| lists.of(*e)).copied().collect();
            order.chunks(LEAF).map(of).collect()
        };
        self.leaf_vertices = LeafBlocks::arrange(gather(&owned.vertices).iter().map(Vec::as_slice), |v| [v]);
        let edges_of = gather(&owned.edges);
        self.leaf_edges = LeafBlocks::arrange(edges_of.iter().map(Vec::as_slice), |e| edges[e as usize]);
        let is_face = |e: &u32| (*e as usize) < faces.len();
        let faces_of: Vec<Vec<u32>> = order.chunks(LEAF).map(|l| l.iter().copied().filter(is_face).collect()).collect();
        self.leaf_faces = LeafBlocks::arrange(faces_of.iter().map(Vec::as_slice), |f| faces[f as usize]);
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
        self.tree.visit(&self.leaves[a as usize].query(), a, passes, |b| {
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
        let (box_a, box_b) = (self.leaves[a as usize].query(), self.leaves[b as usize].query());
        let (vertices, edges, faces) = (&self.leaf_vertices, &self.leaf_edges, &self.leaf_faces);
        let mut side = Side { boxes: &self.boxes, pass, out: &mut found.first };
        side.pairs(vertices.leaf(a), &box_b, faces.leaf(b), &box_a, false);
        if a != b {
            side.pairs(vertices.leaf(b), &box_a, faces.leaf(a), &box_b, false);
        }
        side.out = &mut found.second;
        side.pairs(edges.leaf(a), &box_b, edges.leaf(b), &box_a, a == b);
    }

    fn edge_faces(&self, a: u32, b: u32, pass: &impl Fn(u32, u32) -> bool, found: &mut Found) {
        let (box_a, box_b) = (self.leaves[a as usize].query(), self.leaves[b as usize].query());
        let (edges, faces) = (&self.leaf_edges, &self.leaf_faces);
        let mut side = Side { boxes: &self.boxes, pass, out: &mut found.first };
        side.pairs(edges.leaf(a), &box_b, faces.leaf(b), &box_a, false);
        if a != b {
            side.pairs(edges.leaf(b), &box_a, faces.leaf(a), &box_b, false);
        }
    }
}

/// Pairs between two leaves, and where they go.
struct Side<'a, P> {
    /// Boxes in double precision by vertex index, for ties.
    boxes: &'a [Aabb],
    pass: &'a P,
    out: &'a mut Vec<[u32; 2]>,
}

impl<P: Fn(u32, u32) -> bool> Side<'_, P> {
    /// All pairs of primitives of one leaf with those of another, each first restricted to the other's box. Of a list
    /// with itself (`same`), each pair once.
    #[inline(always)]
    fn pairs<const N: usize, const M: usize>(
        &mut self,
        first: &[Block<N>],
        near_first: &[f32; 6],
        second: &[Block<M>],
        near_second: &[f32; 6],
        same: bool,
    ) {
        let mut masks = [0; BLOCKS];
        let mut any = 0;
        for (mask, block) in masks.iter_mut().zip(second) {
            *mask = block.near(near_second);
            any |= *mask;
        }
        if any == 0 {
            return;
        }
        for (i, block) in first.iter().enumerate() {
            let mut lanes = block.near(near_first);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let (query, corners) = (block.query(lane), block.corners(lane));
                for (j, other) in second.iter().enumerate().skip(if same { i } else { 0 }) {
                    // Of its own block, only the lanes behind it.
                    let behind = if same && i == j { !((2 << lane) - 1) } else { -1 };
                    let hits = other.near(&query) & masks[j] & behind;
                    if hits != 0 {
                        self.found(block.number(lane), &corners, &query, other, hits);
                    }
                }
            }
        }
    }

    /// Keeps the hits that share no vertex, overlap exactly and pass the filter.
    #[inline(always)]
    fn found<const N: usize, const M: usize>(
        &mut self,
        number: u32,
        corners: &[u32; N],
        query: &[f32; 6],
        other: &Block<M>,
        hits: i32,
    ) {
        let mut hits = hits & !other.sharing(corners);
        let proven = other.proven(query);
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let other_corners = other.corners(lane);
            let overlap = proven >> lane & 1 == 1 || self.exact_box(corners).overlaps(&self.exact_box(&other_corners));
            if overlap && (self.pass)(corners[0], other_corners[0]) {
                let n = other.number(lane);
                // Edge-edge: the smaller first. The other kinds have their fixed order.
                self.out.push(if N == M && n < number { [n, number] } else { [number, n] });
            }
        }
    }

    #[cold]
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
