//! REST's exploration as messages, and back.

use meetpoint_client::v1;
use serde_json::Value;
use v1::explorer::Kind;

use crate::from_json::{point, pose, present, real, rows, signed, text, truth, unsigned};
use crate::plan_json::asked;

/// The query that asks what a request asks.
pub(crate) fn query(request: &v1::GetExplorationRequest) -> String {
    let (mut robots, mut positions) = (vec![], vec![]);
    for explorer in &request.explorers {
        match &explorer.kind {
            Some(Kind::Robot(robot)) => robots.push(robot.clone()),
            Some(Kind::Position(v1::Point { x_m, y_m })) => positions.push(format!("{x_m},{y_m}")),
            None => panic!("a query cannot say that"),
        }
    }
    let of = asked(request.robot.as_ref(), request.map_version);
    let session = &request.session;
    let within = if session.is_empty() { String::new() } else { format!("&session={session}") };
    format!("robots={}&positions={}{of}{within}", robots.join(","), positions.join(";"))
}

pub(crate) fn exploration(body: &Value) -> v1::Exploration {
    let frontier = |body: &Value| v1::Frontier {
        point: Some(point(&body["point"])),
        length_m: real(&body["length_m"]),
    };
    v1::Exploration {
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        cost_revision: unsigned(&body["cost_revision"]),
        live: truth(&body["live"]),
        robot_radius_m: real(&body["robot_radius_m"]),
        robots: rows(&body["robots"], robot),
        explored: truth(&body["explored"]),
        frontiers: rows(&body["frontiers"], frontier),
        frontier_m: real(&body["frontier_m"]),
        observed_m2: real(&body["observed_m2"]),
        reached_m2: real(&body["reached_m2"]),
        planning_time_us: signed(&body["planning_time_us"]),
        frame_session: text(&body["frame_session"]),
        missing_arcs: rows(&body["missing_arcs"], unsigned),
    }
}

fn robot(body: &Value) -> v1::RobotExploration {
    let name = format!("EXPLORATION_CODE_{}", text(&body["code"]));
    let code = v1::ExplorationCode::from_str_name(&name);
    v1::RobotExploration {
        robot: text(&body["robot"]),
        session: text(&body["session"]),
        code: code.unwrap_or_else(|| panic!("{name} is no code")).into(),
        pose: present(body, "pose").map(pose),
        stamp_ns: signed(&body["stamp_ns"]),
        goal: present(body, "goal").map(point),
        heading_rad: present(body, "heading_rad").map(real),
        distance_m: real(&body["distance_m"]),
        points: rows(&body["points"], point),
        frame_session: present(body, "frame_session").map(text),
    }
}
