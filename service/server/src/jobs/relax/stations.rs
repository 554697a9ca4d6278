//! Stations: the moments of a course at which the pose is estimated. Coarse in time as in section 5
//! of Thrun, Burgard and Fox, Machine Learning 31 (1998): one for what was seen at about the same
//! time, and one after a long way on which nothing was.

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{Detector, Motion, Sighting, Step, Travel};

use super::course::{Course, Moment, Place, Seen};
use super::names::LandmarkNames;

/// What is seen within so many nanoseconds of the first sighting is seen at one station: a fifth of a
/// second, in which an indoor robot moves by 0.2 m, which odometry knows to millimetres.
const TOGETHER_NS: i64 = 200_000_000;
/// A way without a sighting is cut after so many metres, as in the paper.
const WAY_MAX_M: f64 = 20.0;
/// Legs of a way are at most so long, in metres...
const LEG_MAX_M: f64 = 0.5;
/// ...and turn by at most so much, in radians, unless odometry came less often.
const LEG_MAX_RAD: f64 = 0.2;
/// A first station so near to the start, in metres and radians, is the start.
const AT_START: f64 = 0.05;

/// A course in the terms of relaxation.
#[derive(Debug)]
pub(super) struct Stations {
    pub(super) travel: Travel,
    /// Where the stations lie, by odometry: one a step.
    pub(super) places: Vec<Place>,
    /// What its types are called, and its landmarks, if that is to be believed.
    pub(super) names: LandmarkNames,
}

/// The stations of a course: the first is its start.
pub(super) fn stations(course: &Course, forgets_identities: bool) -> Stations {
    let start = Place { n_before: 0, odometry: Pose::IDENTITY, travelled_m: 0.0 };
    let (mut places, mut steps) = (vec![start], vec![standing()]);
    let mut names = LandmarkNames::default();
    let seen =
        course.moments.iter().flat_map(|moment| moment.seen.iter().map(move |seen| (moment, seen)));
    let mut station_ns = None;
    for (moment, seen) in seen {
        let elapsed_ns = station_ns.map(|begun_ns| moment.stamp_ns.saturating_sub(begun_ns));
        if elapsed_ns.is_none_or(|elapsed_ns| !(0..=TOGETHER_NS).contains(&elapsed_ns)) {
            go_on(course, moment.place, &mut places, &mut steps);
            station_ns = Some(moment.stamp_ns);
        }
        let station = places[places.len() - 1];
        let identity = seen.identity.as_deref().filter(|_| !forgets_identities);
        let identity = identity.map(|identity| names.landmark(&seen.landmark_type, identity));
        let landmark_type = names.landmark_type(&seen.landmark_type);
        let sighting = sighting(station, (moment, seen), identity, landmark_type);
        if let Some(step) = steps.last_mut() {
            step.sightings.push(sighting);
        }
    }
    let detector = Detector {
        range_max_m: course.range_max_m,
        half_field_of_view_rad: course.half_field_of_view_rad,
    };
    let travel = Travel { detector, steps };
    Stations { travel, places, names }
}

fn standing() -> Step {
    Step { motion: Motion::NONE, sightings: Vec::new() }
}

/// Goes on to a station, over others if the way is long.
fn go_on(course: &Course, to: Place, places: &mut Vec<Place>, steps: &mut Vec<Step>) {
    let last = places[places.len() - 1];
    let way = last.odometry.step_to(to.odometry);
    let is_at_start = steps.len() == 1
        && to.travelled_m < AT_START
        && way.distance_m() < AT_START
        && way.theta_rad.abs() < AT_START;
    if is_at_start && steps[0].sightings.is_empty() {
        places[0] = Place { odometry: to.odometry, ..to };
        return;
    }
    let mut from = last;
    let mut between: Vec<Place> = Vec::new();
    for place in course.odometry(last.n_before, to.n_before) {
        if WAY_MAX_M <= place.travelled_m - from.travelled_m {
            between.push(place);
            from = place;
        }
    }
    for place in between.into_iter().chain([to]) {
        let from = places[places.len() - 1];
        steps.push(Step { motion: motion(course, from, place), sightings: Vec::new() });
        places.push(place);
    }
}

/// The way from one place to another, in legs.
fn motion(course: &Course, from: Place, to: Place) -> Motion {
    let way = course.odometry(from.n_before, to.n_before).map(|place| place.odometry);
    let mut legs = Vec::new();
    let (mut begun, mut last) = (from.odometry, from.odometry);
    let mut length_m = 0.0;
    for here in way.chain([to.odometry]) {
        let step_m = last.step_to(here).distance_m();
        let turn_rad = begun.step_to(here).theta_rad.abs();
        if last != begun && (LEG_MAX_M < length_m + step_m || LEG_MAX_RAD < turn_rad) {
            legs.push(begun.step_to(last));
            (begun, length_m) = (last, 0.0);
        }
        length_m += step_m;
        last = here;
    }
    if last != begun {
        legs.push(begun.step_to(last));
    }
    Motion::new(legs)
}

