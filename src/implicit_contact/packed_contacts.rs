//! Contact rows laid out for the relaxation passes: one record per contact, in the order of the sweeps, and the
//! contacts of each block for gathering `C^T p`.

use super::friction::{LocalMetric, local_step, project_tangent};
use super::incidence::Incidence;
use super::problem::ContactProblem;
use crate::constraint::RowSet;
use crate::linalg::Colouring;
use crate::math::{Mat3, Vec3, add, add_scaled, cross, dot, mat_transpose_vec, mat_vec, scale};
use crate::model::FrictionCone;
use crate::parallel::{BLOCK, Par};

/// Linear entries held in the record; contacts with more, or with angular entries, read the row set instead.
const INLINE_ENTRIES: usize = 4;
/// From this number of contacts on sweeps follow a colouring, so that they can run in parallel. Part of the numbers.
const COLOURED_FROM: usize = 32 * BLOCK;

/// One contact.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Contact {
    /// Blocks and weights; unused slots have weight 0.
    pub blocks: [u32; INLINE_ENTRIES],
    /// Signed weights.
    pub weights: [f64; INLINE_ENTRIES],
    /// `[n, t1, t2]`
    pub frame: [Vec3; 3],
    /// `(-c, h1, h2)`: the velocity to make complementary is `C dv + target`.
    pub target: Vec3,
    /// Friction coefficient.
    pub friction: f64,
    /// Index in the row set.
    pub source: u32,
    /// Whether entries must be read from the row set.
    pub general: bool,
}

/// Contacts in sweep order; capacity is kept from problem to problem.
#[derive(Default)]
pub(super) struct PackedContacts {
    /// Records.
    pub contacts: Vec<Contact>,
    /// Groups of records that share no block; the last one is swept in order.
    colouring: Colouring,
    /// The contacts of each block.
    pub incidence: Incidence,
    /// Scales of their natural maps.
    scales: Vec<[f64; 2]>,
}

/// World velocity that contact `contact` sees in `v`.
#[inline(always)]
pub(super) fn relative_velocity(contact: &Contact, rows: &RowSet, v: &[Vec3]) -> Vec3 {
    if contact.general {
        return rows.relative_velocity(contact.source as usize, v);
    }
    let [b0, b1, b2, b3] = contact.blocks;
    let [w0, w1, w2, w3] = contact.weights;
    let u = add_scaled(scale(w0, v[b0 as usize]), w1, v[b1 as usize]);
    add_scaled(add_scaled(u, w2, v[b2 as usize]), w3, v[b3 as usize])
}

impl Contact {
    /// `R u + target`
    #[inline(always)]
    pub fn in_frame(&self, u: Vec3) -> Vec3 {
        let (f, t) = (&self.frame, self.target);
        [dot(f[0], u) + t[0], dot(f[1], u) + t[1], dot(f[2], u) + t[2]]
    }

    /// `R^T p`
    #[inline(always)]
    pub fn in_world(&self, p: Vec3) -> Vec3 {
        add_scaled(add_scaled(scale(p[0], self.frame[0]), p[1], self.frame[1]), p[2], self.frame[2])
    }
}

/// `C dv + target` of one contact.
#[inline(always)]
pub(super) fn contact_velocity(contact: &Contact, rows: &RowSet, dv: &[Vec3]) -> Vec3 {
    contact.in_frame(relative_velocity(contact, rows, dv))
}

/// `u += S^-1 W^T f` for one contact.
#[inline(always)]
fn respond(contact: &Contact, rows: &RowSet, inverse: &[Mat3], f: Vec3, u: &mut [Vec3]) {
    if contact.general {
        let i = contact.source as usize;
        for k in rows.offsets[i] as usize..rows.offsets[i + 1] as usize {
            let b = rows.blocks[k] as usize;
            u[b] = add(u[b], mat_vec(&inverse[b], scale(rows.weights[k], f)));
        }
        for a in &rows.angular[rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize] {
            let b = a.block as usize;
            u[b] = add(u[b], mat_vec(&inverse[b], cross(a.lever, f)));
        }
        return;
    }
    for (b, w) in contact.blocks.iter().zip(contact.weights) {
        let b = *b as usize;
        u[b] = add(u[b], mat_vec(&inverse[b], scale(w, f)));
    }
}

