//! Figure 1 of HSSH 2004, as travels that can be read.

use meetpoint_places::{Assumptions, Hypothesis, MapTree, MapTreeParams, World};

/// More than any of the figures comes to.
pub(crate) const PARAMS: MapTreeParams =
    MapTreeParams { assumptions: Assumptions::HSSH_2004, n_hypotheses_max: 1000 };

/// Where the robot is according to every hypothesis, the simplest first: a letter for the visit
/// at which it first came there, the visits being A, B, C...
fn here(tree: &MapTree) -> String {
    let letter = |leaf: &Hypothesis| {
        let visit = leaf.sightings(tree.travel()).and_then(|told| Some(told.last()?.first_visit));
        ('A'..).nth(visit.expect("the last at least")).expect("a letter")
    };
    tree.hypotheses().iter().map(letter).collect()
}

/// What `here` says after every step of the route, and how many minimal models there are.
fn told(drawing: &str, route: &str) -> Vec<(String, usize)> {
    let world = World::from_drawing(drawing).expect("a drawing");
    let travel = world.travel_along(route).expect("a route");
    let mut tree = MapTree::new(PARAMS, travel.first.clone());
    let mut told = vec![(here(&tree), tree.minimal().len())];
    for step in &travel.steps {
        tree.extend(step.clone()).expect("a gateway that is there");
        told.push((here(&tree), tree.minimal().len()));
    }
    assert!(!tree.is_truncated(), "nothing was given up");
    told
}

fn expected(rows: &[(&str, usize)]) -> Vec<(String, usize)> {
    rows.iter().map(|&(here, n_minimal)| (here.to_owned(), n_minimal)).collect()
}

/// D looks just like A. E is not B, which refutes D = A; F = A is the simplest map.
#[test]
fn figure_1a() {
    let told = told(
        "
                W
                |
            C---B---A---X
            |   |   |
            |   Z   |
            |       |
        Y---D-------E",
        "ABCDEA",
    );
    assert_eq!(
        told,
        expected(&[
            ("A", 1),
            ("B", 1),
            ("C", 1),
            ("AD", 1), // A structural ambiguity.
            ("E", 1),  // D = A would lead to B, and E is not like B.
            ("AF", 1), // F = A makes one place less.
        ])
    );
}

/// A and B look alike. The robot comes back up the street under B, and that may be E = A, E = B,
/// or neither.
#[test]
fn figure_1b() {
    let told = told(
        "
        X---A---B---C
            |   |   |
            Y   +---D",
        "ABCDB",
    );
    assert_eq!(
        told,
        expected(&[
            ("A", 1),
            ("B", 1), // Not A: a street does not meet a place twice.
            ("C", 1),
            ("D", 1),
            ("ABE", 2), // Two maps of four places, one of five.
        ])
    );
}
