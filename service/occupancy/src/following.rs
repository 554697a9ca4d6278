//! The cells of a tile as robots without a laser are followed by them.
//!
//! Of the same firings two maps are drawn, by two sets of weights: the grid, by weights whose answers add up to what is
//! there, and this one, by weights that answer each firing by itself: what a firing is compared with (T98, eq. (3)) is
//! best what other firings said in the same way. No one sees it but who follows a robot.

use crate::invalid_tile::InvalidTile;
use crate::tile::{N_CELLS, NEVER_OBSERVED, read_log_odds, same_bits};

/// Bytes of these cells as they are stored.
pub(crate) const FOLLOWING_BYTES: usize = 4 * N_CELLS;

/// Log-odds of "occupied" of each cell.
#[derive(Clone)]
pub(crate) struct Following {
    /// Row-major along +x, the lowest row first. Invariant: [`NEVER_OBSERVED`] or not NaN.
    log_odds: Box<[f32; N_CELLS]>,
}

impl Following {
    /// As told by place in the tile.
    pub(crate) fn of(log_odds: impl Fn(usize) -> f32) -> Self {
        Self { log_odds: Box::new(std::array::from_fn(log_odds)) }
    }

    /// NaN where nothing was said.
    #[inline]
    pub(crate) fn log_odds(&self, index: usize) -> f32 {
        self.log_odds[index]
    }

    #[inline]
    pub(crate) fn set(&mut self, index: usize, log_odds: f32) {
        self.log_odds[index] = if log_odds.is_nan() { NEVER_OBSERVED } else { log_odds };
    }

    /// Appends [`FOLLOWING_BYTES`]: little-endian f32, cell by cell.
    pub(crate) fn write(&self, bytes: &mut Vec<u8>) {
        for log_odds in self.log_odds.iter() {
            bytes.extend_from_slice(&log_odds.to_le_bytes());
        }
    }

    /// What [`Following::write`] wrote; cells that are missing are never observed.
    ///
    /// # Errors
    /// [`InvalidTile::LogOdds`] for a NaN that is not that of "never observed".
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, InvalidTile> {
        let mut read = Self::of(|_| NEVER_OBSERVED);
        for (log_odds, cell) in read.log_odds.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *log_odds = read_log_odds(*cell)?;
        }
        Ok(read)
    }
}

impl PartialEq for Following {
    /// Bit for bit: "never observed" equals itself.
    fn eq(&self, other: &Self) -> bool {
        same_bits(&self.log_odds, &other.log_odds)
    }
}
