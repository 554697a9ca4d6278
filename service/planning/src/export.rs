//! What is in plan tables, for whoever carries them elsewhere.

use meetpoint_topology::RegionIndex;

use crate::cost::Cost;
use crate::plans::Plans;

/// A gate: a piece of the portal between two regions.
#[derive(Clone, Debug, PartialEq)]
pub struct GateView {
    /// The region that holds the nodes, and the one across.
    pub regions: [RegionIndex; 2],
    /// What crossing costs beyond its length; [`UNREACHABLE`](crate::UNREACHABLE) if it is closed.
    pub toll: Cost,
    /// In their order along the line.
    pub nodes: Vec<NodeView>,
}

/// A cell of a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeView {
    /// The cell, by index.
    pub cell: usize,
    /// By which steps the gate is crossed from it: bit k for step k.
    pub across: u8,
}

impl Plans {
    /// All gates.
    pub fn gates(&self) -> impl Iterator<Item = GateView> + '_ {
        self.layout.gates.iter().zip(&self.tolls).map(|(gate, &toll)| {
            let node = |node: &crate::gates::Node| NodeView {
                cell: node.cell,
                across: node.across.iter().fold(0, |across, (step, _)| across | 1 << step),
            };
            GateView { regions: gate.regions, toll, nodes: gate.nodes.iter().map(node).collect() }
        })
    }

    /// Number of regions.
    pub fn n_regions(&self) -> usize {
        self.layout.cells.len()
    }

    /// Cells of a region that could be entered when the tables were first made, ascending.
    ///
    /// # Panics
    /// If `region` is not below [`Self::n_regions`]; true of all functions here that take one.
    pub fn region_cells(&self, region: usize) -> &[u32] {
        &self.layout.cells[region]
    }

    /// The gates of a region, by their places among all.
    pub fn region_gates(&self, region: usize) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.layout.doors[region].iter().map(|door| door.gate)
    }

    /// Number of nodes of a gate, by its place among all.
    ///
    /// # Panics
    /// If there is no such gate.
    pub fn n_gate_nodes(&self, gate: usize) -> usize {
        self.layout.gates[gate].nodes.len()
    }

    /// Cost inside a region from each of its cells to a node of one of its gates, tolls apart: the
    /// gate by its place among the region's, the node by its place in the gate.
    ///
    /// # Panics
    /// If there is no such gate or node.
    pub fn region_costs(
        &self,
        region: usize,
        gate: usize,
        node: usize,
    ) -> impl Iterator<Item = Cost> + '_ {
        let door = &self.layout.doors[region][gate];
        assert!(node < door.n_nodes, "node {node} of {}", door.n_nodes);
        let (table, place) = (&self.tables[region], door.first + node);
        (0..self.layout.cells[region].len()).map(move |slot| table.cost(slot, gate, door, place))
    }
}
