//! Plan tables of one space: exact costs and routes by look-up.
//!
//! ```text
//! cost(s, t) = min over gates a of s's region, b of t's, nodes m of a, n of b of
//!              table(s, m) + all(m, n) + table(t, n)
//! ```
//!
//! or, within one region, what it costs inside. S. Thrun, Artificial Intelligence 99 (1998),
//! section 3.2, plans topologically and in triplets of regions; section 4.2 tells what that loses.
//! Costs between the cells of critical lines, computed in the grid beforehand, lose nothing.

use std::sync::Arc;

use meetpoint_topology::{Partition, RegionIndex, TopologicalGraph};

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::{Clique, GateCosts};
use crate::gates::{Gate, gates};
use crate::hierarchy::Hierarchy;
use crate::pair_bounds::PairBounds;
use crate::region_table::{Door, RegionTable};
use crate::space::Space;

/// What crossing an arc costs beyond its length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcCost {
    /// So much more; 0 for a free passage.
    Open(Cost),
    /// No way.
    Closed,
}

/// Plan tables. Immutable: a change makes new ones, which share what did not change.
#[derive(Clone, Debug)]
pub struct Plans {
    pub(crate) space: Arc<Space>,
    pub(crate) layout: Arc<Layout>,
    pub(crate) tables: Vec<Arc<RegionTable>>,
    /// What crossing a gate costs beyond its length, by gate; [`UNREACHABLE`] if it is closed.
    pub(crate) tolls: Vec<Cost>,
    pub(crate) gate_costs: Arc<GateCosts>,
    pub(crate) bounds: Arc<PairBounds>,
}

/// What does not depend on costs: regions, their cells, gates, order of elimination.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) partition: Arc<Partition>,
    /// Cells by region, in row-major order.
    pub(crate) cells: Vec<Vec<u32>>,
    /// A cell's place among those of its region.
    pub(crate) slots: Vec<u32>,
    pub(crate) gates: Vec<Gate>,
    pub(crate) doors: Vec<Vec<Door>>,
    pub(crate) hierarchy: Hierarchy,
}

/// Size of plan tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Cells that can be entered.
    pub n_cells: usize,
    /// Pieces of portals.
    pub n_gates: usize,
    /// Cells of portals.
    pub n_nodes: usize,
    /// From cells to the nodes of their region, in bytes.
    pub region_bytes: usize,
    /// Between nodes, in bytes.
    pub gate_bytes: usize,
}

impl Plans {
    /// Tables for a robot that goes about in `space`, cut into regions by `partition` and `graph`.
    /// `arcs` has one entry an arc of the graph. Partition and space must be of the same cells.
    pub fn new(
        space: Arc<Space>,
        partition: Arc<Partition>,
        graph: &TopologicalGraph,
        arcs: &[ArcCost],
    ) -> Self {
        let layout = Arc::new(Layout::new(&space, partition, graph));
        let tables = (0..layout.cells.len()).map(|region| layout.table(&space, region)).collect();
        Self::assembled(space, layout, tables, arcs)
    }

    /// The same regions with other costs: only the tables of regions where a cell or a step
    /// changed are computed again. Equal to tables made afresh, but for the order of elimination.
    ///
    /// The cells of `space` must be those of the tables; it may close some and open these again,
    /// but not open what was closed when the tables were first made.
    pub fn with_costs(&self, space: Arc<Space>, arcs: &[ArcCost]) -> Self {
        let layout = self.layout.clone();
        let table = |region: usize| {
            if layout.is_same(&self.space, &space, region) {
                self.tables[region].clone()
            } else {
                layout.table(&space, region)
            }
        };
        let tables = (0..layout.cells.len()).map(table).collect();
        Self::assembled(space, layout.clone(), tables, arcs)
    }

    fn assembled(
        space: Arc<Space>,
        layout: Arc<Layout>,
        tables: Vec<Arc<RegionTable>>,
        arcs: &[ArcCost],
    ) -> Self {
        let toll = |gate: &Gate| {
            let tolls = gate.arcs.iter().map(|&arc| match arcs.get(arc) {
                Some(ArcCost::Closed) => UNREACHABLE,
                Some(&ArcCost::Open(toll)) => toll,
                None => 0,
            });
            tolls.fold(0, |sum: Cost, toll| sum.saturating_add(toll).min(UNREACHABLE))
        };
        let tolls: Vec<Cost> = layout.gates.iter().map(toll).collect();
        let cliques: Vec<Clique> = (0..tables.len())
            .map(|region| layout.clique(&space, region, &tables[region], &tolls))
            .collect();
        let gate_costs = Arc::new(GateCosts::new(&layout.hierarchy, &cliques));
        let bounds = Arc::new(PairBounds::new(&layout.hierarchy, &gate_costs));
        Self { space, layout, tables, tolls, gate_costs, bounds }
    }

    /// Where the robot can go.
    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    /// The regions.
    pub fn partition(&self) -> &Arc<Partition> {
        &self.layout.partition
    }

    /// How much there is.
    pub fn size(&self) -> Size {
        Size {
            n_cells: self.layout.cells.iter().map(Vec::len).sum(),
            n_gates: self.layout.gates.len(),
            n_nodes: self.layout.gates.iter().map(|gate| gate.nodes.len()).sum(),
            region_bytes: self.tables.iter().map(|table| table.n_bytes()).sum(),
            gate_bytes: self.gate_costs.n_bytes() + self.bounds.n_bytes(),
        }
    }

    /// Region and place in its table of a cell that can be entered.
    pub(crate) fn place(&self, index: usize) -> Option<(usize, usize)> {
        if !self.space.is_enterable(index) {
            return None;
        }
        let RegionIndex(region) = self.layout.partition.region_at(index)?;
        Some((region as usize, self.layout.slots[index] as usize))
    }

