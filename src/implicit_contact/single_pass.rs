//! The relaxation pass in single precision, over the contacts that press or are about to.
//!
//! Everything is made dimensionless first (velocities and masses relative to powers of two), so that no unit leaves the
//! range of f32. Velocities are increments from a base that the caller renews in f64, with the targets: rounding is
//! relative to what still changes, not to the solution.
//!
//! All contacts are screened now and then, with their normal velocity alone; those that press, or should, get a record. In crowded scenes nine of ten contacts never do.

use super::friction::{LocalMetric, project};
use super::packed_contacts::contact_velocity;
use super::residuals::Task;
use super::translation_level::{Sides, TranslationLevel};
use crate::constraint::RowSet;
use crate::linalg::power_of_two;
use crate::math::simd::{Kernel, Quad, run_wide};
use crate::math::{Mat3, Vec3, mat_add};
use crate::model::FrictionCone;
use std::ops::Range;

/// No record, or no general entries.
pub(super) const NONE: u32 = u32::MAX;

/// The normal velocity of one contact.
#[derive(Clone, Copy, Debug, Default)]
struct Screen {
    /// `NONE` first where the entries are those of the row.
    blocks: [u32; 4],
    weights: [f32; 4],
    /// Normal, and the target of the normal velocity.
    plane: Quad,
}

/// One contact that was near.
#[derive(Clone, Copy, Debug, Default)]
struct Record {
    blocks: [u32; 4],
    weights: [f32; 4],
    /// `n, t1, t2`
    rows: [Quad; 3],
    /// The same by columns: x, y, z of the three axes.
    columns: [Quad; 3],
    /// `C base + target`
    target: Quad,
    p: Quad,
    /// `lambda`
    pressure: f32,
    /// `G`: nn, n1, n2 and friction; 11, 12, 22 and its largest eigenvalue's inverse.
    normal: [f32; 4],
    tangent: [f32; 4],
    /// Inverse of the tangential block (11, 12, 22) and `1 / G_nn`.
    inverse: [f32; 4],
    /// Position in `general`, or `NONE`.
    general: u32,
    /// The components on its sides, and its compliance without them.
    sides: Sides,
    compliance: f64,
    /// The contact, and the base that the target belongs to.
    contact: u32,
    base: u32,
}

/// Entries of contacts with more than four, or with angular ones, rounded.
#[derive(Clone, Debug, Default)]
pub(super) struct GeneralRows {
    /// Ends of the linear and the angular entries of each.
    ends: Vec<[u32; 2]>,
    linear: Vec<(u32, f32)>,
    angular: Vec<(u32, Quad)>,
}

/// The contacts of a task, rounded, and which of them are near; capacity is kept.
#[derive(Default)]
pub(super) struct SinglePass {
    screens: Vec<Screen>,
    /// Contacts that were near at some time, and the record of each contact.
    records: Vec<Record>,
    record_of: Vec<u32>,
    general: GeneralRows,
    level: TranslationLevel,
    /// Records to relax, by contact.
    near: Vec<u32>,
    /// Columns of the inverse blocks of the metric, and the same in double precision.
    inverse: Vec<[Quad; 3]>,
    exact_inverse: Vec<Mat3>,
    /// Velocity and mass that the rounded numbers are relative to.
    velocity: f64,
    mass: f64,
    /// Number of times the base was renewed.
    bases: u32,
}

impl SinglePass {
    /// Takes over the contacts, with or without a second level of the metric; none is near.
    pub fn assign(&mut self, task: &Task, level: bool) {
        let Task { problem, packed, single, .. } = *task;
        self.mass = single.unit();
        self.velocity = power_of_two(task.velocity_scale);
        self.bases = 0;
        let velocity = self.velocity;
        self.screens.clear();
        self.screens.extend(packed.contacts.iter().map(|contact| {
            let n = contact.frame[0];
            let plane = Quad::new([n[0] as f32, n[1] as f32, n[2] as f32, (contact.target[0] / velocity) as f32]);
            let blocks = if contact.general { [NONE; 4] } else { contact.blocks };
            Screen { blocks, weights: contact.weights.map(|w| w as f32), plane }
        }));
        self.records.clear();
        self.record_of.clear();
        self.record_of.resize(packed.contacts.len(), NONE);
        self.general.clear();
        self.level.assign(problem.translations.filter(|_| level), problem.inverse_diagonal.len(), self.mass);
        self.near.clear();
    }

