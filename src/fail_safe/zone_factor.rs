//! The direct solver of a zone in its unknowns: as narrow as the zone is long, however many rows it has.

use super::zone_rows::ZoneRows;
use crate::linalg::{BlockMatrix, Envelope, EnvelopeCholesky};
use crate::math::{IDENTITY, Vec3};

/// Block products up to which a zone is factored, and more by entry of its rows: what conjugate gradients would take.
const WORK: (usize, usize) = (20_000, 64);

/// Factors of `I + sigma A_S^T A_S` for sets S of rows. Pattern and order of elimination are those of all rows, made once.
pub(super) struct ZoneFactor {
    matrix: BlockMatrix,
    envelope: Envelope,
    factor: EnvelopeCholesky,
    /// Where the products of the entries of each row stand, row after row.
    places: Vec<u32>,
    /// Start of each row in `places`.
    offsets: Vec<usize>,
    no_fixed: Vec<bool>,
    buffer: Vec<Vec3>,
}

/// The factor of a zone, made when it is first asked for.
#[derive(Default)]
pub(super) struct LateFactor(Option<Option<ZoneFactor>>);

impl LateFactor {
    /// As of [`ZoneFactor::new`]; the rows are the same each time.
    pub fn of(&mut self, rows: &ZoneRows) -> Option<&mut ZoneFactor> {
        self.0.get_or_insert_with(|| ZoneFactor::new(rows)).as_mut()
    }
}

impl ZoneFactor {
    /// Of a zone's rows; `None` where its factor would cost more than iterations do. Cost: a sort of the entries' pairs.
    fn new(rows: &ZoneRows) -> Option<ZoneFactor> {
        let mut pairs = Vec::new();
        for i in 0..rows.len() {
            for (a, _) in rows.row(i) {
                pairs.extend(rows.row(i).map(|(b, _)| (a as u32, b as u32)));
            }
        }
        let matrix = BlockMatrix::from_places(rows.width, pairs.clone());
        let envelope = Envelope::new(&matrix);
        if envelope.work() > WORK.0 + WORK.1 * rows.entry_count() {
            return None;
        }
        let squares = (0..rows.len()).map(|i| rows.row(i).len().pow(2));
        let mut offsets = vec![0];
        squares.for_each(|n| offsets.push(offsets.last().copied().unwrap_or(0) + n));
        let places = pairs.iter().map(|(a, b)| matrix.place(*a, *b) as u32).collect();
        let (factor, buffer) = (EnvelopeCholesky::default(), Vec::new());
        Some(ZoneFactor { no_fixed: vec![false; rows.width], matrix, envelope, factor, places, offsets, buffer })
    }

    /// Factors `I + sigma A_S^T A_S` for the rows `set`; whether rounding has left it positive definite. Cost: the
    /// envelope's.
    pub fn assign(&mut self, rows: &ZoneRows, set: &[usize], sigma: f64) -> bool {
        self.matrix.values.fill([[0.0; 3]; 3]);
        for k in &self.matrix.diagonal {
            self.matrix.values[*k] = IDENTITY;
        }
        for i in set {
            let mut place = self.offsets[*i];
            for (_, x) in rows.row(*i) {
                for (_, y) in rows.row(*i) {
                    let block = &mut self.matrix.values[self.places[place] as usize];
                    place += 1;
                    for r in 0..3 {
                        let scaled = sigma * x[r];
                        for c in 0..3 {
                            block[r][c] += scaled * y[c];
                        }
                    }
                }
            }
        }
        self.factor.assign(&self.matrix, &self.envelope, &self.no_fixed)
    }

    /// `x := (I + sigma A_S^T A_S)^-1 x` of the set assigned last.
    pub fn solve(&mut self, x: &mut [Vec3]) {
        self.factor.solve(&self.envelope, x, &mut self.buffer);
    }
}
