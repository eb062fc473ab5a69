//! The table of settings.

use super::fault::FieldFault;
use super::file::{not_negative, positive};
use crate::model::{FailSafe, FilterSettings, FrictionCone, Method, Settings, SolverChoice, StartPolicy, ZoneFriction};
use serde::{Deserialize, Serialize};

/// Settings of the step; what is not given keeps its default.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettingsTable {
    pub method: Option<MethodName>,
    pub solver: Option<Solver>,
    pub friction_cone: Option<Cone>,
    pub start: Option<Start>,
    pub contact_tolerance: Option<f64>,
    pub velocity_tolerance: Option<f64>,
    pub iterations_max: Option<u32>,
    pub splitting_iterations: Option<u32>,
    pub rounds_max: Option<u32>,
    pub halvings_max: Option<u32>,
    pub recovery_fraction: Option<f64>,
    pub proximity_factor: Option<f64>,
    pub turn_max: Option<f64>,
    pub fail_safe: Option<FailSafeName>,
    pub zone_friction: Option<ZoneFrictionName>,
    pub restitution: Option<f64>,
    pub repulsion_stiffness: Option<f64>,
    pub passes_max: Option<u32>,
    pub two_pass: Option<bool>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MethodName {
    #[default]
    Implicit,
    Filter,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FailSafeName {
    #[default]
    UnilateralProjection,
    InelasticProjection,
    RigidZone,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ZoneFrictionName {
    PerContact,
    PerZone,
    Frictionless,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    Automatic,
    IterativeAnticipation,
    LightAnticipation,
    AcceleratedRelaxation,
    AugmentedLagrangian,
    FullAnticipation,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cone {
    Disc,
    Pyramid,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    Refuse,
    Pass,
}

impl SettingsTable {
    /// The settings, with every step certified.
    pub fn settings(&self) -> Settings {
        let d = Settings::default();
        let method = match self.method.unwrap_or_default() {
            MethodName::Implicit => Method::ImplicitContact,
            MethodName::Filter => Method::VelocityFilter,
        };
        let solver = self.solver.map_or(d.solver, |solver| match solver {
            Solver::Automatic => SolverChoice::Automatic,
            Solver::IterativeAnticipation => SolverChoice::IterativeAnticipation,
            Solver::LightAnticipation => SolverChoice::LightAnticipation,
            Solver::AcceleratedRelaxation => SolverChoice::AcceleratedRelaxation,
            Solver::AugmentedLagrangian => SolverChoice::AugmentedLagrangian,
            Solver::FullAnticipation => SolverChoice::FullAnticipation,
        });
        let friction_cone = self.friction_cone.map_or(d.friction_cone, |cone| match cone {
            Cone::Disc => FrictionCone::Disc,
            Cone::Pyramid => FrictionCone::Pyramid,
        });
        let start_policy = self.start.map_or(d.start_policy, |start| match start {
            Start::Refuse => StartPolicy::Refuse,
            Start::Pass => StartPolicy::Pass,
        });
        let fail_safe = match self.fail_safe.unwrap_or_default() {
            FailSafeName::UnilateralProjection => FailSafe::UnilateralProjection,
            FailSafeName::InelasticProjection => FailSafe::InelasticProjection,
            FailSafeName::RigidZone => FailSafe::RigidZone,
        };
        let zone_friction = self.zone_friction.map_or(d.zone_friction, |name| match name {
            ZoneFrictionName::PerContact => ZoneFriction::PerContact,
            ZoneFrictionName::PerZone => ZoneFriction::PerZone,
            ZoneFrictionName::Frictionless => ZoneFriction::Frictionless,
        });
        let filter = FilterSettings {
            restitution: self.restitution.unwrap_or(d.filter.restitution),
            repulsion_stiffness: self.repulsion_stiffness.unwrap_or(d.filter.repulsion_stiffness),
            passes_max: self.passes_max.unwrap_or(d.filter.passes_max),
            two_pass: self.two_pass.unwrap_or(d.filter.two_pass),
        };
        Settings {
            method,
            filter,
            solver,
            friction_cone,
            start_policy,
            contact_tolerance: self.contact_tolerance.unwrap_or(d.contact_tolerance),
            velocity_tolerance: self.velocity_tolerance.unwrap_or(d.velocity_tolerance),
            iterations_max: self.iterations_max.unwrap_or(d.iterations_max),
            splitting_iterations: self.splitting_iterations.unwrap_or(d.splitting_iterations),
            rounds_max: self.rounds_max.unwrap_or(d.rounds_max),
            halvings_max: self.halvings_max.unwrap_or(d.halvings_max),
            recovery_fraction: self.recovery_fraction.unwrap_or(d.recovery_fraction),
            proximity_factor: self.proximity_factor.unwrap_or(d.proximity_factor),
            turn_max: self.turn_max.unwrap_or(d.turn_max),
            fail_safe,
            zone_friction,
            certify: true,
            ablation: d.ablation,
        }
    }
}

impl SettingsTable {
    /// Errors: a number out of its range.
    pub fn check(&self) -> Result<(), FieldFault> {
        let at = "settings";
        for (value, name) in [
            (self.contact_tolerance, "contact_tolerance"),
            (self.velocity_tolerance, "velocity_tolerance"),
            (self.turn_max, "turn_max"),
        ] {
            value.map_or(Ok(()), |value| positive(value, at, name))?;
        }
        for (value, name) in
            [(self.recovery_fraction, "recovery_fraction"), (self.repulsion_stiffness, "repulsion_stiffness")]
        {
            value.map_or(Ok(()), |value| not_negative(value, at, name))?;
        }
        if let Some(restitution) = self.restitution.filter(|e| !(0.0..=1.0).contains(e)) {
            return Err(FieldFault::new("settings.restitution", format!("between 0 and 1, not {restitution}")));
        }
        match self.proximity_factor {
            Some(factor) if !(factor >= 1.0 && factor.is_finite()) => {
                Err(FieldFault::new("settings.proximity_factor", format!("finite and at least 1, not {factor}")))
            }
            _ => Ok(()),
        }
    }
}
