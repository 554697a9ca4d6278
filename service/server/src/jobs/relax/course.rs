//! What the journal of a session says of its way: odometry from its start on, and what was observed
//! along it.
//!
//! In the order of arrival, as mapping takes it: stamps may run backwards a little, and a clock that
//! is set back does not fold the way. Over batches that never came odometry that is a pose goes on,
//! because the robot reckoned on; velocities are missing, and the way with them.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose};
use meetpoint_proto::v1;
use v1::observation::Kind;

use crate::convert::pose;
use crate::error::Error;

/// Neighbours of a moment that are looked at for its stamp: a quarter of a second at 30 Hz.
const N_NEIGHBOURS: usize = 8;
/// Whatever is within reach of a hand needs no direction, and what only reaches so far no distance;
/// metres.
const AT_HAND_M: f64 = 0.5;

/// The robot's own reckoning at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Waypoint {
    stamp_ns: i64,
    /// In the odometry's own frame.
    odometry: Pose,
    travelled_m: f64,
}

impl Waypoint {
    fn after(before: Option<&Self>, stamp_ns: i64, odometry: Pose) -> Self {
        let travelled_m = before.map_or(0.0, |before| {
            before.travelled_m + before.odometry.step_to(odometry).distance_m()
        });
        Self { stamp_ns, odometry, travelled_m }
    }
}

/// A point of the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Waypoints before it.
    pub(super) n_before: usize,
    /// The robot's pose by odometry, seen from the session's start.
    pub(super) odometry: Pose,
    /// Length of the way to here by odometry, in metres.
    pub(super) travelled_m: f64,
}

/// An observation that is to have a pose.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Moment {
    pub(super) stamp_ns: i64,
    pub(super) place: Place,
    /// The landmarks that were seen.
    pub(super) seen: Vec<Seen>,
}

/// A landmark seen.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seen {
    pub(super) identity: Option<String>,
    pub(super) landmark_type: String,
    /// Where, from the robot, in metres.
    pub(super) robot_from_landmark: Point2<f64>,
}

/// The way of a session.
#[derive(Debug)]
pub(super) struct Course {
    waypoints: Vec<Waypoint>,
    pub(super) moments: Vec<Moment>,
    /// Sightings that do not say enough.
    pub(super) n_left_out: u32,
    /// How far its detectors see, from the robot, in metres.
    pub(super) range_max_m: f64,
    /// Half of what they see, in radians, up to pi.
    pub(super) half_field_of_view_rad: f64,
}

