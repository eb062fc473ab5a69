//! The certificate's predicate against rational arithmetic by another route, and its search against brute force.

use crate::random::Random;
use crate::scenes::{Scene, grid, scenes};
use num_rational::BigRational as Q;
use num_traits::{One, Signed, Zero};
use signorini::detection::Primitives;
use signorini::detection::intersection::{below_half_space, find, find_brute_force};
use signorini::geometry::point_triangle;
use signorini::math::predicates::{orient2d, orient3d, plane_side, segment_meets_triangle};
use signorini::math::{Vec3, add_scaled, scale};
use signorini::parallel::{Par, Pool};

type Q3 = [Q; 3];

fn exact(v: Vec3) -> Q3 {
    v.map(|x| Q::from_float(x).unwrap())
}

fn sub(a: &Q3, b: &Q3) -> Q3 {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

/// Whether numbers `u` in a polygon of half-planes exist: the system `A u <= b` in three unknowns, by Fourier-Motzkin
/// elimination. Knows nothing of orientations or special cases.
fn feasible(mut rows: Vec<(Vec<Q>, Q)>, unknowns: usize) -> bool {
    for k in 0..unknowns {
        let (mut upper, mut lower, mut rest) = (vec![], vec![], vec![]);
        for (a, b) in rows {
            if a[k].is_zero() {
                rest.push((a, b));
            } else {
                let f = Q::one() / a[k].abs();
                let row = (a.iter().map(|x| x * &f).collect::<Vec<Q>>(), &b * &f);
                if row.0[k].is_positive() { upper.push(row) } else { lower.push(row) }
            }
        }
        for (a, b) in &upper {
            for (c, d) in &lower {
                rest.push((a.iter().zip(c).map(|(x, y)| x + y).collect(), b + d));
            }
        }
        rest.sort();
        rest.dedup();
        rows = rest;
    }
    rows.iter().all(|(_, b)| !b.is_negative())
}

/// Whether `t` in [0, 1] and weights `u, v >= 0`, `u + v <= 1` with `p + t (q - p) = a + u (b - a) + v (c - a)` exist.
fn meets(x: &[Vec3; 5]) -> bool {
    let [p, q, a, b, c] = x.map(exact);
    let (d, e, f, r) = (sub(&q, &p), sub(&b, &a), sub(&c, &a), sub(&a, &p));
    let number = |n: i32| Q::from_integer(n.into());
    let mut rows = vec![
        (vec![number(-1), number(0), number(0)], number(0)),
        (vec![number(1), number(0), number(0)], number(1)),
        (vec![number(0), number(-1), number(0)], number(0)),
        (vec![number(0), number(0), number(-1)], number(0)),
        (vec![number(0), number(1), number(1)], number(1)),
    ];
    for k in 0..3 {
        let row = vec![d[k].clone(), -&e[k], -&f[k]];
        rows.push((row.iter().map(|x| -x).collect(), -&r[k]));
        rows.push((row, r[k].clone()));
    }
    feasible(rows, 3)
}

fn check(x: &[Vec3; 5]) -> bool {
    let expected = meets(x);
    for [p, q, a, b, c] in [*x, [x[1], x[0], x[3], x[4], x[2]], [x[0], x[1], x[3], x[2], x[4]]] {
        assert_eq!(segment_meets_triangle(p, q, a, b, c), expected, "{x:?}");
    }
    expected
}

#[test]
fn segments_and_triangles_on_lattices_and_at_random() {
    let mut r = Random::new(20);
    let (mut hits, mut queries) = (0, 0);
    for size in [2, 3, 4, 9] {
        for _ in 0..80 {
            hits += usize::from(check(&[0; 5].map(|_| [0; 3].map(|_| r.pick(size) as f64 - 1.0))));
            // All in one plane.
            hits += usize::from(check(&[0; 5].map(|_| [r.pick(size) as f64, r.pick(size) as f64, 1.0])));
            // All on one line.
            hits += usize::from(check(&[0; 5].map(|_| scale(r.pick(size + 3) as f64, [1.0, -0.5, 2.0]))));
            queries += 3;
        }
    }
    for _ in 0..300 {
        hits += usize::from(check(&[0; 5].map(|_| r.vector())));
        queries += 1;
    }
    assert!(hits > queries / 8 && hits < queries * 7 / 8, "{hits} of {queries}");
}

#[test]
fn segments_that_end_beside_triangles_by_one_bit() {
    let mut r = Random::new(21);
    let mut hits = 0;
    for _ in 0..300 {
        let far = scale([0.0, 1.0, 1e6][r.pick(3)], r.vector());
        let [a, b, c] = [0; 3].map(|_| add_scaled(far, 1.0, r.vector()));
        // A point on the triangle, its edge or its corner, rounded.
        let (u, v) = ([0.0, r.unit(), 0.5][r.pick(3)], [0.0, 0.25][r.pick(2)]);
        let on = add_scaled(add_scaled(a, u, signorini::math::sub(b, a)), v, signorini::math::sub(c, a));
        let p = [0, 1, 2].map(|k| [on[k], on[k].next_up(), on[k].next_down()][r.pick(3)]);
        let q = add_scaled(p, [0.0, 1.0, 1e-9][r.pick(3)], r.vector());
        hits += usize::from(check(&[p, q, a, b, c]));
    }
    assert!(hits > 10 && hits < 290, "{hits}");
}

#[test]
fn sizes_beyond_the_range_of_expansions() {
    let mut r = Random::new(22);
    for _ in 0..10 {
        for exponent in [-320, -300, -200, -90, -76, 90, 91, 150, 300] {
            let size = 10_f64.powi(exponent);
            check(&[0; 5].map(|_| [0; 3].map(|_| (r.pick(4) as f64 - 1.0) * size)));
            // Sizes mixed within one query.
            check(&[0; 5].map(|_| [0; 3].map(|_| (r.pick(3) as f64 - 1.0) * [1.0, size][r.pick(2)])));
        }
    }
}

#[test]
fn signs_of_determinants() {
    let mut r = Random::new(23);
    let sign = |q: &Q| i32::from(q.is_positive()) - i32::from(q.is_negative());
    for _ in 0..2000 {
        let size = if r.pick(2) == 0 { 1.0 } else { r.power(-300.0, 300.0) };
        let mut coordinate = || match r.pick(3) {
            0 => r.pick(3) as f64 * size,
            1 => (0.5 + r.pick(4) as f64 * f64::EPSILON) * size,
            _ => r.between(-1.0, 1.0),
        };
        let x = [0; 4].map(|_| [0; 3].map(|_| coordinate()));
        let q = x.map(exact);
        let (u, v, w) = (sub(&q[1], &q[0]), sub(&q[2], &q[0]), sub(&q[3], &q[0]));
        let cross = |i: usize, j: usize| &u[i] * &v[j] - &u[j] * &v[i];
        let volume = cross(1, 2) * &w[0] + cross(2, 0) * &w[1] + cross(0, 1) * &w[2];
        assert_eq!(orient3d(x[0], x[1], x[2], x[3]), sign(&volume), "{x:?}");
        let [a, b, c, _] = x.map(|v| [v[0], v[1]]);
        assert_eq!(orient2d(a, b, c), sign(&cross(0, 1)), "{x:?}");
        let offset = [x[2][0], signorini::math::dot(x[0], x[1])][r.pick(2)];
        if offset.is_finite() {
            let side = &q[0][0] * &q[1][0] + &q[0][1] * &q[1][1] + &q[0][2] * &q[1][2] - Q::from_float(offset).unwrap();
            assert_eq!(plane_side(x[0], offset, x[1]), sign(&side), "{x:?} {offset}");
        }
    }
}

#[test]
fn whole_states_agree_with_brute_force_and_have_points() {
    let pool = Pool::new(2).unwrap();
    let mut total = 0;
    for scene in scenes() {
        let p = scene.primitives();
        for x in [&scene.x0, &scene.x1] {
            let between = |a: u32, b: u32| scene.body[a as usize] != scene.body[b as usize];
            let expected = find_brute_force(&p, x, &between);
            assert_eq!(find(&p, x, &between, Par::Serial), expected, "{}", scene.name);
            let expected = find_brute_force(&p, x, &|_, _| true);
            assert_eq!(find(&p, x, &|_, _| true, Par::Pool(&pool)), expected, "{}", scene.name);
            total += expected.len();
            points_are_common(&scene, x, &expected);
        }
    }
    assert!(total > 1000, "{total}");
}

/// The filter before the exact predicates must leave every pair that touches: segments that end on triangles to the last
/// bit, and corners, edges and planes of small lattices that meet exactly.
#[test]
fn pairs_that_touch_to_the_last_bit_agree_with_brute_force() {
    let mut r = Random::new(24);
    let mut x: Vec<Vec3> = Vec::new();
    for i in 0..2000 {
        let far = scale([0.0, 1.0, 1e6][r.pick(3)], r.vector());
        let [a, b, c] = [0; 3].map(|_| add_scaled(far, 1.0, r.vector()));
        let (u, v) = ([0.0, r.unit(), 0.5][r.pick(3)], [0.0, 0.25][r.pick(2)]);
        let on = add_scaled(add_scaled(a, u, signorini::math::sub(b, a)), v, signorini::math::sub(c, a));
        let p = [0, 1, 2].map(|k| [on[k], on[k].next_up(), on[k].next_down()][r.pick(3)]);
        let q = add_scaled(p, 1.0, r.vector());
        let size = 2 + i % 3;
        let lattice = [0; 5].map(|_| [0; 3].map(|_| 0.1 * r.pick(size) as f64 - 0.3));
        x.extend(if i % 2 == 0 { [p, q, a, b, c] } else { lattice });
    }
    let count = x.len() as u32 / 5;
    let edges: Vec<[u32; 2]> = (0..count).map(|i| [5 * i, 5 * i + 1]).collect();
    let faces: Vec<[u32; 3]> = (0..count).map(|i| [5 * i + 2, 5 * i + 3, 5 * i + 4]).collect();
    let vertices: Vec<u32> = (0..5 * count).collect();
    let p = signorini::detection::Primitives { vertices: &vertices, edges: &edges, faces: &faces };
    let own = |a: u32, b: u32| a / 5 == b / 5;
    let expected = find_brute_force(&p, &x, &own);
    assert!(expected.len() > 300 && expected.len() < 1900, "{}", expected.len());
    assert_eq!(find(&p, &x, &own, Par::Serial), expected);
}

/// Stars about one vertex, of all numbers of faces, that turn on, back, or more than once about it: the pairs that clear
/// stars leave out are none that touch.
#[test]
fn stars_that_fold_and_wind_agree_with_brute_force() {
    let mut r = Random::new(28);
    let (mut crossing, mut free) = (0, 0);
    for i in 0..20_000 {
        let count = 1 + i % 14;
        let closed = count > 2 && r.pick(2) == 0;
        let turns = [0.7, 1.0, 1.0, 1.3, 2.0][r.pick(5)];
        let (rough, steep) = ([0.0, 0.0, 0.1, 0.6][r.pick(4)], [0.0, 0.1, 1.0][r.pick(3)]);
        let (far, size) = ([0.0, 1.0, 1e3][r.pick(3)], [1.0, 1e-3][r.pick(2)]);
        let away = scale(far, r.vector());
        let [u, v, w] = [0; 3].map(|_| r.vector());
        let mut at = |angle: f64, radius: f64| {
            let angle = std::f64::consts::TAU * (angle + rough * (r.unit() - 0.5));
            let height = steep * (r.unit() - 0.5);
            let x = add_scaled(scale(radius * angle.cos(), u), radius * angle.sin(), v);
            add_scaled(away, size, add_scaled(x, height, w))
        };
        let mut x = vec![at(0.0, 0.0)];
        let ring = count + usize::from(!closed);
        x.extend((0..ring).map(|k| at(turns * k as f64 / count as f64, 1.0 + 0.5 * (k % 3) as f64)));
        // Far from it a point, so that single precision of the whole sees ever less of the star.
        x.push(add_scaled(away, size * [1.0, 1e4, 1e5, 1e7][r.pick(4)], u));
        let corner = |k: usize| 1 + (k % ring) as u32;
        // Neither the order of the faces nor that of their corners matters.
        let mut faces: Vec<[u32; 3]> = (0..count).map(|k| [0, corner(k), corner(k + 1)]).collect();
        faces.rotate_left(r.pick(count));
        faces.iter_mut().for_each(|f| f.rotate_left(r.pick(3)));
        let mut edges: Vec<[u32; 2]> = (0..count).map(|k| [corner(k), corner(k + 1)]).collect();
        edges.extend((0..ring).map(|k| [0, corner(k)]));
        let vertices: Vec<u32> = (0..x.len() as u32).collect();
        let p = Primitives { vertices: &vertices, edges: &edges, faces: &faces };
        let expected = find_brute_force(&p, &x, &|_, _| true);
        assert_eq!(find(&p, &x, &|_, _| true, Par::Serial), expected, "{i}: {x:?}");
        *if expected.is_empty() { &mut free } else { &mut crossing } += 1;
    }
    assert!(crossing > 3000 && free > 3000, "{crossing} {free}");
}

/// Sheets that are crumpled ever more, from flat to a cloud.
#[test]
fn crumpled_sheets_agree_with_brute_force() {
    let pool = Pool::new(2).unwrap();
    let mut r = Random::new(29);
    let mut crossing = 0;
    for i in 0..60 {
        let mut scene = grid("sheet", 14, 1 + i % 2);
        let rough = 0.1 * [0.0, 0.1, 0.3, 0.5, 0.8, 2.0][i / 10];
        scene.x0.iter_mut().for_each(|x| *x = add_scaled(*x, rough, r.vector()));
        let p = scene.primitives();
        let expected = find_brute_force(&p, &scene.x0, &|_, _| true);
        let par = if i % 3 == 0 { Par::Pool(&pool) } else { Par::Serial };
        assert_eq!(find(&p, &scene.x0, &|_, _| true, par), expected, "{i}");
        crossing += usize::from(!expected.is_empty());
    }
    assert!((15..45).contains(&crossing), "{crossing}");
}

fn points_are_common(scene: &Scene, x: &[Vec3], found: &[signorini::detection::intersection::Intersection]) {
    for i in found {
        let [a, b, c] = scene.faces[i.face as usize].map(|v| x[v as usize]);
        let [p, q] = scene.edges[i.edge as usize].map(|v| x[v as usize]);
        let size = [a, b, c, p, q].iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let separation = point_triangle::closest_points(i.point, a, b, c).separation;
        let distance = separation.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(distance <= 1e-13 * size, "{}: {i:?} is {distance:e} away", scene.name);
    }
}

#[test]
fn vertices_below_a_half_space() {
    let x = [[0.0, 0.0, 1.0], [3.0, 2.0, 0.5], [1.0, 1.0, 0.5_f64.next_down()], [0.0, 0.0, -2.0]];
    let below = below_half_space(&[0, 1, 2, 3], &x, [0.0, 0.0, 1.0], 0.5);
    assert_eq!(below.iter().map(|b| b.0).collect::<Vec<_>>(), [2, 3]);
    assert_eq!(below[1].1, [0.0, 0.0, 0.5]);
}

#[test]
fn a_fold_that_crosses_its_neighbour_is_found() {
    // Faces 0 1 2 and 0 3 4 share vertex 0; edge 3 4 passes through the first.
    let mut x = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, -0.5], [0.3, 0.3, 0.5]];
    let faces = [[0, 1, 2], [0, 3, 4]];
    let edges = [[0, 1], [1, 2], [0, 2], [0, 3], [3, 4], [0, 4]];
    let p = signorini::detection::Primitives { vertices: &[0, 1, 2, 3, 4], edges: &edges, faces: &faces };
    let found = find(&p, &x, &|_, _| true, Par::Serial);
    assert_eq!((found.len(), found[0].edge, found[0].face), (1, 4, 0));
    assert!(signorini::math::norm(signorini::math::sub(found[0].point, [0.3, 0.3, 0.0])) < 1e-15);
    x[3] = [0.3, 0.3, 0.1];
    assert!(find(&p, &x, &|_, _| true, Par::Serial).is_empty());
}

