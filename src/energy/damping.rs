//! Damping of a body: against still space by mass, and within the material by its viscosity.

/// Damping matrix `B = rate M + sum tau V` of a body; the damping force is `-B v`.
///
/// The first part (Rayleigh's mass term) slows every motion, falling too: `v` decays as `exp(-rate t)`. The second acts
/// against deformation alone: [`super::Stencil::viscosity`] vanishes on rigid motions. A mode of angular frequency `w`
/// has the damping ratio `rate / (2 w) + tau w / 2`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damping {
    /// Rate of the mass term `[1/s]`, not negative.
    pub mass_rate: f64,
    /// Time tau of stretch, shear and volume `[s]`, not negative.
    pub stretch_time: f64,
    /// Time tau of bending `[s]`, not negative.
    pub bending_time: f64,
}

/// Mean squared stretch up to which V is that of Green's strain, whose rate grows with the square of the stretch: faces
/// stretched forty times would come back only within 800 tau. Beyond, V is divided by what it exceeds this by.
pub(super) const GREEN_STRETCH_SQUARED: f64 = 4.0;

/// What V is divided by where the squares of the `count` stretches sum to `squares`: 1 in ordinary deformation.
pub(super) fn excess_stretch(squares: f64, count: f64) -> f64 {
    (squares / (GREEN_STRETCH_SQUARED * count)).max(1.0)
}

impl Damping {
    /// The first of the three that is negative or not finite.
    pub fn fault(&self) -> Option<f64> {
        [self.mass_rate, self.stretch_time, self.bending_time].into_iter().find(|d| !(*d >= 0.0 && d.is_finite()))
    }
}
