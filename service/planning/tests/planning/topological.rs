//! Topological plans against breadth-first search, and parts and portals against their words.

use std::collections::{BTreeSet, VecDeque};

use meetpoint_planning::{Grouping, PartGraph, PartIndex, TopologicalPlans, Transit, backups};
use proptest::prelude::*;

use crate::floors::{costs_from, floors, open_cells};

/// Parts passed through from `start` to every other, both included; `None` if there is no way.
fn n_passed(graph: &PartGraph, start: PartIndex) -> Vec<Option<usize>> {
    let mut passed = vec![None; graph.parts().n_parts()];
    passed[start.0 as usize] = Some(1);
    let mut open = VecDeque::from([start]);
    while let Some(part) = open.pop_front() {
        for &exit in graph.exits(part) {
            let next = graph.to(exit);
            if passed[next.0 as usize].is_none() {
                passed[next.0 as usize] = passed[part.0 as usize].map(|n_parts| n_parts + 1);
                open.push_back(next);
            }
        }
    }
    passed
}

/// The parts of a plan that begins in `start`.
fn parts_of(graph: &PartGraph, start: PartIndex, plan: &[Transit]) -> Vec<PartIndex> {
    std::iter::once(start).chain(plan.iter().map(|&transit| graph.to(transit))).collect()
}

proptest! {
    /// As few parts as can be, from one to the next, the same in both directions, and what follows
    /// a part is the plan from there.
    #[test]
    fn plans_are_shortest_symmetric_and_consistent(floor in floors()) {
        let graph = floor.graph(Grouping::Pairs);
        let plans = TopologicalPlans::new(&graph);
        for from in graph.parts().indices() {
            let passed = n_passed(&graph, from);
            for to in graph.parts().indices() {
                let plan = plans.plan(&graph, from, to);
                let parts = plan.as_ref().map(|plan| parts_of(&graph, from, plan));
                prop_assert_eq!(parts.as_ref().map(Vec::len), passed[to.0 as usize], "its length");
                let Some(plan) = plan else { continue };
                let mut back = plans.plan(&graph, to, from).expect("a way back");
                back.reverse();
                let back: Vec<Transit> = back.into_iter().map(Transit::back).collect();
                prop_assert_eq!(&back, &plan, "the same in both directions");
                for (at, transit) in plan.iter().enumerate() {
                    let rest = plans.plan(&graph, graph.from(*transit), to);
                    prop_assert_eq!(rest.as_deref(), Some(&plan[at..]), "what follows");
                }
            }
        }
    }

    /// A part is what the robot can reach within one region, no more and no less.
    #[test]
    fn parts_are_connected(floor in floors()) {
        let (space, partition) = floor.cut();
        let graph = floor.graph(Grouping::Openings);
        let parts = graph.parts();
        for cell in 0..space.info().n_cells() {
            prop_assert_eq!(parts.at(cell).is_some(), space.is_enterable(cell), "a part a cell");
        }
        for part in parts.indices() {
            let first = parts.cells(part)[0] as usize;
            let region = partition.region_at(first);
            prop_assert_eq!(Some(parts.region(part)), region, "its region");
            let costs = costs_from(&space, &[(first, 0)], |cell| partition.region_at(cell) == region);
            let reached: Vec<u32> = (0..).zip(&costs).filter(|&(_, &cost)| cost < 1 << 30)
                .map(|(cell, _)| cell).collect();
            prop_assert_eq!(parts.cells(part), reached, "its cells");
        }
    }

    /// Every step between two parts belongs to one portal that joins them, whatever the grouping;
    /// openings are those of pairs, cut into pieces.
    #[test]
    fn portals_hold_all_steps(floor in floors()) {
        let [pairs, openings] = [Grouping::Pairs, Grouping::Openings].map(|by| floor.graph(by));
        let space = pairs.space();
        let mut finer = BTreeSet::new();
        for cell in open_cells(space) {
            for (step, next) in space.steps(cell) {
                let sides = [cell, next].map(|cell| pairs.parts().at(cell).expect("open"));
                let found = [&pairs, &openings].map(|graph| graph.transit(cell, step));
                for (graph, transit) in [&pairs, &openings].into_iter().zip(found) {
                    prop_assert_eq!(transit.is_some(), sides[0] != sides[1], "where parts meet");
                    let Some(transit) = transit else { continue };
                    prop_assert_eq!([graph.from(transit), graph.to(transit)], sides, "its parts");
                    let back = graph.transit(next, (step + 4) % 8);
                    prop_assert_eq!(back, Some(transit.back()), "the step back");
                    prop_assert!(graph.exits(sides[0]).contains(&transit), "one of the exits");
                }
                finer.extend(found[0].zip(found[1]));
            }
        }
        let of_openings: BTreeSet<_> = finer.iter().map(|&(_, opening)| opening).collect();
        prop_assert_eq!(of_openings.len(), finer.len(), "an opening lies in one pair's portal");
        prop_assert_eq!(of_openings.len(), 2 * openings.n_portals(), "all were met, both ways");
    }
}

/// The numbers of section 4.3 for the map of figure 9.
#[test]
fn backups_of_the_paper() {
    assert_eq!(backups(67, 7.84).round(), 525.0, "topological planning");
    assert_eq!((backups(27_280, 94.2) / 1e4).round(), 257.0, "grid-based planning");
}
