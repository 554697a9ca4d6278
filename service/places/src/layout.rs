//! Where to draw the places of a map, so that those that are near each other by ways are near on
//! paper.
//!
//! Stress majorisation: E. R. Gansner, Y. Koren, S. North, "Graph drawing by stress majorization",
//! Graph Drawing 2004, section 2.3, one place after the other. It lessens
//!
//! ```text
//! sum over pairs i < j of ways(i, j)^-2 (|x_i - x_j| - ways(i, j))²
//! ```
//!
//! from where places would lie if every way were straight, of length 1, and met others at right
//! angles. Time O(rounds × places²), space O(places²).

use std::collections::VecDeque;

use crate::place_map::{Gateway, PlaceId, PlaceMap};
use crate::star::Star;

/// Rounds; after these nothing moves that the eye would see.
const N_ROUNDS: u32 = 60;
/// Places that all pairs are looked at of; of larger maps the first guess is drawn.
const N_PLACES_MAX: usize = 1000;

/// Where to draw each place, in the order of their ids; a way is about 1 long. Another hypothesis
/// of the same travel may look otherwise altogether. All places hang together.
pub fn layout(map: &PlaceMap) -> Vec<[f64; 2]> {
    let mut places = first_guess(map);
    let n_places = places.len();
    if N_PLACES_MAX < n_places {
        return places;
    }
    let n_ways: Vec<Vec<f64>> = map
        .places()
        .map(|(from, _)| n_ways(map, from).into_iter().map(f64::from).collect())
        .collect();
    for _ in 0..N_ROUNDS {
        for index in 0..n_places {
            places[index] = better(&places, &n_ways[index], index);
        }
    }
    places
}

/// Where a place lies best with the others where they are.
fn better(places: &[[f64; 2]], n_ways: &[f64], index: usize) -> [f64; 2] {
    let [x, y] = places[index];
    let (mut sum, mut weight) = ([0.0, 0.0], 0.0);
    for (other, &far) in n_ways.iter().enumerate() {
        if other == index || far == 0.0 {
            continue;
        }
        let [other_x, other_y] = places[other];
        let (dx, dy) = (x - other_x, y - other_y);
        let stretch = far / dx.hypot(dy).max(1e-9);
        let w = far.powi(-2);
        sum[0] += w * (other_x + dx * stretch);
        sum[1] += w * (other_y + dy * stretch);
        weight += w;
    }
    if 0.0 < weight { sum.map(|sum| sum / weight) } else { [x, y] }
}

/// Ways that one goes at least from a place to each.
fn n_ways(map: &PlaceMap, from: PlaceId) -> Vec<u32> {
    let mut ways = vec![0; map.n_places()];
    let mut reached = vec![false; map.n_places()];
    let mut queue = VecDeque::from([from]);
    reached[from.0 as usize] = true;
    while let Some(place) = queue.pop_front() {
        for next in ways_out(map, place).filter_map(|gateway| map.leads_to(gateway)) {
            let index = next.place.0 as usize;
            if !reached[index] {
                reached[index] = true;
                ways[index] = ways[place.0 as usize] + 1;
                queue.push_back(next.place);
            }
        }
    }
    ways
}

/// All gateways of a place.
fn ways_out(map: &PlaceMap, place: PlaceId) -> impl Iterator<Item = Gateway> {
    let n_gateways = map.place(place).map_or(0, |known| known.star.n_gateways());
    (0..n_gateways).map(move |index| Gateway { place, index })
}

/// Every way 1 long and straight.
fn first_guess(map: &PlaceMap) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0, 0.0]; map.n_places()];
    let mut reached = vec![false; map.n_places()];
    // Places, with the direction of their gateway 0 in quarter turns clockwise from up.
    let mut queue: VecDeque<(PlaceId, f64)> = VecDeque::new();
    if let Some(first) = reached.first_mut() {
        *first = true;
        queue.push_back((PlaceId(0), 0.0));
    }
    while let Some((place, heading)) = queue.pop_front() {
        let [x, y] = places[place.0 as usize];
        let Some(known) = map.place(place) else { continue };
        for gateway in ways_out(map, place) {
            let Some(to) = map.leads_to(gateway) else { continue };
            let index = to.place.0 as usize;
            if std::mem::replace(&mut reached[index], true) {
                continue;
            }
            let out = heading + quarters(&known.star, gateway.index);
            // A little askew, so that no two places that are guessed alike coincide.
            let angle_rad = out * std::f64::consts::FRAC_PI_2 + 0.01 * f64::from(to.place.0);
            places[index] = [x + angle_rad.sin(), y + angle_rad.cos()];
            let back = map.place(to.place).map_or(0.0, |there| quarters(&there.star, to.index));
            queue.push_back((to.place, out + 2.0 - back));
        }
    }
    places
}

/// The direction of a gateway from gateway 0, in quarter turns clockwise: those of one path lie
/// opposite, the others at right angles, if that can be.
fn quarters(star: &Star, gateway: u8) -> f64 {
    let (n_gateways, at) = (star.n_gateways(), f64::from(gateway));
    let through = (0..n_gateways).find_map(|from| Some((from, star.continuation(from)?)));
    match (n_gateways, through) {
        (2, Some(_)) => 2.0 * at,
        // The third leaves on one side of the two.
        (3, Some((0, 1))) => [0.0, 2.0, 3.0][usize::from(gateway)],
        (3, Some((1, 2))) => [0.0, 1.0, 3.0][usize::from(gateway)],
        (3, None) | (5.., _) => 4.0 * at / f64::from(n_gateways),
        _ => at,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    fn distances(places: &[[f64; 2]]) -> Vec<f64> {
        let pairs =
            places.iter().enumerate().flat_map(|(n, a)| places[..n].iter().map(move |b| (a, b)));
        pairs.map(|([ax, ay], [bx, by])| (ax - bx).hypot(ay - by)).collect()
    }

    #[test]
    fn a_street_grid_looks_like_one() {
        let world = World::from_drawing(
            "
            A---B---C
            |   |   |
            D---E---F
            |   |   |
            G---H---I",
        )
        .expect("a drawing");
        let places = layout(world.map());
        assert!(distances(&places).iter().all(|&far| 0.6 < far), "apart: {places:?}");
        let way = |from: usize, to: usize| {
            (places[from][0] - places[to][0]).hypot(places[from][1] - places[to][1])
        };
        assert!((0.7..1.3).contains(&way(0, 1)), "a way: {places:?}");
        assert!(way(0, 8) > 2.0 * way(0, 4) - 0.5, "corners lie opposite: {places:?}");
    }

    #[test]
    fn any_map_can_be_drawn() {
        assert_eq!(layout(&PlaceMap::default()), Vec::<[f64; 2]>::new(), "an empty one");
        let world = World::from_drawing("A---B").expect("a drawing");
        assert!((distances(&layout(world.map()))[0] - 1.0).abs() < 1e-6, "a way long");
    }
}
