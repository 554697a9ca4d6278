//! What one scan saw, as facets: hits with the direction of the wall that they lie on.
//!
//! The wall's direction at a hit is that of the line fitted to it and its neighbours among the beams,
//! as far as these lie on one wall. Hits are found again by the beam that would meet them, which takes
//! constant time: G. Blais, M. Levine, "Registering multiview range data to create 3D computer
//! objects", IEEE Transactions on Pattern Analysis and Machine Intelligence 17 (1995), section 3.

use std::f64::consts::TAU;

use meetpoint_geometry::{Point2, Pose, Vector2};
use meetpoint_occupancy::Reading;

use crate::laser_travel::TravelLaser;

/// A hit on a wall, in the robot's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facet {
    /// The hit.
    pub(crate) at: Point2<f64>,
    /// Unit vector across the wall, towards the sensor.
    pub(crate) normal: Vector2<f64>,
    /// Half the distance to the farther of its neighbours, in metres: as far as the facet reaches.
    pub(crate) reach_m: f64,
}

/// The facets of one scan.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// In the order of the beams.
    pub(crate) facets: Vec<Facet>,
    /// For each beam, 1 + its facet; 0 without.
    by_beam: Vec<u32>,
    sensor_from_robot: Pose,
    angle_min_rad: f64,
    beams_per_rad: f64,
}

/// Beams on each side that a line is fitted to.
const N_SIDE: usize = 3;
/// Hits farther than this from the next are not on one wall, in metres: a wall seen at 10 degrees
/// from 5 m, beams a degree apart.
const GAP_MAX_M: f64 = 0.5;
/// Neighbours farther than this from a hit do not say which way its wall runs, in metres.
const FIT_REACH_M: f64 = 0.4;
/// A line that its hits lie farther off is none, root mean square in metres: three times the noise of
/// usual lasers.
const FIT_ERROR_MAX_M: f64 = 0.03;
/// Cosine of the angle between wall's normal and beam below which a hit is not believed: 5 degrees
/// off grazing.
const GRAZING_COSINE_MIN: f64 = 0.09;
/// Facets reach no farther, in metres.
const REACH_MAX_M: f64 = 0.25;
/// Beams that a search for the nearest facet looks at on each side, at most.
const N_LOOK_MAX: f64 = 12.0;

impl Surface {
    /// The facets of a scan, of hits up to `range_max_m`.
    pub(crate) fn new(laser: &TravelLaser, ranges_m: &[f32], range_max_m: f64) -> Self {
        let hits: Vec<Option<Point2<f64>>> = laser
            .geometry
            .readings(ranges_m)
            .map(|(bearing_rad, reading)| match reading {
                Reading::Hit(range_m) if range_m <= range_max_m => {
                    let (sin, cos) = bearing_rad.sin_cos();
                    Some(laser.robot_from_sensor * Point2::new(range_m * cos, range_m * sin))
                }
                _ => None,
            })
            .collect();
        let mut surface = Self {
            facets: Vec::new(),
            by_beam: vec![0; hits.len()],
            sensor_from_robot: laser.robot_from_sensor.inverse(),
            angle_min_rad: laser.geometry.angle_min_rad,
            beams_per_rad: 1.0 / laser.geometry.angle_increment_rad,
        };
        let sensor = laser.robot_from_sensor.position();
        for beam in 0..hits.len() {
            if let Some(facet) = facet(&hits, beam, sensor) {
                surface.facets.push(facet);
                surface.by_beam[beam] = u32::try_from(surface.facets.len()).unwrap_or(0);
            }
        }
        surface
    }