    /// What passing a door costs on the side of its region: the toll is paid across.
    pub(crate) fn door_cost(&self, door: &Door) -> Cost {
        let toll = self.tolls[door.gate];
        if door.is_inner && toll < UNREACHABLE { 0 } else { toll }
    }
}

impl Layout {
    fn new(space: &Space, partition: Arc<Partition>, graph: &TopologicalGraph) -> Self {
        let mut cells = vec![vec![]; partition.n_regions() as usize];
        let mut slots = vec![u32::MAX; space.info().n_cells()];
        for (index, slot) in slots.iter_mut().enumerate() {
            let Some(RegionIndex(region)) = partition.region_at(index) else { continue };
            if space.is_enterable(index) {
                let cells = &mut cells[region as usize];
                *slot = u32::try_from(cells.len()).unwrap_or(u32::MAX);
                cells.push(u32::try_from(index).unwrap_or(u32::MAX));
            }
        }
        let gates = gates(space, &partition, graph);
        let doors = doors(&gates, cells.len());
        let n_nodes = gates.iter().map(|gate| gate.nodes.len()).collect();
        let of_region = doors.iter().map(|doors| doors.iter().map(|door| door.gate).collect());
        let hierarchy = Hierarchy::new(n_nodes, of_region);
        Self { partition, cells, slots, gates, doors, hierarchy }
    }

    /// Place of a cell in a region, if it lies there.
    fn slot_in(&self, region: usize, index: usize) -> Option<u32> {
        let is_here = self
            .partition
            .region_at(index)
            .is_some_and(|RegionIndex(at)| at as usize == region);
        (is_here && self.slots[index] != u32::MAX).then(|| self.slots[index])
    }

    fn table(&self, space: &Space, region: usize) -> Arc<RegionTable> {
        let slot = |index: usize| self.slot_in(region, index).filter(|_| space.is_enterable(index));
        let (doors, cells) = (&self.doors[region], &self.cells[region]);
        Arc::new(RegionTable::new(space, &self.gates, doors, cells, slot))
    }

    /// Whether all that a region's table is made from is the same in two spaces.
    fn is_same(&self, before: &Space, after: &Space, region: usize) -> bool {
        let is_same = |index: usize| {
            before.moves(index) == after.moves(index)
                && before.weight(index) == after.weight(index)
        };
        let across = self.doors[region].iter().filter(|door| !door.is_inner);
        self.cells[region].iter().all(|&cell| is_same(cell as usize))
            && across
                .flat_map(|door| &self.gates[door.gate].nodes)
                .all(|node| is_same(node.cell))
    }

    /// Costs between the nodes of a region's gates by ways inside it.
    fn clique(&self, space: &Space, region: usize, table: &RegionTable, tolls: &[Cost]) -> Clique {
        let doors = &self.doors[region];
        let n_nodes: usize = doors.iter().map(|door| door.n_nodes).sum();
        let mut costs = vec![UNREACHABLE; n_nodes * n_nodes];
        let mut row = vec![UNREACHABLE; n_nodes];
        for door in doors {
            let toll = tolls[door.gate];
            for (at, node) in self.gates[door.gate].nodes.iter().enumerate() {
                let to = &mut costs[(door.first + at) * n_nodes..][..n_nodes];
                if UNREACHABLE <= toll {
                    continue;
                }
                let starts = starts(space, node, door.is_inner, toll);
                for (cell, extra) in starts {
                    let Some(slot) = self.slot_in(region, cell) else { continue };
                    row_of(table, doors, slot as usize, tolls, &mut row);
                    for (to, &cost) in to.iter_mut().zip(&row) {
                        *to = (*to).min(extra + cost).min(UNREACHABLE);
                    }
                }
            }
        }
        let gates = doors.iter().map(|door| (door.gate, door.first)).collect();
        let region = u32::try_from(region).unwrap_or(u32::MAX);
        Clique { region, gates, n_nodes, costs }
    }
}

/// Cells of a region from which, or by which, a way from a node begins, with its cost so far.
fn starts(
    space: &Space,
    node: &crate::gates::Node,
    is_inner: bool,
    toll: Cost,
) -> Vec<(usize, Cost)> {
    if is_inner {
        return vec![(node.cell, 0)];
    }
    let open = node.across.iter().filter(|(step, _)| space.moves(node.cell) >> step & 1 == 1);
    open.map(|&(step, to)| (to, toll + space.step_cost(node.cell, step))).collect()
}

/// Costs from a cell to all nodes of its region, tolls included.
fn row_of(
    table: &RegionTable,
    doors: &[Door],
    slot: usize,
    tolls: &[Cost],
    row: &mut [Cost],
) {
    for (at, door) in doors.iter().enumerate() {
        let toll = tolls[door.gate];
        let to = &mut row[door.first..][..door.n_nodes];
        if UNREACHABLE <= toll {
            to.fill(UNREACHABLE);
        } else {
            table.costs(slot, at, door, if door.is_inner { 0 } else { toll }, to);
        }
    }
}

/// The doors of every region.
fn doors(gates: &[Gate], n_regions: usize) -> Vec<Vec<Door>> {
    let mut doors: Vec<Vec<Door>> = vec![vec![]; n_regions];
    for (at, gate) in gates.iter().enumerate() {
        for (region, is_inner) in gate.regions.iter().zip([true, false]) {
            let doors = &mut doors[region.0 as usize];
            let first = doors.last().map_or(0, |door| door.first + door.n_nodes);
            doors.push(Door { gate: at, is_inner, first, n_nodes: gate.nodes.len() });
        }
    }
    doors
}
