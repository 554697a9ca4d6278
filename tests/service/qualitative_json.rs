//! Explorations by small steps: REST's JSON as messages.

use meetpoint_client::v1;
use serde_json::Value;

use crate::from_json::{present, real, rows, signed, small, text, truth, unsigned};

/// A value of an enum by its name, behind the prefix that all of its names share.
fn named(value: &Value, prefix: &str, of: impl Fn(&str) -> Option<i32>) -> i32 {
    let name = format!("{prefix}{}", text(value));
    of(&name).unwrap_or_else(|| panic!("`{name}` is none of its values"))
}

fn goal(value: &Value) -> i32 {
    named(value, "DISTINCTIVENESS_GOAL_", |name| {
        v1::DistinctivenessGoal::from_str_name(name).map(i32::from)
    })
}

fn strategy(value: &Value) -> i32 {
    named(value, "CONTROL_STRATEGY_", |name| {
        v1::ControlStrategy::from_str_name(name).map(i32::from)
    })
}

fn direction(value: &Value) -> v1::PlaceDirection {
    v1::PlaceDirection { place: small(&value["place"]), direction: small(&value["direction"]) }
}

pub(crate) fn exploration(body: &Value) -> v1::QualitativeExploration {
    v1::QualitativeExploration {
        session: text(&body["session"]),
        map: text(&body["map"]),
        sensor: text(&body["sensor"]),
        cones: small(&body["cones"]),
        folded: truth(&body["folded"]),
        compass: truth(&body["compass"]),
        selection: named(&body["selection"], "TRAVEL_SELECTION_", |name| {
            v1::TravelSelection::from_str_name(name).map(i32::from)
        }),
        corridor_width_m: real(&body["corridor_width_m"]),
        rehearsal_edges_max: small(&body["rehearsal_edges_max"]),
        begun_after_batch: unsigned(&body["begun_after_batch"]),
        read_through: unsigned(&body["read_through"]),
        firings_left_out: unsigned(&body["firings_left_out"]),
        batches_skipped: unsigned(&body["batches_skipped"]),
    }
}

pub(crate) fn step(body: &Value) -> v1::QualitativeStep {
    v1::QualitativeStep {
        kind: named(&body["kind"], "STEP_KIND_", |name| {
            v1::StepKind::from_str_name(name).map(i32::from)
        }),
        turn_rad: present(body, "turn_rad").map(real),
        move_m: present(body, "move_m").map(real),
        state: named(&body["state"], "QUALITATIVE_STATE_", |name| {
            v1::QualitativeState::from_str_name(name).map(i32::from)
        }),
        stamp_ns: signed(&body["stamp_ns"]),
        firings: unsigned(&body["firings"]),
        steps: unsigned(&body["steps"]),
        standing: small(&body["standing"]),
    }
}

fn open_direction(body: &Value) -> v1::OpenDirection {
    v1::OpenDirection {
        heading_rad: real(&body["heading_rad"]),
        law: named(&body["law"], "TRAVEL_LAW_", |name| {
            v1::TravelLaw::from_str_name(name).map(i32::from)
        }),
        leads_to: present(body, "leads_to").map(direction),
    }
}

fn object(body: &Value) -> v1::NearObject {
    v1::NearObject {
        heading_rad: real(&body["heading_rad"]),
        distance_m: real(&body["distance_m"]),
    }
}

fn point(body: &Value) -> v1::Point {
    v1::Point { x_m: real(&body["x_m"]), y_m: real(&body["y_m"]) }
}

fn whereabouts(body: &Value) -> v1::TopologicalWhereabouts {
    v1::TopologicalWhereabouts {
        kind: named(&body["kind"], "TOPOLOGICAL_WHEREABOUTS_KIND_", |name| {
            v1::TopologicalWhereaboutsKind::from_str_name(name).map(i32::from)
        }),
        place: present(body, "place").map(direction),
        facing: present(body, "facing").map(small),
        may_be: present(body, "may_be").map(direction),
        heading_rad: real(&body["heading_rad"]),
    }
}

