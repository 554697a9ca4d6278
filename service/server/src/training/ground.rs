//! A building to train in, and where in it robots are.

use meetpoint_geometry::{Cell, GridFrame, GridInfo, Point2, Pose};
use meetpoint_occupancy::Raster;
use meetpoint_sim::{Building, ChaCha8Rng, InvalidBuilding};
use rand::RngExt;

/// Robots keep this off walls where nobody has driven, in metres.
const CLEARANCE_M: f64 = 0.3;
/// Places drawn by lot before it is said that a robot can be nowhere.
const N_TRIES: u32 = 100_000;
/// Cells of a recorded building are made about as large as those of simulated ones, in metres: a place is
/// wall if a wall is anywhere in its cell.
const CELL_M: f64 = 0.1;
/// Log-odds of 0.65: what is beyond is wall, as `map_server` takes it.
const WALL: f32 = 0.619;

/// A building, what of it is known, and where robots are.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    building: Building,
    /// Which cells somebody looked at, in the order of the building's; `None`: all are known.
    known: Option<Vec<bool>>,
    /// Poses in the building's frame that robots took; none: they are anywhere that is free.
    poses: Vec<Pose>,
}

/// Why nobody can be trained there.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum NoGround {
    /// It is no building.
    #[error("{0}")]
    Building(#[from] InvalidBuilding),
    /// A robot fits nowhere.
    #[error("no place is {CLEARANCE_M} m off walls: a robot can be nowhere")]
    NowhereFree,
    /// What robots did is not on the grid.
    #[error("none of {0} poses lies on free cells of the grid; are both in one frame?")]
    NoPoseOnGrid(usize),
    /// There is too little to learn from.
    #[error(
        "{n_found} of {n_wanted} places were found: too little of the grid is known near poses"
    )]
    TooFewPlaces {
        /// Places found.
        n_found: usize,
        /// Places asked for.
        n_wanted: usize,
    },
}

impl Ground {
    /// All of a building, which robots may be anywhere in.
    pub(crate) fn of_building(building: Building) -> Self {
        Self { building, known: None, poses: Vec::new() }
    }

    /// A recorded grid, and poses in its frame; without any, robots are wherever it is free.
    ///
    /// # Errors
    /// [`NoGround`] if the grid has no cells, or none of the poses lies on free ones.
    pub(crate) fn recorded(raster: &Raster, map_from_robot: &[Pose]) -> Result<Self, NoGround> {
        let Coarse { info, walls, known } = Coarse::new(raster);
        let building = Building::from_cells(walls, info.width, info.frame.resolution_m())?;
        let corner = raster.info.origin();
        let in_building =
            |pose: &Pose| Pose::new(pose.x_m - corner.x, pose.y_m - corner.y, pose.theta_rad);
        let mut ground = Self { building, known: Some(known), poses: Vec::new() };
        ground.poses = map_from_robot.iter().map(in_building).collect();
        ground.poses.retain(|pose| {
            let cell = info.frame.cell_at(pose.position());
            pose.is_finite()
                && ground.building.info().index_of(cell).is_some()
                && !ground.building.is_wall(cell)
        });
        if ground.poses.is_empty() && !map_from_robot.is_empty() {
            return Err(NoGround::NoPoseOnGrid(map_from_robot.len()));
        }
        Ok(ground)
    }

    /// The building.
    pub(crate) fn building(&self) -> &Building {
        &self.building
    }

    /// Poses that robots took, in order of time; none where they are anywhere.
    pub(crate) fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Whether a cell is wall; `None` where nobody knows.
    pub(crate) fn is_wall(&self, cell: Cell) -> Option<bool> {
        let is_known = self.known.as_ref().is_none_or(|known| {
            self.building.info().index_of(cell).is_some_and(|index| known[index])
        });
        is_known.then(|| self.building.is_wall(cell))
    }

