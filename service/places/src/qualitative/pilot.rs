//! From a distinctive place to the next, motion by motion (KB 1988, Fig. 2): leave in a direction,
//! follow the edge by the strategy that fits, climb where something is to be maximised.

use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI};

use meetpoint_geometry::{Point2, Vector2, angle_between, wrap_angle};

use super::arrival::Arrival;
use super::control::{Strategy, fitting, steering_rad};
use super::distinctiveness::{Goal, goal};
use super::edge_log::EdgeLog;
use super::firings::Firings;
use super::hill_climb::climb;
use super::outlook::Outlook;
use super::readings::{Command, Readings};
use super::ring::Ring;
use super::surroundings::{Scale, Surroundings, surroundings};

/// How the pilot moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotParams {
    /// Lengths of the environment.
    pub scale: Scale,
    /// A small step, in metres.
    pub step_m: f64,
    /// Steps made blindly out of a place, in metres: as far as its own walls mislead.
    pub leave_m: f64,
    /// Firings that are averaged on the way; at least 1, as the other two.
    pub n_firings_under_way: usize,
    /// Firings that are averaged before a step of the hill-climb.
    pub n_firings_climb: usize,
    /// Firings that are averaged at a place, twice: once turned by half the angle between sonars.
    pub n_firings_survey: usize,
    /// A step of the hill-climb that is shorter says that the place is reached, in metres.
    pub summit_m: f64,
    /// Steps of one hill-climb, at most.
    pub n_climb_max: u32,
}

impl PilotParams {
    /// For corridors of about 2 m.
    pub const CORRIDORS_OF_2_M: Self = Self {
        scale: Scale::CORRIDORS_OF_2_M,
        step_m: 0.15,
        leave_m: 1.2,
        n_firings_under_way: 4,
        n_firings_climb: 4,
        n_firings_survey: 6,
        summit_m: 0.08,
        n_climb_max: 30,
    };
}

/// What the pilot has to say.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// A motion to be made.
    Under(Command),
    /// A distinctive place is reached.
    Arrived(Box<Arrival>),
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    /// On the way out of a place, straight on.
    Leaving { heading_rad: f64, left_m: f64 },
    /// On an edge; for so many metres no place is looked for.
    Following { quiet_m: f64 },
    /// Near a place, which was noticed while travelling along `entry_rad`.
    Climbing { entry_rad: f64, from: Point2<f64>, n_steps: u32, n_passages: u32 },
    /// At its summit.
    Surveying { entry_rad: f64, from: Point2<f64>, n_steps: u32 },
}

/// Moves from place to place.
#[derive(Clone, Debug)]
pub(crate) struct Pilot {
    params: PilotParams,
    /// That of the corridors around here.
    scale: Scale,
    /// Their width, as measured so far, in metres.
    width_m: f64,
    doing: Doing,
    /// Commands that were decided and not yet given.
    queue: VecDeque<Command>,
    last: Command,
    firings: Firings,
    /// Where the robot is by dead reckoning, since whenever.
    position: Point2<f64>,
    heading_rad: f64,
    /// What the robot's own headings are ahead of the frame in which it thinks.
    frame_rad: f64,
    sees_home: bool,
    /// Where the last place was left and whereto, and how far the first steps go blindly.
    origin: Option<(Point2<f64>, f64, f64)>,
    /// Steps in a row that something distinctive was noticed.
    n_noticed: u32,
    /// Firings since the robot moved last.
    n_fired_here: usize,
    log: EdgeLog,
}

/// A place this near to where the robot left is the one that it left, in metres.
const SAME_PLACE_M: f64 = 1.1;
/// Nearer things ahead are in the way, in metres: no place is as narrow.
const BLOCKED_M: f64 = 0.5;
/// Steps in a row that must notice something.
const N_NOTICED: u32 = 2;

