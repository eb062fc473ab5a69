//! Snapshots: the same bits from there on, in this world and another; ids; bytes that are none of ours.

use signorini::kinematics::Pose;
use signorini::math::{Vec3, add_scaled};
use signorini::model::{HalfSpace, Material, Settings};
use signorini::parallel::Par;
use signorini::world::{
    BodyOptions, DeformableDescription, Fault, KinematicDescription, Outcome, RigidDescription, SymmetrySlack,
    Topology, World,
};

const DT: f64 = 0.01;
const GRAVITY: Vec3 = [0.0, 0.0, -9.81];

/// A 5 x 5 sheet with a host matrix over a floor, a rigid tetrahedron that falls on it, and a kinematic triangle.
struct Scene {
    world: World,
    sheet: u64,
    rigid: u64,
    lid: u64,
}

fn corners(size: f64) -> Vec<Vec3> {
    vec![[size, size, size], [size, -size, -size], [-size, size, -size], [-size, -size, size]]
}

fn scene() -> Scene {
    let mut world = World::new();
    let material = world
        .add_material(Material { friction_coefficient: 0.4, combine_rule: Default::default(), restitution: 0.0 })
        .unwrap();
    let options = BodyOptions { half_thickness: Some(0.005), material, ..BodyOptions::default() };
    let n = 5u32;
    let positions: Vec<Vec3> =
        (0..n * n).map(|k| [0.1 * f64::from(k % n), 0.1 * f64::from(k / n), 0.02 + 1e-3 * f64::from(k % 3)]).collect();
    let cell = |k: u32| [[k, k + 1, k + n + 1], [k, k + n + 1, k + n]];
    let triangles = (0..n * n).filter(|k| k % n < n - 1 && k / n < n - 1).flat_map(cell).collect();
    let topology = Topology { triangles, ..Topology::default() };
    let masses = vec![0.01; positions.len()];
    let sheet = world
        .add_deformable(DeformableDescription { options, positions, topology, masses, ..Default::default() })
        .unwrap();
    let triangles = vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    let inertia = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
    let pose = Pose { position: [0.2, 0.2, 0.12], orientation: [0.1, 0.2, 0.3, 0.86f64.sqrt()] };
    let rigid = world
        .add_rigid(RigidDescription {
            options,
            vertices: corners(0.05),
            topology: Topology { triangles, ..Topology::default() },
            mass: 0.1,
            inertia,
            inertia_in_world: false,
            pose,
            velocity: [0.0; 3],
            angular_velocity: [0.0, 1.0, 0.0],
            own_dynamics: None,
        })
        .unwrap();
    let vertices = vec![[0.0, 0.0, 0.4], [0.4, 0.0, 0.4], [0.0, 0.4, 0.4]];
    let topology = Topology { triangles: vec![[0, 1, 2]], ..Topology::default() };
    let lid = world.add_kinematic(KinematicDescription { options, vertices, topology, pose: None }).unwrap();
    world.add_half_space(options, HalfSpace { normal: [0.0, 0.0, 1.0], offset: 0.0 }).unwrap();
    let offsets = (0..=(n * n) as usize).collect();
    let system = world.add_system(vec![sheet], offsets, (0..n * n).collect(), false).unwrap();
    let block = [[0.012, 0.0, 0.0], [0.0, 0.011, 0.0], [0.0, 0.0, 0.01]];
    world.push_system(system, vec![block; (n * n) as usize], SymmetrySlack::Double).unwrap();
    Scene { world, sheet, rigid, lid }
}

impl Scene {
    /// One step under gravity; its hash.
    fn step(&mut self) -> u64 {
        let world = &mut self.world;
        for id in [self.sheet, self.rigid] {
            let velocities = world.outcome(id, Outcome::EndVelocity).unwrap();
            world.push_velocities(id, velocities.iter().map(|v| add_scaled(*v, DT, GRAVITY)).collect()).unwrap();
        }
        let spin = world.angular_outcome(self.rigid, Outcome::EndVelocity).unwrap();
        world.push_angular_velocity(self.rigid, spin).unwrap();
        let lid = world.positions(self.lid).unwrap().iter().map(|x| add_scaled(*x, 1.0, [0.0, 0.0, -1e-3])).collect();
        world.push_target_positions(self.lid, lid).unwrap();
        world.step(&Settings::default(), DT, Par::Serial).unwrap();
        world.state_hash()
    }

    fn steps(&mut self, count: usize) -> Vec<u64> {
        (0..count).map(|_| self.step()).collect()
    }

    fn save(&self) -> Vec<u8> {
        let mut bytes = vec![0xaa; self.world.snapshot_size()];
        assert_eq!(self.world.save_snapshot(&mut bytes), Ok(bytes.len()));
        bytes
    }
}