fn outlook(body: &Value) -> v1::Outlook {
    let gained = |value: &Value| i32::try_from(signed(value)).expect("few directions");
    v1::Outlook {
        distance_difference_m: real(&body["distance_difference_m"]),
        symmetry_about_center: real(&body["symmetry_about_center"]),
        symmetry_about_line: real(&body["symmetry_about_line"]),
        discontinuity: present(body, "discontinuity").map(real),
        open_directions: small(&body["open_directions"]),
        open_directions_gained: present(body, "open_directions_gained").map(gained),
        lateral_m: present(body, "lateral_m").map(real),
        goal: goal(&body["goal"]),
        rule: text(&body["rule"]),
        climb: present(body, "climb").map(point),
        strategy: strategy(&body["strategy"]),
        steering_rad: real(&body["steering_rad"]),
        directions: rows(&body["directions"], open_direction),
        objects: rows(&body["objects"], object),
    }
}

fn place(body: &Value) -> v1::DistinctivePlace {
    v1::DistinctivePlace {
        number: small(&body["number"]),
        star: text(&body["star"]),
        goal: goal(&body["goal"]),
        home: truth(&body["home"]),
        visits: small(&body["visits"]),
        position: Some(point(&body["position"])),
        directions: rows(&body["directions"], open_direction),
        objects: rows(&body["objects"], object),
    }
}

fn averaged(body: &Value) -> v1::Averaged {
    v1::Averaged {
        measured: small(&body["measured"]),
        mean: present(body, "mean").map(real),
        std: present(body, "std").map(real),
    }
}

fn edge(body: &Value) -> v1::TravelEdge {
    v1::TravelEdge {
        from: Some(direction(&body["from"])),
        to: Some(direction(&body["to"])),
        strategy: strategy(&body["strategy"]),
        traversals: small(&body["traversals"]),
        length_m: Some(averaged(&body["length_m"])),
        width_m: Some(averaged(&body["width_m"])),
        turned_rad: Some(averaged(&body["turned_rad"])),
        curvature_rad_per_m: real(&body["curvature_rad_per_m"]),
    }
}

fn unexplored(body: &Value) -> v1::UnexploredDirection {
    v1::UnexploredDirection {
        at: Some(direction(&body["at"])),
        turns: rows(&body["turns"], small),
        rotation_rad: present(body, "rotation_rad").map(real),
        least_rotation: truth(&body["least_rotation"]),
        most_rotation: truth(&body["most_rotation"]),
    }
}

fn rehearsal(body: &Value) -> v1::QualitativeRehearsal {
    v1::QualitativeRehearsal {
        from: Some(direction(&body["from"])),
        may_be: Some(direction(&body["may_be"])),
        route: rows(&body["route"], direction),
        done: small(&body["done"]),
        expected: text(&body["expected"]),
        expected_length_m: present(body, "expected_length_m").map(real),
        as_predicted: present(body, "as_predicted").map(truth),
        others: small(&body["others"]),
    }
}

pub(crate) fn detail(body: &Value) -> v1::GetQualitativeExplorationResponse {
    v1::GetQualitativeExplorationResponse {
        exploration: Some(exploration(&body["exploration"])),
        step: Some(step(&body["step"])),
        whereabouts: Some(whereabouts(&body["whereabouts"])),
        outlook: Some(outlook(&body["outlook"])),
        places: rows(&body["places"], place),
        edges: rows(&body["edges"], edge),
        agenda: rows(&body["agenda"], unexplored),
        rehearsal: present(body, "rehearsal").map(rehearsal),
        rehearsals: small(&body["rehearsals"]),
        rehearsals_refuted: small(&body["rehearsals_refuted"]),
        surprises: small(&body["surprises"]),
        png: Vec::new(),
    }
}
