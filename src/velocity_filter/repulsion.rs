//! Stage 3: weak springs between what starts closer than its thickness [Harmon10, §3.1; Bridson02, §7.2].

use super::coupled_springs::{effective_mass, settle_coupled};
use super::motion::FilteredMotion;
use super::row_response::WELL_WITHIN;
use super::stage_rows::StageRows;
use crate::contact_search::Contact;
use crate::math::{Vec3, dot, scale};
use crate::step::PartStart;

/// Share of the thickness that pairs may overlap without being pushed apart: what rests stays in touch, and keeps its
/// friction, instead of hopping out of reach and falling back.
const RESTING_SHARE: f64 = 0.1;

/// Sweeps over the springs and their friction at most: neighbours share a load, and a stack carries its own.
const SWEEPS_MAX: usize = 64;

/// Sweeps end when none changes a velocity by more than this share of what the first one did.
const SETTLED: f64 = 5e-3;

/// Pushes the contacts apart that start closer than their thickness; how many were pushed.
///
/// A spring gives `k d dt` at most: `d` is the overlap at the start, `repulsion_stiffness` is k in units of the
/// contact's effective mass over `dt^2`, so that 1 is a spring that makes up for the whole overlap within the part. It
/// is capped: a pair is pushed until it separates by `recovery_fraction` times its overlap beyond a tenth of the
/// thickness, and one that separates faster already is left alone. Friction acts within `mu` times what its spring
/// gives. What they add to the kinetic energy is at most the sum of `lambda` times the speed asked for.
pub fn repel(motion: &mut FilteredMotion, contacts: &[Contact], part: &PartStart) -> u32 {
    let (metric, dt, recovery) = (part.metric, part.segment.dt, part.settings.recovery_fraction);
    let stiffness = part.settings.filter.repulsion_stiffness;
    if stiffness == 0.0 {
        return 0;
    }
    let mut rows = motion.rows(contacts);
    let overlap_speed = |contact: &u32| {
        let contact = &contacts[*contact as usize];
        (contact.thickness - contact.start_gap).max(0.0) / dt
    };
    let overlap_speeds: Vec<f64> = rows.built.contact.iter().map(overlap_speed).collect();
    let resting_speed = |contact: &u32| RESTING_SHARE * contacts[*contact as usize].thickness / dt;
    let excess = overlap_speeds.iter().zip(&rows.built.contact).map(|(speed, c)| (speed - resting_speed(c)).max(0.0));
    rows.separations = excess.map(|speed| recovery * speed).collect();
    let is_coupled = rows.built.rows.blocks.iter().any(|block| !metric.uncoupled[*block as usize]);
    if is_coupled {
        let mass = |row: usize| effective_mass(&rows.built.rows, row, metric).unwrap_or(0.0);
        let limits: Vec<f64> = (0..rows.len()).map(|row| stiffness * overlap_speeds[row] * mass(row)).collect();
        settle_coupled(&mut rows, &limits, metric, part.par);
        return motion.take(contacts, 0, rows);
    }
    let limits: Vec<f64> = overlap_speeds
        .iter()
        .zip(&rows.responses)
        .map(|(speed, response)| response.normal_impulse(stiffness * speed).unwrap_or(0.0))
        .collect();
    let before: Vec<Vec3> = (0..rows.len()).map(|row| rows.velocity(row)).collect();
    settle(&mut rows, |rows, row| press(rows, row, limits[row]).max(rub(rows, row)));
    bound_energy(&mut rows, &before);
    motion.take(contacts, 0, rows)
}

/// Sweeps over all rows, there and back, until they have settled. A sweep of a row tells by how much it changes its
/// velocity.
fn settle(rows: &mut StageRows, mut sweep: impl FnMut(&mut StageRows, usize) -> f64) {
    let (count, mut first) = (rows.len(), 0.0);
    for number in 0..SWEEPS_MAX {
        let mut largest = 0.0_f64;
        for i in 0..count {
            let row = if number % 2 == 0 { i } else { count - 1 - i };
            largest = largest.max(sweep(rows, row));
        }
        if number == 0 {
            first = largest;
        }
        if largest <= SETTLED * first {
            break;
        }
    }
}

