//! What a step allocates once its buffers have their size, by a counting allocator: a crate of its own, because a global
//! allocator is one per program.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod solves;

use signorini::constraint::Metric;
use signorini::dynamics::{Accelerations, Unconstrained};
use signorini::energy::{Damping, SheetMaterial, SolidMaterial};
use signorini::kinematics::Pose;
use signorini::math::{IDENTITY, Vec3, mat_scale};
use signorini::mesh::Surface;
use signorini::mesh::TetMesh;
use signorini::model::{
    BodyDescription, Dynamics, HalfSpace, Kind, Material, Materials, Model, Precision, Segment, Settings,
};
use signorini::parallel::Par;
use signorini::world::{
    BodyOptions, NodeForces, RigidDescription, SheetDescription, SheetModel, SolidDescription, Topology, World,
};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

/// Counts calls that take memory.
struct Counting;

thread_local! {
    /// Calls of this thread: tests run side by side.
    static CALLS: Cell<u64> = const { Cell::new(0) };
    /// Bytes that this thread took and did not give back, and the most that there were.
    static HELD: Cell<[i64; 2]> = const { Cell::new([0; 2]) };
}

fn count() {
    // A thread that ends has no counter any more, and counts for nobody.
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
}

fn hold(bytes: i64) {
    let _ = HELD.try_with(|held| {
        let [now, most] = held.get();
        held.set([now + bytes, most.max(now + bytes)]);
    });
}

// SAFETY: everything is left to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        hold(layout.size() as i64);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        hold(-(layout.size() as i64));
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        hold(size as i64 - layout.size() as i64);
        // SAFETY: as the caller promises.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations that `f` makes.
fn allocations(f: impl FnOnce()) -> u64 {
    let before = CALLS.get();
    f();
    CALLS.get() - before
}

fn sheet_material() -> SheetMaterial {
    SheetMaterial {
        density: 200.0,
        thickness: 1e-3,
        young_modulus: 1e6,
        poisson_ratio: 0.3,
        bending_stiffness: Some(1e-5),
        flat: true,
        rest_scale: 1.0,
        damping: Damping { mass_rate: 1.0, stretch_time: 1e-3, bending_time: 1e-3 },
    }
}

/// A square of `n` by `n` cells of 2 cm.
fn grid(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let points = (0..=n).flat_map(|j| (0..=n).map(move |i| [0.02 * f64::from(i), 0.02 * f64::from(j), 0.0015]));
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let faces = cells
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    (points.collect(), faces.collect())
}