    /// Velocity `[m/s]` that rounded velocities are relative to.
    pub fn velocity_unit(&self) -> f64 {
        self.velocity
    }

    /// Columns of the inverse blocks of the metric.
    pub fn inverse(&self) -> &[[Quad; 3]] {
        &self.inverse
    }

    /// Takes a new block-diagonal metric.
    pub fn set_metric(&mut self, task: &Task, inverse: impl Fn(usize) -> Mat3 + Sync) {
        let (m, exact) = (self.mass, &mut self.exact_inverse);
        task.par.map_indexed_into(exact, task.problem.inverse_diagonal.len(), inverse);
        self.inverse.clear();
        self.inverse.extend(exact.iter().map(|a| [0, 1, 2].map(|c| Quad::round([a[0][c], a[1][c], a[2][c]], m))));
        self.measure_records(task);
    }

    fn measure_records(&mut self, task: &Task) {
        for i in 0..self.records.len() {
            self.records[i] = self.measured(task, self.records[i]);
        }
    }

    /// The record with the local metric of its contact.
    fn measured(&self, task: &Task, mut record: Record) -> Record {
        let (m, packed) = (self.mass, task.packed);
        let c = record.contact as usize;
        let own = packed.world_metric(c, task.problem.rows, &self.exact_inverse);
        let [normal, _, _, a, _, b] = packed.in_frame(c, &own);
        let rubs = record.normal[3] > 0.0;
        record.compliance = if rubs { 3.0 / (1.0 / normal + 1.0 / a + 1.0 / b) } else { normal };
        let metric = LocalMetric::new(packed.in_frame(c, &mat_add(&own, &self.level.metric(&record.sides))));
        let LocalMetric { entries, normal_inverse, tangent_inverse, tangent_step } = metric;
        let [nn, n1, n2, a, b, c] = entries.map(|g| (m * g) as f32);
        let [i, j, k] = tangent_inverse.map(|g| (g / m) as f32);
        record.normal = [nn, n1, n2, record.normal[3]];
        record.tangent = [a, b, c, (tangent_step / m) as f32];
        record.inverse = [i, j, k, (normal_inverse / m) as f32];
        record
    }

    /// The second level of the metric.
    pub fn level(&self) -> &TranslationLevel {
        &self.level
    }

    /// The same, to go on from an iteration to the next.
    pub fn level_mut(&mut self) -> &mut TranslationLevel {
        &mut self.level
    }

    /// Weighs the second level by the contacts that are near.
    pub fn weigh(&mut self, task: &Task) {
        let near = self.near.iter().map(|r| &self.records[*r as usize]);
        if self.level.weigh(near.map(|r| (&r.sides, r.compliance))) {
            self.measure_records(task);
        }
    }

    /// Starts from multipliers: those that press are near.
    pub fn start(&mut self, task: &Task, p: &[Vec3], base: &[Vec3]) {
        self.bases += 1;
        self.near.clear();
        let pressing = p.iter().filter(|p| p[0] > 0.0).count();
        self.near.reserve(pressing);
        self.records.reserve(pressing);
        for (c, p) in p.iter().enumerate() {
            if p[0] > 0.0 {
                let r = self.record(task, c, base);
                let p = Quad::round(*p, 1.0 / (self.mass * self.velocity));
                (self.records[r].p, self.records[r].pressure) = (p, p.lanes()[0]);
                self.near.push(r as u32);
            }
        }
    }

    /// Takes `base` as what velocities are relative to from now on.
    pub fn renew(&mut self, task: &Task, base: &[Vec3]) {
        self.bases += 1;
        for i in 0..self.near.len() {
            self.aim(task, self.near[i] as usize, base);
        }
    }

    /// The target of record `r` for this base.
    fn aim(&mut self, task: &Task, r: usize, base: &[Vec3]) {
        let contact = &task.packed.contacts[self.records[r].contact as usize];
        self.records[r].target = Quad::round(contact_velocity(contact, task.problem.rows, base), 1.0 / self.velocity);
        self.records[r].base = self.bases;
    }