/// Scales all impulses down, if need be, so that the kinetic energy grows by no more than the work at the speeds asked for.
///
/// Impulses that have settled keep that by themselves; `before` are the velocities of the rows without them.
fn bound_energy(rows: &mut StageRows, before: &[Vec3]) {
    let (mut work, mut start, mut end) = (0.0, 0.0, 0.0);
    for row in 0..rows.len() {
        let p = rows.impulses[row];
        work += p[0] * rows.separations[row];
        start += dot(p, before[row]);
        end += dot(p, rows.velocity(row));
    }
    // With a share s of the impulses the energy grows by `s start + s^2 (end - start) / 2`.
    if 0.5 * (start + end) > work && end > start {
        let share = (2.0 * (work - start) / (end - start)).clamp(0.0, 1.0);
        rows.impulses.iter_mut().for_each(|p| *p = scale(share, *p));
    }
}

/// Moves the normal impulse of a row towards what separates it as fast as was asked for, within what its spring can.
fn press(rows: &mut StageRows, row: usize, limit: f64) -> f64 {
    let missing = rows.separations[row] - rows.velocity(row)[0];
    let Some(change) = rows.responses[row].normal_impulse(missing) else { return 0.0 };
    let old = rows.impulses[row][0];
    let given = (old + change).clamp(0.0, limit) - old;
    rows.push(row, [given, 0.0, 0.0]);
    if change == 0.0 { 0.0 } else { (missing * (given / change)).abs() }
}

/// Moves the friction of a row against its sliding, within the limit.
fn rub(rows: &mut StageRows, row: usize) -> f64 {
    let [lambda, old1, old2] = rows.impulses[row];
    let (limit, mobility) = (rows.built.rows.friction[row] * lambda, rows.responses[row].tangential_mobility());
    if mobility <= 0.0 || (limit <= 0.0 && old1 == 0.0 && old2 == 0.0) {
        return 0.0;
    }
    let [_, u1, u2] = rows.velocity(row);
    let wanted = [old1 - u1 / mobility, old2 - u2 / mobility];
    let size = wanted[0].hypot(wanted[1]);
    let share = if size > limit { limit / size } else { 1.0 };
    rows.sticks[row] = size <= WELL_WITHIN * limit;
    let given = [share * wanted[0] - old1, share * wanted[1] - old2];
    rows.push(row, [0.0, given[0], given[1]]);
    mobility * given[0].hypot(given[1])
}

#[cfg(test)]
mod tests {
    use super::super::coupled_springs::tests::{chain, stage};
    use super::*;

    /// A mass of 0.5 kg at 2 m/s that was pushed back too hard: it leaves as fast as it came, or faster by the work
    /// allowed.
    #[test]
    fn impulses_that_have_not_settled_add_no_more_than_the_work_of_springs() {
        let metric = chain(1, 0.5, 0.0);
        for (separation, impulse) in [(0.0, 2.0), (0.5, 2.5)] {
            let mut rows = stage(&metric, &[(0, None, 2.0)], 0.0);
            rows.separations = vec![separation];
            let before = vec![rows.velocity(0)];
            rows.push(0, [3.0, 0.0, 0.0]);
            bound_energy(&mut rows, &before);
            assert!((rows.impulses[0][0] - impulse).abs() < 1e-12, "{:?}", rows.impulses);
            let speed = -2.0 + rows.impulses[0][0] / 0.5;
            let gained = 0.5 * 0.5 * (speed * speed - 4.0);
            assert!((gained - impulse * separation).abs() < 1e-12, "{gained}");
        }
        // What keeps within the work is left as it is.
        let mut rows = stage(&metric, &[(0, None, 2.0)], 0.0);
        let before = vec![rows.velocity(0)];
        rows.push(0, [1.5, 0.0, 0.0]);
        bound_energy(&mut rows, &before);
        assert_eq!(rows.impulses[0][0], 1.5);
    }
}
