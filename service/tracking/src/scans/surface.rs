//! What one scan saw, as facets: hits with the direction of the wall that they lie on.
//!
//! The wall's direction at a hit is that of the line fitted to it and its neighbours among the beams,
//! as far as these lie on one wall. Hits are found again by the beam that would meet them, which takes
//! constant time: G. Blais, M. Levine, "Registering multiview range data to create 3D computer
//! objects", IEEE Transactions on Pattern Analysis and Machine Intelligence 17 (1995), section 3.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use meetpoint_geometry::{Point2, Vector2, wrap_angle};
use meetpoint_occupancy::Reading;

use crate::scans::laser_travel::TravelLaser;

/// A hit on a wall, in the robot's frame. In single precision, a tenth of a millimetre at a kilometre,
/// since many are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facet {
    /// The hit.
    pub(crate) at: Point2<f32>,
    /// Unit vector across the wall, towards the sensor.
    pub(crate) normal: Vector2<f32>,
    /// Half the distance to the farther of its neighbours, in metres: as far as the facet reaches.
    pub(crate) reach_m: f32,
}

/// The facets of one scan.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// In the order of the beams.
    facets: Vec<Facet>,
    /// One a beam; what no wall is met by is [`NO_FACET`].
    /// After a full turn the first beams once more.
    by_beam: Vec<Facet>,
    is_full_turn: bool,
    /// The sensor in the robot's frame.
    sensor: Point2<f32>,
    /// Direction of beam 0 in the robot's frame, in (-pi, pi].
    angle_min_rad: f32,
    beams_per_rad: f32,
    /// Beams of a full turn.
    n_turn: f32,
}

/// Stands for no facet: it is nearest to nothing, because no comparison with it is true.
const NO_FACET: Facet = Facet {
    at: Point2::new(f32::NAN, f32::NAN),
    normal: Vector2::new(f32::NAN, f32::NAN),
    reach_m: 0.0,
};

/// Beams on each side that a line is fitted to, and how far they may lie from the hit, in metres: wide
/// where the wall is straight, since a direction that errs by 0.04 radians, as that of a narrow fit
/// does, would hold a robot in a corridor where it is; narrow elsewhere.
const FITS: [(usize, f64); 2] = [(8, 0.8), (3, 0.4)];
/// Hits farther than this from the next are not on one wall, in metres: a wall seen at 10 degrees
/// from 5 m, beams a degree apart.
const GAP_MAX_M: f64 = 0.5;
/// A line that its hits lie farther off is none, root mean square in metres: twice the noise of usual
/// lasers.
const FIT_ERROR_MAX_M: f64 = 0.02;
/// Cosine of the angle between the wall's normal and the beam below which a hit is not believed: 5
/// degrees off grazing.
const GRAZING_COSINE_MIN: f64 = 0.09;
/// Facets reach no farther, in metres.
const REACH_MAX_M: f64 = 0.25;
/// A hit may lie this far beyond a facet's reach, in metres: what a turn of a degree moves a wall at
/// 3 m by.
const BEYOND_REACH_M: f32 = 0.05;
/// Beams that a search for the nearest facet looks at on each side, at most.
const N_LOOK_MAX: f32 = 12.0;
/// Beams of a full turn that come again at its end: as many as two searches look at.
const N_REPEATED: usize = 26;
/// Walls that face directions farther apart than 37 degrees are not the same.
const FACING_COSINE_MIN: f32 = 0.8;