impl Pilot {
    /// A pilot that looks for its first place.
    pub(crate) fn new(params: PilotParams) -> Self {
        let params = PilotParams {
            n_firings_under_way: params.n_firings_under_way.max(1),
            n_firings_climb: params.n_firings_climb.max(1),
            n_firings_survey: params.n_firings_survey.max(1),
            ..params
        };
        let n_kept = params.n_firings_under_way.max(params.n_firings_climb);
        let n_kept = n_kept.max(2 * params.n_firings_survey);
        Self {
            params,
            scale: params.scale,
            width_m: params.scale.open_m / 1.05,
            doing: Doing::Following { quiet_m: 0.0 },
            queue: VecDeque::new(),
            last: Command::Look,
            firings: Firings::new(n_kept, params.scale.range_max_m),
            position: Point2::origin(),
            heading_rad: 0.0,
            frame_rad: 0.0,
            sees_home: false,
            origin: None,
            n_noticed: 0,
            n_fired_here: 0,
            log: EdgeLog::default(),
        }
    }

    /// Where the robot looks.
    pub(crate) fn heading_rad(&self) -> f64 {
        self.heading_rad
    }

    /// Whether the robot still stands at the place where it arrived last.
    pub(crate) fn is_at_place(&self) -> bool {
        matches!(self.doing, Doing::Leaving { .. }) && self.log.length_m == 0.0
    }

    /// Says where the robot is.
    pub(crate) fn set_position(&mut self, position: Point2<f64>) {
        self.position = position;
    }

    /// Turns the frame of headings counter-clockwise: places seemed turned by so much.
    pub(crate) fn turn_frame(&mut self, by_rad: f64) {
        self.frame_rad += by_rad;
        self.heading_rad = wrap_angle(self.heading_rad - by_rad);
        self.firings.turn_frame(by_rad);
    }

    /// Leaves a place.
    pub(crate) fn leave(&mut self, heading_rad: f64) {
        self.leave_for(heading_rad, self.params.leave_m);
    }

    fn leave_for(&mut self, heading_rad: f64, left_m: f64) {
        self.log = EdgeLog::default();
        self.origin = Some((self.position, heading_rad, left_m));
        self.doing = Doing::Leaving { heading_rad, left_m };
        self.n_noticed = 0;
    }

    /// Takes in what is read, and says what comes next.
    pub(crate) fn next(&mut self, readings: &Readings) -> Outcome {
        if readings.ranges_m.is_empty() {
            return Outcome::Under(Command::Look);
        }
        self.take_in(readings);
        while self.queue.is_empty() {
            let arrival = match self.doing {
                Doing::Leaving { heading_rad, left_m } => self.step_out(heading_rad, left_m),
                Doing::Following { quiet_m } => self.step_on(quiet_m),
                Doing::Climbing { .. } => self.step_up(),
                Doing::Surveying { .. } => self.surveyed(),
            };
            if let Some(arrival) = arrival {
                return Outcome::Arrived(Box::new(arrival));
            }
        }
        self.last = self.queue.pop_front().unwrap_or(Command::Look);
        Outcome::Under(self.last)
    }

    fn take_in(&mut self, readings: &Readings) {
        let heading_rad = wrap_angle(readings.heading_rad - self.frame_rad);
        let turned_rad = angle_between(self.heading_rad, heading_rad);
        self.heading_rad = heading_rad;
        let sign = match self.last {
            Command::Move { by_m } => by_m.signum(),
            _ => 1.0,
        };
        let step_m = sign * readings.moved_m;
        self.position += towards(self.heading_rad) * step_m;
        if matches!(self.doing, Doing::Leaving { .. } | Doing::Following { .. }) {
            self.log.length_m += step_m;
            self.log.turned_rad += turned_rad;
        }
        if matches!(self.doing, Doing::Surveying { .. }) {
            self.sees_home |= readings.sees_home;
        }
        self.n_fired_here = if step_m == 0.0 { self.n_fired_here + 1 } else { 1 };
        self.firings.take_in(heading_rad, readings.ranges_m);
    }

    /// What the newest firings say; `None` before the first.
    pub(crate) fn outlook(&self) -> Option<Outlook> {
        let ring = self.ring_under_way()?;
        let n = self.params.n_firings_under_way;
        let before = self.firings.mean_before(self.n_fired_here, n, self.heading_rad);
        Some(Outlook::new(ring, before.as_ref(), self.heading_rad, &self.scale))
    }

    /// What stands around, from the last firings under way.
    fn ring_under_way(&self) -> Option<Ring> {
        self.firings.mean(self.params.n_firings_under_way, self.heading_rad)
    }

