//! What a fail-safe moves as one: a node of a deformable body, a whole rigid body, or something scripted.

use crate::constraint::Metric;
use crate::contact_search::{Hit, Pair, PairKind};
use crate::model::{Kind, Model};

/// Nodes of a model: one per vertex and one per body. Vertices of rigid and posed bodies share their body's node, points
/// carried by tetrahedra stand for the nodes of their element, so that a zone owns every degree of freedom that its
/// bodies drive.
pub struct Nodes<'a> {
    model: &'a Model,
    scripted: Vec<bool>,
}

impl<'a> Nodes<'a> {
    /// Nodes of a model under a metric. Cost: linear in vertices and bodies.
    pub fn new(model: &'a Model, metric: &Metric) -> Nodes<'a> {
        let vertices = model.vertex_body.len();
        let mut scripted = vec![true; vertices + model.bodies.len()];
        for (index, body) in model.bodies.iter().enumerate() {
            match body.description.kind {
                Kind::Deformable { .. } => {
                    for (vertex, block) in body.nodes().zip(body.blocks.clone()) {
                        scripted[vertex] = metric.fixed[block];
                    }
                }
                Kind::Rigid { .. } => scripted[vertices + index] = metric.fixed[body.blocks.start],
                Kind::Kinematic { .. } | Kind::HalfSpace(_) => {}
            }
        }
        Nodes { model, scripted }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.scripted.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.scripted.is_empty()
    }

    /// Whether a node follows a script: a fail-safe cannot move it.
    pub fn is_scripted(&self, node: usize) -> bool {
        self.scripted[node]
    }

    /// Node of a body as a whole.
    pub fn of_body(&self, body: usize) -> usize {
        self.model.vertex_body.len() + body
    }

    /// The body behind a node, if the node is a whole body.
    pub fn body(&self, node: usize) -> Option<usize> {
        node.checked_sub(self.model.vertex_body.len())
    }

    /// Adds the nodes that move a vertex.
    fn push_of_vertex(&self, vertex: usize, nodes: &mut Vec<usize>) {
        let index = self.model.vertex_body[vertex] as usize;
        let body = &self.model.bodies[index];
        match body.description.kind {
            Kind::Rigid { .. } | Kind::Kinematic { posed: true } => nodes.push(self.of_body(index)),
            Kind::Deformable { .. } => {
                let first = body.nodes().start;
                nodes.extend(body.carriers(vertex).map(|(block, _)| first + block - body.blocks.start));
            }
            _ => nodes.push(vertex),
        }
    }

    /// Whether a fail-safe can move a node: it is no script, and not a vertex that others carry.
    pub fn is_movable(&self, node: usize) -> bool {
        let own = match self.body(node) {
            Some(body) => matches!(self.model.bodies[body].description.kind, Kind::Rigid { .. }),
            None => {
                let body = &self.model.bodies[self.model.vertex_body[node] as usize];
                matches!(body.description.kind, Kind::Deformable { .. }) && body.nodes().contains(&node)
            }
        };
        own && !self.scripted[node]
    }

    /// Nodes of a pair, sorted, without repeats.
    pub fn of_pair(&self, pair: &Pair) -> Vec<usize> {
        let mut nodes = Vec::with_capacity(4);
        if pair.kind == PairKind::VertexHalfSpace {
            self.push_of_vertex(pair.features[0] as usize, &mut nodes);
            nodes.push(self.of_body(pair.features[1] as usize));
        } else {
            pair.vertices(self.model).iter().for_each(|v| self.push_of_vertex(*v as usize, &mut nodes));
        }
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Whether every node of a hit is scripted or in the given set.
    pub fn all_within(&self, hit: &Hit, set: &[bool]) -> bool {
        self.of_pair(&hit.pair).iter().all(|n| set[*n] || self.scripted[*n])
    }

    /// First block of a movable node.
    pub fn first_block(&self, node: usize) -> usize {
        match self.body(node) {
            Some(body) => self.model.bodies[body].blocks.start,
            None => {
                let body = &self.model.bodies[self.model.vertex_body[node] as usize];
                body.blocks.start + node - body.nodes().start
            }
        }
    }

    /// Blocks of a movable node.
    pub fn blocks(&self, node: usize) -> std::ops::Range<usize> {
        let first = self.first_block(node);
        first..first + if self.body(node).is_some() { 2 } else { 1 }
    }
}
