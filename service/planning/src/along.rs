//! The regions along a path of cells, and the arcs between them.

use meetpoint_topology::{Partition, RegionIndex, TopologicalGraph};

use crate::gates::Crossings;
use crate::space::Space;

/// A region on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// The region.
    pub region: RegionIndex,
    /// The arc by which it is entered, by its place in the graph: the first of them where a corner
    /// is cut; `None` in the region of the start.
    pub arc: Option<usize>,
}

/// The regions that a path of neighbouring cells goes through. Time O(cells + portal cells).
pub fn stretches(
    space: &Space,
    partition: &Partition,
    graph: &TopologicalGraph,
    cells: &[u32],
) -> Vec<Stretch> {
    let crossings = Crossings::new(graph);
    let region_of = |cell: u32| partition.region_at(cell as usize);
    let Some(first) = cells.first().and_then(|&cell| region_of(cell)) else { return vec![] };
    let mut found = vec![Stretch { region: first, arc: None }];
    for pair in cells.windows(2) {
        let (Some(here), Some(next)) = (region_of(pair[0]), region_of(pair[1])) else { continue };
        if here == next {
            continue;
        }
        let [from, to] = [pair[0], pair[1]].map(|cell| cell as usize);
        // From the smaller region, as gates are found.
        let (from, to) = if here < next { (from, to) } else { (to, from) };
        let step = space.steps(from).find(|&(_, cell)| cell == to).map(|(step, _)| step);
        let regions = [here.min(next), here.max(next)];
        let crossed = |step| crossings.of_step(space, graph, regions, (from, step));
        let arc = step.and_then(|step| crossed(step).first().copied());
        found.push(Stretch { region: next, arc });
    }
    found
}