#[test]
fn the_same_steps_follow_a_snapshot_in_this_world_and_another() {
    let mut scene = scene();
    scene.steps(25);
    assert!(scene.world.contacts().iter().any(|c| c.state > 0), "warm starts are part of what is tested");
    let saved = scene.save();
    let hash = scene.world.state_hash();
    let onward = scene.steps(15);
    scene.world.load_snapshot(&saved).unwrap();
    assert_eq!(scene.world.state_hash(), hash);
    assert_eq!(scene.save(), saved, "what was loaded is saved again bit for bit");
    assert_eq!(scene.steps(15), onward);
    let mut other = self::scene();
    other.world.load_snapshot(&saved).unwrap();
    assert_eq!(other.steps(15), onward, "ids of the other world name the same bodies");
}

#[test]
fn ids_given_out_after_a_snapshot_are_stale_and_never_given_out_again() {
    let mut scene = scene();
    let saved = scene.save();
    let options = BodyOptions::default();
    let plane = HalfSpace { normal: [0.0, 0.0, 1.0], offset: -5.0 };
    scene.world.remove_body(scene.lid).unwrap();
    let later = [(); 3].map(|()| scene.world.add_half_space(options, plane).unwrap());
    scene.world.load_snapshot(&saved).unwrap();
    assert!(scene.world.body_info(scene.lid).is_ok(), "what was removed after the snapshot is there again");
    for id in later {
        assert_eq!(scene.world.body_info(id).unwrap_err().fault, Fault::StaleId);
    }
    scene.world.remove_body(scene.lid).unwrap();
    for _ in 0..4 {
        let id = scene.world.add_half_space(options, plane).unwrap();
        assert!(id != scene.lid && !later.contains(&id), "an id was given out twice");
    }
}

#[test]
fn other_bytes_are_refused_and_change_nothing() {
    let mut scene = scene();
    scene.steps(20);
    let saved = scene.save();
    let hash = scene.world.state_hash();
    let mut small = vec![7; saved.len() - 1];
    let error = scene.world.save_snapshot(&mut small).unwrap_err();
    assert_eq!((error.fault, error.value), (Fault::BufferLayout, saved.len() as f64));
    assert!(small.iter().all(|byte| *byte == 7));
    let mut refused = |bytes: &[u8]| {
        assert_eq!(scene.world.load_snapshot(bytes).unwrap_err().fault, Fault::SnapshotMismatch);
        assert_eq!(scene.world.state_hash(), hash);
    };
    for length in (0..saved.len()).step_by(97) {
        refused(&saved[..length]);
    }
    for place in (0..saved.len()).step_by(53) {
        let mut damaged = saved.clone();
        damaged[place] ^= 1 << (place % 8);
        refused(&damaged);
    }
    let mut longer = saved.clone();
    longer.push(0);
    refused(&longer);
}

/// The library's checksum: of bytes, eight at a time as they were put. Found again here from its description, so that
/// forged snapshots pass it.
fn forge(bytes: &mut [u8], saved: &[u8]) -> bool {
    let payload = &bytes[28..];
    let mut hash = 0x243f_6a88_85a3_08d3_u64;
    for chunk in payload.chunks(8) {
        let mut word = [0u8; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        hash = (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^= hash >> 29;
    }
    bytes[20..28].copy_from_slice(&hash.to_le_bytes());
    bytes != saved
}

#[test]
fn a_forged_snapshot_is_refused_or_makes_a_world_that_steps() {
    let mut scene = scene();
    scene.steps(20);
    let saved = scene.save();
    let mut untouched = saved.clone();
    assert!(!forge(&mut untouched, &saved), "the forger knows the checksum");
    let mut random = 0x1234_5678_9abc_def1_u64;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let (mut loaded, mut refused) = (0, 0);
    for _ in 0..3000 {
        let mut bytes = saved.clone();
        for _ in 0..1 + next() % 3 {
            let place = 28 + (next() % (bytes.len() as u64 - 28)) as usize;
            let value =
                [0, 1, 0x7f, 0x80, 0xf0, 0xff, next() as u8, bytes[place].wrapping_add(1)][(next() % 8) as usize];
            bytes[place] = value;
        }
        if !forge(&mut bytes, &saved) {
            continue;
        }
        let mut world = World::new();
        match world.load_snapshot(&bytes) {
            Ok(()) => {
                loaded += 1;
                // Whatever it says, it is one of the outcomes of a step.
                let _ = world.step(&Settings { iterations_max: 50, ..Settings::default() }, DT, Par::Serial);
                world.state_hash();
            }
            Err(error) => {
                refused += 1;
                assert!(matches!(error.fault, Fault::SnapshotMismatch), "{error:?}");
            }
        }
    }
    assert!(loaded > 200 && refused > 200, "{loaded} loaded, {refused} refused: both ways are tried");
}