    /// The facet nearest to `point` (in this scan's robot frame) whose wall faces as `normal` does,
    /// if one lies within `gate_m`.
    pub(crate) fn nearest(
        &self,
        point: Point2<f64>,
        normal: Vector2<f64>,
        gate_m: f64,
    ) -> Option<&Facet> {
        let from_sensor = self.sensor_from_robot * point;
        let range_m = from_sensor.x.hypot(from_sensor.y);
        let bearing_rad = from_sensor.y.atan2(from_sensor.x) - self.angle_min_rad;
        let full_turn = TAU * self.beams_per_rad;
        let mut beam = bearing_rad * self.beams_per_rad;
        if beam < -N_LOOK_MAX {
            beam += full_turn.abs();
        }
        let look = (gate_m / range_m.max(gate_m) * self.beams_per_rad.abs()).ceil();
        let look = look.clamp(1.0, N_LOOK_MAX);
        let low = (beam - look).round().max(0.0);
        let high = (beam + look).round().min(self.by_beam.len() as f64 - 1.0);
        if high < low {
            return None;
        }
        let mut best: Option<(f64, &Facet)> = None;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped above")]
        for &index in &self.by_beam[low as usize..=high as usize] {
            let Some(facet) = (index as usize).checked_sub(1).map(|index| &self.facets[index])
            else {
                continue;
            };
            let away = point - facet.at;
            let across_m = facet.normal.dot(&away).abs();
            let along_m = (facet.normal.x * away.y - facet.normal.y * away.x).abs();
            if gate_m < across_m || gate_m.min(0.05) + facet.reach_m < along_m {
                continue;
            }
            let distance = across_m * across_m + along_m * along_m;
            if best.is_none_or(|(least, _)| distance < least)
                && FACING_COSINE_MIN < facet.normal.dot(&normal)
            {
                best = Some((distance, facet));
            }
        }
        best.map(|(_, facet)| facet)
    }
}

/// Walls that face directions farther apart than 37 degrees are not the same.
const FACING_COSINE_MIN: f64 = 0.8;

/// The facet at a beam's hit, if it lies on a wall.
fn facet(hits: &[Option<Point2<f64>>], beam: usize, sensor: Point2<f64>) -> Option<Facet> {
    let at = hits[beam]?;
    let (before, after) = (neighbours(hits, beam, -1), neighbours(hits, beam, 1));
    if before.len() + after.len() < 2 {
        return None;
    }
    let points = || before.iter().chain(&after).chain(std::iter::once(&at));
    let n = (before.len() + after.len() + 1) as f64;
    let mean = points().fold(Vector2::zeros(), |sum, point| sum + point.coords) / n;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for point in points() {
        let away = point.coords - mean;
        xx += away.x * away.x;
        xy += away.x * away.y;
        yy += away.y * away.y;
    }
    let along_rad = 0.5 * (2.0 * xy).atan2(xx - yy);
    let mut normal = Vector2::new(-along_rad.sin(), along_rad.cos());
    let error = (normal.x * normal.x * xx + 2.0 * normal.x * normal.y * xy + normal.y * normal.y * yy).max(0.0);
    let to_sensor = (sensor - at).normalize();
    if normal.dot(&to_sensor) < 0.0 {
        normal = -normal;
    }
    let believed = (error / n).sqrt() <= FIT_ERROR_MAX_M && GRAZING_COSINE_MIN <= normal.dot(&to_sensor);
    let next_m = |side: &[Point2<f64>]| side.first().map_or(0.0, |next| (next - at).norm());
    let reach_m = (0.5 * next_m(&before).max(next_m(&after))).min(REACH_MAX_M);
    // The hit as the line has it: what its neighbours say of it counts too.
    let at = at - normal * normal.dot(&(at.coords - mean));
    believed.then_some(Facet { at, normal, reach_m })
}

/// The hits next to a beam's on its wall, nearest first.
fn neighbours(hits: &[Option<Point2<f64>>], beam: usize, step: isize) -> Vec<Point2<f64>> {
    let mut found = Vec::with_capacity(N_SIDE);
    let Some(at) = hits[beam] else { return found };
    let (mut index, mut last) = (beam, at);
    while found.len() < N_SIDE {
        let Some(next) = index.checked_add_signed(step) else { break };
        let Some(Some(hit)) = hits.get(next).copied() else { break };
        if GAP_MAX_M < (hit - last).norm() || FIT_REACH_M < (hit - at).norm() {
            break;
        }
        found.push(hit);
        (index, last) = (next, hit);
    }
    found
}
