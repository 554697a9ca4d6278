//! Tours through a building: all that is new first, then some of it again.
//!
//! At every place the tour takes the corridor that it took least often so far, by lot among equals,
//! and turns back only in dead ends: as a person does who shows a robot around and wants to have
//! been everywhere.

use rand::Rng;
use rand::seq::IndexedRandom;

use crate::corridors::Corridors;

/// A tour ends with at least this many sightings of landmarks that were seen before: it comes back
/// to where it was, and does not end where it has just arrived for the first time.
const N_KNOWN_AT_END: usize = 4;
/// Tours drawn before a building is given up.
const N_TRIES: usize = 200;

/// A walk from place to place, beginning and ending at a landmark, on which the robot drives over
/// landmarks `n_sightings` times, over all of them at least once, and over ones that it knows at
/// the last four; it comes by a corridor that it did not know to a landmark that it did, which
/// closes a loop. `None` if no such tour was found in 200.
pub fn tour(building: &Corridors, n_sightings: usize, rng: &mut impl Rng) -> Option<Vec<usize>> {
    (0..N_TRIES).find_map(|_| {
        let walk = walk(building, n_sightings, rng)?;
        comes_back(building, &walk).then_some(walk)
    })
}

/// A walk by least driven corridors, from a landmark by lot.
fn walk(building: &Corridors, n_sightings: usize, rng: &mut impl Rng) -> Option<Vec<usize>> {
    let places: Vec<usize> = (0..building.places().len()).collect();
    let landmarks: Vec<usize> =
        places.into_iter().filter(|&place| building.is_landmark(place)).collect();
    let mut walk = vec![*landmarks.choose(rng)?];
    let mut n_seen = 1;
    while n_seen < n_sightings {
        let next = least_driven(building, &walk, rng)?;
        walk.push(next);
        n_seen += usize::from(building.is_landmark(next));
    }
    Some(walk)
}

/// The next place of a walk.
fn least_driven(building: &Corridors, walk: &[usize], rng: &mut impl Rng) -> Option<usize> {
    let (&here, before) = walk.split_last()?;
    let mut ahead: Vec<usize> = building.neighbours(here).collect();
    if 1 < ahead.len() {
        ahead.retain(|place| Some(place) != before.last());
    }
    let least = ahead.iter().map(|&place| n_driven(walk, here, place)).min()?;
    ahead.retain(|&place| n_driven(walk, here, place) == least);
    ahead.choose(rng).copied()
}

/// How often a walk takes the corridor between two places, either way.
fn n_driven(walk: &[usize], a: usize, b: usize) -> usize {
    walk.windows(2).filter(|&pair| pair == [a, b] || pair == [b, a]).count()
}

/// True if a walk closes a loop, sees all landmarks, and ends among known ones.
fn comes_back(building: &Corridors, walk: &[usize]) -> bool {
    let known = |n_places: usize| &walk[..n_places];
    let closes_loop = (1..walk.len()).any(|index| {
        let is_new_way = n_driven(known(index), walk[index - 1], walk[index]) == 0;
        is_new_way && known(index).contains(&walk[index])
    });
    let sightings: Vec<usize> =
        walk.iter().copied().filter(|&place| building.is_landmark(place)).collect();
    let first_of_end = sightings.len().saturating_sub(N_KNOWN_AT_END);
    let sees_all = (0..building.places().len())
        .filter(|&place| building.is_landmark(place))
        .all(|place| sightings[..first_of_end].contains(&place));
    closes_loop && sees_all
}
