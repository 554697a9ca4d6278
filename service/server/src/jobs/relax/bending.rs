//! Poses between stations: the way as odometry knows it, bent so that it meets the stations.
//!
//! Odometry, rid of its steady errors, leads from each station to somewhere near the next. What it
//! is off by there, in position and heading, is taken away along the way in proportion to the
//! length travelled, as Thrun, Burgard and Fox interpolate in section 5 of Machine Learning 31
//! (1998).

use meetpoint_geometry::{Pose, wrap_angle};
use meetpoint_relaxation::Calibration;

use super::course::{Course, Place};

/// Odometry rid of its steady errors, all along a course.
struct Reckoning<'a> {
    course: &'a Course,
    calibration: Calibration,
    /// At each waypoint, with the pose by odometry that it comes from.
    waypoints: Vec<(Pose, Pose)>,
}

impl<'a> Reckoning<'a> {
    fn new(course: &'a Course, calibration: Calibration) -> Self {
        let (mut last, mut reckoned) = (Pose::IDENTITY, Pose::IDENTITY);
        let waypoints = course.odometry(0, course.n_waypoints()).map(|place| {
            reckoned = reckoned * calibration.corrected(last.step_to(place.odometry));
            last = place.odometry;
            (reckoned, last)
        });
        let waypoints = waypoints.collect();
        Self { course, calibration, waypoints }
    }

    fn at(&self, place: Place) -> Pose {
        let n_before = place.n_before.min(self.course.n_waypoints());
        let before = n_before.checked_sub(1).and_then(|index| self.waypoints.get(index));
        let (reckoned, odometry) = before.copied().unwrap_or((Pose::IDENTITY, Pose::IDENTITY));
        reckoned * self.calibration.corrected(odometry.step_to(place.odometry))
    }
}

/// The pose at every moment of a course whose stations, at `places`, have these poses. Before the
/// first and after the last station the way is only carried along.
pub(super) fn bent(
    course: &Course,
    places: &[Place],
    poses: &[Pose],
    calibration: Calibration,
) -> Vec<Pose> {
    let reckoning = Reckoning::new(course, calibration);
    let stations: Vec<Station> = places
        .iter()
        .zip(poses)
        .map(|(&place, &pose)| Station { place, pose, reckoned: reckoning.at(place) })
        .collect();
    let pose = |place: Place| {
        let next = stations.partition_point(|station| is_before(station.place, place));
        let reckoned = reckoning.at(place);
        let Some(from) = stations.get(next.saturating_sub(1)) else { return reckoned };
        let carried = from.carry(reckoned);
        match stations.get(next.max(1)) {
            Some(to) => to.pulled(from, carried, place),
            None => carried,
        }
    };
    course.moments.iter().map(|moment| pose(moment.place)).collect()
}

/// Where a pose is known, and what odometry says of it.
struct Station {
    place: Place,
    pose: Pose,
    reckoned: Pose,
}

impl Station {
    /// A reckoned pose as it is seen from here.
    fn carry(&self, reckoned: Pose) -> Pose {
        self.pose * self.reckoned.step_to(reckoned)
    }

    /// A pose carried from the station before, freed from its share of the error that is there when
    /// this station is reached.
    fn pulled(&self, from: &Self, carried: Pose, place: Place) -> Pose {
        let length_m = self.place.travelled_m - from.place.travelled_m;
        let way_m = place.travelled_m - from.place.travelled_m;
        let is_reached = !is_before(place, self.place);
        let share = if is_reached {
            1.0
        } else if length_m <= 0.0 {
            0.0
        } else {
            way_m / length_m
        };
        let share = share.clamp(0.0, 1.0);
        let arrived = from.carry(self.reckoned);
        let missing = self.pose.position() - arrived.position();
        Pose::new(
            carried.x_m + share * missing.x,
            carried.y_m + share * missing.y,
            carried.theta_rad + share * wrap_angle(self.pose.theta_rad - arrived.theta_rad),
        )
    }
}

/// Whether a place comes before another along the way.
fn is_before(a: Place, b: Place) -> bool {
    (a.n_before, a.travelled_m) < (b.n_before, b.travelled_m)
}

