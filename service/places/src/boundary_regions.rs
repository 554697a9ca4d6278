//! Boundary regions: which places lie to the right and to the left of a path.
//!
//! The Spatial Semantic Hierarchy has regions as sets of places that contain them, of which a path bounds two:
//! B. Kuipers, "The Spatial Semantic Hierarchy", Artificial Intelligence 119 (2000), section 6.4; HSSH 2004,
//! section II, names regions and leaves their axioms to E. Remolina and B. Kuipers (2004). Those that are
//! meant here, in our words:
//!
//! 1. **Turns.** A gateway clockwise between that by which a path leaves a place and that by which it comes in
//!    is on its right, any other one on its left. Where a path begins or ends it has no sides.
//! 2. **Travel.** Who leaves through a gateway on one side stays on that side until he meets the path again.
//! 3. **Directions.** What is right of a path is left of it in its other direction.
//! 4. **Boundary.** No place lies on both sides, and none of the path's own lies on any.
//!
//! Axiom 2 is a default: who walks around the end of a path, or over a bridge, comes to the other side without
//! meeting it. Where that is known, axiom 4 takes it back for all places that hang together without the path:
//! they are told as around it, and on neither side. What was never travelled is on no side.
//!
//! Time O(paths × gateways).

use std::collections::{BTreeMap, BTreeSet};

use crate::place_map::{Gateway, Pass, PlaceId, PlaceMap};

/// The regions that a path bounds, in the direction in which it is listed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BoundaryRegions {
    /// Places to the right, ascending.
    pub right: Vec<PlaceId>,
    /// Places to the left, ascending.
    pub left: Vec<PlaceId>,
    /// Places that one comes to from both sides without meeting the path, ascending.
    pub around: Vec<PlaceId>,
}

/// On which sides of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sides {
    right: bool,
    left: bool,
}

/// The regions of every path, in the order of [`PlaceMap::passes`].
pub fn boundary_regions(map: &PlaceMap) -> Vec<BoundaryRegions> {
    map.passes().iter().map(|path| of_path(map, path)).collect()
}

fn of_path(map: &PlaceMap, path: &[Pass]) -> BoundaryRegions {
    let own: BTreeSet<PlaceId> = path.iter().map(|pass| pass.place).collect();
    let mut sides: BTreeMap<PlaceId, Sides> = BTreeMap::new();
    for pass in path {
        let (Some(enters), Some(leaves)) = (pass.enters, pass.leaves) else { continue };
        let Some(known) = map.place(pass.place) else { continue };
        let n_gateways = known.star.n_gateways();
        let onward = |gateway: u8| (gateway + n_gateways - leaves) % n_gateways;
        for index in (0..n_gateways).filter(|&index| index != enters && index != leaves) {
            let is_right = onward(index) < onward(enters);
            let side = Sides { right: is_right, left: !is_right };
            spread(map, &own, &mut sides, (Gateway { place: pass.place, index }, side));
        }
    }
    let on = |wanted: Sides| {
        let places = sides.iter().filter(move |(_, sides)| **sides == wanted);
        places.map(|(place, _)| *place).collect()
    };
    BoundaryRegions {
        right: on(Sides { right: true, left: false }),
        left: on(Sides { right: false, left: true }),
        around: on(Sides { right: true, left: true }),
    }
}

/// Says of all places beyond a gateway that they lie on a side, as far as one gets without the path.
fn spread(
    map: &PlaceMap,
    own: &BTreeSet<PlaceId>,
    sides: &mut BTreeMap<PlaceId, Sides>,
    (from, side): (Gateway, Sides),
) {
    let mut queue = vec![from];
    while let Some(gateway) = queue.pop() {
        let Some(to) = map.leads_to(gateway).filter(|to| !own.contains(&to.place)) else {
            continue;
        };
        let known = sides.entry(to.place).or_default();
        let both = Sides { right: known.right || side.right, left: known.left || side.left };
        if both == *known {
            continue;
        }
        *known = both;
        let n_gateways = map.place(to.place).map_or(0, |place| place.star.n_gateways());
        queue.extend((0..n_gateways).map(|index| Gateway { index, ..to }));
    }
}
