//! One session on the map: from each observation to the robot's pose.

use meetpoint_geometry::{Point2, Pose, angle_between};
use meetpoint_occupancy::Grid;

use crate::descent::{Descent, descend};
use crate::field::Field;
use crate::observation::SessionConfig;
use crate::odometry::{Odometry, seconds_between};
use crate::params::{MappingParams, MatchParams};
use crate::points::thinned;
use crate::search::{Candidate, Prior, Window, best_in_window};

/// What is remembered of a session.
#[derive(Clone, Debug)]
pub(crate) struct Tracker {
    pub(crate) config: SessionConfig,
    pub(crate) odometry: Odometry,
    pub(crate) state: TrackState,
}

/// Where the robot is and how it came there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrackState {
    /// Pose at the last scan, or the start.
    pub(crate) map_from_robot: Pose,
    /// Odometry at the last scan, if it is chained to what comes.
    pub(crate) odometry_from_robot: Option<Pose>,
    /// Stamp of the last scan.
    pub(crate) stamp_ns: Option<i64>,
    /// Step between the last two scans, and the seconds that it took.
    pub(crate) last_step: Option<(Pose, f64)>,
    /// Pose at which the last scan was drawn.
    pub(crate) drawn_at: Option<Pose>,
    /// Usual agreement of a scan with the map.
    pub(crate) usual: Option<f64>,
    /// Scans since the map last agreed.
    pub(crate) n_lost: u32,
    /// True if the next scan may be anywhere near.
    pub(crate) adrift: bool,
}

/// What became of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracked {
    pub(crate) map_from_robot: Pose,
    pub(crate) draw: bool,
}

impl Tracker {
    pub(crate) fn new(config: SessionConfig) -> Self {
        let start = config.map_from_start;
        let state = TrackState {
            map_from_robot: if start.is_finite() { start } else { Pose::IDENTITY },
            odometry_from_robot: None,
            stamp_ns: None,
            last_step: None,
            drawn_at: None,
            usual: None,
            n_lost: 0,
            adrift: true,
        };
        Self { config, odometry: Odometry::default(), state }
    }

    /// Forgets how the odometry was chained to the map.
    pub(crate) fn break_odometry(&mut self) {
        self.odometry.clear();
        self.state.odometry_from_robot = None;
        self.state.last_step = None;
        self.state.adrift = true;
    }

    /// The pose at a moment by odometry alone.
    pub(crate) fn predicted(&self, stamp_ns: i64) -> Pose {
        let odometry = self.odometry.pose_at(stamp_ns);
        let step = self.state.odometry_from_robot.zip(odometry).map(|(a, b)| a.step_to(b));
        let pose = self.state.map_from_robot * step.unwrap_or(Pose::IDENTITY);
        if pose.is_finite() { pose } else { self.state.map_from_robot }
    }

    /// Takes a scan: matches its points (in the robot's frame) and says whether to draw it.
    pub(crate) fn track(
        &mut self,
        stamp_ns: i64,
        points: &[Point2<f64>],
        (grid, field): (&Grid, &Field),
        params: &MappingParams,
    ) -> Tracked {
        let odometry = self.odometry.pose_at(stamp_ns);
        let predicted = self.predicted(stamp_ns);
        let moved = self.state.map_from_robot.step_to(predicted);
        let search_points = thinned(points, params.matching.n_search_points_max);
        let window = tracking_window(predicted, moved, &params.matching);
        let prior = Prior {
            center: predicted,
            gain_per_m2: params.matching.odometry_gain_per_m2,
            gain_per_rad2: params.matching.odometry_gain_per_rad2,
            loss_max: params.matching.odometry_loss_max,
        };
        let mut best = best_in_window(field, &search_points, &window, &prior);
        for other in self.other_predictions(stamp_ns, predicted) {
            let window = tracking_window(other, moved, &params.matching);
            let found = best_in_window(field, &search_points, &window, &prior);
            if found.score > best.score {
                best = found;
            }
        }
        let Candidate { pose, .. } = best;
        let Descent { pose, agreement } =
            descend(field, points, pose, &prior, params.matching.n_iterations_max);
        let _ = (grid, agreement);
        let draw = self.moved_since_drawn(pose, params);
        let dt = self.state.stamp_ns.map(|before| seconds_between(before, stamp_ns));
        self.state.last_step =
            dt.filter(|&dt| dt > 0.0).map(|dt| (self.state.map_from_robot.step_to(pose), dt));
        self.state.map_from_robot = pose;
        self.state.odometry_from_robot = odometry;
        self.state.stamp_ns = Some(stamp_ns);
        self.state.adrift = false;
        if draw {
            self.state.drawn_at = Some(pose);
        }
        Tracked { map_from_robot: pose, draw }
    }

    /// Predictions that do without the odometry of this step, where they differ from it.
    fn other_predictions(&self, stamp_ns: i64, predicted: Pose) -> Vec<Pose> {
        let here = self.state.map_from_robot;
        let mut others = vec![here];
        if let (Some((step, seconds)), Some(before)) = (self.state.last_step, self.state.stamp_ns) {
            let share = seconds_between(before, stamp_ns) / seconds;
            if share.is_finite() && 0.0 < share && share < 4.0 {
                others.push(here * Pose::IDENTITY.interpolate(step, share));
            }
        }
        others.retain(|other| {
            let way = predicted.step_to(*other);
            way.distance_m() > 0.15 || way.theta_rad.abs() > 0.06
        });
        others
    }

    fn moved_since_drawn(&self, pose: Pose, params: &MappingParams) -> bool {
        self.state.drawn_at.is_none_or(|drawn| {
            let turn = angle_between(drawn.theta_rad, pose.theta_rad).abs();
            params.trust.draw_distance_m <= drawn.step_to(pose).distance_m()
                || params.trust.draw_turn_rad <= turn
        })
    }
}

fn tracking_window(center: Pose, moved: Pose, params: &MatchParams) -> Window {
    Window {
        center,
        half_m: params.search_half_m + params.search_half_per_m * moved.distance_m(),
        half_rad: params.search_half_rad + params.search_half_per_rad * moved.theta_rad.abs(),
        step_rad: params.search_step_rad,
    }
}
