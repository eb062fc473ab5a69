//! Each energy in turn.

use crate::checks::{at_rest, derivatives, kept_where_convex, matrix, projected, rigid_motion};
use crate::configurations::{hinge, mirrored, near, pose, pressed, tetrahedron, triangle};
use crate::random::Random;
use signorini::energy::{
    CorotationalTetrahedron, FaceDrag, Gravity, HessianForm, Hinge, Spring, Stencil, TargetSpring, TriangleMembrane,
};
use signorini::math::{Vec3, add_scaled, dot, norm, scale, sub};

const CASES: usize = 200;

/// Young's moduli and Poisson's ratios from jelly to steel.
fn moduli(random: &mut Random) -> (f64, f64) {
    (random.power(3.0, 9.0), random.between(0.0, 0.48))
}

#[test]
fn springs() {
    let mut random = Random::new(1);
    let mut convex = 0;
    for case in 0..CASES {
        let rest_length = if case % 10 == 0 { 0.0 } else { random.between(0.1, 2.0) };
        let spring = Spring { stiffness: random.power(0.0, 5.0), rest_length };
        let rest = [random.vector(), random.vector()];
        let stretched = near(&rest, 0.4, &mut random);
        let short = [rest[0], add_scaled(rest[0], 0.05, sub(rest[1], rest[0]))];
        for x in [rest, stretched, short] {
            derivatives(&spring, &x, 1e-6, "spring");
            projected(&spring, &x, "spring");
            rigid_motion(&spring, &x, &pose(&mut random), "spring");
            convex += u32::from(kept_where_convex(&spring, &x, "spring"));
        }
        let direction = scale(1.0 / norm(sub(rest[1], rest[0])), sub(rest[1], rest[0]));
        if rest_length > 0.0 {
            at_rest(&spring, &[rest[0], add_scaled(rest[0], rest_length, direction)], "spring");
        }
        projected(&spring, &[rest[0], rest[0]], "spring of no length");
        assert_eq!(spring.force(&[rest[0], rest[0]]), [[0.0; 3]; 2]);
    }
    assert!(convex > 100);
}

#[test]
fn nodes_in_fields() {
    let mut random = Random::new(2);
    for _ in 0..CASES {
        let x = [random.vector()];
        let target = TargetSpring { stiffness: random.power(0.0, 5.0), target: random.vector() };
        derivatives(&target, &x, 1e-6, "target spring");
        projected(&target, &x, "target spring");
        let gravity = Gravity { mass: random.power(-3.0, 3.0), acceleration: random.vector() };
        let weight = gravity.force(&x)[0];
        for c in 0..3 {
            let (mut ahead, mut behind) = (x, x);
            ahead[0][c] += 1e-3;
            behind[0][c] -= 1e-3;
            let slope = (gravity.energy(&ahead) - gravity.energy(&behind)) / 2e-3;
            assert!((slope + weight[c]).abs() <= 1e-9 * norm(weight));
        }
    }
}

#[test]
fn tetrahedra() {
    let mut random = Random::new(3);
    let mut convex = 0;
    for _ in 0..CASES {
        let rest = tetrahedron(&mut random);
        let (young, poisson) = moduli(&mut random);
        let Some(solid) = CorotationalTetrahedron::new(&rest, young, poisson) else { continue };
        let name = "tetrahedron";
        at_rest(&solid, &near(&rest, 0.0, &mut random), name);
        for x in [
            near(&rest, 0.01, &mut random),
            near(&rest, 0.3, &mut random),
            pressed(&rest, 0.3, &mut random),
            mirrored(&rest, 0.05, &mut random),
        ] {
            projected(&solid, &x, name);
            rigid_motion(&solid, &x, &pose(&mut random), name);
            // Finite differences only away from where two singular values cancel and the rotation jumps.
            if least_sum(&rest, &x) > 0.05 {
                derivatives(&solid, &x, 2e-5, name);
                convex += u32::from(kept_where_convex(&solid, &x, name));
            }
        }
    }
    assert!(convex > 20, "{convex}");
}

/// Smallest sum of two signed singular values of the deformation, by nalgebra.
fn least_sum(rest: &[Vec3; 4], x: &[Vec3; 4]) -> f64 {
    let edges = |p: &[Vec3; 4]| nalgebra::Matrix3::from_fn(|r, c| p[c + 1][r] - p[0][r]);
    let f = edges(x) * edges(rest).try_inverse().unwrap();
    let mut sigma: Vec<f64> = f.singular_values().iter().copied().collect();
    sigma.sort_by(f64::total_cmp);
    sigma[1] + sigma[0] * f.determinant().signum()
}

