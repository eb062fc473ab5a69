//! What textbooks say.

use crate::scenes::{NO_DAMPING, block, grid, options, run, sheet, sheet_material, solid, solid_material};
use signorini::energy::{Attachment, Damping, SheetMaterial, SolidMaterial};
use signorini::kinematics::Pose;
use signorini::math::{Mat3, Vec3, add_scaled, cross, dot, mat_vec, norm, sub};
use signorini::model::Settings;
use signorini::parallel::Par;
use signorini::world::{NodeForces, Outcome, RigidDescription, SheetModel, Topology, World};

const GRAVITY: Vec3 = [0.0, 0.0, -9.81];

/// A strip one cell wide that hangs from its two ends takes the shape of a chain.
#[test]
fn a_hanging_strip_is_a_catenary() {
    let (columns, span, slack) = (60, 1.0, 1.3);
    let (rest, faces) = grid(columns, 1, slack * span, 0.02);
    // Folded to the span, sagging a little, so that it falls to the right side.
    let start: Vec<Vec3> = rest
        .iter()
        .map(|p| {
            let s = p[0] / slack;
            [s, p[1], -2.0 * s * (span - s)]
        })
        .collect();
    let material = SheetMaterial {
        young_modulus: 1e7,
        bending_stiffness: Some(0.0),
        damping: Damping { mass_rate: 4.0, ..NO_DAMPING },
        ..sheet_material()
    };
    let pinned = (0..rest.len() as u32).map(|i| [0, columns].contains(&(i % (columns + 1)))).collect();
    let mut description =
        sheet((start, faces), material, SheetModel::Shell, NodeForces { pinned, ..NodeForces::default() });
    description.rest = rest;
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    let id = world.add_sheet(description).unwrap();
    run(&mut world, 0.02, 500);
    // z = a (cosh((x - 1/2)/a) - cosh(1/(2 a))) with 2 a sinh(1/(2 a)) the length.
    let (mut low, mut high) = (0.05, 5.0);
    for _ in 0..200 {
        let a: f64 = 0.5 * (low + high);
        if 2.0 * a * (0.5 / a).sinh() > slack * span { low = a } else { high = a }
    }
    let a = low;
    let depth = a * ((0.5 / a).cosh() - 1.0);
    for p in world.positions(id).unwrap() {
        let expected = a * (((p[0] - 0.5) / a).cosh() - (0.5 / a).cosh());
        assert!((p[2] - expected).abs() < 0.01 * depth, "{p:?}: {expected}");
    }
}

/// A thin shell clamped at one end bends as Euler and Bernoulli's beam under a small load.
#[test]
fn a_shell_cantilever_bends_as_a_beam() {
    let (length, width, h) = (0.5, 0.004, 2e-3);
    let material = SheetMaterial {
        young_modulus: 2e8,
        thickness: h,
        density: 1000.0,
        damping: Damping { mass_rate: 6.0, ..NO_DAMPING },
        ..sheet_material()
    };
    let columns = 40;
    // One cell wide and narrow: a strip also folds at its diagonals, which makes it softer by (w^2 / (a^2 + w^2))^2 for
    // cells a long and w wide, here one per cent.
    let (points, faces) = grid(columns, 1, length, width);
    // The first two columns are clamped; the hinge at the second one bends for half a cell on either side.
    let pinned = (0..points.len() as u32).map(|i| i % (columns + 1) < 2).collect();
    let mut world = World::new();
    let g = 0.2;
    world.set_gravity([0.0, 0.0, -g]).unwrap();
    let description =
        sheet((points, faces), material, SheetModel::Shell, NodeForces { pinned, ..NodeForces::default() });
    let id = world.add_sheet(description).unwrap();
    run(&mut world, 0.05, 400);
    // q L^4 / (8 E I).
    let free = length * (1.0 - 0.5 / f64::from(columns));
    let (load, inertia) = (material.density * h * width * g, width * h.powi(3) / 12.0);
    let deflection = load * free.powi(4) / (8.0 * material.young_modulus * inertia);
    let tip = world.positions(id).unwrap().iter().filter(|p| p[0] > 0.99 * length).fold(0.0, |a: f64, p| a.min(p[2]));
    assert!((-tip / deflection - 1.0).abs() < 0.03, "{tip} {deflection}");
}

