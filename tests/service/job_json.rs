//! Jobs and what they find: REST's JSON as messages, and the other way about.

use meetpoint_client::v1;
use serde_json::{Value, json};
use v1::create_job_request::Params;
use v1::job_log_line::Figures;

use crate::closure_json;
use crate::from_json::{point, present, real, rows, signed, small, text, truth, unsigned};
use crate::merge_json;

/// The body that asks for a job.
pub(crate) fn new_job(request: &v1::CreateJobRequest) -> Value {
    let v1::CreateJobRequest { map, kind, priority, params } = request;
    let kind = match v1::JobKind::try_from(*kind) {
        Ok(v1::JobKind::Rebuild) => "REBUILD",
        Ok(v1::JobKind::Relax) => "RELAX",
        Ok(v1::JobKind::Merge) => "MERGE",
        Ok(v1::JobKind::Unspecified) | Err(_) => "UNSPECIFIED",
    };
    let mut body = json!({"map": map, "kind": kind, "priority": priority});
    match params {
        Some(Params::Relax(params)) => body["relax"] = relax_params(params),
        Some(Params::Merge(params)) => body["merge"] = merge_json::params(params),
        None => {}
    }
    body
}

fn relax_params(params: &v1::RelaxParams) -> Value {
    let v1::RelaxParams {
        sessions,
        forget_identities,
        estimate_odometry,
        landmarks_from_grid,
        going_on,
    } = params;
    let mut body = json!({
        "sessions": sessions,
        "forget_identities": forget_identities,
        "landmarks_from_grid": landmarks_from_grid,
        "going_on": going_on,
    });
    if let Some(estimate_odometry) = estimate_odometry {
        body["estimate_odometry"] = json!(estimate_odometry);
    }
    body
}

pub(crate) fn job(body: &Value) -> v1::Job {
    let state = match text(&body["state"]).as_str() {
        "QUEUED" => v1::JobState::Queued,
        "RUNNING" => v1::JobState::Running,
        "SUCCEEDED" => v1::JobState::Succeeded,
        "FAILED" => v1::JobState::Failed,
        "CANCELLED" => v1::JobState::Cancelled,
        other => panic!("`{other}` is no state of a job"),
    };
    let kind = match text(&body["kind"]).as_str() {
        "REBUILD" => v1::JobKind::Rebuild,
        "RELAX" => v1::JobKind::Relax,
        "MERGE" => v1::JobKind::Merge,
        other => panic!("`{other}` is no kind of job"),
    };
    let line = |line: &Value| v1::JobLogLine {
        time_ns: signed(&line["time_ns"]),
        text: text(&line["text"]),
        figures: present(line, "relax").map(|figures| Figures::Relax(relax_figures(figures))),
    };
    v1::Job {
        id: text(&body["id"]),
        map: text(&body["map"]),
        kind: kind.into(),
        state: state.into(),
        progress: real(&body["progress"]),
        log: rows(&body["log"], line),
        done: truth(&body["done"]),
        result_version: unsigned(&body["result_version"]),
        error: present(body, "error").map(|error| v1::JobError {
            code: text(&error["code"]),
            message: text(&error["message"]),
        }),
        create_time_ns: signed(&body["create_time_ns"]),
        update_time_ns: signed(&body["update_time_ns"]),
        estimated_end_time_ns: present(body, "estimated_end_time_ns").map(signed),
        cancel_requested: truth(&body["cancel_requested"]),
        priority: i32::try_from(signed(&body["priority"])).expect("a small number"),
        params: present(body, "relax").map(|params| v1::job::Params::Relax(asked(params))).or_else(
            || present(body, "merge").map(|it| v1::job::Params::Merge(merge_json::asked(it))),
        ),
        result: present(body, "relax_result")
            .map(|result| {
                let sessions = rows(&result["sessions"], relaxed_session);
                v1::job::Result::RelaxResult(v1::RelaxResult { sessions })
            })
            .or_else(|| present(body, "merge_result").map(merge_json::result)),
    }
}

fn asked(body: &Value) -> v1::RelaxParams {
    v1::RelaxParams {
        sessions: rows(&body["sessions"], text),
        forget_identities: truth(&body["forget_identities"]),
        estimate_odometry: present(body, "estimate_odometry").map(truth),
        landmarks_from_grid: truth(&body["landmarks_from_grid"]),
        going_on: truth(&body["going_on"]),
    }
}

fn relax_figures(body: &Value) -> v1::RelaxFigures {
    v1::RelaxFigures {
        session: text(&body["session"]),
        iteration: small(&body["iteration"]),
        stage: text(&body["stage"]),
        log_likelihood: present(body, "log_likelihood").map(real),
    }
}

fn relaxed_session(body: &Value) -> v1::RelaxedSession {
    let calibration = |odometry: &Value| v1::OdometryCalibration {
        scale: real(&odometry["scale"]),
        turn_per_m: real(&odometry["turn_per_m"]),
        turn_per_rad: real(&odometry["turn_per_rad"]),
    };
    let alternative = |other: &Value| v1::RelaxAlternative {
        log_odds: real(&other["log_odds"]),
        decided_by: text(&other["decided_by"]),
    };
    v1::RelaxedSession {
        session: text(&body["session"]),
        steps: small(&body["steps"]),
        sightings: small(&body["sightings"]),
        sightings_left_out: small(&body["sightings_left_out"]),
        landmarks: small(&body["landmarks"]),
        log_likelihood: real(&body["log_likelihood"]),
        confidence: real(&body["confidence"]),
        spread_before_m: real(&body["spread_before_m"]),
        spread_after_m: real(&body["spread_after_m"]),
        correction_max_m: real(&body["correction_max_m"]),
        calibration: present(body, "calibration").map(calibration),
        alternatives: rows(&body["alternatives"], alternative),
        method: match text(&body["method"]).as_str() {
            "LANDMARKS" => v1::RelaxMethod::Landmarks.into(),
            "SCANS" => v1::RelaxMethod::Scans.into(),
            other => panic!("`{other}` is no method"),
        },
        scans: present(body, "scans").map(closure_json::scan_relaxation),
        grid_sightings: small(&body["grid_sightings"]),
        together_with: rows(&body["together_with"], text),
    }
}

pub(crate) fn landmark(body: &Value) -> v1::Landmark {
    let covariance = &body["covariance"];
    v1::Landmark {
        id: text(&body["id"]),
        landmark_type: text(&body["type"]),
        identity: present(body, "identity").map(text),
        position: Some(point(body)),
        covariance: Some(v1::Covariance {
            xx_m2: real(&covariance["xx_m2"]),
            xy_m2: real(&covariance["xy_m2"]),
            yy_m2: real(&covariance["yy_m2"]),
        }),
        sightings: small(&body["sightings"]),
        confidence: real(&body["confidence"]),
        session: text(&body["session"]),
        source: match text(&body["source"]).as_str() {
            "DETECTOR" => v1::LandmarkSource::Detector.into(),
            "GRID" => v1::LandmarkSource::Grid.into(),
            other => panic!("`{other}` tells no landmarks apart"),
        },
    }
}
