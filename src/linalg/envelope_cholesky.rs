//! Direct factor of a symmetric positive definite block matrix within its envelope, rows ordered to keep that narrow.

use super::BlockMatrix;
use crate::math::{Mat3, Vec3, mat_add, mat_mul, mat_scale, mat_transpose_vec, mat_vec, sub, transpose};

/// Order of elimination and the envelope of the factor: of the pattern alone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Envelope {
    /// Row of the matrix at each place of the order.
    order: Vec<u32>,
    /// Place of each row.
    place: Vec<u32>,
    /// First place that each place's row of the factor reaches.
    first: Vec<u32>,
    /// Start of each row of the factor; one more entry than rows.
    offsets: Vec<usize>,
    /// Which rows a visit has seen, and those that it reached: capacity only.
    seen: Vec<bool>,
    reached: Vec<u32>,
}

impl Envelope {
    /// Reverse Cuthill-McKee order [George81, chapter 4], from a node far out in each component. Cost: a few passes
    /// over the pattern.
    pub fn new(matrix: &BlockMatrix) -> Envelope {
        let mut envelope = Envelope::default();
        envelope.assign(matrix);
        envelope
    }

    /// Makes this the envelope of `matrix` as [`Envelope::new`], in the memory that it has.
    pub fn assign(&mut self, matrix: &BlockMatrix) {
        let Envelope { order, place, first, offsets, seen, reached } = self;
        let n = matrix.rows();
        order.clear();
        seen.clear();
        seen.resize(n, false);
        for start in 0..n {
            if !seen[start] {
                let far = farthest(matrix, start, seen, reached);
                let far = farthest(matrix, far, seen, reached);
                visit(matrix, far, seen, order);
            }
        }
        order.reverse();
        place.clear();
        place.resize(n, 0);
        order.iter().enumerate().for_each(|(p, row)| place[*row as usize] = p as u32);
        first.clear();
        offsets.clear();
        offsets.push(0);
        for p in 0..n {
            let columns = row_columns(matrix, order[p] as usize);
            let reach = columns.iter().map(|c| place[*c as usize]).fold(p as u32, u32::min);
            first.push(reach);
            offsets.push(offsets[p] + p + 1 - reach as usize);
        }
    }

    /// Block products that a factorisation takes.
    pub fn work(&self) -> usize {
        self.offsets.windows(2).map(|w| (w[1] - w[0]) * (w[1] - w[0]) / 2).sum()
    }

    /// Number of blocks of the factor.
    pub fn len(&self) -> usize {
        self.offsets.last().copied().unwrap_or(0)
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }
}

fn row_columns(matrix: &BlockMatrix, row: usize) -> &[u32] {
    &matrix.columns[matrix.row_offsets[row]..matrix.row_offsets[row + 1]]
}

/// The last node that a breadth-first visit reaches; leaves `seen` as it was, and `reached` empty.
fn farthest(matrix: &BlockMatrix, start: usize, seen: &mut [bool], reached: &mut Vec<u32>) -> usize {
    visit(matrix, start, seen, reached);
    let last = reached.last().map_or(start, |row| *row as usize);
    reached.drain(..).for_each(|row| seen[row as usize] = false);
    last
}

/// Appends the component of `start` breadth first, neighbours with fewer neighbours first.
fn visit(matrix: &BlockMatrix, start: usize, seen: &mut [bool], order: &mut Vec<u32>) {
    let mut next = order.len();
    seen[start] = true;
    order.push(start as u32);
    while next < order.len() {
        let from = order.len();
        for column in row_columns(matrix, order[next] as usize) {
            if !std::mem::replace(&mut seen[*column as usize], true) {
                order.push(*column);
            }
        }
        order[from..].sort_unstable_by_key(|row| (row_columns(matrix, *row as usize).len(), *row));
        next += 1;
    }
}

/// `L L^T = A` within an envelope; diagonal blocks hold inverses.
#[derive(Clone, Debug, Default)]
pub struct EnvelopeCholesky {
    values: Vec<Mat3>,
}

