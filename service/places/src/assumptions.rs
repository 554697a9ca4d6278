//! The axioms: what has to hold for a map to be possible.
//!
//! HSSH 2004 builds on the theory of E. Remolina and B. Kuipers ("Towards a general theory of
//! topological maps", Artificial Intelligence 152, 2004) without printing its axioms. Those that
//! hold here, in our words and in the order in which they are tested, cheapest first:
//!
//! 1. **Action.** Travels are reliable: the same gateway leads to the same gateway every time
//!    (HSSH 2004, Fig. 4, step 1). A map in which the robot should have seen another star or view
//!    than it saw is refuted.
//! 2. **Two directions.** An edge can be travelled both ways, and has two ends: the gateway where
//!    one arrives leads back to the gateway where one left, and is another one.
//! 3. **One edge a gateway.** Each gateway is on one path fragment, and leads to one gateway.
//! 4. **Place matching by local topology.** A visit is at a known place, arriving at one of its
//!    gateways, only if the star of the place reads from there as it was seen: same number of
//!    gateways, control laws and fragments, in the same circular order (Fig. 4, step 2).
//! 5. **Views,** where the caller gives them: places whose views have different names differ, and
//!    a view that is said to be unique is had by one place only (Fig. 4, step 4b).
//! 6. **Path order** ([`Assumptions::has_ordered_paths`]). The places on a path are ordered, so
//!    that a path meets no place twice: it neither crosses itself nor closes to a circle.
//! 7. **Planarity** ([`Assumptions::is_planar`]; F. Savelli and B. Kuipers, "Loop-closing and
//!    planarity in topological map-building", IROS 2004). The map can be drawn in the plane, with
//!    the circular order of every star as seen from above: V − E + F = 2 for its places, edges
//!    and faces. A link within a face divides it; one between two faces of a connected map would
//!    add a handle. It is therefore enough that the two gateways lie in one face.
//!
//! Nothing is assumed of gateways that nobody has been through, and metrical records are not
//! used. A new place is always possible, but by a unique view.

use crate::place_map::{Gateway, PlaceMap};

/// What is taken for granted about a building, beyond the axioms that always hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Assumptions {
    /// Axiom 6. To be left out where corridors run in circles without a place where they end.
    pub has_ordered_paths: bool,
    /// Axiom 7. To be left out where ways cross over each other.
    pub is_planar: bool,
}

impl Assumptions {
    /// The topological axioms of HSSH 2004, section IV, first experiment.
    pub const HSSH_2004: Self = Self { has_ordered_paths: true, is_planar: false };
    /// The same in the plane: section IV, second experiment.
    pub const HSSH_2004_PLANAR: Self = Self { has_ordered_paths: true, is_planar: true };
    /// Nothing but reliable travels.
    pub const NONE: Self = Self { has_ordered_paths: false, is_planar: false };

    /// Whether `a` may lead to `b` in `map`, which is connected and in which neither leads
    /// anywhere yet (axioms 2, 6 and 7). O(places on the two paths + edges around a face).
    pub(crate) fn allow(self, map: &PlaceMap, a: Gateway, b: Gateway) -> bool {
        a != b
            && (!self.has_ordered_paths || share_no_place(map, a, b))
            && (!self.is_planar || share_a_face(map, a, b))
    }
}

/// Whether no place lies on both of the paths that enter at `a` and `b`. If they are one, all do.
fn share_no_place(map: &PlaceMap, a: Gateway, b: Gateway) -> bool {
    map.path_inward(a).all(|on_a| map.path_inward(b).all(|on_b| on_a.place != on_b.place))
}

/// Whether one comes past `b` who walks from `a` along the walls, the place on his left.
fn share_a_face(map: &PlaceMap, a: Gateway, b: Gateway) -> bool {
    let mut at = a;
    loop {
        let next = map.turned(at, 1);
        if next == b {
            return true;
        }
        // What is not known is a dead end: one turns there, and is back at the same gateway.
        at = map.leads_to(next).unwrap_or(next);
        if at == a {
            return false;
        }
    }
}