    /// Whether something stands right ahead.
    fn is_blocked(&self) -> bool {
        self.ring_under_way().is_some_and(|ring| ring.nearest_m(self.heading_rad, 0.25) < BLOCKED_M)
    }

    fn turn_and_move(&mut self, heading_rad: f64, by_m: f64) {
        let by_rad = angle_between(self.heading_rad, heading_rad);
        if 0.02 < by_rad.abs() {
            self.queue.push_back(Command::Turn { by_rad });
        }
        if by_m != 0.0 {
            self.queue.push_back(Command::Move { by_m });
        }
    }

    fn step_out(&mut self, heading_rad: f64, left_m: f64) -> Option<Arrival> {
        let has_turned = angle_between(self.heading_rad, heading_rad).abs() < 0.1;
        if left_m <= 0.0 || (has_turned && self.is_blocked()) {
            self.doing = Doing::Following { quiet_m: 2.0 * self.params.step_m };
            return None;
        }
        self.doing = Doing::Leaving { heading_rad, left_m: left_m - self.params.step_m };
        self.turn_and_move(heading_rad, self.params.step_m);
        if self.log.length_m == 0.0 {
            // The turn towards the edge is none along it.
            self.log.turned_rad -= angle_between(self.heading_rad, heading_rad);
        }
        None
    }

    fn step_on(&mut self, quiet_m: f64) -> Option<Arrival> {
        let Some(ring) = self.ring_under_way() else {
            self.queue.push_back(Command::Look);
            return None;
        };
        let scale = self.scale;
        let is_noticed = quiet_m <= 0.0 && !surroundings(&ring, &scale).is_passage();
        self.n_noticed = if is_noticed { self.n_noticed + 1 } else { 0 };
        if self.is_blocked() {
            self.n_noticed = N_NOTICED;
        }
        if N_NOTICED <= self.n_noticed {
            let (entry_rad, from) = (self.heading_rad, self.position);
            self.doing = Doing::Climbing { entry_rad, from, n_steps: 0, n_passages: 0 };
            self.look(self.params.n_firings_climb);
            return None;
        }
        let strategy = fitting(&ring, self.heading_rad, &scale);
        let wall_m = |side_rad: f64| ring.wall_m(self.heading_rad + side_rad);
        let width_m = wall_m(FRAC_PI_2) + wall_m(-FRAC_PI_2);
        self.log.step(strategy, width_m);
        if strategy == Strategy::FollowMidline && quiet_m <= 0.0 && !is_noticed {
            self.width_m += 0.1 * (width_m.clamp(1.2, 3.0) - self.width_m);
            self.scale = Scale::of_corridors(self.width_m, scale.range_max_m);
        }
        let turn_rad = steering_rad(strategy, &ring, self.heading_rad, &scale);
        self.doing = Doing::Following { quiet_m: quiet_m - self.params.step_m };
        self.turn_and_move(self.heading_rad + turn_rad, self.params.step_m);
        None
    }

    fn look(&mut self, n: usize) {
        self.queue.extend((0..n).map(|_| Command::Look));
    }

    fn step_up(&mut self) -> Option<Arrival> {
        let Doing::Climbing { entry_rad, from, n_steps, n_passages } = self.doing else {
            return None;
        };
        let ring = self.firings.mean(self.params.n_firings_climb, self.heading_rad)?;
        let scale = self.scale;
        let around = surroundings(&ring, &scale);
        let goal = goal(&around);
        let n_passages = if goal == Goal::Passage { n_passages + 1 } else { 0 };
        self.doing = Doing::Climbing { entry_rad, from, n_steps: n_steps + 1, n_passages };
        if 2 <= n_passages {
            self.pass(&around, entry_rad);
        } else if self.params.n_climb_max <= n_steps {
            self.survey();
        } else {
            match climb(&around, goal, &scale) {
                Some(step) if step.norm() < self.params.summit_m => self.survey(),
                Some(step) => self.climb(step),
                None if goal == Goal::ComeCloser => {
                    let is_free = 0.8 < ring.nearest_m(entry_rad, 0.5);
                    let by_m = if is_free { self.params.step_m } else { 0.0 };
                    self.climb(towards(entry_rad) * by_m);
                }
                None => self.look(self.params.n_firings_climb),
            }
        }
        None
    }

