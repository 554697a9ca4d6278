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
use crate::exits::{Exits, Sources};
use crate::gate_costs::{Clique, GateCosts};
use crate::gates::{Gate, gates};
use crate::hierarchy::Hierarchy;
use crate::inside::Patch;
use crate::pair_costs::PairCosts;
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
    /// By region, for searches within it.
    pub(crate) patches: Vec<Arc<Patch>>,
    /// What crossing a gate costs beyond its length, by gate; [`UNREACHABLE`] if it is closed.
    pub(crate) tolls: Vec<Cost>,
    pub(crate) gate_costs: Arc<GateCosts>,
    /// Of every region's doors: the toll, where it is paid on the region's side.
    pub(crate) door_tolls: Vec<Vec<Cost>>,
    pub(crate) pairs: Arc<PairCosts>,
    pub(crate) exits: Arc<Exits>,
}

/// What does not depend on costs: regions, their cells, gates, order of elimination.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) partition: Arc<Partition>,
    /// Cells by region, in row-major order.
    pub(crate) cells: Vec<Vec<u32>>,
    /// Where every cell is found.
    pub(crate) places: Vec<Place>,
    pub(crate) gates: Vec<Gate>,
    pub(crate) doors: Vec<Vec<Door>>,
    pub(crate) hierarchy: Hierarchy,
}

/// Region of a cell, and its place among the cells of the region that can be entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    region: u32,
    slot: u32,
}

impl Place {
    const NOWHERE: Self = Self { region: u32::MAX, slot: u32::MAX };

    pub(crate) fn region(self) -> usize {
        self.region as usize
    }

    pub(crate) fn slot(self) -> usize {
        self.slot as usize
    }
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
    /// From cells to the nodes of their region, and what searches within it need, in bytes.
    pub region_bytes: usize,
    /// Between nodes, in bytes.
    pub gate_bytes: usize,
}

impl Plans {
    /// Tables for a robot that goes about in `space`, cut into regions by `partition` and `graph`.
    /// `arcs` has one entry an arc of the graph. Partition and space must be of the same cells.
    /// Costs between all nodes are kept ready if they take no more than `pair_bytes_max`; without
    /// them answers are the same and take longer.
    pub fn new(
        space: Arc<Space>,
        partition: Arc<Partition>,
        graph: &TopologicalGraph,
        arcs: &[ArcCost],
        pair_bytes_max: usize,
    ) -> Self {
        let layout = Arc::new(Layout::new(&space, partition, graph));
        let tables: Vec<_> =
            (0..layout.cells.len()).map(|region| layout.table(&space, region)).collect();
        let patches = (0..tables.len()).map(|region| layout.patch(&space, region)).collect();
        let tolls = layout.tolls(arcs);
        let cliques = (0..tables.len())
            .map(|region| Arc::new(layout.clique(&space, region, &tables[region], &tolls)))
            .collect();
        let gate_costs = GateCosts::new(&layout.hierarchy, cliques);
        let pairs = PairCosts::new(&layout.hierarchy, &gate_costs, pair_bytes_max);
        let sources =
            Sources { hierarchy: &layout.hierarchy, pairs: &pairs, cliques: gate_costs.cliques() };
        let exits = Arc::new(Exits::new(&sources));
        let (gate_costs, pairs) = (Arc::new(gate_costs), Arc::new(pairs));
        let door_tolls = layout.door_tolls(&tolls);
        Self { space, layout, tables, patches, tolls, gate_costs, door_tolls, pairs, exits }
    }

    /// The same regions with other costs: only what the difference reaches is computed again.
    /// Answers are those of tables made afresh.
    ///
    /// The cells of `space` must be those of the tables; it may close some and open these again,
    /// but not open what was closed when the tables were first made.
    pub fn with_costs(&self, space: Arc<Space>, arcs: &[ArcCost]) -> Self {
        let layout = &self.layout;
        let tolls = layout.tolls(arcs);
        let mut tables = self.tables.clone();
        let mut patches = self.patches.clone();
        let mut cliques = self.gate_costs.cliques().to_vec();
        for (region, (table, clique)) in tables.iter_mut().zip(&mut cliques).enumerate() {
            let is_same =
                Arc::ptr_eq(&self.space, &space) || layout.is_same(&self.space, &space, region);
            if !is_same {
                *table = layout.table(&space, region);
                patches[region] = layout.patch(&space, region);
            }
            let mut gates = layout.doors[region].iter().map(|door| door.gate);
            if !is_same || gates.any(|gate| tolls[gate] != self.tolls[gate]) {
                *clique = Arc::new(layout.clique(&space, region, table, &tolls));
            }
        }
        let (gate_costs, is_changed) = self.gate_costs.with_cliques(&layout.hierarchy, cliques);
        let (pairs, changed) = self.pairs.with_changes(&layout.hierarchy, &gate_costs, &is_changed);
        let sources =
            Sources { hierarchy: &layout.hierarchy, pairs: &pairs, cliques: gate_costs.cliques() };
        let before = self.gate_costs.cliques();
        let exits = self.exits.with_changes(&sources, before, |a, b| changed.of(a, b));
        Self {
            space,
            tables,
            patches,
            door_tolls: layout.door_tolls(&tolls),
            tolls,
            gate_costs: Arc::new(gate_costs),
            pairs: Arc::new(pairs),
            exits: Arc::new(exits),
            ..self.clone()
        }
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
            region_bytes: self.tables.iter().map(|table| table.n_bytes()).sum::<usize>()
                + self.patches.iter().map(|patch| patch.n_bytes()).sum::<usize>(),
            gate_bytes: self.gate_costs.n_bytes() + self.pairs.n_bytes() + self.exits.n_bytes(),
        }
    }

    /// Where a cell is found that could be entered when the tables were first made.
    pub(crate) fn place(&self, index: usize) -> Option<Place> {
        self.layout.places.get(index).copied().filter(|&place| place != Place::NOWHERE)
    }

    /// Whether a cell lies in a region.
    pub(crate) fn is_in(&self, region: usize, index: usize) -> bool {
        self.layout.places[index].region() == region
    }
}

