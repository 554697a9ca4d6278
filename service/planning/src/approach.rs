//! From a cell to the nodes of a gate, and from these to those of another.

use crate::cost::{Cost, UNREACHABLE};
use crate::differences::DifferenceRow;
use crate::gates::GATE_NODES_MAX;
use crate::least_sums::{Columns, first_by_column, first_by_row, least_sum};
use crate::pair_costs::Block;
use crate::plans::{Place, Plans};
use crate::region_table::{Door, RegionTable};

/// A cell, and the ways out of its region.
pub(crate) struct End<'a> {
    place: Place,
    table: &'a RegionTable,
    pub(crate) doors: &'a [Door],
    tolls: &'a [Cost],
}

/// Costs from a cell to the nodes of one gate.
#[derive(Clone, Copy)]
pub(crate) struct Approach<'a> {
    pub(crate) gate: usize,
    pub(crate) n_nodes: usize,
    /// The least of them; at most [`UNREACHABLE`].
    least: Cost,
    /// What the others are more.
    more: DifferenceRow<'a>,
}

impl<'a> End<'a> {
    /// Of a cell.
    pub(crate) fn new(plans: &'a Plans, place: Place) -> Self {
        let table = &*plans.tables[place.region()];
        let doors = plans.layout.doors[place.region()].as_slice();
        let tolls = plans.door_tolls[place.region()].as_slice();
        Self { place, table, doors, tolls }
    }

    /// Least cost to a door, toll included; at most [`UNREACHABLE`].
    pub(crate) fn least(&self, at: usize) -> Cost {
        let least = self.table.least(self.place.slot(), at, &self.doors[at]);
        least.saturating_add(self.tolls[at]).min(UNREACHABLE)
    }

    /// Costs to the nodes of a door.
    pub(crate) fn approach(&self, at: usize) -> Approach<'a> {
        let door = &self.doors[at];
        let more = self.table.more(self.place.slot(), at, door);
        Approach { gate: door.gate, n_nodes: door.n_nodes, least: self.least(at), more }
    }
}

impl Approach<'_> {
    /// By node; [`UNREACHABLE`] where there is none.
    pub(crate) fn costs(&self) -> [Cost; GATE_NODES_MAX] {
        let mut costs = [UNREACHABLE; GATE_NODES_MAX];
        if self.least < UNREACHABLE {
            self.more.costs(self.least, &mut costs);
        }
        costs.map(|cost| cost.min(UNREACHABLE))
    }
}

/// Sums of the costs to two gates and of those between their nodes.
pub(crate) struct BlockSums<'a> {
    pub(crate) from: Approach<'a>,
    pub(crate) to: Approach<'a>,
    pub(crate) block: Block<'a>,
}

impl BlockSums<'_> {
    /// The least of them; [`UNREACHABLE`] if there is no way.
    pub(crate) fn cost(&self) -> Cost {
        let least = self.least();
        if UNREACHABLE <= least {
            return UNREACHABLE;
        }
        let narrow =
            self.narrow().map(|(rows, between, columns)| least_sum(rows, between, &columns));
        match narrow {
            Some(more) if more < u16::MAX => (least + Cost::from(more)).min(UNREACHABLE),
            _ => self.wide_cost(),
        }
    }

    /// The nodes of the first sum, by those of `from`, that is a `cost` below [`UNREACHABLE`].
    pub(crate) fn first(&self, cost: Cost) -> Option<(usize, usize)> {
        let more = u16::try_from(cost - self.least()).ok().filter(|&more| more < u16::MAX);
        let Some(((rows, between, columns), more)) = self.narrow().zip(more) else {
            return self.wide_first(cost);
        };
        if self.block.is_turned {
            let (to, from) = first_by_column(rows, between, &columns, more)?;
            return Some((from, to));
        }
        first_by_row(rows, between, &columns, more)
    }

    /// No sum is less.
    fn least(&self) -> Cost {
        self.from.least + self.block.least + self.to.least
    }

    /// Rows, block and columns, if all are of 16 bits.
    fn narrow(&self) -> Option<(&[u16], &[u16], Columns)> {
        let (rows, columns) =
            if self.block.is_turned { (&self.to, &self.from) } else { (&self.from, &self.to) };
        let (DifferenceRow::Narrow(rows), DifferenceRow::Narrow(columns)) =
            (rows.more, columns.more)
        else {
            return None;
        };
        let DifferenceRow::Narrow(between) = self.block.more else { return None };
        Some((rows, between, Columns::new(columns)))
    }

    fn wide_cost(&self) -> Cost {
        let [from, to] = [&self.from, &self.to].map(Approach::costs);
        let (rows, columns) = if self.block.is_turned { (to, from) } else { (from, to) };
        let n_rows = if self.block.is_turned { self.to.n_nodes } else { self.from.n_nodes };
        let mut best = UNREACHABLE;
        for (row, &cost) in rows[..n_rows].iter().enumerate() {
            let mut line = [UNREACHABLE; GATE_NODES_MAX];
            self.block.row(row, &mut line);
            let sums = line.iter().zip(&columns).map(|(between, column)| between + column);
            best = best.min(cost + sums.min().unwrap_or(UNREACHABLE));
        }
        best
    }

    fn wide_first(&self, cost: Cost) -> Option<(usize, usize)> {
        let [from, to] = [&self.from, &self.to].map(Approach::costs);
        (0..self.from.n_nodes).find_map(|first| {
            let sum = |&last: &usize| from[first] + self.block.cost(first, last) + to[last];
            (0..self.to.n_nodes).find(|last| sum(last) == cost).map(|last| (first, last))
        })
    }
}
