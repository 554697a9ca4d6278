//! Maps of places on the wire.

use meetpoint_geometry::Point2;
use meetpoint_places::{
    Assumptions, BoundaryRegions, ConsistentFrame, Decision, EdgeRecords, Errand, Gateway,
    Hypothesis, Leg, Observation, Place, PlaceId, Selection, boundary_regions, first_difference,
};
use meetpoint_proto::v1;

use crate::error::Error;
use crate::hypotheses::{Assertion, Travelled, Tree, hypothesis_id};

/// What a tree is asked for by.
pub(crate) fn assumptions(name: &v1::TreeName) -> Assumptions {
    let v1::TreeName { map: _, session: _, planar, circles, metrical: _ } = name;
    Assumptions { has_ordered_paths: !circles, is_planar: *planar }
}

/// Which of equally near gateways is taken.
///
/// # Errors
/// [`Error::InvalidField`] for a value that is none.
pub(crate) fn selection(wire: i32) -> Result<Selection, Error> {
    match v1::TravelSelection::try_from(wire) {
        Ok(v1::TravelSelection::Unspecified | v1::TravelSelection::LeastRotation) => {
            Ok(Selection::LeastRotation)
        }
        Ok(v1::TravelSelection::MostRotation) => Ok(Selection::MostRotation),
        Err(_) => Err(Error::field("selection", format!("{wire} is none of its values"))),
    }
}

