//! A branch of the medial axis, walked outward from a place, and where on it the gateway is.
//!
//! Three criteria (HSSH 2004, section III-B), each told as the first cell of the branch where
//!
//! ```text
//! constriction   nothing ahead, within a corridor's width, is notably narrower; then the
//!                narrowest cell within a clearance from there
//! visibility     what is in view changes most from one stride to the next
//! control law    a law holds that does not hold at the core, and goes on to hold
//! ```
//!
//! Time O(cells · cells of a corridor's width) for the first, O(strides) isovists for the second,
//! O(cells) looks for the third.

use meetpoint_geometry::{Pose, Vector2};

use crate::local::gateway::GatewayCriterion;
use crate::local::medial_axis::{MedialAxis, NodeKind};
use crate::local::neighborhood::Departure;
use crate::local::params::{GatewayParams, LawParams, LocalParams};
use crate::local::sight::{isovist, n_different};
use crate::local::walls::control_law;
use crate::star::ControlLaw;

/// Half the way over which the direction of a branch is measured, in metres, at least; else it is
/// the clearance, for an axis that was thinned cell by cell wavers more where space is wide.
const DIRECTION_REACH_M: f64 = 0.3;

/// A line of the axis, from the place that it leaves.
pub(crate) struct Branch<'a> {
    axis: &'a MedialAxis,
    /// Outward.
    pub(crate) cells: Vec<usize>,
    /// Clearance of the cells, in metres.
    profile: Vec<f64>,
    /// Way from the first cell, in metres.
    way_m: Vec<f64>,
    /// Whether it ends before what was never observed.
    is_open: bool,
}

impl<'a> Branch<'a> {
    pub(crate) fn new(axis: &'a MedialAxis, departure: Departure) -> Self {
        let line = &axis.lines[departure.line];
        let mut cells = line.cells.clone();
        if departure.end == 1 {
            cells.reverse();
        }
        let is_open = axis.nodes[line.nodes[1 - departure.end]].kind == NodeKind::Frontier;
        let profile = cells.iter().map(|&cell| axis.clearance.at_m(cell)).collect();
        let mut way_m = vec![0.0];
        for pair in cells.windows(2) {
            let so_far = way_m[way_m.len() - 1];
            way_m.push(so_far + (axis.point(pair[1]) - axis.point(pair[0])).norm());
        }
        Self { axis, cells, profile, way_m, is_open }
    }

    /// Where the gateway is, as a place in [`Self::cells`]; `None` if there is none.
    pub(crate) fn gateway(&self, core_m: f64, params: &LocalParams) -> Option<usize> {
        let GatewayParams { fall_min, ahead, .. } = params.gateway;
        match params.criterion {
            GatewayCriterion::Constriction => {
                constriction(&self.profile, &self.way_m, self.is_open, [fall_min, ahead])
            }
            GatewayCriterion::Visibility => self.change_of_view(core_m, &params.gateway),
            GatewayCriterion::ControlLaw => self.change_of_law(&params.law),
        }
    }

    /// The direction outward at a cell, as a vector of no certain length.
    pub(crate) fn direction(&self, at: usize) -> Vector2<f64> {
        let reach_m = DIRECTION_REACH_M.max(self.profile[at]);
        let is_far = |other: &usize| reach_m <= (self.way_m[*other] - self.way_m[at]).abs();
        let before = (0..at).rev().find(is_far).unwrap_or(0);
        let after = (at..self.cells.len()).find(is_far).unwrap_or(self.cells.len() - 1);
        self.axis.point(self.cells[after]) - self.axis.point(self.cells[before])
    }

    /// Where one stands at a cell who travels outward.
    pub(crate) fn pose(&self, at: usize) -> Pose {
        let point = self.axis.point(self.cells[at]);
        let direction = self.direction(at);
        Pose::new(point.x, point.y, direction.y.atan2(direction.x))
    }

