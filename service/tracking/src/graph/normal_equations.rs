//! Sparse normal equations of a pose graph: pattern and symbolic factorisation once, numbers often.
//!
//! Blocks of three for each pose that is free, lower triangle, by columns. Cholesky of faer with its
//! fill-reducing order (approximate minimum degree).

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{ColMut, Side};
use nalgebra::{Matrix3, Vector3};

use crate::graph::pose_graph::Edge;

/// Where an edge's blocks stand.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Block of `from`; `None` for a pose that is held.
    from: Option<usize>,
    /// Block of `to`.
    to: Option<usize>,
    /// Place of the block below the diagonal among its column's, if both are free.
    below: usize,
}

/// The equations of a graph.
#[derive(Debug)]
pub(crate) struct NormalEquations {
    /// Block of each pose; `None` for one that is held.
    blocks: Vec<Option<usize>>,
    pattern: SymbolicSparseColMat<usize>,
    /// `None` if the pattern could not be analysed, which means that memory ran out.
    symbolic: Option<SymbolicLlt<usize>>,
    places: Vec<Place>,
    values: Vec<f64>,
    gradient: Vec<f64>,
}

impl NormalEquations {
    /// For a graph of `n_poses` poses with these edges, of which the first stays. Room for numbers, all 0.
    pub(crate) fn new(n_poses: usize, edges: &[Edge]) -> Self {
        let held: Vec<bool> = (0..n_poses).map(|pose| pose == 0).collect();
        Self::holding(&held, edges)
    }

    /// For a graph of poses with these edges, of which some stay. Room for numbers, all 0.
    pub(crate) fn holding(held: &[bool], edges: &[Edge]) -> Self {
        let mut n_blocks = 0;
        let mut block = |&is_held: &bool| {
            let block = (!is_held).then_some(n_blocks);
            n_blocks += usize::from(!is_held);
            block
        };
        let blocks: Vec<Option<usize>> = held.iter().map(&mut block).collect();
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); n_blocks];
        for edge in edges {
            if let (Some(a), Some(b)) = (blocks[edge.from], blocks[edge.to]) {
                below[a.min(b)].push(a.max(b));
            }
        }
        for rows in &mut below {
            rows.sort_unstable();
            rows.dedup();
        }
        let place = |edge: &Edge| {
            let (from, to) = (blocks[edge.from], blocks[edge.to]);
            let both = from.zip(to).map(|(a, b)| (a.min(b), a.max(b)));
            let below = both.and_then(|(column, row)| below[column].binary_search(&row).ok());
            Place { from, to, below: below.unwrap_or(0) }
        };
        let places = edges.iter().map(place).collect();
        let pattern = pattern(&below);
        let symbolic = SymbolicLlt::try_new(pattern.as_ref(), Side::Lower).ok();
        let values = vec![0.0; pattern.compute_nnz()];
        let gradient = vec![0.0; 3 * n_blocks];
        Self { blocks, pattern, symbolic, places, values, gradient }
    }

    /// Block of each pose; `None` for one that is held.
    pub(crate) fn blocks(&self) -> &[Option<usize>] {
        &self.blocks
    }

    /// Sets all numbers to 0.
    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
        self.gradient.fill(0.0);
    }

    /// Adds the edge of that index: J' L J and J' L e.
    pub(crate) fn add(
        &mut self,
        index: usize,
        information: &Matrix3<f64>,
        error: &Vector3<f64>,
        (by_from, by_to): (&Matrix3<f64>, &Matrix3<f64>),
    ) {
        let Place { from, to, below } = self.places[index];
        let (from_l, to_l) = (by_from.transpose() * information, by_to.transpose() * information);
        if let Some(block) = from {
            self.add_diagonal(block, &(from_l * by_from), &(from_l * error));
        }
        if let Some(block) = to {
            self.add_diagonal(block, &(to_l * by_to), &(to_l * error));
        }
        if let (Some(from), Some(to)) = (from, to) {
            if from < to {
                self.add_below(from, below, &(to_l * by_from));
            } else {
                self.add_below(to, below, &(from_l * by_to));
            }
        }
    }

    fn add_diagonal(&mut self, block: usize, hessian: &Matrix3<f64>, gradient: &Vector3<f64>) {
        for column in 0..3 {
            let first = self.pattern.col_ptr()[3 * block + column];
            for row in column..3 {
                self.values[first + row - column] += hessian[(row, column)];
            }
            self.gradient[3 * block + column] += gradient[column];
        }
    }

    fn add_below(&mut self, block: usize, place: usize, hessian: &Matrix3<f64>) {
        for column in 0..3 {
            let first = self.pattern.col_ptr()[3 * block + column] + 3 - column + 3 * place;
            for row in 0..3 {
                self.values[first + row] += hessian[(row, column)];
            }
        }
    }

    /// The step to the minimum of the quadratic form, with `damping` times the diagonal added to it;
    /// three numbers a free pose. `None` if the form is not positive definite.
    pub(crate) fn solution(&self, damping: f64) -> Option<Vec<f64>> {
        let mut damped = self.values.clone();
        for column in 0..self.gradient.len() {
            let diagonal = &mut damped[self.pattern.col_ptr()[column]];
            *diagonal += damping * *diagonal + DIAGONAL_MIN;
        }
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &damped);
        let symbolic = self.symbolic.clone()?;
        let factor = Llt::try_new_with_symbolic(symbolic, matrix, Side::Lower).ok()?;
        let mut step: Vec<f64> = self.gradient.iter().map(|number| -number).collect();
        factor.solve_in_place(ColMut::from_slice_mut(&mut step).as_mat_mut());
        step.iter().all(|number| number.is_finite()).then_some(step)
    }
}

/// A pose about which nothing is known stays where it is.
const DIAGONAL_MIN: f64 = 1e-9;

/// The pattern whose blocks stand below the diagonal as given.
fn pattern(below: &[Vec<usize>]) -> SymbolicSparseColMat<usize> {
    let (mut col_ptr, mut row_idx) = (vec![0], Vec::new());
    for (block, rows) in below.iter().enumerate() {
        for column in 0..3 {
            row_idx.extend(3 * block + column..3 * block + 3);
            row_idx.extend(rows.iter().flat_map(|row| 3 * row..3 * row + 3));
            col_ptr.push(row_idx.len());
        }
    }
    SymbolicSparseColMat::new_checked(3 * below.len(), 3 * below.len(), col_ptr, None, row_idx)
}
