//! Changes and doors, and REST's JSON of them.

use meetpoint_client::v1;
use serde_json::Value;

use crate::door::Page;
use crate::from_json::{bounding_box, point, present, real, rows, signed, small, text, unsigned};
use crate::rest_door::{paged, version_name};

/// What is asked, as a query.
pub(crate) fn query(request: &v1::ListChangesRequest) -> String {
    let v1::ListChangesRequest {
        map: _,
        since,
        version,
        bounding_box,
        cells_min,
        page_size,
        page_token,
    } = request;
    let box_asked = bounding_box.map_or_else(String::new, |asked| {
        let v1::BoundingBox { min_x_m, min_y_m, max_x_m, max_y_m } = asked;
        format!("&bbox={min_x_m},{min_y_m},{max_x_m},{max_y_m}")
    });
    let (version, page) = (version_name(*version), paged(Page(*page_size, page_token)));
    format!("since={since}&version={version}&cells_min={cells_min}{box_asked}&{page}")
}

pub(crate) fn changes(body: &Value) -> v1::ListChangesResponse {
    let change = |body: &Value| {
        let kind = match text(&body["kind"]).as_str() {
            "APPEARED" => v1::ChangeKind::Appeared,
            "VANISHED" => v1::ChangeKind::Vanished,
            other => panic!("`{other}` is no kind of a change"),
        };
        v1::Change {
            kind: kind.into(),
            bounding_box: present(body, "bounding_box").map(bounding_box),
            cells: unsigned(&body["cells"]),
            position: present(body, "position").map(point),
        }
    };
    v1::ListChangesResponse {
        changes: rows(&body["changes"], change),
        next_page_token: text(&body["next_page_token"]),
        since: unsigned(&body["since"]),
        map_version: unsigned(&body["map_version"]),
        cells_appeared: unsigned(&body["cells_appeared"]),
        cells_vanished: unsigned(&body["cells_vanished"]),
    }
}

pub(crate) fn doors(body: &Value) -> v1::ListDoorsResponse {
    let door = |body: &Value| {
        let state = match text(&body["state"]).as_str() {
            "OPEN" => v1::DoorState::Open,
            "CLOSED" => v1::DoorState::Closed,
            other => panic!("`{other}` is no state of a door"),
        };
        v1::Door {
            id: text(&body["id"]),
            position: present(body, "position").map(point),
            bounding_box: present(body, "bounding_box").map(bounding_box),
            cells: unsigned(&body["cells"]),
            state: state.into(),
            changes: small(&body["changes"]),
            change_time_ns: signed(&body["change_time_ns"]),
            since_time_ns: signed(&body["since_time_ns"]),
            closed_share: real(&body["closed_share"]),
            variance: real(&body["variance"]),
            autocorrelation: real(&body["autocorrelation"]),
        }
    };
    v1::ListDoorsResponse {
        doors: rows(&body["doors"], door),
        next_page_token: text(&body["next_page_token"]),
        map_version: unsigned(&body["map_version"]),
    }
}