impl EnvelopeCholesky {
    /// Factor of `matrix`, whose rows and columns that are `fixed` count as those of the identity.
    ///
    /// `None` where it is not positive definite. Cost: [`Envelope::work`].
    pub fn new(matrix: &BlockMatrix, envelope: &Envelope, fixed: &[bool]) -> Option<EnvelopeCholesky> {
        let mut factor = EnvelopeCholesky::default();
        factor.assign(matrix, envelope, fixed).then_some(factor)
    }

    /// Makes this the factor of `matrix` as [`EnvelopeCholesky::new`], in the memory that it has; whether there is one.
    pub fn assign(&mut self, matrix: &BlockMatrix, envelope: &Envelope, fixed: &[bool]) -> bool {
        let values = &mut self.values;
        values.clear();
        values.resize(envelope.len(), [[0.0; 3]; 3]);
        for p in 0..envelope.order.len() {
            let row = envelope.order[p] as usize;
            let (first, start) = (envelope.first[p] as usize, envelope.offsets[p]);
            let (done, rest) = values.split_at_mut(start);
            let own = &mut rest[..p + 1 - first];
            load(matrix, envelope, row, fixed, own);
            for q in first..p {
                let (other, reach) = (envelope.offsets[q], envelope.first[q] as usize);
                let from = first.max(reach);
                let mut block = own[q - first];
                for k in from..q {
                    let product = mat_mul(&own[k - first], &transpose(&done[other + k - reach]));
                    block = mat_add(&block, &mat_scale(-1.0, &product));
                }
                own[q - first] = mat_mul(&block, &transpose(&done[other + q - reach]));
            }
            let mut pivot = own[p - first];
            for block in &own[..p - first] {
                pivot = mat_add(&pivot, &mat_scale(-1.0, &mat_mul(block, &transpose(block))));
            }
            let Some(inverse) = inverse_factor(&pivot) else { return false };
            own[p - first] = inverse;
        }
        true
    }

    /// `x := A^-1 x`; `y` is a buffer. Cost: two passes over the factor.
    pub fn solve(&self, envelope: &Envelope, x: &mut [Vec3], y: &mut Vec<Vec3>) {
        let n = envelope.order.len();
        y.clear();
        y.extend(envelope.order.iter().map(|row| x[*row as usize]));
        for p in 0..n {
            let (first, start) = (envelope.first[p] as usize, envelope.offsets[p]);
            for q in first..p {
                y[p] = sub(y[p], mat_vec(&self.values[start + q - first], y[q]));
            }
            y[p] = mat_vec(&self.values[start + p - first], y[p]);
        }
        for p in (0..n).rev() {
            let (first, start) = (envelope.first[p] as usize, envelope.offsets[p]);
            y[p] = mat_transpose_vec(&self.values[start + p - first], y[p]);
            for q in first..p {
                y[q] = sub(y[q], mat_transpose_vec(&self.values[start + q - first], y[p]));
            }
        }
        envelope.order.iter().zip(y).for_each(|(row, y)| x[*row as usize] = *y);
    }
}

/// Writes the blocks of a row up to the diagonal to their places within the envelope.
fn load(matrix: &BlockMatrix, envelope: &Envelope, row: usize, fixed: &[bool], own: &mut [Mat3]) {
    let p = envelope.place[row] as usize;
    let first = p + 1 - own.len();
    for k in matrix.row_offsets[row]..matrix.row_offsets[row + 1] {
        let column = matrix.columns[k] as usize;
        let q = envelope.place[column] as usize;
        if q <= p && !fixed[row] && !fixed[column] {
            own[q - first] = matrix.values[k];
        }
    }
    if fixed[row] {
        own[p - first] = crate::math::IDENTITY;
    }
}

