//! The best way from place to place along the edges of a map.
//!
//! E. W. Dijkstra, "A note on two problems in connexion with graphs", Numerische Mathematik 1
//! (1959), without a heap: O(places²).

use crate::place_map::{Gateway, PlaceId, PlaceMap};

/// A travel from a place to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leg {
    /// Where the place is left.
    pub from: Gateway,
    /// Where the next one is entered.
    pub to: Gateway,
}

/// The travels from one place to another whose costs add up to the least; `None` if the map has no
/// such places, or nobody knows a way. `cost` is that of the edge that a gateway leads into: more
/// than 0, the same from both ends. Of ways that cost the same, the one found first: of lower
/// places and gateways.
pub fn route(
    map: &PlaceMap,
    from: PlaceId,
    to: PlaceId,
    cost: impl Fn(Gateway) -> f64,
) -> Option<Vec<Leg>> {
    (map.place(from).is_some() && map.place(to).is_some()).then_some(())?;
    let mut costs = vec![f64::INFINITY; map.n_places()];
    let mut is_settled = vec![false; map.n_places()];
    let mut last_legs: Vec<Option<Leg>> = vec![None; map.n_places()];
    costs[from.0 as usize] = 0.0;
    loop {
        let open = map.places().filter(|(place, _)| !is_settled[place.0 as usize]);
        let (place, known) =
            open.min_by(|(a, _), (b, _)| costs[a.0 as usize].total_cmp(&costs[b.0 as usize]))?;
        let so_far = costs[place.0 as usize];
        if place == to || so_far.is_infinite() {
            break;
        }
        is_settled[place.0 as usize] = true;
        for index in 0..known.star.n_gateways() {
            let from = Gateway { place, index };
            let Some(to) = map.leads_to(from) else { continue };
            let through = so_far + cost(from);
            if through < costs[to.place.0 as usize] {
                costs[to.place.0 as usize] = through;
                last_legs[to.place.0 as usize] = Some(Leg { from, to });
            }
        }
    }
    let mut legs = Vec::new();
    let mut at = to;
    while at != from {
        let leg = last_legs[at.0 as usize]?;
        at = leg.from.place;
        legs.push(leg);
    }
    legs.reverse();
    Some(legs)
}
