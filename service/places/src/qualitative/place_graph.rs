//! Distinctive places, the edges between them, and what was measured of both.

use std::collections::VecDeque;

use meetpoint_geometry::{angle_between, wrap_angle};

use super::arrival::Arrival;
use super::travel_edge::{TravelEdge, Traversal};
use crate::place_map::{Gateway, PlaceId, PlaceMap};

/// A place, as a robot knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownPlace {
    /// Its looks, directions averaged over all visits; direction `i` of it is gateway `i` of the map.
    pub seen: Arrival,
    /// The place from which its position was reckoned, and the metres from there.
    pub reckoned_from: Option<(PlaceId, f64)>,
    /// How often it was visited and recognised.
    pub n_visits: u32,
}

/// Places and edges.
#[derive(Clone, Debug, Default)]
pub struct PlaceGraph {
    map: PlaceMap,
    places: Vec<KnownPlace>,
    edges: Vec<TravelEdge>,
}

impl PlaceGraph {
    /// Which gateway of which place leads where; without measures.
    pub fn map(&self) -> &PlaceMap {
        &self.map
    }

    /// What is known of a place, if there is one of that id.
    pub fn place(&self, id: PlaceId) -> Option<&KnownPlace> {
        self.places.get(id.0 as usize)
    }

    /// All edges.
    pub fn edges(&self) -> &[TravelEdge] {
        &self.edges
    }

    /// The edge that leaves through a gateway, if anybody has travelled it.
    pub fn edge(&self, gateway: Gateway) -> Option<&TravelEdge> {
        self.edges.iter().find(|edge| edge.ends.contains(&gateway))
    }

    /// Gateways that nobody left or came in through: the exploration agenda, (place, direction).
    pub fn agenda(&self) -> impl Iterator<Item = Gateway> {
        self.map.gateways().filter(|&gateway| self.map.leads_to(gateway).is_none())
    }

    pub(crate) fn add(&mut self, seen: Arrival, reckoned_from: Option<(PlaceId, f64)>) -> PlaceId {
        let id = self.map.add_place(&seen.observation());
        self.places.push(KnownPlace { seen, reckoned_from, n_visits: 1 });
        id
    }

    /// Says that a place is "home", or is not; false if there is no such place.
    pub(crate) fn mark(&mut self, place: PlaceId, is_home: bool) -> bool {
        let known = self.places.get_mut(place.0 as usize);
        known.map(|known| known.seen.is_home = is_home).is_some()
    }

    pub(crate) fn link(&mut self, from: Gateway, to: Gateway, traversal: &Traversal) {
        self.map.link(from, to);
        self.edges.push(TravelEdge::new([from, to], traversal));
    }

    /// Metres of dead reckoning between the positions of two places: how sure it is how the one
    /// lies from the other. Every place but the first was reckoned from an earlier one.
    pub(crate) fn reckoned_m(&self, a: PlaceId, b: PlaceId) -> f64 {
        let (mut a, mut b, mut way_m) = (a, b, 0.0);
        while a != b {
            let later = if a < b { &mut b } else { &mut a };
            let from = self.place(*later).and_then(|known| known.reckoned_from);
            let Some((from, from_m)) = from else { return f64::INFINITY };
            (*later, way_m) = (from, way_m + from_m);
        }
        way_m
    }

    /// Takes in that a known edge was travelled again.
    pub(crate) fn travelled(&mut self, from: Gateway, traversal: &Traversal) {
        if let Some(edge) = self.edges.iter_mut().find(|edge| edge.ends.contains(&from)) {
            edge.take_in(from, traversal);
        }
    }

    /// Takes in how a place looks that was recognised by one who came by `came_by`.
    pub(crate) fn visited(&mut self, came_by: Gateway, seen: &Arrival) {
        let Some(known) = self.places.get_mut(came_by.place.0 as usize) else { return };
        known.n_visits += 1;
        let share = 1.0 / f64::from(known.n_visits);
        let n = known.seen.directions.len();
        for (index, now) in seen.directions.iter().enumerate() {
            let mean = &mut known.seen.directions[(index + usize::from(came_by.index)) % n];
            let off_rad = angle_between(mean.heading_rad, now.heading_rad);
            mean.heading_rad = wrap_angle(mean.heading_rad + share * off_rad);
        }
    }

    /// The rehearsal of a candidate: the departures of a route along known edges from its place,
    /// the end of which tells most of whether this is the place (KB 1988, section 2.5). That is "home",
    /// if it is near enough; else, of the places as far as that, the one whose star the fewest have.
    ///
    /// A breadth-first search; empty if no edge leads from the place.
    pub(crate) fn rehearsal(&self, candidate: PlaceId, n_edges_max: usize) -> Vec<Gateway> {
        let mut reached = vec![candidate];
        let mut queue = VecDeque::from([(candidate, Vec::new())]);
        let mut best: Option<(bool, usize, usize, Vec<Gateway>)> = None;
        while let Some((at, route)) = queue.pop_front() {
            if !route.is_empty() {
                let known = self.place(at);
                let is_home = known.is_some_and(|known| known.seen.is_home);
                let rank = (!is_home, n_edges_max - route.len(), self.n_alike(at), route.clone());
                if best.as_ref().is_none_or(|best| rank < *best) {
                    best = Some(rank);
                }
            }
            if route.len() == n_edges_max {
                continue;
            }
            for gateway in self.map.gateways().filter(|gateway| gateway.place == at) {
                if let Some(next) = self.map.leads_to(gateway)
                    && !reached.contains(&next.place)
                {
                    reached.push(next.place);
                    let onward = route.iter().copied().chain([gateway]).collect();
                    queue.push_back((next.place, onward));
                }
            }
        }
        best.map_or_else(Vec::new, |(_, _, _, route)| route)
    }

    /// How many places may be taken for this one by their directions.
    fn n_alike(&self, id: PlaceId) -> usize {
        let Some(known) = self.place(id) else { return 0 };
        let is_alike = |other: &&KnownPlace| {
            let mut gateways = (0..).take(other.seen.directions.len());
            gateways.any(|gateway| known.seen.turned_against(&other.seen, gateway).is_some())
        };
        self.places.iter().filter(is_alike).count()
    }
}