impl Course {
    /// The session's poses by odometry at all waypoints after `n_from` and up to `n_to`.
    pub(super) fn odometry(&self, n_from: usize, n_to: usize) -> impl Iterator<Item = Place> + '_ {
        let range = n_from..n_to.min(self.waypoints.len()).max(n_from);
        range.map(|index| self.at_waypoint(index))
    }

    /// Whether the robot reckoned at all.
    pub(super) fn has_odometry(&self) -> bool {
        !self.waypoints.is_empty()
    }

    /// Waypoints of the whole way.
    pub(super) fn n_waypoints(&self) -> usize {
        self.waypoints.len()
    }

    /// The same moments along another way: the robot's poses at some of them, in order, in a frame of
    /// their own. Without poses the way stays as it is.
    pub(super) fn along(mut self, poses: &[(usize, Pose)]) -> Self {
        if poses.is_empty() {
            return self;
        }
        let mut waypoints: Vec<Waypoint> = Vec::with_capacity(poses.len());
        for &(moment, odometry) in poses {
            let Some(Moment { stamp_ns, .. }) = self.moments.get(moment) else { continue };
            waypoints.push(Waypoint::after(waypoints.last(), *stamp_ns, odometry));
        }
        self.waypoints = waypoints;
        for index in 0..self.moments.len() {
            let n_before = poses.partition_point(|&(moment, _)| moment <= index);
            self.moments[index].place = self.place_at(self.moments[index].stamp_ns, n_before);
        }
        self
    }

    fn at_waypoint(&self, index: usize) -> Place {
        let Waypoint { stamp_ns: _, odometry, travelled_m } = self.waypoints[index];
        let odometry = self.waypoints[0].odometry.step_to(odometry);
        Place { n_before: index + 1, odometry, travelled_m }
    }

    /// Where the robot was at a time, by the waypoints that arrived about then.
    fn place_at(&self, stamp_ns: i64, n_before: usize) -> Place {
        if self.waypoints.is_empty() {
            return Place { n_before: 0, odometry: Pose::IDENTITY, travelled_m: 0.0 };
        }
        let near = n_before.saturating_sub(N_NEIGHBOURS)
            ..(n_before + N_NEIGHBOURS).min(self.waypoints.len());
        let stamp = |index: usize| self.waypoints[index].stamp_ns;
        let nearest_first = || {
            let mut order: Vec<usize> = near.clone().collect();
            order.sort_by_key(|index| index.abs_diff(n_before));
            order.into_iter()
        };
        if let Some(exact) = nearest_first().find(|&index| stamp(index) == stamp_ns) {
            return self.at_waypoint(exact);
        }
        let encloses = |&index: &usize| {
            index + 1 < near.end && stamp(index) < stamp_ns && stamp_ns < stamp(index + 1)
        };
        let Some(index) = nearest_first().find(encloses) else {
            return self.at_waypoint(n_before.saturating_sub(1).min(self.waypoints.len() - 1));
        };
        let (before, after) = (self.at_waypoint(index), self.at_waypoint(index + 1));
        let share = seconds(stamp(index), stamp_ns) / seconds(stamp(index), stamp(index + 1));
        let length_m = after.travelled_m - before.travelled_m;
        Place {
            n_before: index + 1,
            odometry: before.odometry.interpolate(after.odometry, share),
            travelled_m: before.travelled_m + share * length_m,
        }
    }
}

