//! A square of 64 by 64 cells: the unit in which a grid grows, is shared and is stored.

use std::fmt;

use crate::following::{FOLLOWING_BYTES, Following};
use crate::history::{HISTORY_BYTES, History};
use crate::invalid_tile::InvalidTile;

/// Cells along each side of a tile.
pub const TILE_CELLS: i32 = 64;

/// Cells of a tile.
pub(crate) const N_CELLS: usize = 64 * 64;

/// First byte of a stored tile in which no cell was heard only: the format that follows.
const FORMAT: u8 = 1;

/// First byte of a stored tile with such cells.
const FORMAT_HEARD: u8 = 2;

/// First byte of a stored tile that remembers what became of cells.
const FORMAT_HISTORIES: u8 = 3;

/// First byte of a stored tile that robots without a laser are followed by.
pub(crate) const FORMAT_FOLLOWING: u8 = 4;

/// The bits of "never observed": one NaN of all, so that equal tiles are equal bytes.
pub(crate) const NEVER_OBSERVED: f32 = f32::NAN;

/// Steps of a [`HitMean`] along each side of a cell.
const HIT_STEPS: f32 = 255.0;

/// Which tile: tile (x, y) holds the cells 64x to 64x + 63 by 64y to 64y + 63.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileIndex {
    /// Index along +x.
    pub x: i32,
    /// Index along +y.
    pub y: i32,
}

/// Where in its cell the recent hits lie on average, each coordinate in 1/255 of the cell's edge
/// less one half step; `None`-like zero means that nothing was ever hit there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HitMean {
    x: u8,
    y: u8,
}

impl HitMean {
    /// No hit yet. Real means have both coordinates in 1..=255.
    const NONE: Self = Self { x: 0, y: 0 };

    /// No laser ever looked at the cell; what is known of it was heard.
    const HEARD: Self = Self { x: 0, y: 1 };

    /// Share of the cell's edge from its lower-left corner, in (0, 1), along x and y.
    #[inline]
    pub fn offset(self) -> (f32, f32) {
        ((f32::from(self.x) - 0.5) / HIT_STEPS, (f32::from(self.y) - 0.5) / HIT_STEPS)
    }

    /// The step that holds `share` of the cell's edge. Anything outside is brought to the edge.
    fn at(share: (f32, f32)) -> Self {
        Self { x: hit_step(share.0), y: hit_step(share.1) }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to 1..=255 on the same line"
)]
fn hit_step(share: f32) -> u8 {
    (share * HIT_STEPS + 1.0).clamp(1.0, HIT_STEPS) as u8
}

/// 64 by 64 cells: log-odds of "occupied" (or never observed), where in the cell hits lie, and what became of
/// those that were both free and hit.
#[derive(Clone)]
pub struct Tile {
    /// Row-major along +x, the lowest row first. Invariant: [`NEVER_OBSERVED`] or not NaN.
    log_odds: Box<[f32; N_CELLS]>,
    /// Same order. Invariant: [`HitMean::NONE`] or [`HitMean::HEARD`] where never hit, else both
    /// coordinates positive.
    hits: Box<[HitMean; N_CELLS]>,
    /// By place in the tile. Invariant: ascending, each once, below 4,096.
    histories: Vec<(u16, History)>,
    /// What sonars said, as robots are followed by it; `None` where they never spoke.
    following: Option<Following>,
}

impl Tile {
    /// A tile of which nothing is known.
    pub fn unknown() -> Self {
        Self {
            log_odds: Box::new([NEVER_OBSERVED; N_CELLS]),
            hits: Box::new([HitMean::NONE; N_CELLS]),
            histories: Vec::new(),
            following: None,
        }
    }

    /// Log-odds of all cells, row-major along +x, the lowest row first; NaN where never observed.
    pub fn log_odds(&self) -> &[f32; N_CELLS] {
        &self.log_odds
    }

    /// Where in a cell its recent hits lie, or `None` where nothing was ever hit. `index` is the
    /// cell's place in the tile, row-major.
    ///
    /// # Panics
    /// If `index` is not below 4,096.
    #[inline]
    pub fn hit_mean(&self, index: usize) -> Option<HitMean> {
        let hit = self.hits[index];
        (hit.x != 0).then_some(hit)
    }

    /// True if all that is known of a cell was heard by sonar. `index` as in [`Tile::hit_mean`].
    ///
    /// # Panics
    /// If `index` is not below 4,096.
    #[inline]
    pub fn is_heard(&self, index: usize) -> bool {
        self.hits[index] == HitMean::HEARD
    }

