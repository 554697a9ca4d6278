//! Local perceptual maps of places on the wire.

use meetpoint_geometry::Pose;
use meetpoint_places::{DState, LargeScaleStar, LocalPlace, ParsedMap, PlaceId};
use meetpoint_proto::v1;

use super::hypothesis::small;
use super::place;

/// A place by itself: where its gateways lead is a matter of the map of places, not of what was seen here.
pub(crate) fn alone(id: PlaceId, local: &LocalPlace, parsed: &ParsedMap) -> v1::Place {
    let mut wire = place::to_wire(id, local, &parsed.map);
    wire.number = 0;
    for gateway in &mut wire.gateways {
        (gateway.to_place, gateway.to_gateway) = (None, 0);
    }
    wire
}

/// The distinctive states of a star, clockwise.
pub(crate) fn states(star: &LargeScaleStar) -> Vec<v1::DistinctiveState> {
    let number = |at: usize| small(at + 1);
    let numbers = |turns: Vec<usize>| turns.into_iter().map(number).collect();
    let state = |(at, state): (usize, &DState)| {
        let DState { path, is_plus, ends } = *state;
        v1::DistinctiveState {
            number: number(at),
            path: u32::from(path),
            plus: is_plus,
            ends,
            right: numbers(star.turns_right(at)),
            left: numbers(star.turns_left(at)),
            around: number(star.turned_around(at)),
        }
    };
    star.states().iter().enumerate().map(state).collect()
}

/// A pose for the wire.
pub(crate) fn pose(pose: Pose) -> v1::Pose {
    let Pose { x_m, y_m, theta_rad } = pose;
    v1::Pose { x_m, y_m, theta_rad }
}
