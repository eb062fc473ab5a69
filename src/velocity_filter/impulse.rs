//! Stage 4: passes of impulses and continuous detection [Harmon10, §2.3, §3.1].

use super::motion::FilteredMotion;
use super::stage_rows::StageRows;
use crate::contact_search::{CandidateSearch, Contact, Hit};
use crate::math::Vec3;
use crate::model::{Model, Phase, StepError, StepReport};
use crate::step::{PartStart, lap};
use std::time::Instant;

/// Gives impulses to what collides, pass by pass, until nothing does or the passes are used up; what is left.
///
/// Each pass treats its collisions in the order of their times: a pair that still approaches gets the impulse that
/// reflects its normal velocity by the restitution, and friction. It then tests again what has moved. Ends early where
/// only pairs without finite mass collide, or none of the collisions approaches any more. Errors: cancelled.
pub fn iterate_impulses(
    part: &PartStart,
    motion: &mut FilteredMotion,
    search: &mut CandidateSearch,
    report: &mut StepReport,
) -> Result<Vec<Hit>, StepError> {
    let (sweep, filter) = (part.sweep(), part.settings.filter);
    let (mut hits, mut tested): (Vec<Hit>, Vec<Vec3>) = Default::default();
    for pass in 1..=filter.passes_max + 1 {
        part.watch.ask(Phase::Round, part.segment.from)?;
        let mut clock = Instant::now();
        hits = match pass {
            1 => sweep.hits(&motion.end, search),
            _ => sweep.hits_again(&motion.end, (&tested, &hits), search),
        };
        tested.clone_from(&motion.end.positions);
        report.rounds += 1;
        report.times.detection += lap(&mut clock);
        if hits.is_empty() || pass > filter.passes_max {
            break;
        }
        let contacts = in_order_of_time(&hits);
        let mut rows = motion.rows(&contacts);
        for row in 0..rows.len() {
            let contact = &contacts[rows.built.contact[row] as usize];
            reflect(&mut rows, row, restitution(part.segment.model, contact, filter.restitution));
        }
        let given = motion.take(&contacts, pass, rows);
        report.iterations += given;
        report.times.solve += lap(&mut clock);
        if given == 0 {
            break;
        }
    }
    Ok(hits)
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