/// `W S^-1 W^T` of one contact, world frame.
fn world_metric(contact: &Contact, rows: &RowSet, inverse: &[Mat3]) -> Mat3 {
    let mut g = [[0.0; 3]; 3];
    if !contact.general {
        for (b, w) in contact.blocks.iter().zip(contact.weights) {
            for r in 0..3 {
                g[r] = add_scaled(g[r], w * w, inverse[*b as usize][r]);
            }
        }
        return g;
    }
    let i = contact.source as usize;
    for axis in 0..3 {
        // Column by column: the velocity at the contact from a unit impulse. Entries on one block (two levers, a
        // repeated vertex) act together, so responses are summed per block before they are seen again.
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        let mut column = [0.0; 3];
        let linear = rows.offsets[i] as usize..rows.offsets[i + 1] as usize;
        let angular = &rows.angular[rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize];
        for k in linear.clone() {
            let b = rows.blocks[k];
            let total: f64 = linear.clone().filter(|j| rows.blocks[*j] == b).map(|j| rows.weights[j]).sum();
            let response = mat_vec(&inverse[b as usize], scale(total, unit));
            column = add_scaled(column, rows.weights[k], response);
        }
        for a in angular {
            let mut torque = [0.0; 3];
            for other in angular.iter().filter(|o| o.block == a.block) {
                torque = add(torque, cross(other.lever, unit));
            }
            column = add(column, cross(mat_vec(&inverse[a.block as usize], torque), a.lever));
        }
        for r in 0..3 {
            g[r][axis] = column[r];
        }
    }
    g
}

/// `R G R^T` of a symmetric G as its upper triangle.
fn frame_metric(frame: &[Vec3; 3], g: &Mat3) -> [f64; 6] {
    let [n, a, b] = frame.map(|axis| mat_vec(g, axis));
    let entries =
        [dot(frame[0], n), dot(frame[0], a), dot(frame[0], b), dot(frame[1], a), dot(frame[1], b), dot(frame[2], b)];
    [entries[0].max(0.0), entries[1], entries[2], entries[3].max(0.0), entries[4], entries[5].max(0.0)]
}

/// Local metric of one contact for the block-diagonal metric with this inverse.
fn local_metric(contact: &Contact, rows: &RowSet, inverse: &[Mat3]) -> LocalMetric {
    LocalMetric::new(frame_metric(&contact.frame, &world_metric(contact, rows, inverse)))
}

impl PackedContacts {
    /// Packs the rows of `problem`. Cost: one pass over the entries.
    pub fn assign(&mut self, problem: &ContactProblem, par: Par) {
        let PackedContacts { contacts, colouring, incidence, scales } = self;
        let (rows, inverse) = (problem.rows, problem.inverse_diagonal);
        if rows.len() >= COLOURED_FROM {
            colouring.assign(rows.len(), inverse.len(), |i| entry_blocks(rows, i));
        } else {
            colouring.assign_uncoloured(rows.len());
        }
        par.map_indexed_into(contacts, rows.len(), |k| pack(rows, colouring.order[k] as usize));
        incidence.rebuild(rows, inverse.len(), contacts.iter().map(|c| c.source as usize));
        par.map_indexed_into(scales, rows.len(), |c| {
            let metric = local_metric(&contacts[c], rows, inverse);
            [metric.entries[0], if metric.tangent_step > 0.0 { 1.0 / metric.tangent_step } else { 0.0 }]
        });
    }

    /// Takes the contacts `list` of `whole` alone, in its order. Cost: a pass over their entries and over the blocks.
    pub fn assign_subset(&mut self, whole: &PackedContacts, problem: &ContactProblem, list: &[usize]) {
        let PackedContacts { contacts, colouring, incidence, scales } = self;
        contacts.clear();
        contacts.extend(list.iter().map(|c| whole.contacts[*c]));
        colouring.assign_uncoloured(list.len());
        incidence.rebuild(problem.rows, problem.inverse_diagonal.len(), contacts.iter().map(|c| c.source as usize));
        scales.clear();
        scales.extend(list.iter().map(|c| whole.scales[*c]));
    }

    /// `W S^-1 W^T` of contact `c`, world frame.
    pub fn world_metric(&self, c: usize, rows: &RowSet, inverse: &[Mat3]) -> Mat3 {
        world_metric(&self.contacts[c], rows, inverse)
    }

