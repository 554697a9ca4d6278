//! Walls that a ring of sonars hears: adjacent readings that one straight wall explains.
//!
//! A cone hears of a wall what is nearest, on the ray that lies closest to the wall's normal. A wall at
//! distance D from the robot's middle, whose normal points in direction f, is therefore heard at
//!
//! ```text
//! r_i = (D - n(f)·p_i) / cos(max(0, |b_i - f| - half cone))
//! ```
//!
//! by transducer i at `p_i` that looks in direction `b_i`. For each f the best D is that of least squares; f is
//! found by golden section. S. Thrun, "Learning metric-topological maps for indoor mobile robot navigation",
//! Artificial Intelligence 99 (1998), section 2.3 (iii) and Fig. 6, connects the ends of five or more
//! adjacent readings by a line. Ends drawn in the middles of cones lie on an arc, not on a line, which turns
//! that line by some degrees where more of them lie on one side of the normal; hence the cones here. Time
//! O(readings * window * sections).

use meetpoint_geometry::angle_between;
use meetpoint_occupancy::SonarRing;

use crate::params::WallParams;

/// Steps of the golden section: the last is a ten-thousandth of the first.
const N_SECTIONS: u32 = 20;
/// How much of the interval a golden section keeps.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// A transducer and what it heard.
#[derive(Clone, Copy, Debug)]
struct Heard {
    bearing_rad: f64,
    x_m: f64,
    y_m: f64,
    range_m: f64,
}

/// Directions of the normals of the walls that a ring hears, seen from the robot, in radians; each as often as
/// there are windows of adjacent readings that do not share a reading.
pub(crate) fn heard_walls(ring: &SonarRing, ranges_m: &[f32], params: &WallParams) -> Vec<f64> {
    let n_window = params.n_readings;
    let n = ring.robot_from_transducer.len().min(ranges_m.len());
    if n_window < 3 || n < n_window {
        return Vec::new();
    }
    let mut order: Vec<usize> = (0..n).collect();
    let bearing = |index: usize| ring.robot_from_transducer[index].theta_rad;
    order.sort_by(|&a, &b| bearing(a).total_cmp(&bearing(b)));
    let heard: Vec<Option<Heard>> =
        order.iter().map(|&index| heard(ring, index, ranges_m[index], params)).collect();
    let mut fits: Vec<(f64, f64, usize)> = (0..n)
        .filter_map(|first| {
            let window: Option<Vec<Heard>> =
                (0..n_window).map(|step| heard[(first + step) % n]).collect();
            let (error_m, normal_rad) = fitted(&window?, ring.cone_rad / 2.0)?;
            (error_m < params.error_max_m).then_some((error_m, normal_rad, first))
        })
        .collect();
    fits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = vec![false; n];
    let mut walls = Vec::new();
    for (_, normal_rad, first) in fits {
        let places = (0..n_window).map(|step| (first + step) % n);
        if places.clone().any(|place| taken[place]) {
            continue;
        }
        places.for_each(|place| taken[place] = true);
        walls.push(normal_rad);
    }
    walls
}

/// A reading that an echo made near enough.
fn heard(ring: &SonarRing, index: usize, range_m: f32, params: &WallParams) -> Option<Heard> {
    let transducer = ring.robot_from_transducer[index];
    let range_m = f64::from(range_m);
    let is_echo = ring.range_min_m < range_m && range_m < ring.range_max_m.min(params.range_max_m);
    (is_echo && transducer.is_finite()).then_some(Heard {
        bearing_rad: transducer.theta_rad,
        x_m: transducer.x_m,
        y_m: transducer.y_m,
        range_m,
    })
}

/// The wall that explains a window best: the root of the mean square error in metres, and the direction of its
/// normal. `None` if the window sees no more than its own edge of the wall.
fn fitted(window: &[Heard], half_cone_rad: f64) -> Option<(f64, f64)> {
    let (first, last) = (window.first()?.bearing_rad, window.last()?.bearing_rad);
    let span_rad = angle_between(first, last).rem_euclid(std::f64::consts::TAU);
    let error = |off_rad: f64| square_error_m2(window, half_cone_rad, first + off_rad);
    let (mut low, mut high) = (0.0, span_rad);
    for _ in 0..N_SECTIONS {
        let reach = GOLDEN * (high - low);
        if error(high - reach) < error(low + reach) {
            high = low + reach;
        } else {
            low = high - reach;
        }
    }
    let off_rad = f64::midpoint(low, high);
    let is_within = span_rad < std::f64::consts::PI
        && EDGE_SHARE * span_rad < off_rad
        && off_rad < (1.0 - EDGE_SHARE) * span_rad;
    let error_m = (error(off_rad) / window.len() as f64).sqrt();
    is_within.then_some((error_m, first + off_rad))
}

