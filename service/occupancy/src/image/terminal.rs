//! The grid as text for a terminal.

use super::picture::probability;
use crate::raster::Raster;

/// Dots of a Braille character along x and y. A character is about twice as high as wide, so dots
/// are about square.
const DOTS_X: u32 = 2;
const DOTS_Y: u32 = 4;
/// Bits of the dots in Unicode's Braille block, by row from above and column.
const DOT_BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
const BRAILLE_BLANK: u32 = 0x2800;
/// A wall from this probability on, as in map images.
const OCCUPIED_PROBABILITY_MIN: f32 = 0.65;
const FREE: char = '·';
const UNKNOWN: char = ' ';

/// What a rectangle of cells looks like.
#[derive(Clone, Copy, PartialEq)]
enum Look {
    Wall,
    Free,
    Unknown,
}

/// The grid in at most `n_columns` columns, its highest row first, each line ended by a newline:
/// walls as Braille dots (a dot for a square with occupied cells for half of its edge), `·` where
/// all is free, blank where most was never observed. What lies outside of all walls is cut off,
/// stray readings with it. The aspect is kept; small grids are not blown up. Empty for an empty
/// grid or no columns.
pub fn terminal(raster: &Raster, n_columns: usize) -> String {
    let n_columns = u32::try_from(n_columns).unwrap_or(u32::MAX);
    let (width, height) = (raster.info.width, raster.info.height);
    if width == 0 || height == 0 || n_columns == 0 {
        return String::new();
    }
    let whole = Dots::new(raster, Window { x: 0, y: 0, width, height }, n_columns);
    let dots = Dots::new(raster, whole.walls().unwrap_or(whole.window), n_columns);
    dots.lines().fold(String::new(), |text, line| text + line.trim_end() + "\n")
}

/// A rectangle of cells, counted from the raster's upper-left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

/// A window of a raster seen as squares of `n_cells` by `n_cells`, a dot each, counted from its
/// upper-left corner.
struct Dots<'a> {
    raster: &'a Raster,
    window: Window,
    n_cells: u32,
}

impl<'a> Dots<'a> {
    /// Squares large enough that the window fits into the columns.
    fn new(raster: &'a Raster, window: Window, n_columns: u32) -> Self {
        let n_cells = window.width.div_ceil(n_columns.saturating_mul(DOTS_X));
        Self { raster, window, n_cells }
    }

    /// The part of the window that holds all walls, if there are any.
    fn walls(&self) -> Option<Window> {
        let Window { width, height, .. } = self.window;
        let n_dots_x = width.div_ceil(self.n_cells);
        let n_dots_y = height.div_ceil(self.n_cells);
        let dots = (0..n_dots_y).flat_map(|y| (0..n_dots_x).map(move |x| (x, y)));
        let walls = dots.filter(|&(x, y)| self.look(x, y) == Look::Wall);
        let (low, high) = walls.fold(((u32::MAX, u32::MAX), (0, 0)), |(low, high), (x, y)| {
            let low: (u32, u32) = (x.min(low.0), y.min(low.1));
            (low, (x.max(high.0), y.max(high.1)))
        });
        let from = |dot: u32, limit: u32| (dot * self.n_cells).min(limit);
        (low.0 <= high.0).then(|| Window {
            x: from(low.0, width),
            y: from(low.1, height),
            width: from(high.0 + 1, width) - from(low.0, width),
            height: from(high.1 + 1, height) - from(low.1, height),
        })
    }

    fn lines(&self) -> impl Iterator<Item = String> {
        let n_columns = self.window.width.div_ceil(self.n_cells * DOTS_X);
        let n_rows = self.window.height.div_ceil(self.n_cells * DOTS_Y);
        (0..n_rows)
            .map(move |row| (0..n_columns).map(|column| self.character(column, row)).collect())
    }

