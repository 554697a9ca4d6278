//! What is asked, as both doors say it.

use meetpoint_client::v1;
use serde_json::{Value, json};

/// The shapes of question that are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Route and lengths of a path.
    Route,
    /// The dense path too.
    DensePath,
    /// Which way to go now.
    NextMotion,
    /// Lengths from each of a hundred points to each of a hundred others.
    Matrix,
}

impl Shape {
    /// Those that are about one pair of points.
    pub(super) const OF_PAIRS: [Self; 3] = [Self::Route, Self::DensePath, Self::NextMotion];

    /// For the table.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Route => "route only",
            Self::DensePath => "dense path",
            Self::NextMotion => "next motion",
            Self::Matrix => "matrix, 100 by 100",
        }
    }

    /// The question about a pair of points; a matrix of one entry.
    pub(super) fn of_pair(self, map: &str, [start, goal]: [v1::Point; 2]) -> Question {
        match self {
            Self::Route | Self::DensePath => Question::Path(v1::PlanPathRequest {
                map: map.to_owned(),
                start: Some(start),
                goal: Some(goal),
                route_only: self == Self::Route,
                ..v1::PlanPathRequest::default()
            }),
            Self::NextMotion => Question::Motion(v1::NextMotionRequest {
                map: map.to_owned(),
                position: Some(start),
                goal: Some(goal),
                ..v1::NextMotionRequest::default()
            }),
            Self::Matrix => matrix(map, vec![start], vec![goal]),
        }
    }
}

/// A question for lengths.
pub(super) fn matrix(map: &str, starts: Vec<v1::Point>, goals: Vec<v1::Point>) -> Question {
    let map = map.to_owned();
    Question::Matrix(v1::PlanMatrixRequest { map, starts, goals, ..Default::default() })
}

/// A question, ready to be asked.
#[derive(Clone, Debug)]
pub(super) enum Question {
    Path(v1::PlanPathRequest),
    Motion(v1::NextMotionRequest),
    Matrix(v1::PlanMatrixRequest),
}

/// A question as REST takes it.
#[derive(Debug, PartialEq)]
pub(super) struct RestQuestion {
    /// Path and query.
    pub(super) target: String,
    /// The body of a POST; `None` for a GET.
    pub(super) body: Option<Value>,
}

impl Question {
    /// The same in JSON.
    pub(super) fn to_rest(&self) -> RestQuestion {
        match self {
            Self::Path(request) => {
                let v1::PlanPathRequest { map, start, goal, route_only, .. } = request;
                let [start, goal] = [start, goal].map(|end| point_json(&end.unwrap_or_default()));
                let body = json!({"start": start, "goal": goal, "route_only": route_only});
                RestQuestion { target: format!("/v1/maps/{map}/paths"), body: Some(body) }
            }
            Self::Motion(request) => {
                let v1::NextMotionRequest { map, position, goal, .. } = request;
                let [from, to] = [position, goal].map(|end| end.unwrap_or_default());
                let target = format!(
                    "/v1/maps/{map}/next-motion?x_m={}&y_m={}&goal_x_m={}&goal_y_m={}",
                    from.x_m, from.y_m, to.x_m, to.y_m
                );
                RestQuestion { target, body: None }
            }
            Self::Matrix(request) => {
                let v1::PlanMatrixRequest { map, starts, goals, .. } = request;
                let [starts, goals] = [starts, goals].map(|ends| points_json(ends));
                let body = json!({"starts": starts, "goals": goals});
                RestQuestion { target: format!("/v1/maps/{map}/matrix"), body: Some(body) }
            }
        }
    }
}

fn point_json(point: &v1::Point) -> Value {
    json!({"x_m": point.x_m, "y_m": point.y_m})
}

fn points_json(points: &[v1::Point]) -> Value {
    points.iter().map(point_json).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_is_asked_the_same() {
        let pair = [v1::Point { x_m: 1.5, y_m: -2.0 }, v1::Point { x_m: 0.0, y_m: 3.25 }];
        let route = Shape::Route.of_pair("lab", pair).to_rest();
        let body = json!({"start": {"x_m": 1.5, "y_m": -2.0}, "goal": {"x_m": 0.0, "y_m": 3.25}, "route_only": true});
        assert_eq!(
            route,
            RestQuestion { target: "/v1/maps/lab/paths".into(), body: Some(body) },
            "a route"
        );
        let motion = Shape::NextMotion.of_pair("lab", pair).to_rest();
        let target = "/v1/maps/lab/next-motion?x_m=1.5&y_m=-2&goal_x_m=0&goal_y_m=3.25";
        assert_eq!(motion, RestQuestion { target: target.into(), body: None }, "a motion");
        let lengths = Shape::Matrix.of_pair("lab", pair).to_rest();
        let body =
            json!({"starts": [{"x_m": 1.5, "y_m": -2.0}], "goals": [{"x_m": 0.0, "y_m": 3.25}]});
        assert_eq!(
            lengths,
            RestQuestion { target: "/v1/maps/lab/matrix".into(), body: Some(body) },
            "a matrix"
        );
    }
}
