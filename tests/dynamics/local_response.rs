//! Two hinged bars swing into a wall [Otaduy09, Fig. 2]: response through the whole body against response of the
//! vertices that touch alone. The scene is that of `examples/scenes/two_bar.toml`.

use crate::scenes::{NO_DAMPING, grid, run, sheet, sheet_material};
use signorini::energy::{Damping, Forces, SheetMaterial};
use signorini::math::{Vec3, scale, sub};
use signorini::model::{HalfSpace, Settings};
use signorini::parallel::Par;
use signorini::world::{BodyOptions, DeformableDescription, NodeForces, Outcome, SheetModel, Topology, World};

/// Simulated time `[s]`.
const DURATION: f64 = 0.6;

fn material() -> SheetMaterial {
    SheetMaterial {
        density: 1000.0,
        thickness: 0.01,
        bending_stiffness: Some(0.5),
        damping: Damping { mass_rate: 0.5, ..NO_DAMPING },
        ..sheet_material()
    }
}

fn options() -> BodyOptions {
    BodyOptions { half_thickness: Some(5e-3), ..BodyOptions::default() }
}

fn bars() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (points, faces) = grid(2, 1, 1.0, 0.2);
    (points.iter().map(|x| sub(*x, [0.5, 0.1, 0.0])).collect(), faces)
}

fn wall() -> HalfSpace {
    let normal = [-0.3, 0.0, 0.954];
    let length = signorini::math::norm(normal);
    HalfSpace { normal: scale(1.0 / length, normal), offset: -0.5 / length }
}

/// The bars, held at one end, with a wall or without.
fn world_of_bars(with_wall: bool) -> (World, u64) {
    let mut world = World::new();
    world.set_gravity([0.0, 0.0, -9.81]).unwrap();
    if with_wall {
        world.add_half_space(options(), wall()).unwrap();
    }
    let pinned = bars().0.iter().map(|x| x[0] < -0.49).collect();
    let mut description = sheet(bars(), material(), SheetModel::Shell, NodeForces { pinned, ..NodeForces::default() });
    description.options = options();
    let id = world.add_sheet(description).unwrap();
    (world, id)
}

/// Where vertices of these masses end that contact moves one by one: as a body without a matrix of its own.
fn projected(from: &[Vec3], velocities: Vec<Vec3>, masses: &[f64], dt: f64) -> Vec<Vec3> {
    let mut world = World::new();
    world.add_half_space(options(), wall()).unwrap();
    let description = DeformableDescription {
        options: options(),
        positions: from.to_vec(),
        rest: bars().0,
        topology: Topology { triangles: bars().1, ..Topology::default() },
        masses: masses.to_vec(),
        pinned: from.iter().map(|x| x[0] < -0.49).collect(),
    };
    let id = world.add_deformable(description).unwrap();
    world.push_velocities(id, velocities).unwrap();
    world.step(&Settings::default(), dt, Par::Serial).unwrap();
    world.positions(id).unwrap().to_vec()
}

/// Elastic energy after each step, with response through the whole body.
fn global(forces: &Forces, dt: f64) -> Vec<f64> {
    let (mut world, id) = world_of_bars(true);
    let mut energies = Vec::new();
    for _ in 0..(DURATION / dt) as usize {
        run(&mut world, dt, 1);
        energies.push(forces.elastic_energy(world.positions(id).unwrap()));
    }
    energies
}

/// The same with free steps, each followed by a projection of what went through the wall. And how often that was.
fn local(forces: &Forces, dt: f64) -> (Vec<f64>, Vec<usize>) {
    let (mut world, id) = world_of_bars(false);
    let masses = material().lumped_masses(&bars().0, &bars().1).unwrap();
    let (mut energies, mut hits) = (Vec::new(), Vec::new());
    for step in 0..(DURATION / dt) as usize {
        let from = world.positions(id).unwrap().to_vec();
        run(&mut world, dt, 1);
        let free = world.positions(id).unwrap().to_vec();
        let velocities: Vec<Vec3> = free.iter().zip(&from).map(|(to, from)| scale(1.0 / dt, sub(*to, *from))).collect();
        let end = projected(&from, velocities, &masses, dt);
        if end.iter().zip(&free).any(|(a, b)| signorini::math::norm(sub(*a, *b)) > 1e-6) {
            hits.push(step);
            let velocities = end.iter().zip(&from).map(|(to, from)| scale(1.0 / dt, sub(*to, *from))).collect();
            world.push_positions(id, end.clone(), true).unwrap();
            world.push_velocities(id, velocities).unwrap();
        }
        energies.push(forces.elastic_energy(&end));
    }
    (energies, hits)
}

#[test]
fn response_through_the_body_keeps_the_elastic_energy_low() {
    let (points, faces) = bars();
    let forces = material().shell(&points, &faces).unwrap();
    for dt in [0.01, 0.02, 0.03, 0.04] {
        let (global, (local, hits)) = (global(&forces, dt), local(&forces, dt));
        let first = hits[0];
        // Up to the impact both are the same motion.
        assert!(
            first > 3 && global[..first].iter().zip(&local).all(|(a, b)| (a - b).abs() <= 1e-9 * (a + b)),
            "{first}"
        );
        let most = |energies: &[f64]| energies.iter().copied().fold(0.0, f64::max);
        println!(
            "dt {dt}: impact in step {first}: {:.3e} J before, then {:.3e} J global and {:.3e} J local; largest {:.3e} and {:.3e}",
            global[first - 1],
            global[first],
            local[first],
            most(&global),
            most(&local),
        );
        assert!(local[first] > 1.2 * global[first], "{dt}: {} {}", local[first], global[first]);
        if dt >= 0.02 {
            assert!(most(&local) > 1.5 * most(&global), "{dt}: {} {}", most(&local), most(&global));
        }
    }
}

/// What the comparison rests on: velocities of a body that the library drives can be set.
#[test]
fn a_driven_body_goes_on_from_pushed_velocities() {
    let (mut world, id) = world_of_bars(false);
    run(&mut world, 0.01, 3);
    let velocities = world.outcome(id, Outcome::EndVelocity).unwrap();
    let (mut other, same) = world_of_bars(false);
    other.push_positions(same, world.positions(id).unwrap().to_vec(), true).unwrap();
    other.push_velocities(same, velocities).unwrap();
    run(&mut world, 0.01, 1);
    run(&mut other, 0.01, 1);
    assert_eq!(world.positions(id).unwrap(), other.positions(same).unwrap());
}
