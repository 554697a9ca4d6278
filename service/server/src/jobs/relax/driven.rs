//! A session's way as its scans tell of it: with live poses, relaxed, and what is kept of that.

use meetpoint_geometry::Pose;
use meetpoint_proto::v1;
use meetpoint_storage::{JobId, SessionRecord};
use meetpoint_tracking::{
    Calibration, DrivenScan, LandmarkSighting, LaserTravel, PlacedTravel, TravelOutcome,
};

use super::course::Course;
use super::finding::{count, place};
use super::fitted_landmarks::fitted_landmarks;
use super::live_poses::{KnownPoses, LivePose};
use super::merged_starts::{UnsureFrame, covariance_of};
use super::named_sightings::named_sighting;
use super::names::LandmarkNames;
use super::way::{Way, WayScan};
use crate::convert::pose;
use crate::convert::relaxation::RelaxedSession;

/// Scans to either side in the order of arrival among which a stamp is looked for: seconds.
const N_NEIGHBOURS: usize = 32;

/// A session on its way to be relaxed.
#[derive(Debug)]
pub(super) struct Driven {
    course: Course,
    live: Vec<LivePose>,
    /// Places of the scans among the moments.
    moments: Vec<usize>,
    /// In the session's frame.
    travel: LaserTravel,
    /// So many of its first scans have poses that an earlier relaxation found.
    n_relaxed: usize,
}

impl Driven {
    /// A way with the poses of all of its moments; those without a pose are left out.
    pub(super) fn new(way: Way, KnownPoses { poses: live, n_relaxed }: KnownPoses) -> Self {
        let Way { mut course, lasers, scans } = way;
        course.moments.truncate(live.len());
        let has_odometry = course.has_odometry();
        let (mut moments, mut driven) = (Vec::new(), Vec::new());
        for WayScan { moment, laser, ranges_m } in scans {
            let (Some(at), Some(live)) = (course.moments.get(moment), live.get(moment)) else {
                continue;
            };
            moments.push(moment);
            driven.push(DrivenScan {
                stamp_ns: at.stamp_ns,
                laser,
                ranges_m,
                odometry_from_robot: has_odometry.then_some(at.place.odometry),
                map_from_robot: live.session_from_robot,
                is_lost: live.is_lost,
            });
        }
        let travel = LaserTravel { lasers, scans: driven };
        let n_relaxed = moments.partition_point(|&moment| moment < n_relaxed);
        Self { course, live, moments, travel, n_relaxed }
    }

    /// What is relaxed, in the frame of the session's map, and what was seen of named landmarks. `frames` are
    /// those by whose errors its place there is wrong, if it was merged.
    pub(super) fn placed(
        &self,
        record: &SessionRecord,
        sightings: Vec<LandmarkSighting>,
        frames: &[UnsureFrame],
    ) -> PlacedTravel {
        let (map_from_session, mut travel) = (place(record), self.travel.clone());
        for scan in &mut travel.scans {
            scan.map_from_robot = map_from_session * scan.map_from_robot;
        }
        let n_relaxed = self.n_relaxed;
        let first = travel.scans.first().map_or(map_from_session, |scan| scan.map_from_robot);
        let start_covariance = covariance_of(first, frames).unwrap_or(PlacedTravel::KNOWN_START);
        PlacedTravel { travel, start_covariance, n_relaxed, sightings }
    }

    /// What was seen of landmarks that have names, each from the scan that was taken nearest in time.
    pub(super) fn named_sightings(&self, names: &mut LandmarkNames) -> Vec<LandmarkSighting> {
        let live = |&moment: &usize| (moment, self.live[moment].session_from_robot);
        let known: Vec<(usize, Pose)> = self.moments.iter().map(live).collect();
        let mut sightings = Vec::new();
        for (index, moment) in self.course.moments.iter().enumerate() {
            if moment.seen.is_empty() {
                continue;
            }
            let Some(scan) = self.scan_near(index) else { break };
            let step = known[scan].1.step_to(self.pose(index, &known));
            let named = |seen| named_sighting(names, seen, (scan, step * seen.robot_from_landmark));
            sightings.extend(moment.seen.iter().filter_map(named));
        }
        sightings
    }

    /// The scan taken nearest to a moment in time, among those that arrived about then; `None` without
    /// scans.
    fn scan_near(&self, moment: usize) -> Option<usize> {
        let next = self.moments.partition_point(|&scan| scan <= moment);
        let near = next.saturating_sub(N_NEIGHBOURS)..self.moments.len().min(next + N_NEIGHBOURS);
        let at_ns = self.live[moment].stamp_ns;
        near.min_by_key(|&scan| self.live[self.moments[scan]].stamp_ns.abs_diff(at_ns))
    }

    pub(super) fn n_scans(&self) -> usize {
        self.travel.scans.len()
    }

