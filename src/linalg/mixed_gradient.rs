//! Conjugate gradients in single precision on increments from an iterate that is renewed in double precision: the memory
//! traffic of single precision, the accuracy of double.

use super::{BlockMatrix, GradientEnding, SweepGradient, power_of_two};
use crate::math::{Mat3, Vec3, ZERO_MATRIX, add, dot, inverse, mat_vec, sub};
use crate::parallel::Par;

/// Fall of the squared residual after which it is computed anew in double precision: what single precision loses in the
/// meantime stays far below it.
const RENEWAL: f64 = 1e-5;

/// Share of the wanted fall that is left to the difference of the two norms.
const SAFETY: f64 = 0.5;

/// A renewal that has not taken this share off the squared residual found rounding, not progress.
const PROGRESS: f64 = 0.5;

/// Buffers; capacity only.
#[derive(Clone, Debug, Default)]
pub struct MixedGradient {
    sweep: SweepGradient,
    exact_inverse: Vec<Mat3>,
    exact: Vec<Vec3>,
    /// Whether no diagonal block says that the matrix is not positive definite.
    sound: bool,
}

impl MixedGradient {
    /// Takes a symmetric positive definite matrix; rows that are `fixed` are left out of it.
    ///
    /// Cost: a pass over the blocks.
    pub fn prepare(&mut self, matrix: &BlockMatrix, fixed: &[bool], par: Par) {
        self.sweep.assign(matrix, |i| fixed[i]);
        let n = fixed.len();
        self.exact_inverse.resize(n, ZERO_MATRIX);
        par.map_into(&mut self.exact_inverse, |i| {
            if fixed[i] { ZERO_MATRIX } else { inverse(matrix.diagonal_block(i)).unwrap_or(ZERO_MATRIX) }
        });
        let exact = &self.exact_inverse;
        self.sound = (0..n).all(|i| fixed[i] || (0..3).all(|k| exact[i][k][k] > 0.0));
        self.sweep.set_inverse(|i| exact[i], par);
        self.exact.resize(n, [0.0; 3]);
    }

    /// `|b - A x|^2` in the norm of the inverse diagonal blocks, over the rows that are not fixed.
    pub fn residual_squared(&mut self, matrix: &BlockMatrix, b: &[Vec3], x: &[Vec3], par: Par) -> f64 {
        let inverse = &self.exact_inverse;
        let free = |i: usize| inverse[i][0][0] > 0.0;
        par.map_into(&mut self.exact, |i| if free(i) { sub(b[i], matrix.row_product(i, x)) } else { [0.0; 3] });
        let exact = &self.exact;
        par.sum(exact.len(), |i| dot(exact[i], mat_vec(&inverse[i], exact[i])))
    }

