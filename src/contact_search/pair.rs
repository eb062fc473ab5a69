//! Primitive pairs of a model: which may touch, how thick they are, by what key they are known.

use crate::geometry::{edge_edge, point_triangle};
use crate::math::{Vec3, dot};
use crate::model::{Body, Kind, Model};

/// Fraction of the rest distance that pairs of one surface keep when they are closer than their thickness at rest.
/// Half: fine meshes neither lock nor fold onto themselves.
pub const REST_DISTANCE_FRACTION: f64 = 0.5;

/// What meets what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairKind {
    /// A vertex and a face.
    VertexFace,
    /// Two edges.
    EdgeEdge,
    /// A vertex and a half-space.
    VertexHalfSpace,
}

/// A primitive pair, by indices of the whole model: vertex and face, edge and edge, vertex and body of the half-space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    /// What meets what.
    pub kind: PairKind,
    /// The two primitives.
    pub features: [u32; 2],
}

/// Persistent name of a contact: bodies by key, features by local index, and which of the pair's contacts it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ContactKey {
    /// Body keys.
    pub bodies: [u64; 2],
    /// What meets what.
    pub kind: PairKind,
    /// Local feature indices.
    pub features: [u32; 2],
    /// Number of the contact among those of its pair.
    pub ordinal: u32,
}

impl ContactKey {
    /// The key as one number, for hosts: a mix of all fields in which collisions are improbable.
    pub fn number(&self) -> u64 {
        let words = [
            self.bodies[0],
            self.bodies[1],
            self.kind as u64,
            u64::from(self.features[0]) << 32 | u64::from(self.features[1]),
            u64::from(self.ordinal),
        ];
        // One round of the splitmix64 finaliser per word.
        words.iter().fold(0x9e37_79b9_7f4a_7c15, |hash: u64, word| {
            let mut z = (hash ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        })
    }
}

/// Closest points of a pair as a stencil: `separation = sum weights_k x_k`, from the second primitive to the first.
#[derive(Clone, Copy, Debug)]
pub struct ClosestPoints {
    /// Signed weights of the four vertices.
    pub weights: [f64; 4],
    /// From the closest point of the second primitive to that of the first `[m]`.
    pub separation: Vec3,
    /// Squared distance `[m^2]`.
    pub distance_squared: f64,
}

impl Pair {
    /// The four vertices of a mesh pair in the order of the detectors; of a half-space pair, the vertex four times.
    #[inline]
    pub fn vertices(&self, model: &Model) -> [u32; 4] {
        let [a, b] = self.features;
        match self.kind {
            PairKind::VertexFace => {
                let f = model.faces[b as usize];
                [a, f[0], f[1], f[2]]
            }
            PairKind::EdgeEdge => {
                let (e, f) = (model.edges[a as usize], model.edges[b as usize]);
                [e[0], e[1], f[0], f[1]]
            }
            PairKind::VertexHalfSpace => [a; 4],
        }
    }

    /// Body indices of the two primitives.
    #[inline]
    pub fn bodies(&self, model: &Model) -> [usize; 2] {
        let [a, b] = self.features;
        let of = |v: u32| model.vertex_body[v as usize] as usize;
        match self.kind {
            PairKind::VertexFace => [of(a), of(model.faces[b as usize][0])],
            PairKind::EdgeEdge => [of(model.edges[a as usize][0]), of(model.edges[b as usize][0])],
            PairKind::VertexHalfSpace => [of(a), b as usize],
        }
    }

    /// Local feature indices within the two bodies.
    pub fn local_features(&self, model: &Model) -> [u32; 2] {
        let [a, b] = self.features;
        let [body_a, body_b] = self.bodies(model).map(|i| &model.bodies[i]);
        match self.kind {
            PairKind::VertexFace => [a - body_a.vertices.start as u32, b - body_b.faces.start as u32],
            PairKind::EdgeEdge => [a - body_a.edges.start as u32, b - body_b.edges.start as u32],
            PairKind::VertexHalfSpace => [a - body_a.vertices.start as u32, 0],
        }
    }