#[test]
fn degenerate_tetrahedra_have_finite_forces_and_are_pushed_back() {
    let mut random = Random::new(4);
    for _ in 0..CASES {
        let rest = tetrahedron(&mut random);
        let (young, poisson) = moduli(&mut random);
        let Some(solid) = CorotationalTetrahedron::new(&rest, young, poisson) else { continue };
        let flat = pressed(&rest, 0.0, &mut random);
        let line = rest.map(|p| [p[0], 2.0 * p[0], -p[0]]);
        let point = [random.vector(); 4];
        for x in [flat, line, point, mirrored(&rest, 0.0, &mut random), mirrored(&rest, 0.6, &mut random)] {
            projected(&solid, &x, "degenerate tetrahedron");
            assert!(solid.energy(&x) > 0.0);
            // Down the force the energy falls: nothing stays inverted.
            let force = solid.force(&x);
            let steepest = force.iter().map(|f| dot(*f, *f)).sum::<f64>();
            let bound = solid.stiffness_bound(&x);
            let mut y = x;
            for (p, f) in y.iter_mut().zip(&force) {
                *p = add_scaled(*p, 1e-3 / bound, *f);
            }
            let fall = solid.energy(&x) - solid.energy(&y);
            assert!(fall >= 0.4e-3 * steepest / bound, "{fall} {steepest} {bound}");
        }
    }
    let inverted = [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    assert!(CorotationalTetrahedron::new(&inverted, 1.0, 0.3).is_none());
    assert!(CorotationalTetrahedron::new(&[[1.0; 3]; 4], 1.0, 0.3).is_none());
}

#[test]
fn uniaxial_strain_of_a_tetrahedron_has_the_stress_of_linear_elasticity() {
    let rest = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (young, poisson, strain) = (1e6, 0.3, 1e-6);
    let solid = CorotationalTetrahedron::new(&rest, young, poisson).unwrap();
    let stretched =
        rest.map(|p| [p[0] * (1.0 + strain), p[1] * (1.0 - poisson * strain), p[2] * (1.0 - poisson * strain)]);
    // Face opposite node 1 has area 1/2: a uniaxial stress E strain pulls it with E strain / 2, shared so that node 1
    // bears V sigma b1 = sigma / 6.
    let f = solid.force(&stretched);
    assert!((f[1][0] + young * strain / 6.0).abs() < 1e-5 * young * strain);
    assert!(f[2].iter().chain(&f[3]).all(|c| c.abs() < 1e-5 * young * strain));
}

#[test]
fn membranes() {
    let mut random = Random::new(5);
    let mut convex = 0;
    for _ in 0..CASES {
        let rest = triangle(&mut random);
        let (young, poisson) = moduli(&mut random);
        let membrane = TriangleMembrane::new(&rest, 1e-3, young, poisson, 1.0).unwrap();
        at_rest(&membrane, &near(&rest, 0.0, &mut random), "membrane");
        let larger = rest.map(|p| scale(1.3, p));
        at_rest(&TriangleMembrane::new(&rest, 1e-3, young, poisson, 1.3).unwrap(), &larger, "scaled membrane");
        let sheared = near(&rest, 0.3, &mut random);
        let stretched = near(&rest.map(|p| scale(1.5, p)), 0.1, &mut random);
        for x in [near(&rest, 0.01, &mut random), sheared, stretched, pressed(&rest, 0.2, &mut random)] {
            projected(&membrane, &x, "membrane");
            rigid_motion(&membrane, &x, &pose(&mut random), "membrane");
            if thinnest(&rest, &x) > 0.05 {
                derivatives(&membrane, &x, 2e-5, "membrane");
                convex += u32::from(kept_where_convex(&membrane, &x, "membrane"));
            }
        }
        let line = rest.map(|p| [p[0], 2.0 * p[0], -p[0]]);
        for x in [line, [random.vector(); 3]] {
            projected(&membrane, &x, "degenerate membrane");
        }
    }
    assert!(convex > 100, "{convex}");
    assert!(TriangleMembrane::new(&[[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]], 1.0, 1.0, 0.3, 1.0).is_none());
}

/// Smallest singular value of the deformation in the plane.
fn thinnest(rest: &[Vec3; 3], x: &[Vec3; 3]) -> f64 {
    let edges = |p: &[Vec3; 3]| nalgebra::Matrix3x2::from_fn(|r, c| p[c + 1][r] - p[0][r]);
    let (a, b) = (edges(x), edges(rest));
    let inverse = (b.transpose() * b).try_inverse().unwrap() * b.transpose();
    let sigma = (a * inverse).singular_values();
    let mut sigma: Vec<f64> = sigma.iter().copied().collect();
    sigma.sort_by(f64::total_cmp);
    // Three values of a rank two map: the first is zero.
    sigma[1]
}

#[test]
fn a_membrane_under_tension_contracts_by_poissons_ratio() {
    let rest = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let (young, poisson, strain) = (1e6, 0.3, 1e-6);
    let membrane = TriangleMembrane::new(&rest, 2e-3, young, poisson, 1.0).unwrap();
    let x = rest.map(|p| [p[0] * (1.0 + strain), p[1] * (1.0 - poisson * strain), 0.0]);
    let f = membrane.force(&x);
    assert!((f[1][0] + young * strain * 2e-3 / 2.0).abs() < 1e-5 * young * strain * 2e-3);
    assert!(f[2].iter().all(|c| c.abs() < 1e-5 * young * strain * 2e-3), "{f:?}");
}

#[test]
fn hinges() {
    let mut random = Random::new(6);
    for case in 0..CASES {
        let rest = hinge(&mut random);
        let bent = Hinge::new(&rest, random.power(-6.0, 0.0), case % 2 == 0).unwrap();
        let found = Hinge::angle(&rest).unwrap();
        assert_eq!(bent.rest_angle, if case % 2 == 0 { 0.0 } else { found });
        if case % 2 == 1 {
            at_rest(&bent, &near(&rest, 0.0, &mut random), "hinge");
        }
        for x in [near(&rest, 0.02, &mut random), near(&rest, 0.2, &mut random)] {
            derivatives(&bent, &x, 1e-5, "hinge");
            projected(&bent, &x, "hinge");
            rigid_motion(&bent, &x, &pose(&mut random), "hinge");
        }
        // A triangle pressed to a line has no normal: a named case.
        let mut line = rest;
        line[2] = add_scaled(rest[0], 0.3, sub(rest[1], rest[0]));
        projected(&bent, &line, "degenerate hinge");
        assert_eq!(bent.force(&line), [[0.0; 3]; 4]);
        assert!(Hinge::new(&line, 1.0, true).is_none());
    }
}

#[test]
fn a_hinge_measures_the_angle_between_its_normals() {
    for angle in [-3.0_f64, -1.0, 0.0, 0.4, 2.0] {
        // Vertex 3 is turned down by the angle: the normals open by as much.
        let x = [[0.0; 3], [2.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.7, -angle.cos(), -angle.sin()]];
        assert!((Hinge::angle(&x).unwrap() - angle).abs() < 1e-14, "{angle} {:?}", Hinge::angle(&x));
    }
}

#[test]
fn drag_opposes_what_passes_through_a_face() {
    let mut random = Random::new(7);
    for _ in 0..CASES {
        let (x, wind) = (triangle(&mut random), random.vector());
        let v = [random.vector(), random.vector(), random.vector()];
        let drag = FaceDrag { coefficient: random.between(0.1, 2.0) };
        let force = drag.force(&x, &v, wind);
        let secant = drag.secant(&x, &v, wind);
        // The secant is the force at v, positive semi-definite, and half of the derivative along the motion.
        let relative = v.map(|v| sub(v, wind));
        for (i, f) in force.iter().enumerate() {
            let product: Vec3 =
                std::array::from_fn(|r| -(0..3).map(|j| dot(secant[i][j][r], relative[j])).sum::<f64>());
            assert!(norm(sub(product, *f)) < 1e-13 * (1.0 + norm(*f)));
        }
        let m = matrix(&secant);
        assert!(m.clone().symmetric_eigen().eigenvalues.min() > -1e-14);
        let direction = random.vector();
        let h = 1e-6;
        let ahead = drag.force(&x, &v.map(|v| add_scaled(v, h, direction)), wind);
        let behind = drag.force(&x, &v.map(|v| add_scaled(v, -h, direction)), wind);
        let slope = scale(0.5 / h, sub(ahead[0], behind[0]));
        let row: Vec3 = std::array::from_fn(|r| -2.0 * (0..3).map(|j| dot(secant[0][j][r], direction)).sum::<f64>());
        assert!(norm(sub(slope, row)) < 1e-5, "{slope:?} {row:?}");
        assert!(relative.iter().zip(&force).map(|(u, f)| dot(*u, *f)).sum::<f64>() <= 1e-15, "drag takes energy");
    }
    let drag = FaceDrag { coefficient: 1.0 };
    assert_eq!(drag.force(&[[0.0; 3]; 3], &[[1.0; 3]; 3], [0.0; 3]), [[0.0; 3]; 3]);
    // The whole face at once: c A u^2.
    let x = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    let f = drag.force(&x, &[[0.0, 0.0, 3.0]; 3], [0.0; 3]);
    assert!((f[0][2] + 2.0 * 9.0 / 3.0).abs() < 1e-15);
}

#[test]
fn the_projected_hessian_of_a_hinge_is_the_exact_one_at_rest() {
    let mut random = Random::new(8);
    for _ in 0..CASES {
        let rest = hinge(&mut random);
        let bent = Hinge::new(&rest, 1e-3, false).unwrap();
        let exact = matrix(&bent.hessian(&rest, HessianForm::Exact));
        let close = matrix(&bent.hessian(&rest, HessianForm::Projected));
        assert!((exact - close).iter().all(|d| d.abs() < 1e-12));
    }
}
