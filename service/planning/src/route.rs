//! Routes: which regions a best path goes through, and by which gates.

use meetpoint_topology::RegionIndex;

use crate::cost::{Cost, UNREACHABLE};
use crate::gate_costs::{Leg, NodeName};
use crate::inside::Scratch;
use crate::plans::Plans;

/// A piece of a portal, by its place among a map's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GateIndex(pub u32);

/// The regions of a best path.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Route {
    /// What the path costs.
    pub cost: Cost,
    /// From the start's region to the goal's; at least one.
    pub steps: Vec<RouteStep>,
}

/// A region on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RouteStep {
    /// The region.
    pub region: RegionIndex,
    /// Where it is entered; `None` in the first.
    pub gate: Option<GateIndex>,
}

/// A best path, piece by piece: through every piece's region from one end to the other.
pub(crate) struct Pieces {
    pub(crate) cost: Cost,
    /// Region of the start, and the first node; `None` if the path stays inside.
    pub(crate) first: Option<(usize, NodeName)>,
    pub(crate) legs: Vec<Leg>,
    /// Region of the goal, and the last node.
    pub(crate) last: Option<(usize, NodeName)>,
}

impl Plans {
    /// Cost of the best path between two cells, by index; [`UNREACHABLE`] if there is none.
    pub fn cost(&self, from: usize, to: usize, scratch: &mut Scratch) -> Cost {
        let (Some(start), Some(goal)) = (self.place(from), self.place(to)) else {
            return UNREACHABLE;
        };
        let by_gates = self.cost_by_gates(start, goal);
        if start.region() == goal.region() {
            return by_gates.min(scratch.search(self, from, to, by_gates));
        }
        by_gates
    }

    /// Regions and gates of the best path between two cells, by index; `None` if there is none.
    pub fn route(&self, from: usize, to: usize, scratch: &mut Scratch) -> Option<Route> {
        let region = self.place(from)?.region();
        let pieces = self.pieces(from, to, scratch)?;
        Some(route_of(region, &pieces))
    }

    /// The arcs that have to be open for a gate to be, by their places in the graph: one as a
    /// rule, more where a corner is cut between regions that no arc joins.
    pub fn arcs(&self, gate: GateIndex) -> &[usize] {
        self.layout.gates.get(gate.0 as usize).map_or(&[], |gate| &gate.arcs)
    }

    /// The best path; if it stays inside one region, `scratch` knows its cells.
    pub(crate) fn pieces(&self, from: usize, to: usize, scratch: &mut Scratch) -> Option<Pieces> {
        let (start, goal) = (self.place(from)?, self.place(to)?);
        let meeting = self.meeting(start, goal);
        let by_gates = meeting.map_or(UNREACHABLE, |meeting| meeting.cost);
        if start.region() == goal.region() {
            let cost = scratch.search(self, from, to, by_gates);
            if cost < by_gates {
                return Some(Pieces { cost, first: None, legs: vec![], last: None });
            }
        }
        let meeting = meeting?;
        let mut legs = vec![];
        let hierarchy = &self.layout.hierarchy;
        let middle = self.middle(meeting.first, meeting.last)?;
        self.gate_costs.legs(hierarchy, meeting.first, middle, &mut legs);
        self.gate_costs.legs(hierarchy, middle, meeting.last, &mut legs);
        Some(Pieces {
            cost: meeting.cost,
            first: Some((start.region(), meeting.first)),
            legs,
            last: Some((goal.region(), meeting.last)),
        })
    }
}

/// The regions of a path that begins in region `start`.
pub(crate) fn route_of(start: usize, pieces: &Pieces) -> Route {
    let step = |region: usize, gate: Option<usize>| RouteStep {
        region: RegionIndex(u32::try_from(region).unwrap_or(u32::MAX)),
        gate: gate.map(|gate| GateIndex(u32::try_from(gate).unwrap_or(u32::MAX))),
    };
    let mut steps = vec![step(start, None)];
    let legs = pieces.legs.iter().map(|leg| (leg.region as usize, leg.from));
    let mut region = start;
    for (next, node) in legs.chain(pieces.last) {
        if next != region {
            steps.push(step(next, Some(node.gate)));
            region = next;
        }
    }
    Route { cost: pieces.cost, steps }
}
