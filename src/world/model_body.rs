//! Bodies that the library drives (MODEL), and bodies of tetrahedra whoever drives them.

use super::body::{Body, BodyOptions, round_all};
use super::surface::surface;
use super::{Fault, Topology, World, WorldError};
use crate::energy::{Attachment, FaceDrag, Forces, MaterialFault, SheetMaterial, SolidMaterial, Spring};
use crate::math::{Vec3, ZERO, is_finite, norm, sub};
use crate::mesh::{Embedding, MeshError, TetMesh};
use crate::model::{Dynamics, Kind, Surface};
use std::sync::Arc;

/// How a sheet resists stretch and shear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SheetModel {
    /// Constant-strain membranes and hinges.
    Shell,
    /// Springs along the edges and across them; the ratio of the two stiffnesses.
    MassSpring {
        /// Stiffness of a spring across an edge over that of the edge's own.
        bend_ratio: f64,
    },
}

/// What acts on the nodes of a MODEL body besides its material.
#[derive(Clone, Debug, Default)]
pub struct NodeForces {
    /// Start velocities per node `[m/s]`; empty: zero.
    pub velocities: Vec<Vec3>,
    /// Nodes of infinite mass that follow their target positions; empty: none.
    pub pinned: Vec<bool>,
    /// Springs besides those of the material: ends and stiffness `[N/m]`, at rest at their rest distance.
    pub springs: Vec<([u32; 2], f64)>,
    /// Springs to targets, which start where the nodes start.
    pub attachments: Vec<Attachment>,
    /// Drag of a face: density of the air times drag coefficient over 2 `[kg/m^3]`.
    pub drag: f64,
}

/// Cloth or shell that the library drives.
#[derive(Clone, Debug)]
pub struct SheetDescription {
    /// What every kind of body has.
    pub options: BodyOptions,
    /// Start positions `[m]`.
    pub positions: Vec<Vec3>,
    /// Rest positions `[m]`; empty: the start positions.
    pub rest: Vec<Vec3>,
    /// What collides; its triangles are the sheet.
    pub topology: Topology,
    /// Material.
    pub material: SheetMaterial,
    /// How it stretches.
    pub model: SheetModel,
    /// What else acts on it.
    pub forces: NodeForces,
}

/// A solid of tetrahedra, with its own surface or one that it carries.
#[derive(Clone, Debug)]
pub struct SolidDescription {
    /// What every kind of body has.
    pub options: BodyOptions,
    /// Start positions of the nodes `[m]`.
    pub positions: Vec<Vec3>,
    /// Rest positions of the nodes `[m]`; empty: the start positions.
    pub rest: Vec<Vec3>,
    /// Elements, either orientation.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Points at rest and what of them collides; `None`: the boundary of the tetrahedra.
    pub embedded: Option<(Vec<Vec3>, Topology)>,
    /// Material; of a body that the host drives only the density is used.
    pub material: SolidMaterial,
    /// Whether the host drives the nodes.
    pub host_driven: bool,
    /// What else acts on it; of a body that the host drives only velocities and pins.
    pub forces: NodeForces,
}

impl World {
    /// Adds a sheet. Errors name the array index and the value; the world is then as it was.
    pub fn add_sheet(&mut self, description: SheetDescription) -> Result<u64, WorldError> {
        let SheetDescription { options, mut positions, rest, topology, material, model, forces } = description;
        let rest = rest_of(rest, &positions)?;
        if topology.triangles.is_empty() {
            return Err(WorldError::new(Fault::BadTopology, "a sheet needs triangles"));
        }
        round_all(&mut positions, options.precision, "start position")?;
        let surface = surface(rest, topology)?;
        let masses = material.lumped_masses(&surface.rest, &surface.faces).map_err(of_material)?;
        let made = match model {
            SheetModel::Shell => material.shell(&surface.rest, &surface.faces),
            SheetModel::MassSpring { bend_ratio } => material.mass_spring(&surface.rest, &surface.faces, bend_ratio),
        };
        let made = made.map_err(of_material)?;
        let faces = surface.faces.clone();
        let rest = surface.rest.clone();
        let scale = material.rest_scale;
        let mut body = deformable(&options, masses, &forces, surface, positions.clone())?;
        body.description.dynamics = Some(dynamics(made, &forces, (&rest, scale), faces)?);
        body.attachments = forces.attachments.iter().map(|a| positions[a.node as usize]).collect();
        self.insert(&options, body)
    }

