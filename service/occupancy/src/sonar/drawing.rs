//! Sonar drawn into the grid: the evidence of one firing for each cell that it speaks of (T98 2.2).

use std::sync::Arc;

use meetpoint_geometry::{Cell, Pose};

use super::interpretation::Interpretation;
use crate::beam::BeamModel;
use crate::grid::{GRID_REACH_CELLS, Grid};
use crate::scan_marks::tile_place;
use crate::tile::Tile;

impl Grid {
    /// Adds what a firing of sonars says, heard from `map_from_robot`, to the cells around it, by the
    /// same prior, decay and bounds as the laser's readings; gives back the cells ever hit by a laser
    /// among them. A pose that is not finite or beyond the grid's reach draws nothing.
    pub fn insert_sonar(
        &mut self,
        map_from_robot: Pose,
        heard: &Interpretation,
        model: &BeamModel,
    ) -> Vec<Cell> {
        let (frame, reach_m) = (self.frame(), heard.reach_m());
        let limit_m = f64::from(GRID_REACH_CELLS) * frame.resolution_m() - reach_m;
        let is_near = |at_m: f64| at_m.abs() < limit_m;
        let mut changed = Vec::new();
        if !(map_from_robot.is_finite()
            && is_near(map_from_robot.x_m)
            && is_near(map_from_robot.y_m))
        {
            return changed;
        }
        let robot_from_map = map_from_robot.inverse();
        let middle = map_from_robot.position();
        let corner = |side_m: f64| frame.cell_at(middle.map(|at_m| at_m + side_m));
        let (low, high) = (corner(-reach_m), corner(reach_m));
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let cell = Cell { x, y };
                let evidence = heard.evidence(robot_from_map * frame.center_of(cell));
                if evidence != 0.0 && self.add(cell, evidence, model) {
                    changed.push(cell);
                }
            }
        }
        changed
    }

    /// Adds evidence to a cell; whether a laser ever hit it.
    fn add(&mut self, cell: Cell, evidence: f32, model: &BeamModel) -> bool {
        let (tile, index) = tile_place(cell);
        let tile = self.tiles.entry(tile).or_insert_with(|| Arc::new(Tile::unknown()));
        let tile = Arc::make_mut(tile);
        tile.set_log_odds(index, model.updated(tile.log_odds()[index], evidence));
        tile.hit_mean(index).is_some()
    }
}
