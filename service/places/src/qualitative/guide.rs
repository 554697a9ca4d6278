//! The explorer behind odometry: a robot fires as often as it likes, and is told what is left of the
//! step that it was told.
//!
//! Firings count for the explorer when the step before is done. That it is done is read off odometry,
//! so that what is told is a function of what the robot sensed and of nothing else: who reads the
//! same firings again tells the same.

use meetpoint_geometry::{Pose, angle_between};

use super::explorer::Explorer;
use super::readings::{Command, Readings};

/// When a step counts as done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideParams {
    /// A turn is done that is off by no more than this, in radians,
    pub turn_slack_rad: f64,
    /// nor by this share of itself; so is a move that lacks no more than this share.
    pub slack_share: f64,
    /// Odometry that changed by less than this since the last firing says that the robot stands, in
    /// metres,
    pub stands_m: f64,
    /// and this, in radians.
    pub stands_rad: f64,
    /// A robot that stood at so many firings in a row has done what it can of a step: something is in
    /// its way. More than it fires before it begins to move, and at least 1.
    pub n_standing_max: u32,
}

impl GuideParams {
    /// For robots that fire some times a second or once after every step, with odometry as wheels
    /// have it.
    pub const WHEELS: Self = Self {
        turn_slack_rad: 0.1,
        slack_share: 0.25,
        stands_m: 0.001,
        stands_rad: 0.002,
        n_standing_max: 5,
    };
}

/// A firing of all around, and where the robot was by its own reckoning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Firing<'a> {
    /// As in [`Readings`].
    pub ranges_m: &'a [f64],
    /// Its angle is by a compass, if the robot has one.
    pub odometry_from_robot: Pose,
    /// As in [`Readings`].
    pub sees_home: bool,
}

/// Guides a robot through its exploration.
#[derive(Clone, Debug)]
pub struct Guide {
    explorer: Explorer,
    params: GuideParams,
    told: Command,
    /// Where the step began that was told; `None` before the first firing.
    from: Option<Pose>,
    last: Option<Pose>,
    n_standing: u32,
    sees_home: bool,
    n_firings: u64,
    n_steps: u64,
}

impl Guide {
    /// Guides that explorer.
    pub fn new(explorer: Explorer, params: GuideParams) -> Self {
        Self {
            explorer,
            params,
            told: Command::Look,
            from: None,
            last: None,
            n_standing: 0,
            sees_home: false,
            n_firings: 0,
            n_steps: 0,
        }
    }

    /// The explorer.
    pub fn explorer(&self) -> &Explorer {
        &self.explorer
    }

    /// The explorer, to be told what people decided.
    pub fn explorer_mut(&mut self) -> &mut Explorer {
        &mut self.explorer
    }

    /// Firings taken in.
    pub fn n_firings(&self) -> u64 {
        self.n_firings
    }

    /// Steps told that were done, or given up.
    pub fn n_steps(&self) -> u64 {
        self.n_steps
    }

    /// Firings in a row at which the robot stood, though it has something to do.
    pub fn n_standing(&self) -> u32 {
        self.n_standing
    }

    /// Takes in the next firing, in the order of time. One whose odometry is not finite says nothing.
    pub fn take_in(&mut self, firing: &Firing) {
        let now = firing.odometry_from_robot;
        if !now.is_finite() {
            return;
        }
        self.n_firings += 1;
        self.sees_home |= firing.sees_home;
        let stands = self.last.is_some_and(|last| {
            let step = last.step_to(now);
            step.distance_m() < self.params.stands_m
                && step.theta_rad.abs() < self.params.stands_rad
        });
        self.last = Some(now);
        self.n_standing = if stands { self.n_standing.saturating_add(1) } else { 0 };
        let is_given_up = self.params.n_standing_max.max(1) <= self.n_standing;
        if !(is_given_up || self.is_done(now)) {
            return;
        }
        let sign = match self.told {
            Command::Move { by_m } => by_m.signum(),
            _ => 1.0,
        };
        let moved_m = self.from.map_or(0.0, |from| sign * from.step_to(now).x_m);
        let heading_rad = now.theta_rad;
        let sees_home = std::mem::take(&mut self.sees_home);
        let readings = Readings { ranges_m: firing.ranges_m, heading_rad, moved_m, sees_home };
        let n_stops = self.explorer.itinerary().stops().len();
        self.told = self.explorer.next(&readings);
        self.explorer.itinerary_mut().stopped_at(n_stops, now);
        self.from = Some(now);
        self.n_standing = 0;
        self.n_steps += 1;
    }

