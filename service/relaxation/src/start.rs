//! Where a travel begins: alpha(1) (TBF98 equation (14)), or anywhere within an area (section 8).

use meetpoint_geometry::Pose;

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
    /// It is within this area, with any heading.
    Within(Area),
}

impl StartBelief {
    /// As probabilities on a grid; none at all if the start is outside of it.
    pub(crate) fn on(&self, grid: &PoseGrid) -> Belief {
        match self {
            Self::At(pose) => at(grid, *pose),
            Self::Within(area) => Belief::uniform(grid, |pose| {
                let (min, max) = (area.min, area.max);
                let across = min.x <= pose.x_m && pose.x_m <= max.x;
                across && min.y <= pose.y_m && pose.y_m <= max.y
            }),
        }
    }
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
        let anywhere = StartBelief::Within(area).on(&grid);
        assert_eq!(anywhere.n_cells(), 7 * 7 * 72, "all of them");
        assert!((anywhere.sum() - 1.0).abs() < 1e-4, "one in all");
    }
}
