//! Landmarks that the service finds itself: the meet points of the grid about the robot.
//!
//! Section 10 of Thrun, Burgard and Fox, Machine Learning 31 (1998), names the meet points of Thrun's
//! Voronoi diagrams as landmarks: junctions, corners, dead ends. A grid drawn of the robot's last metres
//! is right in itself, however far odometry has drifted. So the way is cut into stretches; each is
//! mapped by itself, from what lies before it to what lies behind; and a meet point that the robot came
//! within reach of is a sighting, from the nearest pose, if that pose is on the stretch itself: so every
//! pass tells of a place once, and no pass tells of what it has seen one side of only.
//!
//! The way between sightings is the one by matching: steps from scan to scan as the stretches have them.

use std::ops::{ControlFlow, Range};

use meetpoint_geometry::{Cell, GridInfo, Point2, Pose};
use meetpoint_occupancy::Raster;
use meetpoint_topology::{FreeSpace, MeetPoint, TopologyParams, meet_points, segmentation};
use meetpoint_tracking::{
    LiveMap, MappingParams, Observation, ObservationKind, Sensor, SensorKind, SessionConfig,
    SessionKey,
};

use super::course::{Course, Seen};
use super::way::{Way, WayScan};
use crate::error::Error;

/// What the type of these landmarks is called. All are of one: a niche in a bend adds a branch on one
/// pass and none on the next, which makes a junction of a corner.
const TYPE: &str = "meet_point";
/// Length of a stretch, in metres: two corridors' width, so that it tells of a few places only.
const STRETCH_M: f64 = 6.0;
/// What is mapped before a stretch and behind it, in metres: with it 12 m, over which matched odometry
/// is right to centimetres.
const MARGIN_M: f64 = 3.0;
/// A robot within this of a meet point has reached it, in metres. Not more than a detector at hand has
/// (twice what relaxation calls reached), so that a place that was passed by is no place missed.
const REACH_M: f64 = 1.0;
/// Clearance of a meet point, in metres: less is no way for a robot; in more, walls are so far that their
/// roughness moves the point by more than sightings may differ.
const CLEARANCE_M: Range<f64> = 0.4..2.5;
/// What bounds a meet point's clearance has to be wall, to this share, and not the end of what was seen.
const WALL_SHARE_MIN: f64 = 0.7;
/// Thickness of the ring in which that is counted, in metres: two cells and what cuts their corners.
const RING_M: f64 = 0.12;
/// Grids of stretches reach so far beyond the poses, in metres: the largest clearance, and walls.
const BORDER_M: f64 = 4.0;
/// Edge of their cells, in metres.
const RESOLUTION_M: f64 = 0.05;
/// Cells of a stretch's grid: 60 m by 60 m. One with more has leaps in it, and nothing is seen on it.
const N_CELLS_MAX: usize = 1_440_000;
/// Scans less than this apart, in metres and radians, say the same: who stands is not mapped for hours.
const STEP_MIN: f64 = 0.02;
/// A stretch whose scans do not agree, to this share, is not believed.
const LOST_SHARE_MAX: f64 = 0.2;

/// Whether landmarks of that type are those of the grid.
pub(super) fn is_type(landmark_type: &str) -> bool {
    landmark_type == TYPE
}

/// Sightings of the grid's landmarks along a course.
pub(super) fn n_sightings(course: &Course) -> usize {
    let seen = course.moments.iter().flat_map(|moment| &moment.seen);
    seen.filter(|seen| is_type(&seen.landmark_type)).count()
}

/// What was made of a way.
#[derive(Debug)]
pub(super) struct Told {
    /// The course with the sightings, along the way by matching.
    pub(super) course: Course,
    /// Stretches mapped.
    pub(super) n_stretches: usize,
    /// Those whose scans did not agree: nothing is seen on them, and their steps are odometry's.
    pub(super) n_doubtful: usize,
}

/// A scan that is mapped, and what is known of it.
#[derive(Clone, Copy, Debug)]
struct Mapped {
    /// Its place among the way's scans.
    scan: usize,
    /// Its place among the course's moments.
    moment: usize,
    travelled_m: f64,
    /// By odometry.
    odometry: Pose,
}

