//! What cannot be stepped is refused, and nothing changes.

use crate::world::*;
use signorini::model::*;
use signorini::parallel::Par;

fn scene() -> World {
    let mut plan = Plan::rubbing(0.4);
    let cloth = sheet(5, 0.5);
    plan.cloth(&cloth, cloth.positions.clone(), 0.3, &[], [0.0; 3]);
    plan.rigid(&ball(0.1), at([0.0, 0.0, 0.2]), 1.0, diagonal(0.004), [0.0, 0.0, -4.0], [0.0; 3]);
    plan.scripted(&block([0.2; 3]), at([0.0, 0.0, -0.3]));
    plan.half_space([0.0, 0.0, 1.0], -1.0);
    plan.build()
}

fn refused(change: impl Fn(&mut World)) -> StepError {
    let mut world = scene();
    world.prepare();
    change(&mut world);
    let (state, memory) = (world.state.clone(), world.memory.clone());
    let error = world.advance(Par::Serial).expect_err("must be refused");
    let bits = |s: &State| s.positions.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&world.state), bits(&state));
    assert_eq!(world.memory, memory);
    assert!(world.result.velocities.is_empty());
    error
}

#[test]
fn values_that_are_not_finite_are_refused_and_nothing_changes() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(matches!(refused(|w| w.drives.velocities[3][1] = bad), StepError::BadInput(e) if e.index == 3));
        assert!(matches!(refused(|w| w.state.positions[7][0] = bad), StepError::BadInput(e) if e.index == 7));
        assert!(matches!(refused(|w| w.drives.target_positions[7][0] = bad), StepError::BadInput(_)));
        assert!(matches!(refused(|w| w.drives.target_poses[2].position[0] = bad), StepError::BadInput(_)));
        assert!(matches!(refused(|w| w.state.poses[1].orientation[0] = bad), StepError::BadInput(_)));
        assert!(matches!(refused(|w| w.drives.target_half_spaces[3].offset = bad), StepError::BadInput(_)));
        assert!(matches!(refused(|w| w.dt = bad), StepError::BadInput(_)));
        assert!(matches!(refused(|w| w.settings.contact_tolerance = bad), StepError::BadInput(_)));
    }
    assert!(matches!(refused(|w| w.dt = 0.0), StepError::BadInput(_)));
    assert!(matches!(refused(|w| w.drives.velocities.truncate(3)), StepError::BadInput(_)));
}

fn with_system(values: Vec<f64>, upper: bool) -> Result<StepReport, StepError> {
    let mut plan = Plan::default();
    let mesh = sheet(2, 0.5);
    plan.cloth(&mesh, mesh.positions.clone(), 0.4, &[], [0.0, 0.0, 1.0]);
    let world = plan.build();
    let rows = 4;
    let columns: Vec<u32> = (0..rows).flat_map(|r| if upper { r..rows } else { 0..rows }).collect();
    let mut row_offsets = vec![0];
    for r in 0..rows {
        row_offsets.push(row_offsets[r as usize] + if upper { (rows - r) as usize } else { rows as usize });
    }
    let description = SystemDescription { bodies: vec![1], row_offsets, columns, upper };
    let bodies = world.model.bodies.iter().map(|b| b.description.clone()).collect();
    let model = Model::build(bodies, world.model.materials.clone(), vec![description.clone()]).unwrap();
    let mut world = World { model, ..world };
    world.prepare();
    let blocks = values.into_iter().map(diagonal).collect();
    world.drives.systems = vec![System { description, values: blocks }];
    world.advance(Par::Serial)
}

#[test]
fn host_matrices_must_be_symmetric_with_positive_definite_diagonal_blocks() {
    let full = |d: f64, o: f64| (0..16).map(|i| if i % 5 == 0 { d } else { o }).collect::<Vec<_>>();
    assert!(with_system(full(1.0, -0.1), false).is_ok());
    assert!(with_system((0..10).map(|i| if [0, 4, 7, 9].contains(&i) { 1.0 } else { -0.1 }).collect(), true).is_ok());
    let mut singular = full(1.0, -0.1);
    singular[10] = 0.0;
    assert!(matches!(with_system(singular, false), Err(StepError::SingularSystem { system: 0, row: 2 })));
    let mut lopsided = full(1.0, -0.1);
    lopsided[1] = 0.3;
    assert!(matches!(with_system(lopsided, false), Err(StepError::BadInput(_))));
    let mut bad = full(1.0, -0.1);
    bad[3] = f64::NAN;
    assert!(matches!(with_system(bad, false), Err(StepError::BadInput(_))));
}

/// Positive definite diagonal blocks do not make a matrix positive definite: whatever comes of it, the step ends clean
/// or is refused.
#[test]
fn an_indefinite_host_matrix_ends_in_finite_numbers() {
    let mut host = crate::support::scenes::crumple(8, 1);
    let mut touched = 0;
    for _ in 0..60 {
        if touched == 2 {
            return;
        }
        host.prepare();
        for system in &mut host.drives.systems {
            for (row, slots) in system.description.row_offsets.windows(2).enumerate() {
                for k in slots[0]..slots[1] {
                    if system.description.columns[k] as usize != row {
                        system.values[k].iter_mut().flatten().for_each(|v| *v *= 3.0);
                    }
                }
            }
        }
        match host.advance(Par::Serial) {
            Ok(report) => {
                assert_eq!(report.intersections, Some(0));
                touched += u32::from(report.contacts > 0);
            }
            Err(error) => {
                assert!(matches!(error, StepError::SingularSystem { .. }), "{error:?}");
                return;
            }
        }
        assert!(host.state.positions.iter().flatten().all(|x| x.is_finite()));
        host.velocities.clone_from(&host.result.end_velocities);
    }
    panic!("the sheet must touch, or its matrix be refused");
}
