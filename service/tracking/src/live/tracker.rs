//! One session on the map: from each observation to the robot's pose.

use std::f64::consts::PI;

use meetpoint_geometry::{Pose, angle_between};

use crate::live::matcher::{Chart, Match, Matcher};
use crate::live::observation::{SensorKind, SessionConfig};
use crate::live::odometry::{Odometry, seconds_between};
use crate::matching::points::ScanPoint;
use crate::matching::search::Window;
use crate::params::{MappingParams, MatchParams, SonarParams, TrustParams};
use crate::position::wall_orientation::WallOrientation;

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
    /// Pose at which the last firing of sonars was drawn.
    pub(crate) heard_at: Option<Pose>,
    /// Usual agreement of a scan with the map.
    pub(crate) usual: Option<f64>,
    /// Agreement of the last scan.
    pub(crate) agreement: f64,
    /// Scans since the map last agreed.
    pub(crate) n_lost: u32,
    /// True if the next scan may be anywhere near.
    pub(crate) adrift: bool,
    /// What walls heard by sonar tell of the building.
    pub(crate) walls: WallOrientation,
}

/// What became of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tracked {
    pub(crate) map_from_robot: Pose,
    pub(crate) draw: bool,
}

/// How far the map can be asked where the robot is.
enum Found {
    /// The robot is where the match says.
    Here(Match),
    /// The map does not reach here: the prediction stands.
    Unmapped,
    /// The map should know, and agrees nowhere.
    Nowhere,
}

/// A standing robot's odometry moves by no more than this between two scans, in metres and
/// radians.
const STANDING_MAX: f64 = 1e-3;

/// A standing robot's scan agrees as well as the one before but for this.
const STANDING_LOSS_MAX: f64 = 0.03;

/// A prediction nearer than this to another needs no search of its own, in metres...
const APART_MIN_M: f64 = 0.15;

/// ...and radians.
const APART_MIN_RAD: f64 = 0.06;

/// A step is not thought to go on for longer than so many times what it took.
const STEP_SHARE_MAX: f64 = 4.0;

