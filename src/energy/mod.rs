//! Energies of a few nodes, with their forces and Hessians: what bodies are made of.
//!
//! * `stencil`: the trait of all of them
//! * `spring`: two nodes
//! * `triangle_membrane`: a triangle in its plane
//! * `discrete_shell`: the angle between two triangles
//! * `corotational_tetrahedron`: solids
//! * `target_spring`, `gravity`: one node
//! * `wind`: drag of a face
//! * `damping`: against still space, and within the material
//! * `forces`: all energies of one body
//! * `side_by_side`, `wide_shell`, `wide_tetrahedron`: four elements at a time
//! * `pattern`: which blocks of the matrix they fill
//! * `material`: physical units to energies and masses

mod corotational_tetrahedron;
mod damping;
mod discrete_shell;
mod forces;
mod gravity;
mod material;
mod pattern;
mod side_by_side;
mod spring;
mod stencil;
mod target_spring;
mod triangle_membrane;
mod wide_shell;
mod wide_tetrahedron;
mod wind;

pub use corotational_tetrahedron::{CorotationalTetrahedron, lame};
pub use damping::Damping;
pub use discrete_shell::Hinge;
pub use forces::{Attachment, Elements, Forces, ForcesFault};
pub use gravity::Gravity;
pub use material::{MaterialFault, SheetMaterial, SolidMaterial};
pub use pattern::{Part, Pattern, Places};
pub use side_by_side::{Block, LANES, SideBySide};
pub use spring::Spring;
pub use stencil::{Blocks, HessianForm, Stencil};
pub use target_spring::TargetSpring;
pub use triangle_membrane::TriangleMembrane;
pub use wind::FaceDrag;