    /// Solves `A x = b` for the matrix prepared last, from the given `x`, until [`Self::residual_squared`] is at most
    /// `target`. Returns the steps made. Fixed rows keep their `x`.
    ///
    /// `Capped`: out of steps, or further than single precision gets; `x` is then the best there was. Cost of a step: a
    /// product in single precision.
    pub fn solve(
        &mut self,
        matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        (target, steps_max): (f64, u32),
        par: Par,
    ) -> (u32, GradientEnding) {
        let (mut steps, mut last, mut beta, mut unit) = (0, f64::INFINITY, 0.0, 1.0);
        // The squared residual before the last step.
        let mut before = 0.0;
        self.sweep.forget();
        loop {
            let square = self.residual_squared(matrix, b, x, par);
            if square <= target {
                return (steps, GradientEnding::Converged);
            }
            if !(square.is_finite() && self.sound) {
                return (steps, GradientEnding::Breakdown);
            }
            if square > PROGRESS * last || steps >= steps_max {
                return (steps, GradientEnding::Capped);
            }
            last = square;
            let old = unit;
            unit = power_of_two(self.exact.iter().flatten().fold(0.0, |m: f64, f| m.max(f.abs())));
            let exact = &self.exact;
            let mut rho = self.sweep.begin(|i| exact[i], unit, par);
            if before > 0.0 {
                // The direction goes on, in the new unit.
                beta = rho / before * (unit / old);
            }
            // The norm of the sweep falls about as that of the diagonal does.
            let enough = (SAFETY * target / square).max(RENEWAL) * rho;
            let mut sound = true;
            while sound {
                let curvature = self.sweep.turn(beta as f32, par);
                sound = curvature > 0.0 && rho.is_finite();
                if sound {
                    let next = self.sweep.descend((rho / curvature) as f32, par);
                    steps += 1;
                    beta = next / rho;
                    (before, rho) = (rho, next);
                    if rho <= enough || steps >= steps_max {
                        break;
                    }
                }
            }
            let (sweep, up) = (&self.sweep, unit / self.sweep.unit());
            par.for_each_block(x, |start, x| {
                for (i, x) in x.iter_mut().enumerate() {
                    *x = add(*x, sweep.change(start + i).widen(up));
                }
            });
            if !sound {
                return (steps, GradientEnding::Breakdown);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{mat_scale, norm};

    /// A chain of masses on stiff springs, in an odd unit of mass.
    fn chain(n: u32, mass: f64) -> BlockMatrix {
        let places = (1..n).flat_map(|i| [(i, i - 1), (i - 1, i)]).collect();
        let mut a = BlockMatrix::from_places(n as usize, places);
        let spring = [[3.0, 0.4, 0.0], [0.4, 2.0, 0.1], [0.0, 0.1, 0.5]];
        for i in 0..n {
            let place = a.place(i, i);
            a.values[place] = mat_scale(mass, &[[7.0, 0.8, 0.0], [0.8, 4.1, 0.2], [0.0, 0.2, 1.01]]);
            if i > 0 {
                for (row, column) in [(i, i - 1), (i - 1, i)] {
                    let place = a.place(row, column);
                    a.values[place] = mat_scale(-mass, &spring);
                }
            }
        }
        a
    }

    #[test]
    fn goes_far_beyond_single_precision_and_leaves_fixed_rows_alone() {
        for mass in [1.0, 3e-70, 5e120] {
            let a = chain(3000, mass);
            let mut fixed = vec![false; 3000];
            fixed[7] = true;
            let exact: Vec<Vec3> = (0..3000).map(|i| [f64::from(i).sin(), 1.0 / mass.sqrt(), -f64::from(i)]).collect();
            let mut b = vec![[0.0; 3]; 3000];
            a.product(&exact, &mut b, Par::Serial);
            let mut x: Vec<Vec3> = exact.iter().map(|_| [0.0; 3]).collect();
            x[7] = exact[7];
            let mut solver = MixedGradient::default();
            solver.prepare(&a, &fixed, Par::Serial);
            let start = solver.residual_squared(&a, &b, &x, Par::Serial);
            let (steps, ending) = solver.solve(&a, &b, &mut x, (1e-22 * start, 2000), Par::Serial);
            assert_eq!(ending, GradientEnding::Converged, "{steps}");
            assert_eq!(x[7], exact[7]);
            let worst = (0..3000).map(|i| norm(sub(x[i], exact[i]))).fold(0.0, f64::max);
            assert!(worst < 1e-7 * norm(exact[2999]), "{worst}");
        }
    }

    #[test]
    fn threads_change_no_bit_and_what_is_indefinite_is_named() {
        let mut a = chain(5000, 0.01);
        let b: Vec<Vec3> = (0..5000).map(|i| [1.0, f64::from(i % 17), -0.3]).collect();
        let run = |a: &BlockMatrix, par: Par| {
            let mut x = vec![[0.0; 3]; 5000];
            let mut solver = MixedGradient::default();
            solver.prepare(a, &[false; 5000], par);
            let start = solver.residual_squared(a, &b, &x, par);
            let (steps, ending) = solver.solve(a, &b, &mut x, (1e-12 * start, 1000), par);
            (x, steps, ending)
        };
        let pool = crate::parallel::Pool::new(3).unwrap();
        let (serial, shared) = (run(&a, Par::Serial), run(&a, Par::Pool(&pool)));
        assert!(serial == shared && serial.2 == GradientEnding::Converged && serial.1 > 10);
        let place = a.place(100, 100);
        a.values[place] = mat_scale(-1.0, &a.values[place]);
        assert_ne!(run(&a, Par::Serial).2, GradientEnding::Converged);
    }
}
