//! REST's plans and costs as messages, and back.

use std::fmt::Write;

use meetpoint_client::v1;
use serde_json::{Value, json};
use v1::cost::Kind;
use v1::obstacle::Shape;
use v1::robot_choice::Kind as Robot;

use crate::from_json::{point, present, real, rows, signed, text, unsigned};

fn point_json(point: &v1::Point) -> Value {
    json!({"x_m": point.x_m, "y_m": point.y_m})
}

fn points_json(points: &[v1::Point]) -> Value {
    points.iter().map(point_json).collect()
}

/// What a body says of the robot and the version.
fn put_asked(body: &mut Value, robot: Option<&v1::RobotChoice>, map_version: u64) {
    match robot.and_then(|robot| robot.kind.as_ref()) {
        Some(Robot::Profile(name)) => body["profile"] = json!(name),
        Some(Robot::RobotRadiusM(radius_m)) => body["robot_radius_m"] = json!(radius_m),
        None => {}
    }
    if map_version != 0 {
        body["map_version"] = json!(map_version);
    }
}

/// The same in a query, after other fields.
pub(crate) fn asked(robot: Option<&v1::RobotChoice>, map_version: u64) -> String {
    let mut query = match robot.and_then(|robot| robot.kind.as_ref()) {
        Some(Robot::Profile(name)) => format!("&profile={name}"),
        Some(Robot::RobotRadiusM(radius_m)) => format!("&robot_radius_m={radius_m}"),
        None => String::new(),
    };
    if map_version != 0 {
        write!(query, "&map_version={map_version}").expect("text can be written to");
    }
    query
}

pub(crate) fn path_question(request: &v1::PlanPathRequest) -> Value {
    let mode = match request.mode() {
        v1::PlanMode::Unspecified | v1::PlanMode::Exact => "EXACT",
        v1::PlanMode::Triplet => "TRIPLET",
        v1::PlanMode::Paper => "PAPER",
    };
    let mut body = json!({
        "mode": mode,
        "alternatives": request.alternatives,
        "route_only": request.route_only,
        "cells": request.cells,
    });
    for (name, end) in [("start", &request.start), ("goal", &request.goal)] {
        if let Some(end) = end {
            body[name] = point_json(end);
        }
    }
    put_asked(&mut body, request.robot.as_ref(), request.map_version);
    let tree = request.tree.clone().unwrap_or_default();
    for (name, place) in [("from_place", request.from_place), ("to_place", request.to_place)] {
        if let Some(place) = place {
            body[name] = json!(place);
        }
    }
    if !request.hypothesis.is_empty() {
        body["hypothesis"] = json!(request.hypothesis);
        body["session"] = json!(tree.session);
        body["metrical"] = json!(tree.metrical);
    }
    body
}

pub(crate) fn matrix_question(request: &v1::PlanMatrixRequest) -> Value {
    let (starts, goals) = (points_json(&request.starts), points_json(&request.goals));
    let mut body = json!({"starts": starts, "goals": goals});
    put_asked(&mut body, request.robot.as_ref(), request.map_version);
    body
}

fn code(body: &Value) -> i32 {
    let name = format!("PLAN_CODE_{}", text(body));
    v1::PlanCode::from_str_name(&name).unwrap_or_else(|| panic!("{name} is no code")).into()
}

fn basis(body: &Value) -> v1::PlanBasis {
    let name = format!("ANSWERED_BY_{}", text(&body["answered_by"]));
    let answered_by = v1::AnsweredBy::from_str_name(&name).expect("who answers is told");
    v1::PlanBasis {
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        cost_revision: unsigned(&body["cost_revision"]),
        profile: present(body, "profile").map_or_else(String::new, text),
        robot_radius_m: real(&body["robot_radius_m"]),
        answered_by: answered_by.into(),
        hypothesis: present(body, "hypothesis").map_or_else(String::new, text),
    }
}

pub(crate) fn path_reply(body: &Value) -> v1::PlanPathResponse {
    v1::PlanPathResponse {
        code: code(&body["code"]),
        basis: Some(basis(body)),
        path: present(body, "route").map(|_| path(body)),
        alternatives: present(body, "alternatives").map_or_else(Vec::new, |list| rows(list, path)),
        warnings: rows(&body["warnings"], text),
        what_to_do: present(body, "what_to_do").map_or_else(String::new, text),
        snapped_start: present(body, "snapped_start").map(point),
        snapped_goal: present(body, "snapped_goal").map(point),
        planning_time_us: signed(&body["planning_time_us"]),
    }
}

fn path(body: &Value) -> v1::PlannedPath {
    let step = |body: &Value| v1::RouteStep {
        region: unsigned(&body["region"]),
        arc: unsigned(&body["arc"]),
    };
    let points = |name| present(body, name).map_or_else(Vec::new, |list| rows(list, point));
    v1::PlannedPath {
        route: rows(&body["route"], step),
        grid_length_m: real(&body["grid_length_m"]),
        path_length_m: present(body, "path_length_m").map_or(0.0, real),
        clearance_min_m: present(body, "clearance_min_m").map_or(0.0, real),
        points: points("points"),
        cells: points("cells"),
        cost_m: real(&body["cost_m"]),
        loss_bound: real(&body["loss_bound"]),
    }
}

