//! What distinguishes two maps that fit the same travel: which visits were to one place.

use crate::map_tree::Hypothesis;
use crate::place_map::{Gateway, PlaceMap};
use crate::travel::Travel;

/// What a map says of a visit, in words that mean the same in all maps of one travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Sighting {
    /// The earliest visit to the same place: the visit itself if the place was new.
    pub first_visit: usize,
    /// The gateway of this arrival, counted clockwise from the one of the earliest visit.
    pub gateway: u8,
}

/// The first visit of which two maps say different things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Which visit, the start being 0.
    pub visit: usize,
    /// What either map says of it.
    pub sightings: [Sighting; 2],
}

/// What `map` says of all visits of one who starts at `from` and makes these turns; `None` if it
/// does not know all edges on the way. Two maps of one travel are the same if this is.
pub fn sightings(
    map: &PlaceMap,
    from: Gateway,
    turns: impl IntoIterator<Item = u8>,
) -> Option<Vec<Sighting>> {
    let arrivals = map.arrivals(from, turns)?;
    let mut first_of: Vec<Option<(usize, u8)>> = vec![None; map.n_places()];
    let sighting = |(visit, at): (usize, &Gateway)| {
        let (first_visit, first_gateway) =
            *first_of[at.place.0 as usize].get_or_insert((visit, at.index));
        let n_gateways = map.place(at.place).map_or(1, |place| place.star.n_gateways());
        Sighting { first_visit, gateway: (at.index + n_gateways - first_gateway) % n_gateways }
    };
    Some(arrivals.iter().enumerate().map(sighting).collect())
}

/// The first visit of which two hypotheses say different things; `None` if there is none, or if
/// they are not both of this travel.
pub fn first_difference(travel: &Travel, a: &Hypothesis, b: &Hypothesis) -> Option<Difference> {
    let pairs = a.sightings(travel)?.into_iter().zip(b.sightings(travel)?).enumerate();
    pairs
        .map(|(visit, (a, b))| Difference { visit, sightings: [a, b] })
        .find(|difference| difference.sightings[0] != difference.sightings[1])
}
