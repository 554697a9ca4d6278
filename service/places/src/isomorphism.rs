//! Whether two maps are one and the same but for the numbers of places and gateways.
//!
//! Gateways stand in circular order around their places, so that one pair of gateways that are the
//! same fixes all others: from each pair of places, the same turns lead to the same places. All pairs
//! are tried for one gateway of the first map. Time O(gateways²).

use std::collections::HashMap;

use crate::place_map::{Gateway, PlaceId, PlaceMap};

/// Whether places of `a` can be taken for places of `b`, one to one, such that as many gateways
/// stand around them in the same circular order and lead to the same places, or nowhere. Laws, path
/// fragments and views are not compared; maps must hang together.
pub fn is_isomorphic(a: &PlaceMap, b: &PlaceMap) -> bool {
    if a.n_places() != b.n_places() || a.n_edges() != b.n_edges() {
        return false;
    }
    let Some(first) = a.gateways().next() else { return true };
    b.gateways().any(|image| agree(a, first, b, image))
}

/// Whether all that can be reached from `first` is as what can be reached from `image`.
fn agree(a: &PlaceMap, first: Gateway, b: &PlaceMap, image: Gateway) -> bool {
    let n_gateways =
        |map: &PlaceMap, id: PlaceId| map.place(id).map_or(0, |place| place.star.n_gateways());
    // Of every place of `a`, which gateway of `b` its gateway 0 is.
    let mut images: HashMap<PlaceId, Gateway> = HashMap::new();
    let mut taken: HashMap<PlaceId, PlaceId> = HashMap::new();
    let mut open = vec![(first, image)];
    while let Some((at, image)) = open.pop() {
        let n = n_gateways(a, at.place);
        if n != n_gateways(b, image.place) {
            return false;
        }
        let zero = b.turned(image, n - at.index);
        if let Some(known) = images.insert(at.place, zero) {
            if known != zero {
                return false;
            }
            continue;
        }
        if taken.insert(image.place, at.place).is_some() {
            return false;
        }
        for turn in 0..n {
            match (a.leads_to(a.turned(at, turn)), b.leads_to(b.turned(image, turn))) {
                (Some(next), Some(next_image)) => open.push((next, next_image)),
                (None, None) => {}
                _ => return false,
            }
        }
    }
    images.len() == a.n_places()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    fn map(drawing: &str) -> PlaceMap {
        World::from_drawing(drawing).expect("a drawing").map().clone()
    }

    #[test]
    fn turned_and_named_otherwise_it_is_the_same() {
        let arms = map("A-B-C-F-G\n  |\n  D-E");
        let turned = map("E\n|\nD\n|\nB-X\n|\nC\n|\nF-G");
        assert!(is_isomorphic(&arms, &turned), "a quarter turn, and places that are bends");
        let mirrored = map("G-F-C-B-A\n      |\n    E-D");
        assert!(!is_isomorphic(&arms, &mirrored), "left is not right");
        assert!(!is_isomorphic(&arms, &map("A-B-C-F\n  |\n  D-E")), "a place is missing");
    }

    #[test]
    fn a_ring_of_four_is_not_one_of_six() {
        let ring = |drawing: &str| map(drawing);
        let four = ring("A-B\n| |\nC-D");
        assert!(is_isomorphic(&four, &four), "all four ways around");
        assert!(!is_isomorphic(&four, &ring("A-B-C\n|   |\nD-E-F")), "as many corners, more edges");
    }
}