/// A bar of linear tetrahedra is stiffer than the beam, and comes closer to it as it is refined.
#[test]
fn a_solid_cantilever_converges_to_a_beam() {
    let (length, side) = (1.0, 0.2);
    let material =
        SolidMaterial { young_modulus: 1e6, damping: Damping { mass_rate: 10.0, ..NO_DAMPING }, ..solid_material() };
    let g = 0.05;
    let ratio = |cells: [u32; 3]| {
        let (points, tetrahedra) = block(cells, [length, side, side], [0.0; 3]);
        let pinned = points.iter().map(|p| p[0] == 0.0).collect();
        let forces = NodeForces { pinned, ..NodeForces::default() };
        let mut world = World::new();
        world.set_gravity([0.0, 0.0, -g]).unwrap();
        let id = world.add_solid(solid((points, tetrahedra), material, forces)).unwrap();
        run(&mut world, 0.05, 150);
        let tip: Vec<f64> =
            world.positions(id).unwrap().iter().filter(|p| p[0] > 0.99 * length).map(|p| p[2] - 0.5 * side).collect();
        let mean = tip.iter().sum::<f64>() / tip.len() as f64;
        let (load, inertia) = (material.density * side * side * g, side.powi(4) / 12.0);
        let bending = load * length.powi(4) / (8.0 * material.young_modulus * inertia);
        // Timoshenko's shear term for a square section without Poisson's effect: q L^2 / (2 k G A).
        let shear = load * length.powi(2) / (2.0 * 5.0 / 6.0 * 0.5 * material.young_modulus * side * side);
        -mean / (bending + shear)
    };
    let (coarse, fine) = (ratio([10, 2, 2]), ratio([20, 4, 4]));
    assert!(coarse > 0.4 && coarse < fine && fine < 1.02, "{coarse} {fine}");
    assert!(1.0 - fine < 0.55 * (1.0 - coarse), "{coarse} {fine}");
}

/// Nodes on springs, hardly held together by the sheet: backward Euler has its own closed form,
/// `x_n = (v0/w) (1 + w^2 dt^2)^(-n/2) sin(n atan(w dt))`: a damping ratio of about `w dt / 2`.
#[test]
fn a_spring_swings_at_its_frequency_with_the_damping_of_backward_euler() {
    let (points, faces) = grid(1, 1, 1.0, 1.0);
    let (stiffness, v0, dt) = (100.0, 0.3, 2e-3);
    let attachments = (0..4).map(|node| Attachment { node, stiffness, damping: 0.0 }).collect();
    let material =
        SheetMaterial { density: 1200.0, young_modulus: 1e-6, bending_stiffness: Some(0.0), ..sheet_material() };
    let masses = material.lumped_masses(&points, &faces).unwrap();
    let forces = NodeForces { attachments, velocities: vec![[0.0, 0.0, v0]; 4], ..NodeForces::default() };
    let mut world = World::new();
    let id = world.add_sheet(sheet((points, faces), material, SheetModel::Shell, forces)).unwrap();
    let mut turned = [false; 4];
    for n in 1..=500 {
        run(&mut world, dt, 1);
        for (i, p) in world.positions(id).unwrap().iter().enumerate() {
            let w = (stiffness / masses[i]).sqrt();
            let (decay, phase) = ((1.0 + (w * dt).powi(2)).powf(-0.5 * f64::from(n)), f64::from(n) * (w * dt).atan());
            let expected = v0 / w * decay * phase.sin();
            assert!((p[2] - expected).abs() < 1e-5 * v0 / w, "{n} {i}: {} {expected}", p[2]);
            turned[i] |= p[2] < -0.3 * v0 / w;
        }
    }
    assert_eq!(turned, [true; 4], "every node swings through");
}

#[test]
fn a_free_body_falls_as_galilei_says_and_drag_gives_a_terminal_velocity() {
    let (points, faces) = grid(4, 4, 1.0, 1.0);
    let material = sheet_material();
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    let falling =
        world.add_sheet(sheet((points.clone(), faces.clone()), material, SheetModel::Shell, NodeForces::default()));
    let shifted: Vec<Vec3> = points.iter().map(|p| add_scaled(*p, 1.0, [5.0, 0.0, 0.0])).collect();
    let drag = NodeForces { drag: 0.6, ..NodeForces::default() };
    let gliding = world.add_sheet(sheet((shifted, faces), material, SheetModel::Shell, drag)).unwrap();
    let (dt, steps) = (0.01, 300);
    run(&mut world, dt, steps);
    // Backward Euler: x = g dt^2 n (n + 1) / 2, exactly.
    let n = steps as f64;
    let expected = -9.81 * dt * dt * n * (n + 1.0) / 2.0;
    for p in world.positions(falling.unwrap()).unwrap() {
        assert!((p[2] - expected).abs() < 1e-6 * expected.abs(), "{} {expected}", p[2]);
    }
    // m g = c A v^2.
    let terminal = (material.density * material.thickness * 9.81 / 0.6_f64).sqrt();
    let mean: f64 = world.outcome(gliding, Outcome::Velocity).unwrap().iter().map(|v| v[2]).sum::<f64>() / 25.0;
    assert!((-mean / terminal - 1.0).abs() < 0.01, "{mean} {terminal}");
}

