//! Friction per material, with a combine rule and overrides per pair.

/// How the coefficients of two materials make the coefficient of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CombineRule {
    /// `sqrt(a b)`
    #[default]
    GeometricMean,
    /// `(a + b) / 2`
    Mean,
    /// `min(a, b)`
    Minimum,
    /// `max(a, b)`
    Maximum,
    /// `a b`
    Product,
}

/// Surface material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Coulomb friction coefficient, at least 0, no unit.
    pub friction_coefficient: f64,
    /// Rule used with another material; the rule with the larger ordinal of the two wins.
    pub combine_rule: CombineRule,
    /// Coefficient of restitution of collisions, 0 to 1: a pair has the greater of two. Read by the velocity filter.
    pub restitution: f64,
}

/// All materials of a model, and the pairs that override the combine rule.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// Materials by index.
    pub list: Vec<Material>,
    /// `(a, b, coefficient)` with `a <= b`, sorted.
    pub overrides: Vec<(u32, u32, f64)>,
}

impl Materials {
    /// Coefficient of restitution between two materials: the greater of theirs, so that a ball that bounces does so on any
    /// floor.
    pub fn restitution(&self, a: u32, b: u32) -> f64 {
        self.list[a as usize].restitution.max(self.list[b as usize].restitution)
    }

    /// Friction coefficient between two materials.
    pub fn friction_coefficient(&self, a: u32, b: u32) -> f64 {
        let key = (a.min(b), a.max(b));
        if let Ok(i) = self.overrides.binary_search_by(|o| (o.0, o.1).cmp(&key)) {
            return self.overrides[i].2;
        }
        let (ma, mb) = (&self.list[a as usize], &self.list[b as usize]);
        let (x, y) = (ma.friction_coefficient, mb.friction_coefficient);
        let rule = if (ma.combine_rule as u32) < (mb.combine_rule as u32) { mb.combine_rule } else { ma.combine_rule };
        match rule {
            CombineRule::GeometricMean => (x * y).sqrt(),
            CombineRule::Mean => 0.5 * (x + y),
            CombineRule::Minimum => x.min(y),
            CombineRule::Maximum => x.max(y),
            CombineRule::Product => x * y,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_win_over_the_combine_rule() {
        let m = |f, rule| Material { friction_coefficient: f, combine_rule: rule, restitution: 0.5 * f };
        let materials = Materials {
            list: vec![m(0.4, CombineRule::GeometricMean), m(0.9, CombineRule::Minimum)],
            overrides: vec![(0, 0, 0.05)],
        };
        assert_eq!(materials.friction_coefficient(0, 0), 0.05);
        assert_eq!(materials.friction_coefficient(1, 0), 0.4);
        assert_eq!(materials.friction_coefficient(1, 1), 0.9);
        assert_eq!((materials.restitution(0, 0), materials.restitution(0, 1)), (0.2, 0.45));
        assert_eq!(materials.restitution(1, 0), 0.45);
    }
}
