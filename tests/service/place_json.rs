//! REST's JSON of places.

use meetpoint_client::v1;
use serde_json::Value;

use crate::from_json::{point, present, real, rows, small, text, truth, unsigned};

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
