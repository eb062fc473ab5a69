//! Which blocks of a body's matrix its energies fill.

use super::{Elements, Forces, Stencil};
use crate::linalg::{BlockMatrix, Envelope};
use std::ops::Range;

/// Nodes of a part at least, and parts at most: what is shared by two parts is computed in both.
const PART_NODES: usize = 1024;
const PARTS_MAX: usize = 8;

/// Parts that take more than this many quarters of the work of the whole are not worth it.
const QUARTERS_MAX: usize = 5;

/// Places of a stencil's blocks among the values of the matrix.
pub type Places<const N: usize> = [[u32; N]; N];

/// Block pattern of a body over its nodes, and where every energy adds. Depends on the topology alone: made once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pattern {
    /// The matrix, of zeros.
    pub matrix: BlockMatrix,
    /// The envelope of its direct factor.
    pub envelope: Envelope,
    /// Places of the springs' blocks.
    pub springs: Vec<Places<2>>,
    /// Places of the membranes' blocks.
    pub membranes: Vec<Places<3>>,
    /// Places of the hinges' blocks.
    pub hinges: Vec<Places<4>>,
    /// Places of the solids' blocks.
    pub tetrahedra: Vec<Places<4>>,
    /// Places of the blocks of faces in the wind.
    pub drag: Vec<Places<3>>,
    /// All rows.
    pub whole: Part,
    /// The same rows for several threads; the whole alone where nodes that lie next to each other are numbered far apart.
    pub parts: Vec<Part>,
}

/// Consecutive rows of the matrix, and the stencils that add to them, ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Nodes of the rows.
    pub nodes: Range<usize>,
    /// Springs.
    pub springs: Vec<u32>,
    /// Membranes.
    pub membranes: Vec<u32>,
    /// Hinges.
    pub hinges: Vec<u32>,
    /// Solids.
    pub tetrahedra: Vec<u32>,
}

impl Part {
    /// The rows of these nodes.
    fn new(forces: &Forces, nodes: Range<usize>) -> Part {
        fn touching<const N: usize>(stencils: &[[u32; N]], rows: &Range<usize>) -> Vec<u32> {
            let touches = |nodes: &[u32; N]| nodes.iter().any(|node| rows.contains(&(*node as usize)));
            (0..).zip(stencils).filter(|(_, nodes)| touches(nodes)).map(|(number, _)| number).collect()
        }
        Part {
            springs: touching(&forces.springs.nodes, &nodes),
            membranes: touching(&forces.membranes.nodes, &nodes),
            hinges: touching(&forces.hinges.nodes, &nodes),
            tetrahedra: touching(&forces.tetrahedra.nodes, &nodes),
            nodes,
        }
    }

    /// Stencils.
    fn work(&self) -> usize {
        self.springs.len() + self.membranes.len() + self.hinges.len() + self.tetrahedra.len()
    }
}

impl Pattern {
    /// The pattern of `forces` over `count` nodes. Node numbers in range ([`Forces::fault`]). Cost: a sort of the pairs.
    pub fn new(forces: &Forces, count: usize) -> Pattern {
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        add_pairs(&forces.springs.nodes, &mut pairs);
        add_pairs(&forces.membranes.nodes, &mut pairs);
        add_pairs(&forces.hinges.nodes, &mut pairs);
        add_pairs(&forces.tetrahedra.nodes, &mut pairs);
        add_pairs(&forces.drag_faces, &mut pairs);
        let matrix = BlockMatrix::from_places(count, pairs);
        let mut pattern = Pattern { matrix, ..Pattern::default() };
        pattern.envelope = Envelope::new(&pattern.matrix);
        pattern.springs = pattern.places(&forces.springs);
        pattern.membranes = pattern.places(&forces.membranes);
        pattern.hinges = pattern.places(&forces.hinges);
        pattern.tetrahedra = pattern.places(&forces.tetrahedra);
        pattern.drag = forces.drag_faces.iter().map(|nodes| pattern.places_of(nodes)).collect();
        pattern.whole = Part::new(forces, 0..count);
        let parts = (count / PART_NODES).clamp(1, PARTS_MAX);
        let part = |i: usize| Part::new(forces, i * count / parts..(i + 1) * count / parts);
        pattern.parts = (0..parts).map(part).collect();
        if 4 * pattern.parts.iter().map(Part::work).sum::<usize>() > QUARTERS_MAX * pattern.whole.work() {
            pattern.parts = vec![pattern.whole.clone()];
        }
        pattern
    }

    fn places_of<const N: usize>(&self, nodes: &[u32; N]) -> Places<N> {
        nodes.map(|row| nodes.map(|column| self.matrix.place(row, column) as u32))
    }

    fn places<S: Stencil<N>, const N: usize>(&self, elements: &Elements<S, N>) -> Vec<Places<N>> {
        elements.nodes.iter().map(|nodes| self.places_of(nodes)).collect()
    }
}

fn add_pairs<const N: usize>(stencils: &[[u32; N]], pairs: &mut Vec<(u32, u32)>) {
    for nodes in stencils {
        for a in nodes {
            pairs.extend(nodes.iter().filter(|b| *b != a).map(|b| (*a, *b)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::Spring;

    #[test]
    fn rows_are_sorted_hold_the_diagonal_and_places_agree() {
        let mut forces = Forces { drag_faces: vec![[3, 1, 0]], ..Forces::default() };
        forces.springs.push([2, 0], Spring { stiffness: 1.0, rest_length: 1.0 });
        let pattern = Pattern::new(&forces, 5);
        assert_eq!(pattern.matrix.row_offsets, [0, 4, 7, 9, 12, 13]);
        assert_eq!(pattern.matrix.columns, [0, 1, 2, 3, 0, 1, 3, 0, 2, 0, 1, 3, 4]);
        assert_eq!(pattern.matrix.diagonal, [0, 5, 8, 11, 12]);
        assert_eq!(pattern.springs, [[[8, 7], [2, 0]]]);
        assert_eq!(pattern.drag[0][0], [11, 10, 9]);
    }
}
