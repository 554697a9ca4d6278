//! Questions for plans and their answers on the wire.

use std::time::Duration;

use meetpoint_geometry::Point2;
use meetpoint_proto::v1;

use super::pose::COORDINATE_MAX_M;
use crate::error::Error;
use crate::planning::{Choice, Field, Nowhere, Planned, Profile, RADIUS_MAX_M};

/// A finite point within [`COORDINATE_MAX_M`].
pub(crate) fn point(field: &str, wire: Option<v1::Point>) -> Result<Point2<f64>, Error> {
    let v1::Point { x_m, y_m } = wire.ok_or_else(|| Error::field(field, "missing"))?;
    if !(x_m.is_finite() && y_m.is_finite()) {
        return Err(Error::field(field, format!("({x_m}, {y_m}) m is not finite")));
    }
    let farthest_m = x_m.abs().max(y_m.abs());
    if COORDINATE_MAX_M < farthest_m {
        let problem =
            format!("{farthest_m:e} m from the origin, at most {COORDINATE_MAX_M} are taken");
        return Err(Error::field(field, problem));
    }
    Ok(Point2::new(x_m, y_m))
}

/// A point for the wire.
pub(crate) fn point_to_wire(point: Point2<f64>) -> v1::Point {
    v1::Point { x_m: point.x, y_m: point.y }
}

/// What a request says of the robot; the default profile if it says nothing.
pub(crate) fn choice(wire: Option<v1::RobotChoice>) -> Result<Choice, Error> {
    use v1::robot_choice::Kind;
    match wire.and_then(|v1::RobotChoice { kind }| kind) {
        None => Ok(Choice::Named(Profile::DEFAULT.to_owned())),
        Some(Kind::Profile(name)) => Ok(Choice::Named(name)),
        Some(Kind::RobotRadiusM(radius_m)) if (0.0..=RADIUS_MAX_M).contains(&radius_m) => {
            // -0 is 0, of other bits.
            Ok(Choice::Radius(radius_m.abs()))
        }
        Some(Kind::RobotRadiusM(radius_m)) => {
            let problem = format!("{radius_m} m, must be 0 to {RADIUS_MAX_M} m");
            Err(Error::field("robot_radius_m", problem))
        }
    }
}

/// A length that may be 0 for none.
pub(crate) fn length_m(field: &str, wire: f64) -> Result<f64, Error> {
    if (0.0..=COORDINATE_MAX_M).contains(&wire) {
        return Ok(wire);
    }
    Err(Error::field(field, format!("{wire} m, must be 0 to {COORDINATE_MAX_M} m")))
}

/// What an answer was computed from.
pub(crate) fn basis(field: &Field, by_tables: bool) -> v1::PlanBasis {
    let by = if by_tables { v1::AnsweredBy::Tables } else { v1::AnsweredBy::Search };
    v1::PlanBasis {
        map: field.ground.map.0.clone(),
        map_version: field.ground.version,
        cost_revision: field.costs.revision(),
        profile: field.profile.name.clone(),
        robot_radius_m: field.profile.radius_m,
        answered_by: by.into(),
        hypothesis: String::new(),
    }
}

/// Which end of a path is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    Start,
    Goal,
}

impl End {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Goal => "goal",
        }
    }
}

/// The code of an end that is nowhere.
pub(crate) fn code(end: End, why: Nowhere) -> v1::PlanCode {
    use v1::PlanCode as Code;
    match (end, why) {
        (_, Nowhere::Outside) => Code::OutsideMap,
        (End::Start, Nowhere::Occupied) => Code::StartOccupied,
        (End::Start, Nowhere::Unknown) => Code::StartUnknown,
        (End::Goal, Nowhere::Occupied) => Code::GoalOccupied,
        (End::Goal, Nowhere::Unknown) => Code::GoalUnknown,
    }
}

/// A path for the wire.
pub(crate) fn path_to_wire(field: &Field, planned: Planned) -> v1::PlannedPath {
    let Planned { route, grid_length_m, cost_m, dense, cells, loss_bound } = planned;
    let step = |&(region, arc): &(_, Option<usize>)| v1::RouteStep {
        region: field.ground.region_id(region),
        arc: arc.map_or(0, |place| field.ground.arc_id(place)),
    };
    let dense = dense.unwrap_or_default();
    v1::PlannedPath {
        route: route.iter().map(step).collect(),
        grid_length_m,
        path_length_m: dense.length_m,
        clearance_min_m: dense.clearance_min_m,
        points: dense.points.into_iter().map(point_to_wire).collect(),
        cells: cells.into_iter().map(point_to_wire).collect(),
        cost_m,
        loss_bound,
    }
}

/// Microseconds, at most what the wire holds.
pub(crate) fn micros(duration: Duration) -> i64 {
    i64::try_from(duration.as_micros()).unwrap_or(i64::MAX)
}
