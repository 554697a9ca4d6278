//! The places of a window where some points fit, and those that rival them, by branch and bound.
//!
//! For each heading the window is cut into squares of shifts; a square whose bound ([`Pyramid`]) does
//! not reach a share of the best score so far is dropped, others are cut into smaller ones, the most
//! promising first. What is left is thinned to places that lie apart. A match is worth only as much as
//! it beats its rivals by. Time O(headings * squares * points), and more the more rivals there are.

use std::cmp::Reverse;

use meetpoint_geometry::{Cell, Point2, Pose};

use crate::field::{FULL, Field};
use crate::pyramid::{LEVELS, Pyramid};
use crate::search::{Candidate, Window, headings, place_points};

/// What counts as a place of its own, and which are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PeakParams {
    /// Lower scores are no match.
    pub(crate) score_min: f64,
    /// Scores lower than this share of the best are no rivals.
    pub(crate) rival_share: f64,
    /// Two poses as far apart as this are two, in metres...
    pub(crate) apart_m: f64,
    /// ...or as this, in radians.
    pub(crate) apart_rad: f64,
    /// No more are kept.
    pub(crate) n_max: usize,
}

/// A square of shifts at one heading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Square {
    bound: Reverse<u32>,
    heading: usize,
    /// The lowest shift, x and y.
    low: (i32, i32),
}

/// The shifts of one heading.
struct Shifts<'a> {
    pyramid: &'a Pyramid,
    /// The points' cells unshifted.
    cells: &'a [Cell],
    /// Shifts go from -half to half.
    half: i32,
}

/// The poses of the window's lattice where the points fit, best first; no two of them near each other.
/// Of each heading and coarsest square only the best counts. The score is the mean of the field, in
/// 0..=1.
pub(crate) fn peaks_in_window(
    (field, pyramid): (&Field, &Pyramid),
    points: &[Point2<f64>],
    window: &Window,
    params: &PeakParams,
) -> Vec<Candidate> {
    if points.is_empty() || !window.center.is_finite() {
        return Vec::new();
    }
    let headings: Vec<Pose> = headings(window).collect();
    let half = window.half_cells(field.resolution_m());
    let full = FULL * points.len() as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a sum")]
    let floor_of = |best: u32| {
        (params.score_min * full).max(params.rival_share * f64::from(best)).max(0.0) as u32
    };
    let mut cells = vec![Vec::with_capacity(points.len()); headings.len()];
    let mut squares = Vec::new();
    for (heading, (&pose, cells)) in headings.iter().zip(&mut cells).enumerate() {
        place_points(field, points, pose, cells);
        let shifts = Shifts { pyramid, cells, half };
        let whole = shifts.squares(0, (-half, -half), half + half + 1);
        squares.extend(whole.map(|(bound, low)| Square { bound: Reverse(bound), heading, low }));
    }
    squares.sort_unstable();
    let (mut found, mut best) = (Vec::new(), 0);
    for Square { bound: Reverse(bound), heading, low } in squares {
        let floor = floor_of(best);
        if bound <= floor {
            break;
        }
        let shifts = Shifts { pyramid, cells: &cells[heading], half };
        if let Some((sum, (x, y))) = shifts.best_of(0, low, floor) {
            best = best.max(sum);
            let pose = headings[heading];
            let shifted = Pose {
                x_m: pose.x_m + f64::from(x) * field.resolution_m(),
                y_m: pose.y_m + f64::from(y) * field.resolution_m(),
                ..pose
            };
            found.push(Candidate { pose: shifted, score: f64::from(sum) / full });
        }
    }
    thinned(found, f64::from(floor_of(best)) / full, params)
}

impl Shifts<'_> {
    /// The squares of a level that cover `edge` shifts from `low` on, with their bounds.
    fn squares(
        &self,
        level: usize,
        low: (i32, i32),
        edge: i32,
    ) -> impl Iterator<Item = (u32, (i32, i32))> {
        let step = 1 << LEVELS[level];
        let from = move |low: i32| (low..(low + edge).min(self.half + 1)).step_by(step);
        from(low.1).flat_map(move |y| {
            from(low.0).map(move |x| (self.pyramid.sum(level, self.cells, Cell { x, y }), (x, y)))
        })
    }

    /// The best shift of a square of a level whose sum is more than `floor`, and that sum.
    fn best_of(&self, level: usize, low: (i32, i32), floor: u32) -> Option<(u32, (i32, i32))> {
        let (edge, next) = (1 << LEVELS[level], level + 1);
        let mut squares: Vec<_> = self.squares(next, low, edge).collect();
        squares.sort_by_key(|&(bound, low)| (Reverse(bound), low));
        let mut best: Option<(u32, (i32, i32))> = None;
        for (bound, low) in squares {
            let floor = best.map_or(floor, |(sum, _)| sum);
            if bound <= floor {
                break;
            }
            let found = if next + 1 == LEVELS.len() {
                Some((bound, low))
            } else {
                self.best_of(next, low, floor)
            };
            best = found.or(best);
        }
        best
    }
}

/// The best, the best of those apart from it, and so on.
fn thinned(mut found: Vec<Candidate>, floor: f64, params: &PeakParams) -> Vec<Candidate> {
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in found.into_iter().take_while(|candidate| floor < candidate.score) {
        if kept.len() == params.n_max {
            break;
        }
        if kept.iter().all(|other| are_apart(other.pose, candidate.pose, params)) {
            kept.push(candidate);
        }
    }
    kept
}

fn are_apart(a: Pose, b: Pose, params: &PeakParams) -> bool {
    let step = a.step_to(b);
    params.apart_m <= step.distance_m() || params.apart_rad <= step.theta_rad.abs()
}
