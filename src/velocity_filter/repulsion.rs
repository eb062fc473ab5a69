//! Stage 3: weak springs between what starts closer than its thickness [Harmon10, §3.1; Bridson02, §7.2].

use super::motion::FilteredMotion;
use super::row_response::WELL_WITHIN;
use super::stage_rows::StageRows;
use crate::contact_search::Contact;

/// Sweeps over the springs, and as many over their friction: neighbours share a load.
const SWEEPS: usize = 8;

/// Pushes the contacts apart that start closer than their thickness; how many were pushed.
///
/// A spring gives `k d dt` at most: `d` is the overlap at the start, `stiffness` is k in units of the contact's effective
/// mass over `dt^2`, so that 1 is a spring that makes up for the whole overlap within the part. It is capped: a pair is
/// pushed until it separates by `recovery` times its overlap within the part, and one that separates faster already is
/// left alone. Friction follows, within `mu` times what each spring gave. Both descend on the kinetic energy less
/// `lambda` times the speed asked for, so that what springs add is at most the sum of these products.
pub fn repel(motion: &mut FilteredMotion, contacts: &[Contact], stiffness: f64, recovery: f64, dt: f64) -> u32 {
    if stiffness == 0.0 {
        return 0;
    }
    let mut rows = motion.rows(contacts);
    let overlap_speed = |contact: &u32| {
        let contact = &contacts[*contact as usize];
        (contact.thickness - contact.start_gap).max(0.0) / dt
    };
    let overlap_speeds: Vec<f64> = rows.built.contact.iter().map(overlap_speed).collect();
    rows.separations = overlap_speeds.iter().map(|speed| recovery * speed).collect();
    let limits: Vec<f64> = overlap_speeds
        .iter()
        .zip(&rows.responses)
        .map(|(speed, response)| response.normal_impulse(stiffness * speed).unwrap_or(0.0))
        .collect();
    for _ in 0..SWEEPS {
        (0..rows.len()).for_each(|row| press(&mut rows, row, limits[row]));
    }
    for _ in 0..SWEEPS {
        (0..rows.len()).for_each(|row| rub(&mut rows, row));
    }
    motion.take(contacts, 0, rows)
}

/// Moves the normal impulse of a row towards what separates it as fast as was asked for, within what its spring can.
fn press(rows: &mut StageRows, row: usize, limit: f64) {
    let missing = rows.separations[row] - rows.velocity(row)[0];
    let Some(change) = rows.responses[row].normal_impulse(missing) else { return };
    let old = rows.impulses[row][0];
    rows.push(row, [(old + change).clamp(0.0, limit) - old, 0.0, 0.0]);
}

/// Moves the friction of a row against its sliding, within the limit.
fn rub(rows: &mut StageRows, row: usize) {
    let [lambda, old1, old2] = rows.impulses[row];
    let (limit, mobility) = (rows.built.rows.friction[row] * lambda, rows.responses[row].tangential_mobility());
    if limit <= 0.0 || mobility <= 0.0 {
        return;
    }
    let [_, u1, u2] = rows.velocity(row);
    let wanted = [old1 - u1 / mobility, old2 - u2 / mobility];
    let size = wanted[0].hypot(wanted[1]);
    let share = if size > limit { limit / size } else { 1.0 };
    rows.sticks[row] = size <= WELL_WITHIN * limit;
    rows.push(row, [0.0, share * wanted[0] - old1, share * wanted[1] - old2]);
}
