//! Snapshots of bodies that the library drives: their energies, and what tetrahedra carry.

use super::archive::{Archive, Sink, Source, archive_struct};
use crate::energy::{
    Attachment, CorotationalTetrahedron, Damping, Elements, FaceDrag, Forces, Hinge, Spring, TriangleMembrane,
};
use crate::mesh::Embedding;
use crate::model::Dynamics;
use crate::world::WorldError;
use std::sync::Arc;

archive_struct!(Embedding { nodes, weights });
archive_struct!(Spring { stiffness, rest_length });
archive_struct!(TriangleMembrane { volume, gradients, lambda, mu });
archive_struct!(CorotationalTetrahedron { volume, gradients, lambda, mu });
archive_struct!(Hinge { stiffness, rest_angle });
archive_struct!(Attachment { node, stiffness, damping });
archive_struct!(Damping { mass_rate, stretch_time, bending_time });
archive_struct!(FaceDrag { coefficient });
archive_struct!(Forces { springs, membranes, hinges, tetrahedra, attachments, drag_faces, drag, damping });

impl<S: Archive, const N: usize> Archive for Elements<S, N> {
    fn save(&self, out: &mut dyn Sink) {
        self.nodes.save(out);
        self.stencils.save(out);
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        Ok(Elements { nodes: Archive::load(source)?, stencils: Archive::load(source)? })
    }
}

impl Archive for Arc<Embedding> {
    fn save(&self, out: &mut dyn Sink) {
        self.as_ref().save(out);
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        Embedding::load(source).map(Arc::new)
    }
}

impl Archive for Arc<Dynamics> {
    fn save(&self, out: &mut dyn Sink) {
        match self.as_ref() {
            Dynamics::Deformable { forces, pattern } => {
                0u8.save(out);
                pattern.matrix.rows().save(out);
                forces.save(out);
            }
            Dynamics::Rigid { linear_damping, angular_damping } => {
                1u8.save(out);
                linear_damping.save(out);
                angular_damping.save(out);
            }
        }
    }

    fn load(source: &mut Source) -> Result<Self, WorldError> {
        let dynamics = match u8::load(source)? {
            0 => {
                let nodes = usize::load(source)?;
                let forces = Forces::load(source)?;
                // A node takes its mass and its position of the bytes: a number alone allocates no pattern.
                if nodes > source.remaining() {
                    return Err(source.mismatch("a body has more nodes than the snapshot bytes", nodes as f64));
                }
                Dynamics::deformable(forces, nodes)
                    .map_err(|(message, index, value)| source.mismatch(message, value).index(index))?
            }
            1 => Dynamics::Rigid { linear_damping: Archive::load(source)?, angular_damping: Archive::load(source)? },
            other => return Err(source.mismatch("a number names no kind of dynamics", f64::from(other))),
        };
        Ok(Arc::new(dynamics))
    }
}
