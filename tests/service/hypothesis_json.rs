//! Maps of places: REST's JSON as messages.

use meetpoint_client::v1;
use serde_json::Value;

use crate::from_json::{point, present, real, rows, signed, small, text, truth, unsigned};

pub(crate) fn tree(body: &Value) -> v1::HypothesisTree {
    let name = v1::TreeName {
        map: text(&body["map"]),
        session: text(&body["session"]),
        planar: truth(&body["planar"]),
        circles: truth(&body["circles"]),
        metrical: truth(&body["metrical"]),
    };
    let assertion = |said: &Value| v1::HypothesisAssertion {
        hypothesis: text(&said["hypothesis"]),
        visits: small(&said["visits"]),
        in_force: truth(&said["in_force"]),
        reason: text(&said["reason"]),
        author: text(&said["author"]),
        time_ns: signed(&said["time_ns"]),
    };
    v1::HypothesisTree {
        name: Some(name),
        visits: small(&body["visits"]),
        visits_left_out: small(&body["visits_left_out"]),
        left_out_reason: text(&body["left_out_reason"]),
        consistent: small(&body["consistent"]),
        minimal: small(&body["minimal"]),
        ruled_out: unsigned(&body["ruled_out"]),
        given_up: unsigned(&body["given_up"]),
        truncated: truth(&body["truncated"]),
        assertions: rows(&body["assertions"], assertion),
        contradicted: unsigned(&body["contradicted"]),
        unmeasured: truth(&body["unmeasured"]),
        by_steps: truth(&body["by_steps"]),
    }
}

fn hypothesis(body: &Value) -> v1::Hypothesis {
    v1::Hypothesis {
        id: text(&body["id"]),
        rank: small(&body["rank"]),
        minimal: truth(&body["minimal"]),
        places: small(&body["places"]),
        edges: small(&body["edges"]),
        paths: small(&body["paths"]),
        unexplored: small(&body["unexplored"]),
        visits: rows(&body["visits"], small),
    }
}

pub(crate) fn list(body: &Value) -> v1::ListHypothesesResponse {
    let difference = |between: &Value| v1::HypothesisDifference {
        visit: small(&between["visit"]),
        first_visit: small(&between["first_visit"]),
        other_first_visit: small(&between["other_first_visit"]),
    };
    let decision = |next: &Value| v1::HypothesisDecision {
        hypothesis: text(&next["hypothesis"]),
        other_hypothesis: text(&next["other_hypothesis"]),
        turns: rows(&next["turns"], small),
        expected: text(&next["expected"]),
        other_expected: text(&next["other_expected"]),
    };
    v1::ListHypothesesResponse {
        tree: Some(tree(&body["tree"])),
        hypotheses: rows(&body["hypotheses"], hypothesis),
        next_page_token: text(&body["next_page_token"]),
        difference: present(body, "difference").map(difference),
        next_decision: present(body, "next_decision").map(decision),
    }
}

fn frame(body: &Value) -> v1::HypothesisFrame {
    v1::HypothesisFrame {
        places: rows(&body["places"], point),
        chi2: real(&body["chi2"]),
        degrees: small(&body["degrees"]),
        chi2_max: real(&body["chi2_max"]),
        contradicted: truth(&body["contradicted"]),
        settled: truth(&body["settled"]),
    }
}

pub(crate) fn detail(body: &Value) -> v1::GetHypothesisResponse {
    let gateway = |at: &Value| v1::HypothesisGateway {
        to_place: present(at, "to_place").map(small),
        to_gateway: present(at, "to_gateway").map_or(0, small),
        length_m: present(at, "length_m").map(real),
        turned_rad: present(at, "turned_rad").map(real),
        travels: small(&at["travels"]),
    };
    let place = |of: &Value| v1::HypothesisPlace {
        number: small(&of["number"]),
        star: text(&of["star"]),
        view: text(&of["view"]),
        view_is_unique: truth(&of["view_is_unique"]),
        gateways: rows(&of["gateways"], gateway),
    };
    let item = |next: &Value| v1::AgendaItem {
        place: small(&next["place"]),
        gateway: small(&next["gateway"]),
        turns: rows(&next["turns"], small),
    };
    v1::GetHypothesisResponse {
        tree: Some(tree(&body["tree"])),
        hypothesis: Some(hypothesis(&body["hypothesis"])),
        places: rows(&body["places"], place),
        at_place: small(&body["at_place"]),
        at_gateway: small(&body["at_gateway"]),
        agenda: rows(&body["agenda"], item),
        png: Vec::new(),
        paths: rows(&body["paths"], |path| v1::HypothesisPath { places: rows(path, small) }),
        frame: present(body, "frame").map(frame),
        regions: rows(&body["regions"], |of| v1::BoundaryRegions {
            right: rows(&of["right"], small),
            left: rows(&of["left"], small),
            around: rows(&of["around"], small),
        }),
    }
}

pub(crate) fn plan(body: &Value) -> v1::PlanTravelResponse {
    let leg = |of: &Value| v1::TravelLeg {
        place: small(&of["place"]),
        gateway: small(&of["gateway"]),
        turn: small(&of["turn"]),
        to_place: small(&of["to_place"]),
        length_m: present(of, "length_m").map(real),
    };
    let code = match text(&body["code"]).as_str() {
        "OK" => v1::TravelPlanCode::Ok,
        "PLACE_UNKNOWN" => v1::TravelPlanCode::PlaceUnknown,
        other => panic!("`{other}` is no code"),
    };
    v1::PlanTravelResponse {
        tree: Some(tree(&body["tree"])),
        hypothesis: text(&body["hypothesis"]),
        code: code.into(),
        legs: rows(&body["legs"], leg),
        length_m: present(body, "length_m").map(real),
    }
}

pub(crate) fn next_travel(body: &Value) -> v1::GetNextTravelResponse {
    let errand = match text(&body["errand"]).as_str() {
        "REHEARSE" => v1::TravelErrand::Rehearse,
        "CONFIRM" => v1::TravelErrand::Confirm,
        "EXPLORE" => v1::TravelErrand::Explore,
        "EXPLORED" => v1::TravelErrand::Explored,
        "REFUTED" => v1::TravelErrand::Refuted,
        other => panic!("`{other}` is no errand"),
    };
    v1::GetNextTravelResponse {
        tree: Some(tree(&body["tree"])),
        errand: errand.into(),
        turns: rows(&body["turns"], small),
        place: small(&body["place"]),
        gateway: small(&body["gateway"]),
    }
}
