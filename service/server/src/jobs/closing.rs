//! Loops closed while robots drive.
//!
//! When a robot has come back near a place that it saw long before on its way, how far its pose is off
//! by then is open: live mapping looks for it no farther than a step errs. Then a relaxation is started
//! that goes on from the last one, behind all other jobs and on a small share of a core; what it finds is
//! a decision of the journal like that of any other. When it is started depends on the clock; what the
//! map is drawn by, on the journal alone. What is delivered late, or from a file, is left to the relaxation
//! in full that follows: nobody drives by it.

use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};

use meetpoint_geometry::Point2;
use meetpoint_proto::v1;
use meetpoint_storage::{JobState, MapId, SessionState};
use tokio::sync::broadcast::error::RecvError;

use crate::convert::job::RELAX;
use crate::live::Event;
use crate::{error::Error, service::Service};

/// Behind what people ask for, with room for more below.
const PRIORITY: i32 = -50;
/// Newest jobs of a map among which one that is not done is looked for.
const N_JOBS_READ: u32 = 20;
/// Edge of the squares by which places are remembered, in metres: what a robot sees at once.
const SQUARE_M: f64 = 4.0;
/// Places with less way between them are not worth a look, in metres: live mapping still has their
/// walls in view, or saw them a corner ago.
const WAY_BETWEEN_MIN_M: f64 = 30.0;
/// Way that a robot drives along what it saw before, until there is enough of it to tell one place from
/// another, in metres: several submaps, two of which must say the same.
const SEEN_AGAIN_MIN_M: f64 = 25.0;
/// A place is seen again from this far, in metres: as far as closures are looked for.
const REACH_M: f64 = 5.0;
/// How far a pose may be off for each metre of the way: more than live mapping drifts along corridors.
const DRIFT_SHARE: f64 = 0.03;
/// No pose is farther off, in metres: as far as closures are looked for.
const DRIFT_MAX_M: f64 = 8.0;
/// The pace of a session is taken over this: a few batches.
const PACE_OVER: Duration = Duration::from_secs(5);

/// Starts relaxations until the service stops.
pub(crate) async fn watch(service: Service) {
    let settings = &service.settings.jobs;
    let (way_min_m, pace_max) = (settings.closing_way_m, settings.closing_pace_max);
    if way_min_m <= 0.0 {
        return;
    }
    let mut events = service.live.watch();
    let (mut ways, mut due) = (HashMap::<String, Way>::new(), BTreeMap::<MapId, String>::new());
    loop {
        let event = tokio::select! {
            event = events.recv() => event,
            () = service.stop.cancelled() => return,
        };
        match event {
            Ok((map, Event::Correction(v1::SessionCorrection { session, correction }))) => {
                let Some(correction) = correction else { continue };
                let way = ways.entry(session.clone()).or_default();
                way.keep_pace(correction.stamp_ns, Instant::now());
                let pose = correction.map_from_robot.unwrap_or_default();
                let comes_back = way.comes_back(Point2::new(pose.x_m, pose.y_m), way_min_m);
                if comes_back && way.pace <= pace_max {
                    due.insert(map, session);
                }
            }
            Ok((_, Event::Session(session))) => {
                if session.state != i32::from(v1::SessionState::Open) {
                    ways.remove(&session.id);
                }
            }
            // The job begins with the poses of the newest version.
            Ok((map, Event::Version(_))) => {
                let Some(session) = due.remove(&map) else { continue };
                match start(&service, map, &session).await {
                    Ok(true) => ways.entry(session).or_default().relaxed(),
                    Ok(false) => {}
                    Err(error) => error.log(),
                }
            }
            // What was left out of a way is made up for by what comes.
            Ok(_) | Err(RecvError::Lagged(_)) => {}
            Err(RecvError::Closed) => return,
        }
    }
}

/// Starts a relaxation of a map on which a session has come back; false if there is no need.
async fn start(service: &Service, map: MapId, session: &str) -> Result<bool, Error> {
    let record = service.session_record(session).await?;
    if record.map_from_session.is_none() || record.state != SessionState::Open {
        return Ok(false);
    }
    let is_at_work = |state| matches!(state, JobState::Queued | JobState::Running);
    let jobs = service.store.jobs(Some(&map), None, N_JOBS_READ).await?;
    if jobs.iter().any(|job| job.kind == RELAX && is_at_work(job.state)) {
        return Ok(false);
    }
    let params = v1::RelaxParams { going_on: true, ..v1::RelaxParams::default() };
    let request = v1::CreateJobRequest {
        map: map.0,
        kind: v1::JobKind::Relax.into(),
        priority: PRIORITY,
        params: Some(v1::create_job_request::Params::Relax(params)),
    };
    service.create_job(request).await?;
    Ok(true)
}

/// The way of a session as far as the robot was told of it.
#[derive(Debug)]
struct Way {
    /// Seconds of the robot's clock that come in a second; infinite as long as nobody knows.
    pace: f64,
    /// A stamp of the robot's clock in nanoseconds, and when it came.
    pace_since: Option<(i64, Instant)>,
    at: Option<Point2<f64>>,
    driven_m: f64,
    /// Way until the last relaxation was started, in metres.
    relaxed_m: f64,
    /// Way since then along what the robot had seen long before, in metres.
    seen_again_m: f64,
    /// For each square the way until the robot first was there, in metres.
    squares: BTreeMap<(i64, i64), f64>,
}