/// Inverse of the lower factor of a 3x3 block; `None` where that is not positive definite.
fn inverse_factor(m: &Mat3) -> Option<Mat3> {
    let root = |x: f64| (x > 0.0 && x.is_finite()).then(|| x.sqrt());
    let a = root(m[0][0])?;
    let (b, d) = (m[1][0] / a, m[2][0] / a);
    let c = root(m[1][1] - b * b)?;
    let e = (m[2][1] - d * b) / c;
    let f = root(m[2][2] - d * d - e * e)?;
    let (ia, ic, inverse_f) = (1.0 / a, 1.0 / c, 1.0 / f);
    let ib = -b * ia * ic;
    Some([[ia, 0.0, 0.0], [ib, ic, 0.0], [-(d * ia + e * ib) * inverse_f, -e * ic * inverse_f, inverse_f]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::math::{IDENTITY, norm, outer};

    /// A grid of nodes with springs of random directions, shuffled, and a lone node at the end.
    fn grid(n: usize) -> BlockMatrix {
        let count = n * n + 1;
        let shuffled = |i: usize| (i * 7 + 3) % (n * n);
        let mut dense = vec![vec![[[0.0; 3]; 3]; count]; count];
        let mut random = Random(5);
        let mut next = || random.signed();
        for row in dense.iter_mut().enumerate() {
            row.1[row.0] = mat_scale(1e-3, &IDENTITY);
        }
        for y in 0..n {
            for x in 0..n {
                for (dx, dy) in [(1, 0), (0, 1)] {
                    if x + dx < n && y + dy < n {
                        let (a, b) = (shuffled(y * n + x), shuffled((y + dy) * n + x + dx));
                        let d = [next(), next(), next()];
                        let k = outer(d, d);
                        for (i, j, s) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)] {
                            dense[i][j] = mat_add(&dense[i][j], &mat_scale(s, &k));
                        }
                    }
                }
            }
        }
        let mut matrix = BlockMatrix { row_offsets: vec![0], ..BlockMatrix::default() };
        for (i, row) in dense.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                if i == j {
                    matrix.diagonal.push(matrix.values.len());
                }
                if i == j || block.iter().flatten().any(|v| *v != 0.0) {
                    matrix.columns.push(j as u32);
                    matrix.values.push(*block);
                }
            }
            matrix.row_offsets.push(matrix.values.len());
        }
        matrix
    }

    #[test]
    fn the_factor_solves_and_the_order_keeps_the_envelope_narrow() {
        let matrix = grid(8);
        let envelope = Envelope::new(&matrix);
        assert!(envelope.len() <= 65 * 10, "{}", envelope.len());
        let mut order = envelope.order.clone();
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(i, row)| i as u32 == *row));
        let exact: Vec<Vec3> = (0..65).map(|i| [f64::from(i), 1.0, (f64::from(i)).sin()]).collect();
        let mut x: Vec<Vec3> = (0..65).map(|i| matrix.row_product(i, &exact)).collect();
        let factor = EnvelopeCholesky::new(&matrix, &envelope, &[false; 65]).unwrap();
        factor.solve(&envelope, &mut x, &mut Vec::new());
        assert!((0..65).all(|i| norm(sub(x[i], exact[i])) < 1e-8), "{x:?}");
    }

    #[test]
    fn fixed_rows_stand_apart_and_indefinite_matrices_are_none() {
        let mut matrix = grid(4);
        let envelope = Envelope::new(&matrix);
        let fixed: Vec<bool> = (0..17).map(|i| i % 5 == 0).collect();
        let mut reused = Envelope::new(&grid(8));
        reused.assign(&matrix);
        assert!(reused == envelope);
        let exact: Vec<Vec3> = (0..17).map(|i| if fixed[i] { [0.0; 3] } else { [1.0, i as f64, -2.0] }).collect();
        let rhs = |i: usize| if fixed[i] { [7.0; 3] } else { matrix.row_product(i, &exact) };
        let mut x: Vec<Vec3> = (0..17).map(rhs).collect();
        EnvelopeCholesky::new(&matrix, &envelope, &fixed).unwrap().solve(&envelope, &mut x, &mut Vec::new());
        for i in 0..17 {
            let wanted = if fixed[i] { [7.0; 3] } else { exact[i] };
            assert!(norm(sub(x[i], wanted)) < 1e-9, "{i}: {:?}", x[i]);
        }
        let place = matrix.diagonal[3];
        matrix.values[place][1][1] = -1.0;
        assert!(EnvelopeCholesky::new(&matrix, &envelope, &[false; 17]).is_none());
    }
}
