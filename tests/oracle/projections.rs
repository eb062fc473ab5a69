//! Projections of zones against dense singular values, an interior point method and the laws, over random zones with
//! rows that repeat, oppose each other and are nearly parallel.

use super::random::Random;
use super::solver::interior_point;
use super::solver_problems::Made;
use nalgebra::{DMatrix, DVector};
use signorini::constraint::Metric;
use signorini::contact_search::{Pair, PairKind, mesh_contact};
use signorini::fail_safe::{Projection, ZoneResponse, project_zone};
use signorini::math::{Mat3, Vec3, add, add_scaled, cross, dot, mat_vec, norm, outer, scale, sub};
use signorini::model::{BodyDescription, FailSafe, Kind, Material, Materials, Model, Precision, Surface, ZoneFriction};

const RANK_CUT: f64 = 1e-6;

/// Linear entries, angular entries, normal.
type Stencil = (Vec<(u32, f64)>, Vec<(u32, Vec3)>, Vec3);

fn isotropic(m: f64) -> Mat3 {
    [[m, 0.0, 0.0], [0.0, m, 0.0], [0.0, 0.0, m]]
}

/// Vertices and rigid bodies with masses over some decades, and rows of all kinds, nearly parallel ones within a tilt.
///
/// The last third of the bodies is rigid, so that weights over vertices sum up to zero where no rigid or scripted part
/// takes part.
fn random_zone(random: &mut Random, rows: usize, (decades, tilt): (f64, f64), scripted: bool, friction: f64) -> Made {
    let mut made = Made::new();
    let vertices = rows.div_ceil(2) + 6;
    for _ in 0..vertices {
        made.block(isotropic(random.power(-decades, decades)), random.vector());
    }
    let bodies = 3;
    for _ in 0..bodies {
        let mass = random.power(-decades, decades);
        made.block(isotropic(mass), random.vector());
        let mut inertia = isotropic(0.02 * mass);
        for _ in 0..3 {
            let axis = random.vector();
            let part = outer(axis, axis);
            for r in 0..3 {
                inertia[r] = add_scaled(inertia[r], 0.1 * mass, part[r]);
            }
        }
        made.block(inertia, scale(3.0, random.vector()));
    }
    made.finish();
    let mut earlier: Vec<Stencil> = Vec::new();
    while made.rows.len() < rows {
        let kind = random.unit();
        let (linear, angular, normal) = if kind < 0.35 && !earlier.is_empty() {
            let (linear, angular, normal) = earlier[random.pick(earlier.len())].clone();
            let normal = match random.pick(3) {
                0 => normal,
                1 => scale(-1.0, normal),
                _ => add_scaled(normal, tilt, random.vector()),
            };
            (linear, angular, normal)
        } else {
            let mut linear: Vec<(u32, f64)> = Vec::new();
            while linear.len() < 4 {
                let v = random.pick(vertices) as u32;
                if linear.iter().all(|(b, _)| *b != v) {
                    linear.push((v, 0.0));
                }
            }
            let (s, t) = (random.unit(), random.unit());
            let weights = if random.unit() < 0.5 {
                [1.0, -0.5 * s, -0.5 * t, 0.5 * (s + t) - 1.0]
            } else {
                [1.0 - s, s, t - 1.0, -t]
            };
            linear.iter_mut().zip(weights).for_each(|(l, w)| l.1 = w);
            let mut angular = Vec::new();
            if kind < 0.6 {
                // The first primitive belongs to a rigid body.
                linear.retain(|(_, w)| *w < 0.0);
                let body = (vertices + 2 * random.pick(bodies)) as u32;
                linear.push((body, 1.0));
                angular.push((body + 1, scale(0.4, random.vector())));
            } else if scripted && kind < 0.7 {
                linear.retain(|(_, w)| *w > 0.0);
            }
            (linear, angular, random.vector())
        };
        made.contact(&linear, &angular, normal, (0.0, friction));
        earlier.push((linear, angular, normal));
    }
    made
}

fn metric(made: &Made) -> Metric {
    let mut metric = Metric::default();
    metric.lumped = (0..made.matrix.rows()).map(|b| *made.matrix.diagonal_block(b)).collect();
    metric
}

fn projected(made: &Made, fail_safe: FailSafe, friction: ZoneFriction) -> (Vec<Vec3>, Projection) {
    let all: Vec<usize> = (0..made.rows.len()).collect();
    let mut velocities = made.velocities.clone();
    let response = ZoneResponse { fail_safe, friction };
    let projection = project_zone(&made.rows, &all, &metric(made), &response, &mut velocities);
    (velocities, projection)
}

