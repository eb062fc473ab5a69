//! Stage 4: passes of impulses and continuous detection [Harmon10, §2.3, §3.1].

use super::motion::FilteredMotion;
use super::stage_rows::StageRows;
use crate::contact_search::{BodyFilter, CandidateSearch, Contact, Hit, Passing, renewed_hits, swept_hits};
use crate::math::Vec3;
use crate::model::{Model, Phase, Segment, StepError, StepReport};
use crate::step::{Surroundings, lap};
use std::time::Instant;

/// Gives impulses to what collides, pass by pass, until nothing does or the passes are used up; what is left.
///
/// Each pass treats its collisions in the order of their times: a pair that still approaches gets the impulse that
/// reflects its normal velocity by the restitution, and friction. It then tests again what has moved. Ends early where
/// only pairs without finite mass collide, or none of the collisions approaches any more. Errors: cancelled.
pub fn iterate_impulses(
    around: &Surroundings,
    segment: &Segment,
    passing: &Passing,
    motion: &mut FilteredMotion,
    search: &mut CandidateSearch,
    report: &mut StepReport,
) -> Result<Vec<Hit>, StepError> {
    let filter = around.settings.filter;
    let mut detection = Detection { around, segment, passing, hits: None, tested: Vec::new() };
    for pass in 1..=filter.passes_max + 1 {
        around.watch.ask(Phase::Round, segment.from)?;
        let mut clock = Instant::now();
        detection.test(motion, search);
        report.rounds += 1;
        report.times.detection += lap(&mut clock);
        let hits = detection.hits.as_deref().unwrap_or_default();
        if hits.is_empty() || pass > filter.passes_max {
            break;
        }
        let contacts = in_order_of_time(hits);
        let mut rows = motion.rows(&contacts);
        for row in 0..rows.len() {
            let contact = &contacts[rows.built.contact[row] as usize];
            reflect(&mut rows, row, restitution(segment.model, contact, filter.restitution));
        }
        let given = motion.take(&contacts, pass, rows);
        report.iterations += given;
        report.times.solve += lap(&mut clock);
        if given == 0 {
            break;
        }
    }
    Ok(detection.hits.unwrap_or_default())
}

/// Coefficient of restitution of a contact: of its materials, `least` at least.
fn restitution(model: &Model, contact: &Contact, least: f64) -> f64 {
    let [a, b] = contact.pair.bodies(model).map(|body| model.bodies[body].description.material);
    model.materials.restitution(a, b).max(least)
}

/// The impulse of a row that approaches: its normal velocity is reflected by `restitution`, friction stops its sliding as
/// far as it can.
fn reflect(rows: &mut StageRows, row: usize, restitution: f64) {
    let u = rows.velocity(row);
    let change = -(1.0 + restitution) * u[0];
    let Some(lambda) = rows.responses[row].normal_impulse(change).filter(|_| u[0] < 0.0) else { return };
    let (p, sticks) = rows.responses[row].with_friction(u, lambda, rows.built.rows.friction[row]);
    rows.sticks[row] = sticks;
    rows.push(row, p);
}

/// Contacts of hits, the earliest first.
fn in_order_of_time(hits: &[Hit]) -> Vec<Contact> {
    let mut order: Vec<&Hit> = hits.iter().collect();
    order.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.pair.cmp(&b.pair)));
    order.iter().map(|hit| hit.contact).collect()
}

/// Continuous detection over the passes of a part.
struct Detection<'a> {
    around: &'a Surroundings<'a>,
    segment: &'a Segment<'a>,
    passing: &'a Passing,
    /// Hits of the last test; `None` before the first.
    hits: Option<Vec<Hit>>,
    /// End positions of the last test.
    tested: Vec<Vec3>,
}

impl Detection<'_> {
    /// Tests the motion: after the first time only pairs of which a vertex ends elsewhere than in the test before.
    fn test(&mut self, motion: &FilteredMotion, search: &mut CandidateSearch) {
        let (model, start, par) = (self.segment.model, self.segment.start, self.around.par);
        let filter: &BodyFilter = self.around.filter;
        let factor = self.around.settings.proximity_factor.max(1.0);
        let x1 = &motion.end.positions;
        let candidates = search.update(model, filter, &start.positions, x1, factor, par);
        self.hits = Some(match self.hits.take() {
            None => swept_hits(model, filter, self.passing, candidates, start, &motion.end, par),
            Some(hits) => {
                let moved: Vec<bool> = x1.iter().zip(&self.tested).map(|(now, then)| now != then).collect();
                renewed_hits(model, filter, self.passing, candidates, (start, &motion.end), &hits, &moved, par)
            }
        });
        self.tested.clone_from(x1);
    }
}
