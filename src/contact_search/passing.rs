//! Tangled vertices: every pair that touches one passes.

/// The vertices of tangled components. Empty when the state is clean.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Passing {
    flags: Vec<bool>,
    count: usize,
}

impl Passing {
    /// Adds a vertex of a model with `total` vertices.
    pub fn insert(&mut self, vertex: u32, total: usize) {
        self.flags.resize(total, false);
        self.count += usize::from(!std::mem::replace(&mut self.flags[vertex as usize], true));
    }

    /// Whether no pair passes.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of tangled vertices.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether one of the vertices is tangled.
    #[inline]
    pub fn touches(&self, vertices: &[u32]) -> bool {
        self.count > 0 && vertices.iter().any(|v| self.flags[*v as usize])
    }
}
