//! A row per step, and what the rows come to.

use crate::model::StepReport;

macro_rules! row {
    ($($(#[$doc:meta])* $field:ident: $type:ty,)*) => {
        /// What a step did. `stats.csv` has a column per field.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct StepRow { $($(#[$doc])* pub $field: $type,)* }

        impl StepRow {
            /// Names of the columns.
            pub const COLUMNS: &'static [&'static str] = &[$(stringify!($field)),*];

            /// The values, separated by commas, with all their digits.
            pub fn to_csv(&self) -> String {
                [$(self.$field.to_string()),*].join(",")
            }

            /// The row of a line; `None` if it is no such line.
            pub fn from_csv(line: &str) -> Option<StepRow> {
                let mut words = line.split(',');
                let row = StepRow { $($field: words.next()?.parse().ok()?,)* };
                words.next().is_none().then_some(row)
            }
        }
    };
}

row! {
    /// From 1.
    step: u64,
    /// At the end of the step `[s]`.
    time: f64,
    contacts: u32,
    active_contacts: u32,
    rounds: u32,
    parts: u32,
    projected_zones: u32,
    rigid_zones: u32,
    held_vertices: u32,
    tangled_pairs: u32,
    iterations: u32,
    /// 0 or 1.
    not_converged: u32,
    complementarity_residual: f64,
    friction_residual: f64,
    dynamics_residual: f64,
    /// Found by the certificate.
    intersections: u32,
    /// Below 1 only when pinched.
    certified_fraction: f64,
    /// `[J]`
    kinetic_energy: f64,
    /// `[J]`
    elastic_energy: f64,
    /// Of the wall.
    seconds: f64,
    /// Of the processor, over all threads; as `seconds` where the system does not tell.
    processor_seconds: f64,
    dynamics: f64,
    search: f64,
    rows: f64,
    solve: f64,
    detection: f64,
    fail_safe: f64,
    certificate: f64,
    bytes: u64,
}

impl StepRow {
    /// The row of a report.
    pub fn new(step: u64, time: f64, report: &StepReport) -> StepRow {
        let seconds = |microseconds: f64| 1e-6 * microseconds;
        let t = &report.times;
        StepRow {
            step,
            time,
            contacts: report.contacts,
            active_contacts: report.active_contacts,
            rounds: report.rounds,
            parts: report.parts,
            projected_zones: report.projected_zones,
            rigid_zones: report.rigid_zones,
            held_vertices: report.held_vertices,
            tangled_pairs: report.tangled_pairs,
            iterations: report.iterations,
            not_converged: u32::from(report.not_converged),
            complementarity_residual: report.complementarity_residual,
            friction_residual: report.friction_residual,
            dynamics_residual: report.dynamics_residual,
            intersections: report.intersections.unwrap_or(0),
            certified_fraction: report.certified_fraction,
            kinetic_energy: 0.0,
            elastic_energy: 0.0,
            seconds: 0.0,
            processor_seconds: 0.0,
            dynamics: seconds(t.dynamics),
            search: seconds(t.search),
            rows: seconds(t.rows),
            solve: seconds(t.solve),
            detection: seconds(t.detection),
            fail_safe: seconds(t.fail_safe),
            certificate: seconds(t.certificate),
            bytes: report.bytes,
        }
    }

    /// Rounds of a part of the step, rounded up.
    pub fn rounds_of_a_part(&self) -> u32 {
        self.rounds.div_ceil(self.parts.max(1))
    }

    /// Whether zones were projected or moved as rigid bodies, or vertices were held.
    pub fn fail_safe_used(&self) -> bool {
        self.projected_zones > 0 || self.rigid_zones > 0 || self.held_vertices > 0
    }
}

/// Mean, median, 95th percentile and largest of a list.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Spread {
    pub mean: f64,
    pub median: f64,
    pub p95: f64,
    pub max: f64,
}

impl Spread {
    /// Nearest rank; zeros for an empty list.
    pub fn of(values: impl Iterator<Item = f64>) -> Spread {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let rank = |share: f64| {
            let place = (share * sorted.len() as f64).ceil() as usize;
            sorted.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        let mean = sorted.iter().sum::<f64>() / sorted.len().max(1) as f64;
        Spread { mean, median: rank(0.5), p95: rank(0.95), max: rank(1.0) }
    }
}

/// Processor seconds that the threads of this process have used, `None` where the system does not tell (Linux does).
pub fn processor_seconds() -> Option<f64> {
    let mut nanoseconds = 0u64;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        nanoseconds += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    Some(1e-9 * nanoseconds as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_read_back_and_percentiles_are_nearest_ranks() {
        let report =
            StepReport { contacts: 7, friction_residual: 0.1 + 0.2, rounds: 7, parts: 4, ..StepReport::default() };
        let row = StepRow { seconds: 1.0 / 3.0, ..StepRow::new(12, 0.1, &report) };
        assert_eq!(StepRow::from_csv(&row.to_csv()), Some(row.clone()));
        assert_eq!(row.to_csv().split(',').count(), StepRow::COLUMNS.len());
        assert_eq!(StepRow::from_csv(&format!("{},1", row.to_csv())), None);
        assert_eq!(row.rounds_of_a_part(), 2);
        let spread = Spread::of((1..=100).rev().map(f64::from));
        assert_eq!(spread, Spread { mean: 50.5, median: 50.0, p95: 95.0, max: 100.0 });
        assert_eq!(Spread::of(std::iter::empty()), Spread::default());
    }
}
