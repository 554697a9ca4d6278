//! Points of free space, drawn at random.

use anyhow::Context;
use meetpoint_client::{Client, v1};
use meetpoint_sim::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::question::{Question, Shape, matrix};

/// Cells of a smaller probability of being occupied are free, in percent.
const FREE_BELOW_PERCENT: u8 = 50;
/// Starts of a matrix, and goals.
const MATRIX_SIDE: usize = 100;
/// So many draws for every pair that is wanted, at most: free space may lie in pieces.
const DRAWS_PER_PAIR_MAX: usize = 20;

/// Centres of free cells, and the generator that draws from them.
pub(super) struct FreePoints {
    points: Vec<v1::Point>,
    rng: ChaCha8Rng,
}

impl FreePoints {
    /// The free cells of a grid.
    ///
    /// # Errors
    /// If there are none.
    pub(super) fn new(grid: &v1::Grid, seed: u64) -> anyhow::Result<Self> {
        let origin = grid.origin.unwrap_or_default();
        let width = grid.width.max(1) as usize;
        let centre = |index: usize| v1::Point {
            x_m: origin.x_m + ((index % width) as f64 + 0.5) * grid.resolution_m,
            y_m: origin.y_m + ((index / width) as f64 + 0.5) * grid.resolution_m,
        };
        let cells = grid.cells.iter().enumerate();
        let free = cells.filter(|&(_, &percent)| percent < FREE_BELOW_PERCENT);
        let points: Vec<v1::Point> = free.map(|(index, _)| centre(index)).collect();
        anyhow::ensure!(!points.is_empty(), "the map has no free cell");
        Ok(Self { points, rng: ChaCha8Rng::seed_from_u64(seed) })
    }

    /// How many free cells there are.
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// Two points, drawn one by one.
    pub(super) fn pair(&mut self) -> [v1::Point; 2] {
        [self.point(), self.point()]
    }

    /// A matrix between points.
    pub(super) fn matrix(&mut self, map: &str) -> Question {
        let [starts, goals] =
            [0, 1].map(|_| (0..MATRIX_SIDE).map(|_| self.point()).collect::<Vec<_>>());
        matrix(map, starts, goals)
    }

    /// `n` pairs that a way leads between.
    ///
    /// # Errors
    /// If the service fails, or free space lies in too many pieces.
    pub(super) async fn connected_pairs(
        &mut self,
        client: &Client,
        map: &str,
        n: usize,
    ) -> anyhow::Result<Vec<[v1::Point; 2]>> {
        let mut pairs = Vec::with_capacity(n);
        for _ in 0..n.saturating_mul(DRAWS_PER_PAIR_MAX) {
            let pair = self.pair();
            let Question::Path(request) = Shape::Route.of_pair(map, pair) else { continue };
            let reply = client.plan_path(request).await.context("a pair could not be asked for")?;
            if reply.code() == v1::PlanCode::Ok {
                pairs.push(pair);
            }
            if pairs.len() == n {
                return Ok(pairs);
            }
        }
        let share = 1.0 / DRAWS_PER_PAIR_MAX as f64;
        anyhow::bail!("a way leads between fewer than {share} of all pairs of free cells")
    }

    fn point(&mut self) -> v1::Point {
        self.points[self.rng.random_range(0..self.points.len())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_free_cells_are_drawn() {
        let grid = v1::Grid {
            resolution_m: 0.5,
            origin: Some(v1::Point { x_m: 10.0, y_m: -1.0 }),
            width: 3,
            height: 2,
            cells: vec![255, 100, 255, 50, 255, 2],
            ..v1::Grid::default()
        };
        let mut points = FreePoints::new(&grid, 7).expect("one is free");
        assert_eq!(points.len(), 1, "unknown and occupied cells are not free");
        let centre = v1::Point { x_m: 11.25, y_m: -0.25 };
        assert_eq!(points.pair(), [centre; 2], "its centre");
        let nothing = v1::Grid { cells: vec![255; 6], ..grid };
        assert!(FreePoints::new(&nothing, 7).is_err(), "nothing is free");
    }
}
