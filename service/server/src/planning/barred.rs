//! What closed arcs bar on a map as it grows, which has no arcs of its own.

use std::collections::HashMap;

use meetpoint_planning::Shape;
use meetpoint_topology::Topology;

use super::costs::{CostKind, Costs};
use super::field::center_of;

/// A bar about a step that leads across an arc's line, in cells: one on either side of it, because walls
/// have wavered by as much since the version was drawn.
const BAR_WIDTH_CELLS: f64 = 2.0;

/// Obstacles in place of the arcs of a version that are closed, and the ids of closed arcs that it lacks.
pub(crate) fn barred(topology: &Topology, costs: &Costs) -> (Vec<Shape>, Vec<u64>) {
    let info = topology.partition().info();
    let width_m = BAR_WIDTH_CELLS * info.frame.resolution_m();
    let ids = topology.ids().arcs.iter().map(|id| id.0);
    let arcs: HashMap<u64, _> = ids.zip(&topology.graph().arcs).collect();
    let (mut shapes, mut missing) = (Vec::new(), Vec::new());
    for id in closed(costs) {
        let Some(arc) = arcs.get(&id) else {
            missing.push(id);
            continue;
        };
        let steps = arc.portal.iter().map(|step| [step.left, step.right]);
        let ends = steps.map(|ends| ends.map(|index| center_of(info, index)).to_vec());
        shapes.extend(ends.map(|points| Shape::Polyline { points, width_m }));
    }
    (shapes, missing)
}

/// Ids of the arcs that are closed, the oldest decision first.
pub(crate) fn closed(costs: &Costs) -> impl Iterator<Item = u64> + '_ {
    costs.in_force().iter().filter_map(|cost| match cost.kind {
        CostKind::Closure(arc) => Some(arc),
        _ => None,
    })
}
