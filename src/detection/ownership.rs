//! Which element of the tree owns which vertex and edge, and which elements hang together.

use super::primitives::Primitives;

/// Lists of numbers, one per element.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists {
    offsets: Vec<u32>,
    numbers: Vec<u32>,
}

impl Lists {
    /// From `(element, number)` pairs; `count` elements.
    pub fn collect(count: usize, pairs: &[(u32, u32)]) -> Lists {
        let mut offsets = vec![0_u32; count + 2];
        for (element, _) in pairs {
            offsets[*element as usize + 2] += 1;
        }
        for i in 2..offsets.len() {
            offsets[i] += offsets[i - 1];
        }
        let mut numbers = vec![0; pairs.len()];
        for (element, number) in pairs {
            let place = &mut offsets[*element as usize + 1];
            numbers[*place as usize] = *number;
            *place += 1;
        }
        offsets.pop();
        Lists { offsets, numbers }
    }

    /// How many numbers there are in all.
    pub fn total(&self) -> usize {
        self.numbers.len()
    }

    #[inline(always)]
    pub fn of(&self, element: u32) -> &[u32] {
        &self.numbers[self.offsets[element as usize] as usize..self.offsets[element as usize + 1] as usize]
    }
}

/// Elements: all faces, then the edges of no face, then the vertices of no edge and no face.
#[derive(Clone, Debug, Default)]
pub(super) struct Ownership {
    pub loose_edges: Vec<u32>,
    pub loose_vertices: Vec<u32>,
    /// Vertices of each element, at most three; each vertex once.
    pub vertices: Lists,
    /// Edges of each element, at most three; each edge once.
    pub edges: Lists,
    /// Each face by itself, none for the other elements.
    pub faces: Lists,
    /// Each edge of no face by itself, none for the other elements.
    pub wires: Lists,
    /// Connected component of each element.
    pub components: Vec<u32>,
    /// A vertex of each component.
    pub representatives: Vec<u32>,
}

const NOBODY: u32 = u32::MAX;

/// Deals vertices and edges out to elements. Cost: linear.
pub(super) fn own(primitives: &Primitives) -> Ownership {
    let (edges, faces) = (primitives.edges, primitives.faces);
    let corners = edges.iter().flatten().chain(faces.iter().flatten()).chain(primitives.vertices);
    let size = corners.max().map_or(0, |v| *v as usize + 1);
    let mut out = Ownership::default();

    let edge_owner = edge_owners(size, edges, faces);
    out.loose_edges = (0..edges.len() as u32).filter(|e| edge_owner[*e as usize] == NOBODY).collect();
    let mut edge_pairs: Vec<(u32, u32)> = Vec::with_capacity(edges.len());
    edge_pairs.extend(edge_owner.iter().zip(0..).filter(|(owner, _)| **owner != NOBODY).map(|(o, e)| (*o, e)));
    edge_pairs.extend(out.loose_edges.iter().zip(faces.len() as u32..).map(|(e, element)| (element, *e)));

    let mut vertex_owner = vec![NOBODY; size];
    let loose = out.loose_edges.iter().map(|e| edges[*e as usize].as_slice());
    for (element, corners) in faces.iter().map(|f| f.as_slice()).chain(loose).enumerate() {
        for v in corners {
            let owner = &mut vertex_owner[*v as usize];
            *owner = (*owner).min(element as u32);
        }
    }
    let mut taken = vec![false; size];
    let mut vertex_pairs: Vec<(u32, u32)> = Vec::with_capacity(primitives.vertices.len());
    let mut element = (faces.len() + out.loose_edges.len()) as u32;
    for v in primitives.vertices {
        if std::mem::replace(&mut taken[*v as usize], true) {
            continue;
        }
        match vertex_owner[*v as usize] {
            NOBODY => {
                out.loose_vertices.push(*v);
                vertex_pairs.push((element, *v));
                element += 1;
            }
            owner => vertex_pairs.push((owner, *v)),
        }
    }
    out.vertices = Lists::collect(element as usize, &vertex_pairs);
    out.edges = Lists::collect(element as usize, &edge_pairs);
    out.faces = Lists {
        offsets: (0..=element).map(|e| e.min(faces.len() as u32)).collect(),
        numbers: (0..faces.len() as u32).collect(),
    };
    let wires: Vec<(u32, u32)> =
        out.loose_edges.iter().copied().zip(faces.len() as u32..).map(|(e, element)| (element, e)).collect();
    out.wires = Lists::collect(element as usize, &wires);
    connect(&mut out, size, edges, faces);
    out
}

/// The first face that has each edge, or [`NOBODY`].
fn edge_owners(size: usize, edges: &[[u32; 2]], faces: &[[u32; 3]]) -> Vec<u32> {
    // Edges by their smaller vertex.
    let by_vertex: Vec<(u32, u32)> = edges.iter().zip(0..).map(|(e, number)| (e[0].min(e[1]), number)).collect();
    let at_vertex = Lists::collect(size, &by_vertex);
    let mut owner = vec![NOBODY; edges.len()];
    for (number, f) in faces.iter().enumerate() {
        for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
            let (low, high) = (a.min(b), a.max(b));
            for e in at_vertex.of(low) {
                let ends = edges[*e as usize];
                if ends[0].max(ends[1]) == high && owner[*e as usize] == NOBODY {
                    owner[*e as usize] = number as u32;
                    // A repeated edge goes to the next face that has it, or stands alone.
                    break;
                }
            }
        }
    }
    owner
}

/// Connected components through shared vertices, numbered in the order of the elements.
fn connect(out: &mut Ownership, size: usize, edges: &[[u32; 2]], faces: &[[u32; 3]]) {
    let mut parent: Vec<u32> = (0..size as u32).collect();
    let mut join = |corners: &[u32]| {
        let first = root(&mut parent, corners[0]);
        for v in &corners[1..] {
            let other = root(&mut parent, *v);
            parent[other as usize] = first;
        }
    };
    faces.iter().for_each(|f| join(f));
    edges.iter().for_each(|e| join(e));
    let mut number = vec![NOBODY; size];
    let loose = out.loose_edges.iter().map(|e| edges[*e as usize][0]);
    let firsts: Vec<u32> = faces.iter().map(|f| f[0]).chain(loose).chain(out.loose_vertices.iter().copied()).collect();
    for v in firsts {
        let top = root(&mut parent, v) as usize;
        if number[top] == NOBODY {
            number[top] = out.representatives.len() as u32;
            out.representatives.push(v);
        }
        out.components.push(number[top]);
    }
}

/// Root of a vertex, the path to it halved.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        let above = parent[parent[v as usize] as usize];
        parent[v as usize] = above;
        v = above;
    }
    v
}
