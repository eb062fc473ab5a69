//! Preconditioned conjugate gradients in single precision on increments from an iterate that is renewed in double
//! precision: the memory traffic of single precision, the accuracy of double. The preconditioner is the inverse diagonal
//! blocks.

use super::{BlockMatrix, GradientEnding, SinglePrecision, power_of_two};
use crate::math::simd::{Kernel, Quad, run_wide};
use crate::math::{Mat3, Vec3, ZERO_MATRIX, add, dot, inverse, mat_vec, sub};
use crate::parallel::Par;

/// Fall of the squared residual after which it is computed anew in double precision: what single precision loses in the
/// meantime stays far below it.
const RENEWAL: f64 = 1e-5;

/// A renewal that has not taken this share off the squared residual found rounding, not progress.
const PROGRESS: f64 = 0.5;

/// Residual, its image under the inverse diagonal and the increment of one block.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    residual: Quad,
    scaled: Quad,
    change: Quad,
}

/// Buffers; capacity only.
#[derive(Clone, Debug, Default)]
pub struct MixedGradient {
    matrix: SinglePrecision,
    exact_inverse: Vec<Mat3>,
    inverse: Vec<[Quad; 3]>,
    exact: Vec<Vec3>,
    nodes: Vec<Node>,
    direction: Vec<Quad>,
    image: Vec<Quad>,
}

impl MixedGradient {
    /// Takes a symmetric positive definite matrix; rows that are `fixed` are left out of it.
    ///
    /// Cost: a pass over the blocks.
    pub fn prepare(&mut self, matrix: &BlockMatrix, fixed: &[bool], par: Par) {
        self.matrix.assign(matrix);
        let n = fixed.len();
        self.exact_inverse.resize(n, ZERO_MATRIX);
        par.map_into(&mut self.exact_inverse, |i| {
            if fixed[i] { ZERO_MATRIX } else { inverse(matrix.diagonal_block(i)).unwrap_or(ZERO_MATRIX) }
        });
        self.inverse.resize(n, [Quad::default(); 3]);
        let (exact, mass) = (&self.exact_inverse, self.matrix.unit());
        par.map_into(&mut self.inverse, |i| {
            [0, 1, 2].map(|c| Quad::round([exact[i][0][c], exact[i][1][c], exact[i][2][c]], mass))
        });
        self.exact.resize(n, [0.0; 3]);
        self.nodes.resize(n, Node::default());
        self.direction.resize(n, Quad::default());
        self.image.resize(n, Quad::default());
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
        let (mut steps, mut last, mut beta, mut old) = (0, f64::INFINITY, 0.0, (0.0, 1.0));
        self.direction.fill(Quad::default());
        loop {
            let square = self.residual_squared(matrix, b, x, par);
            if square <= target {
                return (steps, GradientEnding::Converged);
            }
            if !square.is_finite() {
                return (steps, GradientEnding::Breakdown);
            }
            if square > PROGRESS * last || steps >= steps_max {
                return (steps, GradientEnding::Capped);
            }
            last = square;
            let unit = power_of_two(self.exact.iter().flatten().fold(0.0, |m: f64, f| m.max(f.abs())));
            let mut rho = self.renew(unit, par);
            if old.0 > 0.0 {
                // The direction goes on, in the new unit.
                beta = rho / old.0 * (unit / old.1);
            }
            let enough = (0.5 * target).max(RENEWAL * square) / (unit * unit / self.matrix.unit());
            let mut sound = true;
            while sound {
                let curvature = self.turn(beta as f32, par);
                sound = curvature > 0.0 && rho.is_finite();
                if sound {
                    let next = self.descend((rho / curvature) as f32, par);
                    steps += 1;
                    beta = next / rho;
                    rho = next;
                    if rho <= enough || steps >= steps_max {
                        break;
                    }
                }
            }
            let (nodes, up) = (&self.nodes, unit / self.matrix.unit());
            par.for_each_block(x, |start, x| {
                for (i, x) in x.iter_mut().enumerate() {
                    *x = add(*x, nodes[start + i].change.widen(up));
                }
            });
            old = (rho, unit);
            if !sound {
                return (steps, GradientEnding::Breakdown);
            }
        }
    }

    /// Takes over the exact residual, in a unit of impulse; returns its square.
    fn renew(&mut self, unit: f64, par: Par) -> f64 {
        let (exact, inverse) = (&self.exact, &self.inverse);
        par.update_and_sum(&mut self.nodes, |s, nodes| {
            run_wide(Renew { nodes, exact: &exact[s..], inverse: &inverse[s..], unit: 1.0 / unit })
        })
    }

    /// The next direction `d = z + beta d` and its image; returns `d · A d`.
    fn turn(&mut self, beta: f32, par: Par) -> f64 {
        let nodes = &self.nodes;
        par.for_each_block(&mut self.direction, |s, d| run_wide(Turn { d, nodes: &nodes[s..], beta }));
        let (matrix, d) = (&self.matrix, &self.direction);
        par.update_and_sum(&mut self.image, |start, out| run_wide(Image { matrix, d, start, out }))
    }

    /// A step of `alpha` along the direction; returns the squared residual.
    fn descend(&mut self, alpha: f32, par: Par) -> f64 {
        let (inverse, image, d) = (&self.inverse, &self.image, &self.direction);
        par.update_and_sum(&mut self.nodes, |s, nodes| {
            run_wide(Descend { nodes, inverse: &inverse[s..], image: &image[s..], d: &d[s..], alpha })
        })
    }
}

struct Renew<'a> {
    nodes: &'a mut [Node],
    exact: &'a [Vec3],
    inverse: &'a [[Quad; 3]],
    unit: f64,
}

impl Kernel for Renew<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for ((node, f), inverse) in self.nodes.iter_mut().zip(self.exact).zip(self.inverse) {
            let residual = Quad::round(*f, self.unit);
            let scaled = Quad::combine(inverse, residual);
            *node = Node { residual, scaled, change: Quad::default() };
            sum = sum + residual * scaled;
        }
        sum.total()
    }
}

struct Turn<'a> {
    d: &'a mut [Quad],
    nodes: &'a [Node],
    beta: f32,
}

impl Kernel for Turn<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (d, node) in self.d.iter_mut().zip(self.nodes) {
            *d = node.scaled.add_scaled(self.beta, *d);
        }
    }
}

struct Image<'a> {
    matrix: &'a SinglePrecision,
    d: &'a [Quad],
    start: usize,
    out: &'a mut [Quad],
}

impl Kernel for Image<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for (i, y) in self.out.iter_mut().enumerate() {
            *y = self.matrix.rounded_row_product(self.start + i, self.d);
            sum = sum + self.d[self.start + i] * *y;
        }
        sum.total()
    }
}

struct Descend<'a> {
    nodes: &'a mut [Node],
    inverse: &'a [[Quad; 3]],
    image: &'a [Quad],
    d: &'a [Quad],
    alpha: f32,
}

impl Kernel for Descend<'_> {
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut sum = Quad::default();
        for (i, node) in self.nodes.iter_mut().enumerate() {
            let residual = node.residual.add_scaled(-self.alpha, self.image[i]);
            let scaled = Quad::combine(&self.inverse[i], residual);
            *node = Node { residual, scaled, change: node.change.add_scaled(self.alpha, self.d[i]) };
            sum = sum + residual * scaled;
        }
        sum.total()
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
