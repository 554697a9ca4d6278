//! The skeleton of drawn rooms.

use meetpoint_topology::{Skeleton, TopologyParams, clearance, skeleton, voronoi};
use proptest::prelude::*;

use crate::building::{any_space, drawn};

fn of(drawing: &str) -> Skeleton {
    let space = drawn(drawing, 10);
    let (clearance, params) = (clearance(&space), TopologyParams::INDOOR);
    skeleton(&voronoi(&space, &clearance, &params.voronoi), &clearance, params.meet_points.arm_m)
}

/// Nodes, lines, and how many lines leave each node, sorted.
fn numbers(skeleton: &Skeleton) -> (usize, usize, Vec<usize>) {
    let ends = || skeleton.lines.iter().flat_map(|line| line.nodes);
    let degree = |node| ends().filter(|&end| end == node).count();
    let mut degrees: Vec<usize> = (0..skeleton.nodes.len()).map(degree).collect();
    degrees.sort_unstable();
    (skeleton.nodes.len(), skeleton.lines.len(), degrees)
}

#[test]
fn corridors_that_cross() {
    let crossing = of("####..####
                       ####..####
                       ####..####
                       ####..####
                       ..........
                       ..........
                       ####..####
                       ####..####
                       ####..####
                       ####..####");
    assert_eq!(numbers(&crossing), (5, 4, vec![1, 1, 1, 1, 4]), "four arms and the crossing");
    let bend = of("########..
                   ########..
                   ########..
                   ########..
                   ..........
                   ..........");
    assert_eq!(numbers(&bend), (2, 1, vec![1, 1]), "one line around a corner");
    let ring = of("............
                   ............
                   ..########..
                   ..########..
                   ..########..
                   ............
                   ............");
    assert_eq!(numbers(&ring), (1, 1, vec![2]), "a ring is one line from and to one node");
}

proptest! {
    #[test]
    fn every_cell_of_the_pruned_diagram_is_on_a_line_or_a_node(space in any_space()) {
        let (clearance, params) = (clearance(&space), TopologyParams::INDOOR);
        let diagram = voronoi(&space, &clearance, &params.voronoi);
        let width = space.info().width as usize;
        for arm_m in [0.0, 0.8] {
            let found = skeleton(&diagram, &clearance, arm_m);
            for line in &found.lines {
                prop_assert!(2 <= line.cells.len(), "from a node to a node");
                for pair in line.cells.windows(2) {
                    let [a, b] = [pair[0], pair[1]].map(|at| (at % width, at / width));
                    let away = a.0.abs_diff(b.0).max(a.1.abs_diff(b.1));
                    prop_assert_eq!(away, 1, "step by step");
                    prop_assert!(diagram.is_on()[pair[0]] && diagram.is_on()[pair[1]]);
                }
            }
            let mut inner: Vec<usize> = found
                .lines
                .iter()
                .flat_map(|line| line.cells[1..line.cells.len() - 1].iter().copied())
                .collect();
            let n_inner = inner.len();
            inner.sort_unstable();
            inner.dedup();
            prop_assert_eq!(inner.len(), n_inner, "no cell is on two lines");
        }
    }
}