/// Finds the landmarks of a way stretch by stretch and tells how far it is, as a share; `None` if it was
/// told to stop.
///
/// # Errors
/// [`Error::Internal`] if there is no grid of [`RESOLUTION_M`].
pub(super) fn with_grid_landmarks(
    way: Way,
    mut tell: impl FnMut(f64) -> ControlFlow<()>,
) -> Result<Option<Told>, Error> {
    let scans = thinned(&way);
    let (mut sightings, mut steps) = (Vec::new(), Vec::new());
    let (mut n_stretches, mut n_doubtful) = (0, 0);
    let mut begin = 0;
    while begin < scans.len() {
        let begin_m = scans[begin].travelled_m;
        let beyond = |m: f64| scans.partition_point(|scan| scan.travelled_m < m);
        let end = beyond(begin_m + STRETCH_M).max(begin + 1);
        let all = beyond(begin_m - MARGIN_M)..beyond(begin_m + STRETCH_M + MARGIN_M).max(end);
        let stretch = Stretch::mapped(&way, &scans[all.clone()])?;
        let own = begin - all.start..end - all.start;
        n_stretches += 1;
        if stretch.is_doubtful() {
            n_doubtful += 1;
        } else {
            sightings.extend(stretch.sightings(own.clone()));
        }
        steps.extend(stretch.steps(own));
        if tell(end as f64 / scans.len() as f64).is_break() {
            return Ok(None);
        }
        begin = end;
    }
    let mut course = way.course.along(&chained(&scans, &steps));
    for (moment, seen) in sightings {
        course.moments[moment].seen.push(seen);
    }
    if course.range_max_m < REACH_M {
        course.range_max_m = REACH_M;
        course.half_field_of_view_rad = std::f64::consts::PI;
    }
    Ok(Some(Told { course, n_stretches, n_doubtful }))
}

/// The scans of a way that say something new.
fn thinned(way: &Way) -> Vec<Mapped> {
    let mut kept: Vec<Mapped> = Vec::new();
    for (scan, WayScan { moment, .. }) in way.scans.iter().enumerate() {
        let Some(at) = way.course.moments.get(*moment) else { continue };
        let odometry = at.place.odometry;
        let is_new = kept.last().is_none_or(|last| {
            let step = last.odometry.step_to(odometry);
            STEP_MIN <= step.distance_m() || STEP_MIN <= step.theta_rad.abs()
        });
        if is_new {
            let travelled_m = at.place.travelled_m;
            kept.push(Mapped { scan, moment: *moment, travelled_m, odometry });
        }
    }
    kept
}

/// The way by these steps, each from a scan to the next one.
fn chained(scans: &[Mapped], steps: &[Pose]) -> Vec<(usize, Pose)> {
    let mut pose = Pose::IDENTITY;
    let mut way = Vec::with_capacity(scans.len());
    for (scan, &step) in scans.iter().zip(steps) {
        way.push((scan.moment, pose));
        pose = pose * step;
    }
    way
}

/// A stretch of a way, mapped by itself.
struct Stretch<'a> {
    scans: &'a [Mapped],
    /// One a scan.
    poses: Vec<Pose>,
    n_lost: usize,
    map: LiveMap,
}

impl<'a> Stretch<'a> {
    fn mapped(way: &Way, scans: &'a [Mapped]) -> Result<Self, Error> {
        let key = SessionKey(0);
        let sensor = |laser: &meetpoint_tracking::TravelLaser| Sensor {
            robot_from_sensor: laser.robot_from_sensor,
            kind: SensorKind::Laser(laser.geometry),
        };
        let sensors = way.lasers.iter().map(sensor).collect();
        let mut map = LiveMap::new(MappingParams::INDOOR, RESOLUTION_M)
            .map_err(|error| Error::internal(format!("no grid of {RESOLUTION_M} m: {error:?}")))?;
        map.open_session(key, SessionConfig { map_from_start: Pose::IDENTITY, sensors });
        let (mut poses, mut n_lost) = (Vec::with_capacity(scans.len()), 0);
        for mapped in scans {
            let WayScan { laser, ranges_m, .. } = &way.scans[mapped.scan];
            let stamp_ns = way.course.moments[mapped.moment].stamp_ns;
            let kind = ObservationKind::OdometryPose(mapped.odometry);
            map.apply(key, &Observation { stamp_ns, kind });
            let kind = ObservationKind::LaserScan { sensor: *laser, ranges_m: ranges_m.to_vec() };
            let estimate = map.apply(key, &Observation { stamp_ns, kind });
            n_lost += usize::from(estimate.is_none_or(|estimate| estimate.lost));
            poses.push(estimate.map_or(Pose::IDENTITY, |estimate| estimate.map_from_robot));
        }
        Ok(Self { scans, poses, n_lost, map })
    }

