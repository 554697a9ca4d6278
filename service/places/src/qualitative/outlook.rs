//! What a robot has before it: the measures of the paper, what is to be maximised, the next step of the
//! hill-climb, and the local control strategy that fits.

use meetpoint_geometry::Vector2;

use super::control::{Strategy, fitting, steering_rad};
use super::distinctiveness::{Distinctiveness, Goal, distinctiveness, goal};
use super::hill_climb::climb;
use super::ring::Ring;
use super::surroundings::{Scale, Surroundings, surroundings};

/// All that is read off the newest firings.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlook {
    /// Where the robot looks, in the frame of headings.
    pub heading_rad: f64,
    /// The mean of the newest firings, the first reading where the robot looks.
    pub ring: Ring,
    /// The measures.
    pub measures: Distinctiveness,
    /// Whether there was a firing one small step ago; if not, changes since then read as none.
    pub has_before: bool,
    /// What stands around: the signature of a place, where this is one.
    pub around: Surroundings,
    /// What is to be maximised here.
    pub goal: Goal,
    /// The next step of the hill-climb, in metres in the frame of headings; `None` where nothing can
    /// be climbed.
    pub climb: Option<Vector2<f64>>,
    /// The strategy by which one goes on ahead.
    pub strategy: Strategy,
    /// How far to turn for it before the next small step, counter-clockwise.
    pub steering_rad: f64,
}

impl Outlook {
    /// Of the mean of firings now and one small step before, both from where the robot looks now.
    pub(crate) fn new(ring: Ring, before: Option<&Ring>, heading_rad: f64, scale: &Scale) -> Self {
        let measures = distinctiveness(before.unwrap_or(&ring), &ring, heading_rad, scale);
        let around = surroundings(&ring, scale);
        let goal = goal(&around);
        let strategy = fitting(&ring, heading_rad, scale);
        Self {
            heading_rad,
            measures,
            has_before: before.is_some(),
            goal,
            climb: climb(&around, goal, scale),
            around,
            strategy,
            steering_rad: steering_rad(strategy, &ring, heading_rad, scale),
            ring,
        }
    }
}
