//! Rigid translations of what a metric couples: the modes in which a solve must balance momentum.

use crate::linalg::BlockMatrix;
use crate::math::{Mat3, Vec3, ZERO_MATRIX, add, inverse, mat_add, mat_vec, norm, sub};

/// Marks blocks of no component.
const NONE: u32 = u32::MAX;

/// The connected components of a metric and their masses under translation.
#[derive(Clone, Debug, Default)]
pub struct Translations {
    /// Component of each linear block that is coupled to others; `u32::MAX` for the rest.
    component: Vec<u32>,
    /// Inverse of the sum of all blocks of A within each component.
    inverse_masses: Vec<Mat3>,
    /// Blocks that translate.
    linear: Vec<bool>,
}

impl Translations {
    /// The components of a pattern over the blocks that `linear` marks; masses follow by [`Translations::update`]. Cost:
    /// linear in the entries of A.
    pub fn new(matrix: &BlockMatrix, linear: &[bool]) -> Translations {
        let rows = matrix.rows();
        let entries = |row: usize| matrix.row_offsets[row]..matrix.row_offsets[row + 1];
        let mut parent: Vec<u32> = (0..rows as u32).collect();
        for row in 0..rows {
            for k in entries(row) {
                if matrix.columns[k] > row as u32 {
                    let (a, b) = (root(&mut parent, row as u32), root(&mut parent, matrix.columns[k]));
                    // The smaller index leads, so that components are numbered in block order.
                    parent[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let mut component = vec![NONE; rows];
        let mut number_of_root = vec![NONE; rows];
        let mut count = 0;
        for row in (0..rows).filter(|row| linear[*row] && entries(*row).len() > 1) {
            let number = &mut number_of_root[root(&mut parent, row as u32) as usize];
            if *number == NONE {
                *number = count;
                count += 1;
            }
            component[row] = *number;
        }
        Translations { component, inverse_masses: vec![ZERO_MATRIX; count as usize], linear: linear.to_vec() }
    }

    /// Sums the masses of the components, from a matrix of this pattern. Cost: a pass over its entries.
    pub fn update(&mut self, matrix: &BlockMatrix) {
        self.inverse_masses.fill(ZERO_MATRIX);
        for (row, component) in self.component.iter().enumerate().filter(|(_, c)| **c != NONE) {
            let mass = &mut self.inverse_masses[*component as usize];
            for k in matrix.row_offsets[row]..matrix.row_offsets[row + 1] {
                if self.linear[matrix.columns[k] as usize] {
                    *mass = mat_add(mass, &matrix.values[k]);
                }
            }
        }
        self.inverse_masses.iter_mut().for_each(|m| *m = inverse(m).unwrap_or(ZERO_MATRIX));
    }

    /// Writes the translation of each component that makes `product`, which is `A dv`, and the impulses sum up to the same
    /// `[m/s]`. Cost: a pass over the blocks.
    ///
    /// It is the correction that brings `dv` closest to the solution of `A dv = impulses` in the norm of A. Stiffness
    /// does not feel a translation of the whole, so that what the masses gain is then what contacts gave, to rounding.
    pub fn missing(&self, impulses: &[Vec3], product: &[Vec3], out: &mut Vec<Vec3>) {
        out.clear();
        out.resize(self.inverse_masses.len(), [0.0; 3]);
        for (row, component) in self.component.iter().enumerate().filter(|(_, c)| **c != NONE) {
            let sum = &mut out[*component as usize];
            *sum = add(*sum, sub(impulses[row], product[row]));
        }
        out.iter_mut().zip(&self.inverse_masses).for_each(|(r, m)| *r = mat_vec(m, *r));
    }

    /// The component that block `b` belongs to.
    pub fn component(&self, b: usize) -> Option<usize> {
        let c = self.component[b];
        (c != NONE).then_some(c as usize)
    }

    /// Inverse masses of the components under translation `[1/kg]`.
    pub fn inverse_masses(&self) -> &[Mat3] {
        &self.inverse_masses
    }

    /// Adds the translation of its component to each block; returns the largest.
    pub fn translate(&self, shifts: &[Vec3], dv: &mut [Vec3]) -> f64 {
        for (v, component) in dv.iter_mut().zip(&self.component).filter(|(_, c)| **c != NONE) {
            *v = add(*v, shifts[*component as usize]);
        }
        shifts.iter().fold(0.0, |largest, t| largest.max(norm(*t)))
    }
}

fn root(parent: &mut [u32], mut block: u32) -> u32 {
    while parent[block as usize] != block {
        parent[block as usize] = parent[parent[block as usize] as usize];
        block = parent[block as usize];
    }
    block
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{IDENTITY, mat_scale, scale};

    /// Two chains of springs, one of them anchored, a lone mass between them in block order.
    fn chains() -> BlockMatrix {
        let bond = |k: f64| mat_scale(-k, &IDENTITY);
        let rows: Vec<Vec<(u32, Mat3)>> = vec![
            vec![(0, mat_scale(2.0 + 5.0, &IDENTITY)), (3, bond(5.0))],
            vec![(1, mat_scale(1.0 + 4.0 + 9.0, &IDENTITY)), (4, bond(4.0))],
            vec![(2, IDENTITY)],
            vec![(0, bond(5.0)), (3, mat_scale(3.0 + 5.0, &IDENTITY))],
            vec![(1, bond(4.0)), (4, mat_scale(1.0 + 4.0, &IDENTITY))],
        ];
        let mut a = BlockMatrix { row_offsets: vec![0], ..BlockMatrix::default() };
        for (i, row) in rows.into_iter().enumerate() {
            for (column, value) in row {
                if column as usize == i {
                    a.diagonal.push(a.values.len());
                }
                a.columns.push(column);
                a.values.push(value);
            }
            a.row_offsets.push(a.values.len());
        }
        a
    }

    #[test]
    fn components_gain_what_impulses_give() {
        let a = chains();
        let mut modes = Translations::new(&a, &[true; 5]);
        modes.update(&a);
        let impulses = [[1.0, 0.0, 2.0], [0.5, 0.0, 0.0], [7.0; 3], [0.0, -3.0, 0.0], [0.0; 3]];
        let mut dv = vec![[0.1, 0.2, 0.3], [0.0; 3], [9.0; 3], [-0.4, 0.0, 0.0], [1.0, 1.0, 1.0]];
        let balance = |impulses: &[Vec3], dv: &mut [Vec3]| {
            let product: Vec<Vec3> = (0..5).map(|row| a.row_product(row, dv)).collect();
            let mut missing = Vec::new();
            modes.missing(impulses, &product, &mut missing);
            modes.translate(&missing, dv)
        };
        let largest = balance(&impulses, &mut dv);
        // The free chain has masses 2 and 3; its springs cancel.
        let gained = add(scale(2.0, dv[0]), scale(3.0, dv[3]));
        assert!(norm(sub(gained, [1.0, -3.0, 2.0])) < 1e-14, "{gained:?}");
        let anchored = add(a.row_product(1, &dv), a.row_product(4, &dv));
        assert!(norm(sub(anchored, [0.5, 0.0, 0.0])) < 1e-14, "{anchored:?}");
        assert_eq!(dv[2], [9.0; 3], "what is coupled to nothing stays");
        assert!(largest > 0.0 && balance(&impulses, &mut dv) < 1e-15);
    }

    #[test]
    fn angular_blocks_do_not_translate() {
        let a = chains();
        let mut modes = Translations::new(&a, &[true, true, true, false, true]);
        modes.update(&a);
        let (mut dv, mut missing) = (vec![[0.0; 3]; 5], Vec::new());
        modes.missing(&[[7.0, 0.0, 0.0]; 5], &[[0.0; 3]; 5], &mut missing);
        modes.translate(&missing, &mut dv);
        assert_eq!(dv[3], [0.0; 3]);
        assert!((dv[0][0] - 1.0).abs() < 1e-15, "7 over its own diagonal block");
    }
}
