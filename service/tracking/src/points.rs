//! The hits of a scan as points.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::{LaserGeometry, Reading};

/// The hits of a scan up to `range_max_m`, in the robot's frame, in the order of the beams.
pub(crate) fn hit_points(
    robot_from_sensor: Pose,
    geometry: &LaserGeometry,
    ranges_m: &[f32],
    range_max_m: f64,
) -> Vec<Point2<f64>> {
    let hits = geometry.readings(ranges_m).filter_map(|(bearing_rad, reading)| match reading {
        Reading::Hit(range_m) if range_m <= range_max_m => Some((bearing_rad, range_m)),
        _ => None,
    });
    hits.map(|(bearing_rad, range_m)| {
        let (sin, cos) = (robot_from_sensor.theta_rad + bearing_rad).sin_cos();
        robot_from_sensor.position() + meetpoint_geometry::Vector2::new(cos, sin) * range_m
    })
    .collect()
}

/// Every k-th of the points, so that at most `n_max` remain.
pub(crate) fn thinned(points: &[Point2<f64>], n_max: usize) -> Vec<Point2<f64>> {
    points.iter().step_by(points.len().div_ceil(n_max.max(1)).max(1)).copied().collect()
}
