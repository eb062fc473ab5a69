//! What is asked of a stencil at a configuration.

use nalgebra::DMatrix;
use signorini::energy::{Blocks, HessianForm, LANES, Stencil};
use signorini::kinematics::Pose;
use signorini::math::simd::Lanes;
use signorini::math::{Vec3, add, add_scaled, cross, mat_vec, norm, sub};

/// The blocks as one matrix.
pub fn matrix<const N: usize>(blocks: &Blocks<N>) -> DMatrix<f64> {
    DMatrix::from_fn(3 * N, 3 * N, |r, c| blocks[r / 3][c / 3][r % 3][c % 3])
}

fn largest(m: &DMatrix<f64>) -> f64 {
    m.iter().fold(0.0, |a, x| a.max(x.abs()))
}

/// Mean distance of the nodes from the first one; 1 for a single node.
fn extent<const N: usize>(x: &[Vec3; N]) -> f64 {
    let sum: f64 = x.iter().map(|p| norm(sub(*p, x[0]))).sum();
    if sum > 0.0 { sum / N as f64 } else { 1.0 }
}

/// The same nodes with coordinate `c` of node `i` moved by `h`.
fn moved<const N: usize>(x: &[Vec3; N], i: usize, c: usize, h: f64) -> [Vec3; N] {
    let mut y = *x;
    y[i][c] += h;
    y
}

/// Force against the central difference of the energy, Hessian against that of the force. `tolerance` is relative to the
/// largest entry of the Hessian, times the extent for forces.
pub fn derivatives<S: Stencil<N>, const N: usize>(s: &S, x: &[Vec3; N], tolerance: f64, name: &str) {
    let h = 1e-5 * extent(x);
    let exact = matrix(&s.hessian(x, HessianForm::Exact));
    let scale = largest(&exact).max(largest(&matrix(&s.hessian(x, HessianForm::Projected))));
    let force = s.force(x);
    for i in 0..N {
        for c in 0..3 {
            let (ahead, behind) = (moved(x, i, c, h), moved(x, i, c, -h));
            let slope = (s.energy(&ahead) - s.energy(&behind)) / (2.0 * h);
            let error = (slope + force[i][c]).abs();
            assert!(error <= tolerance * scale * extent(x), "{name}: force {i} {c}: {} against {slope}", force[i][c]);
            let (f1, f0) = (s.force(&ahead), s.force(&behind));
            for j in 0..N {
                for r in 0..3 {
                    let slope = -(f1[j][r] - f0[j][r]) / (2.0 * h);
                    let found = exact[(3 * j + r, 3 * i + c)];
                    let error = (slope - found).abs();
                    assert!(error <= tolerance * scale, "{name}: Hessian {j}{r} {i}{c}: {found} against {slope}");
                }
            }
        }
    }
}

/// Symmetric to rounding, no eigenvalue below zero, none above the bound.
pub fn projected<S: Stencil<N>, const N: usize>(s: &S, x: &[Vec3; N], name: &str) {
    let bound = s.stiffness_bound(x);
    for (what, blocks) in [("Hessian", s.hessian(x, HessianForm::Projected)), ("viscosity", s.viscosity(x))] {
        let m = matrix(&blocks);
        let scale = largest(&m);
        assert!(m.iter().all(|v| v.is_finite()), "{name}: {what} finite");
        assert!(largest(&(&m - m.transpose())) <= 1e-12 * scale, "{name}: {what} symmetric");
        let values = m.symmetric_eigen().eigenvalues;
        assert!(values.min() >= -1e-10 * scale, "{name}: {what} has {}", values.min());
        if what == "Hessian" {
            assert!(values.max() <= bound * (1.0 + 1e-10), "{name}: {} above the bound {bound}", values.max());
        }
    }
    assert!(s.force(x).iter().flatten().all(|v| v.is_finite()), "{name}: force finite");
    for (lane, (force, m)) in side_by_side(s, x, 2.0, 0.3).iter().enumerate() {
        assert!(force.iter().flatten().all(|v| v.is_finite()), "{name}: force {lane} finite");
        assert!(m.iter().all(|v| v.is_finite()), "{name}: matrix {lane} finite");
        let least = m.clone().symmetric_eigen().eigenvalues.min();
        assert!(least >= -1e-10 * largest(m), "{name}: matrix {lane} has {least}");
    }
}

/// The configurations that [`side_by_side`] has in its lanes.
fn lanes<const N: usize>(x: &[Vec3; N]) -> [[Vec3; N]; LANES] {
    let step = 0.1 * extent(x);
    [*x, moved(x, 0, 1, step), *x, moved(x, N - 1, 2, -step)]
}