/// A cloth, which takes conjugate gradients, and a tetrahedron, which takes the direct factor.
fn model() -> Model {
    let (points, faces) = grid(24);
    let material = sheet_material();
    let masses = material.lumped_masses(&points, &faces).unwrap();
    let count = points.len();
    let forces = material.shell(&points, &faces).unwrap();
    let cloth =
        body(1, Surface::from_triangles(points, faces).unwrap(), masses, Dynamics::deformable(forces, count).unwrap());
    let corners = vec![[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.0, 0.1, 1.0], [0.0, 0.0, 1.1]];
    let mesh = TetMesh::new(corners.clone(), vec![[0, 1, 2, 3]]).unwrap();
    let damping = sheet_material().damping;
    let material = SolidMaterial { density: 1e3, young_modulus: 1e5, poisson_ratio: 0.3, rest_scale: 1.0, damping };
    let dynamics = Dynamics::deformable(material.solid(&mesh).unwrap(), 4).unwrap();
    let surface = Surface::from_triangles(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
    let solid = body(2, surface, mesh.lumped_masses(1e3), dynamics);
    let mut rigid = solid.clone();
    rigid.key = 3;
    rigid.kind = Kind::Rigid { mass: 1.0, inertia: mat_scale(1e-3, &IDENTITY) };
    rigid.dynamics = Some(Arc::new(Dynamics::Rigid { linear_damping: 0.0, angular_damping: 0.0 }));
    let material = Material { friction_coefficient: 0.5, combine_rule: Default::default(), restitution: 0.0 };
    Model::build(vec![cloth, solid, rigid], Materials { list: vec![material], overrides: vec![] }, vec![]).unwrap()
}

fn body(key: u64, surface: Surface, masses: Vec<f64>, dynamics: Dynamics) -> BodyDescription {
    let pinned = vec![false; masses.len()];
    BodyDescription {
        key,
        surface: Arc::new(surface),
        kind: Kind::Deformable { masses, pinned },
        half_thickness: Some(1e-3),
        material: 0,
        groups: 1,
        mask: 1,
        self_collision: true,
        precision: Precision::Double,
        embedding: None,
        dynamics: Some(Arc::new(dynamics)),
    }
}

/// Stages 1 and 2: assembly, both kinds of unconstrained solve, rigid motion, the metric.
#[test]
fn dynamics_and_metric_of_a_steady_step_allocate_nothing() {
    let model = model();
    let mut state = model.rest_state();
    let mut drives = model.idle_drives(&state);
    drives.gravity = [0.0, 0.0, -9.81];
    let (mut own, mut metric, mut accelerations) = (Unconstrained::default(), Metric::default(), Accelerations::new());
    let mut iterations = 0;
    for step in 0..6 {
        for (block, v) in state.velocities.iter_mut().enumerate() {
            v[2] += 0.1 * f64::sin((block + step) as f64);
        }
        let dt = 0.004;
        let segment =
            Segment { model: &model, drives: &drives, step_start: &state, start: &state, from: 0.0, to: 1.0, dt };
        let count = allocations(|| {
            own.assign(&segment, &accelerations, Par::Serial);
            metric.assign(&model, &state, &own.drives).unwrap();
            own.keep_accelerations(&segment, &mut accelerations);
        });
        assert!(step < 2 || count == 0, "step {step}: {count}");
        iterations += own.iterations;
        assert!(own.converged);
    }
    assert!(iterations > 5, "{iterations}");
    assert!(allocations(|| drop(std::hint::black_box(vec![0_u8; 100]))) > 0, "the allocator counts");
}

/// A world that the library drives, with a ground if asked for.
fn world(ground: bool) -> World {
    let mut world = World::new();
    if ground {
        world.add_half_space(BodyOptions::default(), HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 }).unwrap();
    }
    world.set_gravity([0.0, 0.0, -9.81]).unwrap();
    world
}

fn options() -> BodyOptions {
    BodyOptions { half_thickness: Some(1e-3), ..BodyOptions::default() }
}

/// Adds a sheet, this much higher than just above the ground.
fn add_sheet(world: &mut World, n: u32, higher: f64) {
    let (mut positions, faces) = grid(n);
    positions.iter_mut().for_each(|x| x[2] += higher);
    world
        .add_sheet(SheetDescription {
            options: options(),
            positions,
            rest: Vec::new(),
            topology: Topology { triangles: faces, ..Topology::default() },
            material: sheet_material(),
            model: SheetModel::Shell,
            forces: NodeForces::default(),
        })
        .unwrap();
}

/// Corners and faces of a cube of 10 cm about the origin.
fn cube() -> (Vec<Vec3>, Topology) {
    let corner = |i: usize| std::array::from_fn(|k| if i >> k & 1 == 1 { 0.05 } else { -0.05 });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    ((0..8).map(corner).collect(), Topology { triangles, ..Topology::default() })
}

/// Adds a rigid cube with its centre at this height; the library drives it, or a host.
fn add_cube(world: &mut World, height: f64, own_dynamics: Option<[f64; 2]>) -> u64 {
    let (vertices, topology) = cube();
    let description = RigidDescription {
        options: options(),
        vertices,
        topology,
        mass: 1.0,
        inertia: mat_scale(0.1 * 0.1 / 6.0, &IDENTITY),
        inertia_in_world: false,
        pose: Pose { position: [0.0, 0.0, height], ..Pose::IDENTITY },
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
        own_dynamics,
    };
    world.add_rigid(description).unwrap()
}

/// Adds a soft cube of five tetrahedra with its centre at this height.
fn add_soft_cube(world: &mut World, height: f64) {
    let damping = Damping { mass_rate: 1.0, stretch_time: 1e-3, bending_time: 1e-3 };
    let positions = cube().0.iter().map(|x| [x[0], x[1], x[2] + height]).collect();
    world
        .add_solid(SolidDescription {
            options: options(),
            positions,
            rest: Vec::new(),
            tetrahedra: vec![[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]],
            embedded: None,
            material: SolidMaterial { density: 1e3, young_modulus: 1e5, poisson_ratio: 0.3, rest_scale: 1.0, damping },
            host_driven: false,
            forces: NodeForces::default(),
        })
        .unwrap();
}

