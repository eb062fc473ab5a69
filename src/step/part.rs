//! A part of a step as a method finds it, and as it leaves it.

use crate::constraint::Metric;
use crate::contact_search::{BodyFilter, Contact, Hit, Passing};
use crate::fail_safe::Sweep;
use crate::math::Vec3;
use crate::model::{Segment, Settings, State, Watch};
use crate::parallel::Par;

/// A part of a step with all that a method answers it with.
#[derive(Clone, Copy)]
pub struct PartStart<'a> {
    /// The part.
    pub segment: Segment<'a>,
    /// Its metric.
    pub metric: &'a Metric,
    /// Which bodies may touch.
    pub filter: &'a BodyFilter,
    /// Tangled vertices.
    pub passing: &'a Passing,
    /// Settings of the step.
    pub settings: &'a Settings,
    /// Where work runs.
    pub par: Par<'a>,
    /// Who watches.
    pub watch: Watch<'a>,
}

impl<'a> PartStart<'a> {
    /// What tests the ends of the part.
    pub fn sweep(&self) -> Sweep<'a> {
        let PartStart { segment, filter, passing, par, .. } = *self;
        Sweep { segment, filter, passing, factor: self.settings.proximity_factor.max(1.0), par }
    }
}

/// What a method gave a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    /// Impulse on the first primitive, world frame `[N s]`.
    pub impulse: Vec3,
    /// First tangent of its friction frame.
    pub tangent: Vec3,
    /// It pushes, and its friction is inside the limit.
    pub sticks: bool,
}

/// A contact with what a method gave it.
#[derive(Clone, Copy, Debug)]
pub struct SolvedContact {
    /// The contact.
    pub contact: Contact,
    /// Gap that was asked for at the end of the part `[m]`.
    pub required_gap: f64,
    /// What it was given.
    pub solved: Solved,
    /// Whether the last response is with this contact; it has then a row.
    pub is_row: bool,
}

/// The end of a part, clean if `hits` is empty.
#[derive(Clone, Debug, Default)]
pub struct PartEnd {
    /// Velocity per block `[m/s]`.
    pub velocities: Vec<Vec3>,
    /// Contact impulse per block `[N s]`.
    pub block_impulses: Vec<Vec3>,
    /// End state, rounded to the hosts' formats.
    pub end: State,
    /// Contacts, in stable order.
    pub contacts: Vec<SolvedContact>,
    /// Pairs that came too close.
    pub hits: Vec<Hit>,
}

impl PartEnd {
    /// An end of nothing.
    pub(super) fn clear(&mut self) {
        self.velocities.clear();
        self.block_impulses.clear();
        self.contacts.clear();
        self.hits.clear();
    }
}
