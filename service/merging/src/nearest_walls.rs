//! For every cell of a ground the nearest wall, as far as one is near.

use meetpoint_geometry::{Cell, Point2};

use crate::ground::Ground;
use crate::walls::Wall;

/// Walls farther than this are not near, in metres.
pub(crate) const REACH_M: f64 = 0.8;
/// Stands for no wall.
const NONE: u32 = u32::MAX;

/// The nearest walls.
#[derive(Clone, Debug)]
pub(crate) struct NearestWalls {
    /// In the order of the ground's cells: by the distance from the cell's middle.
    indices: Vec<u32>,
}

impl NearestWalls {
    /// Of some walls. Time O(walls).
    pub(crate) fn new(ground: &Ground, walls: &[Wall]) -> Self {
        let n_cells = ground.info.n_cells();
        let (mut indices, mut squares) = (vec![NONE; n_cells], vec![f32::INFINITY; n_cells]);
        #[expect(clippy::cast_possible_truncation, reason = "a few cells")]
        let (reach, reach2) =
            ((REACH_M / ground.edge_m()).ceil() as i32, (REACH_M * REACH_M) as f32);
        for (number, wall) in (0_u32..).zip(walls) {
            let cell = ground.info.frame.cell_at(wall.at);
            for y in cell.y - reach..=cell.y + reach {
                for x in cell.x - reach..=cell.x + reach {
                    let near = Cell { x, y };
                    let Some(index) = ground.info.index_of(near) else { continue };
                    #[expect(clippy::cast_possible_truncation, reason = "a distance of cells")]
                    let square =
                        (ground.info.frame.center_of(near) - wall.at).norm_squared() as f32;
                    if square <= reach2 && square < squares[index] {
                        squares[index] = square;
                        indices[index] = number;
                    }
                }
            }
        }
        Self { indices }
    }

    /// The wall nearest to the middle of the cell that holds a point.
    #[inline]
    pub(crate) fn near<'a>(
        &self,
        ground: &Ground,
        walls: &'a [Wall],
        point: Point2<f64>,
    ) -> Option<&'a Wall> {
        let index = ground.info.index_of(ground.info.frame.cell_at(point))?;
        walls.get(self.indices[index] as usize)
    }
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{GridFrame, GridInfo};
    use meetpoint_occupancy::{Grid, Raster};
    use proptest::prelude::*;

    use super::*;

    /// A free square of 4 m.
    fn ground() -> Ground {
        let frame = GridFrame::new(0.1).expect("a length");
        let info = GridInfo { frame, first: Cell { x: -20, y: -20 }, width: 40, height: 40 };
        let raster = Raster { info, log_odds: vec![-3.0; info.n_cells()] };
        Ground::of_grid(&Grid::from_raster(&raster)).0
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// By the definition: of all walls the one nearest to the middle of the cell.
        #[test]
        fn finds_the_nearest(
            walls in prop::collection::vec((-2.0_f64..2.0, -2.0_f64..2.0), 1..12),
            (x, y) in (-2.0_f64..2.0, -2.0_f64..2.0),
        ) {
            let wall = |(x, y)| Wall { at: Point2::new(x, y), normal: None, is_one_sided: false };
            let walls: Vec<Wall> = walls.into_iter().map(wall).collect();
            let ground = ground();
            let nearest = NearestWalls::new(&ground, &walls);
            let point = Point2::new(x, y);
            let middle = ground.info.frame.center_of(ground.info.frame.cell_at(point));
            let distance_m = |wall: &Wall| (wall.at - middle).norm();
            let expected_m = walls.iter().map(distance_m).fold(f64::INFINITY, f64::min);
            match nearest.near(&ground, &walls, point) {
                Some(found) => prop_assert!((distance_m(found) - expected_m).abs() < 1e-5),
                None => prop_assert!(REACH_M < expected_m + 1e-5, "a wall {} m away", expected_m),
            }
        }
    }
}
