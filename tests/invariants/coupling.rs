//! One problem with everything in it: a system over cloth and a rigid body, lumped bodies, infinite mass, a script.

use crate::world::*;
use signorini::math::{Mat3, add, mat_vec, norm, sub};
use signorini::model::*;
use signorini::parallel::Par;

/// A full symmetric pattern over `rows` blocks: masses, and a spring from block 0 to block 4 with a lever.
fn blocks(rows: usize, upper: bool, pinned: usize) -> (Vec<usize>, Vec<u32>, Vec<Mat3>) {
    let stiff = 40.0;
    let entry = |i: usize, j: usize| -> Mat3 {
        if i == j {
            let own = [0.1, 0.1, 0.1, 0.1, 2.0, 0.05][i];
            diagonal(own + if i == 0 || i == 4 || i == pinned { stiff } else { 0.0 })
        } else if (i.min(j), i.max(j)) == (0, 4) {
            diagonal(-stiff)
        } else if (i.min(j), i.max(j)) == (4, 5) {
            let lever = [[0.0, 0.1, 0.0], [-0.1, 0.0, 0.02], [0.0, -0.02, 0.0]];
            if i < j { lever } else { signorini::math::transpose(&lever) }
        } else {
            diagonal(-0.001)
        }
    };
    let (mut offsets, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for i in 0..rows {
        for j in (if upper { i } else { 0 })..rows {
            columns.push(j as u32);
            values.push(entry(i, j));
        }
        offsets.push(columns.len());
    }
    (offsets, columns, values)
}

fn world(upper: bool) -> World {
    let mut plan = Plan::rubbing(0.3);
    let cloth = sheet(2, 0.4);
    plan.cloth(&cloth, cloth.positions.clone(), 0.4, &[2], [0.0, 0.0, 1.0]);
    plan.rigid(&ball(0.1), at([0.5, 0.0, 0.0]), 2.0, diagonal(0.05), [0.0; 3], [0.0; 3]);
    plan.rigid(&ball(0.05), at([0.03, 0.02, 0.056]), 0.5, diagonal(0.0005), [0.0, 0.0, -2.0], [0.0; 3]);
    plan.rigid(&ball(0.05), at([0.05, 0.02, -0.06]), f64::INFINITY, diagonal(f64::INFINITY), [0.0; 3], [0.0; 3]);
    plan.scripted(&block([0.2; 3]), at([0.5, 0.0, 0.25]));
    let base = plan.build();
    let (row_offsets, columns, values) = blocks(6, upper, 2);
    let description = SystemDescription { bodies: vec![1, 2], row_offsets, columns, upper };
    let bodies = base.model.bodies.iter().map(|b| b.description.clone()).collect();
    let model = Model::build(bodies, base.model.materials.clone(), vec![description.clone()]).unwrap();
    let mut world = World { model, ..base };
    world.prepare();
    world.drives.velocities[4] = [0.0, 0.0, 3.0];
    world.drives.systems = vec![System { description, values }];
    world.settings.contact_tolerance = 1e-9;
    world.settings.velocity_tolerance = 1e-9;
    world
}

#[test]
fn the_matrix_equation_holds_over_bodies_and_fixed_blocks_do_not_respond() {
    let mut pulled = Vec::new();
    for upper in [false, true] {
        let mut world = world(upper);
        // The scripted block comes down on the rigid body of the system.
        let mut pose = world.pose(5);
        pose.position[2] -= 0.06;
        world.script(5, pose);
        let free = world.drives.velocities.clone();
        let report = world.advance(Par::Serial).expect("a step");
        assert!(report.active_contacts >= 2, "{report:?}");
        assert_eq!(report.intersections, Some(0));
        let (_, _, values) = blocks(6, false, 2);
        let change: Vec<_> = (0..6).map(|b| sub(world.result.end_velocities[b], free[b])).collect();
        assert_eq!(change[2], [0.0; 3], "a pinned vertex follows its velocity");
        let scale = world.result.impulses.iter().map(|p| norm(*p)).fold(0.0, f64::max);
        for row in (0..6).filter(|r| *r != 2) {
            let mut product = [0.0; 3];
            for column in 0..6 {
                product = add(product, mat_vec(&values[row * 6 + column], change[column]));
            }
            let error = norm(sub(product, world.result.impulses[row]));
            assert!(error < 1e-6 * scale, "row {row}: {error:e} of {scale:e}");
        }
        assert_eq!(world.result.end_velocities[8], free[8], "infinite mass");
        assert!(change[3] != [0.0; 3], "coupling reaches vertices that nothing touches");
        pulled.push(world.result.end_velocities.clone());
    }
    assert_eq!(pulled[0], pulled[1], "upper and full give the same bits");
}
