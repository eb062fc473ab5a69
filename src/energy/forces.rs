//! All energies of one body, over its nodes.

use super::{CorotationalTetrahedron, Damping, FaceDrag, Hinge, Spring, Stencil, TriangleMembrane};
use crate::math::{Vec3, add};

/// Stencils of one kind with the nodes they act on.
#[derive(Clone, Debug, PartialEq)]
pub struct Elements<S, const N: usize> {
    /// Nodes of each stencil.
    pub nodes: Vec<[u32; N]>,
    /// The stencils.
    pub stencils: Vec<S>,
}

impl<S, const N: usize> Default for Elements<S, N> {
    fn default() -> Self {
        Elements { nodes: Vec::new(), stencils: Vec::new() }
    }
}

impl<S: Stencil<N>, const N: usize> Elements<S, N> {
    /// Adds a stencil.
    pub fn push(&mut self, nodes: [u32; N], stencil: S) {
        self.nodes.push(nodes);
        self.stencils.push(stencil);
    }

    /// Number of stencils.
    pub fn len(&self) -> usize {
        self.stencils.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.stencils.is_empty()
    }

    /// Positions of the nodes of stencil `i`.
    #[inline]
    pub fn gather(&self, i: usize, x: &[Vec3]) -> [Vec3; N] {
        self.nodes[i].map(|node| x[node as usize])
    }

    /// Sum of the energies `[J]`.
    pub fn energy(&self, x: &[Vec3]) -> f64 {
        (0..self.len()).map(|i| self.stencils[i].energy(&self.gather(i, x))).sum()
    }

    /// Adds the forces to `out` `[N]`, in the order of the stencils.
    pub fn add_forces(&self, x: &[Vec3], out: &mut [Vec3]) {
        for i in 0..self.len() {
            let forces = self.stencils[i].force(&self.gather(i, x));
            for (node, f) in self.nodes[i].iter().zip(forces) {
                out[*node as usize] = add(out[*node as usize], f);
            }
        }
    }

    fn fault(&self, count: usize) -> Option<(usize, u32)> {
        let bad = |nodes: &[u32; N], k: usize| nodes[k] as usize >= count || nodes[..k].contains(&nodes[k]);
        let at = |(i, nodes): (usize, &[u32; N])| (0..N).find(|k| bad(nodes, *k)).map(|k| (i, nodes[k]));
        self.nodes.iter().enumerate().find_map(at)
    }
}

/// A node tied by a spring to a point that the host moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// The node.
    pub node: u32,
    /// Stiffness `[N/m]`.
    pub stiffness: f64,
    /// Damping against the target as if it stood still `[N s/m]`.
    pub damping: f64,
}

/// What acts within a deformable body, and on it from outside, besides gravity and contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forces {
    /// Springs.
    pub springs: Elements<Spring, 2>,
    /// Membranes.
    pub membranes: Elements<TriangleMembrane, 3>,
    /// Hinges.
    pub hinges: Elements<Hinge, 4>,
    /// Solids.
    pub tetrahedra: Elements<CorotationalTetrahedron, 4>,
    /// Springs to targets.
    pub attachments: Vec<Attachment>,
    /// Faces that feel the wind.
    pub drag_faces: Vec<[u32; 3]>,
    /// Their drag.
    pub drag: FaceDrag,
    /// Damping.
    pub damping: Damping,
}

/// Finite and not negative.
fn good(value: f64) -> bool {
    value >= 0.0 && value.is_finite()
}

