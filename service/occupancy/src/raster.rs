//! A rectangle cut out of the grid, dense, for whoever draws or searches it.

use meetpoint_geometry::GridInfo;

/// Log-odds of a rectangle of cells.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Which cells, and how they lie in the map.
    pub info: GridInfo,
    /// Natural logarithm of the odds of "occupied", one number a cell, row-major along +x, the
    /// lowest row first; NaN where no reading ever observed the cell.
    /// Invariant: `info.n_cells()` numbers.
    pub log_odds: Vec<f32>,
}

impl Raster {
    /// What [`Raster::percent`] says of a cell that was never observed.
    pub const PERCENT_UNKNOWN: u8 = 255;

    /// Probability of "occupied" in percent, 0..=100, rounded to the nearest; 255 where never
    /// observed. Same order as `log_odds`.
    pub fn percent(&self) -> Vec<u8> {
        self.log_odds.iter().map(|&log_odds| percent(log_odds)).collect()
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a rounded percentage lies within 0..=100"
)]
fn percent(log_odds: f32) -> u8 {
    if log_odds.is_nan() {
        return Raster::PERCENT_UNKNOWN;
    }
    let probability = 1.0 / (1.0 + (-log_odds).exp());
    (100.0 * probability).round() as u8
}

#[cfg(test)]
mod tests {
    use meetpoint_geometry::{Cell, GridFrame};

    use super::*;

    #[test]
    fn even_odds_are_half_and_unknown_is_not_half() {
        let frame = GridFrame::new(0.05).expect("a length");
        let info = GridInfo { frame, first: Cell { x: 0, y: 0 }, width: 5, height: 1 };
        let log_odds = vec![0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2.0];
        let raster = Raster { info, log_odds };
        assert_eq!(raster.percent(), [50, 255, 100, 0, 88], "e^2 / (1 + e^2) is 0.88");
    }
}
