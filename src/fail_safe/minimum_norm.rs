//! The smallest vector that meets equations which may repeat or contradict each other.

use super::zone_factor::{LateFactor, ZoneFactor};
use super::zone_rows::{ZoneRows, inner};
use crate::math::{Vec3, add_scaled, scale};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Rank cut: directions whose singular value is below this share of the largest one are left out. Rows are unit vectors.
const RANK_CUT: f64 = 1e-6;

/// Rows up to which matrices are dense and the spectrum is computed.
const DENSE_ROWS: usize = 128;

/// The penalty, relative to unit rows, of the factor in the unknowns: directions below 1e-5 of the largest fade out.
const PENALTY: f64 = 1e10;

/// Rows up to which `A A^T` is factored; more are solved by bidiagonalisation.
const FACTORED_ROWS: usize = 800;

/// Solves with the factor, each from what the last one left.
const REFINEMENTS: usize = 6;

/// Multipliers beyond this multiple of the right side tell that the equations contradict each other.
const LARGEST_MULTIPLIER: f64 = 1e9;

/// Bidiagonalisations at most, each from what the last one left: orthogonality that rounding took is made anew.
const RESTARTS: usize = 3;

/// Sweeps of the symmetric eigenvalue iteration at most, per row.
const EIGEN_SWEEPS: usize = 64;

/// Residual, relative to the right side, at which bidiagonalisation ends.
const TOLERANCE: f64 = 1e-13;

/// A solution of `A y = r` with its multipliers: `y = A^T lambda`.
pub(super) struct MinimumNorm {
    pub y: Vec<Vec3>,
    pub multipliers: Vec<f64>,
    /// Directions used; of a factor all rows, of bidiagonalisation its steps.
    pub rank: usize,
}

/// The least-squares solution of `A y = r` of smallest norm, at the rank cut.
///
/// Few rows: by the eigenvectors of `A A^T`, refined once. More: by the factor in the unknowns where there is one, else by
/// a factor of `A A^T` with the square of the cut on its diagonal, refined: directions below the cut fade out. Many, or
/// such as contradict each other: by the bidiagonalisation of Golub and Kahan in the form of Paige and Saunders, at most
/// three times four steps a row; there the cut is what that many steps do not reach. Cost: cubic in few rows, else linear
/// in entries times steps.
pub(super) fn minimum_norm(rows: &ZoneRows, right: &[f64], factor: &mut LateFactor) -> MinimumNorm {
    if rows.len() <= DENSE_ROWS
        && let Some(solution) = by_spectrum(rows, right)
    {
        return solution;
    }
    if let Some(factor) = factor.of(rows)
        && let Some(solution) = by_unknowns(rows, right, factor)
    {
        return solution;
    }
    if rows.len() <= FACTORED_ROWS
        && let Some(solution) = by_factor(rows, right)
    {
        return solution;
    }
    let mut solution = by_bidiagonalisation(rows, right);
    for _ in 1..RESTARTS {
        let left: Vec<f64> = (0..rows.len()).map(|i| right[i] - rows.product(i, &solution.y)).collect();
        let next = by_bidiagonalisation(rows, &left);
        solution.multipliers.iter_mut().zip(&next.multipliers).for_each(|(sum, l)| *sum += l);
        solution.y = rows.transposed_product(&solution.multipliers);
        solution.rank = solution.rank.max(next.rank);
    }
    solution
}

fn by_spectrum(rows: &ZoneRows, right: &[f64]) -> Option<MinimumNorm> {
    let n = rows.len();
    let matrix = DMatrix::from_fn(n, n, |i, j| rows.inner_product(i.min(j), i.max(j)));
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, EIGEN_SWEEPS * n.max(1))?;
    let largest = eigen.eigenvalues.iter().fold(0.0_f64, |m, v| m.max(*v));
    let kept: Vec<usize> = (0..n).filter(|i| eigen.eigenvalues[*i] > RANK_CUT * RANK_CUT * largest).collect();
    let solve = |r: &DVector<f64>| {
        let mut lambda = DVector::zeros(n);
        for i in &kept {
            let vector = eigen.eigenvectors.column(*i);
            lambda.axpy(vector.dot(r) / eigen.eigenvalues[*i], &vector, 1.0);
        }
        lambda
    };
    let r = DVector::from_column_slice(right);
    let mut lambda = solve(&r);
    let y = rows.transposed_product(lambda.as_slice());
    let left = DVector::from_fn(n, |i, _| r[i] - rows.product(i, &y));
    lambda += solve(&left);
    let y = rows.transposed_product(lambda.as_slice());
    Some(MinimumNorm { y, multipliers: lambda.as_slice().to_vec(), rank: kept.len() })
}