/// Normals nearer to the window's edge than this share of it are not believed: with all readings on one
/// side, distance and direction can hardly be told apart.
const EDGE_SHARE: f64 = 0.2;

/// Sum of the squared errors of the best wall with that normal.
fn square_error_m2(window: &[Heard], half_cone_rad: f64, normal_rad: f64) -> f64 {
    let (sin, cos) = normal_rad.sin_cos();
    let term = |heard: &Heard| {
        let off_rad = angle_between(heard.bearing_rad, normal_rad).abs() - half_cone_rad;
        let share = 1.0 / off_rad.max(0.0).cos();
        (share, heard.range_m + (heard.x_m * cos + heard.y_m * sin) * share)
    };
    let (mut squares, mut products) = (0.0, 0.0);
    for heard in window {
        let (share, reach_m) = term(heard);
        squares += share * share;
        products += share * reach_m;
    }
    let distance_m = products / squares;
    let error_m2 = |heard: &Heard| {
        let (share, reach_m) = term(heard);
        (reach_m - distance_m * share).powi(2)
    };
    window.iter().map(error_m2).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_geometry::Pose;
    use std::f64::consts::TAU;

    fn ring() -> SonarRing {
        let at = |index: u32| {
            let bearing_rad = TAU * f64::from(index) / 24.0;
            Pose::new(0.26 * bearing_rad.cos(), 0.26 * bearing_rad.sin(), bearing_rad)
        };
        SonarRing {
            robot_from_transducer: (0..24).map(at).collect(),
            cone_rad: TAU / 24.0,
            range_min_m: 0.15,
            range_max_m: 6.0,
        }
    }

    /// What the ring hears of a wall that far off, by the nearest of a hundred rays a cone.
    fn of_wall(normal_rad: f64, distance_m: f64) -> Vec<f32> {
        let ring = ring();
        let nearest = |transducer: &Pose| {
            let rays = (0..=100).map(|ray| {
                let bearing_rad =
                    transducer.theta_rad + ring.cone_rad * (f64::from(ray) / 100.0 - 0.5);
                let toward = angle_between(bearing_rad, normal_rad).cos();
                let (sin, cos) = normal_rad.sin_cos();
                let left_m = distance_m - transducer.x_m * cos - transducer.y_m * sin;
                if toward.acos() < 0.5 { left_m / toward } else { f64::INFINITY }
            });
            #[expect(clippy::cast_possible_truncation, reason = "sonars answer in 32-bit floats")]
            let range_m = rays.fold(f64::INFINITY, f64::min) as f32;
            range_m
        };
        ring.robot_from_transducer.iter().map(nearest).collect()
    }

    #[test]
    fn a_wall_is_heard_as_it_stands() {
        for step in 0..60_u32 {
            let normal_rad = 0.1 * f64::from(step);
            let walls = heard_walls(&ring(), &of_wall(normal_rad, 1.4), &WallParams::INDOOR);
            for wall in &walls {
                let off_rad = angle_between(*wall, normal_rad).abs();
                assert!(off_rad < 0.005, "{off_rad} rad off a wall at {normal_rad} rad");
            }
            assert!(walls.len() < 2, "one wall, not {}", walls.len());
        }
    }

    #[test]
    fn a_round_room_has_no_walls_and_odd_readings_make_none() {
        let jagged: Vec<f32> = (0..24).map(|i| if i % 2 == 0 { 1.0 } else { 1.6 }).collect();
        assert!(heard_walls(&ring(), &jagged, &WallParams::INDOOR).is_empty(), "no line at all");
        let nothing = [f32::INFINITY; 24];
        assert!(heard_walls(&ring(), &nothing, &WallParams::INDOOR).is_empty(), "no echo");
        let odd = [f32::NAN, -1.0, f32::NEG_INFINITY, 0.0];
        assert!(heard_walls(&ring(), &odd, &WallParams::INDOOR).is_empty(), "no numbers");
    }
}
