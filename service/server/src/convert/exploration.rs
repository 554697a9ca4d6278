//! Exploration on the wire.

use meetpoint_geometry::{Point2, Pose};
use meetpoint_planning::{Errand, Frontier, Way};
use meetpoint_proto::v1;

use super::plan::{point, point_to_wire};
use super::pose::to_wire as pose_to_wire;
use crate::error::Error;

/// Robots that are asked about at once: each costs a settling of the values.
pub(crate) const N_EXPLORERS_MAX: usize = 32;
/// Frontiers of a reply.
const N_FRONTIERS_MAX: usize = 256;

/// Somebody who is asked about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Asked {
    /// A robot, by id.
    Robot(String),
    /// Somebody there.
    Position(Point2<f64>),
}

/// Who is asked about; nobody for all.
///
/// # Errors
/// [`Error::InvalidField`] for too many, or none.
pub(crate) fn asked(explorers: Vec<v1::Explorer>) -> Result<Vec<Asked>, Error> {
    use v1::explorer::Kind;
    let n = explorers.len();
    if N_EXPLORERS_MAX < n {
        let problem = format!("{n}, at most {N_EXPLORERS_MAX} are taken");
        return Err(Error::field("explorers", problem));
    }
    let asked = |(at, v1::Explorer { kind }): (usize, v1::Explorer)| match kind {
        Some(Kind::Robot(robot)) => Ok(Asked::Robot(robot)),
        Some(Kind::Position(wire)) => {
            Ok(Asked::Position(point(&format!("explorers[{at}].position"), Some(wire))?))
        }
        None => Err(Error::field(format!("explorers[{at}]"), "neither a robot nor a position")),
    };
    explorers.into_iter().enumerate().map(asked).collect()
}

/// Somebody who explores, and where.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Explorer {
    pub(crate) robot: String,
    pub(crate) session: String,
    /// In the frame that is explored, the map's mostly; `None` if nobody knows.
    pub(crate) map_from_robot: Option<Pose>,
    /// The session in whose frame it is known to map, where that is another; empty for the map's.
    pub(crate) elsewhere: Option<String>,
    /// By the robot's clock.
    pub(crate) stamp_ns: i64,
}

/// What a robot is to do; no errand for one that has no place in the frame that is explored.
pub(crate) fn robot_to_wire(explorer: Explorer, errand: Option<Errand>) -> v1::RobotExploration {
    use v1::ExplorationCode as Code;
    let Explorer { robot, session, map_from_robot, elsewhere: frame_session, stamp_ns } = explorer;
    let pose = map_from_robot.map(pose_to_wire);
    let bare = v1::RobotExploration {
        robot,
        session,
        pose,
        stamp_ns,
        frame_session,
        ..Default::default()
    };
    let (code, way) = match errand {
        None => (Code::NotPlaced, None),
        Some(Errand::Go(way)) => (Code::Ok, Some(way)),
        Some(Errand::Explored) => (Code::Explored, None),
        Some(Errand::LeftToOthers) => (Code::LeftToOthers, None),
        Some(Errand::Occupied) => (Code::StartOccupied, None),
        Some(Errand::Outside) => (Code::OutsideMap, None),
    };
    let coded = v1::RobotExploration { code: code.into(), ..bare };
    let Some(Way { goal, points, length_m, heading_rad, cost: _, moved_m: _ }) = way else {
        return coded;
    };
    v1::RobotExploration {
        goal: Some(point_to_wire(goal)),
        heading_rad,
        distance_m: length_m,
        points: points.into_iter().map(point_to_wire).collect(),
        ..coded
    }
}

/// The longest frontiers, the longest first.
pub(crate) fn frontiers_to_wire(mut frontiers: Vec<Frontier>) -> Vec<v1::Frontier> {
    frontiers.sort_by(|a, b| b.length_m.total_cmp(&a.length_m));
    frontiers.truncate(N_FRONTIERS_MAX);
    let to_wire =
        |Frontier { point, length_m }| v1::Frontier { point: Some(point_to_wire(point)), length_m };
    frontiers.into_iter().map(to_wire).collect()
}