    /// A pose of a robot by lot.
    ///
    /// # Errors
    /// [`NoGround::NowhereFree`].
    pub(crate) fn pose(&self, rng: &mut ChaCha8Rng) -> Result<Pose, NoGround> {
        if !self.poses.is_empty() {
            return Ok(self.poses[rng.random_range(0..self.poses.len())]);
        }
        let info = self.building.info();
        let edge_m = info.frame.resolution_m();
        for _ in 0..N_TRIES {
            let x_m = rng.random_range(0.0..edge_m * f64::from(info.width));
            let y_m = rng.random_range(0.0..edge_m * f64::from(info.height));
            let at = Point2::new(x_m, y_m);
            if self.is_wall(info.frame.cell_at(at)) == Some(false)
                && self.building.is_free(at, CLEARANCE_M)
            {
                return Ok(Pose::new(x_m, y_m, rng.random_range(0.0..std::f64::consts::TAU)));
            }
        }
        Err(NoGround::NowhereFree)
    }
}

/// A grid in cells of about [`CELL_M`]; its first cell is (0, 0).
struct Coarse {
    info: GridInfo,
    walls: Vec<bool>,
    known: Vec<bool>,
}

impl Coarse {
    fn new(raster: &Raster) -> Self {
        let GridInfo { frame, width, height, .. } = raster.info;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "cells are 0.01 to 0.5 m; saturating"
        )]
        let factor = ((CELL_M / frame.resolution_m()).round() as u32).max(1);
        let (columns, rows) = (width.div_ceil(factor), height.div_ceil(factor));
        // A product of a length and a whole number is a length.
        let frame = GridFrame::new(frame.resolution_m() * f64::from(factor)).unwrap_or(frame);
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: columns, height: rows };
        let mut coarse =
            Self { info, walls: vec![false; info.n_cells()], known: vec![false; info.n_cells()] };
        for (index, &log_odds) in raster.log_odds.iter().enumerate() {
            let (x, y) = (index % width as usize, index / width as usize);
            let at = y / factor as usize * columns as usize + x / factor as usize;
            coarse.known[at] |= !log_odds.is_nan();
            coarse.walls[at] |= WALL < log_odds;
        }
        coarse
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// Six by four cells of 0.05 m from (1, -0.1) on: a wall at the right, unknown at the lower left.
    fn raster() -> Raster {
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: 20, y: -2 }, width: 6, height: 4 };
        let log_odds = (0..24).map(|index| match (index % 6, index / 6) {
            (0 | 1, 0 | 1) => f32::NAN,
            (5, _) => 2.0,
            _ => -2.0,
        });
        Raster { info, log_odds: log_odds.collect() }
    }

    #[test]
    fn recorded_grids_are_made_coarser() {
        let ground = Ground::recorded(&raster(), &[]).expect("a building");
        let info = ground.building().info();
        assert_eq!((info.width, info.height), (3, 2), "cells of 0.1 m");
        let said = |x, y| ground.is_wall(Cell { x, y });
        assert_eq!(said(0, 0), None, "nobody looked");
        assert_eq!((said(1, 0), said(0, 1)), (Some(false), Some(false)), "free");
        assert_eq!((said(2, 0), said(2, 1)), (Some(true), Some(true)), "half of them wall");
        assert_eq!(said(3, 0), None, "beyond the grid");
    }

    #[test]
    fn poses_are_those_on_the_grid() {
        let [free, in_wall, beyond] =
            [(1.12, 0.0), (1.27, 0.0), (9.0, 9.0)].map(|(x_m, y_m)| Pose::new(x_m, y_m, 0.5));
        let ground = Ground::recorded(&raster(), &[free, in_wall, beyond]).expect("one is good");
        let pose = ground.pose(&mut ChaCha8Rng::seed_from_u64(1)).expect("the one");
        assert!((pose.x_m - 0.12).abs() < 1e-9 && (pose.y_m - 0.1).abs() < 1e-9, "{pose:?}");
        let none = Ground::recorded(&raster(), &[in_wall, beyond]);
        assert_eq!(none.err(), Some(NoGround::NoPoseOnGrid(2)), "neither is free");
        let narrow = Ground::recorded(&raster(), &[]).expect("a building");
        let pose = narrow.pose(&mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(pose, Err(NoGround::NowhereFree), "0.3 m wide");
    }
}