impl Layout {
    fn new(space: &Space, partition: Arc<Partition>, graph: &TopologicalGraph) -> Self {
        let mut cells = vec![vec![]; partition.n_regions() as usize];
        let mut places = vec![Place::NOWHERE; space.info().n_cells()];
        for (index, place) in places.iter_mut().enumerate() {
            let Some(RegionIndex(region)) = partition.region_at(index) else { continue };
            if space.is_enterable(index) {
                let cells = &mut cells[region as usize];
                let slot = u32::try_from(cells.len()).unwrap_or(u32::MAX);
                *place = Place { region, slot };
                cells.push(u32::try_from(index).unwrap_or(u32::MAX));
            }
        }
        let gates = gates(space, &partition, graph);
        let doors = doors(&gates, cells.len());
        let n_nodes = gates.iter().map(|gate| gate.nodes.len()).collect();
        let of_region = doors.iter().map(|doors| doors.iter().map(|door| door.gate).collect());
        let hierarchy = Hierarchy::new(n_nodes, of_region);
        Self { partition, cells, places, gates, doors, hierarchy }
    }

    /// Place of a cell in a region, if it lies there.
    fn slot_in(&self, region: usize, index: usize) -> Option<u32> {
        let place = self.places[index];
        (place.region() == region).then_some(place.slot)
    }

    /// What crossing a gate costs beyond its length; [`UNREACHABLE`] if it is closed.
    fn tolls(&self, arcs: &[ArcCost]) -> Vec<Cost> {
        let toll = |gate: &Gate| {
            let tolls = gate.arcs.iter().map(|&arc| match arcs.get(arc) {
                Some(ArcCost::Closed) => UNREACHABLE,
                Some(&ArcCost::Open(toll)) => toll,
                None => 0,
            });
            tolls.fold(0, |sum: Cost, toll| sum.saturating_add(toll).min(UNREACHABLE))
        };
        self.gates.iter().map(toll).collect()
    }

    /// Tolls by region and door: paid on the side across from the nodes; a closed gate is closed
    /// on both.
    fn door_tolls(&self, tolls: &[Cost]) -> Vec<Vec<Cost>> {
        let toll = |door: &Door| match tolls[door.gate] {
            toll if door.is_inner && toll < UNREACHABLE => 0,
            toll => toll,
        };
        self.doors.iter().map(|doors| doors.iter().map(toll).collect()).collect()
    }

    fn table(&self, space: &Space, region: usize) -> Arc<RegionTable> {
        let slot = |index: usize| self.slot_in(region, index).filter(|_| space.is_enterable(index));
        let (doors, cells) = (&self.doors[region], &self.cells[region]);
        Arc::new(RegionTable::new(space, &self.gates, doors, cells, slot))
    }

    fn patch(&self, space: &Space, region: usize) -> Arc<Patch> {
        let is_here =
            |index: usize| self.places[index].region() == region && space.is_enterable(index);
        Arc::new(Patch::new(space, &self.cells[region], is_here))
    }

    /// Whether all that a region's table is made from is the same in two spaces.
    fn is_same(&self, before: &Space, after: &Space, region: usize) -> bool {
        let is_same = |index: usize| {
            before.moves(index) == after.moves(index) && before.weight(index) == after.weight(index)
        };
        let across = self.doors[region].iter().filter(|door| !door.is_inner);
        self.cells[region].iter().all(|&cell| is_same(cell as usize))
            && across.flat_map(|door| &self.gates[door.gate].nodes).all(|node| is_same(node.cell))
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
fn row_of(table: &RegionTable, doors: &[Door], slot: usize, tolls: &[Cost], row: &mut [Cost]) {
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