/// A count, which is far below the limit of its type.
pub(crate) fn small(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// A tree.
pub(crate) fn tree(name: v1::TreeName, travelled: &Travelled, tree: &Tree) -> v1::HypothesisTree {
    let maps = tree.maps();
    let (visits_left_out, left_out_reason) = travelled.left_out();
    v1::HypothesisTree {
        name: Some(name),
        visits: small(tree.n_visits()),
        visits_left_out,
        left_out_reason: left_out_reason.to_owned(),
        consistent: small(maps.hypotheses().len()),
        minimal: small(maps.minimal().len()),
        ruled_out: maps.n_ruled_out(),
        given_up: maps.n_given_up(),
        truncated: maps.is_truncated(),
        assertions: tree.assertions().iter().map(assertion).collect(),
        contradicted: tree.n_contradicted(),
        unmeasured: tree.is_unmeasured(),
        by_steps: travelled.is_by_steps(),
    }
}

fn assertion((said, in_force): &(Assertion, bool)) -> v1::HypothesisAssertion {
    let Assertion { hypothesis, sightings, reason, author, time_ns } = said;
    v1::HypothesisAssertion {
        hypothesis: hypothesis.clone(),
        visits: small(sightings.len()),
        in_force: *in_force,
        reason: reason.clone(),
        author: author.clone(),
        time_ns: *time_ns,
    }
}

/// The map of that rank, from 0.
pub(crate) fn hypothesis(
    travelled: &Travelled,
    tree: &Tree,
    (rank, of): (usize, &Hypothesis),
) -> v1::Hypothesis {
    let sightings = tree.told(of);
    let start = Gateway { place: PlaceId(0), index: 0 };
    let arrivals = of.map.arrivals(start, tree.maps().travel().turns()).unwrap_or_default();
    let n_unexplored =
        of.map.gateways().filter(|&gateway| of.map.leads_to(gateway).is_none()).count();
    v1::Hypothesis {
        id: hypothesis_id(travelled.session(), &sightings),
        rank: small(rank + 1),
        minimal: rank < tree.maps().minimal().len(),
        places: small(of.map.n_places()),
        edges: small(of.map.n_edges()),
        paths: small(of.map.n_paths()),
        unexplored: small(n_unexplored),
        visits: arrivals.into_iter().map(|at| at.place.0).collect(),
    }
}

/// What tells the two simplest maps apart, if there are two.
pub(crate) fn difference(tree: &Tree) -> Option<v1::HypothesisDifference> {
    let [first, second, ..] = tree.maps().hypotheses() else { return None };
    let difference = first_difference(tree.maps().travel(), first, second)?;
    let [of_first, of_second] = difference.sightings;
    Some(v1::HypothesisDifference {
        visit: small(difference.visit),
        first_visit: small(of_first.first_visit),
        other_first_visit: small(of_second.first_visit),
    })
}

/// A travel that tells two maps of a tree apart.
pub(crate) fn decision(
    travelled: &Travelled,
    tree: &Tree,
    decision: Decision,
) -> v1::HypothesisDecision {
    let id = |id| {
        let map = tree.maps().hypothesis(id);
        map.map(|map| hypothesis_id(travelled.session(), &tree.told(map))).unwrap_or_default()
    };
    let seen = |seen: Option<Observation>| seen.map_or_else(String::new, |seen| seen.to_string());
    let [expected, other_expected] = decision.rehearsal.predicted.map(seen);
    let [hypothesis, other_hypothesis] = decision.between.map(id);
    v1::HypothesisDecision {
        hypothesis,
        other_hypothesis,
        turns: turns(decision.rehearsal.turns),
        expected,
        other_expected,
    }
}

fn turns(turns: Vec<u8>) -> Vec<u32> {
    turns.into_iter().map(u32::from).collect()
}

/// The places of a map with what leads where.
pub(crate) fn places(of: &Hypothesis, edges: &EdgeRecords) -> Vec<v1::HypothesisPlace> {
    of.map.places().map(|(id, known)| place(of, edges, (id, known))).collect()
}

fn place(
    of: &Hypothesis,
    edges: &EdgeRecords,
    (id, known): (PlaceId, &Place),
) -> v1::HypothesisPlace {
    let gateways = (0..known.star.n_gateways()).map(|index| {
        let gateway = Gateway { place: id, index };
        let leads_to = of.map.leads_to(gateway);
        let edge = edges.leaving(gateway).unwrap_or_default();
        v1::HypothesisGateway {
            to_place: leads_to.map(|to| to.place.0),
            to_gateway: leads_to.map_or(0, |to| u32::from(to.index)),
            length_m: edge.length_m,
            turned_rad: edge.turned_rad,
            travels: edge.n_travels,
        }
    });
    v1::HypothesisPlace {
        number: id.0,
        star: known.star.to_string(),
        view: known.view.as_ref().map(|view| view.name.clone()).unwrap_or_default(),
        view_is_unique: known.view.as_ref().is_some_and(|view| view.is_unique),
        gateways: gateways.collect(),
    }
}

/// The paths of a map, each as its places in order.
pub(crate) fn paths(of: &Hypothesis) -> Vec<v1::HypothesisPath> {
    let path = |places: Vec<PlaceId>| v1::HypothesisPath {
        places: places.into_iter().map(|place| place.0).collect(),
    };
    of.map.paths().into_iter().map(path).collect()
}

/// The regions that each path bounds.
pub(crate) fn regions(of: &Hypothesis) -> Vec<v1::BoundaryRegions> {
    let numbers = |places: Vec<PlaceId>| places.into_iter().map(|place| place.0).collect();
    let bounded = |BoundaryRegions { right, left, around }| v1::BoundaryRegions {
        right: numbers(right),
        left: numbers(left),
        around: numbers(around),
    };
    boundary_regions(&of.map).into_iter().map(bounded).collect()
}

/// Where the places of a map lie by odometry.
pub(crate) fn frame(of: &ConsistentFrame) -> v1::HypothesisFrame {
    let ConsistentFrame { places, chi2, n_degrees, chi2_max, is_settled } = of;
    v1::HypothesisFrame {
        places: places.iter().map(|&at| point(at)).collect(),
        chi2: *chi2,
        degrees: small(*n_degrees),
        chi2_max: *chi2_max,
        contradicted: of.is_contradicted(),
        settled: *is_settled,
    }
}

fn point(at: Point2<f64>) -> v1::Point {
    v1::Point { x_m: at.x, y_m: at.y }
}

/// Gateways that nobody has been through, the nearest first.
pub(crate) fn agenda(of: &Hypothesis) -> Vec<v1::AgendaItem> {
    let item = |(gateway, way): (Gateway, Vec<u8>)| v1::AgendaItem {
        place: gateway.place.0,
        gateway: gateway.index.into(),
        turns: turns(way),
    };
    of.map.agenda(of.at).into_iter().map(item).collect()
}

/// The legs of a route of one who came in through `came_in`, or stands at that gateway's place.
pub(crate) fn legs(
    of: &Hypothesis,
    edges: &EdgeRecords,
    (came_in, route): (Gateway, &[Leg]),
) -> Vec<v1::TravelLeg> {
    let mut at = came_in;
    let mut leg = |&Leg { from, to }: &Leg| {
        let n_gateways = of.map.place(from.place).map_or(1, |place| place.star.n_gateways());
        let turn = (from.index + n_gateways - at.index) % n_gateways;
        at = to;
        v1::TravelLeg {
            place: from.place.0,
            gateway: from.index.into(),
            turn: turn.into(),
            to_place: to.place.0,
            length_m: edges.leaving(from).and_then(|edge| edge.length_m),
        }
    };
    route.iter().map(&mut leg).collect()
}

/// What a robot is to do, the turns, and the gateway of the simplest map that the last is through.
pub(crate) fn errand(errand: Errand, simplest: Option<&Hypothesis>) -> v1::GetNextTravelResponse {
    use v1::TravelErrand as Wire;
    let (kind, way) = match errand {
        Errand::Rehearse(decision) => (Wire::Rehearse, decision.rehearsal.turns),
        Errand::Confirm { turns, .. } => (Wire::Confirm, turns),
        Errand::Explore { turns, .. } => (Wire::Explore, turns),
        Errand::Explored => (Wire::Explored, Vec::new()),
        Errand::Refuted => (Wire::Refuted, Vec::new()),
    };
    let through = simplest.and_then(|simplest| {
        let (&last, before) = way.split_last()?;
        let at = simplest.map.arrivals(simplest.at, before.iter().copied())?.pop()?;
        Some(simplest.map.turned(at, last))
    });
    v1::GetNextTravelResponse {
        tree: None,
        errand: kind.into(),
        turns: turns(way),
        place: through.map_or(0, |gateway| gateway.place.0),
        gateway: through.map_or(0, |gateway| gateway.index.into()),
    }
}
