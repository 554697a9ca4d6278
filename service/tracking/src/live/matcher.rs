//! One scan against the grid: search, descent, and how well the outcome agrees.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_occupancy::Grid;

use crate::matching::descent::descend;
use crate::matching::field::Field;
use crate::matching::points::{ScanPoint, thinned};
use crate::matching::search::{Prior, Window, best_in_window};
use crate::matching::wide_search::best_in_wide_window;
use crate::params::{MappingParams, MatchParams};

/// The map that scans are matched against.
#[derive(Clone, Copy)]
pub(crate) struct Chart<'a> {
    pub(crate) grid: &'a Grid,
    /// Invariant: the field of `grid`.
    pub(crate) field: &'a Field,
}

/// A scan, and all that it is matched against.
pub(crate) struct Matcher<'a> {
    /// The scan's hits in the robot's frame.
    points: &'a [ScanPoint],
    /// Those of them that the search looks at.
    search_points: Vec<Point2<f64>>,
    chart: Chart<'a>,
    params: &'a MatchParams,
    prior: Prior,
}

/// What matching found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    pub(crate) pose: Pose,
    /// Agreement less what the pose's distance from the prediction costs.
    pub(crate) score: f64,
    /// Mean of the field over the points on mapped space, in 0..=1.
    pub(crate) agreement: f64,
    /// Share of the points on mapped space.
    pub(crate) known_share: f64,
}

/// A hit whose field reaches this lies at a wall, whether or not a beam ever met its cell.
const WALL_VALUE_MIN: f64 = 0.2;

/// A robot that may be anywhere near loses only this share of what another does by lying away from
/// its prediction.
const ADRIFT_SHARE: f64 = 0.1;

impl<'a> Matcher<'a> {
    pub(crate) fn new(
        points: &'a [ScanPoint],
        (predicted, adrift): (Pose, bool),
        chart: Chart<'a>,
        params: &'a MappingParams,
    ) -> Self {
        let params = &params.matching;
        let prior = Prior {
            center: predicted,
            gain_per_m2: params.odometry_gain_per_m2,
            gain_per_rad2: params.odometry_gain_per_rad2,
            loss_max: params.odometry_loss_max * if adrift { ADRIFT_SHARE } else { 1.0 },
        };
        let search_points = thinned(points, params.n_search_points_max);
        Self { points, search_points, chart, params, prior }
    }

    /// The best of a window, and of the same window about other predictions.
    pub(crate) fn best(&self, window: Window, others: &[Pose]) -> Match {
        let search = |window: &Window| {
            best_in_window(self.chart.field, &self.search_points, window, &self.prior)
        };
        let mut best = search(&window);
        for &center in others {
            let found = search(&Window { center, ..window });
            if found.score > best.score {
                best = found;
            }
        }
        self.descended(best.pose)
    }

    /// The best of a large window, or its middle if none reaches `score_min`.
    pub(crate) fn best_widely(&self, window: Window, score_min: f64) -> Match {
        let field = self.chart.field;
        let points = &self.search_points;
        let found = best_in_wide_window(field, points, &window, (&self.prior, score_min));
        self.descended(found.pose)
    }

    /// Where the descent from a pose leads.
    pub(crate) fn descended(&self, start: Pose) -> Match {
        let n_iterations_max = self.params.n_iterations_max;
        self.judged(descend(self.chart.field, self.points, start, &self.prior, n_iterations_max))
    }

    /// How well a pose agrees.
    pub(crate) fn judged(&self, pose: Pose) -> Match {
        let Chart { grid, field } = self.chart;
        let (mut total, mut known, mut sum) = (0.0, 0.0, 0.0);
        for &ScanPoint { at, weight } in self.points {
            total += weight;
            let place = pose * at;
            let (value, _, _) = field.interpolate(place);
            if WALL_VALUE_MIN < value || grid.log_odds(grid.frame().cell_at(place)).is_some() {
                known += weight;
                sum += weight * value;
            }
        }
        let agreement = if known > 0.0 { sum / known } else { 0.0 };
        let known_share = if total > 0.0 { known / total } else { 0.0 };
        Match { pose, score: agreement - self.prior.loss(pose), agreement, known_share }
    }
}
