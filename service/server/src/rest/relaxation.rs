//! What a relax job is asked, tells on the way, and finds, in JSON.

use meetpoint_proto::v1;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::scan_relaxation::{RelaxMethod, ScanRelaxation};

/// How a relax job is to be done. What a session carries decides by what it is relaxed: scans, else
/// sightings of landmarks. Of a session with both, scans and sightings of landmarks that have an identity
/// say together where the robot was, each as far as it is sure; the other landmarks are where it saw
/// them from there.
#[derive(Debug, Default, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RelaxParams {
    /// Only these sessions. Empty for all of the map that have a place in it and scans or sightings; but
    /// of sessions with a laser only the first: the others are tracked in the map that it draws, and
    /// follow it.
    sessions: Vec<String>,
    /// Takes landmarks of one type for all alike, whatever sightings call them.
    forget_identities: bool,
    /// Whether steady errors of the odometry are estimated from the data; true if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    estimate_odometry: Option<bool>,
    /// Whether sessions with a laser are relaxed by landmarks that the service finds itself: junctions,
    /// corners and dead ends of the grid about the robot, drawn of its last metres. Those that a
    /// detector saw count beside them.
    landmarks_from_grid: bool,
    /// Whether sessions with a laser go on from what the newest relaxation found: closures are looked for
    /// only where something is new, and only what is new is matched once more, at a small share of the
    /// cost.
    #[serde(default)]
    going_on: bool,
}

impl From<v1::RelaxParams> for RelaxParams {
    fn from(wire: v1::RelaxParams) -> Self {
        let v1::RelaxParams {
            sessions,
            forget_identities,
            estimate_odometry,
            landmarks_from_grid,
            going_on,
        } = wire;
        Self { sessions, forget_identities, estimate_odometry, landmarks_from_grid, going_on }
    }
}

impl From<RelaxParams> for v1::RelaxParams {
    fn from(params: RelaxParams) -> Self {
        let RelaxParams {
            sessions,
            forget_identities,
            estimate_odometry,
            landmarks_from_grid,
            going_on,
        } = params;
        Self { sessions, forget_identities, estimate_odometry, landmarks_from_grid, going_on }
    }
}

/// One step of a relaxation in numbers.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RelaxFigures {
    /// Id of the session.
    session: String,
    /// From 1 on within the session.
    iteration: u32,
    /// What was done, for people.
    stage: String,
    /// Of all that the session observed; comparable within a stage. Absent where a stage has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    log_likelihood: Option<f64>,
}

impl From<v1::RelaxFigures> for RelaxFigures {
    fn from(wire: v1::RelaxFigures) -> Self {
        let v1::RelaxFigures { session, iteration, stage, log_likelihood } = wire;
        Self { session, iteration, stage, log_likelihood }
    }
}

/// What came of a relax job.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RelaxResult {
    sessions: Vec<RelaxedSession>,
}

/// What came of one session.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RelaxedSession {
    /// Id of the session.
    session: String,
    /// Moments at which the pose was estimated.
    steps: u32,
    /// Sightings used, those that the service made itself among them.
    sightings: u32,
    /// Sightings without the direction or distance that their sensor's range asks for: not used.
    sightings_left_out: u32,
    landmarks: u32,
    /// Of all that the session observed; 0 of a session relaxed by scans.
    log_likelihood: f64,
    /// How probable it is that every sighting is of the landmark that it is taken for.
    #[schema(minimum = 0, maximum = 1, example = 0.99)]
    confidence: f64,
    /// How far sightings of one landmark lie from their mean by dead reckoning, root mean square, in
    /// metres.
    spread_before_m: f64,
    /// The same by what was found.
    spread_after_m: f64,
    /// How far the pose was moved that was moved farthest, in metres.
    correction_max_m: f64,
    /// Absent of a session without odometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    calibration: Option<OdometryCalibration>,
    /// Other readings of the same data, best first; empty if all is clear.
    alternatives: Vec<RelaxAlternative>,
    method: RelaxMethod,
    /// What its scans say; absent if it was not relaxed by them.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    scans: Option<ScanRelaxation>,
    /// Sightings that the service made itself, of junctions, corners and dead ends of the grid.
    grid_sightings: u32,
    /// Ids of other sessions that were relaxed together with this one.
    together_with: Vec<String>,
}

/// What undoes the steady errors of a robot's odometry.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct OdometryCalibration {
    /// True metres for a measured metre.
    scale: f64,
    /// Radians to be added for every metre driven.
    turn_per_m: f64,
    /// Radians to be added for every radian turned.
    turn_per_rad: f64,
}

/// Another reading of what was seen.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RelaxAlternative {
    /// Logarithm of how much less probable it is than the reading that was taken: 0 or less.
    log_odds: f64,
    /// What would tell them apart, for people.
    decided_by: String,
}

impl From<v1::RelaxResult> for RelaxResult {
    fn from(wire: v1::RelaxResult) -> Self {
        let v1::RelaxResult { sessions } = wire;
        Self { sessions: sessions.into_iter().map(RelaxedSession::from).collect() }
    }
}

impl From<v1::RelaxedSession> for RelaxedSession {
    fn from(wire: v1::RelaxedSession) -> Self {
        let v1::RelaxedSession {
            session,
            steps,
            sightings,
            sightings_left_out,
            landmarks,
            log_likelihood,
            confidence,
            spread_before_m,
            spread_after_m,
            correction_max_m,
            calibration,
            alternatives,
            method,
            scans,
            grid_sightings,
            together_with,
        } = wire;
        Self {
            session,
            steps,
            sightings,
            sightings_left_out,
            landmarks,
            log_likelihood,
            confidence,
            spread_before_m,
            spread_after_m,
            correction_max_m,
            calibration: calibration.map(OdometryCalibration::from),
            alternatives: alternatives.into_iter().map(RelaxAlternative::from).collect(),
            method: v1::RelaxMethod::try_from(method).unwrap_or_default().into(),
            scans: scans.map(ScanRelaxation::from),
            grid_sightings,
            together_with,
        }
    }
}

impl From<v1::OdometryCalibration> for OdometryCalibration {
    fn from(wire: v1::OdometryCalibration) -> Self {
        let v1::OdometryCalibration { scale, turn_per_m, turn_per_rad } = wire;
        Self { scale, turn_per_m, turn_per_rad }
    }
}

impl From<v1::RelaxAlternative> for RelaxAlternative {
    fn from(wire: v1::RelaxAlternative) -> Self {
        let v1::RelaxAlternative { log_odds, decided_by } = wire;
        Self { log_odds, decided_by }
    }
}