/// The inelastic change of velocities by the singular values of the scaled gradients.
fn by_singular_values(made: &Made) -> (Vec<Vec3>, usize) {
    let (k, n) = (made.rows.len(), made.matrix.rows());
    let mut root = DMatrix::<f64>::zeros(3 * n, 3 * n);
    for b in 0..n {
        let mass = made.matrix.diagonal_block(b);
        let inverse = nalgebra::Matrix3::from_fn(|i, j| mass[i][j]).try_inverse().unwrap();
        let lower = inverse.cholesky().unwrap().l();
        root.view_mut((3 * b, 3 * b), (3, 3)).copy_from(&lower);
    }
    let mut gradients = DMatrix::<f64>::zeros(k, 3 * n);
    for i in 0..k {
        let mut row = vec![[0.0; 3]; n];
        made.rows.scatter(i, made.rows.frames[i][0], &mut row);
        row.iter().flatten().enumerate().for_each(|(j, g)| gradients[(i, j)] = *g);
    }
    let mut matrix = gradients * &root;
    let mut wanted = DVector::from_column_slice(&made.rows.normal_targets);
    for i in 0..k {
        let length = matrix.row(i).norm();
        matrix.row_mut(i).unscale_mut(length);
        wanted[i] /= length;
    }
    let svd = matrix.svd(true, true);
    let cut = RANK_CUT * svd.singular_values.max();
    let y = svd.solve(&wanted, cut).unwrap();
    let dv = root * y;
    (dv.as_slice().chunks(3).map(|c| [c[0], c[1], c[2]]).collect(), svd.rank(cut))
}

#[test]
fn inelastic_projection_is_the_minimum_norm_solution_by_singular_values() {
    let mut random = Random::new(1);
    for rows in [1, 2, 5, 12, 30, 60, 90, 200] {
        for case in 0..4 {
            // Bidiagonalisation needs steps where rows are nearly parallel; the spectrum does not mind.
            let (tilt, tolerance) = if rows <= 128 { (1e-3, 1e-8) } else { (3e-2, 1e-6) };
            let made = random_zone(&mut random, rows, (1.0, tilt), case % 2 == 0, 0.0);
            let (dv, rank) = by_singular_values(&made);
            let expected: Vec<Vec3> = made.velocities.iter().zip(&dv).map(|(v, d)| add(*v, *d)).collect();
            let (found, projection) = projected(&made, FailSafe::InelasticProjection, ZoneFriction::Frictionless);
            let error = made.error(&found, &expected) * (made.energy(&expected) / made.energy(&made.velocities)).sqrt();
            assert!(error < tolerance, "{rows} rows, case {case}: {error:e} {projection:?}");
            assert!(
                projection.residual < tolerance && projection.converged,
                "{rows} rows, case {case}: {projection:?}"
            );
            if rows <= 128 {
                assert_eq!(projection.rank, rank, "{rows} rows, case {case}");
            }
        }
    }
}

#[test]
fn equations_that_contradict_each_other_are_met_by_least_squares() {
    let mut random = Random::new(2);
    for rows in [20, 60, 120, 160] {
        let mut made = random_zone(&mut random, rows, (0.5, 1e-2), true, 0.0);
        // Scripted motion moves targets, so that rows with one gradient want different things.
        made.rows.normal_targets.iter_mut().for_each(|c| *c += 0.3 * random.between(-1.0, 1.0));
        // What is nearly parallel would amplify that a hundredfold: turn it parallel.
        for i in 0..rows {
            for j in 0..i {
                if dot(made.rows.frames[i][0], made.rows.frames[j][0]) > 0.999 {
                    made.rows.frames[i] = made.rows.frames[j];
                }
            }
        }
        let (dv, _) = by_singular_values(&made);
        let expected: Vec<Vec3> = made.velocities.iter().zip(&dv).map(|(v, d)| add(*v, *d)).collect();
        let (found, projection) = projected(&made, FailSafe::InelasticProjection, ZoneFriction::Frictionless);
        assert!(made.error(&found, &expected) < 1e-6, "{rows}: {:e}", made.error(&found, &expected));
        assert!(projection.residual > 1e-3 && !projection.converged, "{projection:?}");
    }
}

