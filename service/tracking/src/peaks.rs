//! The best places of a window where a scan fits, and those that rival them.
//!
//! As [`best_in_wide_window`](crate::wide_search::best_in_wide_window), but all blocks are looked into
//! whose bound reaches a share of the best score, and what is found there is thinned to places that
//! lie apart. A match is worth only as much as it beats its rivals by. Time as there, and more the more
//! rivals there are.

use std::cmp::Reverse;

use meetpoint_geometry::{Point2, Pose};

use crate::field::{FULL, Field};
use crate::search::search_block;
use crate::search::{Candidate, N_POINTS_MAX, Prior, Window, block_lows, headings, place_points};
use crate::wide_search::{Bounds, Branch, bound_sum};

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

/// The poses of the window's lattice where the points fit, best first; no two of them near each other.
/// Of each heading and block of shifts only the best counts.
pub(crate) fn peaks_in_window(
    (field, bounds): (&Field, &Bounds),
    points: &[Point2<f64>],
    window: &Window,
    params: &PeakParams,
) -> Vec<Candidate> {
    let points = &points[..points.len().min(N_POINTS_MAX)];
    if points.is_empty() || !window.center.is_finite() {
        return Vec::new();
    }
    let headings: Vec<_> = headings(window).collect();
    let half = window.half_cells(field.resolution_m());
    let scale = 1.0 / (FULL * points.len() as f64);
    let mut cells = Vec::with_capacity(points.len());
    let mut branches = Vec::new();
    for (heading, &pose) in (0_u32..).zip(&headings) {
        place_points(field, points, pose, &mut cells);
        for low in block_lows(half) {
            let bound = bound_sum(bounds, &cells, low);
            if params.score_min < f64::from(bound) * scale {
                branches.push(Branch { bound: Reverse(bound), heading, low: (low.x, low.y) });
            }
        }
    }
    branches.sort_unstable();
    let prior =
        Prior { center: window.center, gain_per_m2: 0.0, gain_per_rad2: 0.0, loss_max: 0.0 };
    let (mut found, mut best) = (Vec::new(), params.score_min);
    for Branch { bound: Reverse(bound), heading, low: (x, y) } in branches {
        let floor = params.score_min.max(params.rival_share * best);
        if f64::from(bound) * scale <= floor {
            break;
        }
        let pose = headings[heading as usize];
        place_points(field, points, pose, &mut cells);
        let mut candidate = Candidate { pose, score: floor };
        let low = meetpoint_geometry::Cell { x, y };
        search_block(field, &cells, (pose, half), low, (&prior, &mut candidate));
        if floor < candidate.score {
            best = best.max(candidate.score);
            found.push(candidate);
        }
    }
    thinned(found, params.rival_share * best, params)
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