    /// A step in any direction, forwards or backwards, and a look from there.
    fn climb(&mut self, step: Vector2<f64>) {
        let heading_rad = step.y.atan2(step.x);
        let is_behind = FRAC_PI_2 < angle_between(self.heading_rad, heading_rad).abs();
        let (heading_rad, sign) =
            if is_behind { (wrap_angle(heading_rad + PI), -1.0) } else { (heading_rad, 1.0) };
        if 0.0 < step.norm() {
            self.turn_and_move(heading_rad, sign * step.norm());
        }
        self.look(self.params.n_firings_climb);
    }

    /// It was no place: on, along the edge.
    fn pass(&mut self, around: &Surroundings, entry_rad: f64) {
        let onward = around.direction_towards(entry_rad);
        let heading_rad =
            onward.map_or(entry_rad, |(index, _)| around.directions[index].heading_rad);
        self.doing = Doing::Following { quiet_m: 3.0 * self.params.step_m };
        self.n_noticed = 0;
        self.turn_and_move(heading_rad, self.params.step_m);
    }

    fn survey(&mut self) {
        let Doing::Climbing { entry_rad, from, n_steps, .. } = self.doing else { return };
        self.doing = Doing::Surveying { entry_rad, from, n_steps };
        self.sees_home = false;
        let n_sonars = self.firings.n_sonars().max(1);
        self.look(self.params.n_firings_survey);
        self.queue.push_back(Command::Turn { by_rad: PI / n_sonars as f64 });
        self.look(self.params.n_firings_survey - 1);
    }

    /// What the survey says: a place, a passage after all, or that the summit is elsewhere.
    fn surveyed(&mut self) -> Option<Arrival> {
        let Doing::Surveying { entry_rad, from, n_steps } = self.doing else { return None };
        let scale = self.scale;
        let ring = self.firings.survey(self.params.n_firings_survey)?;
        let around = surroundings(&ring, &scale);
        let goal = goal(&around);
        let is_last = self.params.n_climb_max <= n_steps;
        match climb(&around, goal, &scale) {
            Some(step) if step.norm() < 2.5 * self.params.summit_m || is_last => {
                let is_first = self.origin.is_none();
                let arrival = Arrival::new(goal, &around, entry_rad + PI, is_first);
                if arrival.is_some() || is_last {
                    return self.arrived(arrival, entry_rad, from);
                }
            }
            None if goal == Goal::Passage || is_last => {
                self.pass(&around, entry_rad);
                return None;
            }
            _ => {}
        }
        self.doing = Doing::Climbing { entry_rad, from, n_steps: n_steps + 4, n_passages: 0 };
        match climb(&around, goal, &scale) {
            Some(step) => self.climb(step),
            None => self.climb(towards(entry_rad) * self.params.step_m),
        }
        None
    }

    /// At a place that is not the one just left.
    fn arrived(
        &mut self,
        arrival: Option<Arrival>,
        entry_rad: f64,
        from: Point2<f64>,
    ) -> Option<Arrival> {
        self.n_noticed = 0;
        let is_far = |origin: Point2<f64>| SAME_PLACE_M < (self.position - origin).norm();
        match (self.origin, arrival) {
            (Some((origin, heading_rad, left_m)), _) if !is_far(origin) => {
                // Its own walls looked distinctive from outside.
                self.leave_for(heading_rad, 1.4 * left_m);
                None
            }
            (_, Some(mut arrival)) => {
                let climbed_m = (self.position - from).dot(&towards(entry_rad));
                self.log.length_m += climbed_m;
                arrival.traversal = self.origin.map(|_| self.log.traversal());
                arrival.position = self.position;
                arrival.is_home = self.sees_home;
                Some(arrival)
            }
            (_, None) => {
                self.doing = Doing::Following { quiet_m: 3.0 * self.params.step_m };
                self.turn_and_move(entry_rad, 0.0);
                None
            }
        }
    }
}

fn towards(heading_rad: f64) -> Vector2<f64> {
    Vector2::new(heading_rad.cos(), heading_rad.sin())
}
