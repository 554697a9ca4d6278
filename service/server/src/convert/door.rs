//! Doors on the wire.

use meetpoint_geometry::{Cell, GridFrame};
use meetpoint_occupancy::Door;
use meetpoint_proto::v1;

use super::change::box_around;

/// A door for the wire.
pub(crate) fn to_wire(door: &Door, frame: GridFrame) -> v1::Door {
    let Door {
        oldest: Cell { x, y },
        since_ns,
        position,
        low,
        high,
        n_cells,
        n_changes,
        changed_ns,
        is_closed,
        closed_share,
        variance,
        autocorrelation,
    } = *door;
    let state = if is_closed { v1::DoorState::Closed } else { v1::DoorState::Open };
    v1::Door {
        id: format!("{x}_{y}"),
        position: Some(v1::Point { x_m: position.x, y_m: position.y }),
        bounding_box: Some(box_around(low, high, frame)),
        cells: n_cells as u64,
        state: state.into(),
        changes: n_changes,
        change_time_ns: changed_ns,
        since_time_ns: since_ns,
        closed_share,
        variance,
        autocorrelation,
    }
}
