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
/// walls as Braille dots (a dot for any occupied cell in its square), `·` where all is free, blank
/// where most was never observed. The aspect is kept; small grids are not blown up. Empty for an
/// empty grid or no columns.
pub fn terminal(raster: &Raster, n_columns: u32) -> String {
    let (width, height) = (raster.info.width, raster.info.height);
    if width == 0 || height == 0 || n_columns == 0 {
        return String::new();
    }
    let n_cells = width.div_ceil(n_columns.saturating_mul(DOTS_X));
    let n_characters_x = width.div_ceil(n_cells * DOTS_X);
    let n_characters_y = height.div_ceil(n_cells * DOTS_Y);
    let dots = Dots { raster, n_cells };
    let mut text = String::new();
    for row in 0..n_characters_y {
        let line: String = (0..n_characters_x).map(|column| dots.character(column, row)).collect();
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// A raster seen as squares of `n_cells` by `n_cells`, counted from its upper-left corner.
struct Dots<'a> {
    raster: &'a Raster,
    n_cells: u32,
}

impl Dots<'_> {
    /// The character at a column and a row from above.
    fn character(&self, column: u32, row: u32) -> char {
        let looks = (0..DOTS_Y).flat_map(|y| (0..DOTS_X).map(move |x| (x, y))).map(|(x, y)| {
            (self.look(column * DOTS_X + x, row * DOTS_Y + y), DOT_BITS[y as usize][x as usize])
        });
        let (mut bits, mut n_free, mut n_unknown) = (0, 0, 0);
        for (look, bit) in looks {
            match look {
                Look::Wall => bits |= bit,
                Look::Free => n_free += 1,
                Look::Unknown => n_unknown += 1,
            }
        }
        if bits != 0 {
            return char::from_u32(BRAILLE_BLANK + bits).unwrap_or(UNKNOWN);
        }
        if n_unknown < n_free { FREE } else { UNKNOWN }
    }

    /// A wall if any cell is one, else what most cells are.
    fn look(&self, x: u32, y_from_above: u32) -> Look {
        let (mut n_free, mut n_unknown) = (0, 0);
        for log_odds in self.cells(x, y_from_above) {
            match log_odds {
                Some(log_odds) if OCCUPIED_PROBABILITY_MIN <= probability(log_odds) => {
                    return Look::Wall;
                }
                Some(_) => n_free += 1,
                None => n_unknown += 1,
            }
        }
        if n_unknown < n_free { Look::Free } else { Look::Unknown }
    }

    /// Log-odds of the observed cells of a square, `None` for the others within the raster.
    fn cells(&self, x: u32, y_from_above: u32) -> impl Iterator<Item = Option<f32>> {
        let info = self.raster.info;
        let along =
            |from: u32, limit: u32| (from..from + self.n_cells).take_while(move |&i| i < limit);
        let rows = along(y_from_above * self.n_cells, info.height);
        rows.flat_map(move |y| along(x * self.n_cells, info.width).map(move |x| (x, y))).map(
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
        let raster = drawn("..__#_\n..__._\n..__._\n..__._");
        assert_eq!(terminal(&raster, 10), "· ⠁\n", "free, never observed, one dot");
    }

    proptest! {
        #[test]
        fn as_wide_as_allowed(raster in any_raster(), n_columns in 0_u32..9) {
            let text = terminal(&raster, n_columns);
            let n_longest = text.lines().map(|line| line.chars().count()).max().unwrap_or(0);
            prop_assert!(n_longest <= n_columns as usize);
            let any_wall = raster.log_odds.iter().any(|&odds| 0.65 <= probability(odds));
            let any_dot = text.chars().any(|c| (0x2801..0x2900).contains(&u32::from(c)));
            prop_assert_eq!(any_dot, any_wall && 0 < n_columns);
        }
    }
}
