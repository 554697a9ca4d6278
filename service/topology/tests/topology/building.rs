//! Buildings: drawn as text, or put together from rectangles of free space.

use meetpoint_geometry::{Cell, GridFrame, GridInfo};
use meetpoint_topology::{FreeSpace, Partition, RegionIndex};
use proptest::prelude::*;

pub(crate) fn info(resolution_m: f64, width: usize, height: usize) -> GridInfo {
    let frame = GridFrame::new(resolution_m).expect("a length");
    let [width, height] = [width, height].map(|n| u32::try_from(n).expect("small"));
    GridInfo { frame, first: Cell { x: 0, y: 0 }, width, height }
}

/// Cells of 0.05 m from a drawing, top row first: `.` is free, all else is not. A character is
/// `n_cells` cells wide and high.
pub(crate) fn drawn(drawing: &str, n_cells: usize) -> FreeSpace {
    let rows: Vec<&str> = drawing.trim().lines().map(str::trim).collect();
    let (width, height) = (rows[0].len() * n_cells, rows.len() * n_cells);
    let cells: Vec<bool> = (0..width * height)
        .map(|index| {
            let (x, y) = (index % width / n_cells, index / width / n_cells);
            rows[rows.len() - 1 - y].as_bytes()[x] == b'.'
        })
        .collect();
    FreeSpace::from_cells(info(0.05, width, height), &cells)
}

/// The drawing again, with a letter for each region.
pub(crate) fn redrawn(partition: &Partition, n_cells: usize) -> String {
    let (width, height) = (partition.info().width as usize, partition.info().height as usize);
    let symbol = |region: Option<RegionIndex>| {
        region.map_or('#', |RegionIndex(region)| char::from_digit(10 + region, 36).unwrap_or('?'))
    };
    // The middle of every character; the rim is one cell wide.
    let middles = |side: usize| (1 + n_cells / 2..side - 1).step_by(n_cells);
    let row = |y: usize| -> String {
        middles(width).map(|x| symbol(partition.region_at(y * width + x))).collect()
    };
    let rows: Vec<String> = middles(height).rev().map(row).collect();
    rows.join("\n")
}

/// Rectangles of free space, in decimetres: left, bottom, right, top.
#[derive(Clone, Debug)]
pub(crate) struct Building {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) free: Vec<[usize; 4]>,
}

impl Building {
    /// At `n_cells` cells a decimetre.
    pub(crate) fn space(&self, n_cells: usize) -> FreeSpace {
        let (width, height) = (self.width * n_cells, self.height * n_cells);
        let mut cells = vec![false; width * height];
        for &[left, bottom, right, top] in &self.free {
            for y in bottom * n_cells..top * n_cells {
                cells[y * width + left * n_cells..y * width + right * n_cells].fill(true);
            }
        }
        FreeSpace::from_cells(info(0.1 / n_cells as f64, width, height), &cells)
    }

    /// A quarter turn counter-clockwise.
    pub(crate) fn turned(&self) -> Self {
        let turn = |&[left, bottom, right, top]: &[usize; 4]| {
            [self.height - top, left, self.height - bottom, right]
        };
        let free = self.free.iter().map(turn).collect();
        Self { width: self.height, height: self.width, free }
    }
}

/// A corridor of 2 m with rooms of 3 to 6 m on both sides, each with a door of 0.9 m in a wall of
/// 0.2 m; and how many rooms.
pub(crate) fn office() -> impl Strategy<Value = (Building, usize)> {
    let side = || prop::collection::vec((30_usize..60, 0.0..1.0), 1..4);
    (side(), side()).prop_map(|(below, above)| {
        let mut building = Building { width: 0, height: 106, free: vec![] };
        for (rooms, [bottom, top], door_bottom) in [(&below, [1, 41], 41), (&above, [65, 105], 63)]
        {
            let mut left = 1;
            for &(width, door) in rooms {
                building.free.push([left, bottom, left + width, top]);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a share of a small length"
                )]
                let door_left = left + 2 + (door * (width - 13) as f64) as usize;
                building.free.push([door_left, door_bottom, door_left + 9, door_bottom + 2]);
                left += width + 2;
            }
            building.width = building.width.max(left);
        }
        building.free.push([1, 43, building.width - 1, 63]);
        (building, below.len() + above.len())
    })
}

/// Small grids of free cells and others.
pub(crate) fn any_space() -> impl Strategy<Value = FreeSpace> {
    (1_usize..16, 1_usize..16, 0.05..0.95).prop_flat_map(|(width, height, share)| {
        prop::collection::vec(prop::bool::weighted(share), width * height)
            .prop_map(move |cells| FreeSpace::from_cells(info(0.05, width, height), &cells))
    })
}

/// Blocks scattered over 6 m by 4 m.
pub(crate) fn cluttered() -> impl Strategy<Value = FreeSpace> {
    let block = (0_usize..120, 0_usize..80, 1_usize..40, 1_usize..30);
    prop::collection::vec(block, 0..14).prop_map(|blocks| {
        let mut cells = vec![true; 120 * 80];
        for (left, bottom, width, height) in blocks {
            for y in bottom..(bottom + height).min(80) {
                cells[y * 120 + left..y * 120 + (left + width).min(120)].fill(false);
            }
        }
        FreeSpace::from_cells(info(0.05, 120, 80), &cells)
    })
}
