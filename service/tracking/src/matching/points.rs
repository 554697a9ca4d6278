//! The hits of a scan as points, each with a weight.
//!
//! Beams that graze a wall meet it at points far apart. Drawn, these are dots, and a scan taken a
//! little farther on would rather meet the dots than the wall: along a corridor it would stick to
//! where the last one was drawn. A hit therefore weighs the less the farther it lies from its
//! neighbours.

use meetpoint_geometry::{Point2, Pose, Vector2};
use meetpoint_occupancy::{LaserGeometry, Reading};

/// A hit of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanPoint {
    /// Where, in the robot's frame.
    pub(crate) at: Point2<f64>,
    /// How much it counts, in (0, 1].
    pub(crate) weight: f64,
}

/// The hits of a scan up to `range_max_m`, in the order of the beams. Those up to `gap_m` from the
/// next weigh 1, others less by as much as they are farther.
pub(crate) fn scan_points(
    robot_from_sensor: Pose,
    geometry: &LaserGeometry,
    ranges_m: &[f32],
    (range_max_m, gap_m): (f64, f64),
) -> Vec<ScanPoint> {
    let hits = geometry.readings(ranges_m).filter_map(|(bearing_rad, reading)| match reading {
        Reading::Hit(range_m) if range_m <= range_max_m => Some((bearing_rad, range_m)),
        _ => None,
    });
    let mut points: Vec<ScanPoint> = hits
        .map(|(bearing_rad, range_m)| {
            let (sin, cos) = (robot_from_sensor.theta_rad + bearing_rad).sin_cos();
            let at = robot_from_sensor.position() + Vector2::new(cos, sin) * range_m;
            ScanPoint { at, weight: 1.0 }
        })
        .collect();
    weigh(&mut points, gap_m);
    points
}

fn weigh(points: &mut [ScanPoint], gap_m: f64) {
    let mut gap_before_m = f64::INFINITY;
    for i in 0..points.len() {
        let next = points.get(i + 1).map(|next| (next.at - points[i].at).norm());
        let gap_after_m = next.unwrap_or(f64::INFINITY);
        let nearest_m = gap_before_m.min(gap_after_m);
        points[i].weight =
            if nearest_m <= gap_m { 1.0 } else { (gap_m / nearest_m).max(WEIGHT_MIN) };
        gap_before_m = gap_after_m;
    }
}

/// No hit counts less: a lone post is a landmark too.
const WEIGHT_MIN: f64 = 0.1;

/// As many as `n_max` of the points, evenly by weight.
pub(crate) fn thinned(points: &[ScanPoint], n_max: usize) -> Vec<Point2<f64>> {
    let total: f64 = points.iter().map(|point| point.weight).sum();
    let share = total / points.len().min(n_max).max(1) as f64;
    let mut due = 0.5 * share;
    let picked = points.iter().filter(|point| {
        due -= point.weight;
        let pick = due <= 0.0;
        if pick {
            due += share;
        }
        pick
    });
    picked.take(n_max).map(|point| point.at).collect()
}
