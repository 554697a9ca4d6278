//! Pulling a string tight.
//!
//! Where a string turns, it is cut short:
//!
//! ```text
//! a, v, b  ->  a, b                   if the straight way is clear, else
//!              a, hull vertices, b    around what stands into the triangle a v b
//! ```
//!
//! until every turn goes around a corner. Then no string that can be reached by bending this one
//! is shorter: J. Hershberger and J. Snoeyink, "Computing minimum length paths of a given homotopy
//! class", Computational Geometry 4 (1994). Every cut makes the string shorter and keeps it clear
//! of obstacles; it may also jump over an obstacle that stands alone.

use meetpoint_geometry::Point2;

use super::outline::{Outline, Turn, tight_around};
use super::terrain::Terrain;

/// Cuts a turn that a string starts with, at most. Each turn is cut a few times as a rule.
const N_CUTS_A_TURN_MAX: usize = 16;
/// A string that is not shorter by this is as good, in cells.
const GAIN_MIN: f64 = 1e-6;

/// A string between two points, clear of obstacles.
#[derive(Clone, Debug, Default)]
pub(crate) struct TautString {
    turns: Vec<Turn>,
    corners: Vec<Point2<f64>>,
    around: Vec<Turn>,
}

impl TautString {
    /// Lays the string along points that see each other in turn.
    pub(crate) fn lay(&mut self, points: impl Iterator<Item = Point2<f64>>) {
        self.turns.clear();
        self.turns.extend(points.map(|point| Turn { point, corner: None }));
    }

    /// Where it starts, turns and ends.
    pub(crate) fn points(&self) -> impl Iterator<Item = Point2<f64>> + '_ {
        self.turns.iter().map(|turn| turn.point)
    }

    /// Pulls the string tight.
    pub(crate) fn pull(&mut self, terrain: &Terrain, outline: &Outline) {
        let mut n_cuts_left = N_CUTS_A_TURN_MAX * self.turns.len();
        let mut at = 1;
        while at + 1 < self.turns.len() && 0 < n_cuts_left {
            if self.is_taut(at) {
                at += 1;
                continue;
            }
            n_cuts_left -= 1;
            if self.cut(at, terrain, outline) {
                // What came before may have become slack.
                at = at.saturating_sub(1).max(1);
            } else {
                at += 1;
            }
        }
    }

    /// Whether the string turns around a corner here.
    fn is_taut(&self, at: usize) -> bool {
        let [a, v, b] = [self.turns[at - 1], self.turns[at], self.turns[at + 1]];
        let Some(corner) = v.corner else { return false };
        let turn = (v.point - a.point).perp(&(b.point - v.point));
        let from_arriving = (v.point - a.point).perp(&(corner - v.point));
        let from_leaving = (b.point - v.point).perp(&(corner - v.point));
        0.0 < turn * from_arriving && 0.0 < turn * from_leaving
    }

    /// Cuts the turn short, if it can be.
    fn cut(&mut self, at: usize, terrain: &Terrain, outline: &Outline) -> bool {
        let [a, v, b] = [self.turns[at - 1], self.turns[at], self.turns[at + 1]].map(|t| t.point);
        let cost = terrain.cost(a, v) + terrain.cost(v, b);
        if terrain.is_clear(a, b) && terrain.cost(a, b) <= cost {
            self.turns.remove(at);
            return true;
        }
        let side = (v - b).perp(&(a - b)).signum();
        terrain.obstacles.corners_within([a, v, b], terrain.radius, &mut self.corners);
        self.keep_standing_out(outline, side, [a, b]);
        self.around.clear();
        tight_around(&self.corners, outline, side, [a, b], &mut self.around);
        let Some(&first) = self.around.first() else { return false };
        let mut last = a;
        let mut tight_cost = 0.0;
        for turn in self.around.iter().map(|turn| turn.point).chain([b]) {
            if !terrain.is_clear(last, turn) {
                return false;
            }
            tight_cost += terrain.cost(last, turn);
            last = turn;
        }
        if cost - GAIN_MIN < tight_cost {
            let is_here = (first.point - v).norm() < GAIN_MIN;
            if is_here && self.around.len() == 1 {
                self.turns[at] = first;
            }
            return false;
        }
        self.turns.splice(at..=at, self.around.iter().copied());
        true
    }

    /// Forgets corners that, grown, do not stand out from the line between `a` and `b`.
    fn keep_standing_out(&mut self, outline: &Outline, side: f64, [a, b]: [Point2<f64>; 2]) {
        let along = b - a;
        let least = -outline.reach() * along.norm();
        self.corners.retain(|corner| least <= side * along.perp(&(corner - a)));
    }
}