/// Forces and the full matrix `stiff H + viscous V` of four configurations: `x` and some near it.
fn side_by_side<S: Stencil<N>, const N: usize>(
    s: &S,
    x: &[Vec3; N],
    stiff: f64,
    viscous: f64,
) -> Vec<([Vec3; N], DMatrix<f64>)> {
    let four = lanes(x);
    let points = std::array::from_fn(|k| [0, 1, 2].map(|c| Lanes(four.map(|x| x[k][c]))));
    let found = S::side_by_side([s; LANES], &points, stiff, viscous);
    let entry = |lane: usize, r: usize, c: usize| found.blocks[r / 3][c / 3][r % 3][c % 3].0[lane];
    let matrix = |lane: usize| {
        DMatrix::from_fn(3 * N, 3 * N, |r, c| if r / 3 >= c / 3 { entry(lane, r, c) } else { entry(lane, c, r) })
    };
    (0..LANES).map(|lane| (found.forces.map(|f| f.map(|c| c.0[lane])), matrix(lane))).collect()
}

/// Four elements at a time give what each gives alone.
fn as_one_by_one<S: Stencil<N>, const N: usize>(s: &S, x: &[Vec3; N], name: &str) {
    for (stiff, viscous) in [(1.0, 0.0), (2.0, 0.3)] {
        for (x, (force, found)) in lanes(x).iter().zip(side_by_side(s, x, stiff, viscous)) {
            let hessian = matrix(&s.hessian(x, HessianForm::Projected));
            let expected = stiff * &hessian + viscous * matrix(&s.viscosity(x));
            let error = largest(&(&found - &expected));
            assert!(error <= 1e-7 * largest(&expected), "{name}: {error} of {}", largest(&expected));
            let scale = largest(&hessian) * extent(x) * (1.0 + norm(x[0]) / extent(x));
            for (f, g) in force.iter().zip(s.force(x)) {
                assert!(norm(sub(*f, g)) <= 1e-8 * scale, "{name}: force {f:?} {g:?}");
            }
        }
    }
}

/// Where the exact Hessian has no negative eigenvalue the projected one is the same.
pub fn kept_where_convex<S: Stencil<N>, const N: usize>(s: &S, x: &[Vec3; N], name: &str) -> bool {
    let exact = matrix(&s.hessian(x, HessianForm::Exact));
    let scale = largest(&exact);
    if exact.clone().symmetric_eigen().eigenvalues.min() < -1e-12 * scale {
        return false;
    }
    let difference = largest(&(matrix(&s.hessian(x, HessianForm::Projected)) - exact));
    assert!(difference <= 1e-9 * scale, "{name}: {difference} of {scale}");
    true
}

/// Turned and shifted: the same energy, turned forces; no net force, no net torque, no damping of rigid motion.
pub fn rigid_motion<S: Stencil<N>, const N: usize>(s: &S, x: &[Vec3; N], pose: &Pose, name: &str) {
    as_one_by_one(s, x, name);
    let force = s.force(x);
    let stiffness = largest(&matrix(&s.hessian(x, HessianForm::Projected)));
    let scale = stiffness * extent(x);
    let far = 1.0 + norm(x[0]) / extent(x);
    let y = x.map(|p| pose.transform(p));
    assert!((s.energy(&y) - s.energy(x)).abs() <= 1e-10 * far * scale * extent(x), "{name}: energy");
    for (turned, f) in s.force(&y).iter().zip(&force) {
        assert!(norm(sub(*turned, mat_vec(&pose.rotation(), *f))) <= 1e-9 * far * scale, "{name}: turned force");
    }
    let net = force.iter().fold([0.0; 3], |a, f| add(a, *f));
    assert!(norm(net) <= 1e-12 * far * scale, "{name}: net force {net:?}");
    let torque = force.iter().zip(x).fold([0.0; 3], |t, (f, p)| add(t, cross(sub(*p, x[0]), *f)));
    assert!(norm(torque) <= 1e-10 * far * scale * extent(x), "{name}: net torque {torque:?}");
    let viscosity = s.viscosity(x);
    let velocity = x.map(|p| add(pose.position, cross([0.3, -0.7, 0.5], sub(p, x[0]))));
    let speed = velocity.iter().fold(0.0_f64, |a, v| a.max(norm(*v)));
    for row in &viscosity {
        let f = row.iter().zip(&velocity).fold([0.0; 3], |f, (b, v)| add_scaled(f, 1.0, mat_vec(b, *v)));
        assert!(norm(f) <= 1e-10 * far * stiffness * speed, "{name}: damping of a rigid motion {f:?}");
    }
}

/// At rest: no energy, no force, and the viscosity is the Hessian.
pub fn at_rest<S: Stencil<N>, const N: usize>(s: &S, rest: &[Vec3; N], name: &str) {
    let hessian = matrix(&s.hessian(rest, HessianForm::Exact));
    let scale = largest(&hessian);
    assert!(s.energy(rest) <= 1e-20 * scale * extent(rest).powi(2), "{name}: {}", s.energy(rest));
    assert!(s.force(rest).iter().all(|f| norm(*f) <= 1e-12 * scale * extent(rest)), "{name}: force at rest");
    let difference = largest(&(matrix(&s.viscosity(rest)) - &hessian));
    assert!(difference <= 1e-9 * scale, "{name}: viscosity differs by {difference} of {scale}");
}
