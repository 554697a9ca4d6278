//! One region as a small grid of its own.
//!
//! The rectangle around the region's cells and a closed margin of one cell, so that a search within
//! the region reads little memory and asks of no cell where it belongs. Time and space O(cells of
//! the rectangle).

use crate::cost::{Cost, WEIGHT_ONE};
use crate::inside::halts::Halts;
use crate::space::{Space, weighted};

/// A cell of a patch, by its column and row there.
pub(super) type Spot = [usize; 2];

/// Columns and rows from a cell to the one that each step leads to.
const OFFSETS: [[isize; 2]; 8] =
    [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

/// The cells of one region, and the steps between them.
#[derive(Debug, PartialEq)]
pub(crate) struct Patch {
    /// Column and row in the space of the patch's cell (0, 0).
    origin: Spot,
    /// Columns of the space.
    space_width: usize,
    width: usize,
    height: usize,
    /// By which of the eight steps a cell can be left within the region; 0 for cells outside.
    moves: Vec<u8>,
    ground: Ground,
}

/// What steps cost, and what helps to search there.
#[derive(Debug, PartialEq)]
pub(super) enum Ground {
    /// All steps cost their length: where straight runs end.
    Even(Halts),
    /// Weights of the cells.
    Weighted(Vec<u8>),
}

impl Patch {
    /// Of `cells`, which are those of one region in row-major order. `is_here` tells whether a
    /// cell is one of them and can be entered.
    pub(crate) fn new(space: &Space, cells: &[u32], is_here: impl Fn(usize) -> bool) -> Self {
        let space_width = space.info().width as usize;
        let spot = |&cell: &u32| [cell as usize % space_width, cell as usize / space_width];
        let mut least = [usize::MAX; 2];
        let mut most = [0; 2];
        for [x, y] in cells.iter().map(spot) {
            least = [least[0].min(x), least[1].min(y)];
            most = [most[0].max(x), most[1].max(y)];
        }
        if cells.is_empty() {
            least = [1; 2];
        }
        // The outermost ring of a space is never entered: there is room for the margin.
        let origin = least.map(|least| least - 1);
        let [width, height] = [0, 1].map(|axis| most[axis] + 2 - origin[axis]);
        let ground = Ground::Weighted(vec![]);
        let moves = vec![0; width * height];
        let mut patch = Self { origin, space_width, width, height, moves, ground };
        let here = || cells.iter().map(|&cell| cell as usize).filter(|&cell| is_here(cell));
        for cell in here() {
            let open = space.steps(cell).filter(|&(_, to)| is_here(to));
            let at = patch.at(patch.spot(cell));
            patch.moves[at] = open.fold(0, |moves, (step, _)| moves | 1 << step);
        }
        patch.ground = if here().all(|cell| space.weight(cell) == WEIGHT_ONE) {
            Ground::Even(Halts::new(&patch))
        } else {
            let mut weights = vec![0; width * height];
            for cell in here() {
                weights[patch.at(patch.spot(cell))] = space.weight(cell);
            }
            Ground::Weighted(weights)
        };
        patch
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    pub(super) fn n_cells(&self) -> usize {
        self.moves.len()
    }

    pub(super) fn ground(&self) -> &Ground {
        &self.ground
    }

    /// Where a cell of the region, by its index in the space, is in the patch.
    pub(super) fn spot(&self, cell: usize) -> Spot {
        [cell % self.space_width - self.origin[0], cell / self.space_width - self.origin[1]]
    }

    /// A cell's index in the space.
    pub(super) fn cell(&self, [x, y]: Spot) -> usize {
        (y + self.origin[1]) * self.space_width + x + self.origin[0]
    }

    /// A cell's index in the patch.
    pub(super) fn at(&self, [x, y]: Spot) -> usize {
        y * self.width + x
    }

    /// The cell of that index in the patch.
    pub(super) fn spot_at(&self, at: usize) -> Spot {
        [at % self.width, at / self.width]
    }

    /// By which steps a cell can be left within the region: bit k for step k.
    pub(super) fn moves(&self, spot: Spot) -> u8 {
        self.moves[self.at(spot)]
    }

    /// How many equal steps from a cell of the region, by its index in the space, stay within the
    /// region; `None` where cells weigh differently.
    pub(crate) fn n_open(&self, cell: usize, step: usize) -> Option<usize> {
        let Ground::Even(_) = self.ground else { return None };
        let mut spot = self.spot(cell);
        let mut n_open = 0;
        while self.moves(spot) >> step & 1 == 1 {
            spot = neighbor(spot, step);
            n_open += 1;
        }
        Some(n_open)
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let ground = match &self.ground {
            Ground::Even(halts) => halts.n_bytes(),
            Ground::Weighted(weights) => weights.len(),
        };
        self.moves.len() + ground
    }
}

/// The cell that one step leads to; it must not lead out of the patch.
pub(super) fn neighbor([x, y]: Spot, step: usize) -> Spot {
    let [dx, dy] = OFFSETS[step];
    [x.wrapping_add_signed(dx), y.wrapping_add_signed(dy)]
}

/// What a step between two cells of those weights costs.
pub(super) fn step_cost(weights: &[u8], from: usize, step: usize, to: usize) -> Cost {
    weighted(step, weights[from], weights[to])
}