/// A sighting as it would have been made from its station.
fn sighting(
    station: Place,
    (moment, seen): (&Moment, &Seen),
    identity: Option<u32>,
    landmark_type: u32,
) -> Sighting {
    let station_from_robot = station.odometry.step_to(moment.place.odometry);
    let offset = (station_from_robot * seen.robot_from_landmark).coords;
    let (range_m, bearing_rad) = (offset.norm(), offset.y.atan2(offset.x));
    Sighting { identity, landmark_type, range_m, bearing_rad }
}

#[cfg(test)]
mod tests {
    use meetpoint_proto::v1;
    use meetpoint_relaxation::Calibration;
    use v1::observation::Kind;

    use super::super::course::CourseReader;
    use super::*;

    /// 45 m straight on by steps of a tenth of a metre and a second, then a turn on the spot; doors
    /// are seen at hand after so many seconds.
    fn course(seen_at_s: &[i64]) -> Course {
        let sensor = v1::Sensor {
            id: "button".into(),
            robot_from_sensor: None,
            kind: Some(v1::sensor::Kind::LandmarkDetector(v1::LandmarkDetector {
                range_max_m: 0.3,
                half_field_of_view_rad: 3.0,
            })),
        };
        let mut observations = Vec::new();
        for tick in 0..=480_i32 {
            let turned = f64::from((tick - 450).max(0)) * 0.1;
            let pose =
                v1::Pose { x_m: f64::from(tick.min(450)) * 0.1, y_m: 0.0, theta_rad: turned };
            let stamp_ns = i64::from(tick) * 1_000_000_000;
            let odometry = v1::OdometryPose { odometry_from_robot: Some(pose) };
            let mut note = |sensor_id: &str, kind| {
                let sensor_id = sensor_id.to_owned();
                let kind = Some(kind);
                observations.push(v1::Observation {
                    stamp_ns,
                    monotonic_ns: None,
                    sensor_id,
                    kind,
                });
            };
            note("", Kind::OdometryPose(odometry));
            for _ in seen_at_s.iter().filter(|&&second| second == i64::from(tick)) {
                let identity = Some(format!("door {tick}"));
                let seen = v1::LandmarkSighting { identity, ..v1::LandmarkSighting::default() };
                note("button", Kind::LandmarkSighting(seen));
            }
        }
        let mut reader = CourseReader::new(&[sensor]).expect("a good sensor");
        for observation in observations {
            reader.read(observation);
        }
        reader.finish()
    }

    #[test]
    fn a_station_a_sighting_and_after_a_long_way() {
        let found = stations(&course(&[0, 440, 440, 480]), false);
        let places_m: Vec<f64> =
            found.places.iter().map(|place| place.travelled_m.round()).collect();
        assert_eq!(places_m, [0.0, 20.0, 40.0, 44.0, 45.0], "start, twice on the way, two doors");
        let counts: Vec<usize> =
            found.travel.steps.iter().map(|step| step.sightings.len()).collect();
        assert_eq!(counts, [1, 0, 0, 2, 1], "the start is a station as well");
        let identities = [0, 1, 2].map(|number| found.names.identity(number));
        assert_eq!(identities, ["door 0", "door 440", "door 480"].map(Some), "in order");
        assert_eq!([0, 1].map(|it| found.names.type_name(it)), [Some(""), None], "one type");
        let reckoned = found.travel.dead_reckoning(&Calibration::NONE);
        for (pose, place) in reckoned.iter().zip(&found.places) {
            let off = pose.step_to(place.odometry);
            assert!(off.distance_m() < 1e-9 && off.theta_rad.abs() < 1e-9, "{pose:?} {place:?}");
        }
        let legs = found.travel.steps.iter().flat_map(|step| step.motion.legs());
        let fits = |leg: &Pose| leg.distance_m() <= 0.51 && leg.theta_rad.abs() <= 0.21;
        assert!(legs.clone().all(fits), "short ones");
        assert!(90 + 15 <= legs.count(), "the turn on the spot has its own");
    }

    #[test]
    fn forgotten_identities_are_none() {
        let found = stations(&course(&[5, 9]), true);
        let mut sightings = found.travel.steps.iter().flat_map(|step| &step.sightings);
        assert!(sightings.all(|sighting| sighting.identity.is_none()), "none is told");
        assert_eq!(found.names.identity(0), None, "nor named");
    }
}
