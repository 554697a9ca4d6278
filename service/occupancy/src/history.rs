//! What became of a cell over time: how often it was found occupied, how often free, and how often that changed.
//!
//! Readings of a cell within [`LOOK_NS`] are one look, which finds it occupied or free, as most of their evidence
//! says. Of the looks x(1), x(2)... (1 for occupied) there are
//!
//! ```text
//! variance          v = p (1 - p),  p the share of looks that found it occupied
//! autocorrelation   r = 1 - s / (2 v),  s the share of neighbouring looks that differ
//! ```
//!
//! which is E[(x(t) - p) (x(t+1) - p)] / v of a stationary series: neighbouring looks of independent coins differ
//! with probability 2 v. Looks are neighbours if they are no more than [`PAIR_NS`] apart, so that what happened
//! while nobody looked says nothing.
//!
//! T98, section 2.4, on F. E. Schneider, "Sensorinterpretation und Kartenerstellung für mobile Roboter", Master's
//! thesis, University of Bonn (1994), who looked at variance and autocorrelation of interpretations over time; how,
//! the paper does not say. Time O(log n) a reading for a tile that remembers n cells, memory 60 bytes a cell.
//!
//! Remembered are cells that a beam ended in at some time and that are clearly free at some time: the cores of
//! walls are not, nor what beams only cross.

use crate::changes::DECIDED;
use crate::grid::Grid;
use crate::invalid_tile::InvalidTile;
use crate::scan_marks::{Mark, ScanMarks, tile_place};

/// Readings this near to a look's first belong to it, nanoseconds: somebody who walks by covers a cell for less
/// than half a second, a fifth of a look.
pub const LOOK_NS: u64 = 2_000_000_000;

/// Looks that begin no further apart are neighbours, nanoseconds.
pub const PAIR_NS: u64 = 10_000_000_000;

/// What became of a cell since it is remembered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct History {
    /// When it began, by the clocks of the robots, nanoseconds.
    pub since_ns: i64,
    /// When the present look began, nanoseconds.
    pub look_ns: i64,
    /// Readings of the present look that ended in the cell.
    n_hits: u16,
    /// Readings of the present look that crossed it.
    n_misses: u16,
    /// When the look before began, nanoseconds; what it found is in `last`.
    last_ns: i64,
    /// What the look before found.
    last: Option<bool>,
    /// Looks that are over.
    pub n_looks: u32,
    /// Those that found it occupied.
    pub n_occupied: u32,
    /// Pairs of neighbouring looks.
    pub n_pairs: u32,
    /// Those that differ.
    pub n_switched: u32,
    /// How often the cell became clearly occupied after it was clearly free, or the other way around.
    pub n_changes: u32,
    /// When it last did, nanoseconds.
    pub changed_ns: i64,
    /// What it clearly was last.
    pub is_occupied: bool,
}

impl History {
    /// Of a cell that is clearly free now.
    fn begun(stamp_ns: i64) -> Self {
        Self {
            since_ns: stamp_ns,
            look_ns: stamp_ns,
            n_hits: 0,
            n_misses: 0,
            last_ns: stamp_ns,
            last: None,
            n_looks: 0,
            n_occupied: 0,
            n_pairs: 0,
            n_switched: 0,
            n_changes: 0,
            changed_ns: stamp_ns,
            is_occupied: false,
        }
    }

    /// Takes a reading in, after which the cell has these log-odds.
    fn add(&mut self, stamp_ns: i64, is_hit: bool, log_odds: f32) {
        if LOOK_NS <= stamp_ns.abs_diff(self.look_ns) {
            self.end_look();
            self.look_ns = stamp_ns;
        }
        let n = if is_hit { &mut self.n_hits } else { &mut self.n_misses };
        *n = n.saturating_add(1);
        if DECIDED < log_odds.abs() && (0.0 < log_odds) != self.is_occupied {
            self.is_occupied = !self.is_occupied;
            self.n_changes = self.n_changes.saturating_add(1);
            self.changed_ns = stamp_ns;
        }
    }

    /// The present look is over. One without readings is none.
    fn end_look(&mut self) {
        if self.n_hits == 0 && self.n_misses == 0 {
            return;
        }
        // A hit outweighs two beams that pass, as in the grid.
        let found = u32::from(self.n_misses) < 2 * u32::from(self.n_hits);
        if let Some(last) = self.last
            && self.look_ns.abs_diff(self.last_ns) <= PAIR_NS
        {
            self.n_pairs = self.n_pairs.saturating_add(1);
            self.n_switched = self.n_switched.saturating_add(u32::from(last != found));
        }
        self.n_looks = self.n_looks.saturating_add(1);
        self.n_occupied = self.n_occupied.saturating_add(u32::from(found));
        (self.last, self.last_ns) = (Some(found), self.look_ns);
        (self.n_hits, self.n_misses) = (0, 0);
    }

    /// Share of the looks that found it occupied, in 0..=1; `None` before the first is over.
    pub fn occupied_share(&self) -> Option<f64> {
        (0 < self.n_looks).then(|| f64::from(self.n_occupied) / f64::from(self.n_looks))
    }

    /// Variance of what looks found, in 0..=0.25; 0 before the first is over.
    pub fn variance(&self) -> f64 {
        self.occupied_share().map_or(0.0, |share| share * (1.0 - share))
    }

    /// Autocorrelation of what neighbouring looks found, at most 1; `None` where there are none, or all looks
    /// found the same.
    pub fn autocorrelation(&self) -> Option<f64> {
        let variance = self.variance();
        let switched = f64::from(self.n_switched) / f64::from(self.n_pairs);
        (0 < self.n_pairs && 0.0 < variance).then(|| 1.0 - switched / (2.0 * variance))
    }
}

