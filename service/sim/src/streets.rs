//! Drawings of places and ways between them, at random: floors for maps of places, not for scans.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Share of the ways of a full grid that nested loops leave out, in percent.
const LEFT_OUT_PERCENT: u32 = 25;
/// The most places along a side of a street grid: signs are counted.
const SIDE_MAX: u32 = 100;
/// The first of the letters that places are named by.
const FIRST_SIGN: u32 = 0x4e00;

/// A grid of 3 or 4 by 3 or 4 places with a quarter of the ways left out; places that no way leads to are
/// not drawn.
pub fn nested_loops(rng: &mut ChaCha8Rng) -> String {
    let (width, height) = (rng.random_range(3..=4_usize), rng.random_range(3..=4_usize));
    let mut is_there = || LEFT_OUT_PERCENT <= rng.random_range(0..100);
    let rightward: Vec<Vec<bool>> =
        (0..height).map(|_| (0..width).map(|x| x + 1 < width && is_there()).collect()).collect();
    let downward: Vec<Vec<bool>> =
        (0..height).map(|y| (0..width).map(|_| y + 1 < height && is_there()).collect()).collect();
    let mut drawing = String::new();
    for y in 0..height {
        for (x, name) in (0..width).zip(('A'..='Z').skip(y * width)) {
            let is_reached = rightward[y][x]
                || downward[y][x]
                || (0 < x && rightward[y][x - 1])
                || (0 < y && downward[y - 1][x]);
            drawing.push(if is_reached { name } else { ' ' });
            drawing.push_str(if rightward[y][x] { "---" } else { "   " });
        }
        drawing.push('\n');
        drawing.extend(downward[y].iter().map(|&is_there| if is_there { "|   " } else { "    " }));
        drawing.push('\n');
    }
    drawing
}

/// A grid of `side` by `side` places, at most 100, with about half of the ways between its rows. Rows and the
/// leftmost column are whole: all hangs together.
pub fn street_grid(side: u32, rng: &mut ChaCha8Rng) -> String {
    let side = side.min(SIDE_MAX);
    let mut signs = (FIRST_SIGN..).filter_map(char::from_u32);
    let mut drawing = String::new();
    for y in 0..side {
        let mut below = String::new();
        for x in 0..side {
            drawing.extend(signs.next());
            drawing.push_str(if x + 1 < side { "---" } else { "" });
            let is_there = y + 1 < side && (x == 0 || rng.random());
            below.push_str(if is_there { "|   " } else { "    " });
        }
        drawing.extend(["\n", &below, "\n"]);
    }
    drawing
}
