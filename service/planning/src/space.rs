//! Where a robot can go, step by step.
//!
//! Eight neighbours; a diagonal step needs both cells beside it, so that no corner is cut. Every
//! step goes both ways at the same cost.

use meetpoint_geometry::GridInfo;

use crate::cost::{Cost, DIAGONAL, STRAIGHT, WEIGHT_ONE};

/// Steps between the cells of a rectangle whose outermost ring is never entered.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    info: GridInfo,
    /// By which of the eight steps a cell can be left; bit k is step k.
    moves: Vec<u8>,
    /// Invariant: at least [`WEIGHT_ONE`] where the cell can be entered, 0 elsewhere.
    weights: Vec<u8>,
}

/// Why cells make no space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSpace {
    /// Not one weight a cell.
    #[error("{n_weights} weights for {n_cells} cells")]
    WrongLength {
        /// Given.
        n_weights: usize,
        /// Wanted.
        n_cells: usize,
    },
}

impl Space {
    /// Cells of `info` with their weights, 0 where a cell cannot be entered; smaller weights than
    /// [`WEIGHT_ONE`] are taken for it. The outermost ring is closed.
    ///
    /// # Errors
    /// If there is not one weight a cell.
    pub fn new(info: GridInfo, mut weights: Vec<u8>) -> Result<Self, InvalidSpace> {
        let n_cells = info.n_cells();
        if weights.len() != n_cells {
            return Err(InvalidSpace::WrongLength { n_weights: weights.len(), n_cells });
        }
        let (width, height) = (info.width as usize, info.height as usize);
        for (index, weight) in weights.iter_mut().enumerate() {
            let (x, y) = (index % width, index / width);
            let is_rim = x == 0 || x + 1 == width || y == 0 || y + 1 == height;
            if is_rim {
                *weight = 0;
            } else if 0 < *weight {
                *weight = (*weight).max(WEIGHT_ONE);
            }
        }
        let mut space = Self { info, moves: vec![0; n_cells], weights };
        for index in 0..n_cells {
            space.moves[index] = space.moves_from(index);
        }
        Ok(space)
    }

    /// Cells that can be entered all cost their length.
    ///
    /// # Errors
    /// If there is not one word a cell.
    pub fn uniform(info: GridInfo, is_enterable: &[bool]) -> Result<Self, InvalidSpace> {
        let weights = is_enterable.iter().map(|&is| if is { WEIGHT_ONE } else { 0 }).collect();
        Self::new(info, weights)
    }

    /// Which cells.
    pub fn info(&self) -> GridInfo {
        self.info
    }

    /// Whether a cell can be entered, by its place in row-major data.
    ///
    /// # Panics
    /// If `index` is not below the number of cells; true of all functions here that take one.
    pub fn is_enterable(&self, index: usize) -> bool {
        0 < self.weights[index]
    }

    /// Weight of a cell, in parts of [`WEIGHT_ONE`]; 0 if it cannot be entered.
    pub fn weight(&self, index: usize) -> u8 {
        self.weights[index]
    }

    /// By which steps a cell can be left: bit k for step k of [`Self::neighbor`].
    pub fn moves(&self, index: usize) -> u8 {
        self.moves[index]
    }

    /// The cell one step away: steps counter-clockwise from +x, odd ones diagonal. The cell must
    /// not lie on the outermost ring.
    pub fn neighbor(&self, index: usize, step: usize) -> usize {
        let width = self.info.width as usize;
        match step {
            0 => index + 1,
            1 => index + width + 1,
            2 => index + width,
            3 => index + width - 1,
            4 => index - 1,
            5 => index - width - 1,
            6 => index - width,
            _ => index + 1 - width,
        }
    }

    /// The cells that one step leads to, each with the step.
    pub fn steps(&self, index: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let moves = self.moves[index];
        let is_open = move |step: &usize| moves >> step & 1 == 1;
        (0..8).filter(is_open).map(move |step| (step, self.neighbor(index, step)))
    }

    /// What the step from one cell to its neighbour costs.
    pub fn step_cost(&self, from: usize, step: usize) -> Cost {
        let to = self.neighbor(from, step);
        weighted(step, self.weights[from], self.weights[to])
    }

    fn moves_from(&self, index: usize) -> u8 {
        if self.weights[index] == 0 {
            return 0;
        }
        let is_open = |step: usize| 0 < self.weights[self.neighbor(index, step)];
        let mut moves = 0;
        for step in 0..8 {
            let is_free_beside = step % 2 == 0 || is_open(step - 1) && is_open((step + 1) % 8);
            if is_free_beside && is_open(step) {
                moves |= 1 << step;
            }
        }
        moves
    }
}

/// Steps in the order in which they are tried, relative to the one towards a goal.
pub(crate) const FORWARD_FIRST: [usize; 8] = [0, 1, 7, 2, 6, 3, 5, 4];

/// The step that leads most nearly from one cell towards another, both by column
/// and row.
pub(crate) fn toward(from: [usize; 2], to: [usize; 2]) -> usize {
    match [0, 1].map(|axis| to[axis].cmp(&from[axis]) as i8) {
        [1, 1] => 1,
        [0, 1] => 2,
        [-1, 1] => 3,
        [-1, 0] => 4,
        [-1, -1] => 5,
        [0, -1] => 6,
        [1, -1] => 7,
        _ => 0,
    }
}

/// Cost of a step between two cells of these weights. Rounded down; exact for [`WEIGHT_ONE`].
pub(crate) fn weighted(step: usize, a: u8, b: u8) -> Cost {
    let length = if step.is_multiple_of(2) { STRAIGHT } else { DIAGONAL };
    length * (Cost::from(a) + Cost::from(b)) / (2 * Cost::from(WEIGHT_ONE))
}
