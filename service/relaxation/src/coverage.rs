//! What a travel has looked at: where a landmark would have been noticed, if there were one.
//!
//! A camera looks at all within half of its range and most of its field of view, a person with a
//! button at what the robot drives over, as in [`crate::missed`]. Looks from about the same place
//! are one: what hides a landmark hides it on. Of `n` looks at a place the chance to notice is
//!
//! ```text
//! p(n) = min(1 - missed^n, NOTICED_MAX)
//! ```
//!
//! on cells half a metre wide. Time: looks times cells in view.

use std::collections::{BTreeMap, BTreeSet};

use meetpoint_geometry::{Point2, Pose};

use crate::calibration::Calibration;
use crate::path::Path;
use crate::travel::{Detector, Travel};

/// Width of a cell, in metres.
const CELL_M: f64 = 0.5;
/// A detector that sees no farther sees what the robot drives over, in metres.
const BUTTON_RANGE_MAX_M: f64 = 1.0;
/// What is this near to the way has been driven over, in metres.
const REACHED_M: f64 = 0.5;
/// Share of a detector's range within which it may be relied upon.
const SURE_SHARE: f64 = 0.5;
/// No detector is trusted to look farther, in metres: cells in view grow with its square.
const SURE_RANGE_MAX_M: f64 = 20.0;
/// Share of its field of view, likewise.
const SIDE_SHARE: f64 = 0.8;
/// A robot that has moved by so much looks anew, in metres...
const LOOK_M: f64 = 0.5;
/// ...or turned by so much, in radians.
const LOOK_RAD: f64 = 0.5;
/// Chance that a landmark in view is not noticed at a look: a camera's, and a person's. Cameras read a
/// tag less than half of the time.
const MISSED_BY_CAMERA: f64 = 0.6;
const MISSED_BY_BUTTON: f64 = 0.1;
/// Where one has looked ever so often something may stand in the way.
const NOTICED_MAX: f64 = 0.9;
/// Looks at a cell that are counted.
const N_LOOKS_MAX: u8 = 20;

/// Where landmarks would have been noticed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// Chance that a landmark was missed at all looks, by cell.
    missed: BTreeMap<(i32, i32), f64>,
}

impl Coverage {
    /// Of a travel with the robot at `poses`, one a step.
    pub fn of(travel: &Travel, poses: &[Pose], calibration: &Calibration) -> Self {
        let is_button = travel.detector.range_max_m <= BUTTON_RANGE_MAX_M;
        let certainty = Vec::new();
        let ways = Path { poses: poses.to_vec(), certainty }.between_steps(travel, calibration);
        let ways = ways.iter().map(Vec::as_slice);
        let looks = if is_button { driven_over(ways) } else { viewed(ways, &travel.detector) };
        let missed: f64 = if is_button { MISSED_BY_BUTTON } else { MISSED_BY_CAMERA };
        let missed_at = |n: u8| missed.powi(i32::from(n));
        Self { missed: looks.into_iter().map(|(cell, n)| (cell, missed_at(n))).collect() }
    }

    /// Takes in what another travel has looked at, whose frame lies at `self_from_other` in this one.
    pub fn join(&mut self, other: &Self, self_from_other: Pose) {
        let mut missed = BTreeMap::new();
        for (&cell, &chance) in &other.missed {
            if let Some(cell) = cell_at(self_from_other * center_of(cell)) {
                let least = missed.entry(cell).or_insert(1.0_f64);
                *least = least.min(chance);
            }
        }
        for (cell, chance) in missed {
            *self.missed.entry(cell).or_insert(1.0) *= chance;
        }
    }

    /// Chance that a landmark there was noticed.
    pub fn noticed(&self, place: Point2<f64>) -> f64 {
        let missed = cell_at(place).and_then(|cell| self.missed.get(&cell));
        missed.map_or(0.0, |&missed| noticed(missed))
    }

    /// Area looked at, in square metres, each part as much as it would have been noticed.
    pub fn area_m2(&self) -> f64 {
        self.missed.values().copied().map(noticed).sum::<f64>() * CELL_M * CELL_M
    }

    /// Area that both looked at, in square metres, if the other's frame lies there.
    pub fn common_m2(&self, other: &Self, self_from_other: Pose) -> f64 {
        let both = other.missed.iter().map(|(&cell, &missed)| {
            noticed(missed) * self.noticed(self_from_other * center_of(cell))
        });
        both.sum::<f64>() * CELL_M * CELL_M
    }

    /// Lower-left and upper-right corner of all that was looked at; `None` if it is nothing.
    pub(crate) fn corners(&self) -> Option<(Point2<f64>, Point2<f64>)> {
        let mut cells = self.missed.keys().copied().map(center_of);
        let first = cells.next()?;
        let least = |a: Point2<f64>, b: Point2<f64>| Point2::new(a.x.min(b.x), a.y.min(b.y));
        let most = |a: Point2<f64>, b: Point2<f64>| Point2::new(a.x.max(b.x), a.y.max(b.y));
        Some(cells.fold((first, first), |(min, max), at| (least(min, at), most(max, at))))
    }
}

fn noticed(missed: f64) -> f64 {
    (1.0 - missed).min(NOTICED_MAX)
}