    /// Which of its scans has a stamp.
    pub(super) fn scan_at(&self, stamp_ns: i64) -> Option<usize> {
        self.travel.scans.iter().position(|scan| scan.stamp_ns == stamp_ns)
    }

    /// The pose at every moment: relaxed at scans; between them the way as live mapping had it, bent to
    /// meet both.
    fn poses(&self, relaxed: &[Pose]) -> Vec<Pose> {
        let n_known = self.moments.len().min(relaxed.len());
        let known: Vec<(usize, Pose)> =
            self.moments[..n_known].iter().copied().zip(relaxed.iter().copied()).collect();
        (0..self.live.len()).map(|moment| self.pose(moment, &known)).collect()
    }

    /// The pose at a moment, by those at scans.
    fn pose(&self, moment: usize, known: &[(usize, Pose)]) -> Pose {
        let next = known.partition_point(|&(scan, _)| scan <= moment);
        let stamp_ns = |moment: usize| self.live[moment].stamp_ns;
        let at_ns = stamp_ns(moment);
        let (before, after) = (next.checked_sub(1).map(|index| known[index]), known.get(next));
        let carried = |(from, pose): (usize, Pose)| {
            let live = |moment: usize| self.live[moment].session_from_robot;
            pose * live(from).step_to(live(moment))
        };
        if let Some(before) = before.filter(|&(scan, _)| scan == moment) {
            return before.1;
        }
        // What is sent late, or by a clock of its own, was seen when it says.
        let near = &known[next.saturating_sub(N_NEIGHBOURS)..known.len().min(next + N_NEIGHBOURS)];
        if let Some(&(_, pose)) = near.iter().find(|&&(scan, _)| stamp_ns(scan) == at_ns) {
            return pose;
        }
        if let (Some(before), Some(&after)) = (before, after)
            && (stamp_ns(before.0)..=stamp_ns(after.0)).contains(&at_ns)
        {
            let share = self.share(before.0, moment, after.0);
            return carried(before).interpolate(carried(after), share);
        }
        let encloses =
            |pair: &&[(usize, Pose)]| (stamp_ns(pair[0].0)..=stamp_ns(pair[1].0)).contains(&at_ns);
        if let Some(&[from, to]) = near.windows(2).find(encloses) {
            return from.1.interpolate(to.1, self.share(from.0, moment, to.0));
        }
        before.or(after.copied()).map_or(self.live[moment].session_from_robot, carried)
    }