    /// True if sonar may say something of a cell: nothing but sonar ever has.
    #[inline]
    pub(crate) fn is_for_sonar(&self, index: usize) -> bool {
        self.is_heard(index) || self.log_odds[index].is_nan()
    }

    /// Sets a cell's log-odds by what sonar says of it.
    #[inline]
    pub(crate) fn set_heard(&mut self, index: usize, log_odds: f32) {
        self.following();
        self.set_log_odds(index, log_odds);
        self.hits[index] = HitMean::HEARD;
    }

    /// Log-odds of a cell as robots without a laser are followed by them: what a laser says of it, else what
    /// [`crate::Grid::insert_followed`] brought; NaN where nothing is known. A tile of an older program knows but
    /// one map of what was heard. `index` as in [`Tile::hit_mean`].
    ///
    /// # Panics
    /// If `index` is not below 4,096.
    #[inline]
    pub fn followed_log_odds(&self, index: usize) -> f32 {
        match &self.following {
            Some(following) if self.is_for_sonar(index) => following.log_odds(index),
            _ => self.log_odds[index],
        }
    }

    /// Sets what a robot is followed by in a cell that is for sonar.
    #[inline]
    pub(crate) fn set_followed(&mut self, index: usize, log_odds: f32) {
        self.following().set(index, log_odds);
    }

    /// Begins, before sonar first draws here, with what an older program has drawn.
    #[inline]
    fn following(&mut self) -> &mut Following {
        self.following.get_or_insert_with(|| Following::of(|index| self.log_odds[index]))
    }

    /// Forgets what was heard of a cell, if no more is known: a laser looks at it now.
    #[inline]
    pub(crate) fn forget_heard(&mut self, index: usize) {
        if self.is_heard(index) {
            self.log_odds[index] = NEVER_OBSERVED;
            self.hits[index] = HitMean::NONE;
        }
    }

    /// Sets a cell's log-odds; NaN is kept as "never observed".
    #[inline]
    pub(crate) fn set_log_odds(&mut self, index: usize, log_odds: f32) {
        self.log_odds[index] = if log_odds.is_nan() { NEVER_OBSERVED } else { log_odds };
    }

    /// Takes a hit at `share` of the cell's edge from its lower-left corner into the mean, which
    /// it moves by `weight` of the way; the first hit is the mean.
    #[inline]
    pub(crate) fn add_hit(&mut self, index: usize, share: (f32, f32), weight: f32) {
        self.forget_heard(index);
        let mean = match self.hit_mean(index) {
            None => share,
            Some(mean) => {
                let (x, y) = mean.offset();
                (x + weight * (share.0 - x), y + weight * (share.1 - y))
            }
        };
        self.hits[index] = HitMean::at(mean);
    }

    /// What became of cells that were hit at some time and clearly free at some time, by their place in the
    /// tile, row-major.
    pub fn histories(&self) -> impl Iterator<Item = (usize, &History)> {
        self.histories.iter().map(|(index, history)| (usize::from(*index), history))
    }

    /// What became of one of these cells.
    pub(crate) fn history(&self, index: usize) -> Option<&History> {
        self.history_place(index).ok().map(|place| &self.histories[place].1)
    }

    /// Where a cell's history stands, or would.
    #[inline]
    pub(crate) fn history_place(&self, index: usize) -> Result<usize, usize> {
        self.histories.binary_search_by_key(&index, |(index, _)| usize::from(*index))
    }

    /// The history at a place that [`Tile::history_place`] has found for the cell, begun if there is none.
    #[expect(clippy::cast_possible_truncation, reason = "below 4,096")]
    pub(crate) fn history_at(
        &mut self,
        index: usize,
        found: Result<usize, usize>,
        begun: impl FnOnce() -> History,
    ) -> &mut History {
        let place = found.unwrap_or_else(|place| {
            self.histories.insert(place, (index as u16, begun()));
            place
        });
        &mut self.histories[place].1
    }

