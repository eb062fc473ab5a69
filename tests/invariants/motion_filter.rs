//! The velocity filter alone: what is sent through something arrives beside it, everything else where it was sent.

use crate::support::shapes::{Triangles, cloth_grid, sphere};
use crate::world::Jitter;
use signorini::contact_search::{BodyFilter, intersections};
use signorini::math::{Vec3, add, norm, scale, sub};
use signorini::model::*;
use signorini::parallel::Par;
use signorini::world::{Fault, Motion, MotionFilter, MotionFilterDescription, Topology};
use std::sync::Arc;

const DT: f64 = 0.01;
const HALF_THICKNESS: f64 = 1e-3;

/// A host's mesh of several parts.
#[derive(Clone, Default)]
struct Mesh {
    x: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    masses: Vec<f64>,
    groups: Vec<u32>,
}

impl Mesh {
    fn add(&mut self, part: &Triangles, offset: Vec3, group: u32, mass: f64) -> std::ops::Range<usize> {
        let first = self.x.len();
        self.x.extend(part.positions.iter().map(|x| add(*x, offset)));
        self.triangles.extend(part.faces.iter().map(|f| f.map(|v| v + first as u32)));
        self.masses.resize(self.x.len(), mass);
        self.groups.resize(self.x.len(), group);
        first..self.x.len()
    }

    fn filter(&self, precision: Precision) -> MotionFilter {
        self.try_filter(precision).unwrap()
    }

    fn try_filter(&self, precision: Precision) -> Result<MotionFilter, signorini::world::WorldError> {
        MotionFilter::new(MotionFilterDescription {
            rest: self.x.clone(),
            topology: Topology { triangles: self.triangles.clone(), ..Topology::default() },
            masses: self.masses.clone(),
            groups: self.groups.clone(),
            half_thickness: Some(HALF_THICKNESS),
            friction_coefficient: 0.2,
            self_collision: true,
            precision,
        })
    }

    /// Intersections between any two triangles, whatever their group: by a model of its own.
    fn intersections(&self, x: &[Vec3]) -> usize {
        let mut surface =
            crate::world::surface(&Triangles { positions: self.x.clone(), faces: self.triangles.clone() });
        Arc::make_mut(&mut surface).rest.clone_from(&self.x);
        let body = BodyDescription {
            key: 1,
            surface,
            kind: Kind::Deformable { masses: vec![1.0; x.len()], pinned: vec![false; x.len()] },
            half_thickness: Some(0.0),
            material: 0,
            groups: 1,
            mask: 1,
            self_collision: true,
            precision: Precision::Double,
            embedding: None,
            dynamics: None,
        };
        let material = Material { friction_coefficient: 0.0, combine_rule: Default::default(), restitution: 0.0 };
        let model = Model::build(vec![body], Materials { list: vec![material], overrides: vec![] }, vec![]).unwrap();
        let state = State { positions: x.to_vec(), ..model.rest_state() };
        intersections(&model, &BodyFilter::new(&model), &state, Par::Serial).witnesses.len()
    }
}

fn settings() -> Settings {
    Settings { certify: true, ..Settings::default() }
}

fn run(filter: &mut MotionFilter, motion: Motion) -> StepReport {
    let report = filter.run(motion, &settings(), DT, Par::Serial, Watch::default());
    let report = report.unwrap_or_else(|failure| panic!("{:?} {:?}", failure.error, filter.witnesses()));
    assert_eq!(report.intersections, Some(0));
    report
}

/// A sheet above a scripted ball, in interleaved host order: the ball first, then half of the sheets.
fn sheet_over_ball(jitter: &mut Jitter) -> (Mesh, std::ops::Range<usize>, std::ops::Range<usize>) {
    let mut mesh = Mesh::default();
    let ball = mesh.add(&sphere([0.0; 3], 0.1, 2), [0.0; 3], 7, 0.0);
    let sheet = mesh.add(&cloth_grid(20, 0.6), [0.01, 0.02, 0.12], 3, 2e-3);
    for v in sheet.clone() {
        mesh.x[v] = add(mesh.x[v], jitter.vector(1e-3));
    }
    (mesh, ball, sheet)
}