impl Surface {
    /// The facets of a scan, of hits up to `range_max_m`.
    pub(crate) fn new(laser: &TravelLaser, ranges_m: &[f32], range_max_m: f64) -> Self {
        let TravelLaser { robot_from_sensor, geometry } = laser;
        let hits = Hits::new(laser, ranges_m, range_max_m);
        let facets = (0..hits.at.len()).map(|beam| hits.facet(beam));
        let mut by_beam: Vec<Facet> = facets.map(|facet| facet.unwrap_or(NO_FACET)).collect();
        let facets = by_beam.iter().copied().filter(|facet| !facet.at.x.is_nan()).collect();
        let beams_per_rad = single(1.0 / geometry.angle_increment_rad);
        let n_turn = (TAU * beams_per_rad).abs();
        let is_full_turn = n_turn - 0.5 <= by_beam.len() as f32;
        if is_full_turn {
            let first: Vec<Facet> = by_beam.iter().copied().take(N_REPEATED).collect();
            by_beam.extend(first);
        }
        Self {
            facets,
            by_beam,
            is_full_turn,
            sensor: robot_from_sensor.position().map(single),
            angle_min_rad: single(wrap_angle(robot_from_sensor.theta_rad + geometry.angle_min_rad)),
            beams_per_rad,
            n_turn,
        }
    }

    /// The facets, in the order of the beams.
    pub(crate) fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// The facet nearest to `point` (in this scan's robot frame) whose wall faces as `normal` does,
    /// if one lies within `gate_m`.
    #[inline]
    pub(crate) fn nearest(
        &self,
        point: Point2<f32>,
        normal: Vector2<f32>,
        gate_m: f32,
    ) -> Option<&Facet> {
        let away = point - self.sensor;
        let range_m = (away.x * away.x + away.y * away.y).sqrt();
        let bearing_rad = quick_atan2(away.y, away.x) - self.angle_min_rad;
        let beam = bearing_rad * self.beams_per_rad;
        let beam = if beam < 0.0 { beam + self.n_turn } else { beam };
        let look = (gate_m / range_m.max(gate_m) * self.beams_per_rad.abs()).clamp(1.0, N_LOOK_MAX);
        let beam = if self.is_full_turn && beam < look { beam + self.n_turn } else { beam };
        let (low, high) = ((beam - look).max(0.0), beam + look + 0.5);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; NaN becomes 0"
        )]
        let (low, high) = (low.ceil() as usize, (high as usize + 1).min(self.by_beam.len()));
        let mut best: Option<(f32, &Facet)> = None;
        for facet in self.by_beam.get(low..high)? {
            let away = point - facet.at;
            let across_m = (facet.normal.x * away.x + facet.normal.y * away.y).abs();
            let along_m = (facet.normal.x * away.y - facet.normal.y * away.x).abs();
            let near = across_m <= gate_m && along_m <= BEYOND_REACH_M + facet.reach_m;
            let distance = across_m * across_m + along_m * along_m;
            let facing = FACING_COSINE_MIN < facet.normal.x * normal.x + facet.normal.y * normal.y;
            if near && facing && best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, facet));
            }
        }
        best.map(|(_, facet)| facet)
    }
}

