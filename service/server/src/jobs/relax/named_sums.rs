//! Where the poses of a version put the landmarks that have names, by all that a session saw of each; and
//! with them those that have none.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose, Vector2};
use meetpoint_storage::{MapRecord, SessionRecord};

use super::super::running::Stopped;
use super::super::workbench::Workbench;
use super::course::Moment;
use super::live_poses::{LivePose, newest_poses};
use super::nameless_sums::NamelessSums;
use super::names::LandmarkNames;
use super::way::way;
use crate::service::Service;

/// Sums over the places of what was called the same.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::jobs) struct NamedSums {
    n: f64,
    sum: Vector2<f64>,
    sum_of_squares: f64,
}

/// Names by their numbers.
pub(in crate::jobs) type SumsByName = BTreeMap<u32, NamedSums>;

impl NamedSums {
    pub(super) fn add(&mut self, at: Point2<f64>) {
        self.n += 1.0;
        self.sum += at.coords;
        self.sum_of_squares += at.coords.norm_squared();
    }

    /// How many they are.
    pub(super) fn n(&self) -> f64 {
        self.n
    }

    /// Their mean, and the variance of each coordinate about it, in square metres.
    pub(in crate::jobs) fn mean(&self) -> (Point2<f64>, f64) {
        let mean = self.sum / self.n.max(1.0);
        let of_square = self.sum_of_squares / self.n.max(1.0) - mean.norm_squared();
        (Point2::from(mean), (of_square / 2.0).max(0.0))
    }
}

/// What sessions saw of landmarks, in one frame.
#[derive(Debug, Default)]
pub(in crate::jobs) struct SeenSums {
    /// Of those with names.
    pub(in crate::jobs) named: SumsByName,
    /// Of the others.
    pub(in crate::jobs) nameless: NamelessSums,
}

/// Adds what a session saw of landmarks, as the newest version has it, in the frame that its poses are seen
/// from by `frame_from_session`.
pub(in crate::jobs) async fn add_seen(
    (service, bench): (&Service, &Workbench),
    map: &MapRecord,
    (record, frame_from_session): (&SessionRecord, Pose),
    (names, sums): (&mut LandmarkNames, &mut SeenSums),
) -> Result<(), Stopped> {
    let way = way((service, bench), record, record.acked_through, None).await?;
    let Ok(way) = way else { return Ok(()) };
    let (range_max_m, half_rad) = (way.course.range_max_m, way.course.half_field_of_view_rad);
    let moments = way.course.moments;
    let known = newest_poses(service, (map, &[(record.id, moments.len())])).await?;
    let poses = known.into_iter().flat_map(|known| known.poses);
    let mut begins = true;
    for (moment, LivePose { session_from_robot, is_lost, .. }) in moments.iter().zip(poses) {
        if !is_lost {
            let robot = frame_from_session * session_from_robot;
            sums.nameless.look(robot, range_max_m, half_rad, begins);
            begins = false;
            add_moment(moment, robot, names, sums);
        }
    }
    Ok(())
}

fn add_moment(moment: &Moment, robot: Pose, names: &mut LandmarkNames, sums: &mut SeenSums) {
    for seen in &moment.seen {
        let at = robot * seen.robot_from_landmark;
        if let Some(identity) = &seen.identity {
            let name = names.landmark(&seen.landmark_type, identity);
            sums.named.entry(name).or_default().add(at);
        } else {
            sums.nameless.add(names.landmark_type(&seen.landmark_type), at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_and_how_far_sightings_lie_from_it() {
        let mut sums = NamedSums::default();
        for (x_m, y_m) in [(101.0, 50.0), (99.0, 50.0), (100.0, 51.0), (100.0, 49.0)] {
            sums.add(Point2::new(x_m, y_m));
        }
        let (mean, variance_m2) = sums.mean();
        assert!((mean - Point2::new(100.0, 50.0)).norm() < 1e-9, "{mean}");
        assert!((variance_m2 - 0.5).abs() < 1e-6, "{variance_m2} m2");
    }
}
