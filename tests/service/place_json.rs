//! REST's JSON of places.

use meetpoint_client::v1;
use serde_json::Value;

use crate::from_json::{point, pose, present, real, rows, small, text, truth, unsigned};
use crate::hypothesis_json;

/// What was seen of a place, without cells and picture.
pub(crate) fn seen(body: &Value) -> v1::GetPlaceMapResponse {
    let state = |of: &Value| v1::DistinctiveState {
        number: small(&of["number"]),
        path: small(&of["path"]),
        plus: truth(&of["plus"]),
        ends: truth(&of["ends"]),
        right: rows(&of["right"], small),
        left: rows(&of["left"], small),
        around: small(&of["around"]),
    };
    let grid = v1::Grid {
        resolution_m: real(&body["resolution_m"]),
        origin: present(body, "origin").map(point),
        width: small(&body["width"]),
        height: small(&body["height"]),
        ..v1::Grid::default()
    };
    v1::GetPlaceMapResponse {
        tree: Some(hypothesis_json::tree(&body["tree"])),
        hypothesis: text(&body["hypothesis"]),
        place: small(&body["place"]),
        visits: rows(&body["visits"], small),
        visit: small(&body["visit"]),
        grid: Some(grid),
        png: Vec::new(),
        scans: small(&body["scans"]),
        cut_short: truth(&body["cut_short"]),
        robot: present(body, "robot").map(pose),
        star: present(body, "star").map(place),
        not_a_place: text(&body["not_a_place"]),
        came_in_by: present(body, "came_in_by").map(small),
        star_found: text(&body["star_found"]),
        star_told: text(&body["star_told"]),
        states: rows(&body["states"], state),
    }
}

pub(crate) fn places(body: &Value) -> v1::ListPlacesResponse {
    v1::ListPlacesResponse {
        places: rows(&body["places"], place),
        next_page_token: text(&body["next_page_token"]),
        map_version: unsigned(&body["map_version"]),
        place_count: small(&body["place_count"]),
        edges: small(&body["edges"]),
        paths: small(&body["paths"]),
    }
}

fn place(body: &Value) -> v1::Place {
    v1::Place {
        number: small(&body["number"]),
        core: present(body, "core").map(point),
        clearance_m: real(&body["clearance_m"]),
        star: text(&body["star"]),
        gateways: rows(&body["gateways"], gateway),
        fragments: rows(&body["fragments"], fragment),
    }
}

fn gateway(body: &Value) -> v1::PlaceGateway {
    v1::PlaceGateway {
        left: present(body, "left").map(point),
        right: present(body, "right").map(point),
        heading_rad: real(&body["heading_rad"]),
        width_m: real(&body["width_m"]),
        law: law(&body["law"]),
        continues_to: present(body, "continues_to").map(small),
        to_place: present(body, "to_place").map(small),
        to_gateway: present(body, "to_gateway").map_or(0, small),
    }
}

fn fragment(body: &Value) -> v1::PathFragment {
    v1::PathFragment {
        number: small(&body["number"]),
        plus: truth(&body["plus"]),
        outward: present(body, "outward").map(small),
        inward: present(body, "inward").map(small),
        law: law(&body["law"]),
    }
}

fn law(body: &Value) -> i32 {
    let law = match text(body).as_str() {
        "MIDLINE" => v1::TravelLaw::Midline,
        "LEFT_WALL" => v1::TravelLaw::LeftWall,
        "RIGHT_WALL" => v1::TravelLaw::RightWall,
        "BLIND_STEP" => v1::TravelLaw::BlindStep,
        "DEAD_END" => v1::TravelLaw::DeadEnd,
        "NONE" => v1::TravelLaw::None,
        other => panic!("`{other}` is no law of travel"),
    };
    law.into()
}
