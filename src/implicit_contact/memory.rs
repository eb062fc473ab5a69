//! What the method remembers from step to step: warm starts by persistent key.

use crate::contact_search::{Contact, ContactKey};
use crate::math::{Vec3, norm, scale};
use crate::model::{Body, ByBody, Model, write_by_body};
use crate::step::{Carried, SolvedContact};

/// One contact of the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RememberedContact {
    /// Its key.
    pub key: ContactKey,
    /// Its impulse, world frame `[N s]`.
    pub impulse: Vec3,
    /// Its first tangent, if it stuck.
    pub tangent: Option<Vec3>,
}

/// Warm starts by persistent key, and what every method carries. Part of a snapshot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// Contacts with an impulse, sorted by key.
    pub contacts: Vec<RememberedContact>,
    /// Duration of the segment that they come from `[s]`.
    pub dt: f64,
    /// Velocities at the end of the last step, by body key.
    pub velocities: ByBody,
    /// What every method carries.
    pub carried: Carried,
}

impl Memory {
    /// The remembered contact of this key.
    pub fn recall(&self, key: &ContactKey) -> Option<&RememberedContact> {
        self.contacts.binary_search_by(|c| c.key.cmp(key)).ok().map(|i| &self.contacts[i])
    }

    /// The impulse remembered for a contact, scaled to a segment of `dt`, and the tangent to keep.
    pub fn warm_start(&self, model: &Model, contact: &Contact, dt: f64) -> (Vec3, Option<Vec3>) {
        match self.recall(&contact.pair.key(model, contact.ordinal)) {
            Some(c) if self.dt > 0.0 => (scale(dt / self.dt, c.impulse), c.tangent),
            _ => ([0.0; 3], None),
        }
    }

    /// Remembers the contacts of a solved segment.
    pub fn keep_contacts(&mut self, model: &Model, contacts: &[SolvedContact], dt: f64) {
        self.dt = dt;
        self.contacts.clear();
        self.contacts.reserve_exact(contacts.iter().filter(|c| norm(c.solved.impulse) > 0.0).count());
        for SolvedContact { contact, solved, .. } in contacts {
            if norm(solved.impulse) > 0.0 {
                self.contacts.push(RememberedContact {
                    key: contact.pair.key(model, contact.ordinal),
                    impulse: solved.impulse,
                    tangent: solved.sticks.then_some(solved.tangent),
                });
            }
        }
        self.contacts.sort_unstable_by_key(|contact| contact.key);
    }

    /// Remembers velocities per block, by body.
    pub fn keep_velocities(&mut self, model: &Model, velocities: &[Vec3]) {
        let of_body = |b: &Body| (b.description.key, velocities[b.blocks.clone()].iter().copied());
        write_by_body(&mut self.velocities, model.bodies.iter().filter(|b| !b.blocks.is_empty()).map(of_body));
    }

    /// Takes over what the first part of a step starts from.
    pub fn warm_from(&mut self, last: &Memory) {
        self.contacts.clone_from(&last.contacts);
        self.dt = last.dt;
        write_by_body(&mut self.velocities, last.velocities.iter().map(|(key, list)| (*key, list.iter().copied())));
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.contacts.len() * std::mem::size_of::<RememberedContact>()
            + self.velocities.iter().map(|(_, v)| 24 * v.len() + 32).sum::<usize>()
            + self.carried.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_search::{Pair, PairKind, half_space_contact};
    use crate::model::{BodyDescription, HalfSpace, Kind, Material, Materials, Precision, Surface};
    use std::sync::Arc;

    fn model() -> Model {
        let body = |key, surface: Surface, kind| BodyDescription {
            key,
            surface: Arc::new(surface),
            kind,
            half_thickness: Some(0.1),
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: false,
            precision: Precision::Double,
            embedding: None,
            dynamics: None,
        };
        let point = Surface { rest: vec![[0.0; 3]], vertices: vec![0], ..Surface::default() };
        let plane = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 };
        let bodies = vec![
            body(1, point, Kind::Deformable { masses: vec![1.0], pinned: vec![false] }),
            body(2, Surface::default(), Kind::HalfSpace(plane)),
        ];
        let material = Material { friction_coefficient: 0.5, combine_rule: Default::default(), restitution: 0.0 };
        Model::build(bodies, Materials { list: vec![material], overrides: vec![] }, vec![]).unwrap()
    }

    #[test]
    fn warm_starts_are_found_by_key_and_scaled_by_the_ratio_of_durations() {
        let model = model();
        let pair = Pair { kind: PairKind::VertexHalfSpace, features: [0, 1] };
        let plane = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 };
        let contact = half_space_contact(pair, &plane, &plane, [0.0, 0.0, 0.1], 0.2);
        let remembered =
            RememberedContact { key: pair.key(&model, 0), impulse: [0.5, 0.0, 2.0], tangent: Some([1.0, 0.0, 0.0]) };
        let memory = Memory { contacts: vec![remembered], dt: 0.01, ..Memory::default() };
        let (impulse, tangent) = memory.warm_start(&model, &contact, 0.0025);
        assert_eq!(impulse, [0.125, 0.0, 0.5]);
        assert_eq!(tangent, Some([1.0, 0.0, 0.0]), "the frame is kept while the contact sticks");
        let other = Contact { ordinal: 1, ..contact };
        assert_eq!(memory.warm_start(&model, &other, 0.0025), ([0.0; 3], None));
    }
}