fn seconds(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

/// A detector of a session.
struct Detector {
    robot_from_sensor: Pose,
    range_max_m: f64,
}

/// Reads batches, one after the other.
pub(super) struct CourseReader {
    detectors: BTreeMap<String, Detector>,
    course: Course,
    /// By arrival: stamp, waypoints before it, what was seen.
    noted: Vec<(i64, usize, Vec<Seen>)>,
    velocity: Option<v1::OdometryVelocity>,
}

impl CourseReader {
    /// Begins to read a session with these sensors.
    ///
    /// # Errors
    /// [`Error::InvalidField`] for a pose that is none, which opening the session refused.
    pub(super) fn new(sensors: &[v1::Sensor]) -> Result<Self, Error> {
        let mut detectors = BTreeMap::new();
        let (mut farthest_m, mut widest_rad) = (0.0_f64, 0.0_f64);
        for v1::Sensor { id, robot_from_sensor, kind } in sensors {
            let Some(v1::sensor::Kind::LandmarkDetector(detector)) = kind else { continue };
            let v1::LandmarkDetector { range_max_m, half_field_of_view_rad } = *detector;
            let robot_from_sensor = match robot_from_sensor {
                Some(wire) => pose::pose("robot_from_sensor", *wire)?,
                None => Pose::IDENTITY,
            };
            farthest_m = farthest_m.max(range_max_m + robot_from_sensor.distance_m());
            widest_rad = widest_rad.max(half_field_of_view_rad + robot_from_sensor.theta_rad.abs());
            detectors.insert(id.clone(), Detector { robot_from_sensor, range_max_m });
        }
        let course = Course {
            waypoints: Vec::new(),
            moments: Vec::new(),
            n_left_out: 0,
            range_max_m: farthest_m,
            half_field_of_view_rad: widest_rad.min(std::f64::consts::PI),
        };
        Ok(Self { detectors, course, noted: Vec::new(), velocity: None })
    }

    /// Observations with a pose so far.
    pub(super) fn n_moments(&self) -> usize {
        self.noted.len()
    }

    /// Reads the next observation.
    pub(super) fn read(&mut self, observation: v1::Observation) {
        let v1::Observation { stamp_ns, monotonic_ns: _, sensor_id, kind } = observation;
        let seen = match kind {
            None => return,
            Some(Kind::OdometryPose(v1::OdometryPose { odometry_from_robot })) => {
                let odometry = odometry_from_robot.map(|wire| pose::pose("", wire));
                if let Some(Ok(odometry)) = odometry {
                    self.velocity = None;
                    self.push(stamp_ns, odometry);
                }
                return;
            }
            Some(Kind::OdometryVelocity(velocity)) => {
                let odometry = self.reckoned(stamp_ns);
                self.push(stamp_ns, odometry);
                self.velocity = Some(velocity);
                return;
            }
            Some(Kind::LandmarkSighting(sighting)) => {
                let seen = self.seen(&sensor_id, sighting);
                self.course.n_left_out += u32::from(seen.is_none());
                seen.into_iter().collect()
            }
            Some(Kind::LaserScan(_) | Kind::SonarScan(_) | Kind::Mark(_) | Kind::PlaceVisit(_)) => {
                Vec::new()
            }
        };
        self.noted.push((stamp_ns, self.course.waypoints.len(), seen));
    }

    fn push(&mut self, stamp_ns: i64, odometry: Pose) {
        let waypoint = Waypoint::after(self.course.waypoints.last(), stamp_ns, odometry);
        self.course.waypoints.push(waypoint);
    }

    /// Where the velocity in force has led by now: along an arc.
    fn reckoned(&self, stamp_ns: i64) -> Pose {
        let Some(last) = self.course.waypoints.last() else { return Pose::IDENTITY };
        let Some(velocity) = self.velocity else { return last.odometry };
        let v1::OdometryVelocity { forward_m_per_s, left_m_per_s, turn_rad_per_s } = velocity;
        let seconds = seconds(last.stamp_ns, stamp_ns).max(0.0);
        let turn_rad = turn_rad_per_s * seconds;
        let (along, across) = if turn_rad.abs() < 1e-9 {
            (1.0, 0.0)
        } else {
            (turn_rad.sin() / turn_rad, (1.0 - turn_rad.cos()) / turn_rad)
        };
        let (forward_m, left_m) = (forward_m_per_s * seconds, left_m_per_s * seconds);
        let (x_m, y_m) = (forward_m * along - left_m * across, forward_m * across + left_m * along);
        let reckoned = last.odometry * Pose::new(x_m, y_m, turn_rad);
        if reckoned.is_finite() { reckoned } else { last.odometry }
    }

    /// Where the landmark is, if the sighting says enough.
    fn seen(&self, sensor_id: &str, sighting: v1::LandmarkSighting) -> Option<Seen> {
        let v1::LandmarkSighting { identity, landmark_type, bearing_rad, range_m } = sighting;
        let Detector { robot_from_sensor, range_max_m } = self.detectors.get(sensor_id)?;
        let range_m = range_m.or((*range_max_m <= AT_HAND_M).then_some(0.0))?;
        let bearing_rad = bearing_rad.or((range_m <= AT_HAND_M).then_some(0.0))?;
        let (sin, cos) = bearing_rad.sin_cos();
        let robot_from_landmark = *robot_from_sensor * Point2::new(range_m * cos, range_m * sin);
        Some(Seen { identity, landmark_type, robot_from_landmark })
    }

    /// The whole way. Without odometry all of it is at the start.
    pub(super) fn finish(self) -> Course {
        let Self { mut course, noted, .. } = self;
        let moment = |(stamp_ns, n_before, seen)| {
            let place = course.place_at(stamp_ns, n_before);
            Moment { stamp_ns, place, seen }
        };
        let moments = noted.into_iter().map(moment).collect();
        course.moments = moments;
        course
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const SECOND_NS: i64 = 1_000_000_000;

    fn observation(stamp_ns: i64, sensor_id: &str, kind: Kind) -> v1::Observation {
        let sensor_id = sensor_id.to_owned();
        v1::Observation { stamp_ns, monotonic_ns: None, sensor_id, kind: Some(kind) }
    }

    fn at(x_m: f64) -> Kind {
        let odometry_from_robot = Some(v1::Pose { x_m, y_m: 5.0, theta_rad: 0.0 });
        Kind::OdometryPose(v1::OdometryPose { odometry_from_robot })
    }

    fn sighting(range_m: Option<f64>, bearing_rad: Option<f64>) -> Kind {
        let (identity, landmark_type) = (None, String::new());
        Kind::LandmarkSighting(v1::LandmarkSighting {
            identity,
            landmark_type,
            bearing_rad,
            range_m,
        })
    }

    fn detector(id: &str, range_max_m: f64) -> v1::Sensor {
        let kind = v1::LandmarkDetector { range_max_m, half_field_of_view_rad: 3.0 };
        v1::Sensor {
            id: id.to_owned(),
            robot_from_sensor: Some(v1::Pose { x_m: 0.5, y_m: 0.0, theta_rad: PI / 2.0 }),
            kind: Some(v1::sensor::Kind::LandmarkDetector(kind)),
        }
    }

    fn course(observations: Vec<v1::Observation>) -> Course {
        let sensors = [detector("camera", 4.0), detector("button", 0.3)];
        let mut reader = CourseReader::new(&sensors).expect("good sensors");
        for observation in observations {
            reader.read(observation);
        }
        reader.finish()
    }

    #[test]
    fn moments_lie_between_the_waypoints_about_them() {
        let mark = || Kind::Mark(v1::Mark::default());
        let course = course(vec![
            observation(0, "", at(7.0)),
            observation(SECOND_NS / 2, "", mark()),
            observation(SECOND_NS, "", at(9.0)),
            observation(SECOND_NS, "", mark()),
            observation(9 * SECOND_NS, "", mark()),
        ]);
        let places: Vec<(f64, f64)> = course
            .moments
            .iter()
            .map(|moment| (moment.place.odometry.x_m, moment.place.travelled_m))
            .collect();
        assert_eq!(places, [(1.0, 1.0), (2.0, 2.0), (2.0, 2.0)], "from the start, in metres");
        assert_eq!(
            (course.range_max_m, course.half_field_of_view_rad),
            (4.5, PI),
            "from the robot"
        );
    }

    #[test]
    fn velocities_are_integrated_along_arcs() {
        let velocity = v1::OdometryVelocity {
            forward_m_per_s: PI / 2.0,
            left_m_per_s: 0.0,
            turn_rad_per_s: PI / 2.0,
        };
        let stop = Kind::OdometryVelocity(v1::OdometryVelocity::default());
        let course = course(vec![
            observation(0, "", Kind::OdometryVelocity(velocity)),
            observation(SECOND_NS, "", stop),
            observation(2 * SECOND_NS, "", Kind::Mark(v1::Mark::default())),
        ]);
        let end = course.moments[0].place.odometry;
        assert!(end.step_to(Pose::new(1.0, 1.0, PI / 2.0)).distance_m() < 1e-9, "{end:?}");
    }

    #[test]
    fn sightings_are_seen_from_the_robot_if_they_say_enough() {
        let course = course(vec![
            observation(0, "", at(0.0)),
            observation(0, "camera", sighting(Some(2.0), Some(0.0))),
            observation(0, "camera", sighting(None, Some(0.0))),
            observation(0, "camera", sighting(Some(2.0), None)),
            observation(0, "button", sighting(None, None)),
            observation(0, "bell", sighting(None, None)),
        ]);
        assert_eq!(course.n_left_out, 3, "no distance, no direction, no such sensor");
        let seen: Vec<Point2<f64>> = course
            .moments
            .iter()
            .flat_map(|moment| moment.seen.iter().map(|seen| seen.robot_from_landmark))
            .collect();
        assert!((seen[0] - Point2::new(0.5, 2.0)).norm() < 1e-12, "to the left: {seen:?}");
        assert!((seen[1] - Point2::new(0.5, 0.0)).norm() < 1e-12, "at hand: {seen:?}");
        assert_eq!(course.moments.len(), 5, "each has a pose all the same");
    }
}