pub(crate) fn matrix_reply(body: &Value) -> v1::PlanMatrixResponse {
    let entry = |value: &Value| if value.is_null() { -1.0 } else { real(value) };
    let row = |body: &Value| v1::MatrixRow { lengths_m: rows(body, entry) };
    v1::PlanMatrixResponse {
        basis: Some(basis(body)),
        rows: rows(&body["lengths_m"], row),
        start_codes: rows(&body["start_codes"], code),
        goal_codes: rows(&body["goal_codes"], code),
        planning_time_us: signed(&body["planning_time_us"]),
    }
}

pub(crate) fn motion(body: &Value) -> v1::NextMotionResponse {
    v1::NextMotionResponse {
        code: code(&body["code"]),
        basis: Some(basis(body)),
        heading_rad: present(body, "heading_rad").map(real),
        distance_left_m: real(&body["distance_left_m"]),
        region: unsigned(&body["region"]),
        next_arc: unsigned(&body["next_arc"]),
        next_point: present(body, "next_point").map(point),
        what_to_do: present(body, "what_to_do").map_or_else(String::new, text),
    }
}

pub(crate) fn nearest(body: &Value) -> v1::GetNearestFreePointResponse {
    v1::GetNearestFreePointResponse {
        basis: Some(basis(body)),
        point: present(body, "point").map(point),
        distance_m: real(&body["distance_m"]),
        region: unsigned(&body["region"]),
    }
}

pub(crate) fn reachable(body: &Value) -> v1::GetReachableAreaResponse {
    let region = |body: &Value| v1::ReachedRegion {
        region: unsigned(&body["region"]),
        area_m2: real(&body["area_m2"]),
    };
    v1::GetReachableAreaResponse {
        code: code(&body["code"]),
        basis: Some(basis(body)),
        area_m2: real(&body["area_m2"]),
        regions: rows(&body["regions"], region),
        what_to_do: present(body, "what_to_do").map_or_else(String::new, text),
    }
}

pub(crate) fn new_cost(cost: &v1::Cost) -> Value {
    let mut body = json!({
        "reason": cost.reason,
        "author": cost.author,
        "client_key": cost.client_key,
        "origin": if cost.origin() == v1::CostOrigin::Evidence { "EVIDENCE" } else { "OPERATOR" },
    });
    match &cost.kind {
        Some(Kind::Closure(closure)) => body["closed_arc"] = json!(closure.arc),
        Some(Kind::Toll(toll)) => {
            body["toll"] = json!({"arc": toll.arc, "toll_m": toll.toll_m});
        }
        Some(Kind::Obstacle(v1::Obstacle { shape })) => {
            body["obstacle"] = match shape {
                Some(Shape::Polygon(polygon)) => json!({"polygon": points_json(&polygon.points)}),
                Some(Shape::Polyline(line)) => {
                    json!({"polyline": points_json(&line.points), "width_m": line.width_m})
                }
                None => json!({}),
            };
        }
        Some(Kind::Zone(zone)) => {
            let polygon = zone.polygon.as_ref().map_or_else(Vec::new, |of| of.points.clone());
            body["zone"] = json!({"polygon": points_json(&polygon), "factor": zone.factor});
        }
        None => {}
    }
    body
}

pub(crate) fn cost(body: &Value) -> v1::Cost {
    let polygon = |list: &Value| v1::Polygon { points: rows(list, point) };
    let obstacle = |body: &Value| {
        let line = |list: &Value| v1::Polyline {
            points: rows(list, point),
            width_m: present(body, "width_m").map_or(0.0, real),
        };
        let of_polygon = present(body, "polygon").map(|list| Shape::Polygon(polygon(list)));
        let of_line = present(body, "polyline").map(|list| Shape::Polyline(line(list)));
        v1::Obstacle { shape: of_polygon.or(of_line) }
    };
    let closure = |arc: &Value| Kind::Closure(v1::ArcClosure { arc: unsigned(arc) });
    let toll = |body: &Value| {
        Kind::Toll(v1::ArcToll { arc: unsigned(&body["arc"]), toll_m: real(&body["toll_m"]) })
    };
    let zone = |body: &Value| {
        let polygon = Some(polygon(&body["polygon"]));
        Kind::Zone(v1::Zone { polygon, factor: real(&body["factor"]) })
    };
    let kinds = [
        present(body, "closed_arc").map(closure),
        present(body, "toll").map(toll),
        present(body, "obstacle").map(|body| Kind::Obstacle(obstacle(body))),
        present(body, "zone").map(zone),
    ];
    let origin = match text(&body["origin"]).as_str() {
        "EVIDENCE" => v1::CostOrigin::Evidence,
        _ => v1::CostOrigin::Operator,
    };
    v1::Cost {
        id: text(&body["id"]),
        kind: kinds.into_iter().flatten().next(),
        reason: text(&body["reason"]),
        author: text(&body["author"]),
        origin: origin.into(),
        cost_revision: unsigned(&body["cost_revision"]),
        create_time_ns: signed(&body["create_time_ns"]),
        client_key: present(body, "client_key").map_or_else(String::new, text),
    }
}

pub(crate) fn preferences(profile: &v1::Profile) -> Value {
    json!({
        "robot_radius_m": profile.robot_radius_m,
        "clearance_distance_m": profile.clearance_distance_m,
        "clearance_factor": profile.clearance_factor,
        "occupancy_factor": profile.occupancy_factor,
    })
}

pub(crate) fn profile(body: &Value) -> v1::Profile {
    v1::Profile {
        name: text(&body["name"]),
        robot_radius_m: real(&body["robot_radius_m"]),
        clearance_distance_m: real(&body["clearance_distance_m"]),
        clearance_factor: real(&body["clearance_factor"]),
        occupancy_factor: real(&body["occupancy_factor"]),
    }
}