    /// The record of contact `c`, made if need be, up to date.
    fn record(&mut self, task: &Task, c: usize, base: &[Vec3]) -> usize {
        let rows = task.problem.rows;
        let mut r = self.record_of[c] as usize;
        if self.record_of[c] == NONE {
            r = self.records.len();
            self.record_of[c] = r as u32;
            let contact = &task.packed.contacts[c];
            let f = contact.frame;
            let mut record = Record {
                blocks: contact.blocks,
                weights: contact.weights.map(|w| w as f32),
                rows: f.map(|v| Quad::round(v, 1.0)),
                columns: [0, 1, 2].map(|axis| Quad::round([f[0][axis], f[1][axis], f[2][axis]], 1.0)),
                general: NONE,
                sides: self.level.sides(rows, contact.source as usize),
                contact: c as u32,
                ..Record::default()
            };
            record.normal[3] = contact.friction as f32;
            if contact.general {
                record.general = self.general.push(rows, contact.source as usize);
            }
            let record = self.measured(task, record);
            self.records.push(record);
        }
        if self.records[r].base != self.bases {
            self.aim(task, r, base);
        }
        r
    }

    /// Finds the contacts that press, or whose law the velocities `v` (not increments) violate.
    pub fn screen(&mut self, task: &Task, v: &[Quad], base: &[Vec3]) -> u64 {
        self.near.clear();
        for c in 0..self.screens.len() {
            let r = self.record_of[c];
            let presses = r != NONE && self.records[r as usize].pressure > 0.0;
            if presses || self.normal_velocity(task, c, v) < 0.0 {
                let r = self.record(task, c, base);
                self.near.push(r as u32);
            }
        }
        self.screens.len() as u64
    }

    /// Normal velocity of contact `c`, target included.
    #[inline(always)]
    fn normal_velocity(&self, task: &Task, c: usize, v: &[Quad]) -> f32 {
        let screen = &self.screens[c];
        if screen.blocks[0] != NONE {
            return screen.normal_velocity(seen(&screen.blocks, &screen.weights, v));
        }
        let (rows, i) = (task.problem.rows, task.packed.contacts[c].source as usize);
        let linear = rows.offsets[i] as usize..rows.offsets[i + 1] as usize;
        let angular = rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize;
        let mut u = Quad::default();
        for k in linear {
            u = u.add_scaled(rows.weights[k] as f32, v[rows.blocks[k] as usize]);
        }
        for a in &rows.angular[angular] {
            u = u + v[a.block as usize].cross(Quad::round(a.lever, 1.0));
        }
        screen.normal_velocity(u)
    }

    /// Puts the multipliers of all records into `p`, in units of the problem and within their limits in f64 too.
    pub fn multipliers(&self, task: &Task, p: &mut [Vec3]) {
        let s = self.mass * self.velocity;
        for record in &self.records {
            let c = record.contact as usize;
            p[c] = project(task.settings.friction_cone, task.packed.contacts[c].friction, record.p.widen(s));
        }
    }

    /// The contacts to relax, in order.
    pub fn near(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.near.iter().map(|r| self.records[*r as usize].contact as usize)
    }

    /// Relaxes the near contacts one after the other against the increments `u`; returns the contacts visited.
    pub fn pass(&mut self, cone: FrictionCone, u: &mut [Quad]) -> u64 {
        let SinglePass { records, general, near, inverse, level, .. } = self;
        let sweep = Sweep { records, general, near, inverse, level, u, disc: cone == FrictionCone::Disc };
        run_wide(sweep);
        self.near.len() as u64
    }
}

impl Screen {
    #[inline(always)]
    fn normal_velocity(&self, seen: Quad) -> f32 {
        let n = (seen * self.plane).lanes();
        (n[0] + n[1]) + (n[2] + self.plane.lanes()[3])
    }
}

/// `W v` of a contact with at most four entries.
#[inline(always)]
pub(super) fn seen(blocks: &[u32; 4], weights: &[f32; 4], v: &[Quad]) -> Quad {
    let first = v[blocks[0] as usize].scaled(weights[0]).add_scaled(weights[1], v[blocks[1] as usize]);
    let second = v[blocks[2] as usize].scaled(weights[2]).add_scaled(weights[3], v[blocks[3] as usize]);
    first + second
}

struct Sweep<'a> {
    records: &'a mut [Record],
    general: &'a GeneralRows,
    near: &'a [u32],
    inverse: &'a [[Quad; 3]],
    level: &'a mut TranslationLevel,
    u: &'a mut [Quad],
    disc: bool,
}

