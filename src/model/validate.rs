//! Checks of descriptions: what cannot be built, with key, index and value.

use super::{BodyDescription, BuildError, Dynamics, Kind, Materials, Surface, SystemDescription};
use crate::math::{determinant, is_finite, is_positive_definite, norm_squared};

fn fail(body: u64, index: usize, value: f64, message: &'static str) -> Result<(), BuildError> {
    Err(BuildError { body, index, value, message })
}

/// Checks all descriptions of a model; bodies sorted by key.
pub(super) fn check(
    bodies: &[BodyDescription],
    materials: &Materials,
    systems: &[SystemDescription],
) -> Result<(), BuildError> {
    for (i, material) in materials.list.iter().enumerate() {
        let mu = material.friction_coefficient;
        if !(mu.is_finite() && mu >= 0.0) {
            return fail(0, i, mu, "friction coefficient is negative or not finite");
        }
    }
    for (i, body) in bodies.iter().enumerate() {
        if body.key == 0 || (i > 0 && bodies[i - 1].key == body.key) {
            return fail(body.key, i, 0.0, "body keys must be unique and not 0");
        }
        if body.material as usize >= materials.list.len() {
            return fail(body.key, 0, f64::from(body.material), "no such material");
        }
        if let Some(h) = body.half_thickness
            && !(h.is_finite() && h >= 0.0)
        {
            return fail(body.key, 0, h, "half thickness is negative or not finite");
        }
        check_surface(body.key, &body.surface)?;
        check_kind(body)?;
    }
    let mut claimed = vec![false; bodies.len()];
    for (i, system) in systems.iter().enumerate() {
        check_system(bodies, system, i, &mut claimed)?;
    }
    Ok(())
}

fn check_surface(key: u64, surface: &Surface) -> Result<(), BuildError> {
    let count = surface.rest.len();
    if let Some(i) = surface.rest.iter().position(|x| !is_finite(*x)) {
        return fail(key, i, f64::NAN, "rest position is not finite");
    }
    if let Some(i) = surface.vertices.iter().position(|v| *v as usize >= count) {
        return fail(key, i, f64::from(surface.vertices[i]), "contact vertex out of range");
    }
    for (i, e) in surface.edges.iter().enumerate() {
        if e[0] >= e[1] || e[1] as usize >= count {
            return fail(key, i, f64::from(e[1]), "edge out of range or not ordered");
        }
    }
    for (i, f) in surface.faces.iter().enumerate() {
        if f[0] == f[1] || f[1] == f[2] || f[2] == f[0] || f.iter().any(|v| *v as usize >= count) {
            return fail(key, i, f64::from(f[0]), "face out of range or with a repeated vertex");
        }
    }
    Ok(())
}

fn check_kind(body: &BodyDescription) -> Result<(), BuildError> {
    let carried = body.embedding.as_ref().map_or(0, |e| e.len());
    let count = body.surface.rest.len().saturating_sub(carried);
    check_dynamics(body, count)?;
    match &body.kind {
        Kind::Deformable { masses, pinned } => {
            if masses.len() != count || pinned.len() != count {
                return fail(body.key, masses.len(), count as f64, "one mass and one pin flag per node");
            }
            if let Some(embedding) = &body.embedding
                && let Some(i) = embedding.nodes.iter().position(|n| n.iter().any(|n| *n as usize >= count))
            {
                return fail(body.key, i, f64::from(embedding.nodes[i][0]), "an embedded point names no node");
            }
            match masses.iter().position(|m| !(m.is_finite() && *m > 0.0)) {
                Some(i) => fail(body.key, i, masses[i], "mass is not positive and finite"),
                None => Ok(()),
            }
        }
        Kind::Rigid { mass, inertia } => {
            if mass.is_nan() || *mass <= 0.0 {
                return fail(body.key, 0, *mass, "mass is not positive");
            }
            let symmetric = (0..3).all(|i| (0..3).all(|j| inertia[i][j] == inertia[j][i]));
            let infinite = mass.is_infinite() || (0..3).any(|i| inertia[i][i] == f64::INFINITY);
            if !(infinite || symmetric && is_positive_definite(inertia)) {
                return fail(body.key, 0, determinant(inertia), "inertia is not symmetric positive definite");
            }
            Ok(())
        }
        Kind::Kinematic { .. } => Ok(()),
        Kind::HalfSpace(h) => {
            let length = norm_squared(h.normal);
            if !((length - 1.0).abs() < 1e-6 && h.offset.is_finite()) {
                return fail(body.key, 0, length, "half-space normal is not a unit vector");
            }
            Ok(())
        }
    }
}