    /// Adds a solid of tetrahedra. Errors as for a sheet.
    pub fn add_solid(&mut self, description: SolidDescription) -> Result<u64, WorldError> {
        let SolidDescription { options, mut positions, rest, tetrahedra, embedded, material, host_driven, forces } =
            description;
        let rest = rest_of(rest, &positions)?;
        round_all(&mut positions, options.precision, "start position")?;
        let mesh = TetMesh::new(rest, tetrahedra).map_err(of_mesh)?;
        let masses = {
            let probe =
                SolidMaterial { young_modulus: if host_driven { 1.0 } else { material.young_modulus }, ..material };
            probe.check().map_err(of_material)?;
            mesh.lumped_masses(material.density)
        };
        let boundary = mesh.boundary().map_err(of_mesh)?;
        let (surface, embedding) = match embedded {
            None => (mesh.surface().map_err(of_mesh)?, None),
            Some((points, topology)) => {
                let embedding = Embedding::new(&mesh, &points).map_err(of_mesh)?;
                let mut carried = surface(points, topology)?;
                carried.rest.extend_from_slice(&mesh.rest);
                (carried, Some(Arc::new(embedding)))
            }
        };
        let attached: Vec<Vec3> =
            forces.attachments.iter().map(|a| positions.get(a.node as usize).copied().unwrap_or(ZERO)).collect();
        let placed = with_points(embedding.as_deref(), positions, options.precision);
        let mut body = deformable(&options, masses, &forces, surface, placed)?;
        body.description.embedding = embedding;
        if !host_driven {
            let made = material.solid(&mesh).map_err(of_material)?;
            body.description.dynamics = Some(dynamics(made, &forces, (&mesh.rest, material.rest_scale), boundary)?);
            body.attachments = attached;
        }
        self.insert(&options, body)
    }

    /// Sets the acceleration of gravity on the bodies that the library drives `[m/s^2]`; zero at first.
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<(), WorldError> {
        self.gravity = finite(gravity, "gravity")?;
        Ok(())
    }

    /// Sets the velocity of the air around the bodies that the library drives `[m/s]`; zero at first.
    pub fn set_wind(&mut self, wind: Vec3) -> Result<(), WorldError> {
        self.wind = finite(wind, "wind")?;
        Ok(())
    }
}

fn finite(v: Vec3, what: &str) -> Result<Vec3, WorldError> {
    match v.iter().position(|c| !c.is_finite()) {
        Some(i) => Err(WorldError::new(Fault::NonFinite, format!("the {what} is not finite")).index(i).value(v[i])),
        None => Ok(v),
    }
}

fn rest_of(rest: Vec<Vec3>, positions: &[Vec3]) -> Result<Vec<Vec3>, WorldError> {
    if rest.is_empty() {
        return Ok(positions.to_vec());
    }
    if rest.len() == positions.len() {
        return Ok(rest);
    }
    let message = format!("{} rest positions for {} nodes", rest.len(), positions.len());
    Err(WorldError::new(Fault::BufferLayout, message).value(rest.len() as f64))
}

/// Positions of the embedded points, if any, before those of the nodes.
pub(super) fn with_points(
    embedding: Option<&Embedding>,
    nodes: Vec<Vec3>,
    precision: crate::model::Precision,
) -> Vec<Vec3> {
    let Some(embedding) = embedding else { return nodes };
    let single = precision == crate::model::Precision::Single;
    let place = |i| embedding.place(i, &nodes);
    let round = |x: Vec3| if single { crate::kinematics::rounded_to_single(x) } else { x };
    let mut all: Vec<Vec3> = (0..embedding.len()).map(|i| round(place(i))).collect();
    all.extend(nodes);
    all
}

fn deformable(
    options: &BodyOptions,
    masses: Vec<f64>,
    forces: &NodeForces,
    surface: Surface,
    positions: Vec<Vec3>,
) -> Result<Body, WorldError> {
    let count = masses.len();
    for (what, given) in [("start velocities", forces.velocities.len()), ("pin flags", forces.pinned.len())] {
        if given != 0 && given != count {
            let message = format!("{given} {what} for {count} nodes");
            return Err(WorldError::new(Fault::BufferLayout, message).value(given as f64));
        }
    }
    if let Some(i) = forces.velocities.iter().position(|v| !is_finite(*v)) {
        return Err(WorldError::new(Fault::NonFinite, "a start velocity is not finite").index(i));
    }
    let pinned = if forces.pinned.is_empty() { vec![false; count] } else { forces.pinned.clone() };
    let mut body = Body::new(options, Kind::Deformable { masses, pinned }, surface);
    body.velocities = if forces.velocities.is_empty() { vec![ZERO; count] } else { forces.velocities.clone() };
    body.positions = positions;
    Ok(body)
}

fn dynamics(
    mut made: Forces,
    forces: &NodeForces,
    (rest, rest_scale): (&[Vec3], f64),
    faces: Vec<[u32; 3]>,
) -> Result<Arc<Dynamics>, WorldError> {
    for (ends, stiffness) in &forces.springs {
        let [a, b] = ends.map(|v| rest.get(v as usize).copied().unwrap_or(ZERO));
        made.springs.push(*ends, Spring { stiffness: *stiffness, rest_length: rest_scale * norm(sub(b, a)) });
    }
    made.attachments = forces.attachments.clone();
    made.drag = FaceDrag { coefficient: forces.drag };
    made.drag_faces = if forces.drag > 0.0 { faces } else { Vec::new() };
    Dynamics::deformable(made, rest.len()).map(Arc::new).map_err(of_material)
}

fn of_material((message, index, value): MaterialFault) -> WorldError {
    let fault = if value.is_finite() { Fault::InvalidArgument } else { Fault::NonFinite };
    WorldError::new(fault, message).index(index).value(value)
}

fn of_mesh(error: MeshError) -> WorldError {
    let fault = if error.value.is_nan() || error.value.is_infinite() { Fault::NonFinite } else { Fault::BadTopology };
    WorldError::new(fault, error.message).index(error.index).value(error.value)
}
