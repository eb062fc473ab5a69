//! The relaxation pass in single precision: a third of the instructions and half of the memory of the pass in
//! [`super::packed_contacts`], with the same steps.
//!
//! Everything is made dimensionless first (velocities by the velocity scale, masses by a mean mass, both rounded to
//! powers of two), so that no unit leaves the range of f32. Rounding only affects how well a prediction is relaxed:
//! callers keep multipliers and responses consistent by renewing the prediction from the multipliers in f64.

use super::friction::LocalMetric;
use super::packed_contacts::PackedContacts;
use crate::constraint::RowSet;
use crate::math::{Mat3, Vec3};
use crate::model::FrictionCone;
use crate::parallel::Par;

/// Three lanes and one of padding.
pub(super) type Lanes = [f32; 4];

/// One contact.
#[derive(Clone, Copy, Debug, Default)]
struct Record {
    blocks: [u32; 4],
    weights: [f32; 4],
    /// `n, t1, t2`
    rows: [Lanes; 3],
    /// The same by columns: x, y, z of the three axes.
    columns: [Lanes; 3],
    target: Lanes,
    /// `G`: nn, n1, n2 and friction; 11, 12, 22 and its largest eigenvalue's inverse.
    normal: Lanes,
    tangent: Lanes,
    /// Inverse of the tangential block (11, 12, 22) and `1 / G_nn`.
    inverse: Lanes,
    /// Position in `general`, or `u32::MAX`.
    general: u32,
}

/// Entries of a contact with more than four, or with angular ones.
#[derive(Clone, Debug, Default)]
struct General {
    linear: Vec<(u32, f32)>,
    angular: Vec<(u32, Lanes)>,
}

/// Contacts and the metric of the pass, rounded.
#[derive(Default)]
pub(super) struct SinglePass {
    records: Vec<Record>,
    general: Vec<General>,
    /// Columns of the inverse blocks.
    inverse: Vec<[Lanes; 3]>,
    /// Velocity and mass that the rounded numbers are relative to.
    velocity: f64,
    mass: f64,
}

fn lanes(v: Vec3, scale: f64) -> Lanes {
    [(scale * v[0]) as f32, (scale * v[1]) as f32, (scale * v[2]) as f32, 0.0]
}

/// The power of two at or below a positive, finite `x`; else 1.
fn power_of_two(x: f64) -> f64 {
    if x.is_normal() && x > 0.0 { f64::from_bits(x.to_bits() & 0x7FF0_0000_0000_0000) } else { 1.0 }
}

#[inline(always)]
fn zip(a: Lanes, b: Lanes, f: impl Fn(f32, f32) -> f32) -> Lanes {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])]
}

#[inline(always)]
fn add_scaled(a: Lanes, s: f32, b: Lanes) -> Lanes {
    zip(a, b, |a, b| a + s * b)
}

/// `x[0] m[0] + x[1] m[1] + x[2] m[2]`
#[inline(always)]
fn combine(m: &[Lanes; 3], x: Lanes) -> Lanes {
    let first = m[0].map(|m| m * x[0]);
    add_scaled(add_scaled(first, x[1], m[1]), x[2], m[2])
}

#[inline(always)]
fn cross(a: Lanes, b: Lanes) -> Lanes {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0]
}

impl SinglePass {
    /// Rounds contacts and rows; `mass` and `velocity` are typical of them.
    pub fn new(packed: &PackedContacts, rows: &RowSet, mass: f64, velocity: f64) -> SinglePass {
        let (mass, velocity) = (power_of_two(mass), power_of_two(velocity));
        let mut pass = SinglePass { velocity, mass, ..SinglePass::default() };
        pass.records.reserve(packed.contacts.len());
        for contact in &packed.contacts {
            let f = contact.frame.map(|v| lanes(v, 1.0));
            let mut record = Record {
                blocks: contact.blocks,
                weights: contact.weights.map(|w| w as f32),
                rows: f,
                columns: [0, 1, 2].map(|axis| [f[0][axis], f[1][axis], f[2][axis], 0.0]),
                target: lanes(contact.target, 1.0 / velocity),
                general: u32::MAX,
                ..Record::default()
            };
            record.normal[3] = contact.friction as f32;
            if contact.general {
                record.general = pass.general.len() as u32;
                pass.general.push(general(rows, contact.source as usize));
            }
            pass.records.push(record);
        }
        pass
    }