    fn is_doubtful(&self) -> bool {
        LOST_SHARE_MAX * (self.scans.len() as f64) < self.n_lost as f64
    }

    /// The step from each of these scans to the next: by matching, or by odometry if that is in doubt;
    /// none from the last scan of all.
    fn steps(&self, own: Range<usize>) -> impl Iterator<Item = Pose> + '_ {
        let is_doubtful = self.is_doubtful();
        own.map(move |index| match (self.scans.get(index + 1), self.poses.get(index + 1)) {
            (Some(next), _) if is_doubtful => self.scans[index].odometry.step_to(next.odometry),
            (Some(_), Some(&next)) => self.poses[index].step_to(next),
            _ => Pose::IDENTITY,
        })
    }

    /// The meet points that the robot reached at these scans, each with the moment of the nearest.
    fn sightings(&self, own: Range<usize>) -> Vec<(usize, Seen)> {
        let Some(info) = self.info() else { return Vec::new() };
        let raster = self.map.grid().raster(Some(info));
        let space = FreeSpace::from_raster(&raster, FreeSpace::PROBABILITY_MAX);
        let params = &TopologyParams::INDOOR;
        let found = segmentation(&space, params);
        let points = meet_points(&found.voronoi, &found.clearance, &params.meet_points);
        let told = |point: MeetPoint| {
            let off_m = |index: &usize| (self.poses[*index].position() - point.position).norm();
            let near = (0..self.poses.len()).min_by(|a, b| off_m(a).total_cmp(&off_m(b)))?;
            let is_told = own.contains(&near)
                && off_m(&near) <= REACH_M
                && CLEARANCE_M.contains(&point.clearance_m)
                && is_walled(&raster, point.position, point.clearance_m);
            is_told.then(|| {
                let robot_from_landmark = self.poses[near].inverse() * point.position;
                let landmark_type = TYPE.to_owned();
                let seen = Seen { identity: None, landmark_type, robot_from_landmark };
                (self.scans[near].moment, seen)
            })
        };
        points.into_iter().filter_map(told).collect()
    }

    /// The cells about the poses; `None` if they are too many.
    fn info(&self) -> Option<GridInfo> {
        let frame = self.map.grid().frame();
        let first = self.poses.first()?.position();
        let corner = |pick: fn(f64, f64) -> f64, border_m: f64| {
            let over = |corner: Point2<f64>, pose: &Pose| {
                Point2::new(pick(corner.x, pose.x_m), pick(corner.y, pose.y_m))
            };
            let corner = self.poses.iter().fold(first, over);
            frame.cell_at(Point2::new(corner.x + border_m, corner.y + border_m))
        };
        let (low, high) = (corner(f64::min, -BORDER_M), corner(f64::max, BORDER_M));
        let width = u32::try_from(high.x.saturating_sub(low.x).saturating_add(1)).ok()?;
        let height = u32::try_from(high.y.saturating_sub(low.y).saturating_add(1)).ok()?;
        let is_small = (width as usize).saturating_mul(height as usize) <= N_CELLS_MAX;
        is_small.then_some(GridInfo { frame, first: low, width, height })
    }
}

/// Whether free space ends at walls about a point, as far as its clearance reaches: where it ends at what
/// was never seen, the point lies in the middle of what was seen, and of nothing else.
fn is_walled(raster: &Raster, point: Point2<f64>, clearance_m: f64) -> bool {
    let frame = raster.info.frame;
    let log_odds = |x: i32, y: i32| log_odds(raster, Cell { x, y });
    let is_free = |x: i32, y: i32| log_odds(x, y) < 0.0;
    let reach_m = clearance_m + RING_M;
    #[expect(clippy::cast_possible_truncation, reason = "some hundred cells")]
    let reach = (reach_m / frame.resolution_m()).ceil() as i32;
    let middle = frame.cell_at(point);
    let (mut n_walls, mut n_unknown) = (0_u32, 0_u32);
    for y in middle.y - reach..=middle.y + reach {
        for x in middle.x - reach..=middle.x + reach {
            let off_m = (frame.center_of(Cell { x, y }) - point).norm();
            let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
            let is_edge = !is_free(x, y) && beside.iter().any(|&(x, y)| is_free(x, y));
            if is_edge && off_m <= reach_m {
                n_unknown += u32::from(log_odds(x, y).is_nan());
                n_walls += u32::from(!log_odds(x, y).is_nan());
            }
        }
    }
    0 < n_walls && WALL_SHARE_MIN * f64::from(n_walls + n_unknown) <= f64::from(n_walls)
}