#[test]
fn unilateral_projection_is_the_solution_of_the_quadratic_program() {
    let mut random = Random::new(3);
    for rows in [1, 2, 5, 12, 40, 100, 200] {
        for case in 0..4 {
            let tilt = if rows <= 40 { 1e-3 } else { 3e-2 };
            let mut made = random_zone(&mut random, rows, (1.0, tilt), case % 2 == 0, 0.0);
            if case > 1 {
                // Rows that leave some room.
                made.rows.normal_targets.iter_mut().for_each(|c| *c -= 0.3 * random.unit());
            }
            if made.rows.normal_targets.iter().all(|c| *c <= 0.0) {
                continue;
            }
            let expected = interior_point(&made, false);
            let expected: Vec<Vec3> = made.velocities.iter().zip(&expected).map(|(v, d)| add(*v, *d)).collect();
            let (found, projection) = projected(&made, FailSafe::UnilateralProjection, ZoneFriction::Frictionless);
            let error = made.error(&found, &expected) * (made.energy(&expected) / made.energy(&made.velocities)).sqrt();
            assert!(error < 1e-6, "{rows} rows, case {case}: {error:e} {projection:?}");
            assert!(projection.residual < 1e-8, "{rows} rows, case {case}: {:e}", projection.residual);
            assert!(projection.converged && projection.normal_impulses.iter().all(|l| *l >= 0.0), "{projection:?}");
        }
    }
}

/// Sum of masses times velocities, and the size of its terms.
fn momentum(made: &Made, v: &[Vec3], vertices: impl Fn(usize) -> bool) -> (Vec3, f64) {
    let mut sum = ([0.0; 3], 0.0);
    for b in (0..v.len()).filter(|b| vertices(*b)) {
        let p = mat_vec(made.matrix.diagonal_block(b), v[b]);
        sum = (add(sum.0, p), sum.1 + norm(p));
    }
    sum
}

