//! Figure 1 of HSSH 2004, as travels that can be read.

use meetpoint_places::{Assumptions, Hypothesis, MapTree, MapTreeParams, PlaceId, Travel};

/// More than any of the figures comes to.
pub(crate) const PARAMS: MapTreeParams =
    MapTreeParams { assumptions: Assumptions::HSSH_2004, n_hypotheses_max: 1000 };

/// Where the robot is according to every hypothesis, the simplest first: a letter for the visit
/// at which it first came there, the visits being A, B, C...
fn here(tree: &MapTree) -> String {
    let letter = |leaf: &Hypothesis| {
        let turns = tree.travel().turns();
        let start = meetpoint_places::Gateway { place: PlaceId(0), index: 0 };
        let arrivals = leaf.map.arrivals(start, turns).expect("a map of the travel");
        let visit = arrivals.iter().position(|arrival| arrival.place == leaf.at.place);
        ('A'..).nth(visit.expect("the last at least")).expect("a letter")
    };
    tree.hypotheses().iter().map(letter).collect()
}

/// What `here` says after every step, and how many minimal models there are.
fn told(travel: &str) -> Vec<(String, usize)> {
    let travel: Travel = travel.parse().expect("a travel");
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
///
/// ```text
///   C-------B---          streets end at A, C, D and E, and pass B
///   |       |
///   |     --A---... from E
///   D---E
/// ```
#[test]
fn figure_1a() {
    assert_eq!(
        told("abb 1:abab 2:ab 1:abb 1:ab 1:abb"),
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

/// A and B look alike, and E may be either, or a place of its own.
///
/// ```text
///   ---A---B---C
///      |   |   |
///      ?   ?   |          E is come to from below: up the street under A, or under B,
///      ?---E?--D          or elsewhere
/// ```
#[test]
fn figure_1b() {
    assert_eq!(
        told("aab 1:aab 1:ab 1:ab 1:abb"),
        expected(&[
            ("A", 1),
            ("B", 1), // Not A: a street does not meet a place twice.
            ("C", 1),
            ("D", 1),
            ("ABE", 2), // Two maps of four places, one of five.
        ])
    );
}
