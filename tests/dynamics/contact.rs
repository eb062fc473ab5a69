//! Bodies that the library drives, in contact with each other and with what hosts drive.

use crate::scenes::{block, grid, options, run, sheet, sheet_material, solid, solid_material};
use signorini::energy::{Attachment, Damping, SheetMaterial, SolidMaterial};
use signorini::kinematics::Pose;
use signorini::math::{Vec3, add, norm, sub};
use signorini::mesh::{Shape, TetMesh};
use signorini::model::{HalfSpace, Material, Method, Settings};
use signorini::parallel::{Par, Pool};
use signorini::world::{
    BodyOptions, DeformableDescription, Fault, NodeForces, Outcome, RigidDescription, SheetModel, SolidDescription,
    Topology, World,
};

const GRAVITY: Vec3 = [0.0, 0.0, -9.81];
const FLOOR: HalfSpace = HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 };

fn soft() -> SolidMaterial {
    let damping = Damping { mass_rate: 0.5, stretch_time: 0.01, bending_time: 0.0 };
    SolidMaterial { young_modulus: 2e5, poisson_ratio: 0.3, damping, ..solid_material() }
}

fn cloth() -> SheetMaterial {
    let damping = Damping { mass_rate: 0.2, stretch_time: 1e-3, bending_time: 1e-3 };
    SheetMaterial { young_modulus: 1e5, poisson_ratio: 0.2, damping, ..sheet_material() }
}

/// A coarse block of tetrahedra that carries a ball.
fn carried_ball(centre: Vec3, host_driven: bool) -> SolidDescription {
    let (points, tetrahedra) = block([2, 2, 2], [0.4; 3], [centre[0] - 0.2, centre[1] - 0.2, centre[2] - 0.2]);
    let ball = Shape::Sphere { radius: 0.19 }.tessellate(0.01).unwrap();
    let vertices = ball.rest.iter().map(|p| add(*p, centre)).collect();
    let topology = Topology { triangles: ball.faces, ..Topology::default() };
    SolidDescription {
        embedded: Some((vertices, topology)),
        host_driven,
        ..solid((points, tetrahedra), soft(), NodeForces::default())
    }
}