/// The most that one of eight steps allocates, and its active contacts, once the world has rested for a while.
fn of_a_resting_step(mut world: World, before: impl Fn(&mut World)) -> (u64, u32) {
    let step = |world: &mut World| {
        before(world);
        let mut report = None;
        let count = allocations(|| report = Some(world.step(&Settings::default(), 0.004, Par::Serial).unwrap()));
        let report = report.unwrap();
        assert!(!report.not_converged, "{report:?}");
        (count, report.active_contacts)
    };
    for _ in 0..400 {
        step(&mut world);
    }
    let last = [0; 8].map(|_| step(&mut world));
    (last.iter().map(|l| l.0).max().unwrap(), last[7].1)
}

/// The whole step of what rests, whatever rests there: search, rows, solve, sweep, results.
#[test]
fn a_resting_step_allocates_nothing() {
    let cloth = |n: u32, layers: &[f64]| {
        let mut world = world(true);
        layers.iter().for_each(|higher| add_sheet(&mut world, n, *higher));
        of_a_resting_step(world, |_| ())
    };
    let stack = || {
        let mut world = world(true);
        for height in [0.051, 0.153] {
            add_cube(&mut world, height, Some([0.0; 2]));
        }
        of_a_resting_step(world, |_| ())
    };
    let soft = || {
        let mut world = world(true);
        add_soft_cube(&mut world, 0.051);
        of_a_resting_step(world, |_| ())
    };
    let of_a_host = || {
        let mut world = world(true);
        let body = add_cube(&mut world, 0.051, None);
        of_a_resting_step(world, |world| world.push_velocities(body, vec![[0.0, 0.0, -9.81 * 0.004]]).unwrap())
    };
    for (name, (count, active), least) in [
        ("81 vertices", cloth(8, &[0.0]), 81),
        ("625 vertices", cloth(24, &[0.0]), 500),
        ("cloth on cloth", cloth(12, &[0.0, 0.0025]), 500),
        ("rigid cubes on each other", stack(), 8),
        ("a soft cube", soft(), 4),
        ("a rigid cube that a host drives", of_a_host(), 4),
    ] {
        assert!(count == 0 && active >= least, "{name}: {count} allocations, {active} contacts push");
    }
}

/// Bytes per vertex of a world, its most within steps, and what contacts add to that.
#[test]
fn memory_grows_with_vertices_and_contacts_and_is_bounded_by_them() {
    let of = |n: u32, ground: bool| {
        let before = HELD.get()[0];
        let mut world = world(ground);
        add_sheet(&mut world, n, 0.0);
        let mut contacts = 0;
        for step in 0..60 {
            if step == 30 {
                HELD.set([HELD.get()[0]; 2]);
            }
            contacts = world.step(&Settings::default(), 0.004, Par::Serial).unwrap().contacts;
        }
        let [now, most] = HELD.get().map(|bytes| (bytes - before) as f64);
        drop(world);
        assert_eq!(HELD.get()[0], before, "a world that is dropped gives everything back");
        (now, most, f64::from(contacts))
    };
    for n in [16, 48] {
        let vertices = f64::from((n + 1) * (n + 1));
        let ((falling, most_falling, none), (resting, most_resting, contacts)) = (of(n, false), of(n, true));
        assert!(none == 0.0 && contacts >= 0.9 * vertices, "{none} {contacts}");
        let [held, step] = [falling, most_falling - falling].map(|bytes| bytes / vertices);
        let [kept, solved] = [resting - falling, most_resting - most_falling].map(|bytes| bytes / contacts);
        println!(
            "{vertices} vertices: {held:.0} bytes a vertex held, {step:.0} more within a step; a contact {kept:.0} held, \
             {solved:.0} at the most"
        );
        assert!(held <= HELD_PER_VERTEX && held + step <= MOST_PER_VERTEX && solved <= MOST_PER_CONTACT);
    }
}

/// Bytes for a vertex of a MODEL sheet between steps, and at most within one; bytes for a contact at most within one.
const HELD_PER_VERTEX: f64 = 8e3;
const MOST_PER_VERTEX: f64 = 9e3;
const MOST_PER_CONTACT: f64 = 3e3;
