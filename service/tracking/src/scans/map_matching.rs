//! Every key scan matched once more, with the map that all of them draw.
//!
//! Pairs of scans agree about straight walls. The map has all else that stands still too, chairs and
//! posts, and has forgotten who walked by; but it is made of cells, and of scans that err alike. Where a
//! scan lies by the one and by the other are two estimates whose errors are mostly apart, so that the
//! mean of both is nearer to the truth than either: a key scan moves half the way. Then the map is drawn
//! anew. Time of a round O(key scans * beams * cells a beam).

use std::num::NonZero;

use meetpoint_geometry::{GridFrame, Pose};

use crate::drawing::Drawing;
use crate::matching::descent::descend;
use crate::matching::field::Field;
use crate::matching::points::scan_points;
use crate::matching::search::Prior;
use crate::params::MappingParams;
use crate::scans::key_scan::KeyScan;
use crate::scans::laser_travel::LaserTravel;
use crate::side_by_side::in_chunks;

/// Map matching under way.
#[derive(Debug)]
pub(crate) struct MapMatching {
    frame: GridFrame,
    drawing: Drawing,
    /// Of the drawing, once it is done.
    field: Option<Field>,
    /// Poses of the first key scans, as far as this round has come.
    matched: Vec<Pose>,
    n_rounds_left: u32,
}

/// What a scan moves of the way to where the map has it: the mean of two estimates.
const SHARE: f64 = 0.5;
/// Key scans that a slice draws or matches: some tens of milliseconds.
const N_SLICE: usize = 400;
/// Key scans that a thread takes at once.
const N_AT_ONCE: usize = 16;

impl MapMatching {
    /// Of maps in some frame.
    pub(crate) fn new(frame: GridFrame, n_rounds: u32) -> Self {
        let (drawing, matched) = (Drawing::new(frame), Vec::new());
        Self { frame, drawing, field: None, matched, n_rounds_left: n_rounds }
    }

    /// Does a slice; the poses of key scans move at the end of each round. False, and nothing done, when
    /// all rounds are over. The first key scan stays where it is.
    pub(crate) fn advance(
        &mut self,
        (travel, keys): (&LaserTravel, &[KeyScan]),
        poses: &mut [Pose],
        params: &MappingParams,
        n_threads: NonZero<usize>,
    ) -> bool {
        if self.n_rounds_left == 0 {
            return false;
        }
        let n_drawn = self.drawing.n_drawn();
        if n_drawn < keys.len() {
            self.drawing.draw(travel, keys, poses, (&params.beam_model, n_drawn + N_SLICE));
            return true;
        }
        let field = self.field.get_or_insert_with(|| Field::new(&self.drawing.grid, &params.field));
        let first = self.matched.len();
        let end = (first + N_SLICE).min(keys.len());
        self.matched.extend(in_chunks(first..end, N_AT_ONCE, n_threads, |key| {
            if key == 0 {
                return poses[key];
            }
            poses[key].interpolate(by_map(field, (travel, &keys[key]), poses[key], params), SHARE)
        }));
        if end == keys.len() {
            poses.copy_from_slice(&self.matched);
            *self = Self::new(self.frame, self.n_rounds_left - 1);
        }
        true
    }
}

/// Where the map has a key scan, near where it is.
fn by_map(
    field: &Field,
    (travel, key): (&LaserTravel, &KeyScan),
    pose: Pose,
    params: &MappingParams,
) -> Pose {
    let scan = &travel.scans[key.scan];
    let Some(laser) = travel.lasers.get(scan.laser) else { return pose };
    let params = &params.matching;
    let limits = (params.range_max_m, params.gap_m);
    let points = scan_points(laser.robot_from_sensor, &laser.geometry, &scan.ranges_m, limits);
    let prior = Prior {
        center: pose,
        gain_per_m2: params.odometry_gain_per_m2,
        gain_per_rad2: params.odometry_gain_per_rad2,
        loss_max: params.odometry_loss_max,
    };
    descend(field, &points, pose, &prior, params.n_iterations_max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_occupancy::LaserGeometry;

    use super::*;
    use crate::relaxation_params::LaserRelaxationParams;
    use crate::scans::key_scan::key_scans;
    use crate::scans::laser_travel::{DrivenScan, PlacedTravel, TravelLaser};
    use crate::scans::travels::Travels;

    const PARAMS: LaserRelaxationParams = LaserRelaxationParams::INDOOR;
    const LASER: TravelLaser = TravelLaser {
        robot_from_sensor: Pose::IDENTITY,
        geometry: LaserGeometry {
            angle_min_rad: -PI,
            angle_increment_rad: PI / 180.0,
            n_beams: 360,
            range_min_m: 0.0,
            range_max_m: 20.0,
        },
    };

    /// What a robot sees of the walls of a room of 8 m by 6 m about the origin.
    fn seen(pose: Pose) -> Vec<f32> {
        let range_m = |beam: u32| {
            let (sin, cos) = (pose.theta_rad + LASER.geometry.bearing_rad(beam)).sin_cos();
            let to = |at: f64, half: f64, slope: f64| (half * slope.signum() - at) / slope;
            to(pose.x_m, 4.0, cos).min(to(pose.y_m, 3.0, sin))
        };
        #[expect(clippy::cast_possible_truncation, reason = "ranges are sent as f32")]
        (0..LASER.geometry.n_beams).map(|beam| range_m(beam) as f32).collect()
    }

    #[test]
    fn a_scan_that_lies_apart_from_the_others_comes_nearer() {
        let place = |at: i32| (0.4 * f64::from(at % 8) - 1.3, 0.5 * f64::from(at / 8) - 0.5);
        let pose = |(x_m, y_m): (f64, f64)| Pose::new(x_m, y_m, 0.03);
        let truths: Vec<Pose> = (0..24).map(place).map(pose).collect();
        let scan = |(index, pose): (usize, &Pose)| DrivenScan {
            stamp_ns: i64::try_from(index).expect("few"),
            laser: 0,
            ranges_m: seen(*pose).into(),
            odometry_from_robot: None,
            map_from_robot: *pose,
            is_lost: false,
        };
        let scans = truths.iter().enumerate().map(scan).collect();
        let travel = LaserTravel { lasers: vec![LASER], scans };
        let travels = Travels::new(vec![PlacedTravel::of_known_start(travel)], false);
        let keys = key_scans(&travels, &PARAMS.key_scans);
        assert_eq!(keys.len(), truths.len(), "all are key scans");
        let mut poses = truths.clone();
        poses[4] = poses[4] * Pose::new(0.03, -0.03, 0.01);
        let frame = GridFrame::new(0.05).expect("a length");
        let off_m = |poses: &[Pose], key: usize| truths[key].step_to(poses[key]).distance_m();
        let before_m = off_m(&poses, 4);
        let mut matching = MapMatching::new(frame, 2);
        let one = NonZero::<usize>::MIN;
        let mut n_slices = 0;
        while matching.advance((&travels.all, &keys), &mut poses, &PARAMS.mapping, one) {
            n_slices += 1;
        }
        assert_eq!(n_slices, 4, "two rounds: drawn and matched");
        assert!(off_m(&poses, 4) < 0.9 * before_m, "{} of {before_m} m left", off_m(&poses, 4));
        assert_eq!(poses[0], truths[0], "the first stays");
        // A map of cells of 5 cm errs by less than half of one.
        for key in (0..truths.len()).filter(|key| *key != 4) {
            assert!(off_m(&poses, key) < 0.02, "{key}: {} m", off_m(&poses, key));
        }
    }
}