/// Iterated Tikhonov regularisation in the unknowns; `None` where the equations contradict each other.
fn by_unknowns(rows: &ZoneRows, right: &[f64], factor: &mut ZoneFactor) -> Option<MinimumNorm> {
    let all: Vec<usize> = (0..rows.len()).collect();
    if !factor.assign(rows, &all, PENALTY) {
        return None;
    }
    let largest = right.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    let mut multipliers = vec![0.0; rows.len()];
    let mut y = vec![[0.0; 3]; rows.width];
    for _ in 0..REFINEMENTS {
        // Multipliers grow by `(A A^T + 1/penalty)^-1` of what is left, which is what the unknowns leave of it.
        let left: Vec<f64> = (0..rows.len()).map(|i| PENALTY * (right[i] - rows.product(i, &y))).collect();
        let mut change = rows.transposed_product(&left);
        factor.solve(&mut change);
        for (i, multiplier) in multipliers.iter_mut().enumerate() {
            *multiplier += left[i] - PENALTY * rows.product(i, &change);
        }
        y = rows.transposed_product(&multipliers);
    }
    let bounded = multipliers.iter().all(|l| l.abs() <= LARGEST_MULTIPLIER * largest);
    bounded.then_some(MinimumNorm { y, rank: rows.len(), multipliers })
}

/// Iterated Tikhonov regularisation; `None` where the equations contradict each other.
fn by_factor(rows: &ZoneRows, right: &[f64]) -> Option<MinimumNorm> {
    let n = rows.len();
    let mut matrix = DMatrix::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            matrix[(i, j)] = rows.inner_product(i, j);
        }
    }
    let sum = |j: usize| (0..n).map(|i| matrix[(i.max(j), i.min(j))].abs()).sum::<f64>();
    let bound = (0..n).map(sum).fold(0.0, f64::max);
    // The largest sum of a row bounds the largest eigenvalue.
    (0..n).for_each(|i| matrix[(i, i)] += RANK_CUT * RANK_CUT * bound);
    let factor = matrix.cholesky()?;
    let largest = right.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    let mut lambda = DVector::<f64>::zeros(n);
    for _ in 0..REFINEMENTS {
        let y = rows.transposed_product(lambda.as_slice());
        lambda += factor.solve(&DVector::from_fn(n, |i, _| right[i] - rows.product(i, &y)));
    }
    if !lambda.iter().all(|l| l.abs() <= LARGEST_MULTIPLIER * largest) {
        return None;
    }
    let y = rows.transposed_product(lambda.as_slice());
    Some(MinimumNorm { y, multipliers: lambda.as_slice().to_vec(), rank: n })
}

/// LSQR, which also keeps each direction's multipliers.
fn by_bidiagonalisation(rows: &ZoneRows, right: &[f64]) -> MinimumNorm {
    let n = rows.len();
    let mut multipliers = vec![0.0; n];
    let normalise = |x: &mut [f64]| {
        let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
        x.iter_mut().for_each(|v| *v *= inverse);
        length
    };
    let mut u = right.to_vec();
    let start = normalise(&mut u);
    let mut v = rows.transposed_product(&u);
    let mut alpha = inner(&v, &v).sqrt();
    let mut steps = 0;
    if start > 0.0 && alpha > 0.0 {
        v.iter_mut().for_each(|x| *x = scale(1.0 / alpha, *x));
        // v = A^T p, and the direction of search is A^T w.
        let mut p: Vec<f64> = u.iter().map(|x| x / alpha).collect();
        let mut w = p.clone();
        let (mut phi, mut rho) = (start, alpha);
        let mut frobenius = alpha * alpha;
        while steps < 4 * n {
            steps += 1;
            for i in 0..n {
                u[i] = rows.product(i, &v) - alpha * u[i];
            }
            let beta = normalise(&mut u);
            let image = rows.transposed_product(&u);
            v.iter_mut().zip(&image).for_each(|(x, a)| *x = add_scaled(*a, -beta, *x));
            alpha = inner(&v, &v).sqrt();
            let inverse = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
            v.iter_mut().for_each(|x| *x = scale(inverse, *x));
            p.iter_mut().zip(&u).for_each(|(p, u)| *p = inverse * (u - beta * *p));
            let length = rho.hypot(beta);
            let (cosine, sine) = (rho / length, beta / length);
            let (theta, step) = (sine * alpha, cosine * phi);
            rho = -cosine * alpha;
            phi *= sine;
            frobenius += alpha * alpha + beta * beta;
            for i in 0..n {
                multipliers[i] += step / length * w[i];
                w[i] = p[i] - theta / length * w[i];
            }
            let gradient = phi * alpha * cosine.abs();
            if phi <= TOLERANCE * start || gradient <= TOLERANCE * frobenius.sqrt() * phi || alpha == 0.0 {
                break;
            }
        }
    }
    MinimumNorm { y: rows.transposed_product(&multipliers), multipliers, rank: steps }
}
