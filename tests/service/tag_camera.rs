//! A camera on a simulated robot that sees tags and reads their names.

use meetpoint_client::v1;
use meetpoint_geometry::Point2;
use v1::observation::Kind;

use crate::drive::{SimulatedDrive, observation};

const CAMERA: &str = "camera";
/// It sees tags so far, in metres, and to half of its field of view, in radians.
const SEEN_MAX_M: f64 = 5.0;
const HALF_FIELD_OF_VIEW_RAD: f64 = 1.0;
/// Ranges are 3 % too long.
const RANGE_SCALE: f64 = 1.03;
/// Ticks of a batch: two seconds.
const N_TICKS: usize = 40;

pub(crate) fn camera() -> v1::Sensor {
    let half_field_of_view_rad = HALF_FIELD_OF_VIEW_RAD;
    let detector = v1::LandmarkDetector { range_max_m: SEEN_MAX_M, half_field_of_view_rad };
    v1::Sensor {
        id: CAMERA.to_owned(),
        robot_from_sensor: None,
        kind: Some(v1::sensor::Kind::LandmarkDetector(detector)),
    }
}

/// A drive's batches with what the camera sees of tags that hang there in the building's frame, in metres,
/// and how many sightings that is. They are called `tag 0` and so on; one in `anonymous_each` is not read.
pub(crate) fn batches_with_tags(
    drive: &SimulatedDrive,
    tags_m: &[[f64; 2]],
    anonymous_each: Option<usize>,
) -> (Vec<v1::Batch>, usize) {
    let (mut batches, mut n_sightings) = (drive.batches(N_TICKS), 0_usize);
    for (index, tick) in drive.ticks.iter().enumerate().step_by(5) {
        // A sensor's stamp is used once: what is seen at once comes a nanosecond apart.
        for (tag, [x_m, y_m]) in (0_i64..).zip(tags_m) {
            let there = tick.truth.inverse() * Point2::new(*x_m, *y_m);
            let (range_m, bearing_rad) =
                (there.coords.norm() * RANGE_SCALE, there.y.atan2(there.x));
            if SEEN_MAX_M < range_m || HALF_FIELD_OF_VIEW_RAD < bearing_rad.abs() {
                continue;
            }
            n_sightings += 1;
            let is_read = anonymous_each.is_none_or(|each| !n_sightings.is_multiple_of(each));
            let sighting = v1::LandmarkSighting {
                identity: is_read.then(|| format!("tag {tag}")),
                landmark_type: "tag".to_owned(),
                bearing_rad: Some(bearing_rad),
                range_m: Some(range_m),
            };
            let sighting =
                observation(tick.stamp_ns + tag, CAMERA, Kind::LandmarkSighting(sighting));
            batches[index / N_TICKS].observations.push(sighting);
        }
    }
    (batches, n_sightings)
}
