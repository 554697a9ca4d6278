//! Changes between versions on the wire.

use meetpoint_geometry::{Cell, GridFrame};
use meetpoint_occupancy::{Change, ChangeKind};
use meetpoint_proto::v1;

/// A change for the wire.
pub(crate) fn to_wire(change: &Change, frame: GridFrame) -> v1::Change {
    let Change { kind, low, high, n_cells, first } = *change;
    let kind = match kind {
        ChangeKind::Appeared => v1::ChangeKind::Appeared,
        ChangeKind::Vanished => v1::ChangeKind::Vanished,
    };
    let middle = frame.center_of(first);
    v1::Change {
        kind: kind.into(),
        bounding_box: Some(box_around(low, high, frame)),
        cells: n_cells as u64,
        position: Some(v1::Point { x_m: middle.x, y_m: middle.y }),
    }
}

/// Around the cells from one corner to the other, which belongs to them.
pub(super) fn box_around(low: Cell, high: Cell, frame: GridFrame) -> v1::BoundingBox {
    let beyond = Cell { x: high.x.saturating_add(1), y: high.y.saturating_add(1) };
    let (low, high) = (frame.corner_of(low), frame.corner_of(beyond));
    v1::BoundingBox { min_x_m: low.x, min_y_m: low.y, max_x_m: high.x, max_y_m: high.y }
}