    /// The persistent key of this pair's contact number `ordinal`.
    pub fn key(&self, model: &Model, ordinal: u32) -> ContactKey {
        ContactKey {
            bodies: self.bodies(model).map(|b| model.bodies[b].description.key),
            kind: self.kind,
            features: self.local_features(model),
            ordinal,
        }
    }

    /// Closest points of a mesh pair.
    #[inline]
    pub fn closest_points(&self, x: &[Vec3; 4]) -> ClosestPoints {
        match self.kind {
            PairKind::EdgeEdge => {
                let c = edge_edge::closest_points(x[0], x[1], x[2], x[3]);
                ClosestPoints {
                    weights: [1.0 - c.s, c.s, c.t - 1.0, -c.t],
                    separation: c.separation,
                    distance_squared: c.distance_squared,
                }
            }
            _ => {
                let c = point_triangle::closest_points(x[0], x[1], x[2], x[3]);
                let b = c.barycentrics;
                ClosestPoints {
                    weights: [1.0, -b[0], -b[1], -b[2]],
                    separation: c.separation,
                    distance_squared: c.distance_squared,
                }
            }
        }
    }

    /// Pair thickness `[m]`: half thicknesses summed; for pairs of one surface that rest closer, a fraction of the rest
    /// distance. `None`: the pair touches at rest and never counts as contact.
    #[inline]
    pub fn thickness(&self, model: &Model) -> Option<f64> {
        let [a, b] = self.bodies(model);
        let full = model.bodies[a].half_thickness + model.bodies[b].half_thickness;
        if a != b {
            return Some(full);
        }
        let rest = gather(self.vertices(model), &model.rest);
        if self.apart_along_an_axis(&rest, full) {
            return Some(full);
        }
        let distance = self.closest_points(&rest).distance_squared.sqrt();
        if distance == 0.0 {
            None
        } else if distance < full {
            Some(REST_DISTANCE_FRACTION * distance)
        } else {
            Some(full)
        }
    }
}

impl Pair {
    /// Whether the boxes of the two primitives prove a distance, with a margin beyond the rounding of
    /// [`Pair::closest_points`].
    #[inline]
    fn apart_along_an_axis(&self, x: &[Vec3; 4], distance: f64) -> bool {
        let first = if self.kind == PairKind::EdgeEdge { x[1] } else { x[0] };
        let second = if self.kind == PairKind::EdgeEdge { x[3] } else { x[1] };
        (0..3).any(|c| {
            let (a, b, p, q) = (x[0][c], first[c], x[2][c], x[3][c]);
            let (low_a, high_a) = (a.min(b), a.max(b));
            let (low_b, high_b) = (p.min(q).min(second[c]), p.max(q).max(second[c]));
            let gap = (low_b - high_a).max(low_a - high_b);
            let extent = high_a.max(high_b) - low_a.min(low_b);
            gap - distance > 64.0 * f64::EPSILON * (extent + distance)
        })
    }
}

/// The coordinates of four vertices.
#[inline]
pub fn gather(vertices: [u32; 4], x: &[Vec3]) -> [Vec3; 4] {
    vertices.map(|v| x[v as usize])
}

/// `sum w_k x_k`, as differences, so that far from the origin nothing is lost.
#[inline]
pub fn weighted(weights: &[f64; 4], x: &[Vec3; 4]) -> Vec3 {
    let mut sum = [0.0; 3];
    for k in 0..4 {
        let d = crate::math::sub(x[k], x[3]);
        sum = crate::math::add_scaled(sum, weights[k], d);
    }
    sum
}

/// `n · sum w_k x_k`
#[inline]
pub fn distance_along(normal: Vec3, weights: &[f64; 4], x: &[Vec3; 4]) -> f64 {
    dot(normal, weighted(weights, x))
}

/// Whether a body has no degree of freedom that a contact could move.
pub fn is_immovable(body: &Body) -> bool {
    match &body.description.kind {
        Kind::Deformable { pinned, .. } => pinned.iter().all(|p| *p),
        Kind::Rigid { mass, .. } => mass.is_infinite(),
        Kind::Kinematic { .. } | Kind::HalfSpace(_) => true,
    }
}

/// Which bodies may touch: groups and masks, self-collision, and at least one of the two can move.
#[derive(Clone, Debug, Default)]
pub struct BodyFilter {
    groups: Vec<u64>,
    masks: Vec<u64>,
    collides_with_itself: Vec<bool>,
    immovable: Vec<bool>,
    /// Which bodies are scripted, where only pairs with or without these are allowed.
    scripts: Vec<bool>,
    only: Option<bool>,
    fingerprint: u64,
}

impl BodyFilter {
    /// The filter of a model. Cost: linear in bodies.
    pub fn new(model: &Model) -> BodyFilter {
        let mut filter = BodyFilter::default();
        filter.assign(model);
        filter
    }

