//! Scene files and the runner (cargo feature `runner`).
//!
//! * `fault`: what is wrong with a scene file, with file, line and field
//! * `file`: the tables of a scene file
//! * `settings`: the table of settings
//! * `placement`: where bodies and their copies stand
//! * `mesh_source`: meshes from formulas and files
//! * `cage`: coarse tetrahedra around a surface
//! * `motion`: prescribed motion
//! * `build`: a world from a scene file
//! * `energy`: kinetic and elastic energy of its bodies
//! * `frames`: OBJ frames
//! * `subdivide`: finer frames
//! * `usd`: the animated cache
//! * `statistics`: a row per step, and what the rows come to
//! * `report`: the final line
//! * `run`: the loop

mod build;
mod cage;
mod energy;
mod fault;
mod file;
mod frames;
mod mesh_source;
mod motion;
mod placement;
mod report;
mod run;
mod settings;
mod statistics;
mod subdivide;
mod usd;

pub use fault::SceneFault;
pub use run::{Failure, Finished, Options, run};