/// How often each cell was driven over, once a way between steps.
fn driven_over<'a>(ways: impl Iterator<Item = &'a [Pose]>) -> BTreeMap<(i32, i32), u8> {
    let mut looks = BTreeMap::new();
    let mut before: Option<Pose> = None;
    for way in ways {
        let mut cells = BTreeSet::new();
        for &pose in way {
            let from = before.replace(pose).unwrap_or(pose);
            let length_m = (pose.position() - from.position()).norm();
            let n_parts = (length_m / CELL_M).ceil().clamp(1.0, 1000.0);
            let mut part = 1.0;
            while part <= n_parts {
                let at = from.position() + (pose.position() - from.position()) * (part / n_parts);
                for cell in cells_around(at, REACHED_M) {
                    cells.insert(cell);
                }
                part += 1.0;
            }
        }
        for cell in cells {
            count(&mut looks, cell);
        }
    }
    looks
}

/// How often each cell was in view.
fn viewed<'a>(
    ways: impl Iterator<Item = &'a [Pose]>,
    detector: &Detector,
) -> BTreeMap<(i32, i32), u8> {
    let reach_m = (detector.range_max_m * SURE_SHARE).min(SURE_RANGE_MAX_M);
    let half_rad = detector.half_field_of_view_rad * SIDE_SHARE;
    let mut looks = BTreeMap::new();
    let mut last: Option<Pose> = None;
    for &pose in ways.flatten() {
        let is_new = last.is_none_or(|last| {
            let moved = last.step_to(pose);
            LOOK_M <= moved.distance_m() || LOOK_RAD <= moved.theta_rad.abs()
        });
        if !is_new || !pose.is_finite() {
            continue;
        }
        last = Some(pose);
        let robot_from_map = pose.inverse();
        for cell in cells_around(pose.position(), reach_m) {
            let seen = robot_from_map * center_of(cell);
            if seen.y.atan2(seen.x).abs() <= half_rad {
                count(&mut looks, cell);
            }
        }
    }
    looks
}

fn count(looks: &mut BTreeMap<(i32, i32), u8>, cell: (i32, i32)) {
    let n = looks.entry(cell).or_insert(0);
    *n = n.saturating_add(1).min(N_LOOKS_MAX);
}

/// Cells whose centers are within `reach_m` of a place.
#[expect(clippy::cast_possible_truncation, reason = "at most twenty metres in cells")]
fn cells_around(place: Point2<f64>, reach_m: f64) -> impl Iterator<Item = (i32, i32)> {
    let reach = (reach_m / CELL_M).ceil() as i32;
    let middle = cell_at(place);
    let around = move |(x, y): (i32, i32)| {
        (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| (x + dx, y + dy)))
    };
    let is_near = move |&cell: &(i32, i32)| (center_of(cell) - place).norm() <= reach_m;
    middle.into_iter().flat_map(around).filter(is_near)
}

/// `None` for what is not finite, or farther than any building.
#[expect(clippy::cast_possible_truncation, reason = "checked before")]
fn cell_at(place: Point2<f64>) -> Option<(i32, i32)> {
    let (x, y) = ((place.x / CELL_M).floor(), (place.y / CELL_M).floor());
    let is_inside = x.abs() < CELLS_MAX && y.abs() < CELLS_MAX;
    is_inside.then_some((x as i32, y as i32))
}

/// Cells are not numbered beyond.
const CELLS_MAX: f64 = 1e8;

fn center_of((x, y): (i32, i32)) -> Point2<f64> {
    Point2::new((f64::from(x) + 0.5) * CELL_M, (f64::from(y) + 0.5) * CELL_M)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::motion::Motion;
    use crate::travel::Step;

    /// Ten metres straight on.
    fn coverage(detector: Detector) -> Coverage {
        let step = |legs| Step { motion: Motion::new(legs), sightings: Vec::new() };
        let steps = vec![step(Vec::new()), step(vec![Pose::new(0.5, 0.0, 0.0); 20])];
        let poses = [Pose::IDENTITY, Pose::new(10.0, 0.0, 0.0)];
        Coverage::of(&Travel { detector, steps }, &poses, &Calibration::NONE)
    }

    #[test]
    fn a_button_notices_what_is_driven_over() {
        let button = coverage(Detector { range_max_m: 0.0, half_field_of_view_rad: PI });
        assert!((button.noticed(Point2::new(5.0, 0.1)) - 0.9).abs() < 1e-9, "driven over once");
        assert_eq!(button.noticed(Point2::new(5.0, 2.0)), 0.0, "beside");
        assert!((button.area_m2() - 9.0).abs() < 2.0, "a stripe: {} m2", button.area_m2());
        let across = Pose::new(5.0, -5.0, PI / 2.0);
        let common_m2 = button.common_m2(&button, across);
        assert!(0.3 < common_m2 && common_m2 < 2.0, "where stripes cross: {common_m2} m2");
    }

    #[test]
    fn a_camera_notices_what_is_ahead() {
        let camera = coverage(Detector { range_max_m: 8.0, half_field_of_view_rad: 0.6 });
        assert!(0.8 < camera.noticed(Point2::new(9.0, 0.0)), "ahead many times");
        assert_eq!(camera.noticed(Point2::new(-1.0, 0.0)), 0.0, "behind");
        assert_eq!(camera.noticed(Point2::new(30.0, 0.0)), 0.0, "far away");
        let mut both = camera.clone();
        both.join(&camera, Pose::new(0.0, 20.0, 0.0));
        assert!((both.area_m2() - 2.0 * camera.area_m2()).abs() < 1.0, "side by side");
        assert_eq!(camera.noticed(Point2::new(f64::NAN, 0.0)), 0.0, "nowhere");
    }
}
