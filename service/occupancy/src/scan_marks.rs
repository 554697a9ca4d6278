//! What one scan says of each cell, before it goes into the grid.
//!
//! Beams of one scan overlap near the sensor; they are one reading, not independent ones. A cell
//! therefore takes from a scan one update at most: hit if any beam ended in it, else missed if any
//! crossed it.

use std::collections::HashMap;

use meetpoint_geometry::Cell;

use crate::tile::{TILE_CELLS, TileIndex};

/// What a scan says of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Mark {
    /// No beam met it.
    Unseen,
    /// A beam crossed it.
    Missed,
    /// A beam ended in it.
    Hit,
}

/// A hit: which cell, and where in it as shares of its edge from the lower-left corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HitPlace {
    pub(crate) tile: u32,
    pub(crate) index: usize,
    pub(crate) share: (f32, f32),
}

/// Scratch of [`Grid::insert_scan`](crate::Grid::insert_scan), kept by the caller so that scans
/// allocate nothing; and the cells that the last scan may have moved across a threshold.
#[derive(Debug, Default)]
pub struct ScanMarks {
    /// In the order in which the scan met them.
    pub(crate) tiles: Vec<(TileIndex, Box<[Mark; 4096]>)>,
    /// Place of a tile in `tiles`.
    places: HashMap<TileIndex, u32>,
    /// Used-up tiles, all [`Mark::Unseen`].
    spare: Vec<Box<[Mark; 4096]>>,
    pub(crate) hits: Vec<HitPlace>,
    pub(crate) changed: Vec<Cell>,
    last: Option<(TileIndex, u32)>,
}

impl ScanMarks {
    /// Empty scratch.
    pub fn new() -> Self {
        Self::default()
    }

    /// The cells ever hit that the last inserted scan hit or missed, each once.
    pub fn changed(&self) -> &[Cell] {
        &self.changed
    }

    /// What the last scan says of a cell.
    pub(crate) fn mark(&self, cell: Cell) -> Mark {
        let (tile, index) = tile_place(cell);
        self.places.get(&tile).map_or(Mark::Unseen, |&place| self.tiles[place as usize].1[index])
    }

    /// Forgets the last scan.
    pub(crate) fn clear(&mut self) {
        self.places.clear();
        self.hits.clear();
        self.changed.clear();
        self.last = None;
        for (_, mut marks) in self.tiles.drain(..) {
            marks.fill(Mark::Unseen);
            self.spare.push(marks);
        }
    }

    /// Marks a cell as missed, unless it is hit.
    #[inline]
    pub(crate) fn miss(&mut self, cell: Cell) {
        let (tile, index) = self.place(cell);
        let mark = &mut self.tiles[tile as usize].1[index];
        *mark = (*mark).max(Mark::Missed);
    }

    /// Marks a cell as hit at `share` of its edge.
    pub(crate) fn hit(&mut self, cell: Cell, share: (f32, f32)) {
        let (tile, index) = self.place(cell);
        self.tiles[tile as usize].1[index] = Mark::Hit;
        self.hits.push(HitPlace { tile, index, share });
    }

    #[inline]
    fn place(&mut self, cell: Cell) -> (u32, usize) {
        let (tile, index) = tile_place(cell);
        if let Some((last, place)) = self.last
            && last == tile
        {
            return (place, index);
        }
        let place = self.tile_of(tile);
        self.last = Some((tile, place));
        (place, index)
    }

    #[expect(clippy::cast_possible_truncation, reason = "a scan meets far less than 2³² tiles")]
    fn tile_of(&mut self, tile: TileIndex) -> u32 {
        *self.places.entry(tile).or_insert_with(|| {
            let marks = self.spare.pop().unwrap_or_else(|| Box::new([Mark::Unseen; 4096]));
            self.tiles.push((tile, marks));
            self.tiles.len() as u32 - 1
        })
    }
}

/// The tile of a cell, and the cell's place in it.
#[inline]
#[expect(clippy::cast_sign_loss, reason = "a remainder is not negative")]
pub(crate) fn tile_place(cell: Cell) -> (TileIndex, usize) {
    let tile = TileIndex { x: cell.x.div_euclid(TILE_CELLS), y: cell.y.div_euclid(TILE_CELLS) };
    let (x, y) = (cell.x.rem_euclid(TILE_CELLS), cell.y.rem_euclid(TILE_CELLS));
    (tile, (y * TILE_CELLS + x) as usize)
}
