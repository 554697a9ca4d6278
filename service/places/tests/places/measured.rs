//! What was measured on the way, and the ways that are shortest by it.

use meetpoint_places::{
    EdgeRecord, EdgeRecords, Gateway, Hypothesis, MapTree, PlaceId, Travel, TravelRecord, World,
    route,
};

use crate::figures::PARAMS;

/// A loop of three ways, one of which bends, and a way off.
const FLOOR: &str = "
    A---B---+
    |   |   |
    X   C---D";

/// There, around and back: the simplest map, which is the true one.
fn driven() -> (Travel, Hypothesis) {
    let world = World::from_drawing(FLOOR).expect("a drawing");
    let travel = world.travel_along("XABCDBAX").expect("a route");
    let tree = MapTree::of_travel(PARAMS, &travel).expect("gateways that are there");
    let n_places = tree.hypotheses()[0].map.n_places();
    assert_eq!(n_places, 5, "the loop is closed");
    (travel.clone(), tree.hypotheses()[0].clone())
}

fn record(length_m: f64, turned_rad: f64) -> TravelRecord {
    TravelRecord { length_m: Some(length_m), turned_rad: Some(turned_rad), moved: None }
}

/// X, A, B, C, D are 0 to 4, in the order of first visits.
const X: PlaceId = PlaceId(0);
const B: PlaceId = PlaceId(2);
const D: PlaceId = PlaceId(4);

fn names(legs: &[meetpoint_places::Leg]) -> Vec<u32> {
    legs.iter().map(|leg| leg.to.place.0).collect()
}

#[test]
fn travels_either_way_are_averaged() {
    let (travel, simplest) = driven();
    let nothing = TravelRecord::default();
    let records =
        [record(4.0, 0.0), record(3.0, 0.5), nothing, nothing, nothing, record(5.0, -0.7)];
    let edges = EdgeRecords::new(&simplest, &travel, &records).expect("a map of the travel");
    let gateways = simplest.map.gateways();
    let (from, to) = gateways
        .filter_map(|from| Some((from, simplest.map.leads_to(from)?)))
        .find(|(from, to)| from.place == PlaceId(1) && to.place == B)
        .expect("the way from A to B");
    let there = EdgeRecord { n_travels: 2, length_m: Some(4.0), turned_rad: Some(0.6) };
    assert_eq!(edges.leaving(from), Some(there), "3 m and 5 m");
    let back = EdgeRecord { turned_rad: Some(-0.6), ..there };
    assert_eq!(edges.leaving(to), Some(back), "turned the other way");
    assert!(!edges.have_lengths(), "not of all");
    let nowhere = Gateway { place: PlaceId(9), index: 0 };
    assert_eq!(edges.leaving(nowhere), None, "no such gateway");
}

#[test]
fn ways_are_short_in_metres_or_few() {
    let (travel, simplest) = driven();
    let few = route(&simplest.map, X, D, |_| 1.0).expect("it hangs together");
    assert_eq!(names(&few), [1, 2, 4], "by A and B, around the bend");
    // The bend is longer than the way by C.
    let lengths_m = [1.0, 1.0, 2.0, 2.0, 9.0, 1.0, 1.0];
    let records = lengths_m.map(|length_m| record(length_m, 0.0));
    let edges = EdgeRecords::new(&simplest, &travel, &records).expect("a map of the travel");
    assert!(edges.have_lengths(), "all were measured");
    let length_m = |gateway| edges.leaving(gateway).and_then(|edge| edge.length_m);
    let short = route(&simplest.map, X, D, |gateway| length_m(gateway).unwrap_or(1.0));
    let short = short.expect("it hangs together");
    assert_eq!(names(&short), [1, 2, 3, 4], "by A, B and C");
    assert!(short.windows(2).all(|pair| pair[0].to.place == pair[1].from.place), "{short:?}");
    assert_eq!(route(&simplest.map, X, X, |_| 1.0), Some(Vec::new()), "there already");
    assert_eq!(route(&simplest.map, X, PlaceId(9), |_| 1.0), None, "no such place");
}

#[test]
fn paths_go_straight_on() {
    let (_, simplest) = driven();
    let numbers = |path: Vec<PlaceId>| path.into_iter().map(|place| place.0).collect::<Vec<_>>();
    let paths: Vec<Vec<u32>> = simplest.map.paths().into_iter().map(numbers).collect();
    // The way from X up and that by A, B and around the bend to D; B to C; C to D.
    assert_eq!(paths, [vec![0, 1], vec![1, 2, 4], vec![2, 3], vec![3, 4]], "as drawn");
}
