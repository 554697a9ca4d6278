//! Where a travel begins: alpha(1) (TBF98 equation (14)), about there, or anywhere within an area (section 8).

use meetpoint_geometry::{Pose, angle_between};
use nalgebra::{Matrix3, Vector3};

use crate::belief::Belief;
use crate::layer::Layer;
use crate::perception::single;
use crate::pose_grid::{Area, PoseCell, PoseGrid};
use crate::window::Window;

/// What is known of a travel's first pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartBelief {
    /// It is this one. The paper's is the frame's origin.
    At(Pose),
    /// It is about this one: a normal distribution, as of a travel that was found in the map of others.
    About {
        /// The likeliest.
        pose: Pose,
        /// Of x and y, in metres, and the heading, in radians; row by row.
        covariance: [[f64; 3]; 3],
    },
    /// It is within this area, with any heading.
    Within(Area),
}

/// A pose that is known about is kept within so many standard deviations.
const DEVIATIONS_MAX: f64 = 4.0;
/// Variance of where in its cell a pose is, in squares of the cell's edge: what a grid cannot tell apart.
const WITHIN_CELL: f64 = 1.0 / 12.0;

impl StartBelief {
    /// As probabilities on a grid; none at all if the start is outside of it.
    pub(crate) fn on(&self, grid: &PoseGrid) -> Belief {
        match self {
            Self::At(pose) => at(grid, *pose),
            Self::About { pose, covariance } => about(grid, *pose, covariance),
            Self::Within(area) => Belief::uniform(grid, |pose| {
                let (min, max) = (area.min, area.max);
                let across = min.x <= pose.x_m && pose.x_m <= max.x;
                across && min.y <= pose.y_m && pose.y_m <= max.y
            }),
        }
    }
}

/// A normal distribution, with what the grid leaves open added to its covariance; one pose if that has no
/// inverse.
#[expect(clippy::cast_possible_truncation, reason = "probabilities in single precision")]
fn about(grid: &PoseGrid, pose: Pose, covariance: &[[f64; 3]; 3]) -> Belief {
    let (node_m, step_rad) = (grid.resolution_m(), grid.heading_step_rad());
    let left_open = Vector3::new(node_m, node_m, step_rad).map(|edge| WITHIN_CELL * edge * edge);
    let covariance = Matrix3::from_fn(|row, column| covariance[row][column]);
    let spread = covariance + Matrix3::from_diagonal(&left_open);
    let Some(cholesky) = spread.cholesky().filter(|_| pose.is_finite()) else {
        return at(grid, pose);
    };
    let precision = cholesky.inverse();
    Belief::weighted(grid, |cell| {
        let turn_rad = angle_between(pose.theta_rad, cell.theta_rad);
        let off = Vector3::new(cell.x_m - pose.x_m, cell.y_m - pose.y_m, turn_rad);
        let squares = off.dot(&(precision * off));
        if squares <= DEVIATIONS_MAX.powi(2) { (-squares / 2.0).exp() as f32 } else { 0.0 }
    })
    .selected(0.0)
}

/// One pose, split among the cells around it unless it is one of them.
fn at(grid: &PoseGrid, pose: Pose) -> Belief {
    let nearest = grid.cell_at(pose);
    if !pose.is_finite() || grid.window().index_of(nearest.x, nearest.y).is_none() {
        return Belief::new(vec![Layer::EMPTY; grid.n_headings() as usize]);
    }
    let around = |heading: u32, part: f64| {
        let window = Window { x: nearest.x - 1, y: nearest.y - 1, width: 3, height: 3 };
        let window = window.intersection(grid.window());
        let weight = |(x, y)| {
            let cell = grid.pose_of(PoseCell { x, y, heading });
            let along_x = 1.0 - (grid.in_nodes(cell.x_m - pose.x_m)).abs();
            let along_y = 1.0 - (grid.in_nodes(cell.y_m - pose.y_m)).abs();
            single(part * along_x.max(0.0) * along_y.max(0.0))
        };
        Layer::new(window, window.nodes().map(weight).collect())
    };
    let turn = meetpoint_geometry::angle_between(grid.heading_rad(nearest.heading), pose.theta_rad)
        / grid.heading_step_rad();
    let next = grid.turned(nearest.heading, if turn > 0.0 { 1 } else { -1 });
    let layer = |heading| {
        if heading == nearest.heading {
            around(heading, 1.0 - turn.abs())
        } else if heading == next && turn != 0.0 {
            around(heading, turn.abs())
        } else {
            Layer::EMPTY
        }
    };
    Belief::new((0..grid.n_headings()).map(layer).collect()).selected(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meetpoint_geometry::Point2;

    #[test]
    fn a_known_start_is_one_cell() {
        let area = Area { min: Point2::new(-3.0, -3.0), max: Point2::new(3.0, 3.0) };
        let grid = PoseGrid::new(area, 1.0, 72).expect("a grid");
        let belief = StartBelief::At(Pose::IDENTITY).on(&grid);
        let cell = PoseCell { x: 0, y: 0, heading: 0 };
        assert_eq!(belief.entries().collect::<Vec<_>>(), vec![(cell, 1.0)], "a Dirac");
        let between = StartBelief::At(Pose::new(0.5, 0.25, -0.02)).on(&grid);
        assert!((between.sum() - 1.0).abs() < 1e-6, "split, nothing lost");
        let covariance = [[1.0, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.01]];
        let about = StartBelief::About { pose: Pose::new(0.0, 1.0, 0.1), covariance }.on(&grid);
        assert!((about.sum() - 1.0).abs() < 1e-4, "one in all");
        let mean = about.entries().fold(Vector3::zeros(), |sum, (cell, weight)| {
            let pose = grid.pose_of(cell);
            let turn_rad = angle_between(0.0, pose.theta_rad);
            sum + f64::from(weight) * Vector3::new(pose.x_m, pose.y_m, turn_rad)
        });
        let off = mean - Vector3::new(0.0, 1.0, 0.1);
        assert!(off.amax() < 0.02, "about there: {mean}");
        let anywhere = StartBelief::Within(area).on(&grid);
        assert_eq!(anywhere.n_cells(), 7 * 7 * 72, "all of them");
        assert!((anywhere.sum() - 1.0).abs() < 1e-4, "one in all");
    }
}