#[test]
fn what_is_sent_through_something_stays_outside_and_the_rest_arrives() {
    for seed in 0..10 {
        let mut jitter = Jitter(seed);
        let (mesh, ball, sheet) = sheet_over_ball(&mut jitter);
        let x1: Vec<Vec3> = (0..mesh.x.len())
            .map(|v| add(mesh.x[v], if sheet.contains(&v) { [0.003, 0.0, -0.1] } else { [0.0, 0.001, 0.002] }))
            .collect();
        assert!(mesh.intersections(&x1) > 0, "the motion must go through the ball");
        for precision in [Precision::Double, Precision::Single] {
            let rounded = |x: &[Vec3]| -> Vec<Vec3> {
                let single = |x: &Vec3| x.map(|c| f64::from(c as f32));
                if precision == Precision::Single { x.iter().map(single).collect() } else { x.to_vec() }
            };
            let (x0, x1) = (rounded(&mesh.x), rounded(&x1));
            let mut filter = mesh.filter(precision);
            let report = run(&mut filter, Motion::Between(&x0, &x1));
            let end = filter.positions();
            assert_eq!(mesh.intersections(&end), 0, "seed {seed} {precision:?}");
            assert!(report.active_contacts > 0 && report.certified_fraction == 1.0, "{report:?}");
            for v in ball.clone() {
                assert_eq!(end[v], x1[v], "scripted vertices go where they are sent");
            }
            let far = sheet.clone().filter(|v| mesh.x[*v][0].hypot(mesh.x[*v][1]) > 0.2);
            for v in far {
                let miss = norm(sub(end[v], x1[v]));
                let allowed = if precision == Precision::Single { 0.0 } else { 1e-15 };
                assert!(miss <= allowed, "seed {seed}: vertex {v} misses by {miss:e}");
            }
            for v in 0..end.len() {
                let mean = scale(1.0 / DT, sub(end[v], x0[v]));
                assert!(norm(sub(mean, filter.velocities()[v])) < 1e-12 * (1.0 + norm(mean)));
                assert_eq!(rounded(&end)[v], end[v], "certified after rounding");
            }
        }
    }
}

/// Recorded: the sheet goes down through the ball and up again, then on for some frames.
fn recorded(mesh: &Mesh, sheet: &std::ops::Range<usize>) -> Vec<Vec<Vec3>> {
    let way = |frame: i32| if frame <= 6 { -0.02 * f64::from(frame) } else { -0.12 + 0.03 * f64::from(frame - 6) };
    let at = |frame: i32| {
        let moved = |v: usize| if sheet.contains(&v) { [0.0, 0.0, way(frame)] } else { [0.0; 3] };
        (0..mesh.x.len()).map(|v| add(mesh.x[v], moved(v))).collect()
    };
    (0..16).map(at).collect()
}

#[test]
fn displacement_mode_keeps_what_contact_changed() {
    let (mesh, _, sheet) = sheet_over_ball(&mut Jitter(3));
    let frames = recorded(&mesh, &sheet);
    let mut filter = mesh.filter(Precision::Double);
    let mut offsets: Vec<Vec<Vec3>> = Vec::new();
    for pair in frames.windows(2) {
        run(&mut filter, Motion::Displacement(&pair[0], &pair[1]));
        let end = filter.positions();
        assert_eq!(mesh.intersections(&end), 0);
        offsets.push(end.iter().zip(&pair[1]).map(|(a, b)| sub(*a, *b)).collect());
    }
    let largest = |o: &[Vec3]| o.iter().map(|o| norm(*o)).fold(0.0, f64::max);
    let (before_last, last) = (&offsets[offsets.len() - 2], &offsets[offsets.len() - 1]);
    assert!(largest(last) > 0.05, "what the ball held up stays up: {}", largest(last));
    for (a, b) in before_last.iter().zip(last) {
        assert!(norm(sub(*a, *b)) < 1e-14, "without contact the recorded displacement is the motion");
    }
}

#[test]
fn position_mode_comes_back_to_what_was_recorded() {
    let (mesh, _, sheet) = sheet_over_ball(&mut Jitter(3));
    let frames = recorded(&mesh, &sheet);
    let mut filter = mesh.filter(Precision::Double);
    let mut worst = 0.0_f64;
    for (i, pair) in frames.windows(2).enumerate() {
        let before = if i == 0 { pair[0].clone() } else { filter.positions() };
        let report = if i == 0 {
            run(&mut filter, Motion::Between(&pair[0], &pair[1]))
        } else {
            run(&mut filter, Motion::Towards(&pair[1]))
        };
        let end = filter.positions();
        // What stands still takes energy only: that of the wish is never surpassed but by thickness regained.
        let energy = |v: &dyn Fn(usize) -> Vec3| sheet.clone().map(|i| 1e-3 * norm(v(i)).powi(2)).sum::<f64>();
        let wished = energy(&|i| scale(1.0 / DT, sub(pair[1][i], before[i])));
        let found = energy(&|i| filter.velocities()[i]);
        assert!(found <= wished * (1.0 + 1e-9) + report.recovery_work, "frame {i}: {wished} J -> {found} J");
        // It follows as closely as it can: nothing is pushed higher than it must, frame after frame.
        let height = |x: &[Vec3]| sheet.clone().map(|v| x[v][2]).fold(-1.0, f64::max);
        assert!(height(&end) < height(&pair[1]).max(0.125) + 0.01, "frame {i}: {}", height(&end));
        assert_eq!(mesh.intersections(&end), 0);
        worst = end.iter().zip(&pair[1]).map(|(a, b)| norm(sub(*a, *b))).fold(worst, f64::max);
        if i + 2 == frames.len() {
            let off = end.iter().zip(&pair[1]).map(|(a, b)| norm(sub(*a, *b))).fold(0.0, f64::max);
            assert!(off < 1e-14, "off by {off:e}");
        }
    }
    assert!(worst > 0.05, "the ball held it up meanwhile: {worst}");
}

