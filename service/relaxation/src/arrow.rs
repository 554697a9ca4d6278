//! Linear equations of a chain of poses with a border, as least squares over a travel make them.
//!
//! ```text
//! | D1  U1              B1 |            Dt: 3 by 3, pose t
//! | U1' D2  U2          B2 |            Ut: 3 by 3, pose t with pose t + 1
//! |     U2' D3  ..      B3 |            Bt: 3 by m, pose t with the border
//! |         ..  ..      .. |            S:  m by m, the border: calibration and landmarks
//! | B1' B2' B3' ..      S  |
//! ```
//!
//! Poses are eliminated from the first to the last, then the border is solved by Cholesky's method.
//! Time O(poses m²), space O(poses m).

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

/// The matrix's upper half and the right-hand side (the gradient).
#[derive(Clone, Debug)]
pub(crate) struct Arrow {
    n_border: usize,
    diagonal: Vec<Matrix3<f64>>,
    /// One fewer than poses.
    next: Vec<Matrix3<f64>>,
    /// By pose, `n_border` columns of three.
    border: Vec<Vec<Vector3<f64>>>,
    corner: DMatrix<f64>,
    gradient: Vec<Vector3<f64>>,
    border_gradient: DVector<f64>,
}

/// The solution: the step against the gradient.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    /// By pose.
    pub(crate) poses: Vec<Vector3<f64>>,
    /// Of the border.
    pub(crate) border: DVector<f64>,
    /// Logarithm of the matrix's determinant.
    pub(crate) log_determinant: f64,
}

/// What is left of the equations over the last pose and the border.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    pub(crate) precision: DMatrix<f64>,
    pub(crate) gradient: DVector<f64>,
    /// Logarithm of the determinant of what was eliminated.
    pub(crate) log_determinant: f64,
    /// By how much the best eliminated poses lower the cost.
    pub(crate) gain: f64,
}

/// The equations with all poses taken out: what is left is over the border alone.
#[derive(Clone, Debug)]
pub(crate) struct Reduced {
    arrow: Arrow,
    /// Of the poses' blocks, as they were when they were taken out.
    inverses: Vec<Matrix3<f64>>,
    /// Logarithm of the determinant of what was taken out.
    pub(crate) log_determinant: f64,
}

impl Reduced {
    /// Precision of the border.
    pub(crate) fn corner(&self) -> &DMatrix<f64> {
        &self.arrow.corner
    }

    pub(crate) fn border_gradient(&self) -> &DVector<f64> {
        &self.arrow.border_gradient
    }

    /// The poses' steps, given that of the border.
    pub(crate) fn poses(&self, border: &DVector<f64>) -> Vec<Vector3<f64>> {
        let Arrow { gradient, next, border: by_border, .. } = &self.arrow;
        let mut poses: Vec<Vector3<f64>> = vec![Vector3::zeros(); gradient.len()];
        for pose in (0..poses.len()).rev() {
            let mut sum = gradient[pose];
            if pose + 1 < poses.len() {
                sum += next[pose] * poses[pose + 1];
            }
            for (column, step) in by_border[pose].iter().zip(border.iter()) {
                sum += column * *step;
            }
            poses[pose] = -(self.inverses[pose] * sum);
        }
        poses
    }
}

impl Solution {
    /// The largest step of any number.
    pub(crate) fn largest(&self) -> f64 {
        self.poses.iter().map(Vector3::amax).fold(self.border.amax(), f64::max)
    }
}

impl Arrow {
    /// All zero.
    pub(crate) fn new(n_poses: usize, n_border: usize) -> Self {
        Self {
            n_border,
            diagonal: vec![Matrix3::zeros(); n_poses],
            next: vec![Matrix3::zeros(); n_poses.saturating_sub(1)],
            border: vec![vec![Vector3::zeros(); n_border]; n_poses],
            corner: DMatrix::zeros(n_border, n_border),
            gradient: vec![Vector3::zeros(); n_poses],
            border_gradient: DVector::zeros(n_border),
        }
    }

    /// Adds `precision` of what the pose is, which is `residual` off.
    pub(crate) fn add_prior(
        &mut self,
        pose: usize,
        precision: Matrix3<f64>,
        residual: Vector3<f64>,
    ) {
        self.diagonal[pose] += precision;
        self.gradient[pose] += precision * residual;
    }

