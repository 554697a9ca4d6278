//! How wrong the shape of a map is, whatever is wrong with the place of all of it.
//!
//! Covariances of landmarks seen from a travel's first pose hold what that pose's heading is wrong by,
//! which grows with the distance and is the same for all. Where two maps are laid over one another
//! it does not matter: a rigid motion is free. With `H` the derivatives of all places by a rigid
//! motion of all,
//!
//! ```text
//! C' = P C P,    P = 1 - H (H' H)^-1 H'
//! ```
//!
//! which is W. Baarda's S-transformation to the gauge of inner constraints ("S-transformations and
//! criterion matrices", Netherlands Geodetic Commission 5 (1973)). Time O(landmarks²).

use meetpoint_geometry::Point2;
use nalgebra::{DMatrix, Matrix3};

/// Covariance of landmarks at `places`, two rows and columns for each, without what a rigid motion of
/// all of them explains. As it was where there are too few places for a motion.
pub(crate) fn shape_covariance(places: &[Point2<f64>], covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = places.len();
    if n < 2 {
        return covariance.clone();
    }
    let sum = places.iter().fold(nalgebra::Vector2::zeros(), |sum, place| sum + place.coords);
    let center = sum / n as f64;
    let mut by_motion = DMatrix::zeros(2 * n, 3);
    for (index, place) in places.iter().enumerate() {
        let arm = place.coords - center;
        by_motion[(2 * index, 0)] = 1.0;
        by_motion[(2 * index + 1, 1)] = 1.0;
        by_motion[(2 * index, 2)] = -arm.y;
        by_motion[(2 * index + 1, 2)] = arm.x;
    }
    let squares: Matrix3<f64> =
        (by_motion.transpose() * &by_motion).fixed_view::<3, 3>(0, 0).into();
    let Some(inverse) = squares.try_inverse() else { return covariance.clone() };
    let weights = &by_motion * inverse;
    let left = covariance - &weights * (by_motion.transpose() * covariance);
    &left - (&left * &by_motion) * weights.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn a_motion_of_all_is_no_error_of_the_shape() {
        let places = [[10.0, 0.0], [10.0, 4.0], [14.0, 1.0], [12.0, -3.0]].map(Point2::from);
        let n = places.len();
        let mut covariance = DMatrix::zeros(2 * n, 2 * n);
        // A heading wrong by a tenth of a radian, and a hundredth of a metre each.
        for (row, a) in places.iter().enumerate() {
            for (column, b) in places.iter().enumerate() {
                let block = Matrix2::new(a.y * b.y, -a.y * b.x, -a.x * b.y, a.x * b.x) * 0.01;
                covariance.fixed_view_mut::<2, 2>(2 * row, 2 * column).copy_from(&block);
            }
        }
        covariance += DMatrix::identity(2 * n, 2 * n) * 1e-4;
        let shape = shape_covariance(&places, &covariance);
        for index in 0..2 * n {
            let left = shape[(index, index)];
            assert!((0.0..=1.0001e-4).contains(&left), "{index}: {left}");
        }
        assert!((shape.trace() - 1e-4 * (2.0 * n as f64 - 3.0)).abs() < 1e-9, "three numbers less");
    }
}
