//! From a model and two states to contacts with bodies, thickness and persistent keys; used by every method, by the
//! certificate and by the stand-alone sweep.
//!
//! * `pair`: primitive pairs of a model, which may touch, thickness, persistent keys
//! * `contact`: the contact record with its gap
//! * `candidates`: broad phase over a segment, kept while it holds, and at one state for the certificate
//! * `vicinity`: the candidates that can count while no vertex goes far
//! * `near`, `distinct`: contacts near the start, each once
//! * `swept`: continuous detection over a segment
//! * `passing`: tangled vertices, whose pairs pass
//! * `intersecting`: exact intersections of a state, with witnesses

mod candidates;
mod contact;
mod distinct;
mod intersecting;
mod near;
mod pair;
mod passing;
mod swept;
mod vicinity;

pub use candidates::{Buffers, CandidateSearch, Found, primitives};
pub use contact::{Contact, half_space_contact, mesh_contact};
pub use intersecting::{Tangle, intersections, intersections_with, swept_free};
pub use near::near_contacts;
pub use pair::{
    BodyFilter, ClosestPoints, ContactKey, Pair, PairKind, REST_DISTANCE_FRACTION, distance_along, gather,
    is_immovable, weighted,
};
pub use passing::Passing;
pub use swept::{Hit, minimum_separation, renewed_hits, swept_hits};
