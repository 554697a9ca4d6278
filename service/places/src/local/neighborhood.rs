//! Which nodes of the medial axis make up one place.
//!
//! The core of a place is the widest node around: "the maximum of the medial axis graph is found"
//! (HSSH 2004, Fig. 3). To it belong the nodes that overlap with it,
//!
//! ```text
//! way(core, node) <= reach · D(core)    and    narrowing · min D on the way >= D(node)
//! ```
//!
//! Cores are taken in the order of their clearance, so that a node belongs to one place. Time
//! O(nodes log nodes + lines of each place, squared), space O(nodes).

use crate::local::medial_axis::{AxisLine, MedialAxis, NodeKind};
use crate::local::params::NeighborhoodParams;

/// A line as it leaves a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Departure {
    /// Which line of the axis.
    pub(crate) line: usize,
    /// From which of its two ends: 0 or 1.
    pub(crate) end: usize,
}

/// The nodes of one place, and the lines that leave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Neighborhood {
    /// Its widest node.
    pub(crate) core: usize,
    pub(crate) departures: Vec<Departure>,
}

/// All nodes that belong to a place, grouped; frontiers belong to none. In the order of the
/// clearance of their cores, then of their cells.
pub(crate) fn neighborhoods(axis: &MedialAxis, params: &NeighborhoodParams) -> Vec<Neighborhood> {
    let mut lines_of = vec![vec![]; axis.nodes.len()];
    for (line, AxisLine { nodes, .. }) in axis.lines.iter().enumerate() {
        for (end, &node) in nodes.iter().enumerate() {
            lines_of[node].push(Departure { line, end });
        }
    }
    let measured: Vec<Measured> = axis.lines.iter().map(|line| Measured::new(axis, line)).collect();
    let mut order: Vec<usize> = (0..axis.nodes.len()).collect();
    order.retain(|&node| axis.nodes[node].kind != NodeKind::Frontier);
    order.sort_by_key(|&node| {
        let cell = axis.nodes[node].cell;
        (std::cmp::Reverse(axis.clearance.squared()[cell]), cell)
    });
    let mut is_taken = vec![false; axis.nodes.len()];
    let mut found = vec![];
    for core in order {
        if !is_taken[core] {
            let growth = Growth { axis, params, lines_of: &lines_of, measured: &measured };
            found.push(growth.from(core, &mut is_taken));
        }
    }
    found
}

#[derive(Clone, Copy)]
struct Measured {
    length_m: f64,
    narrowest_m: f64,
}

impl Measured {
    fn new(axis: &MedialAxis, line: &AxisLine) -> Self {
        let clearances = line.cells.iter().map(|&cell| axis.clearance.at_m(cell));
        let narrowest_m = clearances.fold(f64::INFINITY, f64::min);
        Self { length_m: axis.length_m(line), narrowest_m }
    }
}

struct Growth<'a> {
    axis: &'a MedialAxis,
    params: &'a NeighborhoodParams,
    lines_of: &'a [Vec<Departure>],
    measured: &'a [Measured],
}

/// A node within reach of a core, and the way there.
struct Reached {
    node: usize,
    way_m: f64,
    narrowest_m: f64,
    /// The line by which it is reached; none at the core.
    by: Option<usize>,
}

impl Growth<'_> {
    /// The place around a core, nearest nodes first (Dijkstra).
    fn from(&self, core: usize, is_taken: &mut [bool]) -> Neighborhood {
        let core_m = self.axis.clearance_at_m(core);
        let mut open =
            vec![Reached { node: core, way_m: 0.0, narrowest_m: f64::INFINITY, by: None }];
        let (mut nodes, mut inner) = (vec![], vec![]);
        while let Some(at) = nearest(&open) {
            let reached = open.swap_remove(at);
            if is_taken[reached.node] || !self.belongs(&reached, core_m) {
                continue;
            }
            is_taken[reached.node] = true;
            nodes.push(reached.node);
            inner.extend(reached.by);
            for &Departure { line, end } in &self.lines_of[reached.node] {
                let Measured { length_m, narrowest_m } = self.measured[line];
                open.push(Reached {
                    node: self.axis.lines[line].nodes[1 - end],
                    way_m: reached.way_m + length_m,
                    narrowest_m: reached.narrowest_m.min(narrowest_m),
                    by: Some(line),
                });
            }
        }
        let is_inside = |line: usize| inner.contains(&line) || self.is_inside(line, &nodes, core_m);
        let departures = nodes.iter().flat_map(|&node| &self.lines_of[node]).copied();
        let departures = departures.filter(|departure| !is_inside(departure.line)).collect();
        Neighborhood { core, departures }
    }

    fn belongs(&self, reached: &Reached, core_m: f64) -> bool {
        let NeighborhoodParams { junction_reach, end_reach, narrowing_min, .. } = *self.params;
        let reach = match self.axis.nodes[reached.node].kind {
            NodeKind::Junction | NodeKind::Room => junction_reach,
            NodeKind::End => end_reach,
            NodeKind::Frontier => return false,
        };
        let node_m = self.axis.clearance_at_m(reached.node);
        reached.by.is_none()
            || (reached.way_m <= reach * core_m && node_m <= narrowing_min * reached.narrowest_m)
    }

    /// Whether a second line between nodes of one place only leads around an obstacle in it.
    fn is_inside(&self, line: usize, nodes: &[usize], core_m: f64) -> bool {
        let ends = self.axis.lines[line].nodes;
        ends.iter().all(|end| nodes.contains(end))
            && self.measured[line].length_m <= 2.0 * self.params.junction_reach * core_m
    }
}

fn nearest(open: &[Reached]) -> Option<usize> {
    let key = |at: &usize| (open[*at].way_m, open[*at].node, open[*at].by);
    (0..open.len()).min_by(|a, b| {
        let ((a_m, a, a_by), (b_m, b, b_by)) = (key(a), key(b));
        a_m.total_cmp(&b_m).then((a, a_by).cmp(&(b, b_by)))
    })
}