impl Grid {
    /// Remembers what a scan said, which was just inserted with these marks ([`Grid::insert_scan`]), of cells
    /// that were hit at some time and clearly free at some time. Stamps may run backwards a little, and be of
    /// several robots: what counts is how near they are.
    pub fn remember(&mut self, stamp_ns: i64, marks: &ScanMarks) {
        for &cell in marks.changed() {
            let (index, place) = tile_place(cell);
            let Some(tile) = self.tiles.get_mut(&index) else { continue };
            let log_odds = tile.log_odds()[place];
            let found = tile.history_place(place);
            if found.is_err() && -DECIDED <= log_odds {
                continue;
            }
            let is_hit = marks.mark(cell) == Mark::Hit;
            let tile = std::sync::Arc::make_mut(tile);
            tile.history_at(place, found, || History::begun(stamp_ns))
                .add(stamp_ns, is_hit, log_odds);
        }
    }
}

/// Bytes of a history in a stored tile.
pub(crate) const HISTORY_BYTES: usize = 58;

impl History {
    /// As bytes: its fields in their order, little-endian; `last` is 0 for none, 1 for free, 2 for occupied.
    pub(crate) fn to_bytes(self) -> [u8; HISTORY_BYTES] {
        let Self {
            since_ns,
            look_ns,
            n_hits,
            n_misses,
            last_ns,
            last,
            n_looks,
            n_occupied,
            n_pairs,
            n_switched,
            n_changes,
            changed_ns,
            is_occupied,
        } = self;
        let mut bytes = [0; HISTORY_BYTES];
        let last = last.map_or(0, |found| 1 + u8::from(found));
        let mut rest = &mut bytes[..];
        let mut put = |part: &[u8]| {
            let (head, tail) = std::mem::take(&mut rest).split_at_mut(part.len());
            head.copy_from_slice(part);
            rest = tail;
        };
        for time_ns in [since_ns, look_ns, last_ns, changed_ns] {
            put(&time_ns.to_le_bytes());
        }
        for n in [n_looks, n_occupied, n_pairs, n_switched, n_changes] {
            put(&n.to_le_bytes());
        }
        for n in [n_hits, n_misses] {
            put(&n.to_le_bytes());
        }
        put(&[last, u8::from(is_occupied)]);
        bytes
    }

    /// What [`History::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`InvalidTile::History`] for flags that it never writes.
    pub(crate) fn from_bytes(bytes: &[u8; HISTORY_BYTES]) -> Result<Self, InvalidTile> {
        let time_ns =
            |at: usize| i64::from_le_bytes(std::array::from_fn(|byte| bytes[8 * at + byte]));
        let n =
            |at: usize| u32::from_le_bytes(std::array::from_fn(|byte| bytes[32 + 4 * at + byte]));
        let small = |at: usize| u16::from_le_bytes([bytes[52 + 2 * at], bytes[53 + 2 * at]]);
        let last = match bytes[56] {
            0 => None,
            found @ (1 | 2) => Some(found == 2),
            other => return Err(InvalidTile::History(other)),
        };
        let is_occupied = match bytes[57] {
            flag @ (0 | 1) => flag == 1,
            other => return Err(InvalidTile::History(other)),
        };
        Ok(Self {
            since_ns: time_ns(0),
            look_ns: time_ns(1),
            n_hits: small(0),
            n_misses: small(1),
            last_ns: time_ns(2),
            last,
            n_looks: n(0),
            n_occupied: n(1),
            n_pairs: n(2),
            n_switched: n(3),
            n_changes: n(4),
            changed_ns: time_ns(3),
            is_occupied,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reading a second, `#` a hit and `.` a miss, each with the log-odds that follow when nothing was clear.
    fn history(readings: &str) -> History {
        let mut history = History::begun(0);
        for (second, reading) in (0_i64..).zip(readings.chars()) {
            let is_hit = reading == '#';
            history.add(second * 1_000_000_000, is_hit, if is_hit { 2.0 } else { -2.0 });
        }
        history
    }

    #[test]
    fn stretches_are_correlated_and_turns_are_not() {
        let stretches = history("........########........########........");
        assert_eq!(
            (stretches.n_looks, stretches.n_occupied, stretches.n_changes),
            (19, 8, 4),
            "2 s a look"
        );
        assert!(0.5 < stretches.autocorrelation().expect("pairs"), "{stretches:?}");
        let turns = history("..##..##..##..##..##..##..##..##..##..##");
        assert!(0.2 < turns.variance(), "{turns:?}");
        assert!(turns.autocorrelation().expect("pairs") < -0.9, "always the other: {turns:?}");
        assert_eq!(history("..........").autocorrelation(), None, "always the same");
    }

    #[test]
    fn what_was_not_seen_says_nothing() {
        let mut seldom = History::begun(0);
        for look in 0..20_i64 {
            seldom.add(look * 60_000_000_000, look % 2 == 0, 0.0);
        }
        assert_eq!((seldom.n_pairs, seldom.autocorrelation()), (0, None), "a minute apart");
    }

    #[test]
    fn bytes_bring_back_the_history() {
        let history = History { n_hits: 7, n_misses: 513, ..history("...####..##.#") };
        assert_eq!(History::from_bytes(&history.to_bytes()), Ok(history), "all of it");
        let mut bytes = history.to_bytes();
        bytes[56] = 3;
        assert_eq!(History::from_bytes(&bytes), Err(InvalidTile::History(3)), "no such flag");
    }
}