impl Default for Way {
    fn default() -> Self {
        Self {
            pace: f64::INFINITY,
            pace_since: None,
            at: None,
            driven_m: 0.0,
            relaxed_m: 0.0,
            seen_again_m: 0.0,
            squares: BTreeMap::new(),
        }
    }
}

impl Way {
    /// Notes how fast a session comes in.
    fn keep_pace(&mut self, stamp_ns: i64, now: Instant) {
        let (since_ns, since) = *self.pace_since.get_or_insert((stamp_ns, now));
        let passed = now.saturating_duration_since(since);
        if PACE_OVER <= passed {
            self.pace = stamp_ns.saturating_sub(since_ns) as f64 * 1e-9 / passed.as_secs_f64();
            self.pace_since = Some((stamp_ns, now));
        }
    }

    /// Goes on to a place. True if the robot has come back and driven on there, and `way_min_m` since the last
    /// relaxation.
    fn comes_back(&mut self, at: Point2<f64>, way_min_m: f64) -> bool {
        if !(at.x.is_finite() && at.y.is_finite()) {
            return false;
        }
        let step_m = self.at.map_or(0.0, |before| (at - before).norm());
        self.driven_m += step_m;
        self.at = Some(at);
        let here = square(at);
        self.squares.entry(here).or_insert(self.driven_m);
        if self.is_known(here) {
            self.seen_again_m += step_m;
        }
        let is_far = way_min_m <= self.driven_m - self.relaxed_m;
        is_far && SEEN_AGAIN_MIN_M <= self.seen_again_m
    }

    /// True if the robot may see what it saw long before.
    fn is_known(&self, (x, y): (i64, i64)) -> bool {
        let far = square(Point2::new(REACH_M + DRIFT_MAX_M, 0.0)).0 + 1;
        let rows = self.squares.range((x - far, i64::MIN)..=(x + far, i64::MAX));
        let (mut rows, radius) = (rows.filter(|((_, row), _)| (row - y).abs() <= far), SQUARE_M);
        rows.any(|(&(column, row), &before_m)| {
            let way_m = self.driven_m - before_m;
            let off_m = (DRIFT_SHARE * way_m).min(DRIFT_MAX_M);
            let away_m = radius * ((column - x) as f64).hypot((row - y) as f64);
            WAY_BETWEEN_MIN_M <= way_m && away_m <= REACH_M + off_m
        })
    }

    fn relaxed(&mut self) {
        self.relaxed_m = self.driven_m;
        self.seen_again_m = 0.0;
    }
}

/// The square in which a place lies.
#[expect(clippy::cast_possible_truncation, reason = "places far outside of any map count as one")]
fn square(at: Point2<f64>) -> (i64, i64) {
    let along = |metres: f64| (metres / SQUARE_M).floor().clamp(-1e9, 1e9) as i64;
    (along(at.x), along(at.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places a metre apart around a block of so many metres, as often as asked.
    fn around(edge_m: i32, n_rounds: usize) -> impl Iterator<Item = Point2<f64>> {
        let side = (0..edge_m).map(f64::from).collect::<Vec<f64>>();
        let edge = f64::from(edge_m);
        let points = [
            side.iter().map(|&s| Point2::new(s, 0.0)).collect::<Vec<_>>(),
            side.iter().map(|&s| Point2::new(edge, s)).collect(),
            side.iter().map(|&s| Point2::new(edge - s, edge)).collect(),
            side.iter().map(|&s| Point2::new(0.0, edge - s)).collect(),
        ];
        let round: Vec<Point2<f64>> = points.concat();
        std::iter::repeat_n(round, n_rounds).flatten()
    }

    #[test]
    fn a_robot_comes_back_at_the_end_of_a_round() {
        let mut way = Way::default();
        let back = around(40, 2).position(|at| way.comes_back(at, 40.0)).expect("it comes back");
        assert!((165..195).contains(&back), "when it has driven on a while: after {back} m");
        way.relaxed();
        let again = around(40, 2).skip(back).position(|at| way.comes_back(at, 40.0));
        assert!(again.is_some_and(|more| 38 < more), "not at every step: {again:?}");
    }

    #[test]
    fn what_comes_faster_than_robots_drive_is_told() {
        let (mut way, begun) = (Way::default(), Instant::now());
        assert!(way.pace.is_infinite(), "nobody knows");
        for second in 0..12_u32 {
            let now = begun + Duration::from_secs(u64::from(second));
            way.keep_pace(i64::from(second) * 20_000_000_000, now);
        }
        assert!((way.pace - 20.0).abs() < 1e-9, "twenty times as fast: {}", way.pace);
    }

    #[test]
    fn who_drives_on_does_not_come_back() {
        let mut way = Way::default();
        let comes = (0..500).any(|x| way.comes_back(Point2::new(f64::from(x), 0.0), 40.0));
        assert!(!comes, "a long corridor");
        let there_and_back = (0..20).chain((0..20).rev()).cycle().take(39);
        let mut way = Way::default();
        let comes =
            there_and_back.map(f64::from).any(|x| way.comes_back(Point2::new(x, 0.0), 40.0));
        assert!(!comes, "not far enough");
        assert!(!way.comes_back(Point2::new(f64::NAN, 0.0), 0.0), "nowhere");
    }
}