/// Something that does not fit: what, place and value.
pub type ForcesFault = (&'static str, usize, f64);

impl Forces {
    /// Elastic energy of springs, membranes, hinges and solids at `x` `[J]`.
    pub fn elastic_energy(&self, x: &[Vec3]) -> f64 {
        self.springs.energy(x) + self.membranes.energy(x) + self.hinges.energy(x) + self.tetrahedra.energy(x)
    }

    /// Adds the elastic forces at `x` to `out` `[N]`.
    pub fn add_elastic_forces(&self, x: &[Vec3], out: &mut [Vec3]) {
        self.springs.add_forces(x, out);
        self.membranes.add_forces(x, out);
        self.hinges.add_forces(x, out);
        self.tetrahedra.add_forces(x, out);
    }

    /// Counts that do not agree, material numbers out of range.
    fn stencil_fault(&self) -> Option<ForcesFault> {
        let counts = [
            (self.springs.nodes.len(), self.springs.len()),
            (self.membranes.nodes.len(), self.membranes.len()),
            (self.hinges.nodes.len(), self.hinges.len()),
            (self.tetrahedra.nodes.len(), self.tetrahedra.len()),
        ];
        if let Some((nodes, stencils)) = counts.iter().find(|(nodes, stencils)| nodes != stencils) {
            return Some(("as many stencils as lists of nodes are needed", *nodes, *stencils as f64));
        }
        let elastic = |volume: f64, moduli: [f64; 2], gradients: &[f64]| {
            good(volume) && moduli.into_iter().all(good) && gradients.iter().all(|g| g.is_finite())
        };
        let m = self.membranes.stencils.iter();
        let membrane = m.enumerate().find(|(_, m)| !elastic(m.volume, [m.lambda, m.mu], m.gradients.as_flattened()));
        let t = self.tetrahedra.stencils.iter();
        let solid = t.enumerate().find(|(_, t)| !elastic(t.volume, [t.lambda, t.mu], t.gradients.as_flattened()));
        let h = self.hinges.stencils.iter();
        let hinge = h.enumerate().find(|(_, h)| !(good(h.stiffness) && h.rest_angle.is_finite()));
        let found = membrane.map(|(i, m)| (i, m.mu)).or(solid.map(|(i, t)| (i, t.mu)));
        let (i, value) = found.or(hinge.map(|(i, h)| (i, h.stiffness)))?;
        Some(("a material number of an energy is out of range", i, value))
    }

    /// What does not fit a body of `count` nodes, if anything.
    pub fn fault(&self, count: usize) -> Option<ForcesFault> {
        let stencil = |found: Option<(usize, u32)>| {
            let message = "an energy names a node that does not exist, or one twice";
            found.map(|(i, node)| (message, i, f64::from(node)))
        };
        stencil(self.springs.fault(count))
            .or_else(|| stencil(self.membranes.fault(count)))
            .or_else(|| stencil(self.hinges.fault(count)))
            .or_else(|| stencil(self.tetrahedra.fault(count)))
            .or_else(|| self.stencil_fault())
            .or_else(|| {
                let (list, message) =
                    (&self.springs.stencils, "a spring's stiffness and rest length are finite and not negative");
                let i = list.iter().position(|s| !(good(s.stiffness) && good(s.rest_length)))?;
                Some((message, i, if good(list[i].stiffness) { list[i].rest_length } else { list[i].stiffness }))
            })
            .or_else(|| {
                let message =
                    "an attachment needs an existing node, a stiffness and damping that are finite and not negative";
                let bad = |a: &Attachment| a.node as usize >= count || !good(a.stiffness) || !good(a.damping);
                let i = self.attachments.iter().position(bad)?;
                let a = self.attachments[i];
                let value = [a.stiffness, a.damping].into_iter().find(|v| !good(*v)).unwrap_or(f64::from(a.node));
                Some((message, i, value))
            })
            .or_else(|| {
                let bad = |f: &[u32; 3]| f.iter().any(|v| *v as usize >= count);
                let i = self.drag_faces.iter().position(bad)?;
                Some(("a face in the wind names a node that does not exist", i, f64::from(self.drag_faces[i][0])))
            })
            .or_else(|| {
                let value = self.damping.fault().or_else(|| Some(self.drag.coefficient).filter(|c| !good(*c)))?;
                Some(("damping and drag are finite and not negative", 0, value))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_named() {
        let mut forces = Forces::default();
        forces.springs.push([0, 1], Spring { stiffness: 1.0, rest_length: 1.0 });
        forces.attachments.push(Attachment { node: 2, stiffness: 1.0, damping: 0.0 });
        assert_eq!(forces.fault(3), None);
        assert_eq!(forces.fault(2).map(|f| (f.1, f.2)), Some((0, 2.0)));
        forces.springs.push([1, 1], Spring { stiffness: 1.0, rest_length: 1.0 });
        assert_eq!(forces.fault(3).map(|f| (f.1, f.2)), Some((1, 1.0)));
        forces.springs.nodes[1] = [1, 2];
        forces.springs.stencils[1].rest_length = f64::NAN;
        assert!(forces.fault(3).is_some_and(|f| f.1 == 1 && f.2.is_nan()));
        forces.springs.stencils[1].rest_length = 0.0;
        forces.damping.bending_time = -2.0;
        assert_eq!(forces.fault(3).map(|f| f.2), Some(-2.0));
    }
}