    /// The cell that is so far beyond one, but no farther than half the way to the end.
    pub(crate) fn beyond(&self, at: usize, beyond_m: f64) -> usize {
        let rest_m = self.way_m[self.way_m.len() - 1] - self.way_m[at];
        let end_m = self.way_m[at] + beyond_m.min(rest_m / 2.0);
        (at..self.cells.len()).take_while(|&other| self.way_m[other] <= end_m).last().unwrap_or(at)
    }

    fn change_of_view(&self, core_m: f64, params: &GatewayParams) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        let view = |at: usize| {
            let from = self.axis.point(self.cells[at]);
            isovist(&self.axis.space, from, params.sight_m)
        };
        let (mut last, mut before) = (0, view(0));
        for at in 1..self.cells.len() {
            let stride_m = self.way_m[at] - self.way_m[last];
            if stride_m < params.stride_m {
                continue;
            }
            if params.reach * core_m < self.way_m[at] {
                break;
            }
            let now = view(at);
            let share = n_different(&before, &now) as f64 / before.len().max(now.len()) as f64;
            let change = share / stride_m * self.profile[at];
            if params.change_min <= change && best.is_none_or(|(most, _)| most < share / stride_m) {
                best = Some((share / stride_m, usize::midpoint(last, at)));
            }
            (last, before) = (at, now);
        }
        best.map(|(_, at)| at.max(1))
    }

    fn change_of_law(&self, params: &LawParams) -> Option<usize> {
        let laws: Vec<ControlLaw> = (0..self.cells.len())
            .map(|at| control_law(&self.axis.space, self.pose(at), params))
            .collect();
        let holds = |&at: &usize| {
            let end_m = self.way_m[at] + self.profile[at];
            let ahead = (at..laws.len()).take_while(|&other| self.way_m[other] <= end_m);
            laws[at] != laws[0] && ahead.into_iter().all(|other| laws[other] == laws[at])
        };
        (1..laws.len()).find(holds)
    }
}

/// Where a branch of that clearance first is as narrow as it soon gets. Of an open one at least as
/// much is known beyond as it is wide to either side, or that it widens.
fn constriction(
    profile: &[f64],
    way_m: &[f64],
    is_open: bool,
    [fall_min, ahead]: [f64; 2],
) -> Option<usize> {
    let last_m = way_m.last().copied()?;
    let within = |at: usize, reach_m: f64| {
        let end_m = way_m[at] + reach_m;
        (at..profile.len()).take_while(move |&other| way_m[other] <= end_m)
    };
    let is_narrow = |&at: &usize| {
        let reach_m = ahead * profile[at];
        let mut others = within(at, reach_m);
        let widens = || within(at, reach_m).any(|other| fall_min * profile[at] <= profile[other]);
        others.all(|other| profile[at] < fall_min * profile[other])
            && (!is_open || way_m[at] + profile[at] <= last_m || widens())
    };
    let first = (1..profile.len()).find(is_narrow)?;
    // Of several that are as narrow the first.
    within(first, profile[first]).min_by(|&a, &b| profile[a].total_cmp(&profile[b]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(profile: &[f64], is_open: bool) -> Option<usize> {
        let way_m: Vec<f64> = (0..profile.len()).map(|at| at as f64).collect();
        constriction(profile, &way_m, is_open, [1.1, 2.0])
    }

    #[test]
    fn a_constriction_is_the_first_place_that_is_as_narrow_as_it_gets() {
        assert_eq!(at(&[1.4, 1.2, 1.0, 1.0, 1.0, 1.0], false), Some(2), "the mouth of a corridor");
        assert_eq!(at(&[2.0, 2.0, 1.5, 0.5, 0.5, 0.5, 2.0], false), Some(3), "a door in a wall");
        assert_eq!(at(&[1.4, 1.0, 1.0, 1.0, 0.5, 1.0], false), Some(1), "before a door far away");
        assert_eq!(at(&[3.0, 2.5, 2.0, 1.5, 1.0], true), None, "nothing is known of what follows");
        assert_eq!(at(&[3.0, 1.0, 0.5, 1.0], true), Some(2), "a door that was looked through");
    }
}