/// Dynamics and embedding fit the kind of the body.
fn check_dynamics(body: &BodyDescription, count: usize) -> Result<(), BuildError> {
    let deformable = matches!(body.kind, Kind::Deformable { .. });
    if body.embedding.is_some() && !deformable {
        return fail(body.key, 0, 0.0, "only deformable bodies have embedded points");
    }
    let fits = match (body.dynamics.as_deref(), &body.kind) {
        (None, _) => true,
        (Some(Dynamics::Deformable { pattern, .. }), Kind::Deformable { .. }) => pattern.matrix.rows() == count,
        (Some(Dynamics::Rigid { linear_damping, angular_damping }), Kind::Rigid { .. }) => {
            [linear_damping, angular_damping].iter().all(|d| **d >= 0.0 && d.is_finite())
        }
        _ => false,
    };
    if fits { Ok(()) } else { fail(body.key, 0, count as f64, "the dynamics do not fit the body") }
}

fn check_system(
    bodies: &[BodyDescription],
    system: &SystemDescription,
    index: usize,
    claimed: &mut [bool],
) -> Result<(), BuildError> {
    let mut rows = 0;
    for key in &system.bodies {
        let Ok(at) = bodies.binary_search_by_key(key, |b| b.key) else {
            return fail(*key, index, 0.0, "system names an unknown body");
        };
        if std::mem::replace(&mut claimed[at], true) {
            return fail(*key, index, 0.0, "body is in more than one system");
        }
        if matches!(bodies[at].dynamics.as_deref(), Some(Dynamics::Deformable { .. })) {
            return fail(*key, index, 0.0, "a deformable body that the library drives has its own matrix");
        }
        rows += match &bodies[at].kind {
            Kind::Deformable { masses, .. } => masses.len(),
            Kind::Rigid { .. } => 2,
            Kind::Kinematic { .. } | Kind::HalfSpace(_) => {
                return fail(*key, index, 0.0, "a scripted body has no rows in a system");
            }
        };
    }
    let offsets = &system.row_offsets;
    if offsets.len() != rows + 1 || offsets[0] != 0 || offsets[rows] != system.columns.len() {
        return fail(0, index, offsets.len() as f64, "row offsets do not fit the bodies of the system");
    }
    for row in 0..rows {
        if offsets[row] > offsets[row + 1] || offsets[row + 1] > system.columns.len() {
            return fail(0, row, offsets[row] as f64, "row offsets are not ascending");
        }
        let columns = &system.columns[offsets[row]..offsets[row + 1]];
        let sorted = columns.windows(2).all(|w| w[0] < w[1]);
        let in_range = columns.last().is_none_or(|c| (*c as usize) < rows);
        let first = if system.upper { columns.first() == Some(&(row as u32)) } else { true };
        if !(sorted && in_range && first && columns.binary_search(&(row as u32)).is_ok()) {
            return fail(0, row, 0.0, "system row: columns ascending, in range, diagonal present");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Material, Model};
    use std::sync::Arc;

    fn body(key: u64, mass: f64) -> BodyDescription {
        BodyDescription {
            key,
            surface: Arc::new(Surface { rest: vec![[0.0; 3]], vertices: vec![0], ..Surface::default() }),
            kind: Kind::Deformable { masses: vec![mass], pinned: vec![false] },
            half_thickness: Some(0.1),
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: false,
            precision: Default::default(),
            embedding: None,
            dynamics: None,
        }
    }

    fn build(bodies: Vec<BodyDescription>, systems: Vec<SystemDescription>) -> Result<Model, BuildError> {
        let material = Material { friction_coefficient: 0.5, combine_rule: Default::default(), restitution: 0.0 };
        Model::build(bodies, Materials { list: vec![material], overrides: vec![] }, systems)
    }

    #[test]
    fn faults_are_named_with_key_index_and_value() {
        assert!(build(vec![body(2, 1.0), body(1, 1.0)], vec![]).is_ok());
        let error = build(vec![body(2, 1.0), body(1, -4.0)], vec![]).err();
        assert_eq!(error.map(|e| (e.body, e.index, e.value)), Some((1, 0, -4.0)));
        assert!(build(vec![body(1, 1.0), body(1, 1.0)], vec![]).is_err());
        assert!(build(vec![body(1, f64::NAN)], vec![]).is_err());
        let mut stray = body(1, 1.0);
        stray.material = 3;
        assert!(build(vec![stray], vec![]).is_err());
        let mut thick = body(1, 1.0);
        thick.half_thickness = Some(f64::NAN);
        assert!(build(vec![thick], vec![]).is_err());
    }

    #[test]
    fn systems_must_fit_their_bodies() {
        let system = |columns: Vec<u32>| SystemDescription {
            bodies: vec![1],
            row_offsets: vec![0, columns.len()],
            columns,
            upper: false,
        };
        assert!(build(vec![body(1, 1.0)], vec![system(vec![0])]).is_ok());
        assert!(build(vec![body(1, 1.0)], vec![system(vec![])]).is_err());
        assert!(build(vec![body(1, 1.0)], vec![system(vec![1])]).is_err());
        assert!(build(vec![body(1, 1.0)], vec![system(vec![0]), system(vec![0])]).is_err());
        assert!(build(vec![body(3, 1.0)], vec![system(vec![0])]).is_err());
    }
}