/// `atan2` to within 3e-4 radians: beams are ten times farther apart. M. Abramowitz,
/// I. Stegun, "Handbook of mathematical functions" (1964), 4.4.49 of lower degree.
#[inline]
fn quick_atan2(y: f32, x: f32) -> f32 {
    let (least, most) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    let t = least / most.max(f32::MIN_POSITIVE);
    let s = t * t;
    let angle = ((-0.046_496_47 * s + 0.159_314_22) * s - 0.327_622_76) * s * t + t;
    let angle = if x.abs() < y.abs() { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    if y < 0.0 { -angle } else { angle }
}

#[expect(clippy::cast_possible_truncation, reason = "facets are kept in single precision")]
fn single(number: f64) -> f32 {
    number as f32
}

/// The hits of one scan.
#[derive(Debug)]
struct Hits {
    /// In the robot's frame, one a beam; NaN where nothing was hit.
    at: Vec<Point2<f64>>,
    /// Whether a hit may be on one wall with the next.
    is_linked: Vec<bool>,
    sensor: Point2<f64>,
}

/// Some facets of a scan, `n_max` at most: those at beams that are equally far apart.
pub(crate) fn some_facets(
    laser: &TravelLaser,
    ranges_m: &[f32],
    (range_max_m, n_max): (f64, usize),
) -> Vec<Facet> {
    let hits = Hits::new(laser, ranges_m, range_max_m);
    let stride = hits.at.len().div_ceil(n_max.max(1)).max(1);
    (0..hits.at.len()).step_by(stride).filter_map(|beam| hits.facet(beam)).collect()
}

impl Hits {
    /// The hits of a scan up to `range_max_m`.
    fn new(laser: &TravelLaser, ranges_m: &[f32], range_max_m: f64) -> Self {
        let TravelLaser { robot_from_sensor, geometry } = laser;
        let sensor = robot_from_sensor.position();
        let place = |(bearing_rad, reading): (f64, Reading)| match reading {
            Reading::Hit(range_m) if range_m <= range_max_m => {
                let (sin, cos) = (robot_from_sensor.theta_rad + bearing_rad).sin_cos();
                Point2::new(sensor.x + range_m * cos, sensor.y + range_m * sin)
            }
            _ => Point2::new(f64::NAN, f64::NAN),
        };
        let at: Vec<Point2<f64>> = geometry.readings(ranges_m).map(place).collect();
        let is_near =
            |pair: &[Point2<f64>]| (pair[1] - pair[0]).norm_squared() <= GAP_MAX_M * GAP_MAX_M;
        let is_linked = at.windows(2).map(is_near).collect();
        Self { at, is_linked, sensor }
    }

    /// The facet at a beam's hit, if it lies on a wall.
    fn facet(&self, beam: usize) -> Option<Facet> {
        if self.at[beam].x.is_nan() {
            return None;
        }
        FITS.into_iter().find_map(|fit| self.fitted_facet(beam, fit))
    }

    fn fitted_facet(&self, beam: usize, fit: (usize, f64)) -> Option<Facet> {
        let at = self.at[beam];
        let (first, last) = self.neighbours(beam, fit);
        let points = &self.at[first..=last];
        if points.len() < 3 {
            return None;
        }
        let n = points.len() as f64;
        let mean = points.iter().fold(Vector2::zeros(), |sum, point| sum + point.coords) / n;
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for point in points {
            let away = point.coords - mean;
            xx += away.x * away.x;
            xy += away.x * away.y;
            yy += away.y * away.y;
        }
        let spread = (xx - yy).hypot(2.0 * xy);
        // The smaller eigenvalue.
        let squares = 0.5 * (xx + yy - spread);
        if n * FIT_ERROR_MAX_M * FIT_ERROR_MAX_M < squares {
            return None;
        }
        let to_sensor = self.sensor - at;
        let across = across(xx - yy, 2.0 * xy, spread);
        let normal = if across.dot(&to_sensor) < 0.0 { -across } else { across };
        if normal.dot(&to_sensor) < GRAZING_COSINE_MIN * to_sensor.norm() {
            return None;
        }
        let next_m = |end: usize, next: usize| {
            if end == beam { 0.0 } else { (self.at[next] - at).norm() }
        };
        let farther_m = next_m(first, beam.saturating_sub(1)).max(next_m(last, beam + 1));
        let reach_m = (0.5 * farther_m).min(REACH_MAX_M);
        // The hit as the line has it: what its neighbours say of it counts too.
        let at = at - normal * normal.dot(&(at.coords - mean));
        Some(Facet { at: at.map(single), normal: normal.map(single), reach_m: single(reach_m) })
    }

    /// First and last of the beams whose hits lie on one wall with a beam's: so many on each side, and
    /// no farther from it than given.
    fn neighbours(&self, beam: usize, (n_max, reach_m): (usize, f64)) -> (usize, usize) {
        let at = self.at[beam];
        let is_near = |other: usize| (self.at[other] - at).norm_squared() <= reach_m * reach_m;
        let (mut first, mut last) = (beam, beam);
        while beam - first < n_max && 0 < first && self.is_linked[first - 1] && is_near(first - 1) {
            first -= 1;
        }
        while last - beam < n_max
            && last < self.is_linked.len()
            && self.is_linked[last]
            && is_near(last + 1)
        {
            last += 1;
        }
        (first, last)
    }
}

/// Unit vector across the line along which points spread most, whose doubled direction has cosine
/// `x / spread` and sine `y / spread`; across the x axis if they spread everywhere alike.
fn across(x: f64, y: f64, spread: f64) -> Vector2<f64> {
    if spread <= 0.0 {
        return Vector2::y();
    }
    let (x, y) = (x / spread, y / spread);
    if 0.0 <= x {
        let cos = (0.5 * (1.0 + x)).sqrt();
        Vector2::new(-0.5 * y / cos, cos)
    } else {
        let sin = (0.5 * (1.0 - x)).sqrt();
        Vector2::new(-sin, 0.5 * y / sin)
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::Pose;
    use meetpoint_occupancy::LaserGeometry;
    use proptest::prelude::*;

    use super::*;

    const LASER: TravelLaser = TravelLaser {
        robot_from_sensor: Pose { x_m: 0.1, y_m: -0.05, theta_rad: 0.1 },
        geometry: LaserGeometry {
            angle_min_rad: -std::f64::consts::PI,
            angle_increment_rad: std::f64::consts::PI / 180.0,
            n_beams: 360,
            range_min_m: 0.0,
            range_max_m: 20.0,
        },
    };

    /// A room of 6 m by 4 m about the sensor, seen from it.
    fn room() -> Surface {
        let range = |beam: u32| {
            let (sin, cos) = (LASER.geometry.bearing_rad(beam)).sin_cos();
            single((3.0 / cos.abs()).min(2.0 / sin.abs()))
        };
        Surface::new(&LASER, &(0..360).map(range).collect::<Vec<f32>>(), 20.0)
    }

    proptest! {
        /// By the definition: the eigenvector of the smaller eigenvalue, from the half of the angle.
        #[test]
        fn across_is_by_the_half_of_the_angle(x in -5.0_f64..5.0, y in -5.0_f64..5.0) {
            let (sin, cos) = (0.5 * y.atan2(x)).sin_cos();
            let found = across(x, y, x.hypot(y));
            let error = found.perp(&Vector2::new(-sin, cos)).abs();
            prop_assert!(error < 1e-9 && (found.norm() - 1.0).abs() < 1e-9, "{found}");
        }

        /// By the definition: of all facets that face that way and lie within reach, the nearest.
        #[test]
        fn finds_the_nearest_facet(index in 0_usize..300, x in -0.04_f32..0.04, y in -0.04_f32..0.04) {
            let room = room();
            let facet = room.facets()[index % room.facets().len()];
            let point = facet.at + Vector2::new(x, y);
            let near = |facet: &&Facet| {
                let away = point - facet.at;
                let across_m = facet.normal.dot(&away).abs();
                let along_m = (facet.normal.x * away.y - facet.normal.y * away.x).abs();
                across_m <= 0.1 && along_m <= BEYOND_REACH_M + facet.reach_m
            };
            let facing = |other: &&Facet| FACING_COSINE_MIN < other.normal.dot(&facet.normal);
            let distance = |facet: &Facet| (point - facet.at).norm();
            let all = room.facets().iter().filter(near).filter(facing);
            let expected = all.map(distance).min_by(f32::total_cmp).expect("the facet itself");
            let found = room.nearest(point, facet.normal, 0.1).expect("some facet is near");
            prop_assert!((distance(found) - expected).abs() < 1e-4, "{} is not {}", distance(found), expected);
        }

        #[test]
        fn the_quick_angle_is_right(x in -5.0_f32..5.0, y in -5.0_f32..5.0) {
            let error = (quick_atan2(y, x) - y.atan2(x)).abs();
            prop_assert!(error < 3e-4, "{error} off");
        }
    }

    #[test]
    fn walls_face_the_sensor() {
        let room = room();
        assert!(340 < room.facets().len(), "but for the corners all beams meet walls");
        let ahead = room.nearest(Point2::new(3.05, 0.25), Vector2::new(-1.0, -0.1), 0.2);
        let normal = ahead.expect("the wall ahead").normal;
        let (sin, cos) = 0.1_f32.sin_cos();
        assert!((normal - Vector2::new(-cos, -sin)).norm() < 0.02, "{normal}");
        let behind = room.nearest(Point2::new(3.05, 0.25), Vector2::new(1.0, 0.1), 0.2);
        assert_eq!(behind, None, "not the other side of the wall");
    }
}
