//! Gates: the cells where one region is left and the next entered.
//!
//! A portal (T98, section 3.1: a critical line) is all steps that lead from one region to another
//! across one arc. Its *nodes* are the cells of one side from which such a step leads, the side
//! with fewer of them; every path across passes a node. Long portals are cut into gates of at most
//! [`GATE_NODES_MAX`] nodes, along the line. A diagonal step between two regions that no arc joins
//! makes a portal of its own. Time O(cells + steps log steps).

use std::collections::{BTreeMap, HashMap};

use meetpoint_topology::{Partition, RegionIndex, TopologicalGraph};

use crate::space::Space;

/// Nodes of a gate at most. The costs from one cell to the nodes of a gate then differ by few
/// enough to fit in 16 bits in open space, see [`crate::region_table`].
pub(crate) const GATE_NODES_MAX: usize = 32;

/// A piece of a portal.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Gate {
    /// The region that holds the nodes, and the other one.
    pub(crate) regions: [RegionIndex; 2],
    /// Indices of the graph's arcs that all have to be open for this gate to be.
    pub(crate) arcs: Vec<usize>,
    /// In their order along the line; at least one.
    pub(crate) nodes: Vec<Node>,
}

/// A cell of a gate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    /// The cell, by index; in the gate's first region.
    pub(crate) cell: usize,
    /// Steps that lead from it across the gate, and the cells in the other region they lead to.
    pub(crate) across: Vec<(usize, usize)>,
}

/// Steps across portals, by the pair of regions (smaller first) and the arcs: each with the cell
/// in the smaller region and the step from there.
type Portals = BTreeMap<([RegionIndex; 2], Vec<usize>), Vec<(usize, usize)>>;

/// All gates between the regions of `partition`, for a robot that goes about in `space`.
pub(crate) fn gates(space: &Space, partition: &Partition, graph: &TopologicalGraph) -> Vec<Gate> {
    let portals = portals(space, partition, graph);
    portals
        .into_iter()
        .flat_map(|((regions, arcs), steps)| pieces(space, regions, &arcs, &steps))
        .collect()
}

fn portals(space: &Space, partition: &Partition, graph: &TopologicalGraph) -> Portals {
    let crossings = Crossings::new(graph);
    let mut portals = Portals::new();
    for index in 0..space.info().n_cells() {
        let Some(region) = partition.region_at(index) else { continue };
        for (step, to) in space.steps(index) {
            let Some(other) = partition.region_at(to).filter(|&other| region < other) else {
                continue;
            };
            let arcs = crossings.of_step(space, graph, [region, other], (index, step));
            portals.entry(([region, other], arcs)).or_default().push((index, step));
        }
    }
    portals
}

/// The arc of every step along an axis from one region to another, by its two cells, the smaller
/// index first.
pub(crate) struct Crossings(HashMap<[usize; 2], usize>);

impl Crossings {
    pub(crate) fn new(graph: &TopologicalGraph) -> Self {
        let mut arc_of = HashMap::new();
        for (arc, crossings) in graph.arcs.iter().map(|arc| &arc.portal).enumerate() {
            for crossing in crossings {
                arc_of.entry(sorted(crossing.left, crossing.right)).or_insert(arc);
            }
        }
        Self(arc_of)
    }

    /// The arcs that a step between `regions`, the smaller first, crosses: one that joins the two,
    /// or for a diagonal step between regions without one, all that it cuts the corner of.
    pub(crate) fn of_step(
        &self,
        space: &Space,
        graph: &TopologicalGraph,
        regions: [RegionIndex; 2],
        (from, step): (usize, usize),
    ) -> Vec<usize> {
        let arc = |a: usize, b: usize| self.0.get(&sorted(a, b)).copied();
        let to = space.neighbor(from, step);
        if step.is_multiple_of(2) {
            return arc(from, to).into_iter().collect();
        }
        let beside = [space.neighbor(from, step - 1), space.neighbor(from, (step + 1) % 8)];
        let around = |cell| [arc(from, cell), arc(cell, to)];
        let mut arcs: Vec<usize> = beside.into_iter().flat_map(around).flatten().collect();
        arcs.sort_unstable();
        arcs.dedup();
        match arcs.iter().find(|&&arc| graph.arcs[arc].regions == regions) {
            Some(&joining) => vec![joining],
            None => arcs,
        }
    }
}

/// A portal's gates.
fn pieces(
    space: &Space,
    [low, high]: [RegionIndex; 2],
    arcs: &[usize],
    steps: &[(usize, usize)],
) -> Vec<Gate> {
    let forth = side(space, steps.iter().copied());
    let back =
        side(space, steps.iter().map(|&(from, step)| (space.neighbor(from, step), (step + 4) % 8)));
    let (regions, nodes) =
        if back.len() < forth.len() { ([high, low], back) } else { ([low, high], forth) };
    let n_pieces = nodes.len().div_ceil(GATE_NODES_MAX);
    let n_nodes = nodes.len().div_ceil(n_pieces);
    let gate = |nodes: &[Node]| Gate { regions, arcs: arcs.to_vec(), nodes: nodes.to_vec() };
    nodes.chunks(n_nodes).map(gate).collect()
}

/// The nodes of one side of a portal, along the line.
fn side(space: &Space, steps: impl Iterator<Item = (usize, usize)>) -> Vec<Node> {
    let mut of_cell: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    for (from, step) in steps {
        of_cell.entry(from).or_default().push((step, space.neighbor(from, step)));
    }
    let width = space.info().width as usize;
    let place = |cell: usize| [cell % width, cell / width];
    let extent = |axis: usize| {
        let places = || of_cell.keys().map(|&cell| place(cell)[axis]);
        places().max().zip(places().min()).map_or(0, |(most, least)| most - least)
    };
    let axis = usize::from(extent(0) < extent(1));
    let mut nodes: Vec<Node> =
        of_cell.into_iter().map(|(cell, across)| Node { cell, across }).collect();
    nodes.sort_by_key(|node| (place(node.cell)[axis], node.cell));
    nodes
}

fn sorted(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}
