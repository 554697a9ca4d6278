//! Sonar drawn into the grid: the evidence of one firing for each cell that it speaks of (T98 2.2).
//!
//! Sonar draws only cells that no laser has ever looked at, and the first look of a laser forgets what was
//! heard of a cell: a beam knows to a centimetre where a wall is that a cone blurs over decimetres. So with
//! both on one map, every cell that a laser looked at is as if there were no sonar. A pane of glass that a
//! laser looks through therefore stays free; one that throws its beams away is drawn from sonar. Cells of
//! an imported map count as looked at.

use std::sync::Arc;

use meetpoint_geometry::{Cell, Pose};

use super::interpretation::Interpretation;
use crate::beam::BeamModel;
use crate::grid::{GRID_REACH_CELLS, Grid};
use crate::scan_marks::tile_place;
use crate::tile::Tile;

impl Grid {
    /// Adds what a firing of sonars says, heard from `map_from_robot`, to the cells around it that no
    /// laser has looked at, by the same prior, decay and bounds as a laser's readings. A pose that is
    /// not finite or beyond the grid's reach draws nothing.
    pub fn insert_sonar(
        &mut self,
        map_from_robot: Pose,
        heard: &Interpretation,
        model: &BeamModel,
    ) {
        self.add_heard(map_from_robot, heard, |tile, index, evidence| {
            tile.set_heard(index, model.updated(tile.log_odds()[index], evidence));
        });
    }

    /// The same, to what robots without a laser are followed by, and to nothing that is drawn.
    pub fn insert_followed(
        &mut self,
        map_from_robot: Pose,
        heard: &Interpretation,
        model: &BeamModel,
    ) {
        self.add_heard(map_from_robot, heard, |tile, index, evidence| {
            tile.set_followed(index, model.updated(tile.followed_log_odds(index), evidence));
        });
    }

    /// Hands `add` each cell around a firing that is for sonar, with its evidence.
    fn add_heard(
        &mut self,
        map_from_robot: Pose,
        heard: &Interpretation,
        add: impl Fn(&mut Tile, usize, f32),
    ) {
        let (frame, reach_m) = (self.frame(), heard.reach_m());
        let limit_m = f64::from(GRID_REACH_CELLS) * frame.resolution_m() - reach_m;
        let is_near = |at_m: f64| at_m.abs() < limit_m;
        if !(map_from_robot.is_finite()
            && is_near(map_from_robot.x_m)
            && is_near(map_from_robot.y_m))
        {
            return;
        }
        let robot_from_map = map_from_robot.inverse();
        let middle = map_from_robot.position();
        let corner = |side_m: f64| frame.cell_at(middle.map(|at_m| at_m + side_m));
        let (low, high) = (corner(-reach_m), corner(reach_m));
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let cell = Cell { x, y };
                let evidence = heard.evidence(robot_from_map * frame.center_of(cell));
                if evidence == 0.0 {
                    continue;
                }
                let (tile, index) = tile_place(cell);
                let tile = self.tiles.entry(tile).or_insert_with(|| Arc::new(Tile::unknown()));
                if tile.is_for_sonar(index) {
                    add(Arc::make_mut(tile), index, evidence);
                }
            }
        }
    }
}
