//! REST's graphs as messages.

use meetpoint_client::v1;
use serde_json::Value;
use v1::get_region_response::State;

use crate::from_json::{point, present, real, rows, text, truth, unsigned};

pub(crate) fn graph(body: &Value) -> v1::Graph {
    let pruning = match text(&body["pruned"]).as_str() {
        "none" => v1::GraphPruning::Unspecified,
        "pairs" => v1::GraphPruning::Pairs,
        "ends" => v1::GraphPruning::Ends,
        other => panic!("`{other}` is no pruning"),
    };
    v1::Graph {
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        cost_revision: unsigned(&body["cost_revision"]),
        pruning: pruning.into(),
        regions: rows(&body["regions"], region),
        arcs: rows(&body["arcs"], arc),
        ended: rows(&body["ended"], ended),
        hypothesis: present(body, "hypothesis").map(text).unwrap_or_default(),
    }
}

fn region(body: &Value) -> v1::Region {
    let ring = |body: &Value| v1::Ring { points: rows(body, point) };
    v1::Region {
        id: unsigned(&body["id"]),
        area_m2: real(&body["area_m2"]),
        center: Some(point(&body["center"])),
        clearance_m: real(&body["clearance_m"]),
        is_speck: truth(&body["is_speck"]),
        members: present(body, "members").map_or_else(Vec::new, |list| rows(list, unsigned)),
        outline: present(body, "outline").map_or_else(Vec::new, |list| rows(list, ring)),
    }
}

fn arc(body: &Value) -> v1::Arc {
    v1::Arc {
        id: unsigned(&body["id"]),
        region_a: unsigned(&body["regions"][0]),
        region_b: unsigned(&body["regions"][1]),
        position: Some(point(&body["position"])),
        line_from: Some(point(&body["line"][0])),
        line_to: Some(point(&body["line"][1])),
        width_m: real(&body["width_m"]),
        length_m: real(&body["length_m"]),
    }
}

fn ended(body: &Value) -> v1::EndedRegion {
    let heir = |body: &Value| v1::Heir {
        region: unsigned(&body["region"]),
        area_m2: real(&body["area_m2"]),
    };
    v1::EndedRegion {
        region: unsigned(&body["region"]),
        map_version: unsigned(&body["map_version"]),
        heirs: rows(&body["heirs"], heir),
    }
}

pub(crate) fn region_state(body: &Value) -> v1::GetRegionResponse {
    let living = present(body, "region").map(|body| State::Region(region(body)));
    let gone = present(body, "ended").map(|body| State::Ended(ended(body)));
    v1::GetRegionResponse {
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        cost_revision: unsigned(&body["cost_revision"]),
        state: living.or(gone),
    }
}