    /// The character at a column and a row from above.
    fn character(&self, column: u32, row: u32) -> char {
        let (mut bits, mut n_free, mut n_unknown) = (0, 0, 0);
        for (y, row_bits) in (0..).zip(DOT_BITS) {
            for (x, bit) in (0..).zip(row_bits) {
                match self.look(column * DOTS_X + x, row * DOTS_Y + y) {
                    Look::Wall => bits |= bit,
                    Look::Free => n_free += 1,
                    Look::Unknown => n_unknown += 1,
                }
            }
        }
        if bits != 0 {
            return char::from_u32(BRAILLE_BLANK + bits).unwrap_or(UNKNOWN);
        }
        if n_unknown < n_free { FREE } else { UNKNOWN }
    }

    /// A wall if enough cells for one are occupied, else what most cells are.
    fn look(&self, x: u32, y: u32) -> Look {
        let (mut n_occupied, mut n_free, mut n_unknown) = (0, 0, 0);
        for log_odds in self.cells(x, y) {
            match log_odds.map(probability) {
                Some(p) if OCCUPIED_PROBABILITY_MIN <= p => n_occupied += 1,
                Some(_) => n_free += 1,
                None => n_unknown += 1,
            }
        }
        if self.n_cells <= 2 * n_occupied {
            Look::Wall
        } else if n_unknown < n_free {
            Look::Free
        } else {
            Look::Unknown
        }
    }

    /// Log-odds of the observed cells of a square, `None` for the others within the window.
    fn cells(&self, x: u32, y: u32) -> impl Iterator<Item = Option<f32>> {
        let Window { x: left, y: top, width, height } = self.window;
        let along = |dot: u32, first: u32, n: u32| {
            let from = (dot * self.n_cells).min(n);
            first + from..first + n.min(from + self.n_cells)
        };
        let columns = along(x, left, width);
        let info = self.raster.info;
        along(y, top, height).flat_map(move |y| columns.clone().map(move |x| (x, y))).map(
            move |(x, y)| {
                let index = (info.height - 1 - y) as usize * info.width as usize + x as usize;
                self.raster.log_odds.get(index).copied().filter(|log_odds| !log_odds.is_nan())
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::tests::{any_raster, drawn};
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_room() {
        let room = drawn(
            "##########
             #........#
             #........#
             #........#
             #........#
             #........#
             #........#
             ##########",
        );
        assert_eq!(terminal(&room, 80), "⡏⠉⠉⠉⢹\n⣇⣀⣀⣀⣸\n", "walls all around");
        assert_eq!(terminal(&room, 3), "⣏⣉⡇\n", "two cells a dot");
    }

    #[test]
    fn free_unknown_and_walls() {
        let raster = drawn("#.__#_\n..____\n..____\n..__#.\n..___#");
        assert_eq!(terminal(&raster, 10), "⠁ ⡁\n  ⠈\n", "dots win, most cells decide the rest");
        let free = drawn("..__._\n..____\n..____");
        assert_eq!(terminal(&free, 10), "·\n", "free, and never observed");
    }

    #[test]
    fn nothing_outside_of_the_walls() {
        let stray = drawn("______\n......\n__##__\n__#.__\n______");
        assert_eq!(terminal(&stray, 10), terminal(&drawn("##\n#."), 10), "cut off");
    }

    proptest! {
        #[test]
        fn as_wide_as_allowed(raster in any_raster(), n_columns in 0_usize..9) {
            let text = terminal(&raster, n_columns);
            let n_longest = text.lines().map(|line| line.chars().count()).max().unwrap_or(0);
            prop_assert!(n_longest <= n_columns);
            let any_wall = raster.log_odds.iter().any(|&odds| 0.65 <= probability(odds));
            let any_dot = text.chars().any(|c| (0x2801..0x2900).contains(&u32::from(c)));
            prop_assert!(any_wall || !any_dot);
            let is_one_to_one = raster.info.width as usize <= 2 * n_columns;
            prop_assert!(any_dot || !any_wall || !is_one_to_one);
        }
    }
}
