//! The graph: arcs join what lies on the two sides of their lines; pruning.

use std::collections::BTreeSet;

use meetpoint_topology::{
    Pruning, RegionIndex, Segmentation, TopologicalGraph, TopologyParams, pruned, segmentation,
    topological_graph,
};
use proptest::prelude::*;

use crate::building::{cluttered, drawn, office};

fn graph(found: &Segmentation) -> TopologicalGraph {
    topological_graph(&found.partition, &found.lines, &found.clearance)
}

/// Pairs of neighbours with at most two neighbours each.
fn slim_pairs(graph: &TopologicalGraph) -> usize {
    let n_neighbors = |region: RegionIndex| {
        let other = |[a, b]: [RegionIndex; 2]| if a == region { b } else { a };
        let of_region = graph.arcs.iter().filter(|arc| arc.regions.contains(&region));
        of_region.map(|arc| other(arc.regions)).collect::<BTreeSet<_>>().len()
    };
    let is_slim = |pair: &[RegionIndex; 2]| pair.iter().all(|&region| n_neighbors(region) <= 2);
    graph.arcs.iter().filter(|arc| is_slim(&arc.regions)).count()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn an_arc_joins_the_two_sides_of_its_line(space in cluttered()) {
        let found = segmentation(&space, &TopologyParams::INDOOR);
        let graph = graph(&found);
        let width = space.info().width as usize;
        let mut borders = BTreeSet::new();
        for arc in &graph.arcs {
            prop_assert!(arc.regions[0] < arc.regions[1], "two regions in order");
            prop_assert!(!arc.portal.is_empty(), "a way through");
            prop_assert!(0.0 < arc.width_m && arc.width_m <= arc.length_m, "a gap of the line");
            for step in &arc.portal {
                let sides = [step.left, step.right].map(|at| found.partition.region_at(at));
                let mut sides = sides.map(|side| side.expect("portals are free"));
                sides.sort_unstable();
                prop_assert_eq!(sides, arc.regions);
                borders.insert((step.left.min(step.right), step.left.max(step.right)));
            }
        }
        for a in 0..space.info().n_cells() - width {
            for b in [a + 1, a + width] {
                let sides = [a, b].map(|at| found.partition.region_at(at));
                let is_border = sides[0] != sides[1] && sides.iter().all(Option::is_some);
                prop_assert_eq!(is_border, borders.contains(&(a, b)), "all borders are portals");
            }
        }
    }

    #[test]
    fn pruning_leaves_no_slim_pair(space in cluttered()) {
        let found = segmentation(&space, &TopologyParams::INDOOR);
        let group = pruned(&graph(&found), Pruning::Pairs);
        let partition = found.partition.joined(|region| group[region.0 as usize]);
        let graph = topological_graph(&partition, &found.lines, &found.clearance);
        prop_assert_eq!(slim_pairs(&graph), 0);
    }

    #[test]
    fn end_nodes_of_an_office_are_its_rooms((building, _) in office()) {
        let found = segmentation(&building.space(1), &TopologyParams::INDOOR);
        let group = pruned(&graph(&found), Pruning::EndNodes);
        prop_assert!(group.iter().all(|&region| region == RegionIndex(0)), "one region is left");
    }
}

#[test]
fn a_door_is_as_wide_as_it_is_drawn() {
    let space = drawn(
        "###########
         #....#....#
         #....#....#
         #.........#
         #.........#
         #....#....#
         #....#....#
         ###########",
        10,
    );
    let graph = graph(&segmentation(&space, &TopologyParams::INDOOR));
    let [arc] = graph.arcs.as_slice() else { panic!("one door, not {}", graph.arcs.len()) };
    assert!((arc.width_m - 1.0).abs() < 0.01, "a door of 1 m, not {} m", arc.width_m);
    assert!((arc.length_m - 1.05).abs() < 0.01, "from wall to wall, not {} m", arc.length_m);
    let away_m = (arc.position.x - 2.75).hypot(arc.position.y - 2.0);
    assert!(away_m < 0.06, "in the middle of the door, {away_m} m off");
    let areas: Vec<f64> = graph.regions.iter().map(|region| region.area_m2).collect();
    assert!(areas.iter().all(|area_m2| (area_m2 - 6.25).abs() < 0.3), "two rooms, not {areas:?}");
}

#[test]
fn a_chain_of_rooms_is_one_region_when_pruned() {
    let space = drawn(
        "#########################
         #.......#.......#.......#
         #.......#.......#.......#
         #.......................#
         #.......................#
         #.......................#
         #.......#.......#.......#
         #########################",
        6,
    );
    let graph = graph(&segmentation(&space, &TopologyParams::INDOOR));
    assert_eq!(graph.regions.len(), 3, "three rooms");
    assert_eq!(pruned(&graph, Pruning::Pairs), [RegionIndex(0); 3], "nobody has three neighbours");
    let ends = pruned(&graph, Pruning::EndNodes);
    assert_eq!(ends, [RegionIndex(0); 3], "both ends join the middle");
}

#[test]
fn what_nobody_gets_into_is_a_speck() {
    let space = drawn(
        "##################
         #......#.........#
         #......#.........#
         #......#.........#
         #......#.........#
         #......#.........#
         ########.........#
         #..#####.........#
         ##################",
        6,
    );
    let graph = graph(&segmentation(&space, &TopologyParams::INDOOR));
    assert_eq!(graph.arcs.len(), 0, "no doors");
    assert_eq!(graph.regions.len(), 3, "two rooms and a hole of 0.6 m by 0.3 m");
    assert_eq!(graph.specks(), [RegionIndex(0)], "the hole is the lowest");
}
