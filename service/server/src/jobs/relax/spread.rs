//! How well sightings of the same landmark meet.

use meetpoint_geometry::Point2;

/// Root mean square of the distance of sightings from the mean of their landmark, in metres; 0 where
/// nothing was seen twice.
pub(super) fn spread_m(landmarks: impl Iterator<Item = Vec<Point2<f64>>>) -> f64 {
    let (mut sum_m2, mut n) = (0.0, 0_usize);
    for points in landmarks.filter(|points| 1 < points.len()) {
        let mean = mean(&points);
        sum_m2 += points.iter().map(|point| (point - mean).norm_squared()).sum::<f64>();
        n += points.len();
    }
    if n == 0 { 0.0 } else { (sum_m2 / n as f64).sqrt() }
}

/// The middle of points; the origin if there are none.
pub(super) fn mean(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(Point2::origin(), |sum, point| sum + point.coords);
    sum / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sightings_that_meet_have_no_spread() {
        let at = |x_m: f64| Point2::new(x_m, 7.0);
        let spread = |landmarks: &[&[f64]]| {
            let landmarks = landmarks.iter().map(|all| all.iter().map(|&x_m| at(x_m)).collect());
            spread_m(landmarks)
        };
        assert!((spread(&[&[1.0, 3.0], &[9.0]]) - 1.0).abs() < 1e-12, "a metre to either side");
        assert!(spread(&[&[4.0, 4.0, 4.0]]) < 1e-12, "they meet");
        assert!(spread(&[&[4.0], &[5.0]]) < 1e-12, "nothing was seen twice");
    }
}