    /// Makes this the filter of a model. Cost: linear in bodies.
    pub fn assign(&mut self, model: &Model) {
        fn fill<T>(list: &mut Vec<T>, model: &Model, of: impl Fn(&Body) -> T) {
            list.clear();
            list.extend(model.bodies.iter().map(of));
        }
        let meets_itself =
            |b: &Body| b.description.self_collision && matches!(b.description.kind, Kind::Deformable { .. });
        fill(&mut self.groups, model, |b| b.description.groups);
        fill(&mut self.masks, model, |b| b.description.mask);
        fill(&mut self.collides_with_itself, model, meets_itself);
        fill(&mut self.immovable, model, is_immovable);
        self.scripts.clear();
        self.only = None;
        self.find_fingerprint(model);
    }

    /// This filter on pairs with something scripted alone (kinematic bodies, half-spaces), or on all others alone.
    pub fn of_pairs(&self, model: &Model, scripted: bool) -> BodyFilter {
        let is_script = |b: &Body| matches!(b.description.kind, Kind::Kinematic { .. } | Kind::HalfSpace(_));
        let mut only = BodyFilter { only: Some(scripted), ..self.clone() };
        only.scripts = model.bodies.iter().map(is_script).collect();
        only.find_fingerprint(model);
        only
    }

    /// A number that changes with anything here, with the bodies' vertex ranges or with their thickness: what was found
    /// under another one does not hold under this one.
    #[inline]
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn find_fingerprint(&mut self, model: &Model) {
        // FNV-1a over words.
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for (i, body) in model.bodies.iter().enumerate() {
            let only = self.only.map_or(0, |scripted| 1 + u64::from(scripted));
            let flags = u64::from(self.collides_with_itself[i]) | u64::from(self.immovable[i]) << 1 | only << 2;
            let words = [self.groups[i], self.masks[i], flags, body.vertices.end as u64, body.half_thickness.to_bits()];
            words.iter().for_each(|word| hash = (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3));
        }
        self.fingerprint = hash;
    }

    /// Whether bodies `a` and `b` may touch.
    #[inline]
    pub fn allows(&self, a: usize, b: usize) -> bool {
        if a == b {
            return self.collides_with_itself[a] && self.only != Some(true);
        }
        if self.only.is_some_and(|scripted| scripted != (self.scripts[a] || self.scripts[b])) {
            return false;
        }
        self.groups[a] & self.masks[b] != 0
            && self.groups[b] & self.masks[a] != 0
            && !(self.immovable[a] && self.immovable[b])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_tell_pairs_apart() {
        let key = |bodies, features, ordinal| ContactKey { bodies, kind: PairKind::EdgeEdge, features, ordinal };
        let mut numbers: Vec<u64> = Vec::new();
        for a in 0..6u32 {
            for b in 0..6u32 {
                for ordinal in 0..3 {
                    numbers.push(key([1, 2], [a, b], ordinal).number());
                    numbers.push(key([2, 1], [a, b], ordinal).number());
                }
            }
        }
        let count = numbers.len();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), count);
    }

    #[test]
    fn weights_reproduce_the_separation() {
        let x = [[0.2, 0.3, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [0.0, 1.0, -0.1]];
        for kind in [PairKind::VertexFace, PairKind::EdgeEdge] {
            let c = Pair { kind, features: [0, 0] }.closest_points(&x);
            let error = crate::math::norm(crate::math::sub(weighted(&c.weights, &x), c.separation));
            assert!(error < 1e-14);
            assert!(c.weights.iter().sum::<f64>().abs() < 1e-15);
        }
    }
}