impl Tracker {
    pub(crate) fn new(config: SessionConfig) -> Self {
        let start = config.map_from_start;
        let state = TrackState {
            map_from_robot: if start.is_finite() { start } else { Pose::IDENTITY },
            odometry_from_robot: None,
            stamp_ns: None,
            last_step: None,
            drawn_at: None,
            heard_at: None,
            usual: None,
            agreement: 0.0,
            n_lost: 0,
            adrift: true,
            walls: WallOrientation::default(),
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

    /// The step since the last scan by odometry, or `None` without.
    fn step_by_odometry(&self, stamp_ns: i64) -> Option<Pose> {
        let odometry = self.odometry.pose_at(stamp_ns)?;
        let step = self.state.odometry_from_robot?.step_to(odometry);
        step.is_finite().then_some(step)
    }

    /// The step since the last scan if the one before it goes on for as long as stamps say, or `None` if
    /// there was none.
    fn step_by_momentum(&self, stamp_ns: i64) -> Option<Pose> {
        let (step, seconds) = self.state.last_step?;
        let share = seconds_between(self.state.stamp_ns?, stamp_ns) / seconds;
        let goes_on = 0.0 < share && share < STEP_SHARE_MAX;
        goes_on.then(|| Pose::IDENTITY.interpolate(step, share))
    }

    /// The pose at a moment from what came before: by odometry, or without it one step on: lasers turn
    /// evenly, whatever stamps say that were made when scans had come to a computer.
    pub(crate) fn predicted(&self, stamp_ns: i64) -> Pose {
        let here = self.state.map_from_robot;
        let one_on = || self.state.last_step.map(|(step, _)| step);
        let step = self.step_by_odometry(stamp_ns).or_else(one_on);
        let pose = here * step.unwrap_or(Pose::IDENTITY);
        if pose.is_finite() { pose } else { here }
    }

    /// Predictions that do without the odometry of this step, where they differ from it.
    fn other_predictions(&self, stamp_ns: i64, predicted: Pose) -> Vec<Pose> {
        let here = self.state.map_from_robot;
        let onwards = self.step_by_momentum(stamp_ns).map(|step| here * step);
        let apart = |other: &Pose| {
            let way = predicted.step_to(*other);
            APART_MIN_M < way.distance_m() || APART_MIN_RAD < way.theta_rad.abs()
        };
        [Some(here), onwards].into_iter().flatten().filter(apart).collect()
    }

    /// True if nothing but its own reckoning tells where the robot is.
    pub(crate) fn is_reckoned(&self) -> bool {
        !self.config.sensors.iter().any(|sensor| matches!(sensor.kind, SensorKind::Laser(_)))
    }

    /// Chains the odometry that has just come to where the robot is, if it is not chained yet.
    pub(crate) fn chain_odometry(&mut self, stamp_ns: i64) {
        if self.state.odometry_from_robot.is_none() {
            self.settle(stamp_ns, self.state.map_from_robot, 0);
        }
    }

    /// Goes on by reckoning alone.
    pub(crate) fn reckon(&mut self, stamp_ns: i64) {
        self.settle(stamp_ns, self.predicted(stamp_ns), 0);
    }

    /// Puts the robot where it is known to be, and says whether a scan is to be drawn there.
    pub(crate) fn place(&mut self, stamp_ns: i64, pose: Pose, trust: &TrustParams) -> bool {
        let draw = self.moved_since_drawn(pose, trust);
        self.settle(stamp_ns, pose, 0);
        self.state.adrift = false;
        draw
    }

    /// Moves the robot to where it was found at the moment that it was last settled at.
    pub(crate) fn correct(&mut self, pose: Pose) {
        self.state.map_from_robot = pose;
        self.state.heard_at = Some(pose);
    }

    /// Takes a scan: matches its points (in the robot's frame) and says whether to draw it.
    pub(crate) fn track(
        &mut self,
        stamp_ns: i64,
        points: &[ScanPoint],
        chart: Chart<'_>,
        params: &MappingParams,
    ) -> Tracked {
        let predicted = self.predicted(stamp_ns);
        let trust = &params.trust;
        if points.is_empty() {
            self.settle(stamp_ns, predicted, self.state.n_lost);
            return Tracked { map_from_robot: predicted, draw: false };
        }
        let usual = self.state.usual.unwrap_or(trust.usual_agreement_start);
        let matcher = Matcher::new(points, (predicted, self.state.adrift), chart, params);
        let (pose, sure, n_lost) = match self.find(stamp_ns, predicted, &matcher, params) {
            Found::Here(found) => {
                self.state.usual = Some(usual + trust.usual_weight * (found.agreement - usual));
                self.state.agreement = found.agreement;
                self.state.adrift = false;
                (found.pose, trust.draw_share * usual <= found.agreement, 0)
            }
            Found::Unmapped => (predicted, true, 0),
            Found::Nowhere => (predicted, false, self.state.n_lost.saturating_add(1)),
        };
        let draw = sure && self.moved_since_drawn(pose, trust);
        self.settle(stamp_ns, pose, n_lost);
        if draw {
            self.state.drawn_at = Some(pose);
        }
        Tracked { map_from_robot: pose, draw }
    }

    /// Searches about the predictions, and wider while what is found agrees less than is usual.
    fn find(
        &self,
        stamp_ns: i64,
        predicted: Pose,
        matcher: &Matcher<'_>,
        params: &MappingParams,
    ) -> Found {
        let MappingParams { matching, trust, .. } = params;
        let usual = self.state.usual.unwrap_or(trust.usual_agreement_start);
        let others = self.other_predictions(stamp_ns, predicted);
        let here = matcher.judged(predicted);
        if self.stands(predicted) && self.state.agreement <= here.agreement + STANDING_LOSS_MAX {
            return Found::Here(here);
        }
        let reaches = |found: &Match| trust.known_share_min <= found.known_share;
        let chained = !self.state.adrift || self.state.stamp_ns.is_none();
        let mapped = reaches(&here) || others.iter().any(|&other| reaches(&matcher.judged(other)));
        if chained && self.state.n_lost == 0 && !mapped {
            return Found::Unmapped;
        }
        let moved = self.state.map_from_robot.step_to(predicted);
        let mut best = matcher.descended(predicted);
        if self.state.adrift || best.agreement < trust.search_share * usual {
            let found = matcher.best(tracking_window(predicted, moved, matching), &others);
            best = better(best, found);
        }
        let certain = |found: &Match| trust.doubt_share * usual <= found.agreement;
        if self.state.adrift || !certain(&best) {
            let window = wide_window(predicted, trust.doubt_half_m, trust.doubt_half_rad, trust);
            best = better(best, matcher.best(window, &others));
        }
        let poor = best.agreement < trust.wide_share * usual;
        if (self.state.adrift || poor) && self.searches_widely(trust) {
            let window = self.lost_window(predicted, trust);
            let found = matcher.best_widely(window, trust.lost_share * usual);
            if certain(&found) {
                best = better(best, found);
            }
        }
        let share_min = if self.state.adrift { trust.adrift_share } else { trust.lost_share };
        let lost = !reaches(&best) || best.agreement < share_min * usual;
        if lost { Found::Nowhere } else { Found::Here(best) }
    }

    /// True if odometry says that the robot stands where it was found.
    fn stands(&self, predicted: Pose) -> bool {
        let step = self.state.map_from_robot.step_to(predicted);
        !self.state.adrift
            && self.state.n_lost == 0
            && self.state.odometry_from_robot.is_some()
            && step.distance_m() < STANDING_MAX
            && step.theta_rad.abs() < STANDING_MAX
    }

    fn searches_widely(&self, trust: &TrustParams) -> bool {
        let n_lost = self.state.n_lost;
        n_lost < trust.n_lost_scans_max || n_lost.is_multiple_of(trust.n_lost_scans_max.max(1))
    }

    fn lost_window(&self, predicted: Pose, trust: &TrustParams) -> Window {
        let n_lost = self.state.n_lost;
        let half_m = trust.lost_half_m + trust.lost_half_growth_m * f64::from(n_lost);
        let half_rad = if n_lost < 2 { trust.lost_half_rad } else { PI };
        wide_window(predicted, half_m.min(trust.lost_half_max_m), half_rad, trust)
    }

    fn settle(&mut self, stamp_ns: i64, pose: Pose, n_lost: u32) {
        let state = &mut self.state;
        let seconds = state.stamp_ns.map(|before| seconds_between(before, stamp_ns));
        let step = state.map_from_robot.step_to(pose);
        state.last_step = seconds.filter(|_| n_lost == 0).map(|seconds| (step, seconds));
        state.map_from_robot = pose;
        state.odometry_from_robot = self.odometry.pose_at(stamp_ns);
        state.stamp_ns = Some(stamp_ns);
        state.n_lost = n_lost;
    }

    fn moved_since_drawn(&self, pose: Pose, trust: &TrustParams) -> bool {
        has_moved(self.state.drawn_at, pose, (trust.draw_distance_m, trust.draw_turn_rad))
    }

    /// Whether a firing of sonars heard from that pose is to be drawn, which is noted. Not before a laser
    /// on the robot has found where it is.
    pub(crate) fn hears(&mut self, pose: Pose, sonar: &SonarParams) -> bool {
        let least = (sonar.draw_distance_m, sonar.draw_turn_rad);
        let is_known = self.is_reckoned() || (self.state.n_lost == 0 && !self.state.adrift);
        let draw = is_known && has_moved(self.state.heard_at, pose, least);
        if draw {
            self.state.heard_at = Some(pose);
        }
        draw
    }
}

/// True if a robot moved or turned so far since a pose, or there is none.
fn has_moved(since: Option<Pose>, pose: Pose, (distance_m, turn_rad): (f64, f64)) -> bool {
    since.is_none_or(|since| {
        let turned_rad = angle_between(since.theta_rad, pose.theta_rad).abs();
        distance_m <= since.step_to(pose).distance_m() || turn_rad <= turned_rad
    })
}

/// What was found later must score so much more than what was found nearer to the prediction.
const SCORE_GAIN_MIN: f64 = 0.01;

fn better(a: Match, b: Match) -> Match {
    if a.score + SCORE_GAIN_MIN < b.score { b } else { a }
}

fn tracking_window(center: Pose, moved: Pose, params: &MatchParams) -> Window {
    Window {
        center,
        half_m: params.search_half_m + params.search_half_per_m * moved.distance_m(),
        half_rad: params.search_half_rad + params.search_half_per_rad * moved.theta_rad.abs(),
        step_rad: params.search_step_rad,
    }
}

fn wide_window(center: Pose, half_m: f64, half_rad: f64, trust: &TrustParams) -> Window {
    Window { center, half_m, half_rad, step_rad: trust.wide_step_rad }
}
