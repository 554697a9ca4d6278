//! What an answer says, whichever door it came by.

use anyhow::Context;
use meetpoint_client::v1;
use serde_json::Value;

use super::door::Reply;

/// Stands for what is absent: a length that is none, an arc that is none.
const NOTHING: f64 = -1.0;

/// The substance of an answer: what must be equal over both doors, bit for bit.
#[derive(Debug, PartialEq)]
pub(super) struct Answer {
    /// `OK`, or why there is none; one a start and a goal of a matrix.
    codes: Vec<String>,
    /// Lengths, ids, headings and points, in the order of the fields.
    numbers: Vec<f64>,
}

/// What a reply says.
///
/// # Errors
/// If a part is missing.
pub(super) fn answer(reply: &Reply) -> anyhow::Result<Answer> {
    match reply {
        Reply::Path(path) => of_path(path),
        Reply::Motion(motion) => Ok(of_motion(motion)),
        Reply::Matrix(lengths) => Ok(of_matrix(lengths)),
        Reply::Json(body) => of_json(&serde_json::from_slice(body)?),
    }
}

fn of_path(reply: &v1::PlanPathResponse) -> anyhow::Result<Answer> {
    let path = reply.path.as_ref().context("no path over gRPC")?;
    let mut numbers = vec![path.grid_length_m, path.cost_m];
    for step in &path.route {
        numbers.extend([step.region as f64, above_zero(step.arc)]);
    }
    if !path.points.is_empty() {
        numbers.extend([path.path_length_m, path.clearance_min_m]);
    }
    numbers.extend(path.points.iter().flat_map(|point| [point.x_m, point.y_m]));
    Ok(Answer { codes: vec![code(reply.code)], numbers })
}

fn of_motion(reply: &v1::NextMotionResponse) -> Answer {
    let mut numbers = vec![
        reply.heading_rad.unwrap_or(NOTHING),
        reply.distance_left_m,
        above_zero(reply.region),
        above_zero(reply.next_arc),
    ];
    numbers.extend(reply.next_point.iter().flat_map(|point| [point.x_m, point.y_m]));
    Answer { codes: vec![code(reply.code)], numbers }
}

fn of_matrix(reply: &v1::PlanMatrixResponse) -> Answer {
    let codes = reply.start_codes.iter().chain(&reply.goal_codes);
    let lengths_m = reply.rows.iter().flat_map(|row| row.lengths_m.iter().copied());
    let entry = |length_m: f64| if 0.0 <= length_m { length_m } else { NOTHING };
    Answer { codes: codes.copied().map(code).collect(), numbers: lengths_m.map(entry).collect() }
}

fn of_json(body: &Value) -> anyhow::Result<Answer> {
    let mut numbers = Vec::new();
    if let Some(rows) = body["lengths_m"].as_array() {
        numbers.extend(rows.iter().flat_map(rows_of).map(number));
        let codes = ["start_codes", "goal_codes"].map(|name| rows_of(&body[name]));
        let codes = codes.into_iter().flatten().map(text).collect::<anyhow::Result<_>>()?;
        return Ok(Answer { codes, numbers });
    }
    if body.get("distance_left_m").is_some() {
        let fields = ["heading_rad", "distance_left_m", "region", "next_arc"];
        numbers.extend(fields.map(|name| number(&body[name])));
        if let Some(point) = body.get("next_point") {
            numbers.extend(coordinates(point));
        }
    } else {
        numbers.extend(["grid_length_m", "cost_m"].map(|name| number(&body[name])));
        for step in rows_of(&body["route"]) {
            numbers.extend(["region", "arc"].map(|name| number(&step[name])));
        }
        if body.get("points").is_some() {
            numbers.extend(["path_length_m", "clearance_min_m"].map(|name| number(&body[name])));
        }
        numbers.extend(rows_of(&body["points"]).iter().flat_map(coordinates));
    }
    Ok(Answer { codes: vec![text(&body["code"])?], numbers })
}

fn code(number: i32) -> String {
    let name = v1::PlanCode::try_from(number).unwrap_or_default().as_str_name();
    name.trim_start_matches("PLAN_CODE_").to_owned()
}

fn above_zero(id: u64) -> f64 {
    if id == 0 { NOTHING } else { id as f64 }
}

fn rows_of(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(NOTHING)
}

fn coordinates(point: &Value) -> [f64; 2] {
    [number(&point["x_m"]), number(&point["y_m"])]
}

fn text(value: &Value) -> anyhow::Result<String> {
    Ok(value.as_str().context("no code over REST")?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn json_reply(body: &Value) -> Reply {
        Reply::Json(body.to_string().into())
    }

    #[test]
    fn paths_are_compared_in_all_they_say() {
        let route = vec![v1::RouteStep { region: 3, arc: 0 }, v1::RouteStep { region: 4, arc: 9 }];
        let points = vec![v1::Point { x_m: 0.1, y_m: 2.0 }];
        let path = v1::PlannedPath {
            route,
            grid_length_m: 1.5,
            cost_m: 1.75,
            path_length_m: 1.25,
            clearance_min_m: 0.3,
            points,
            ..v1::PlannedPath::default()
        };
        let code = v1::PlanCode::Ok.into();
        let wire = v1::PlanPathResponse { code, path: Some(path), ..Default::default() };
        let wire = answer(&Reply::Path(Box::new(wire))).expect("a path");
        let mut body = json!({
            "code": "OK", "route": [{"region": 3}, {"region": 4, "arc": 9}],
            "grid_length_m": 1.5, "cost_m": 1.75, "path_length_m": 1.25, "clearance_min_m": 0.3,
            "points": [{"x_m": 0.1, "y_m": 2.0}],
        });
        assert_eq!(answer(&json_reply(&body)).ok(), Some(wire), "the same");
        let same = answer(&json_reply(&body)).expect("a path");
        body["route"][1]["arc"] = json!(8);
        assert_ne!(answer(&json_reply(&body)).ok(), Some(same), "by another arc");
    }

    #[test]
    fn motions_and_matrices_are_compared() {
        let motion = v1::NextMotionResponse {
            code: v1::PlanCode::Ok.into(),
            distance_left_m: 2.5,
            region: 7,
            next_point: Some(v1::Point { x_m: 1.0, y_m: 2.0 }),
            ..v1::NextMotionResponse::default()
        };
        let body = json!({
            "code": "OK", "distance_left_m": 2.5, "region": 7, "next_point": {"x_m": 1.0, "y_m": 2.0},
        });
        let same = answer(&Reply::Motion(motion)).ok();
        assert_eq!(answer(&json_reply(&body)).ok(), same, "a motion without heading or arc");
        let rows = vec![v1::MatrixRow { lengths_m: vec![1.5, -1.0] }];
        let codes = [1, 1, 6];
        let lengths = v1::PlanMatrixResponse {
            rows,
            start_codes: codes[..1].to_vec(),
            goal_codes: codes[1..].to_vec(),
            ..v1::PlanMatrixResponse::default()
        };
        let body = json!({
            "lengths_m": [[1.5, null]], "start_codes": ["OK"], "goal_codes": ["OK", "GOAL_UNKNOWN"],
        });
        assert_eq!(
            answer(&json_reply(&body)).ok(),
            answer(&Reply::Matrix(lengths)).ok(),
            "a matrix"
        );
    }
}