    /// Takes a new block-diagonal metric.
    pub fn set_metric(&mut self, inverse: &[Mat3], metrics: &[LocalMetric], par: Par) {
        let m = self.mass;
        self.inverse = par.map_indexed(inverse.len(), |b| {
            let a = &inverse[b];
            [0, 1, 2].map(|c| lanes([a[0][c], a[1][c], a[2][c]], m))
        });
        for (record, metric) in self.records.iter_mut().zip(metrics) {
            let [nn, n1, n2, a, b, c] = metric.entries.map(|g| (m * g) as f32);
            let [i, j, k] = metric.tangent_inverse.map(|g| (g / m) as f32);
            record.normal = [nn, n1, n2, record.normal[3]];
            record.tangent = [a, b, c, (metric.tangent_step / m) as f32];
            record.inverse = [i, j, k, (metric.normal_inverse / m) as f32];
        }
    }

    /// Rounds predicted velocities.
    pub fn round_velocities(&self, u: &[Vec3], out: &mut Vec<Lanes>, par: Par) {
        let r = 1.0 / self.velocity;
        out.resize(u.len(), [0.0; 4]);
        par.map_into(out, |b| lanes(u[b], r));
    }

    /// Rounds multipliers.
    pub fn round_multipliers(&self, p: &[Vec3]) -> Vec<Lanes> {
        let r = 1.0 / (self.mass * self.velocity);
        p.iter().map(|p| lanes(*p, r)).collect()
    }

    /// Adds to `u` what the passes changed since it was rounded.
    #[inline]
    pub fn add_change(&self, u: Vec3, after: Lanes) -> Vec3 {
        let before = lanes(u, 1.0 / self.velocity);
        let change = |i: usize| self.velocity * (f64::from(after[i]) - f64::from(before[i]));
        [u[0] + change(0), u[1] + change(1), u[2] + change(2)]
    }

    /// Multipliers in units of the problem, within their limits in f64 too.
    pub fn multipliers(&self, packed: &PackedContacts, cone: FrictionCone, p: &[Lanes], out: &mut Vec<Vec3>) {
        let s = self.mass * self.velocity;
        out.clear();
        out.extend(p.iter().zip(&packed.contacts).map(|(p, contact)| {
            let p = [s * f64::from(p[0]), s * f64::from(p[1]), s * f64::from(p[2])];
            super::friction::project(cone, contact.friction, p)
        }));
    }

    /// One pass over `list`, or over all contacts in order; returns the contacts visited.
    pub fn pass(&self, cone: FrictionCone, list: Option<&[u32]>, p: &mut [Lanes], u: &mut [Lanes]) -> u64 {
        match (list, cone) {
            (Some(list), FrictionCone::Disc) => {
                list.iter().for_each(|c| self.relax::<true>(*c as usize, p, u));
                list.len() as u64
            }
            (Some(list), FrictionCone::Pyramid) => {
                list.iter().for_each(|c| self.relax::<false>(*c as usize, p, u));
                list.len() as u64
            }
            (None, FrictionCone::Disc) => {
                (0..self.records.len()).for_each(|c| self.relax::<true>(c, p, u));
                self.records.len() as u64
            }
            (None, FrictionCone::Pyramid) => {
                (0..self.records.len()).for_each(|c| self.relax::<false>(c, p, u));
                self.records.len() as u64
            }
        }
    }