/// Segments that end on triangles exactly, of sizes from that of the whole scene down to what single precision of it
/// cannot tell from nothing: none of them is ruled out on the way.
#[test]
fn touches_that_single_precision_cannot_see_are_found() {
    let mut r = Random::new(26);
    let pool = Pool::new(2).unwrap();
    // Multiples of 2^-40 below 2^8: sums and halves of halves are exact.
    let unit = 2.0_f64.powi(-40);
    let round = |v: Vec3| v.map(|c| (c / unit).round() * unit);
    let (mut x, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for size in [1.0, 1e-2, 1e-4, 1e-6] {
        for _ in 0..500 {
            let a = round(scale(60.0, r.vector()));
            let [u, v] = [0; 2].map(|_| round(scale(size, r.vector())));
            // Inside the triangle, on an edge, at a corner.
            let (s, t) = [(0.25, 0.5), (0.5, 0.0), (0.5, 0.5), (1.0, 0.0)][r.pick(4)];
            let p = add_scaled(add_scaled(a, s, u), t, v);
            // Away from the plane, or within it and away from the triangle.
            let normal = signorini::math::cross(u, v);
            let away = if r.pick(2) == 0 || (s, t) == (0.25, 0.5) {
                scale([1.0, -1.0][r.pick(2)] / size, normal)
            } else {
                add_scaled(u, -0.5 - t, v)
            };
            let first = x.len() as u32;
            x.extend([p, add_scaled(p, r.unit(), away), a, add_scaled(a, 1.0, u), add_scaled(a, 1.0, v)]);
            edges.push([first, first + 1]);
            faces.push([first + 2, first + 3, first + 4]);
        }
    }
    // As segments of no face, and as sides of triangles, which are ruled out face against face.
    let sides: Vec<[u32; 3]> = edges
        .iter()
        .map(|[p, q]| {
            x.push(add_scaled(x[*q as usize], 0.3, signorini::math::sub(x[*q as usize], x[*p as usize + 2])));
            [*p, *q, x.len() as u32 - 1]
        })
        .collect();
    let vertices: Vec<u32> = (0..x.len() as u32).collect();
    for sides in [&[][..], &sides] {
        let faces = [&faces, sides].concat();
        let p = Primitives { vertices: &vertices, edges: &edges, faces: &faces };
        for par in [Par::Serial, Par::Pool(&pool)] {
            let found = find(&p, &x, &|_, _| true, par);
            let own = found.iter().filter(|i| i.edge == i.face).count();
            assert_eq!(own, edges.len());
        }
    }
}
