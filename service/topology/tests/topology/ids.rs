//! Ids over a building's life.

use meetpoint_topology::{
    ArcId, Becoming, Counters, Ids, Partition, RegionId, Snapshot, TopologicalGraph,
    TopologyParams, carried_ids, first_ids, segmentation, topological_graph,
};

use crate::building::{drawn, office};
use proptest::prelude::*;

const APART: &str = "
    #########################
    #.......#.......#.......#
    #.......#.......#.......#
    #.......................#
    #.......................#
    #.......................#
    #.......#.......#.......#
    #########################";

/// The wall on the right has been taken down, but for its ends.
const UNITED: &str = "
    #########################
    #.......#...............#
    #.......#...............#
    #.......................#
    #.......................#
    #.......................#
    #.......#...............#
    #########################";

fn cut(drawing: &str) -> (Partition, TopologicalGraph) {
    let found = segmentation(&drawn(drawing, 6), &TopologyParams::INDOOR);
    let graph = topological_graph(&found.partition, &found.lines, &found.clearance);
    (found.partition, graph)
}

struct Version {
    partition: Partition,
    graph: TopologicalGraph,
    ids: Ids,
}

fn first(drawing: &str, counters: &mut Counters) -> Version {
    let (partition, graph) = cut(drawing);
    let ids = first_ids(&graph, counters);
    Version { partition, graph, ids }
}

fn next(old: &Version, drawing: &str, counters: &mut Counters) -> (Version, Vec<Becoming>) {
    let (partition, graph) = cut(drawing);
    let old = Snapshot { partition: &old.partition, graph: &old.graph, ids: &old.ids };
    let (ids, becoming) = carried_ids(old, &partition, &graph, counters);
    (Version { partition, graph, ids }, becoming)
}

#[test]
fn arcs_of_one_middle_are_told_apart_by_their_lines() {
    let mut counters = Counters::default();
    let (partition, mut graph) = cut(APART);
    let mut twin = graph.arcs[0].clone();
    twin.line[1].x += 0.05;
    graph.arcs.push(twin);
    let ids = first_ids(&graph, &mut counters);
    let old = Snapshot { partition: &partition, graph: &graph, ids: &ids };
    let (again, _) = carried_ids(old, &partition, &graph, &mut counters);
    assert_eq!(again, ids, "nothing has changed");
}

#[test]
fn of_a_union_the_largest_had_it_and_of_a_split_the_largest_keeps_it() {
    let mut counters = Counters::default();
    let apart = first(APART, &mut counters);
    assert_eq!(apart.ids.regions, [RegionId(0), RegionId(1), RegionId(2)], "counted up");
    assert_eq!(apart.ids.arcs, [ArcId(0), ArcId(1)], "two doors");

    let (united, becoming) = next(&apart, UNITED, &mut counters);
    let [left, right] = united.ids.regions[..] else { panic!("two rooms") };
    assert_eq!(left, RegionId(0), "untouched");
    assert!([RegionId(1), RegionId(2)].contains(&right), "one of the two, not {right:?}");
    assert_eq!(united.ids.arcs, [ArcId(0)], "the door that is left");
    let now: Vec<RegionId> = becoming.iter().map(|becoming| becoming.now[0].0).collect();
    assert_eq!(now, [RegionId(0), right, right], "both halves are in the new room");

    let (split, becoming) = next(&united, APART, &mut counters);
    assert_eq!(split.ids.regions[0], RegionId(0), "untouched");
    let halves = &split.ids.regions[1..];
    assert!(halves.contains(&right), "the larger half keeps the id");
    assert!(halves.contains(&RegionId(3)), "the other's is new, never one of old");
    assert_eq!(becoming[1].now.len(), 2, "the old room tells of both");
    assert_eq!(split.ids.arcs, [ArcId(0), ArcId(2)], "a door that comes back is a new one");
}

#[test]
fn what_is_gone_became_nothing() {
    let mut counters = Counters::default();
    let apart = first(APART, &mut counters);
    let (_, becoming) = next(&apart, "###\n###", &mut counters);
    assert!(becoming.iter().all(|becoming| becoming.now.is_empty()), "nothing is left");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn nothing_new_nothing_renamed((building, _) in office()) {
        let found = segmentation(&building.space(1), &TopologyParams::INDOOR);
        let graph = topological_graph(&found.partition, &found.lines, &found.clearance);
        let mut counters = Counters::default();
        let ids = first_ids(&graph, &mut counters);
        let old = Snapshot { partition: &found.partition, graph: &graph, ids: &ids };
        let before = counters;
        let (again, _) = carried_ids(old, &found.partition, &graph, &mut counters);
        prop_assert_eq!(again, ids.clone());
        prop_assert_eq!(counters, before, "no id was spent");
    }
}