    /// Adds `precision` of one number of the border, which is `residual` off.
    pub(crate) fn add_border_prior(&mut self, index: usize, precision: f64, residual: f64) {
        self.corner[(index, index)] += precision;
        self.border_gradient[index] += precision * residual;
    }

    /// Adds a way from pose `from` to the next: a residual with its derivatives by both poses and by
    /// the first three numbers of the border.
    pub(crate) fn add_way(
        &mut self,
        from: usize,
        derivatives: [&Matrix3<f64>; 3],
        precision: &Matrix3<f64>,
        residual: &Vector3<f64>,
    ) {
        let [by_from, by_to, by_border] = derivatives;
        let [from_weighted, to_weighted, border_weighted] =
            derivatives.map(|by| by.transpose() * precision);
        self.diagonal[from] += from_weighted * by_from;
        self.diagonal[from + 1] += to_weighted * by_to;
        self.next[from] += from_weighted * by_to;
        for (column, by) in by_border.column_iter().enumerate() {
            self.border[from][column] += from_weighted * by;
            self.border[from + 1][column] += to_weighted * by;
        }
        let square = border_weighted * by_border;
        let mut corner = self.corner.fixed_view_mut::<3, 3>(0, 0);
        corner += square;
        self.gradient[from] += from_weighted * residual;
        self.gradient[from + 1] += to_weighted * residual;
        let mut border_gradient = self.border_gradient.fixed_rows_mut::<3>(0);
        border_gradient += border_weighted * residual;
    }

    /// Adds a residual of two numbers that depends on a pose and on two numbers of the border, from
    /// `index` on.
    pub(crate) fn add_sighting(
        &mut self,
        pose: usize,
        index: usize,
        (by_pose, by_border): (&nalgebra::Matrix2x3<f64>, &nalgebra::Matrix2<f64>),
        precision: &nalgebra::Matrix2<f64>,
        residual: &nalgebra::Vector2<f64>,
    ) {
        let pose_weighted = by_pose.transpose() * precision;
        let border_weighted = by_border.transpose() * precision;
        self.diagonal[pose] += pose_weighted * by_pose;
        let shared = pose_weighted * by_border;
        for (column, by) in shared.column_iter().enumerate() {
            self.border[pose][index + column] += by;
        }
        let mut corner = self.corner.fixed_view_mut::<2, 2>(index, index);
        corner += border_weighted * by_border;
        self.gradient[pose] += pose_weighted * residual;
        let mut border_gradient = self.border_gradient.fixed_rows_mut::<2>(index);
        border_gradient += border_weighted * residual;
    }

    /// Adds `precision` to every number's own, about where it is.
    pub(crate) fn damp(&mut self, precision: f64) {
        for block in &mut self.diagonal {
            *block += Matrix3::identity() * precision;
        }
        for index in 0..self.n_border {
            self.corner[(index, index)] += precision;
        }
    }

    /// Solves; `None` if the matrix is not positive definite.
    pub(crate) fn solve(self) -> Option<Solution> {
        let reduced = self.reduced()?;
        let corner = Cholesky::new(reduced.corner().clone())?;
        let log_determinant = reduced.log_determinant + corner.ln_determinant();
        let border = -corner.solve(reduced.border_gradient());
        Some(Solution { poses: reduced.poses(&border), border, log_determinant })
    }

    /// All poses taken out; `None` if the matrix is not positive definite.
    pub(crate) fn reduced(mut self) -> Option<Reduced> {
        let n_poses = self.diagonal.len();
        let mut inverses = Vec::with_capacity(n_poses);
        let mut log_determinant = 0.0;
        for pose in 0..n_poses {
            let factor = Cholesky::new(self.diagonal[pose])?;
            log_determinant += factor.ln_determinant();
            let inverse = factor.inverse();
            self.eliminate(pose, &inverse);
            inverses.push(inverse);
        }
        self.mirror_corner();
        Some(Reduced { arrow: self, inverses, log_determinant })
    }

    /// Covariance of the last pose (first three) and the border; `None` if the matrix is not
    /// positive definite.
    pub(crate) fn last_and_border_covariance(self) -> Option<DMatrix<f64>> {
        Some(inverse(&Cholesky::new(self.rest()?.precision)?.unpack()))
    }