#[test]
fn momentum_of_a_free_spinning_solid_is_kept() {
    let (points, tetrahedra) = block([3, 2, 1], [0.6, 0.4, 0.2], [0.0; 3]);
    let spin = [1.0, 2.0, 3.0];
    let centre = [0.3, 0.2, 0.1];
    let velocities: Vec<Vec3> = points.iter().map(|p| cross(spin, sub(*p, centre))).collect();
    let material = SolidMaterial { young_modulus: 1e5, poisson_ratio: 0.3, ..solid_material() };
    let forces = NodeForces { velocities: velocities.clone(), ..NodeForces::default() };
    let mut world = World::new();
    let id = world.add_solid(solid((points.clone(), tetrahedra.clone()), material, forces)).unwrap();
    let masses = signorini::mesh::TetMesh::new(points.clone(), tetrahedra).unwrap().lumped_masses(1000.0);
    let sums = |x: &[Vec3], v: &[Vec3]| {
        let mut p = [0.0; 3];
        let mut l = [0.0; 3];
        for i in 0..x.len() {
            p = add_scaled(p, masses[i], v[i]);
            l = add_scaled(l, masses[i], cross(x[i], v[i]));
        }
        (p, l)
    };
    let (p0, l0) = sums(&points, &velocities);
    run(&mut world, 0.005, 100);
    let (x, v) = (world.positions(id).unwrap(), world.outcome(id, Outcome::EndVelocity).unwrap());
    let (p1, l1) = sums(x, &v);
    let scale = masses.iter().sum::<f64>();
    assert!(norm(sub(p1, p0)) < 1e-5 * scale, "{p0:?} {p1:?}");
    // Angular momentum is kept by the forces but not by one linearised step: what is lost is numerical damping.
    assert!(norm(l1) < norm(l0) * 1.001 && norm(l1) > 0.9 * norm(l0), "{l0:?} {l1:?}");
}

#[test]
fn a_free_rigid_body_keeps_its_angular_momentum_through_the_step() {
    let inertia: Mat3 = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.3]];
    let mut world = World::new();
    world.set_gravity(GRAVITY).unwrap();
    let id = world
        .add_rigid(RigidDescription {
            options: options(),
            vertices: vec![[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
            topology: Topology::default(),
            mass: 2.0,
            inertia,
            inertia_in_world: false,
            pose: Pose::IDENTITY,
            velocity: [1.0, 0.0, 0.0],
            angular_velocity: [0.01, 6.0, 0.01],
            own_dynamics: Some([0.0, 0.0]),
        })
        .unwrap();
    let momentum = |pose: Pose, w: Vec3| {
        let r = pose.rotation();
        let body = signorini::math::mat_transpose_vec(&r, w);
        mat_vec(&r, mat_vec(&inertia, body))
    };
    let first = momentum(Pose::IDENTITY, [0.01, 6.0, 0.01]);
    let mut middle = Vec::new();
    for _ in 0..600 {
        world.step(&Settings::default(), 0.005, Par::Serial).unwrap();
        let w = world.angular_outcome(id, Outcome::EndVelocity).unwrap();
        let pose = world.pose(id).unwrap();
        let l = momentum(pose, w);
        assert!(norm(sub(l, first)) < 1e-9 * norm(first), "{l:?}");
        middle.push(signorini::math::mat_transpose_vec(&pose.rotation(), w)[1]);
        assert!(dot(w, l) <= dot([0.01, 6.0, 0.01], first) * (1.0 + 1e-9), "energy never grows");
    }
    assert!(middle.iter().any(|w| *w < -1.0), "Dzhanibekov: it turns over");
    assert!((world.pose(id).unwrap().position[0] - 3.0).abs() < 1e-9);
}
