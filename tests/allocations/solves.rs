//! Contact solves that repeat with the same scratch: once its buffers have their size they allocate nothing.

use super::allocations;
use signorini::constraint::{Angular, RowSet, Translations};
use signorini::implicit_contact::{ContactProblem, SolverReport, SolverScratch, solve};
use signorini::linalg::BlockMatrix;
use signorini::math::{IDENTITY, Mat3, Vec3, inverse, mat_add, mat_scale};
use signorini::model::{Settings, SolverChoice};
use signorini::parallel::Par;

/// A problem and what it is made of. Bodies fall at 4 cm/s and slide at 1 cm/s without contacts.
struct Owned {
    matrix: BlockMatrix,
    inverse: Vec<Mat3>,
    rows: RowSet,
    translations: Option<Translations>,
}

const FALL: f64 = 0.04;
const SLIDING: f64 = 0.01;

impl Owned {
    fn new(matrix: BlockMatrix) -> Owned {
        let inverse = (0..matrix.rows()).map(|b| inverse(matrix.diagonal_block(b)).unwrap()).collect();
        let rows = RowSet { offsets: vec![0], angular_offsets: vec![0], ..RowSet::default() };
        Owned { matrix, inverse, rows, translations: None }
    }

    /// A row with a vertical normal that demands this normal velocity of the response.
    fn contact(&mut self, linear: &[(u32, f64)], angular: &[(u32, Vec3)], target: f64, sliding: f64) {
        let rows = &mut self.rows;
        rows.blocks.extend(linear.iter().map(|(block, _)| *block));
        rows.weights.extend(linear.iter().map(|(_, weight)| *weight));
        rows.angular.extend(angular.iter().map(|(block, lever)| Angular { block: *block, lever: *lever }));
        rows.offsets.push(rows.blocks.len() as u32);
        rows.angular_offsets.push(rows.angular.len() as u32);
        rows.frames.push([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        rows.normal_targets.push(target);
        rows.sliding_velocities.push([sliding, 0.0]);
        rows.friction.push(0.3);
    }

    /// A sheet of `n` by `n` masses on springs, which lies on uneven ground.
    fn sheet(n: u32) -> Owned {
        let at = |i: u32, j: u32| j * n + i;
        let cells = |across: u32, along: u32| (0..along).flat_map(move |j| (0..across).map(move |i| (i, j)));
        let mut springs: Vec<(u32, u32)> = cells(n - 1, n).map(|(i, j)| (at(i, j), at(i + 1, j))).collect();
        springs.extend(cells(n, n - 1).map(|(i, j)| (at(i, j), at(i, j + 1))));
        let places = springs.iter().flat_map(|(a, b)| [(*a, *b), (*b, *a)]).collect();
        let mut matrix = BlockMatrix::from_places((n * n) as usize, places);
        let mut add = |row: u32, column: u32, block: &Mat3| {
            let place = matrix.place(row, column);
            matrix.values[place] = mat_add(&matrix.values[place], block);
        };
        (0..n * n).for_each(|b| add(b, b, &mat_scale(1e-3, &IDENTITY)));
        let stiffness = [[3e-3, 4e-4, 0.0], [4e-4, 2e-3, 1e-4], [0.0, 1e-4, 5e-4]];
        for (a, b) in springs {
            [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)]
                .into_iter()
                .for_each(|(row, column, sign)| add(row, column, &mat_scale(sign, &stiffness)));
        }
        let mut translations = Translations::new(&matrix, &vec![true; (n * n) as usize]);
        translations.update(&matrix);
        let mut made = Owned { translations: Some(translations), ..Owned::new(matrix) };
        for b in 0..n * n {
            made.contact(&[(b, 1.0)], &[], FALL * (1.0 + 0.3 * f64::from(b).sin()), SLIDING);
        }
        made
    }

    /// The same under a heavy point that presses on all of it.
    fn loaded_sheet(n: u32, mass: f64) -> Owned {
        let Owned { mut matrix, rows, .. } = Owned::sheet(n);
        let load = n * n;
        matrix.diagonal.push(matrix.values.len());
        matrix.columns.push(load);
        matrix.values.push(mat_scale(mass, &IDENTITY));
        matrix.row_offsets.push(matrix.values.len());
        let mut made = Owned { rows, ..Owned::new(matrix) };
        for b in 0..n * n {
            made.contact(&[(load, 1.0), (b, -1.0)], &[], FALL, SLIDING);
        }
        made
    }

    /// A stack of boxes on the ground, with contacts at four corners each.
    fn stack(count: u32) -> Owned {
        let blocks: Vec<Mat3> = (0..2 * count).map(|b| mat_scale([1.0, 2e-3][b as usize % 2], &IDENTITY)).collect();
        let mut made = Owned::new(BlockMatrix::from_diagonal(&blocks));
        for body in 0..count {
            let (own, below) = (2 * body, 2 * body.saturating_sub(1));
            for [x, y] in [[-0.1, -0.1], [0.1, -0.1], [-0.1, 0.1], [0.1, 0.1]] {
                let (bottom, top) = ([x, y, -0.05], [-x, -y, -0.05]);
                if body == 0 {
                    made.contact(&[(own, 1.0)], &[(own + 1, bottom)], FALL, SLIDING);
                } else {
                    let levers = [(own + 1, bottom), (below + 1, top)];
                    made.contact(&[(own, 1.0), (below, -1.0)], &levers, 0.0, 0.0);
                }
            }
        }
        made
    }

    fn view(&self) -> ContactProblem<'_> {
        ContactProblem {
            matrix: &self.matrix,
            inverse_diagonal: &self.inverse,
            rows: &self.rows,
            translations: self.translations.as_ref(),
            velocity_scale: FALL,
        }
    }

