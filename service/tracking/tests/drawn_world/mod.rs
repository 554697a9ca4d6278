//! Rooms drawn as text, and a laser in them: `#` is wall, a character half a metre, the last line
//! at y = 0.

use std::f64::consts::PI;

use meetpoint_geometry::Pose;
use meetpoint_occupancy::LaserGeometry;

/// A half circle of 180 beams up to 12 m.
pub(crate) const LASER: LaserGeometry = LaserGeometry {
    angle_min_rad: -PI / 2.0,
    angle_increment_rad: PI / 180.0,
    n_beams: 180,
    range_min_m: 0.05,
    range_max_m: 12.0,
};

const EDGE_M: f64 = 0.5;

/// Walls as squares.
pub(crate) struct DrawnWorld {
    /// Lower-left corners, in metres.
    walls: Vec<(f64, f64)>,
}

impl DrawnWorld {
    pub(crate) fn new(drawing: &str) -> Self {
        let rows = drawing.trim().lines().rev().enumerate();
        let walls = rows.flat_map(|(y, line)| {
            let marks = line.trim().bytes().enumerate().filter(|(_, mark)| *mark == b'#');
            marks.map(move |(x, _)| (x as f64 * EDGE_M, y as f64 * EDGE_M))
        });
        Self { walls: walls.collect() }
    }

    /// A scan of [`LASER`] at `pose`, with an error of up to 2 cm that depends on `index` and beam.
    pub(crate) fn scan(&self, pose: Pose, index: usize) -> Vec<f32> {
        (0..LASER.n_beams)
            .map(|beam| {
                let range_m = self.range_m(pose, LASER.bearing_rad(beam));
                let error_m = 0.02 * ((index as f64 * 7.3 + f64::from(beam)) * 12.9898).sin();
                reading_m(range_m, error_m)
            })
            .collect()
    }

    /// Distance to the nearest wall, by all walls.
    fn range_m(&self, pose: Pose, bearing_rad: f64) -> f64 {
        let (sin, cos) = (pose.theta_rad + bearing_rad).sin_cos();
        let to_wall = |&(x, y): &(f64, f64)| {
            let along = |from: f64, direction: f64, low: f64| {
                let (a, b) = ((low - from) / direction, (low + EDGE_M - from) / direction);
                (a.min(b), a.max(b))
            };
            let (enter_x, leave_x) = along(pose.x_m, cos, x);
            let (enter_y, leave_y) = along(pose.y_m, sin, y);
            let (enter, leave) = (enter_x.max(enter_y), leave_x.min(leave_y));
            if enter <= leave && 0.0 < leave { enter.max(0.0) } else { f64::INFINITY }
        };
        self.walls.iter().map(to_wall).fold(f64::INFINITY, f64::min)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "ranges are sent as f32")]
fn reading_m(range_m: f64, error_m: f64) -> f32 {
    if range_m < LASER.range_max_m { (range_m + error_m) as f32 } else { f32::INFINITY }
}
