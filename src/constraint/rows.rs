//! Sparse contact rows.

use crate::math::{Vec3, add, add_scaled, cross, dot, scale};

/// An entry on an angular block: the contact sees `weight (omega x lever)`; `lever` already carries the weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angular {
    /// Angular block.
    pub block: u32,
    /// Weight times lever arm from the centre of mass `[m]`.
    pub lever: Vec3,
}

/// Contact rows. Contact `i` sees the relative velocity `u = sum w_k v_k + sum omega x lever` of its blocks, and its
/// frame `(n, t1, t2)` turns `u` into one normal and two tangential components: `C_i = R_i W_i`.
///
/// Blocks of infinite mass are left out: they only enter the targets.
#[derive(Clone, Debug, Default)]
pub struct RowSet {
    /// Start of each contact in `blocks` and `weights`; one more entry than contacts.
    pub offsets: Vec<u32>,
    /// Linear blocks (deformable vertices, centres of mass).
    pub blocks: Vec<u32>,
    /// Signed weight per entry of `blocks`.
    pub weights: Vec<f64>,
    /// Start of each contact in `angular`; one more entry than contacts.
    pub angular_offsets: Vec<u32>,
    /// Entries on angular blocks.
    pub angular: Vec<Angular>,
    /// `[n, t1, t2]` per contact, orthonormal.
    pub frames: Vec<[Vec3; 3]>,
    /// `c_i` in `J_i dv >= c_i` `[m/s]`.
    pub normal_targets: Vec<f64>,
    /// `h_i = H_i v*`: sliding velocity without response `[m/s]`.
    pub sliding_velocities: Vec<[f64; 2]>,
    /// Friction coefficient.
    pub friction: Vec<f64>,
}

impl RowSet {
    /// Leaves no row, and makes room for this many contacts of four vertices each.
    pub(super) fn begin(&mut self, contacts: usize) {
        let RowSet { offsets, blocks, weights, angular_offsets, angular, frames, .. } = self;
        offsets.clear();
        offsets.reserve(contacts + 1);
        offsets.push(0);
        blocks.clear();
        blocks.reserve(4 * contacts);
        weights.clear();
        weights.reserve(4 * contacts);
        angular_offsets.clear();
        angular_offsets.reserve(contacts + 1);
        angular_offsets.push(0);
        angular.clear();
        frames.clear();
        frames.reserve(contacts);
        self.normal_targets.clear();
        self.normal_targets.reserve(contacts);
        self.sliding_velocities.clear();
        self.sliding_velocities.reserve(contacts);
        self.friction.clear();
        self.friction.reserve(contacts);
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there is no contact.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Relative velocity `W_i v` of contact `i` `[m/s]`, world frame.
    #[inline]
    pub fn relative_velocity(&self, i: usize, v: &[Vec3]) -> Vec3 {
        self.relative_velocity_of(i, |block| v[block])
    }

    /// The same where `v` gives the velocity of a block.
    #[inline]
    pub fn relative_velocity_of(&self, i: usize, v: impl Fn(usize) -> Vec3) -> Vec3 {
        let mut u = [0.0; 3];
        for k in self.offsets[i] as usize..self.offsets[i + 1] as usize {
            u = add_scaled(u, self.weights[k], v(self.blocks[k] as usize));
        }
        for a in &self.angular[self.angular_offsets[i] as usize..self.angular_offsets[i + 1] as usize] {
            u = add(u, cross(v(a.block as usize), a.lever));
        }
        u
    }

    /// `C_i v`: normal and two tangential components of the relative velocity.
    #[inline]
    pub fn velocity(&self, i: usize, v: &[Vec3]) -> Vec3 {
        let u = self.relative_velocity(i, v);
        let f = &self.frames[i];
        [dot(f[0], u), dot(f[1], u), dot(f[2], u)]
    }

    /// World impulse `R_i^T p` of the multipliers `p = (lambda, gamma1, gamma2)`.
    #[inline]
    pub fn impulse(&self, i: usize, p: Vec3) -> Vec3 {
        let f = &self.frames[i];
        add_scaled(add_scaled(scale(p[0], f[0]), p[1], f[1]), p[2], f[2])
    }

    /// `out += W_i^T f` for the world impulse `f`.
    #[inline]
    pub fn scatter(&self, i: usize, f: Vec3, out: &mut [Vec3]) {
        for k in self.offsets[i] as usize..self.offsets[i + 1] as usize {
            let o = &mut out[self.blocks[k] as usize];
            *o = add_scaled(*o, self.weights[k], f);
        }
        for a in &self.angular[self.angular_offsets[i] as usize..self.angular_offsets[i + 1] as usize] {
            let o = &mut out[a.block as usize];
            *o = add(*o, cross(a.lever, f));
        }
    }
}
