//! What is in view: the no-landmark observations of all places around a robot where it saw nothing
//! (TBF98 section 6), and how often each place was looked at.
//!
//! The places in view of a heading are runs of nodes, row by row, so that sums over them are
//! differences of sums along rows. Time: nodes times rows in view, for a detector that looks
//! everywhere; for another one, times headings.

use crate::layer::Layer;
use crate::perception::single;
use crate::pose_grid::PoseGrid;
use crate::side_by_side::side_by_side;
use crate::travel::Detector;
use crate::window::Window;

use std::f64::consts::PI;
use std::num::NonZero;

/// Which places a detector sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    radius_m: f64,
    half_field_of_view_rad: f64,
}

/// Nodes in a row, seen from the robot's node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    y: i32,
    first_x: i32,
    last_x: i32,
}

impl View {
    /// The detector's own range, or the radius around a button.
    pub(crate) fn new(detector: &Detector, radius_m: f64) -> Self {
        let own = detector.range_max_m;
        let radius_m = if own > 0.0 { own } else { radius_m };
        Self { radius_m, half_field_of_view_rad: detector.half_field_of_view_rad }
    }

    /// Whether all headings see the same.
    pub(crate) fn is_round(&self) -> bool {
        self.half_field_of_view_rad >= PI
    }

    /// Sets of places that differ: one for each heading, or one for all.
    pub(crate) fn n_kinds(&self, grid: &PoseGrid) -> u32 {
        if self.is_round() { 1 } else { grid.n_headings() }
    }

    /// Whether a place is seen that lies that many metres away in that direction.
    fn holds(&self, x_m: f64, y_m: f64, heading_rad: f64) -> bool {
        let near = x_m.hypot(y_m) <= self.radius_m;
        let (sin, cos) = heading_rad.sin_cos();
        let (ahead, left) = (cos * x_m + sin * y_m, cos * y_m - sin * x_m);
        near && (self.is_round() || left.atan2(ahead).abs() <= self.half_field_of_view_rad)
    }

    /// The nodes in view of a heading.
    #[expect(clippy::cast_possible_truncation, reason = "at most a grid's width")]
    fn runs(&self, grid: &PoseGrid, heading: u32) -> Vec<Run> {
        let Window { width, height, .. } = grid.window();
        let nodes = grid.in_nodes(self.radius_m.max(0.0)).floor();
        let reach = nodes.min(f64::from(width.max(height))) as i32;
        let heading_rad = grid.heading_rad(heading);
        let mut runs: Vec<Run> = Vec::new();
        for y in -reach..=reach {
            let mut last: Option<Run> = None;
            for x in -reach..=reach {
                let point = grid.point_of(x, y);
                if self.holds(point.x, point.y, heading_rad) {
                    let run = last.get_or_insert(Run { y, first_x: x, last_x: x });
                    run.last_x = x;
                } else {
                    runs.extend(last.take());
                }
            }
            runs.extend(last);
        }
        runs
    }

    /// For every node, the sum of `values` over what is in view from it.
    fn sums(&self, grid: &PoseGrid, heading: u32, values: &RowSums) -> Vec<f64> {
        let mut sums = vec![0.0; values.window.n_cells()];
        for run in self.runs(grid, heading) {
            values.add_runs(run, &mut sums);
        }
        sums
    }
}

/// The probability of seeing nothing at all, by what is in view (see [`View::n_kinds`]).
/// `logarithms`: of the probability that each node's landmark, if there is one, is not seen.
pub(crate) fn nothing_in_view(
    grid: &PoseGrid,
    view: &View,
    logarithms: &[f64],
    n_threads: NonZero<usize>,
) -> Vec<Layer> {
    let values = RowSums::new(grid.window(), logarithms);
    let n_units = grid.n_cells() * 20;
    side_by_side(view.n_kinds(grid), n_threads, n_units, |heading| {
        let sums = view.sums(grid, heading, &values);
        Layer::new(grid.window(), sums.iter().map(|sum| single(sum.exp())).collect())
    })
}

/// How often each node was in view of robots that were at poses with these probabilities,
/// summed by [`View::n_kinds`].
pub(crate) fn times_in_view(
    grid: &PoseGrid,
    view: &View,
    at: &[Vec<f64>],
    n_threads: NonZero<usize>,
) -> Vec<f64> {
    let n_units = grid.n_cells() * 20;
    let by_kind = side_by_side(view.n_kinds(grid), n_threads, n_units, |heading| {
        let probabilities = &at[heading as usize];
        if probabilities.iter().all(|&probability| probability == 0.0) {
            return Vec::new();
        }
        // What sees a place is what is seen from it in the opposite direction.
        let opposite = grid.turned(heading, i32::try_from(grid.n_headings() / 2).unwrap_or(0));
        view.sums(grid, opposite, &RowSums::new(grid.window(), probabilities))
    });
    let mut times = vec![0.0; grid.n_nodes()];
    for sums in by_kind {
        for (total, sum) in times.iter_mut().zip(sums) {
            *total += sum;
        }
    }
    times
}

/// Sums along rows, from the left.
struct RowSums {
    window: Window,
    /// One more a row than it has nodes.
    sums: Vec<f64>,
}

impl RowSums {
    #[expect(clippy::cast_sign_loss, reason = "windows of grids are not empty")]
    fn new(window: Window, values: &[f64]) -> Self {
        let mut sums = Vec::with_capacity(values.len() + window.height as usize);
        for row in values.chunks(window.width as usize) {
            let mut sum = 0.0;
            sums.push(sum);
            for value in row {
                sum += value;
                sums.push(sum);
            }
        }
        Self { window, sums }
    }

    /// Adds to every node the sum of the run as seen from it.
    #[expect(clippy::cast_sign_loss, reason = "clamped to the window")]
    fn add_runs(&self, run: Run, totals: &mut [f64]) {
        let Window { width, height, .. } = self.window;
        let (n, stride) = (width as usize, width as usize + 1);
        for y in 0.max(-run.y)..height.min(height - run.y) {
            let row = &self.sums[(y + run.y) as usize * stride..][..stride];
            let totals = &mut totals[y as usize * n..][..n];
            for (x, total) in (0..width).zip(totals) {
                let end = (x + run.last_x + 1).clamp(0, width);
                let start = (x + run.first_x).clamp(0, width);
                *total += row[end as usize] - row[start as usize];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_grid::Area;
    use meetpoint_geometry::Point2;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn equals_the_definition(
            half_field_of_view_rad in prop_oneof![Just(PI), 0.3_f64..3.0],
            range_max_m in 0.5_f64..4.0,
            values in proptest::collection::vec(0.0_f64..1.0, 63),
            heading in 0_u32..8,
        ) {
            let area = Area { min: Point2::new(-2.0, -2.0), max: Point2::new(6.0, 4.0) };
            let grid = PoseGrid::new(area, 1.0, 8).expect("a grid");
            let view = View::new(&Detector { range_max_m, half_field_of_view_rad }, 10.0);
            let window = grid.window();
            let sums = view.sums(&grid, heading, &RowSums::new(window, &values));
            for ((x, y), sum) in window.nodes().zip(&sums) {
                let mut expected = 0.0;
                for ((to_x, to_y), value) in window.nodes().zip(&values) {
                    let (dx, dy) = (f64::from(to_x - x), f64::from(to_y - y));
                    if view.holds(dx, dy, grid.heading_rad(heading)) {
                        expected += value;
                    }
                }
                prop_assert!((sum - expected).abs() < 1e-9, "({}, {}): {} not {}", x, y, sum, expected);
            }
        }
    }
}
