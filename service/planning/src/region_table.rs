//! What it costs to get from every cell of a region to every node of its gates, inside.
//!
//! ```text
//! table(c, n) = cost of the shortest path from c to n whose cells but n lie in the region
//! ```
//!
//! Of the nodes that the region itself holds, and of those across: the last step to these crosses
//! the gate. Costs to the nodes of one gate differ little: each is stored as what it exceeds the
//! least of the gate by, in 16 bits where all do fit. One wave (Dijkstra) a node. Time and space
//! O(cells · nodes).

use crate::cost::{Cost, UNREACHABLE};
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
    n_doors: usize,
    n_nodes: usize,
    /// Least cost to a node of the door: one row of `n_doors` a cell.
    least: Vec<Cost>,
    /// What the nodes cost more: one row of `n_nodes` a cell.
    more: More,
}

/// Differences to the least; the largest value of the type is [`UNREACHABLE`].
#[derive(Clone, Debug, PartialEq)]
enum More {
    Narrow(Vec<u16>),
    Wide(Vec<u32>),
}

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
        let n_nodes = doors.iter().map(|door| door.n_nodes).sum();
        let mut table = Self {
            n_doors,
            n_nodes,
            least: vec![UNREACHABLE; n_cells * n_doors],
            more: More::Narrow(vec![u16::MAX; n_cells * n_nodes]),
        };
        let mut wave = Wave::default();
        let mut columns = vec![];
        for (at, door) in doors.iter().enumerate() {
            let gate = &gates[door.gate];
            columns.resize_with(gate.nodes.len().max(columns.len()), || vec![0; n_cells]);
            for (node, column) in gate.nodes.iter().zip(&mut columns) {
                let seeds = seeds(space, node, door.is_inner, &slot);
                wave.run(&ground, &seeds, column);
            }
            table.put(at, door, &columns[..gate.nodes.len()]);
        }
        table
    }

    /// Writes the costs to the nodes of a door.
    fn put(&mut self, at: usize, door: &Door, columns: &[Vec<Cost>]) {
        let n_cells = self.least.len() / self.n_doors;
        for slot in 0..n_cells {
            let least = columns.iter().map(|column| column[slot]).min().unwrap_or(UNREACHABLE);
            self.least[slot * self.n_doors + at] = least;
        }
        let place = |slot: usize| slot * self.n_nodes + door.first;
        if let More::Narrow(more) = &mut self.more {
            if put_narrow(more, place, &self.least[at..], self.n_doors, columns) {
                return;
            }
            let widened = |&more: &u16| if more == u16::MAX { u32::MAX } else { u32::from(more) };
            self.more = More::Wide(more.iter().map(widened).collect());
        }
        if let More::Wide(more) = &mut self.more {
            for slot in 0..n_cells {
                let least = self.least[slot * self.n_doors + at];
                for (to, column) in more[place(slot)..].iter_mut().zip(columns) {
                    *to = if column[slot] < UNREACHABLE { column[slot] - least } else { u32::MAX };
                }
            }
        }
    }

    /// Least costs from a cell, one a door.
    pub(crate) fn least(&self, slot: usize) -> &[Cost] {
        &self.least[slot * self.n_doors..][..self.n_doors]
    }

    /// Cost from a cell to one node, by its place in the rows.
    pub(crate) fn cost(&self, slot: usize, at: usize, node: usize) -> Cost {
        let least = self.least[slot * self.n_doors + at];
        let place = slot * self.n_nodes + node;
        match &self.more {
            More::Narrow(more) if more[place] == u16::MAX => UNREACHABLE,
            More::Narrow(more) => least + Cost::from(more[place]),
            More::Wide(more) if more[place] == u32::MAX => UNREACHABLE,
            More::Wide(more) => least + more[place],
        }
    }

    /// Costs from a cell to the nodes of the door at `at`, plus `extra`.
    pub(crate) fn costs(&self, slot: usize, at: usize, door: &Door, extra: Cost, to: &mut [Cost]) {
        let least = self.least[slot * self.n_doors + at] + extra;
        let place = slot * self.n_nodes + door.first;
        match &self.more {
            More::Narrow(more) => {
                for (to, &more) in to.iter_mut().zip(&more[place..][..door.n_nodes]) {
                    *to = if more == u16::MAX { UNREACHABLE } else { least + Cost::from(more) };
                }
            }
            More::Wide(more) => {
                for (to, &more) in to.iter_mut().zip(&more[place..][..door.n_nodes]) {
                    *to = if more == u32::MAX { UNREACHABLE } else { least + more };
                }
            }
        }
    }

    /// Memory, in bytes.
    pub(crate) fn n_bytes(&self) -> usize {
        let more = match &self.more {
            More::Narrow(more) => size_of_val(more.as_slice()),
            More::Wide(more) => size_of_val(more.as_slice()),
        };
        size_of_val(self.least.as_slice()) + more
    }
}

/// Writes differences in 16 bits; false if one does not fit.
fn put_narrow(
    more: &mut [u16],
    place: impl Fn(usize) -> usize,
    least: &[Cost],
    n_doors: usize,
    columns: &[Vec<Cost>],
) -> bool {
    for (slot, &least) in least.iter().step_by(n_doors).enumerate() {
        for (to, column) in more[place(slot)..].iter_mut().zip(columns) {
            *to = match u16::try_from(column[slot] - least) {
                _ if UNREACHABLE <= column[slot] => u16::MAX,
                Ok(more) if more < u16::MAX => more,
                _ => return false,
            };
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
