//! A rehearsal under way: there along a route that a candidate predicts, and back.

use meetpoint_geometry::angle_between;

use super::arrival::Arrival;
use super::heading_error::HeadingError;
use super::place_graph::PlaceGraph;
use crate::place_map::Gateway;

/// By how much an edge travelled again may differ in length from what is known of it.
const LENGTH_SHARE: f64 = 0.1;
/// And besides, in metres.
const LENGTH_SLACK_M: f64 = 1.0;

/// Whether the place where a robot has arrived is one that it knows.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    /// Where it left, into the unknown.
    pub(crate) from: Gateway,
    /// How far that was by dead reckoning, in metres.
    pub(crate) way_m: f64,
    /// What it saw where it arrived, the place in question.
    pub(crate) seen: Arrival,
    /// Where it may have come in, the next one to be tried last.
    pub(crate) candidates: Vec<Gateway>,
    /// Departures of the rehearsal of the candidate.
    route: Vec<Gateway>,
    /// How far what is seen is turned against what is known, if the candidate is the one.
    turned_rad: f64,
    n_done: usize,
    /// At every place of the way out, the direction back.
    back_rad: Vec<f64>,
    outcome: Option<bool>,
}

/// A rehearsal under way, as it is told to people: whether a place is the one that it looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Rehearsing {
    /// Where the robot left, into the unexplored.
    pub from: Gateway,
    /// Where it came in, if the place is known.
    pub may_be: Gateway,
    /// Departures of the route that tells, as they are if it is: along known edges, to be followed back
    /// afterwards.
    pub route: Vec<Gateway>,
    /// Edges of it that were travelled, there.
    pub n_done: usize,
    /// Whether all was as predicted there; `None` while the robot is on its way there.
    pub outcome: Option<bool>,
    /// Other gateways where it may have come in, to be tested if this one is not it.
    pub n_others: usize,
}

/// What to do next.
pub(crate) enum Next {
    /// Leave in that direction.
    Leave(f64),
    /// The robot is back: whether all was as predicted, and how it left from here.
    Back(bool),
}

impl Trial {
    pub(crate) fn new(from: Gateway, way_m: f64, seen: Arrival, candidates: Vec<Gateway>) -> Self {
        let (route, back_rad) = (Vec::new(), Vec::new());
        Self {
            from,
            way_m,
            seen,
            candidates,
            route,
            turned_rad: 0.0,
            n_done: 0,
            back_rad,
            outcome: None,
        }
    }

    /// Begins the rehearsal of a candidate along a route of at least one edge; where to leave for.
    pub(crate) fn begin(
        &mut self,
        candidate: Gateway,
        route: Vec<Gateway>,
        graph: &PlaceGraph,
    ) -> Option<f64> {
        (self.n_done, self.outcome) = (0, None);
        self.back_rad.clear();
        self.route = route;
        let known = graph.place(candidate.place)?;
        self.turned_rad = self.seen.turned_against(&known.seen, candidate.index)?;
        let first = self.route.first()?;
        Some(self.seen.heading_to(candidate.index, first.index))
    }

    /// As it is told to people.
    pub(crate) fn rehearsing(&self, may_be: Gateway) -> Rehearsing {
        Rehearsing {
            from: self.from,
            may_be,
            route: self.route.clone(),
            n_done: self.n_done,
            outcome: self.outcome,
            n_others: self.candidates.len(),
        }
    }

    /// Index, at the place in question, of the direction in which the rehearsal left.
    pub(crate) fn left_by(&self, candidate: Gateway) -> u8 {
        // At most 32 directions, as a star has.
        let n = self.seen.observation().star.n_gateways();
        self.route.first().map_or(0, |first| (first.index + n - candidate.index) % n)
    }

    /// Takes in what is seen at the end of an edge. It may seem turned against what is known by more
    /// or less than the place in question, as far as headings err between the two.
    pub(crate) fn arrived(
        &mut self,
        arrival: &Arrival,
        graph: &PlaceGraph,
        error: &HeadingError,
    ) -> Next {
        if self.outcome.is_none() {
            self.back_rad.push(arrival.directions[0].heading_rad);
            let leg = self.route.get(self.n_done).copied();
            self.n_done += 1;
            let expected = leg.and_then(|leg| graph.map().leads_to(leg));
            let is_as_predicted = leg.is_some_and(|leg| self.predicts(leg, arrival, graph, error));
            let onward = self.route.get(self.n_done).zip(expected);
            match (is_as_predicted, onward) {
                (true, Some((next, at))) => {
                    return Next::Leave(arrival.heading_to(at.index, next.index));
                }
                (is_as_predicted, _) => self.outcome = Some(is_as_predicted),
            }
        }
        match (self.back_rad.pop(), self.outcome) {
            (Some(back_rad), _) => Next::Leave(back_rad),
            (None, outcome) => Next::Back(outcome == Some(true)),
        }
    }
}

impl Trial {
    /// Whether this may be seen by one who leaves by `leg`, if the candidate is the one.
    fn predicts(
        &self,
        leg: Gateway,
        arrival: &Arrival,
        graph: &PlaceGraph,
        error: &HeadingError,
    ) -> bool {
        let Some(expected) = graph.map().leads_to(leg) else { return false };
        let begun_at = self.route.first().map_or(expected.place, |first| first.place);
        let slack_rad = error.after_rad(graph.reckoned_m(begun_at, expected.place));
        let turned = turned_against(arrival, graph, expected, self.turned_rad, slack_rad);
        let edge = graph.edge(leg).zip(arrival.traversal.as_ref());
        let is_as_long = edge
            .is_none_or(|(edge, traversal)| edge.may_be(traversal, LENGTH_SHARE, LENGTH_SLACK_M));
        turned.is_some() && is_as_long
    }
}

/// How far a place is turned against what is known of it, if it looks as known and is turned by about
/// as much as expected.
pub(crate) fn turned_against(
    arrival: &Arrival,
    graph: &PlaceGraph,
    gateway: Gateway,
    expected_rad: f64,
    slack_rad: f64,
) -> Option<f64> {
    let known = graph.place(gateway.place)?;
    let turned_rad = arrival.turned_against(&known.seen, gateway.index)?;
    (angle_between(expected_rad, turned_rad).abs() <= slack_rad).then_some(turned_rad)
}