#[test]
fn projections_keep_momentum_never_raise_energy_and_change_nothing_twice() {
    let mut random = Random::new(4);
    for rows in [1, 3, 10, 40, 90] {
        for fail_safe in [FailSafe::InelasticProjection, FailSafe::UnilateralProjection] {
            for friction in [ZoneFriction::Frictionless, ZoneFriction::PerContact, ZoneFriction::PerZone] {
                for mu in [0.1, 2.0] {
                    let made = random_zone(&mut random, rows, (2.0, 1e-2), false, mu);
                    let what = format!("{rows} rows, {fail_safe:?}, {friction:?}, {mu}");
                    let (v, projection) = projected(&made, fail_safe, friction);
                    // Blocks after the vertices alternate, linear and angular.
                    let vertices = v.len() - 6;
                    let linear = |b: usize| b < vertices || (b - vertices).is_multiple_of(2);
                    let ((before, size), (after, _)) =
                        (momentum(&made, &made.velocities, linear), momentum(&made, &v, linear));
                    assert!(norm(sub(after, before)) < 1e-12 * size, "{what}: {:e}", norm(sub(after, before)) / size);
                    let (old, new) = (made.energy(&made.velocities), made.energy(&v));
                    assert!(new <= old * (1.0 + 1e-12), "{what}: {old} -> {new}");
                    let tolerance = if friction == ZoneFriction::Frictionless { 1e-7 } else { 1e-5 };
                    assert!(projection.residual < tolerance, "{what}: {:e}", projection.residual);
                    if friction == ZoneFriction::Frictionless {
                        let mut again = made.clone();
                        again.velocities.clone_from(&v);
                        for i in 0..again.rows.len() {
                            again.rows.normal_targets[i] = -again.rows.velocity(i, &v)[0];
                        }
                        let (twice, _) = projected(&again, fail_safe, friction);
                        let change: Vec<Vec3> = twice.iter().zip(&v).map(|(a, b)| sub(*a, *b)).collect();
                        let share = (made.energy(&change) / old).sqrt();
                        assert!(share < 1e-9, "{what}: {share:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn friction_slows_slides_within_its_limit_and_stops_what_it_can() {
    let mut random = Random::new(5);
    for fail_safe in [FailSafe::InelasticProjection, FailSafe::UnilateralProjection] {
        for friction in [ZoneFriction::PerContact, ZoneFriction::PerZone] {
            // One vertex on a scripted plane: both forms are Coulomb's law.
            for mu in [0.0, 0.2, 0.5, 5.0] {
                let mut made = Made::new();
                made.block(isotropic(0.3), [1.0, 0.5, -2.0]);
                made.finish();
                made.contact(&[(0, 1.0)], &[], [0.0, 0.0, 1.0], (0.0, mu));
                let (v, _) = projected(&made, fail_safe, friction);
                let speed = 1.25_f64.sqrt();
                let left = (1.0 - mu * 2.0 / speed).max(0.0);
                let expected = [left, 0.5 * left, 0.0];
                assert!(norm(sub(v[0], expected)) < 1e-12, "{fail_safe:?} {friction:?} {mu}: {:?}", v[0]);
            }
            // Much friction: the contacts that push stop sliding.
            let made = random_zone(&mut random, 8, (0.3, 1e-2), true, 1e3);
            let (v, projection) = projected(&made, fail_safe, friction);
            for (i, impulse) in projection.normal_impulses.iter().enumerate().filter(|(_, l)| **l > 1e-6) {
                let [_, a, b] = made.rows.velocity(i, &v);
                if friction == ZoneFriction::PerZone && fail_safe == FailSafe::InelasticProjection {
                    assert!(a.hypot(b) < 1e-7, "{fail_safe:?} {friction:?} {i} {impulse}: {a} {b}");
                }
            }
        }
    }
}

#[test]
fn a_limit_per_contact_spares_a_slide_that_nothing_presses() {
    // Two vertices that a bar joins to nothing: one strikes its plane, the other slides on its own.
    let mut made = Made::new();
    made.block(isotropic(1.0), [1.0, 0.0, -10.0]);
    made.block(isotropic(1.0), [1.0, 0.0, -0.1]);
    made.finish();
    made.contact(&[(0, 1.0)], &[], [0.0, 0.0, 1.0], (0.0, 0.05));
    made.contact(&[(1, 1.0)], &[], [0.0, 0.0, 1.0], (0.0, 0.05));
    let (each, _) = projected(&made, FailSafe::UnilateralProjection, ZoneFriction::PerContact);
    let (all, _) = projected(&made, FailSafe::UnilateralProjection, ZoneFriction::PerZone);
    assert!((each[0][0] - 0.5).abs() < 1e-12 && (each[1][0] - 0.995).abs() < 1e-12, "{each:?}");
    // The zone's one limit lets the strike brake what does not feel it [Harmon10, §3.9].
    assert!((all[0][0] - all[1][0]).abs() < 1e-12 && all[1][0] < 0.7, "{all:?}");
}

/// The saddle of [Harmon10, Fig. 3.5]: edges (0,0,0)-(0,1,0) and (x,0,0)-(1,1,y) are parallel at x = 1, y = 0, where the
/// cross product vanishes although they are one apart. The contact record keeps the distance and a unit normal.
#[test]
fn parallel_edges_keep_their_distance_where_the_cross_product_vanishes() {
    let surface = |a: Vec3, b: Vec3| {
        std::sync::Arc::new(Surface { rest: vec![a, b], vertices: vec![0, 1], edges: vec![[0, 1]], faces: vec![] })
    };
    let body = |key: u64, surface| BodyDescription {
        key,
        surface,
        kind: Kind::Deformable { masses: vec![1.0; 2], pinned: vec![false; 2] },
        half_thickness: Some(0.01),
        material: 0,
        groups: 1,
        mask: 1,
        self_collision: false,
        precision: Precision::Double,
        embedding: None,
        dynamics: None,
    };
    let mut vanished = 0;
    for (i, j) in (0..=20).flat_map(|i| (0..=10).map(move |j| (i, j))) {
        let (x, y) = (-1.0 + 0.1 * f64::from(i), 0.1 * f64::from(j));
        let points = [[0.0; 3], [0.0, 1.0, 0.0], [x, 0.0, 0.0], [1.0, 1.0, y]];
        let bodies = vec![body(1, surface(points[0], points[1])), body(2, surface(points[2], points[3]))];
        let material = Material { friction_coefficient: 0.0, combine_rule: Default::default(), restitution: 0.0 };
        let materials = Materials { list: vec![material], overrides: vec![] };
        let model = Model::build(bodies, materials, vec![]).unwrap();
        let pair = Pair { kind: PairKind::EdgeEdge, features: [0, 1] };
        let contact = mesh_contact(&model, pair, 0, &pair.closest_points(&points), &points, &points, 0.02);
        let n = cross(sub(points[1], points[0]), sub(points[3], points[2]));
        let published = dot(n, sub(points[2], points[0]));
        // Distance by brute force over both edges.
        let mut distance = f64::INFINITY;
        for (s, t) in (0..=200).flat_map(|s| (0..=200).map(move |t| (s, t))) {
            let on = |a: Vec3, b: Vec3, k: i32| add_scaled(a, f64::from(k) / 200.0, sub(b, a));
            distance = distance.min(norm(sub(on(points[0], points[1], s), on(points[2], points[3], t))));
        }
        assert!((norm(contact.normal) - 1.0).abs() < 1e-14, "{x} {y}");
        assert!((contact.start_gap - distance).abs() < 0.01, "{x} {y}: {} {distance}", contact.start_gap);
        if published.abs() < 1e-12 && distance > 0.5 {
            vanished += 1;
            assert!(contact.start_gap > 0.5, "{x} {y}");
        }
    }
    assert!(vanished > 0, "the published function vanishes at parallel edges that are apart");
}

#[test]
fn two_particles_against_a_wall_end_at_once() {
    // [Harmon10, Fig. 2.4]: impulses one by one never end.
    let mut made = Made::new();
    made.block(isotropic(1.0), [1.0, 0.0, 0.0]);
    made.block(isotropic(1.0), [1.0, 0.0, 0.0]);
    made.finish();
    made.contact(&[(0, -1.0), (1, 1.0)], &[], [1.0, 0.0, 0.0], (0.0, 0.0));
    made.contact(&[(1, -1.0)], &[], [1.0, 0.0, 0.0], (0.0, 0.0));
    for fail_safe in [FailSafe::InelasticProjection, FailSafe::UnilateralProjection] {
        let (v, _) = projected(&made, fail_safe, ZoneFriction::Frictionless);
        assert!(v.iter().all(|v| norm(*v) < 1e-14), "{fail_safe:?}: {v:?}");
    }
    // One by one: halves for ever.
    let (mut a, mut b) = (1.0, 1.0);
    for _ in 0..40 {
        // The second stops at the wall, then the first shares with it.
        (a, b) = (0.5 * (a + 0.0 * b), 0.5 * (a + 0.0 * b));
    }
    assert!(a > 0.0 && b > 0.0);
}

#[test]
fn a_zone_of_a_thousand_rows_is_projected_by_both() {
    // A tall stack of layers: every vertex on the one below, the lowest on a plane.
    let (layers, side) = (25, 6);
    let mut made = Made::new();
    let mut random = Random::new(7);
    for _ in 0..layers * side * side {
        made.block(isotropic(random.between(0.5, 1.5)), add([0.0, 0.0, -1.0], scale(0.2, random.vector())));
    }
    made.finish();
    for layer in 0..layers {
        for k in 0..side * side {
            let v = (layer * side * side + k) as u32;
            let mut entries = vec![(v, 1.0)];
            if layer > 0 {
                let below = |k: usize| ((layer - 1) * side * side + k % (side * side)) as u32;
                entries.extend([(below(k), -0.5), (below(k + 1), -0.3), (below(k + side), -0.2)]);
            }
            let tilt = cross([0.0, 0.0, 0.1], random.vector());
            made.contact(&entries, &[], add([0.0, 0.0, 1.0], tilt), (0.0, 0.3));
        }
    }
    let expected = interior_point(&made, false);
    let expected: Vec<Vec3> = made.velocities.iter().zip(&expected).map(|(v, d)| add(*v, *d)).collect();
    let clock = std::time::Instant::now();
    let (found, projection) = projected(&made, FailSafe::UnilateralProjection, ZoneFriction::Frictionless);
    println!("unilateral, {} rows: {:?}", made.rows.len(), clock.elapsed());
    let scale = (made.energy(&expected) / made.energy(&made.velocities)).sqrt();
    assert!(made.error(&found, &expected) * scale < 1e-6 && projection.converged, "{:e}", projection.residual);
    let clock = std::time::Instant::now();
    let (_, projection) = projected(&made, FailSafe::InelasticProjection, ZoneFriction::Frictionless);
    println!("inelastic: {:?}", clock.elapsed());
    assert!(projection.residual < 1e-8 && projection.converged, "{:e}", projection.residual);
    let clock = std::time::Instant::now();
    let (v, projection) = projected(&made, FailSafe::UnilateralProjection, ZoneFriction::PerContact);
    println!("unilateral with friction: {:?}", clock.elapsed());
    assert!(projection.converged && made.energy(&v) <= made.energy(&made.velocities));
}
