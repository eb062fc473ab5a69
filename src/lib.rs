//! Signorini: implicit contact for cloth, shells, soft bodies and rigid bodies, as a plug-in with a C ABI.
//!
//! A host keeps its own world. It pushes start states and unconstrained velocities, asks for a step, and pulls
//! velocities and end states that drive nothing through anything else. The unilateral contact condition
//! `0 <= lambda  perp  gap >= 0` gives the library its name.
//!
//! | module | what it holds |
//! |---|---|
//! | [`parallel`] | serial and pooled drivers with the same bits on any number of threads |
//! | [`math`] | vectors, roots, exact predicates |
//! | [`geometry`] | closest points of primitive pairs, bounding volumes |
//! | [`linalg`] | 3x3 block-sparse matrices, relaxation, conjugate gradients |
//! | [`mesh`] | triangle meshes, shapes, validation |
//! | [`energy`] | springs, membranes, shells, solids: energies with their forces and Hessians |
//! | [`detection`] | broad phase, proximity, continuous detection, intersection certificate |
//! | [`kinematics`] | poses and the map from degrees of freedom to vertices |
//! | [`model`] | model, state, settings, reports |
//! | [`dynamics`] | assembly and the unconstrained step of the bodies that the library drives |
//! | [`contact_search`] | contacts with body ids and persistent keys |
//! | [`constraint`] | contacts as rows over the degrees of freedom |
//! | [`fail_safe`] | zones (projections, rigid zones) and hold |
//! | [`step`] | the stages of a step that every method shares |
//! | [`implicit_contact`] | constraint manifold refinement around iterative constraint anticipation |
//! | [`velocity_filter`] | repulsions, impulses, zones |
//! | [`world`] | bodies by id, the step, queries |
//! | [`capi`] | the C ABI |
//! | `scene` | scene files and the runner, with the cargo feature `runner` |
//!
//! Units are the host's: lengths `[m]`, time `[s]`, mass `[kg]` stand for whatever consistent set the host uses.
//! No tolerance is absolute.

pub mod capi;
pub mod constraint;
pub mod contact_search;
pub mod detection;
pub mod dynamics;
pub mod energy;
pub mod fail_safe;
pub mod geometry;
pub mod implicit_contact;
pub mod kinematics;
pub mod linalg;
pub mod math;
pub mod mesh;
pub mod model;
pub mod parallel;
#[cfg(feature = "runner")]
pub mod scene;
pub mod step;
pub mod velocity_filter;
pub mod world;