#[cfg(test)]
mod tests {
    use meetpoint_proto::v1;
    use proptest::prelude::*;
    use v1::observation::Kind;

    use super::super::course::CourseReader;
    use super::*;

    /// A way along these poses, a second each, with a mark at each.
    fn course(way: &[Pose]) -> Course {
        let mut observations = Vec::new();
        for (second, pose) in (0_i64..).zip(way) {
            let at = v1::Pose { x_m: pose.x_m, y_m: pose.y_m, theta_rad: pose.theta_rad };
            let odometry = v1::OdometryPose { odometry_from_robot: Some(at) };
            for kind in [Kind::OdometryPose(odometry), Kind::Mark(v1::Mark::default())] {
                observations.push(v1::Observation {
                    stamp_ns: second * 1_000_000_000,
                    monotonic_ns: None,
                    sensor_id: String::new(),
                    kind: Some(kind),
                });
            }
        }
        let mut reader = CourseReader::new(&[]).expect("no sensors");
        for observation in observations {
            reader.read(observation);
        }
        reader.finish()
    }

    fn way() -> impl Strategy<Value = Vec<Pose>> {
        let step = (0.0..0.5_f64, -0.4..0.4_f64).prop_map(|(x, turn)| Pose::new(x, 0.0, turn));
        prop::collection::vec(step, 5..40).prop_map(|steps| {
            let mut way = vec![Pose::IDENTITY];
            for step in steps {
                way.push(way[way.len() - 1] * step);
            }
            way
        })
    }

    fn places(course: &Course, indices: &[usize]) -> Vec<Place> {
        indices.iter().map(|&index| course.moments[index].place).collect()
    }

    fn apart(a: Pose, b: Pose) -> f64 {
        let way = a.step_to(b);
        way.distance_m() + way.theta_rad.abs()
    }

    proptest! {
        /// Stations where odometry has them leave everything as it is.
        #[test]
        fn what_fits_is_not_bent(way in way()) {
            let course = course(&way);
            let places = places(&course, &[0, way.len() / 2, way.len() - 1]);
            let poses: Vec<Pose> = places.iter().map(|place| place.odometry).collect();
            for (bent, odometry) in bent(&course, &places, &poses, Calibration::NONE).iter().zip(&way) {
                prop_assert!(apart(*bent, *odometry) < 1e-9, "{bent:?} {odometry:?}");
            }
        }

        /// Stations are met wherever they lie, and a rigid motion of all moves all.
        #[test]
        fn stations_are_met(way in way(), dx in -3.0..3.0_f64, turn in -1.0..1.0_f64) {
            let course = course(&way);
            let indices = [0, way.len() / 3, way.len() - 1];
            let places = places(&course, &indices);
            let poses = [Pose::IDENTITY, Pose::new(dx, 1.0, turn), Pose::new(-dx, dx, -turn)];
            let calibration = Calibration { scale: 1.02, turn_per_m: 0.01, turn_per_rad: -0.02 };
            let found = bent(&course, &places, &poses, calibration);
            for (&index, &pose) in indices.iter().zip(&poses) {
                prop_assert!(apart(found[index], pose) < 1e-9, "{index}: {:?} {pose:?}", found[index]);
            }
            let motion = Pose::new(4.0, -2.0, 2.5);
            let moved = poses.map(|pose| motion * pose);
            let moved = bent(&course, &places, &moved, calibration);
            for (moved, found) in moved.iter().zip(&found) {
                prop_assert!(apart(*moved, motion * *found) < 1e-9, "{moved:?}");
            }
        }
    }

    #[test]
    fn the_error_is_taken_away_along_the_way() {
        let straight: Vec<Pose> = (0..=10).map(|x| Pose::new(f64::from(x), 0.0, 0.0)).collect();
        let course = course(&straight);
        let places = places(&course, &[0, 10]);
        let poses = [Pose::IDENTITY, Pose::new(10.0, 2.0, 0.2)];
        let found = bent(&course, &places, &poses, Calibration::NONE);
        assert!(apart(found[5], Pose::new(5.0, 1.0, 0.1)) < 1e-9, "half way, half of it");
    }
}
