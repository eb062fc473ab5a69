//! Soft solids.

use crate::invariants::{long, run};
use crate::support::boxes::BOX_VERTICES;
use crate::support::scenes;
use crate::support::tetrahedra::volume;

#[test]
fn soft_boxes_heap_up_in_a_container() {
    let full = long("twenty soft boxes");
    let (across, layers, steps) = if full { (2, 5, 80) } else { (1, 3, 45) };
    let mut host = scenes::boxes(across, layers, 0);
    run("boxes", &mut host, steps, 12.0);
    // A box keeps about its volume: the corner tetrahedra of its bounding shape tell.
    for x in host.state.positions.chunks_exact(BOX_VERTICES) {
        let corners = [x[0], x[40], x[15], x[4]];
        assert!(volume(corners).abs() > 0.5 * 0.024 / 6.0, "{corners:?}");
    }
    let lowest = host.state.positions.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    assert!(lowest > 0.0, "{lowest}");
}
