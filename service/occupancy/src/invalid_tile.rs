//! Why bytes are no tile.

use crate::tile::FORMAT_FOLLOWING;

/// Bytes that are no tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTile {
    /// The first byte names no known format.
    #[error("tile format {0} is not known, the newest is {FORMAT_FOLLOWING}")]
    Format(u8),
    /// Each format is that of tiles with what the formats before cannot hold.
    #[error("a tile of format {0} that should be of another by its cells")]
    Heard(u8),
    /// A history has a flag that is none.
    #[error("a history with flag {0}")]
    History(u8),
    /// A history is out of order or out of the tile.
    #[error("a history of cell {0} is out of place")]
    HistoryOf(u16),
    /// So many bytes are no tile.
    #[error("{0} bytes are no tile")]
    Length(usize),
    /// A cell's log-odds are a NaN other than that of "never observed".
    #[error("log-odds with bits {0:#x} are not canonical")]
    LogOdds(u32),
    /// A mean of hits is out of order or out of the tile.
    #[error("hit mean ({x}, {y}) at cell {index} is out of place")]
    Hit {
        /// The cell's place in the tile.
        index: usize,
        /// Step along x, 1..=255.
        x: u8,
        /// Step along y, 1..=255.
        y: u8,
    },
}
