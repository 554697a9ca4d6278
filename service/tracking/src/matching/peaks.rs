//! The places of a window where some points fit, and those that rival them, by branch and bound.
//!
//! For each heading the window is cut into squares of shifts; a square whose bound ([`Pyramid`]) does
//! not reach a share of the best score so far is dropped, others are cut into smaller ones, the most
//! promising first. What is left is thinned to places that lie apart. A match is worth only as much as
//! it beats its rivals by. Time O(headings * squares * points), and more the more rivals there are.

use std::cmp::Reverse;

use meetpoint_geometry::{Cell, Point2, Pose};

use crate::matching::field::{FULL, Field};
use crate::matching::pyramid::{LEVELS, Pyramid};
use crate::matching::search::{Candidate, Window, headings, place_points};

/// What counts as a place of its own, and which are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakParams {
    /// Lower scores are no match.
    pub score_min: f64,
    /// Scores lower than this share of the best are no rivals.
    pub rival_share: f64,
    /// Two poses as far apart as this are two, in metres...
    pub apart_m: f64,
    /// ...or as this, in radians.
    pub apart_rad: f64,
    /// No more are kept.
    pub n_max: usize,
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
/// 0..=1. The pyramid reaches all cells that the field has and the points may come to.
pub fn peaks_in_window(
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use meetpoint_geometry::GridFrame;
    use meetpoint_occupancy::{BeamModel, Grid, LaserGeometry, ScanMarks};
    use proptest::prelude::*;

    use super::*;
    use crate::matching::search::{Prior, best_in_window};
    use crate::params::FieldParams;

    const LASER: LaserGeometry = LaserGeometry {
        angle_min_rad: -PI,
        angle_increment_rad: PI / 30.0,
        n_beams: 60,
        range_min_m: 0.0,
        range_max_m: 9.0,
    };
    const PARAMS: PeakParams =
        PeakParams { score_min: 0.05, rival_share: 0.8, apart_m: 0.5, apart_rad: 0.3, n_max: 4 };

    fn seen(ranges_m: &[f32]) -> (Field, Vec<Point2<f64>>) {
        let mut grid = Grid::new(GridFrame::new(0.05).expect("a length"));
        let model = BeamModel::INDOOR;
        grid.insert_scan(Pose::IDENTITY, &LASER, ranges_m, &model, &mut ScanMarks::new());
        let field = Field::new(&grid, &FieldParams { hit_std_m: 0.05, occupied_log_odds_min: 0.0 });
        let point = |(beam, &range_m): (u32, &f32)| {
            let (sin, cos) = LASER.bearing_rad(beam).sin_cos();
            Point2::new(f64::from(range_m) * cos, f64::from(range_m) * sin)
        };
        (field, (0_u32..).zip(ranges_m).map(point).collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn the_best_is_that_of_the_exhaustive_search(
            ranges_m in prop::collection::vec(0.5_f32..5.0, 60),
            (x, y, turn) in (-0.9_f64..0.9, -0.9_f64..0.9, -0.4_f64..0.4),
        ) {
            let (field, points) = seen(&ranges_m);
            let center = Pose::new(x, y, turn);
            let window = Window { center, half_m: 1.2, half_rad: 0.5, step_rad: 0.05 };
            let free = Prior { center, gain_per_m2: 0.0, gain_per_rad2: 0.0, loss_max: 0.0 };
            let slow = best_in_window(&field, &points, &window, &free);
            let pyramid = Pyramid::new(&field, 200);
            let peaks = peaks_in_window((&field, &pyramid), &points, &window, &PARAMS);
            match peaks.first() {
                Some(best) => prop_assert!((best.score - slow.score).abs() < 1e-12, "{best:?} {slow:?}"),
                None => prop_assert!(slow.score <= PARAMS.score_min, "{slow:?} was not found"),
            }
        }
    }

    /// Two rooms alike, side by side: a scan of one fits the other.
    #[test]
    fn a_second_room_alike_is_a_rival() {
        let square = |beam: u32| {
            let (sin, cos) = LASER.bearing_rad(beam).sin_cos();
            #[expect(clippy::cast_possible_truncation, reason = "ranges are sent as f32")]
            let range_m = (2.0 / sin.abs().max(cos.abs())) as f32;
            range_m
        };
        let ranges_m: Vec<f32> = (0..60).map(square).collect();
        let (_, points) = seen(&ranges_m);
        let mut grid = Grid::new(GridFrame::new(0.05).expect("a length"));
        for x_m in [0.0, 5.0] {
            let (pose, model) = (Pose::new(x_m, 0.0, 0.0), BeamModel::INDOOR);
            grid.insert_scan(pose, &LASER, &ranges_m, &model, &mut ScanMarks::new());
        }
        let field = Field::new(&grid, &FieldParams { hit_std_m: 0.05, occupied_log_odds_min: 0.0 });
        let pyramid = Pyramid::new(&field, 300);
        let window =
            Window { center: Pose::new(2.0, 0.0, 0.0), half_m: 4.0, half_rad: 0.2, step_rad: 0.02 };
        let peaks = peaks_in_window((&field, &pyramid), &points, &window, &PARAMS);
        let mut places: Vec<f64> = peaks.iter().map(|peak| peak.pose.x_m).collect();
        places.sort_by(f64::total_cmp);
        assert_eq!(places.len(), 2, "both rooms and nothing between: {peaks:?}");
        assert!(places[0].abs() < 0.06 && (places[1] - 5.0).abs() < 0.06, "{places:?}");
    }
}
