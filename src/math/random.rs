//! Numbers for tests, the same in every run: a linear congruential generator.

/// The generator, from a seed.
pub(crate) struct Random(pub u64);

impl Random {
    fn advance(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0
    }

    /// One of `0..n`.
    pub fn below(&mut self, n: u64) -> u64 {
        (self.advance() >> 33) % n
    }

    /// From -1 to 1.
    pub fn signed(&mut self) -> f64 {
        (self.advance() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