/// What a raster says of a cell; NaN beyond it.
fn log_odds(raster: &Raster, cell: Cell) -> f32 {
    let GridInfo { frame: _, first, width, height } = raster.info;
    let column = u32::try_from(cell.x - first.x).ok().filter(|column| *column < width);
    let row = u32::try_from(cell.y - first.y).ok().filter(|row| *row < height);
    match (column, row) {
        (Some(column), Some(row)) => raster.log_odds[(row * width + column) as usize],
        _ => f32::NAN,
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_proto::v1;
    use meetpoint_sim::{ChaCha8Rng, Drive, OdometryError, Robot, corridor_loop};
    use meetpoint_tracking::TravelLaser;
    use rand::SeedableRng;
    use v1::observation::Kind;

    use super::super::course::CourseReader;
    use super::*;
    use crate::convert::pose;

    /// Once around a block and one side more, and where the way truly began.
    fn around_the_block() -> (Way, Pose) {
        let world = corridor_loop();
        let odometry_error =
            OdometryError { drift_rad_per_m: 0.009, ..OdometryError::UNCALIBRATED };
        let robot = Robot { n_ticks_per_scan: 4, odometry_error, ..Robot::INDOOR };
        let rng = ChaCha8Rng::seed_from_u64(3);
        let drive = Drive::new(&world.building, robot, &world.tours[0], 0, rng);
        let drive = drive.expect("the tour can be driven");
        let start = drive.truth();
        let mut reader = CourseReader::new(&[]).expect("no sensors");
        let mut scans = Vec::new();
        for tick in drive {
            let mut read = |kind| {
                let (stamp_ns, sensor_id) = (tick.stamp_ns, String::new());
                let kind = Some(kind);
                reader.read(v1::Observation { stamp_ns, monotonic_ns: None, sensor_id, kind });
            };
            let odometry_from_robot = Some(pose::to_wire(tick.odometry));
            read(Kind::OdometryPose(v1::OdometryPose { odometry_from_robot }));
            let Some(ranges_m) = &tick.scan else { continue };
            read(Kind::LaserScan(v1::LaserScan::default()));
            scans.push(WayScan { moment: scans.len(), laser: 0, ranges_m: ranges_m[..].into() });
        }
        let laser = robot.laser;
        let geometry = laser.geometry();
        let lasers = vec![TravelLaser { robot_from_sensor: laser.robot_from_laser, geometry }];
        (Way { course: reader.finish(), lasers, scans }, start)
    }

    #[test]
    fn corners_are_told_once_a_pass() {
        let (way, start) = around_the_block();
        let told = with_grid_landmarks(way, |_| ControlFlow::Continue(())).expect("a grid");
        let Told { course, n_stretches, n_doubtful } = told.expect("to the end");
        assert_eq!((n_stretches, n_doubtful), (9, 0), "of 6 m, and all agree");
        let seen = course.moments.iter().flat_map(|moment| {
            let pose = start * moment.place.odometry;
            moment.seen.iter().map(move |seen| pose * seen.robot_from_landmark)
        });
        let seen: Vec<Point2<f64>> = seen.collect();
        // The one where the drive goes on to the end is passed twice.
        for (x_m, y_m, n_passes) in [(14.9, 1.0, 2), (14.9, 8.8, 1), (1.2, 8.8, 1), (1.2, 1.0, 1)] {
            let corner = Point2::new(x_m, y_m);
            let n_seen = seen.iter().filter(|&at| (at - corner).norm() < 0.5).count();
            assert_eq!(n_seen, n_passes, "{corner:?} in {seen:?}");
        }
        assert!(seen.len() <= 8, "a niche besides: {seen:?}");
    }
}
