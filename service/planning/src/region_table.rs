//! What it costs to get from every cell of a region to every node of its gates, inside.
//!
//! ```text
//! table(c, n) = cost of the shortest path from c to n whose cells but n lie in the region
//! ```
//!
//! Of the nodes that the region itself holds, and of those across: the last step to these crosses
//! the gate. Costs to the nodes of one gate differ little: each is stored as what it exceeds the
//! least of the gate by, in 16 bits where all do fit. The least stands before the differences to it,
//! so that a look-up reads one place in memory. One wave (Dijkstra) a node. Time and space
//! O(cells · nodes).

use crate::cost::{Cost, UNREACHABLE};
use crate::differences::{DifferenceRow, Differences, halves, narrowed};
use crate::gates::Gate;
use crate::space::Space;
use crate::wave::{Ground, Wave};

/// Which gates a region has, and where their nodes are in its table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Door {
    /// By its place among all gates.
    pub(crate) gate: usize,
    /// Whether the nodes lie in this region.
    pub(crate) is_inner: bool,
    /// Place of the first node in a row of the table.
    pub(crate) first: usize,
    /// Number of nodes.
    pub(crate) n_nodes: usize,
}

/// Costs from the cells of one region to the nodes of its gates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RegionTable {
    n_cells: usize,
    /// Words of a cell's row: for every door [`LEAST_WORDS`], then one a node.
    n_words: usize,
    /// One row a cell.
    words: Differences,
}

/// Words for the least cost to a node of a door: its two halves where words have 16 bits, the first
/// alone where they have 32.
const LEAST_WORDS: usize = 2;

impl RegionTable {
    /// For the cells of a region, with its doors. `slot` tells the place of a cell among `cells`.
    pub(crate) fn new(
        space: &Space,
        gates: &[Gate],
        doors: &[Door],
        cells: &[u32],
        slot: impl Fn(usize) -> Option<u32>,
    ) -> Self {
        let ground = Ground::new(space, cells, &slot);
        let (n_cells, n_doors) = (ground.n_cells(), doors.len());
        let n_nodes: usize = doors.iter().map(|door| door.n_nodes).sum();
        let n_words = n_nodes + n_doors * LEAST_WORDS;
        let mut table = Self { n_cells, n_words, words: Differences::new(n_cells * n_words) };
        let mut wave = Wave::default();
        let mut columns = vec![];
        for (at, door) in doors.iter().enumerate() {
            let gate = &gates[door.gate];
            columns.resize_with(gate.nodes.len().max(columns.len()), || vec![0; n_cells]);
            for (node, column) in gate.nodes.iter().zip(&mut columns) {
                let seeds = seeds(space, node, door.is_inner, &slot);
                wave.run(&ground, &seeds, column);
            }
            table.put(doors, at, &columns[..gate.nodes.len()]);
        }
        table
    }

    /// Writes the costs to the nodes of the door at `at`, after those before it.
    fn put(&mut self, doors: &[Door], at: usize, columns: &[Vec<Cost>]) {
        let first = doors[at].first + at * LEAST_WORDS;
        if let Differences::Narrow(words) = &mut self.words {
            let rows = words.chunks_exact_mut(self.n_words).map(|row| &mut row[first..]);
            if put_narrow(rows, columns) {
                return;
            }
            self.widen(&doors[..at]);
        }
        let Differences::Wide(words) = &mut self.words else { return };
        for (slot, row) in words.chunks_exact_mut(self.n_words).enumerate() {
            let (head, more) = row[first..].split_at_mut(LEAST_WORDS);
            let least = least_of(columns, slot);
            head[0] = least;
            for (to, column) in more.iter_mut().zip(columns) {
                *to = if column[slot] < UNREACHABLE { column[slot] - least } else { u32::MAX };
            }
        }
    }

    /// Makes room for words of 32 bits, `doors` having been written.
    fn widen(&mut self, doors: &[Door]) {
        let mut wide = Self { words: self.words.clone(), ..*self };
        wide.words.widen();
        if let Differences::Wide(words) = &mut wide.words {
            for slot in 0..self.n_cells {
                for (at, door) in doors.iter().enumerate() {
                    words[self.place(slot, at, door.first)] = self.least(slot, at, door);
                }
            }
        }
        *self = wide;
    }

    /// Where the part of a door begins in a cell's row, or so many words of nodes after that.
    fn place(&self, slot: usize, at: usize, first: usize) -> usize {
        slot * self.n_words + at * LEAST_WORDS + first
    }

    /// Least cost from a cell to a node of the door at `at`.
    pub(crate) fn least(&self, slot: usize, at: usize, door: &Door) -> Cost {
        self.words.joined(self.place(slot, at, door.first))
    }

    /// Cost from a cell to a node of the door at `at`, the node by its place among the region's.
    pub(crate) fn cost(&self, slot: usize, at: usize, door: &Door, node: usize) -> Cost {
        let place = self.place(slot, at, LEAST_WORDS + node);
        self.words.cost(place, self.least(slot, at, door))
    }

    /// What the nodes of the door at `at` cost more than the least of them, from a cell.
    pub(crate) fn more(&self, slot: usize, at: usize, door: &Door) -> DifferenceRow<'_> {
        let first = self.place(slot, at, LEAST_WORDS + door.first);
        self.words.row(first..first + door.n_nodes)
    }

    /// Costs from a cell to the nodes of the door at `at`, plus `extra`.
    pub(crate) fn costs(&self, slot: usize, at: usize, door: &Door, extra: Cost, to: &mut [Cost]) {
        self.more(slot, at, door).costs(self.least(slot, at, door) + extra, to);
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        self.words.n_bytes()
    }
}

/// Least cost of a cell.
fn least_of(columns: &[Vec<Cost>], slot: usize) -> Cost {
    columns.iter().map(|column| column[slot]).min().unwrap_or(UNREACHABLE)
}

/// Writes a door's part of every row in 16 bits; false if a difference does not fit.
fn put_narrow<'a>(rows: impl Iterator<Item = &'a mut [u16]>, columns: &[Vec<Cost>]) -> bool {
    for (slot, row) in rows.enumerate() {
        let (head, more) = row.split_at_mut(LEAST_WORDS);
        let least = least_of(columns, slot);
        head.copy_from_slice(&halves(least));
        for (to, column) in more.iter_mut().zip(columns) {
            let Some(more) = narrowed(column[slot], least) else { return false };
            *to = more;
        }
    }
    true
}

/// Where the wave to a node starts, within the region.
fn seeds(
    space: &Space,
    node: &crate::gates::Node,
    is_inner: bool,
    slot: impl Fn(usize) -> Option<u32>,
) -> Vec<(u32, Cost)> {
    // Both ways must still be open: an obstacle may stand in the gate.
    if is_inner {
        return slot(node.cell).map(|slot| (slot, 0)).into_iter().collect();
    }
    let open = node.across.iter().filter(|(step, _)| space.moves(node.cell) >> step & 1 == 1);
    open.filter_map(|&(step, to)| Some((slot(to)?, space.step_cost(node.cell, step)))).collect()
}
