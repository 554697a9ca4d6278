//! Where straight runs end: at the next cell from which a best path may turn.
//!
//! A run along an axis halts at a cell outside the region, and at a cell x from which a step off
//! the axis leads where the cell before x does not lead as cheaply. Between halts nothing needs to
//! be looked at. Kept as bits, one grid for each of the four directions, along it; so 64 cells are
//! looked at together: D. Harabor and A. Grastien, "Improving jump point search", ICAPS 2014,
//! section "block-based scanning". Time O(cells), 4 bits a cell.

use crate::inside::patch::{Patch, Spot, neighbor};

/// For each direction along an axis, where runs in it halt.
#[derive(Debug, PartialEq)]
pub(super) struct Halts {
    /// By direction +x, +y, -x, -y.
    lines: [Lines; 4],
}

/// Bits of lines along an axis, each beginning at a word.
#[derive(Debug, PartialEq)]
struct Lines {
    n_words: usize,
    /// Invariant: the first and the last cell of every line are set.
    words: Vec<u64>,
}

impl Halts {
    pub(super) fn new(patch: &Patch) -> Self {
        Self { lines: [0, 2, 4, 6].map(|direction| Lines::new(patch, direction)) }
    }

    /// Where a run from a cell in a direction (a step along an axis) halts: the first such cell
    /// after it.
    pub(super) fn halt(&self, [x, y]: Spot, direction: usize) -> Spot {
        let lines = &self.lines[direction / 2];
        match direction {
            0 => [lines.after(y, x), y],
            2 => [x, lines.after(x, y)],
            4 => [lines.before(y, x), y],
            _ => [x, lines.before(x, y)],
        }
    }

    pub(super) fn n_bytes(&self) -> usize {
        self.lines.iter().map(|lines| size_of_val(lines.words.as_slice())).sum()
    }
}

impl Lines {
    fn new(patch: &Patch, direction: usize) -> Self {
        let [width, height] = patch.size();
        let is_level = direction.is_multiple_of(4);
        let (n_lines, length) = if is_level { (height, width) } else { (width, height) };
        let n_words = length.div_ceil(64);
        let mut words = vec![0; n_lines * n_words];
        for line in 0..n_lines {
            for at in 0..length {
                let spot = if is_level { [at, line] } else { [line, at] };
                if halts(patch, spot, direction) {
                    words[line * n_words + at / 64] |= 1 << (at % 64);
                }
            }
        }
        Self { n_words, words }
    }

    fn line(&self, line: usize) -> &[u64] {
        &self.words[line * self.n_words..][..self.n_words]
    }

    /// The first set bit after `at`, which is not the last of the line.
    fn after(&self, line: usize, at: usize) -> usize {
        let words = self.line(line);
        let mut word = (at + 1) / 64;
        let mut bits = words[word] & (u64::MAX << ((at + 1) % 64));
        while bits == 0 {
            word += 1;
            bits = words[word];
        }
        word * 64 + bits.trailing_zeros() as usize
    }

    /// The last set bit before `at`, which is not the first of the line.
    fn before(&self, line: usize, at: usize) -> usize {
        let words = self.line(line);
        let mut word = (at - 1) / 64;
        let mut bits = words[word] & (u64::MAX >> (63 - (at - 1) % 64));
        while bits == 0 {
            word -= 1;
            bits = words[word];
        }
        word * 64 + 63 - bits.leading_zeros() as usize
    }
}

/// Whether a run in a direction along an axis halts at a cell.
fn halts(patch: &Patch, spot: Spot, direction: usize) -> bool {
    let moves = patch.moves(spot);
    let back = (direction + 4) % 8;
    // A cell with no step back to the one before is not entered by a run.
    if moves >> back & 1 == 0 {
        return true;
    }
    let before = patch.moves(neighbor(spot, back));
    turns(direction, before) & moves != 0
}

/// The steps that may go on a best path whose last step was `last`, from a cell whose moves are
/// `before`: all of them, or those alone that turn.
///
/// Of several best paths one that steps diagonally as early as it can is looked for. A step n after
/// a step p - x is left out if another way from p to the same cell, not through x, costs less, or
/// as much and steps diagonally earlier:
///
/// ```text
/// p - x along an axis, n beside x or diagonally ahead:  p - n' diagonally, where p can
/// p - x diagonally, n at a right angle to it:           over the cell beside both, where p can
/// ```
///
/// D. Harabor and A. Grastien, "Online graph pruning for pathfinding on grid maps", AAAI 2011,
/// section "neighbour pruning rules", where no corner is cut. There a wall alone stops a step; here
/// it may also be the region's edge, past which a diagonal may lead, so that diagonal steps can
/// make turns too.
pub(super) fn turns(last: usize, before: u8) -> u8 {
    let mut steps = 0;
    for side in [1, 7] {
        if before >> ((last + side) % 8) & 1 == 0 {
            steps |= 1 << ((last + side) % 8) | 1 << ((last + 2 * side) % 8);
        }
    }
    steps
}

/// All steps that may go on a best path, see [`turns`]: these, and those straight on.
pub(super) fn onward(last: usize, before: u8) -> u8 {
    let ahead = 1 << last;
    let natural = if last.is_multiple_of(2) {
        ahead
    } else {
        ahead | 1 << (last - 1) | 1 << ((last + 1) % 8)
    };
    natural | turns(last, before)
}
