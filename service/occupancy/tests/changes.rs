//! Changes between grids, drawn, and against their definition.

use std::collections::BTreeMap;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_occupancy::{Change, ChangeKind, Grid, Raster, Tile, TileIndex, changes, n_moved};
use proptest::prelude::*;

/// `.` free, `#` occupied, `?` undecided, blank never observed; the top line has the highest y. The lower-left
/// cell is (60, -2), so that drawings lie in four tiles.
fn grid(drawing: &[String]) -> Grid {
    let width = drawing.iter().map(String::len).max().unwrap_or(0);
    let log_odds = drawing.iter().rev().flat_map(|line| {
        let line = line.clone() + &" ".repeat(width - line.len());
        line.into_bytes().into_iter().map(|symbol| match symbol {
            b'.' => -2.0,
            b'#' => 2.0,
            b'?' => 0.3,
            _ => f32::NAN,
        })
    });
    let info = GridInfo {
        frame: GridFrame::new(0.1).expect("a length"),
        first: Cell { x: 60, y: -2 },
        width: u32::try_from(width).expect("a small drawing"),
        height: u32::try_from(drawing.len()).expect("a small drawing"),
    };
    Grid::from_raster(&Raster { info, log_odds: log_odds.collect() })
}

fn between(before: &Grid, now: &Grid) -> Vec<Change> {
    let tiles = |grid: &Grid| -> BTreeMap<TileIndex, Tile> {
        grid.tiles().map(|(index, tile)| (index, Tile::clone(tile))).collect()
    };
    let (before, now) = (tiles(before), tiles(now));
    let indices: Vec<TileIndex> = before.keys().chain(now.keys()).copied().collect();
    let indices: std::collections::BTreeSet<TileIndex> = indices.into_iter().collect();
    changes(indices.into_iter().map(|index| (index, before.get(&index), now.get(&index))))
}

fn lines(drawing: &str) -> Vec<String> {
    drawing.lines().map(|line| line.trim_start_matches([' ', '|']).to_owned()).collect()
}

#[test]
fn a_closed_door_has_moved_and_a_blurred_wall_has_not() {
    let open = lines(
        "|###############
         |#.............#
         |#.............#
         |###.........###
         |#.............#
         |#.............#
         |###############",
    );
    let closed = lines(
        "|###############
         |#.............#
         |##...........##
         |###############
         |#.............#
         |#.............#
         |###############",
    );
    let [open, closed] = [open, closed].map(|drawing| grid(&drawing));
    assert_eq!(n_moved(&open, &closed, 2), 5, "what is three cells or more from its frame");
    assert_eq!(n_moved(&closed, &open, 2), 5, "the other way around");
    assert_eq!(n_moved(&open, &open.clone(), 2), 0, "nothing");
}

#[test]
fn a_door_closes_and_a_box_is_taken_away() {
    let before = lines(
        "|#########
         |#...#...#
         |#.......#
         |#.......#
         |#.##.?..#
         |#########",
    );
    let now = lines(
        "|#########
         |#...#...#
         |#...#...#
         |#...#...#
         |#....#..#
         |#########",
    );
    let found = between(&grid(&before), &grid(&now));
    let change = |kind, (low_x, low_y), (high_x, high_y), n_cells| Change {
        kind,
        low: Cell { x: low_x, y: low_y },
        high: Cell { x: high_x, y: high_y },
        n_cells,
        first: Cell { x: low_x, y: low_y },
    };
    assert_eq!(
        found,
        [
            change(ChangeKind::Vanished, (62, -1), (63, -1), 2),
            change(ChangeKind::Appeared, (64, 0), (64, 1), 2),
        ],
        "what was undecided is news, no change"
    );
    assert_eq!(between(&grid(&now), &grid(&now)), [], "nothing");
    assert_eq!(between(&grid(&[]), &grid(&now)), [], "a place that was not known before");
}

/// The definition: all pairs of changed cells that touch, again and again, until labels stay.
fn reference(before: &[String], now: &[String]) -> Vec<(ChangeKind, usize, [usize; 4])> {
    let at = |drawing: &[String], x: usize, y: usize| drawing[y].as_bytes()[x];
    let mut labels: BTreeMap<(usize, usize), (ChangeKind, usize)> = BTreeMap::new();
    for (y, line) in now.iter().enumerate() {
        for x in 0..line.len() {
            let kind = match (at(before, x, y), at(now, x, y)) {
                (b'.', b'#') => ChangeKind::Appeared,
                (b'#', b'.') => ChangeKind::Vanished,
                _ => continue,
            };
            let label = labels.len();
            labels.insert((x, y), (kind, label));
        }
    }
    loop {
        let old = labels.clone();
        for (&(x, y), (kind, label)) in &mut labels {
            for (&(near_x, near_y), &(near_kind, near_label)) in &old {
                let touches = near_x.abs_diff(x) <= 1 && near_y.abs_diff(y) <= 1;
                if touches && near_kind == *kind {
                    *label = near_label.min(*label);
                }
            }
        }
        if labels == old {
            break;
        }
    }
    let mut parts: BTreeMap<usize, (ChangeKind, usize, [usize; 4])> = BTreeMap::new();
    for (&(x, y), &(kind, label)) in &labels {
        let part = parts.entry(label).or_insert((kind, 0, [x, y, x, y]));
        let [low_x, low_y, high_x, high_y] = part.2;
        part.1 += 1;
        part.2 = [low_x.min(x), low_y.min(y), high_x.max(x), high_y.max(y)];
    }
    let mut parts: Vec<_> = parts.into_values().collect();
    parts.sort_unstable();
    parts
}

proptest! {
    #[test]
    fn as_the_definition(
        pairs in prop::collection::vec(("[.#? ]{9}", "[.#? ]{9}"), 1..8),
    ) {
        let (before, now): (Vec<String>, Vec<String>) = pairs.into_iter().unzip();
        let found = between(&grid(&before), &grid(&now));
        prop_assert!(found.windows(2).all(|pair| pair[1].n_cells <= pair[0].n_cells));
        // Drawings count rows from above.
        let row = |y: i32| before.len() - 1 - usize::try_from(y + 2).expect("in the drawing");
        let column = |x: i32| usize::try_from(x - 60).expect("in the drawing");
        let mut parts: Vec<_> = found
            .into_iter()
            .map(|Change { kind, low, high, n_cells, .. }| {
                (kind, n_cells, [column(low.x), row(high.y), column(high.x), row(low.y)])
            })
            .collect();
        parts.sort_unstable();
        prop_assert_eq!(parts, reference(&before, &now));
    }
}