    /// What cold solves report, and what the third and those after it allocate.
    fn repeated(&self, settings: &Settings) -> (SolverReport, u64) {
        let problem = self.view();
        let mut scratch = SolverScratch::default();
        let (mut impulses, mut dv) = (vec![[0.0; 3]; self.rows.len()], vec![[0.0; 3]; self.inverse.len()]);
        let (mut report, mut steady) = (SolverReport::default(), 0);
        for call in 0..5 {
            impulses.fill([0.0; 3]);
            dv.fill([0.0; 3]);
            let count = allocations(|| {
                report = solve(&problem, &mut impulses, &mut dv, settings, &mut scratch, Par::Serial);
            });
            steady += if call < 2 { 0 } else { count };
        }
        (report, steady)
    }
}

#[test]
fn a_repeated_solve_of_a_cloth_on_the_ground_allocates_nothing() {
    let (report, steady) = Owned::sheet(40).repeated(&Settings::default());
    assert!(report.converged && report.hand_overs == 0 && report.iterations >= 10, "{report:?}");
    assert_eq!(steady, 0, "{report:?}");
}

#[test]
fn a_repeated_solve_of_a_stack_of_boxes_allocates_nothing() {
    let (report, steady) = Owned::stack(6).repeated(&Settings::default());
    assert!(report.converged, "{report:?}");
    assert_eq!(steady, 0, "{report:?}");
}

/// What a solve passes through where the first solver is not enough, each by itself.
#[test]
fn repeated_solves_that_are_handed_over_or_cut_off_allocate_nothing() {
    let tight = Settings { contact_tolerance: 1e-8, velocity_tolerance: 1e-8, ..Settings::default() };
    let by = |solver: SolverChoice| Settings { solver, ..Settings::default() };
    let within = |iterations_max: u32| Settings { iterations_max, ..Settings::default() };
    let cases = [
        ("conjugate gradients", Owned::sheet(40), by(SolverChoice::AugmentedLagrangian)),
        ("a factor", Owned::sheet(8), by(SolverChoice::AugmentedLagrangian)),
        ("double precision", Owned::sheet(40), Settings { solver: SolverChoice::AcceleratedRelaxation, ..tight }),
        ("relaxation and conjugate gradients in turn", Owned::loaded_sheet(16, 3.0), Settings::default()),
        ("passes and a factor in turn", Owned::stack(200), Settings::default()),
        ("a cloth that is cut off", Owned::sheet(40), within(1)),
        ("boxes that are cut off in turn", Owned::stack(40), within(1)),
    ];
    for (case, problem, settings) in cases {
        let (report, steady) = problem.repeated(&settings);
        assert_eq!(report.hand_overs > 0, case.contains("in turn"), "{case}: {report:?}");
        assert_eq!(steady, 0, "{case}: {report:?}");
    }
}
