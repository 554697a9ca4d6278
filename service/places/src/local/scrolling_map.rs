//! The scrolling map: a window of fixed size that moves with the robot.
//!
//! HSSH 2004, section I-C: "during travel, a temporary LPM can be used as a scrolling map of the
//! robot's immediate surround". The window moves by whole cells, so that none is drawn again; what
//! it leaves is forgotten. Time O(cells of the window) a shift.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Pose};
use meetpoint_occupancy::{BeamModel, Grid, LaserGeometry, ScanMarks};

use crate::local::perceptual_map::LocalPerceptualMap;

/// A window of cells around a robot, in the frame in which its poses are given: odometry's, as a
/// rule, for nothing far away is kept.
pub struct ScrollingMap {
    grid: Grid,
    /// Cells from the middle to the edge.
    reach: i32,
    /// The window follows when the robot is so many cells from its middle.
    slack: i32,
    middle: Cell,
    marks: ScanMarks,
}

impl ScrollingMap {
    /// A window of `side_m` metres a side around the cell at the origin, with nothing observed. The
    /// robot is within `slack_m` of its middle, along both axes. Lengths that are none give the
    /// least window: one cell.
    pub fn new(frame: GridFrame, side_m: f64, slack_m: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "saturates; bounded by what follows")]
        let cells = |length_m: f64| (length_m / frame.resolution_m()).max(0.0) as i32;
        let reach = cells(side_m / 2.0).min(1 << 12);
        let slack = cells(slack_m).min(reach);
        let middle = Cell { x: 0, y: 0 };
        Self { grid: Grid::new(frame), reach, slack, middle, marks: ScanMarks::new() }
    }

    /// Takes in a scan: the window follows the robot, then the scan is drawn, as far as it lies in
    /// the window.
    pub fn insert_scan(
        &mut self,
        local_from_robot: Pose,
        robot_from_laser: Pose,
        (geometry, ranges_m): (&LaserGeometry, &[f32]),
        model: &BeamModel,
    ) {
        let robot = self.grid.frame().cell_at(local_from_robot.position());
        let is_within = |at: i32, middle: i32| at.abs_diff(middle) <= self.slack.unsigned_abs();
        if !is_within(robot.x, self.middle.x) || !is_within(robot.y, self.middle.y) {
            self.middle = robot;
        }
        let local_from_laser = local_from_robot * robot_from_laser;
        self.grid.insert_scan(local_from_laser, geometry, ranges_m, model, &mut self.marks);
        self.grid = Grid::from_raster(&self.grid.raster(Some(self.window())));
    }

    /// Which cells are kept.
    pub fn window(&self) -> GridInfo {
        let first = Cell {
            x: self.middle.x.saturating_sub(self.reach),
            y: self.middle.y.saturating_sub(self.reach),
        };
        let side = 2 * self.reach.unsigned_abs() + 1;
        GridInfo { frame: self.grid.frame(), first, width: side, height: side }
    }

    /// What is known now, as a map that stays. Its frame is that of the robot's poses.
    pub fn local_map(&self) -> LocalPerceptualMap {
        let raster = self.grid.raster(Some(self.window()));
        LocalPerceptualMap { raster, map_from_local: Pose::IDENTITY }
    }
}