    /// The tile as bytes: the format's number, then the log-odds of all cells as little-endian
    /// f32, then for each cell ever hit, in order, its place as little-endian u16 and its mean's
    /// two steps. In format 2, which is that of tiles with cells that were heard only, these stand in
    /// the same list with steps 0 and 1. In format 3, which is that of tiles with histories, the number of
    /// that list's entries stands before it as little-endian u32, and after it for each history its cell as
    /// little-endian u16 and its bytes. Format 4 is format 3, but with the log-odds that robots are followed by
    /// after those of all cells. Equal tiles give equal bytes, and only they do.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(1 + 4 * N_CELLS + 1024);
        bytes.push(self.format());
        for log_odds in self.log_odds.iter() {
            bytes.extend_from_slice(&log_odds.to_le_bytes());
        }
        if let Some(following) = &self.following {
            following.write(&mut bytes);
        }
        if self.format() >= FORMAT_HISTORIES {
            let is_known = |hit: &&HitMean| **hit != HitMean::NONE;
            let n_known = self.hits.iter().filter(is_known).count();
            bytes.extend_from_slice(&u32::try_from(n_known).unwrap_or(u32::MAX).to_le_bytes());
        }
        for (index, hit) in (0_u16..).zip(self.hits.iter()) {
            if *hit != HitMean::NONE {
                bytes.extend_from_slice(&index.to_le_bytes());
                bytes.extend_from_slice(&[hit.x, hit.y]);
            }
        }
        for (index, history) in &self.histories {
            bytes.extend_from_slice(&index.to_le_bytes());
            bytes.extend_from_slice(&history.to_bytes());
        }
        bytes
    }

    fn format(&self) -> u8 {
        if self.following.is_some() {
            FORMAT_FOLLOWING
        } else if !self.histories.is_empty() {
            FORMAT_HISTORIES
        } else if self.hits.contains(&HitMean::HEARD) {
            FORMAT_HEARD
        } else {
            FORMAT
        }
    }

    /// The tile that [`Tile::to_bytes`] wrote, bit for bit.
    ///
    /// # Errors
    /// [`InvalidTile`] if the format is not known or the bytes are not what it prescribes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, InvalidTile> {
        let (&format, rest) = bytes.split_first().ok_or(InvalidTile::Length(0))?;
        if !(FORMAT..=FORMAT_FOLLOWING).contains(&format) {
            return Err(InvalidTile::Format(format));
        }
        let wrong_length = InvalidTile::Length(bytes.len());
        let (cells, rest) = rest.split_at_checked(4 * N_CELLS).ok_or(wrong_length)?;
        let n_following = if format == FORMAT_FOLLOWING { FOLLOWING_BYTES } else { 0 };
        let (following, rest) = rest.split_at_checked(n_following).ok_or(wrong_length)?;
        let (hits, histories) = if FORMAT_HISTORIES <= format {
            let (n_known, rest) = rest.split_first_chunk().ok_or(wrong_length)?;
            let n_bytes = (u32::from_le_bytes(*n_known) as usize).saturating_mul(4);
            rest.split_at_checked(n_bytes).ok_or(wrong_length)?
        } else {
            (rest, &[][..])
        };
        if hits.len() % 4 != 0 || histories.len() % (2 + HISTORY_BYTES) != 0 {
            return Err(wrong_length);
        }
        let mut tile = Self::unknown();
        for (log_odds, cell) in tile.log_odds.iter_mut().zip(cells.as_chunks::<4>().0) {
            *log_odds = read_log_odds(*cell)?;
        }
        if format == FORMAT_FOLLOWING {
            tile.following = Some(Following::read(following)?);
        }
        tile.read_hits(hits)?;
        tile.read_histories(histories)?;
        if tile.format() == format { Ok(tile) } else { Err(InvalidTile::Heard(format)) }
    }

    fn read_hits(&mut self, bytes: &[u8]) -> Result<(), InvalidTile> {
        let mut index_min = 0;
        for &[low, high, x, y] in bytes.as_chunks::<4>().0 {
            let index = usize::from(u16::from_le_bytes([low, high]));
            let hit = HitMean { x, y };
            let is_mean = 0 < x && 0 < y;
            if index < index_min || N_CELLS <= index || !(is_mean || hit == HitMean::HEARD) {
                return Err(InvalidTile::Hit { index, x, y });
            }
            self.hits[index] = hit;
            index_min = index + 1;
        }
        Ok(())
    }

    fn read_histories(&mut self, bytes: &[u8]) -> Result<(), InvalidTile> {
        let mut index_min = 0;
        for [low, high, history @ ..] in bytes.as_chunks::<{ 2 + HISTORY_BYTES }>().0 {
            let index = u16::from_le_bytes([*low, *high]);
            if index < index_min || N_CELLS <= usize::from(index) {
                return Err(InvalidTile::HistoryOf(index));
            }
            self.histories.push((index, History::from_bytes(history)?));
            index_min = index + 1;
        }
        Ok(())
    }
}