impl Kernel for Sweep<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for r in self.near {
            let r = &mut self.records[*r as usize];
            if self.disc {
                r.relax::<true>(self.general, self.inverse, self.level, self.u);
            } else {
                r.relax::<false>(self.general, self.inverse, self.level, self.u);
            }
        }
    }
}

impl Record {
    #[inline(always)]
    fn relax<const DISC: bool>(
        &mut self,
        general: &GeneralRows,
        inverse: &[[Quad; 3]],
        level: &mut TranslationLevel,
        u: &mut [Quad],
    ) {
        let simple = self.general == NONE;
        let own = if simple { seen(&self.blocks, &self.weights, u) } else { general.seen(self.general, u) };
        let seen = own + level.seen(&self.sides);
        let before = self.p;
        let w = (Quad::combine(&self.columns, seen) + self.target).lanes();
        if self.pressure == 0.0 && w[0] >= 0.0 {
            return;
        }
        let after = self.step::<DISC>(before.lanes(), w);
        (self.p, self.pressure) = (Quad::new(after), after[0]);
        let f = Quad::combine(&self.rows, self.p - before);
        level.respond(&self.sides, f);
        if simple {
            for (b, w) in self.blocks.iter().zip(self.weights) {
                let b = *b as usize;
                u[b] = u[b].add_scaled(w, Quad::combine(&inverse[b], f));
            }
        } else {
            general.respond(self.general, inverse, f, u);
        }
    }

    /// As [`super::friction::local_step`].
    #[inline(always)]
    fn step<const DISC: bool>(&self, p: [f32; 4], w: [f32; 4]) -> [f32; 4] {
        let lambda = (p[0] - w[0] * self.inverse[3]).max(0.0);
        let bound = self.normal[3] * lambda;
        if bound == 0.0 {
            return [lambda, 0.0, 0.0, 0.0];
        }
        let change = lambda - p[0];
        let (w1, w2) = (w[1] + self.normal[1] * change, w[2] + self.normal[2] * change);
        let [a, b, c, step] = self.tangent;
        if DISC {
            let [i, j, k, _] = self.inverse;
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
}

impl GeneralRows {
    /// No rows.
    pub fn clear(&mut self) {
        self.ends.clear();
        self.linear.clear();
        self.angular.clear();
    }

    /// Adds the entries of row `i`; returns their number here.
    pub fn push(&mut self, rows: &RowSet, i: usize) -> u32 {
        let linear = rows.offsets[i] as usize..rows.offsets[i + 1] as usize;
        let angular = rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize;
        self.linear.extend(linear.map(|k| (rows.blocks[k], rows.weights[k] as f32)));
        self.angular.extend(rows.angular[angular].iter().map(|a| (a.block, Quad::round(a.lever, 1.0))));
        self.ends.push([self.linear.len() as u32, self.angular.len() as u32]);
        self.ends.len() as u32 - 1
    }

    /// Places of the linear and of the angular entries of `row`.
    #[inline(always)]
    fn entries(&self, row: u32) -> [Range<usize>; 2] {
        let row = row as usize;
        let (first, last) = (if row == 0 { [0, 0] } else { self.ends[row - 1] }, self.ends[row]);
        [first[0] as usize..last[0] as usize, first[1] as usize..last[1] as usize]
    }

    /// `W v`
    #[inline(always)]
    pub fn seen(&self, row: u32, u: &[Quad]) -> Quad {
        let [linear, angular] = self.entries(row);
        let mut sum = Quad::default();
        for (b, w) in &self.linear[linear] {
            sum = sum.add_scaled(*w, u[*b as usize]);
        }
        for (b, lever) in &self.angular[angular] {
            sum = sum + u[*b as usize].cross(*lever);
        }
        sum
    }

    #[inline(always)]
    fn respond(&self, row: u32, inverse: &[[Quad; 3]], f: Quad, u: &mut [Quad]) {
        let [linear, angular] = self.entries(row);
        for (b, w) in &self.linear[linear] {
            let b = *b as usize;
            u[b] = u[b].add_scaled(*w, Quad::combine(&inverse[b], f));
        }
        for (b, lever) in &self.angular[angular] {
            let b = *b as usize;
            u[b] = u[b] + Quad::combine(&inverse[b], lever.cross(f));
        }
    }
}
