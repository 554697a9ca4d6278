//! Where a map's robots have looked for landmarks.

use std::collections::BTreeMap;

use meetpoint_geometry::{Point2, Pose};

use crate::ground::{Ground, Known};

/// A moment at which a robot looked for landmarks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The robot, in the frame of the map.
    pub at: Pose,
    /// How far it sees landmarks, in metres.
    pub range_max_m: f64,
    /// To each side of straight ahead, in radians.
    pub half_field_of_view_rad: f64,
}

/// Edge of a cell, in metres: half of what two maps may be off at a landmark.
const EDGE_M: f64 = 0.5;
/// Share of a detector's range, and of its field of view, within which it may be relied upon.
const SURE_SHARE: f64 = 0.7;
/// Looks at a place without which nothing is said of it: one may have been past a person.
const N_LOOKS_MIN: u32 = 2;
/// Step along a line of sight, in metres: no wall of a ground's cells is stepped over.
const STEP_M: f64 = 0.1;
/// A wall within this of the place is not in the way, in metres: doors are in walls, signs on them.
const AT_WALL_M: f64 = 0.6;
/// Cells on each side of a look, at most: 50 m.
const N_CELLS_MAX: f64 = 100.0;

/// How often each place was looked at.
#[derive(Clone, Debug, Default)]
pub(crate) struct Looked {
    n_looks: BTreeMap<(i32, i32), u32>,
}

impl Looked {
    /// By looks that walls end. Time O(looks * cells within range * steps).
    pub(crate) fn new(ground: &Ground, looks: &[Look]) -> Self {
        let mut looked = Self::default();
        for look in looks.iter().filter(|look| look.at.is_finite()) {
            looked.add(ground, look);
        }
        looked
    }

    #[expect(clippy::cast_possible_truncation, reason = "at most N_CELLS_MAX")]
    fn add(&mut self, ground: &Ground, look: &Look) {
        let range_m = SURE_SHARE * look.range_max_m;
        let half_rad = SURE_SHARE * look.half_field_of_view_rad;
        let reach = (range_m / EDGE_M).ceil().clamp(0.0, N_CELLS_MAX) as i32;
        let middle = cell(look.at.position());
        for y in middle.1 - reach..=middle.1 + reach {
            for x in middle.0 - reach..=middle.0 + reach {
                let place = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * EDGE_M;
                let seen = (look.at.inverse() * place).coords;
                let is_in_view = seen.norm() <= range_m && seen.y.atan2(seen.x).abs() <= half_rad;
                if is_in_view && is_open(ground, look.at.position(), place) {
                    *self.n_looks.entry((x, y)).or_default() += 1;
                }
            }
        }
    }

    /// Whether a landmark there would have been seen, if none was missed.
    pub(crate) fn has_seen(&self, place: Point2<f64>) -> bool {
        place.iter().all(|it| it.is_finite())
            && self.n_looks.get(&cell(place)).is_some_and(|&n_looks| N_LOOKS_MIN <= n_looks)
    }
}

/// Whether no wall stands between.
fn is_open(ground: &Ground, from: Point2<f64>, to: Point2<f64>) -> bool {
    let way = to - from;
    let length_m = way.norm() - AT_WALL_M;
    let step = way.try_normalize(0.0).unwrap_or_default() * STEP_M;
    let mut at = from;
    let mut gone_m = 0.0;
    while gone_m < length_m {
        if ground.at(at) == Known::Wall {
            return false;
        }
        at += step;
        gone_m += STEP_M;
    }
    true
}

#[expect(clippy::cast_possible_truncation, reason = "saturates far beyond any building")]
fn cell(place: Point2<f64>) -> (i32, i32) {
    ((place.x / EDGE_M).floor() as i32, (place.y / EDGE_M).floor() as i32)
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::GridFrame;
    use meetpoint_occupancy::Grid;

    use super::*;

    #[test]
    fn ahead_within_range_and_more_than_once() {
        let (ground, _) = Ground::of_grid(&Grid::new(GridFrame::new(0.05).expect("a length")));
        let look = Look { at: Pose::IDENTITY, range_max_m: 5.0, half_field_of_view_rad: 1.0 };
        let [once, twice] = [1, 2].map(|n| Looked::new(&ground, &vec![look; n]));
        let ahead = Point2::new(2.2, 0.3);
        assert!(!once.has_seen(ahead), "a person may have stood there");
        assert!(twice.has_seen(ahead), "2 m ahead");
        for (x_m, y_m) in [(4.8, 0.2), (0.3, 2.2), (-2.2, 0.2), (f64::NAN, 0.0)] {
            assert!(!twice.has_seen(Point2::new(x_m, y_m)), "{x_m}, {y_m}");
        }
    }
}
