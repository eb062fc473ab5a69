//! Reproducible random numbers: splitmix64.

use signorini::math::Vec3;

const STRIDE: u64 = 0x9e37_79b9_7f4a_7c15;

/// A generator with a fixed sequence per seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(STRIDE))
    }

    /// Another sequence per seed: the one that stress scenes are numbered by.
    pub fn for_stress(seed: u64) -> Random {
        Random(seed.wrapping_mul(STRIDE) ^ 0x5bf0_3635)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STRIDE);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Ten to a power between `low` and `high`.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.between(low, high))
    }

    /// True as often as `probability` says.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// In the cube `[-1, 1]^3`.
    pub fn vector(&mut self) -> Vec3 {
        self.within(1.0)
    }

    /// In the cube `[-size, size]^3`.
    pub fn within(&mut self, size: f64) -> Vec3 {
        [0; 3].map(|_| self.between(-size, size))
    }

    /// A unit quaternion.
    pub fn rotation(&mut self) -> [f64; 4] {
        loop {
            let q = [0; 4].map(|_| self.between(-1.0, 1.0));
            let n = q.iter().map(|c| c * c).sum::<f64>().sqrt();
            if n > 0.1 && n < 1.0 {
                return q.map(|c| c / n);
            }
        }
    }

    /// In `0..count`.
    pub fn pick(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count - 1)
    }

    /// One of the list.
    pub fn choose<T: Copy>(&mut self, list: &[T]) -> T {
        list[(self.next() % list.len() as u64) as usize]
    }
}