    fn is_done(&self, now: Pose) -> bool {
        let (Some(from), params) = (self.from, &self.params) else { return true };
        match self.told {
            Command::Turn { by_rad } => {
                let slack_rad = params.turn_slack_rad.min(params.slack_share * by_rad.abs());
                let off_rad = angle_between(now.theta_rad, from.theta_rad + by_rad).abs();
                off_rad <= slack_rad
            }
            Command::Move { by_m } => {
                let went_m = by_m.signum() * from.step_to(now).x_m;
                (1.0 - params.slack_share) * by_m.abs() <= went_m
            }
            Command::Look | Command::Done => true,
        }
    }

    /// What is left of the step that was told last; [`Command::Look`] before the first firing.
    pub fn next(&self) -> Command {
        let (Some(from), Some(now)) = (self.from, self.last) else { return Command::Look };
        match self.told {
            Command::Turn { by_rad } => {
                Command::Turn { by_rad: angle_between(now.theta_rad, from.theta_rad + by_rad) }
            }
            Command::Move { by_m } => Command::Move { by_m: by_m - from.step_to(now).x_m },
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::qualitative::ExplorerParams;

    fn guide() -> Guide {
        Guide::new(Explorer::new(ExplorerParams::NX), GuideParams::WHEELS)
    }

    /// In a corridor of 2 m along x.
    fn corridor(heading_rad: f64) -> Vec<f64> {
        let range_m = |index: i32| {
            let across = (heading_rad + TAU * f64::from(index) / 16.0).sin();
            (1.0 / across.abs().max(0.01)).min(6.0)
        };
        (0..16).map(range_m).collect()
    }

    fn fire(guide: &mut Guide, x_m: f64, theta_rad: f64) -> Command {
        let ranges_m = corridor(theta_rad);
        let odometry_from_robot = Pose::new(x_m, 0.0, theta_rad);
        guide.take_in(&Firing { ranges_m: &ranges_m, odometry_from_robot, sees_home: false });
        guide.next()
    }

    #[test]
    fn a_step_under_way_is_told_what_is_left_of_it() {
        let mut guide = guide();
        assert_eq!(guide.next(), Command::Look, "nothing was read yet");
        let Command::Move { by_m } = fire(&mut guide, 0.0, 0.0) else { panic!("ahead") };
        let Command::Move { by_m: rest_m } = fire(&mut guide, 0.05, 0.0) else { panic!("on") };
        assert!((rest_m - (by_m - 0.05)).abs() < 1e-12, "{rest_m} m of {by_m} m");
        assert_eq!(guide.n_steps(), 1, "the step goes on");
        fire(&mut guide, by_m, 0.0);
        assert_eq!((guide.n_steps(), guide.n_firings()), (2, 3), "done");
    }

    #[test]
    fn a_robot_that_stands_is_believed_in_the_end() {
        let mut guide = guide();
        let told = fire(&mut guide, 0.0, 0.0);
        for _ in 1..GuideParams::WHEELS.n_standing_max {
            assert_eq!(fire(&mut guide, 0.0, 0.0), told, "it may not have begun");
        }
        assert_eq!(guide.n_steps(), 1, "not yet");
        fire(&mut guide, 0.0, 0.0);
        assert_eq!(guide.n_steps(), 2, "something is in its way");
    }

    #[test]
    fn what_is_no_number_is_not_taken_in() {
        let mut guide = guide();
        fire(&mut guide, f64::NAN, 0.0);
        assert_eq!(guide.n_firings(), 0, "it says nothing");
    }
}