    /// Adds a quadratic form over the first pose and the first numbers of the border.
    pub(crate) fn add_first(&mut self, precision: &DMatrix<f64>, gradient: &DVector<f64>) {
        self.diagonal[0] += precision.fixed_view::<3, 3>(0, 0);
        self.gradient[0] += gradient.fixed_rows::<3>(0);
        let n_border = gradient.len() - 3;
        for column in 0..n_border {
            self.border[0][column] += precision.fixed_view::<3, 1>(0, 3 + column);
        }
        let mut corner = self.corner.view_mut((0, 0), (n_border, n_border));
        corner += precision.view((3, 3), (n_border, n_border));
        let mut rows = self.border_gradient.rows_mut(0, n_border);
        rows += gradient.rows(3, n_border);
    }

    /// What is left when all poses but the last are eliminated; `None` if the matrix is not positive
    /// definite.
    pub(crate) fn rest(mut self) -> Option<Rest> {
        let last = self.diagonal.len() - 1;
        let (mut log_determinant, mut gain) = (0.0, 0.0);
        for pose in 0..last {
            let factor = Cholesky::new(self.diagonal[pose])?;
            log_determinant += factor.ln_determinant();
            let inverse = factor.inverse();
            gain += self.gradient[pose].dot(&(inverse * self.gradient[pose])) / 2.0;
            self.eliminate(pose, &inverse);
        }
        self.mirror_corner();
        let n = 3 + self.n_border;
        let (mut precision, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        precision.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.diagonal[last]);
        for (column, by) in self.border[last].iter().enumerate() {
            precision.fixed_view_mut::<3, 1>(0, 3 + column).copy_from(by);
            precision.fixed_view_mut::<1, 3>(3 + column, 0).copy_from(&by.transpose());
        }
        precision.view_mut((3, 3), (self.n_border, self.n_border)).copy_from(&self.corner);
        gradient.fixed_rows_mut::<3>(0).copy_from(&self.gradient[last]);
        gradient.rows_mut(3, self.n_border).copy_from(&self.border_gradient);
        Some(Rest { precision, gradient, log_determinant, gain })
    }

    /// Takes a pose out, given the inverse of its block. Of the corner only the upper half is kept
    /// up to date.
    fn eliminate(&mut self, pose: usize, inverse: &Matrix3<f64>) {
        let solved: Vec<Vector3<f64>> =
            self.border[pose].iter().map(|column| inverse * column).collect();
        let solved_gradient = inverse * self.gradient[pose];
        if pose + 1 < self.diagonal.len() {
            let back = self.next[pose].transpose();
            self.diagonal[pose + 1] -= back * inverse * self.next[pose];
            self.gradient[pose + 1] -= back * solved_gradient;
            for (column, by) in solved.iter().enumerate() {
                self.border[pose + 1][column] -= back * by;
            }
        }
        let border = &self.border[pose];
        for (row, by) in border.iter().enumerate() {
            self.border_gradient[row] -= by.dot(&solved_gradient);
        }
        // Column by column, as they lie in memory.
        let columns = self.corner.as_mut_slice().chunks_exact_mut(self.n_border.max(1));
        for (index, (column, other)) in columns.zip(&solved).enumerate() {
            if *other == Vector3::zeros() {
                continue;
            }
            for (entry, by) in column[..=index].iter_mut().zip(border) {
                *entry -= by.dot(other);
            }
        }
    }

    fn mirror_corner(&mut self) {
        for row in 0..self.n_border {
            for column in 0..row {
                self.corner[(row, column)] = self.corner[(column, row)];
            }
        }
    }
}

