//! The grid that a travel asks for: area and resolutions from the data.
//!
//! The area holds dead reckoning's path with three standard deviations of what it may be off at
//! each step, by the second moments of `motion_model.rs` carried from step to step. Nodes are as
//! far apart as twice what sightings leave open, because finer ones tell nothing more, and
//! headings such that a robot comes off by half a node over a usual way between steps; both within
//! bounds of which the coarse ones are the paper's, and coarser where there would be too many nodes.

use meetpoint_geometry::{Point2, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::calibration::Calibration;
use crate::motion_model::MotionParams;
use crate::perception::PerceptionParams;
use crate::pose_grid::{Area, InvalidGrid, PoseGrid};
use crate::travel::Travel;

/// Within so many standard deviations a path is looked for.
const N_STD: f64 = 3.0;

/// Nodes are not farther apart: the paper's, in metres.
const RESOLUTION_MAX_M: f64 = 1.0;

/// Nor nearer, in metres: least squares do better from there on.
const RESOLUTION_MIN_M: f64 = 0.1;

/// Headings: five degrees, the paper's, to two degrees.
const N_HEADINGS: (f64, f64) = (72.0, 180.0);

/// Nodes that a grid has at most; the paper's has 8,100. Beliefs take no more for a large grid, but
/// maps do.
const N_NODES_MAX: f64 = 250_000.0;

/// The grid for a travel that begins at the frame's origin.
///
/// # Errors
/// [`InvalidGrid`] if the travel is not finite, or too wide for any grid.
#[expect(clippy::cast_possible_truncation, reason = "between 4 and 180")]
#[expect(clippy::cast_sign_loss, reason = "between 4 and 180")]
pub fn grid_for(
    travel: &Travel,
    calibration: &Calibration,
    motion: &MotionParams,
    perception: &PerceptionParams,
) -> Result<PoseGrid, InvalidGrid> {
    if !travel.dead_reckoning(calibration).iter().all(|pose| pose.is_finite()) {
        return Err(InvalidGrid::Area);
    }
    let area = area(travel, calibration, motion, perception);
    let size = area.max - area.min;
    let coarse_m = (size.x.max(1.0) * size.y.max(1.0) / N_NODES_MAX).sqrt();
    let resolution_m = resolution_m(travel, perception).max(coarse_m);
    let mut ways: Vec<f64> = travel.steps.iter().map(|step| step.motion.distance_m()).collect();
    ways.sort_by(f64::total_cmp);
    let usual_m = ways.get(ways.len() / 2).copied().unwrap_or(0.0).max(resolution_m);
    let headings = std::f64::consts::TAU * usual_m / resolution_m;
    let headings = headings.clamp(N_HEADINGS.0, N_HEADINGS.1);
    PoseGrid::new(area, resolution_m, (headings / 4.0).round() as u32 * 4)
}

/// The grid for travels that begin at these poses: as fine as the one that asks for the finest, as far as
/// there are not too many nodes.
///
/// # Errors
/// [`InvalidGrid`] if there is no travel, one of them is not finite, or all are too wide for any grid.
pub(crate) fn grid_for_all(
    travels: &[(&Travel, &Calibration, Pose)],
    motion: &MotionParams,
    perception: &PerceptionParams,
) -> Result<PoseGrid, InvalidGrid> {
    let grids: Result<Vec<(PoseGrid, Pose)>, InvalidGrid> = travels
        .iter()
        .map(|(travel, calibration, start)| {
            Ok((grid_for(travel, calibration, motion, perception)?, *start))
        })
        .collect();
    let grids = grids?;
    let corners = grids.iter().flat_map(|(grid, start)| {
        let Area { min, max } = grid.area();
        [min, max, Point2::new(min.x, max.y), Point2::new(max.x, min.y)].map(|it| *start * it)
    });
    let nothing = Area {
        min: Point2::new(f64::INFINITY, f64::INFINITY),
        max: Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };
    let area = corners.fold(nothing, |area, at| Area {
        min: Point2::new(area.min.x.min(at.x), area.min.y.min(at.y)),
        max: Point2::new(area.max.x.max(at.x), area.max.y.max(at.y)),
    });
    let size = area.max - area.min;
    let coarse_m = (size.x * size.y / N_NODES_MAX).sqrt();
    let fine_m = grids.iter().map(|(grid, _)| grid.resolution_m()).fold(f64::INFINITY, f64::min);
    let n_headings = grids.iter().map(|(grid, _)| grid.n_headings()).max();
    PoseGrid::new(area, fine_m.max(coarse_m), n_headings.unwrap_or_default())
}

/// Twice what the better half of the sightings leaves open.
fn resolution_m(travel: &Travel, perception: &PerceptionParams) -> f64 {
    let sightings = travel.steps.iter().flat_map(|step| &step.sightings);
    let std_m = sightings.map(|sighting| {
        let along = perception.range_std_share * sighting.range_m;
        let across = perception.bearing_std_rad * sighting.range_m;
        perception.position_std_m.hypot(along.min(across))
    });
    let mut std_m: Vec<f64> = std_m.collect();
    std_m.sort_by(f64::total_cmp);
    let usual_m = std_m.get(std_m.len() / 2).copied().unwrap_or(RESOLUTION_MAX_M);
    (2.0 * usual_m).clamp(RESOLUTION_MIN_M, RESOLUTION_MAX_M)
}

/// Where the robot and what it saw may be.
fn area(
    travel: &Travel,
    calibration: &Calibration,
    params: &MotionParams,
    perception: &PerceptionParams,
) -> Area {
    let margin_m = 2.0 * RESOLUTION_MAX_M + N_STD * perception.position_std_m;
    let mut covariance = Matrix3::zeros();
    let (mut min, mut max) = (Point2::new(0.0_f64, 0.0), Point2::new(0.0_f64, 0.0));
    let mut before: Option<Pose> = None;
    for (step, pose) in travel.steps.iter().zip(travel.dead_reckoning(calibration)) {
        if let Some(before) = before.replace(pose) {
            let way = pose.position() - before.position();
            let mut by_before = Matrix3::identity();
            by_before[(0, 2)] = -way.y;
            by_before[(1, 2)] = way.x;
            let of_turn = params.rotation_variance_rad2(&step.motion);
            let of_length = params.translation_variance_m2(&step.motion);
            let aside = Vector3::new(-way.y / 2.0, way.x / 2.0, 1.0);
            let along = way.try_normalize(0.0).unwrap_or_default();
            let along = Vector3::new(along.x, along.y, 0.0);
            covariance = by_before * covariance * by_before.transpose()
                + aside * aside.transpose() * of_turn
                + along * along.transpose() * of_length;
        }
        let seen = step.sightings.iter().map(|sighting| sighting.range_m);
        let reach_m = seen.fold(0.0, f64::max) + margin_m;
        let off_x = N_STD * covariance[(0, 0)].sqrt() + reach_m;
        let off_y = N_STD * covariance[(1, 1)].sqrt() + reach_m;
        min = Point2::new(min.x.min(pose.x_m - off_x), min.y.min(pose.y_m - off_y));
        max = Point2::new(max.x.max(pose.x_m + off_x), max.y.max(pose.y_m + off_y));
    }
    Area { min, max }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Motion;
    use crate::travel::{Detector, Sighting, Step};

    fn straight(range_m: f64, n_steps: usize) -> Travel {
        let sighting = Sighting { identity: None, landmark_type: 0, range_m, bearing_rad: 0.0 };
        let detector = Detector { range_max_m: range_m, half_field_of_view_rad: 1.0 };
        let leg = Pose::new(10.0, 0.0, 0.0);
        let steps = (0..n_steps).map(|step| Step {
            motion: if step == 0 { Motion::NONE } else { Motion::new(vec![leg]) },
            sightings: vec![sighting],
        });
        Travel { detector, steps: steps.collect() }
    }

    fn chosen(travel: &Travel, perception: &PerceptionParams) -> Result<PoseGrid, InvalidGrid> {
        grid_for(travel, &Calibration::NONE, &MotionParams::CARPET, perception)
    }

    #[test]
    fn holds_the_path_and_what_it_may_be_off() {
        let grid = chosen(&straight(0.0, 6), &PerceptionParams::BUTTON).expect("a grid");
        let area = grid.area();
        assert!(area.min.x < -2.0 && 55.0 < area.max.x, "the path and more: {area:?}");
        // A heading that wanders is off by more across than along.
        let (ahead, aside) = (area.max.x - 50.0, area.max.y);
        assert!(ahead < aside && aside < 40.0, "{ahead} m ahead, {aside} m aside");
        assert_eq!(grid.resolution_m(), 1.0, "no finer than a button tells");
    }

    #[test]
    fn a_grid_for_two_holds_both() {
        let (travel, params) = (straight(0.0, 3), PerceptionParams::BUTTON);
        let back = Pose::new(60.0, 5.0, std::f64::consts::PI);
        let both = [Pose::IDENTITY, back].map(|start| (&travel, &Calibration::NONE, start));
        let grid = grid_for_all(&both, &MotionParams::CARPET, &params).expect("a grid");
        let alone = chosen(&travel, &params).expect("a grid");
        assert_eq!(grid.resolution_m(), alone.resolution_m(), "as fine");
        assert!(alone.area().min.x <= -2.0 && 61.0 <= grid.area().max.x, "{:?}", grid.area());
        let none = grid_for_all(&[], &MotionParams::CARPET, &params);
        assert!(none.is_err(), "nobody needs none");
    }

    #[test]
    fn sharp_sightings_ask_for_a_fine_grid() {
        let sharp = PerceptionParams { position_std_m: 0.1, ..PerceptionParams::BUTTON };
        let grid = chosen(&straight(0.5, 3), &sharp).expect("a grid");
        assert!(grid.resolution_m() < 0.3, "{} m", grid.resolution_m());
        assert!(72 <= grid.n_headings(), "{} headings", grid.n_headings());
        assert!(chosen(&straight(f64::NAN, 3), &sharp).is_ok(), "no range is no harm");
        let mut nowhere = straight(0.0, 3);
        nowhere.steps[1].motion = Motion::new(vec![Pose::new(f64::INFINITY, 0.0, 0.0)]);
        assert_eq!(chosen(&nowhere, &sharp), Err(InvalidGrid::Area), "not finite");
    }
}