    #[inline(always)]
    fn relax<const DISC: bool>(&self, c: usize, p: &mut [Lanes], u: &mut [Lanes]) {
        let r = &self.records[c];
        let seen = if r.general == u32::MAX {
            let first = u[r.blocks[0] as usize].map(|x| r.weights[0] * x);
            let second = u[r.blocks[2] as usize].map(|x| r.weights[2] * x);
            let first = add_scaled(first, r.weights[1], u[r.blocks[1] as usize]);
            let second = add_scaled(second, r.weights[3], u[r.blocks[3] as usize]);
            zip(first, second, |a, b| a + b)
        } else {
            self.general[r.general as usize].seen(u)
        };
        let before = p[c];
        let w = zip(combine(&r.columns, seen), r.target, |a, b| a + b);
        if before[0] == 0.0 && w[0] >= 0.0 {
            return;
        }
        let after = local_step::<DISC>(r, before, w);
        p[c] = after;
        let f = combine(&r.rows, zip(after, before, |a, b| a - b));
        if r.general == u32::MAX {
            for (b, w) in r.blocks.iter().zip(r.weights) {
                let b = *b as usize;
                u[b] = add_scaled(u[b], w, combine(&self.inverse[b], f));
            }
        } else {
            self.general[r.general as usize].respond(&self.inverse, f, u);
        }
    }
}

/// As [`super::friction::local_step`].
#[inline(always)]
fn local_step<const DISC: bool>(r: &Record, p: Lanes, w: Lanes) -> Lanes {
    let lambda = (p[0] - w[0] * r.inverse[3]).max(0.0);
    let bound = r.normal[3] * lambda;
    if bound == 0.0 {
        return [lambda, 0.0, 0.0, 0.0];
    }
    let change = lambda - p[0];
    let (w1, w2) = (w[1] + r.normal[1] * change, w[2] + r.normal[2] * change);
    let [a, b, c, step] = r.tangent;
    if DISC {
        let [i, j, k, _] = r.inverse;
        let stick = [p[1] - (i * w1 + j * w2), p[2] - (j * w1 + k * w2)];
        if i + k > 0.0 && stick[0] * stick[0] + stick[1] * stick[1] <= bound * bound {
            return [lambda, stick[0], stick[1], 0.0];
        }
        let g = [p[1] - step * w1, p[2] - step * w2];
        let length_squared = g[0] * g[0] + g[1] * g[1];
        if length_squared <= bound * bound {
            return [lambda, g[0], g[1], 0.0];
        }
        let s = bound / length_squared.sqrt();
        [lambda, s * g[0], s * g[1], 0.0]
    } else {
        let g1 = if a > 0.0 { (p[1] - w1 / a).clamp(-bound, bound) } else { 0.0 };
        let w2 = w2 + b * (g1 - p[1]);
        [lambda, g1, if c > 0.0 { (p[2] - w2 / c).clamp(-bound, bound) } else { 0.0 }, 0.0]
    }
}

fn general(rows: &RowSet, i: usize) -> General {
    let linear = rows.offsets[i] as usize..rows.offsets[i + 1] as usize;
    let angular = rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize;
    General {
        linear: linear.map(|k| (rows.blocks[k], rows.weights[k] as f32)).collect(),
        angular: rows.angular[angular].iter().map(|a| (a.block, lanes(a.lever, 1.0))).collect(),
    }
}

impl General {
    fn seen(&self, u: &[Lanes]) -> Lanes {
        let linear = self.linear.iter().fold([0.0; 4], |s, (b, w)| add_scaled(s, *w, u[*b as usize]));
        self.angular.iter().fold(linear, |s, (b, lever)| add_scaled(s, 1.0, cross(u[*b as usize], *lever)))
    }

    fn respond(&self, inverse: &[[Lanes; 3]], f: Lanes, u: &mut [Lanes]) {
        for (b, w) in &self.linear {
            let b = *b as usize;
            u[b] = add_scaled(u[b], *w, combine(&inverse[b], f));
        }
        for (b, lever) in &self.angular {
            let b = *b as usize;
            u[b] = add_scaled(u[b], 1.0, combine(&inverse[b], cross(*lever, f)));
        }
    }
}
