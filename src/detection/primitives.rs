//! The collision primitives of a whole model, and candidate pairs.

/// Borrowed collision primitives: vertex indices that take part, edges, faces.
#[derive(Clone, Copy)]
pub struct Primitives<'a> {
    /// Vertices that take part in contact.
    pub vertices: &'a [u32],
    /// Edges.
    pub edges: &'a [[u32; 2]],
    /// Triangles.
    pub faces: &'a [[u32; 3]],
}

/// Candidate pairs, each list sorted and without repeats: a stable order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Candidates {
    /// `[vertex index, face number]`
    pub vertex_face: Vec<[u32; 2]>,
    /// `[edge number, edge number]`, smaller first.
    pub edge_edge: Vec<[u32; 2]>,
    /// `[edge number, face number]`, for the intersection certificate.
    pub edge_face: Vec<[u32; 2]>,
}