/// Log-odds that were written; of all NaN only that of "never observed".
pub(crate) fn read_log_odds(bytes: [u8; 4]) -> Result<f32, InvalidTile> {
    let read = f32::from_le_bytes(bytes);
    if read.is_nan() && read.to_bits() != NEVER_OBSERVED.to_bits() {
        return Err(InvalidTile::LogOdds(read.to_bits()));
    }
    Ok(read)
}

impl PartialEq for Tile {
    /// Bit for bit: "never observed" equals itself.
    fn eq(&self, other: &Self) -> bool {
        self.hits == other.hits
            && self.histories == other.histories
            && self.following == other.following
            && same_bits(&self.log_odds, &other.log_odds)
    }
}

/// Equality of log-odds in which "never observed" equals itself.
pub(crate) fn same_bits(one: &[f32; N_CELLS], other: &[f32; N_CELLS]) -> bool {
    one.iter().zip(other).all(|(one, other)| one.to_bits() == other.to_bits())
}

impl Eq for Tile {}

impl fmt::Debug for Tile {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n_observed = self.log_odds.iter().filter(|log_odds| !log_odds.is_nan()).count();
        let n_hit = self.hits.iter().filter(|hit| hit.x != 0).count();
        formatter
            .debug_struct("Tile")
            .field("n_observed", &n_observed)
            .field("n_hit", &n_hit)
            .field("n_histories", &self.histories.len())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn refuses_what_is_no_tile() {
        assert_eq!(Tile::from_bytes(&[]), Err(InvalidTile::Length(0)), "nothing");
        assert_eq!(Tile::from_bytes(&[9]), Err(InvalidTile::Format(9)), "a format to come");
        let mut bytes = Tile::unknown().to_bytes();
        bytes.extend_from_slice(&[0, 0, 0, 7]);
        assert!(Tile::from_bytes(&bytes).is_err(), "a mean without x");
        bytes.pop();
        assert_eq!(Tile::from_bytes(&bytes), Err(InvalidTile::Length(bytes.len())), "cut short");
    }

    proptest! {
        #[test]
        fn bytes_bring_back_the_tile(
            cells in prop::collection::vec((0..N_CELLS, -9.0_f32..9.0, 0.0_f32..1.0, 0.0_f32..1.0), 0..60),
        ) {
            let mut tile = Tile::unknown();
            for (index, log_odds, x, y) in cells {
                tile.set_log_odds(index, log_odds);
                tile.add_hit(index, (x, y), 0.25);
            }
            let bytes = tile.to_bytes();
            let back = Tile::from_bytes(&bytes).expect("our own bytes");
            prop_assert_eq!(&back, &tile);
            prop_assert_eq!(back.to_bytes(), bytes);
        }

        #[test]
        fn bytes_tell_what_was_heard(
            cells in prop::collection::vec((0..N_CELLS, any::<bool>()), 0..60),
            is_old: bool,
        ) {
            let mut tile = Tile::unknown();
            for (index, by_sonar) in cells {
                if by_sonar && tile.is_for_sonar(index) {
                    tile.set_heard(index, 1.0);
                    tile.set_followed(index, 0.5);
                } else if !by_sonar {
                    tile.add_hit(index, (0.5, 0.5), 0.25);
                    tile.set_log_odds(index, 2.0);
                }
            }
            if is_old {
                tile.following = None;
            }
            let bytes = tile.to_bytes();
            prop_assert_eq!(&Tile::from_bytes(&bytes).expect("our own bytes"), &tile);
            let mut other = bytes;
            prop_assume!(other[0] <= FORMAT_HEARD);
            other[0] = FORMAT + FORMAT_HEARD - other[0];
            prop_assert_eq!(Tile::from_bytes(&other), Err(InvalidTile::Heard(other[0])));
        }

        #[test]
        fn a_mean_stays_near_its_only_hit(x in 0.0_f32..1.0, y in 0.0_f32..1.0) {
            let mut tile = Tile::unknown();
            tile.add_hit(7, (x, y), 0.25);
            tile.add_hit(7, (x, y), 0.25);
            let (mean_x, mean_y) = tile.hit_mean(7).expect("hit").offset();
            prop_assert!((mean_x - x).abs() < 0.006 && (mean_y - y).abs() < 0.006);
        }

        #[test]
        fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let _ = Tile::from_bytes(&bytes);
        }
    }
}