    /// `R G R^T` of contact `c` for a symmetric G, as its upper triangle.
    pub fn in_frame(&self, c: usize, g: &Mat3) -> [f64; 6] {
        frame_metric(&self.contacts[c].frame, g)
    }

    /// Local metrics of all contacts for the block-diagonal metric with this inverse.
    pub fn metrics(&self, rows: &RowSet, inverse: &[Mat3], out: &mut Vec<LocalMetric>, par: Par) {
        par.map_indexed_into(out, self.contacts.len(), |c| local_metric(&self.contacts[c], rows, inverse));
    }

    /// Adds block by block `W^T R^T p` of the contacts `list` to `out`, in their order.
    pub fn scatter(&self, rows: &RowSet, list: impl Iterator<Item = usize>, p: &[Vec3], out: &mut [Vec3]) {
        for c in list {
            let contact = &self.contacts[c];
            let f = contact.in_world(p[c]);
            if contact.general {
                rows.scatter(contact.source as usize, f, out);
                continue;
            }
            for (b, w) in contact.blocks.iter().zip(contact.weights) {
                let b = *b as usize;
                out[b] = add_scaled(out[b], w, f);
            }
        }
    }

    /// World impulses `R^T p` of all contacts.
    pub fn impulses(&self, p: &[Vec3], out: &mut Vec<Vec3>, par: Par) {
        out.resize(self.contacts.len(), [0.0; 3]);
        par.map_into(out, |c| self.contacts[c].in_world(p[c]));
    }

    /// One projected Gauss-Seidel pass over `list` (all contacts when `None`): each contact is relaxed `repeats` times
    /// against the predicted velocities `u`, which follow every change. Returns the contacts visited.
    pub fn pass(&self, cx: &PassContext, list: Option<&[u32]>, p: &mut [Vec3], u: &mut [Vec3]) -> u64 {
        match list {
            Some(list) => {
                for c in list {
                    self.relax(cx, *c as usize, p, u);
                }
                list.len() as u64
            }
            None => {
                let groups = &self.colouring.offsets;
                let remainder = groups[groups.len() - 2];
                for g in groups.windows(2).take(groups.len() - 2) {
                    self.pass_group(cx, g[0]..g[1], p, u);
                }
                for c in remainder..self.contacts.len() {
                    self.relax(cx, c, p, u);
                }
                self.contacts.len() as u64
            }
        }
    }

    /// A group whose contacts share no block: steps in parallel, responses in order. The bits are those of a sweep.
    fn pass_group(&self, cx: &PassContext, range: std::ops::Range<usize>, p: &mut [Vec3], u: &mut [Vec3]) {
        if range.len() <= BLOCK || matches!(cx.par, Par::Serial) {
            for c in range {
                self.relax(cx, c, p, u);
            }
            return;
        }
        let start = range.start;
        let seen = &*u;
        let mut changes = vec![[0.0; 3]; range.len()];
        cx.par.map_into(&mut changes, |k| {
            let contact = &self.contacts[start + k];
            let before = p[start + k];
            contact.step(cx, &cx.metrics[start + k], before, contact_velocity(contact, cx.rows, seen))
        });
        for (k, after) in changes.iter().enumerate() {
            let c = start + k;
            if *after != p[c] {
                let change = [after[0] - p[c][0], after[1] - p[c][1], after[2] - p[c][2]];
                p[c] = *after;
                respond(&self.contacts[c], cx.rows, cx.inverse, self.contacts[c].in_world(change), u);
            }
        }
    }

    #[inline(always)]
    fn relax(&self, cx: &PassContext, c: usize, p: &mut [Vec3], u: &mut [Vec3]) {
        let contact = &self.contacts[c];
        let seen = relative_velocity(contact, cx.rows, u);
        let before = p[c];
        if before[0] == 0.0 && dot(contact.frame[0], seen) + contact.target[0] >= 0.0 {
            return;
        }
        let after = contact.step(cx, &cx.metrics[c], before, contact.in_frame(seen));
        let change = [after[0] - before[0], after[1] - before[1], after[2] - before[2]];
        p[c] = after;
        respond(contact, cx.rows, cx.inverse, contact.in_world(change), u);
    }

    /// Scales of the natural map of contact `c`: `G_nn` and the largest tangential eigenvalue for the block diagonal of A
    /// itself.
    pub fn natural_scale(&self, c: usize) -> [f64; 2] {
        self.scales[c]
    }