#[test]
fn a_kept_filter_gives_the_bits_of_a_new_one() {
    let (mesh, _, sheet) = sheet_over_ball(&mut Jitter(5));
    let frames = recorded(&mesh, &sheet);
    let mut kept = mesh.filter(Precision::Double);
    let mut x = frames[0].clone();
    for frame in &frames[1..8] {
        let mut fresh = mesh.filter(Precision::Double);
        run(&mut fresh, Motion::Between(&x, frame));
        run(&mut kept, Motion::Between(&x, frame));
        assert_eq!(kept.positions(), fresh.positions());
        x = kept.positions();
    }
}

#[test]
fn scripted_plates_pinch_with_witnesses_in_the_hosts_numbers_and_let_go_again() {
    let mut mesh = Mesh::default();
    let plate = crate::world::block([0.3, 0.3, 0.02]);
    let lower = mesh.add(&plate, [0.0, 0.0, -0.03], 2, f64::INFINITY);
    let sheet = mesh.add(&cloth_grid(6, 0.2), [0.0; 3], 1, 1e-3);
    let upper = mesh.add(&plate, [0.0, 0.0, 0.03], 3, 0.0);
    let closed = |share: f64| -> Vec<Vec3> {
        (0..mesh.x.len())
            .map(|v| {
                let way = if lower.contains(&v) {
                    0.02
                } else if upper.contains(&v) {
                    -0.021
                } else {
                    0.0
                };
                add(mesh.x[v], [0.0, 0.0, share * way])
            })
            .collect()
    };
    let mut filter = mesh.filter(Precision::Double);
    run(&mut filter, Motion::Between(&mesh.x, &closed(0.5)));
    let failure =
        filter.run(Motion::Towards(&closed(1.2)), &settings(), DT, Par::Serial, Watch::default()).unwrap_err();
    assert_eq!(failure.error.fault, Fault::Pinched);
    let report = failure.report.unwrap();
    assert!(report.certified_fraction < 1.0 && report.intersections == Some(0), "{report:?}");
    assert!(!filter.witnesses().is_empty());
    for witness in filter.witnesses() {
        for side in 0..2 {
            for v in witness.vertices[side] {
                assert_eq!(mesh.groups[v as usize], witness.groups[side], "{witness:?}");
            }
        }
    }
    let end = filter.positions();
    assert_eq!(mesh.intersections(&end), 0);
    assert!(end[lower.start][2] < closed(1.2)[lower.start][2], "scripted vertices stopped, too");
    run(&mut filter, Motion::Towards(&closed(0.4)));
    assert_eq!(filter.positions()[lower.start], closed(0.4)[lower.start]);
    assert!(sheet.clone().all(|v| filter.positions()[v][2].abs() < 0.02));
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_changes() {
    let (mesh, _, sheet) = sheet_over_ball(&mut Jitter(1));
    let run = |filter: &mut MotionFilter, motion: Motion| {
        filter.run(motion, &settings(), DT, Par::Serial, Watch::default()).map_err(|f| f.error.fault)
    };
    let mut filter = mesh.filter(Precision::Double);
    assert_eq!(run(&mut filter, Motion::Towards(&mesh.x)), Err(Fault::InvalidArgument), "no state yet");
    assert_eq!(run(&mut filter, Motion::Between(&mesh.x, &mesh.x[1..])), Err(Fault::BufferLayout));
    let mut bad = mesh.x.clone();
    bad[5][1] = f64::NAN;
    assert_eq!(run(&mut filter, Motion::Between(&mesh.x, &bad)), Err(Fault::NonFinite));
    // A sheet in the middle of the ball.
    let inside: Vec<Vec3> = (0..mesh.x.len())
        .map(|v| if sheet.contains(&v) { sub(mesh.x[v], [0.0, 0.0, 0.12]) } else { mesh.x[v] })
        .collect();
    run(&mut filter, Motion::Between(&mesh.x, &mesh.x)).unwrap();
    let before = filter.positions();
    assert_eq!(run(&mut filter, Motion::Between(&inside, &mesh.x)), Err(Fault::IntersectingStart));
    assert!(filter.witnesses().iter().all(|w| w.groups == [3, 7] || w.groups == [7, 3]), "{:?}", filter.witnesses());
    assert!(!filter.witnesses().is_empty());
    assert_eq!(filter.positions(), before);
    let pass = Settings { start_policy: StartPolicy::Pass, ..settings() };
    let report = filter.run(Motion::Between(&inside, &mesh.x), &pass, DT, Par::Serial, Watch::default()).unwrap();
    assert!(report.tangled_pairs > 0);

    let mut spanning = mesh.clone();
    spanning.triangles.push([0, 1, sheet.start as u32]);
    let fault = |mesh: &Mesh| mesh.try_filter(Precision::Double).map(|_| ()).unwrap_err().fault;
    assert_eq!(fault(&spanning), Fault::BadTopology);
    let mut negative = mesh.clone();
    negative.masses[3] = -1.0;
    assert_eq!(fault(&negative), Fault::InvalidArgument);
    let mut few = mesh;
    few.masses.pop();
    assert_eq!(fault(&few), Fault::BufferLayout);
}