/// Inverse of `L L'`, given the lower half `L`: inverts `L` column by column, as these lie in memory,
/// and multiplies.
pub(crate) fn inverse(factor: &DMatrix<f64>) -> DMatrix<f64> {
    let n = factor.nrows();
    let mut columns = DMatrix::identity(n, n);
    for first in 0..n {
        for row in first..n {
            let entry = columns[(row, first)] / factor[(row, row)];
            columns[(row, first)] = entry;
            let below = factor.view((row + 1, row), (n - row - 1, 1));
            let mut rest = columns.view_mut((row + 1, first), (n - row - 1, 1));
            rest.zip_apply(&below, |rest, below| *rest -= entry * below);
        }
    }
    let mut inverse = DMatrix::zeros(n, n);
    for column in 0..n {
        for row in column..n {
            let (a, b) = (columns.column(column), columns.column(row));
            let product = a.rows_range(row..).dot(&b.rows_range(row..));
            (inverse[(row, column)], inverse[(column, row)]) = (product, product);
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix2x3, Vector2};
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The same equations, dense.
    fn dense(arrow: &Arrow) -> (DMatrix<f64>, DVector<f64>) {
        let n_poses = arrow.diagonal.len();
        let n = 3 * n_poses + arrow.n_border;
        let mut matrix = DMatrix::zeros(n, n);
        let mut gradient = DVector::zeros(n);
        for pose in 0..n_poses {
            let at = 3 * pose;
            matrix.fixed_view_mut::<3, 3>(at, at).copy_from(&arrow.diagonal[pose]);
            if pose + 1 < n_poses {
                matrix.fixed_view_mut::<3, 3>(at, at + 3).copy_from(&arrow.next[pose]);
                matrix.fixed_view_mut::<3, 3>(at + 3, at).copy_from(&arrow.next[pose].transpose());
            }
            for (column, by) in arrow.border[pose].iter().enumerate() {
                let place = 3 * n_poses + column;
                matrix.fixed_view_mut::<3, 1>(at, place).copy_from(by);
                matrix.fixed_view_mut::<1, 3>(place, at).copy_from(&by.transpose());
            }
            gradient.fixed_rows_mut::<3>(at).copy_from(&arrow.gradient[pose]);
        }
        let n_border = arrow.n_border;
        matrix.view_mut((3 * n_poses, 3 * n_poses), (n_border, n_border)).copy_from(&arrow.corner);
        gradient.rows_mut(3 * n_poses, n_border).copy_from(&arrow.border_gradient);
        (matrix, gradient)
    }

    /// A random chain of `n_poses` that sees random landmarks of `n_landmarks`.
    fn random(n_poses: usize, n_landmarks: usize, seed: u32) -> Arrow {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(seed));
        let mut number = || rng.random_range(-1.0..1.0);
        let mut arrow = Arrow::new(n_poses, 3 + 2 * n_landmarks);
        arrow.add_prior(0, Matrix3::identity() * 10.0, Vector3::zeros());
        for index in 0..3 + 2 * n_landmarks {
            arrow.add_border_prior(index, 0.5, number());
        }
        for pose in 1..n_poses {
            let mut matrix = || Matrix3::from_fn(|_, _| number());
            let (a, b, c) = (matrix(), matrix(), matrix());
            let residual = Vector3::from_fn(|_, _| number());
            arrow.add_way(pose - 1, [&a, &b, &c], &(Matrix3::identity() * 2.0), &residual);
        }
        for pose in 0..n_poses {
            let landmark = (pose * 7 + seed as usize) % n_landmarks;
            let by = (Matrix2x3::from_fn(|_, _| number()), Matrix2::from_fn(|_, _| number()));
            let residual = Vector2::from_fn(|_, _| number());
            let precision = Matrix2::identity() * 3.0;
            arrow.add_sighting(pose, 3 + 2 * landmark, (&by.0, &by.1), &precision, &residual);
        }
        arrow
    }

    proptest! {
        #[test]
        fn solution_is_that_of_the_dense_matrix(n_poses in 1_usize..8, n_landmarks in 1_usize..5, seed: u32) {
            let arrow = random(n_poses, n_landmarks, seed);
            let (matrix, gradient) = dense(&arrow);
            let factor = Cholesky::new(matrix).expect("positive definite");
            let expected = -factor.solve(&gradient);
            let covariance = arrow.clone().last_and_border_covariance().expect("positive definite");
            let all = factor.inverse();
            let at = 3 * (n_poses - 1);
            let n = covariance.nrows();
            prop_assert!((covariance - all.view((at, at), (n, n))).amax() < 1e-8, "covariance");
            let solution = arrow.solve().expect("positive definite");
            prop_assert!((solution.log_determinant - factor.ln_determinant()).abs() < 1e-8, "determinant");
            for (pose, step) in solution.poses.iter().enumerate() {
                prop_assert!((step - expected.fixed_rows::<3>(3 * pose)).amax() < 1e-8, "{pose}");
            }
            let border = expected.rows(3 * n_poses, solution.border.len());
            prop_assert!((solution.border - border).amax() < 1e-8, "border");
        }
    }
}