fn rigid_box(at: Vec3, own: bool) -> RigidDescription {
    let mesh = Shape::Box { half_extents: [0.15, 0.15, 0.1] }.tessellate(0.01).unwrap();
    RigidDescription {
        options: options(),
        vertices: mesh.rest,
        topology: Topology { triangles: mesh.faces, ..Topology::default() },
        mass: 3.0,
        inertia: [[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.05]],
        inertia_in_world: false,
        pose: Pose { position: at, orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
        own_dynamics: own.then_some([0.1, 0.1]),
    }
}

/// Everything at once: cloth, a soft ball carried by a coarse block, a solid, rigid bodies of both drives, a host's cloth.
fn pile() -> (World, Vec<u64>) {
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    let material = world
        .add_material(Material { friction_coefficient: 0.4, combine_rule: Default::default(), restitution: 0.0 })
        .unwrap();
    let floor = BodyOptions { half_thickness: Some(0.0), material, ..options() };
    world.add_half_space(floor, FLOOR).unwrap();
    let mut ids = Vec::new();
    let (points, tetrahedra) = block([2, 2, 1], [0.6, 0.6, 0.3], [-0.3, -0.3, 0.02]);
    let mut description = solid((points, tetrahedra), soft(), NodeForces::default());
    description.options.material = material;
    ids.push(world.add_solid(description).unwrap());
    let (points, faces) = grid(10, 10, 1.0, 1.0);
    let raised = points.iter().map(|p| [p[0] - 0.5, p[1] - 0.5, 0.36]).collect();
    let spring = SheetModel::MassSpring { bend_ratio: 0.01 };
    ids.push(world.add_sheet(sheet((raised, faces), cloth(), spring, NodeForces::default())).unwrap());
    let mut ball = carried_ball([0.02, 0.01, 0.7], false);
    ball.options.material = material;
    ids.push(world.add_solid(ball).unwrap());
    ids.push(world.add_rigid(rigid_box([0.03, 0.0, 1.1], true)).unwrap());
    let (points, faces) = grid(8, 8, 0.9, 0.9);
    let raised: Vec<Vec3> = points.iter().map(|p| [p[0] - 0.45, p[1] - 0.45, 1.35]).collect();
    let host = DeformableDescription {
        options: options(),
        masses: vec![0.2 * 0.81 / 81.0; 81],
        positions: raised,
        topology: Topology { triangles: faces, ..Topology::default() },
        ..DeformableDescription::default()
    };
    ids.push(world.add_deformable(host).unwrap());
    (world, ids)
}

fn drop_pile(par: Par, steps: usize) -> (World, Vec<u64>) {
    drop_pile_by(Method::ImplicitContact, par, steps)
}

fn drop_pile_by(method: Method, par: Par, steps: usize) -> (World, Vec<u64>) {
    let (mut world, ids) = pile();
    let host = ids[4];
    let dt = 0.01;
    for step in 0..steps {
        let velocity = world.outcome(host, Outcome::EndVelocity).unwrap();
        let falling = velocity.iter().map(|v| add(*v, [0.0, 0.0, -9.81 * dt])).collect();
        world.push_velocities(host, falling).unwrap();
        let settings = Settings { method, certify: true, ..Settings::default() };
        let report = world.step(&settings, dt, par).unwrap_or_else(|e| panic!("step {step}: {:?}", e.error));
        assert_eq!(report.intersections, Some(0), "step {step}");
    }
    (world, ids)
}

/// Cloth, embedded surfaces, solids and rigid bodies of both drives under the velocity filter, with a snapshot on the way.
#[test]
fn every_kind_of_body_falls_on_every_other_under_the_velocity_filter() {
    let (world, ids) = drop_pile_by(Method::VelocityFilter, Par::Serial, 60);
    for id in &ids {
        let lowest = world.positions(*id).unwrap().iter().fold(f64::INFINITY, |a, p| a.min(p[2]));
        assert!(lowest > 0.0, "{lowest}");
    }
    let (cloth, rigid) = (world.positions(ids[1]).unwrap(), world.positions(ids[3]).unwrap());
    let mean = |points: &[Vec3]| points.iter().map(|p| p[2]).sum::<f64>() / points.len() as f64;
    assert!(mean(rigid) < 1.0 && mean(rigid) > mean(cloth) - 0.2, "{} {}", mean(rigid), mean(cloth));
    let pool = Pool::new(2).unwrap();
    let (other, _) = drop_pile_by(Method::VelocityFilter, Par::Pool(&pool), 60);
    assert_eq!(other.state_hash(), world.state_hash(), "two threads");
    // A snapshot goes on with the same bits: what the method remembers is in it.
    let mut bytes = vec![0; world.snapshot_size()];
    world.save_snapshot(&mut bytes).unwrap();
    let (mut gone_on, mut loaded) = (world, World::new());
    loaded.load_snapshot(&bytes).unwrap();
    let settings = Settings { method: Method::VelocityFilter, ..Settings::default() };
    for _ in 0..3 {
        gone_on.step(&settings, 0.01, Par::Serial).unwrap();
        loaded.step(&settings, 0.01, Par::Serial).unwrap();
    }
    assert_eq!(gone_on.state_hash(), loaded.state_hash());
}

#[test]
fn every_kind_of_body_falls_on_every_other_without_crossing() {
    let (world, ids) = drop_pile(Par::Serial, 60);
    for id in &ids {
        let lowest = world.positions(*id).unwrap().iter().fold(f64::INFINITY, |a, p| a.min(p[2]));
        assert!(lowest > 0.0, "{lowest}");
    }
    assert!(world.contacts().len() > 20);
    // The cloth lies on the solid, the ball on the cloth.
    let top = |id: u64| world.positions(id).unwrap().iter().fold(0.0_f64, |a, p| a.max(p[2]));
    assert!(top(ids[0]) < top(ids[1]) + 0.01 && top(ids[1]) < top(ids[2]));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let hash = |par: Par| drop_pile(par, 25).0.state_hash();
    let serial = hash(Par::Serial);
    let pool = Pool::new(3).unwrap();
    assert_eq!(serial, hash(Par::Pool(&pool)));
}

#[test]
fn a_snapshot_goes_on_with_the_same_bits() {
    let (mut world, ids) = drop_pile(Par::Serial, 20);
    let mut bytes = vec![0; world.snapshot_size()];
    world.save_snapshot(&mut bytes).unwrap();
    let mut other = World::new();
    other.load_snapshot(&bytes).unwrap();
    assert_eq!(world.state_hash(), other.state_hash());
    for _ in 0..5 {
        for w in [&mut world, &mut other] {
            w.step(&Settings::default(), 0.01, Par::Serial).unwrap();
        }
    }
    assert_eq!(world.state_hash(), other.state_hash());
    assert!(world.node_positions(ids[2]).unwrap().len() == 27);
    // A damaged byte anywhere is refused, or at least does no harm.
    for i in (0..bytes.len()).step_by(bytes.len() / 97) {
        let mut damaged = bytes.clone();
        damaged[i] ^= 0x55;
        assert_eq!(other.load_snapshot(&damaged).unwrap_err().fault, Fault::SnapshotMismatch);
    }
}

#[test]
fn a_soft_block_comes_to_rest_and_the_floor_bears_its_weight() {
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    world.add_half_space(BodyOptions { half_thickness: Some(0.0), ..options() }, FLOOR).unwrap();
    let (points, tetrahedra) = block([2, 2, 2], [0.3; 3], [0.0, 0.0, 0.01]);
    let mass = TetMesh::new(points.clone(), tetrahedra.clone()).unwrap().lumped_masses(1000.0).iter().sum::<f64>();
    let id = world.add_solid(solid((points, tetrahedra), soft(), NodeForces::default())).unwrap();
    let dt = 0.01;
    run(&mut world, dt, 200);
    let impulse: f64 = world.outcome(id, Outcome::Impulse).unwrap().iter().map(|f| f[2]).sum();
    assert!((impulse / (mass * 9.81 * dt) - 1.0).abs() < 1e-3, "{impulse}");
    let fastest = world.outcome(id, Outcome::Velocity).unwrap().iter().fold(0.0_f64, |a, v| a.max(norm(*v)));
    assert!(fastest < 1e-3, "{fastest}");
    // Under its own weight it is pressed by about rho g h^2 / (2 E).
    let top = world.positions(id).unwrap().iter().fold(0.0_f64, |a, p| a.max(p[2]));
    assert!(top < 0.3 + 1e-3 && top > 0.3 - 0.02, "{top}");
}

#[test]
fn a_carried_ball_rests_on_its_surface_whoever_drives_its_nodes() {
    for host_driven in [false, true] {
        let mut world = World::new();
        world.set_gravity(GRAVITY).unwrap();
        world.add_half_space(BodyOptions { half_thickness: Some(0.0), ..options() }, FLOOR).unwrap();
        let id = world.add_solid(carried_ball([0.0, 0.0, 0.25], host_driven)).unwrap();
        let info = world.body_info(id).unwrap();
        assert_eq!(info.velocities, 27);
        assert!(info.vertices > 27);
        let (dt, mut last) = (0.01, 0.0);
        for _ in 0..120 {
            if host_driven {
                let end = world.outcome(id, Outcome::EndVelocity).unwrap();
                world.push_velocities(id, end.iter().map(|v| add(*v, [0.0, 0.0, -9.81 * dt])).collect()).unwrap();
            }
            let settings = Settings { certify: true, ..Settings::default() };
            assert_eq!(world.step(&settings, dt, Par::Serial).unwrap().intersections, Some(0));
            last = world.outcome(id, Outcome::Impulse).unwrap().iter().map(|f| f[2]).sum();
        }
        let lowest = world.positions(id).unwrap().iter().fold(f64::INFINITY, |a, p| a.min(p[2]));
        assert!(lowest > 0.0 && lowest < 0.01, "{host_driven}: {lowest}");
        if !host_driven {
            assert!(last > 0.0, "the floor bears it");
        }
        let corner = world.node_positions(id).unwrap()[0];
        assert!(corner[2] < 0.03, "the corners of the block collide with nothing: {corner:?}");
    }
}

#[test]
fn pins_and_springs_follow_their_targets() {
    let (points, faces) = grid(6, 6, 0.6, 0.6);
    let mut pinned = vec![false; points.len()];
    (pinned[0], pinned[6]) = (true, true);
    let attachments = vec![Attachment { node: 48, stiffness: 50.0, damping: 0.5 }];
    let forces = NodeForces { pinned, attachments, ..NodeForces::default() };
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    let id = world.add_sheet(sheet((points.clone(), faces), cloth(), SheetModel::Shell, forces)).unwrap();
    for step in 1..=100 {
        let lift = [0.0, 0.0, 0.005 * f64::from(step)];
        world.push_target_positions(id, points.iter().map(|p| add(*p, lift)).collect()).unwrap();
        world.push_attachment_targets(id, vec![add(points[48], lift)]).unwrap();
        run(&mut world, 0.01, 1);
    }
    run(&mut world, 0.01, 100);
    let x = world.positions(id).unwrap();
    for corner in [0, 6] {
        assert!(norm(sub(x[corner], add(points[corner], [0.0, 0.0, 0.5]))) < 1e-12, "{:?}", x[corner]);
    }
    let stretched = norm(sub(x[48], add(points[48], [0.0, 0.0, 0.5])));
    assert!(stretched < 0.05, "the spring holds the third corner: {stretched}");
    assert!(x[24][2] < 0.5, "the middle sags");
}

#[test]
fn a_divided_step_is_assembled_anew_and_stays_clean() {
    // Fast cloth, and a single round: what it hits divides the step.
    let (points, faces) = grid(8, 8, 0.4, 0.4);
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    let raised: Vec<Vec3> = points.iter().map(|p| add(*p, [-0.2, -0.2, 0.3])).collect();
    let velocities = vec![[0.0, 0.0, -20.0]; raised.len()];
    let forces = NodeForces { velocities, ..NodeForces::default() };
    let id = world.add_sheet(sheet((raised, faces), cloth(), SheetModel::Shell, forces)).unwrap();
    world.add_rigid(rigid_box([0.0; 3], true)).unwrap();
    let mut divided = false;
    for _ in 0..20 {
        let settings = Settings { rounds_max: 1, certify: true, ..Settings::default() };
        let report = world.step(&settings, 0.01, Par::Serial).unwrap();
        divided |= report.parts > 1;
        assert_eq!(report.intersections, Some(0));
    }
    assert!(divided);
    assert!(world.positions(id).unwrap().iter().flatten().all(|c| c.is_finite()));
}

#[test]
fn what_cannot_be_made_is_refused_with_place_and_value() {
    let (points, faces) = grid(2, 2, 1.0, 1.0);
    let mut world = World::new();
    let fault = |world: &mut World, material: SheetMaterial, forces: NodeForces| {
        let description = sheet((points.clone(), faces.clone()), material, SheetModel::Shell, forces);
        let error = world.add_sheet(description).unwrap_err();
        (error.fault, error.index, error.value)
    };
    let bad = SheetMaterial { young_modulus: -1.0, ..cloth() };
    assert_eq!(fault(&mut world, bad, NodeForces::default()), (Fault::InvalidArgument, 0, -1.0));
    let springs = vec![([0, 1], 1.0), ([3, 99], 1.0)];
    let forces = NodeForces { springs, ..NodeForces::default() };
    let error = fault(&mut world, cloth(), forces);
    assert_eq!((error.0, error.2), (Fault::InvalidArgument, 99.0));
    let attachments = vec![Attachment { node: 9, stiffness: 1.0, damping: 0.0 }];
    let forces = NodeForces { attachments, ..NodeForces::default() };
    assert_eq!(fault(&mut world, cloth(), forces), (Fault::InvalidArgument, 0, 9.0));
    let forces = NodeForces { pinned: vec![true; 4], ..NodeForces::default() };
    assert_eq!(fault(&mut world, cloth(), forces).0, Fault::BufferLayout);
    let (nodes, mut tetrahedra) = block([1, 1, 1], [1.0; 3], [0.0; 3]);
    tetrahedra.push([0, 1, 2, 3]);
    let error = world.add_solid(solid((nodes.clone(), tetrahedra.clone()), soft(), NodeForces::default())).unwrap_err();
    assert_eq!((error.fault, error.index), (Fault::BadTopology, 5));
    tetrahedra.pop();
    let far = SolidDescription {
        embedded: Some((vec![[0.5; 3], [50.0; 3]], Topology::default())),
        ..solid((nodes.clone(), tetrahedra.clone()), soft(), NodeForces::default())
    };
    assert_eq!(world.add_solid(far).unwrap_err().index, 1);
    // A body with a matrix of its own takes no system of the host's.
    let id = world.add_solid(solid((nodes, tetrahedra), soft(), NodeForces::default())).unwrap();
    let offsets = (0..=8).collect();
    assert_eq!(world.add_system(vec![id], offsets, (0..8).collect(), false).unwrap_err().object, id);
}