    /// Natural-map residuals of contact `c` at `p` and contact velocity `w` `[m/s]`: normal, tangential.
    #[inline]
    pub fn natural_map(&self, cone: FrictionCone, c: usize, scales: [f64; 2], p: Vec3, w: Vec3) -> [f64; 2] {
        let contact = &self.contacts[c];
        let [dn, dt] = scales;
        if dn <= 0.0 {
            return [0.0; 2];
        }
        let normal = (dn * p[0]).min(w[0]).abs();
        if dt <= 0.0 {
            return [normal, 0.0];
        }
        let trial = [p[1] - w[1] / dt, p[2] - w[2] / dt];
        let g = project_tangent(cone, contact.friction * p[0], trial);
        let (a, b) = (p[1] - g[0], p[2] - g[1]);
        [normal, dt * (a * a + b * b).sqrt()]
    }
}

/// What a pass needs beside the contacts.
pub(super) struct PassContext<'a> {
    /// The row set, for contacts with many or angular entries.
    pub rows: &'a RowSet,
    /// Inverse blocks of the metric of the pass.
    pub inverse: &'a [Mat3],
    /// Local metrics for it.
    pub metrics: &'a [LocalMetric],
    /// Shape of the friction limit.
    pub cone: FrictionCone,
    /// Local steps per contact [Otaduy09, §5.5: 3].
    pub repeats: u32,
    /// Where large groups run.
    pub par: Par<'a>,
}

impl Contact {
    /// The local solve: `repeats` local steps, the contact velocity following its own changes.
    #[inline(always)]
    fn step(&self, cx: &PassContext, metric: &LocalMetric, before: Vec3, w: Vec3) -> Vec3 {
        let mut p = local_step(metric, cx.cone, self.friction, before, w);
        for _ in 1..cx.repeats {
            let change = metric.apply([p[0] - before[0], p[1] - before[1], p[2] - before[2]]);
            p = local_step(metric, cx.cone, self.friction, p, add(w, change));
        }
        p
    }
}

fn entry_blocks(rows: &RowSet, i: usize) -> impl Iterator<Item = u32> + Clone + '_ {
    let linear = &rows.blocks[rows.offsets[i] as usize..rows.offsets[i + 1] as usize];
    let angular = &rows.angular[rows.angular_offsets[i] as usize..rows.angular_offsets[i + 1] as usize];
    linear.iter().copied().chain(angular.iter().map(|a| a.block))
}

fn pack(rows: &RowSet, i: usize) -> Contact {
    let linear = rows.offsets[i] as usize..rows.offsets[i + 1] as usize;
    let repeated = (linear.start..linear.end).any(|k| rows.blocks[linear.start..k].contains(&rows.blocks[k]));
    let general = repeated || linear.len() > INLINE_ENTRIES || rows.angular_offsets[i] != rows.angular_offsets[i + 1];
    let (mut blocks, mut weights) = ([0u32; INLINE_ENTRIES], [0.0; INLINE_ENTRIES]);
    if !general {
        // Unused slots repeat the first block, which is at hand, with weight 0.
        blocks = [rows.blocks.get(linear.start).copied().unwrap_or(0); INLINE_ENTRIES];
        if linear.is_empty() {
            blocks = [0; INLINE_ENTRIES];
        }
        for (slot, k) in linear.enumerate() {
            blocks[slot] = rows.blocks[k];
            weights[slot] = rows.weights[k];
        }
    }
    let [h1, h2] = rows.sliding_velocities[i];
    Contact {
        blocks,
        weights,
        frame: rows.frames[i],
        target: [-rows.normal_targets[i], h1, h2],
        friction: rows.friction[i].max(0.0),
        source: i as u32,
        general,
    }
}

/// `R^T S R` for a symmetric `S` in the contact's frame.
pub(super) fn world_stiffness(frame: &[Vec3; 3], s: &Mat3) -> Mat3 {
    let mut e = [[0.0; 3]; 3];
    for axis in 0..3 {
        let seen = [frame[0][axis], frame[1][axis], frame[2][axis]];
        let column = mat_transpose_vec(frame, mat_vec(s, seen));
        for r in 0..3 {
            e[r][axis] = column[r];
        }
    }
    e
}
