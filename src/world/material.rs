//! Materials of a world.

use super::{Fault, World, WorldError, ids};
use crate::model::{CombineRule, Material, Materials};

/// What bodies without a material have: no friction against anything.
const FRICTIONLESS: Material =
    Material { friction_coefficient: 0.0, combine_rule: CombineRule::Product, restitution: 0.0 };

fn check(material: &Material) -> Result<(), WorldError> {
    checked_friction(material.friction_coefficient)?;
    let restitution = material.restitution;
    if !restitution.is_finite() {
        return Err(
            WorldError::new(Fault::NonFinite, "the coefficient of restitution is not finite").value(restitution)
        );
    }
    if !(0.0..=1.0).contains(&restitution) {
        let message = format!("the coefficient of restitution {restitution} is not in 0 to 1");
        return Err(WorldError::new(Fault::InvalidArgument, message).value(restitution));
    }
    Ok(())
}

fn checked_friction(friction: f64) -> Result<f64, WorldError> {
    if !friction.is_finite() {
        return Err(WorldError::new(Fault::NonFinite, "the friction coefficient is not finite").value(friction));
    }
    if friction < 0.0 {
        let message = "the friction coefficient must not be negative";
        return Err(WorldError::new(Fault::InvalidArgument, message).value(friction));
    }
    Ok(friction)
}

impl World {
    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> Result<u64, WorldError> {
        check(&material)?;
        let id = self.materials.insert_with(|_| Ok(material))?;
        self.model_current = false;
        Ok(id)
    }

    /// Changes a material.
    pub fn set_material_values(&mut self, id: u64, material: Material) -> Result<(), WorldError> {
        check(&material)?;
        *self.materials.get_mut(id)? = material;
        self.model_current = false;
        Ok(())
    }

    /// Sets the friction coefficient between two materials (or of one with itself), whatever their combine rules say;
    /// 0 stands for the material of bodies without one.
    pub fn set_pair_friction(&mut self, a: u64, b: u64, friction: f64) -> Result<(), WorldError> {
        checked_friction(friction)?;
        let (a, b) = (self.materials.key_of(a)?, self.materials.key_of(b)?);
        let pair = (a.min(b), a.max(b));
        match self.overrides.binary_search_by(|o| (o.0, o.1).cmp(&pair)) {
            Ok(found) => self.overrides[found].2 = friction,
            Err(place) => self.overrides.insert(place, (pair.0, pair.1, friction)),
        }
        self.model_current = false;
        Ok(())
    }

    /// The model's materials and their keys; index 0 is that of bodies without one, then those of the world in the order
    /// of slots.
    pub(super) fn model_materials(&self) -> (Materials, Vec<u64>) {
        let mut keys = vec![0];
        let mut list = vec![FRICTIONLESS];
        for (id, material) in self.materials.iter() {
            keys.push(ids::key(id));
            list.push(*material);
        }
        let place = |key: u64| keys.iter().position(|known| *known == key).map(|place| place as u32);
        let mut overrides: Vec<(u32, u32, f64)> = Vec::new();
        for (a, b, friction) in &self.overrides {
            if let (Some(a), Some(b)) = (place(*a), place(*b)) {
                overrides.push((a.min(b), a.max(b), *friction));
            }
        }
        overrides.sort_by_key(|pair| (pair.0, pair.1));
        (Materials { list, overrides }, keys)
    }
}