    /// How far a moment lies on the way in time from one moment to another, 0 to 1.
    fn share(&self, from: usize, moment: usize, to: usize) -> f64 {
        let stamp_ns = |moment: usize| self.live[moment].stamp_ns;
        let since = |moment: usize| stamp_ns(moment).saturating_sub(stamp_ns(from)) as f64;
        let share = since(moment) / since(to);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// What the journal keeps of a session, and what there is to tell of it beside its closures. `outcome` has
/// its poses in the map's frame.
pub(super) fn found(
    (job, record): (JobId, &SessionRecord),
    driven: &Driven,
    outcome: &TravelOutcome,
    forgets_identities: bool,
) -> (RelaxedSession, v1::RelaxedSession) {
    let moments = &driven.course.moments;
    let TravelOutcome {
        poses,
        calibration,
        move_max_m: _,
        n_sightings_in_graph,
        n_sightings_doubted,
    } = outcome;
    let map_from_session = place(record);
    let session_from_map = map_from_session.inverse();
    let relaxed: Vec<Pose> = poses.iter().map(|&pose| session_from_map * pose).collect();
    let poses = driven.poses(&relaxed);
    let landmarks = fitted_landmarks(moments, &poses, forgets_identities);
    let live: Vec<Pose> = driven.live.iter().map(|live| live.session_from_robot).collect();
    let moved = poses.iter().zip(&live);
    let moved_m = moved.map(|(pose, live)| (pose.position() - live.position()).norm());
    let relaxed_landmarks = landmarks.relaxed(job, record.id);
    let Calibration { length_scale, turn_scale, turn_per_m, robot_from_wheels } = *calibration;
    let turn_per_rad = turn_scale - 1.0;
    let odometry = v1::OdometryCalibration { scale: length_scale, turn_per_m, turn_per_rad };
    let has_odometry = driven.course.has_odometry();
    let told = v1::RelaxedSession {
        session: record.id.0.to_string(),
        steps: count(driven.travel.scans.len()),
        sightings: count(landmarks.n_sightings),
        sightings_left_out: driven.course.n_left_out,
        landmarks: count(landmarks.len()),
        confidence: relaxed_landmarks.iter().map(|landmark| landmark.certainty).product(),
        spread_before_m: landmarks.spread_m(moments, &live),
        spread_after_m: landmarks.spread_m(moments, &poses),
        correction_max_m: moved_m.fold(0.0, f64::max),
        calibration: has_odometry.then_some(odometry),
        method: v1::RelaxMethod::Scans.into(),
        scans: Some(v1::ScanRelaxation {
            scans: count(driven.travel.scans.len()),
            sightings_in_graph: count(*n_sightings_in_graph),
            sightings_fitted_only: count(
                landmarks.n_sightings.saturating_sub(*n_sightings_in_graph),
            ),
            sightings_doubted: count(*n_sightings_doubted),
            lasers_moved: has_odometry.then(|| pose::to_wire(robot_from_wheels.inverse())),
            ..v1::ScanRelaxation::default()
        }),
        ..v1::RelaxedSession::default()
    };
    let session = record.id;
    (RelaxedSession { session, map_from_session, poses, landmarks: relaxed_landmarks }, told)
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::Point2;

    use super::super::course::{CourseReader, Moment, Place, Seen};
    use super::*;

    /// Moments a second and a metre apart; every third is a scan.
    fn driven(n: usize) -> Driven {
        let at = |index: usize| {
            let odometry = Pose::new(index as f64, 0.0, 0.0);
            let stamp_ns = i64::try_from(index).expect("few");
            let place = Place { n_before: 0, odometry, travelled_m: index as f64 };
            (Moment { stamp_ns, place, seen: Vec::new() }, odometry)
        };
        let live = |index| {
            let (moment, session_from_robot) = at(index);
            LivePose { stamp_ns: moment.stamp_ns, session_from_robot, is_lost: false }
        };
        let scans = (1..n).step_by(3);
        let scans =
            scans.map(|moment| WayScan { moment, laser: 0, ranges_m: std::sync::Arc::from([]) });
        let mut course = CourseReader::new(&[]).expect("no sensors").finish();
        course.moments = (0..n).map(|index| at(index).0).collect();
        let way = Way { course, lasers: Vec::new(), scans: scans.collect() };
        Driven::new(way, KnownPoses { poses: (0..n).map(live).collect(), n_relaxed: 0 })
    }

    #[test]
    fn between_scans_the_way_is_bent() {
        let driven = driven(6);
        assert_eq!(driven.moments, [1, 4], "scans");
        let relaxed = [Pose::new(1.0, 2.0, 0.0), Pose::new(4.0, 5.0, 0.0)];
        let poses = driven.poses(&relaxed);
        let found: Vec<[f64; 2]> = poses.iter().map(|pose| [pose.x_m, pose.y_m]).collect();
        let expected = [[0.0, 2.0], [1.0, 2.0], [2.0, 3.0], [3.0, 4.0], [4.0, 5.0], [5.0, 5.0]];
        for (found, expected) in found.iter().zip(expected) {
            let off_m = (found[0] - expected[0]).hypot(found[1] - expected[1]);
            assert!(off_m < 1e-9, "{found:?} {expected:?}");
        }
        assert_eq!(driven.poses(&[]).len(), 6, "as live mapping had it");
    }

    #[test]
    fn landmarks_are_seen_from_the_scan_nearest_in_time() {
        let seen = |identity: Option<&str>| Seen {
            identity: identity.map(str::to_owned),
            landmark_type: "tag".to_owned(),
            robot_from_landmark: Point2::new(2.0, 1.0),
        };
        let mut driven = driven(6);
        driven.course.moments[2].seen = vec![seen(Some("a")), seen(None)];
        driven.course.moments[5].seen = vec![seen(Some("a"))];
        driven.live[5].stamp_ns = 1;
        let found = driven.named_sightings(&mut LandmarkNames::default());
        let places: Vec<(usize, [f64; 2])> = found
            .iter()
            .map(|one| (one.scan, [one.robot_from_landmark.x, one.robot_from_landmark.y]))
            .collect();
        let expected = [(0, [3.0, 1.0]), (0, [2.0, 1.0])];
        assert_eq!(places, expected, "a metre after the scan, and late but at its stamp");
        let without = Driven { moments: Vec::new(), ..driven };
        assert_eq!(without.named_sightings(&mut LandmarkNames::default()), [], "no scans");
    }

    #[test]
    fn what_was_sent_late_was_seen_when_it_says() {
        let mut driven = driven(6);
        let relaxed = [Pose::new(1.0, 2.0, 0.0), Pose::new(4.0, 5.0, 0.0)];
        driven.live[5].stamp_ns = 1;
        assert_eq!(driven.poses(&relaxed)[5], relaxed[0], "at the stamp of a scan");
        driven.live[5].stamp_ns = 3;
        let between = driven.poses(&relaxed)[5];
        assert!((between.x_m - 3.0).abs() + (between.y_m - 4.0).abs() < 1e-9, "{between:?}");
    }
}
