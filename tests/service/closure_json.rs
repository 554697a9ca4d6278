//! Closures and relaxations by scans: REST's JSON as messages.

use meetpoint_client::v1;
use serde_json::Value;

use crate::from_json::{point, present, real, rows, signed, small, text, truth, unsigned};

pub(crate) fn scan_relaxation(body: &Value) -> v1::ScanRelaxation {
    let sharpness = |of: &Value| v1::GridSharpness {
        cells: unsigned(&of["cells"]),
        entropy_bits: real(&of["entropy_bits"]),
        entropy_mean_bits: real(&of["entropy_mean_bits"]),
    };
    v1::ScanRelaxation {
        scans: small(&body["scans"]),
        closures_accepted: small(&body["closures_accepted"]),
        closures_refused: small(&body["closures_refused"]),
        chi2_before: real(&body["chi2_before"]),
        chi2_after: real(&body["chi2_after"]),
        before: present(body, "before").map(sharpness),
        after: present(body, "after").map(sharpness),
        sightings_in_graph: small(&body["sightings_in_graph"]),
        sightings_fitted_only: small(&body["sightings_fitted_only"]),
        sightings_doubted: small(&body["sightings_doubted"]),
        lasers_moved: present(body, "lasers_moved").map(pose),
    }
}

fn pose(body: &Value) -> v1::Pose {
    let theta_rad = real(&body["theta_rad"]);
    v1::Pose { x_m: real(&body["x_m"]), y_m: real(&body["y_m"]), theta_rad }
}

pub(crate) fn closure(body: &Value) -> v1::Closure {
    let alternative = |other: &Value| v1::ClosureAlternative {
        from_to: Some(pose(&other["from_to"])),
        score: real(&other["score"]),
    };
    v1::Closure {
        id: text(&body["id"]),
        map: text(&body["map"]),
        from_session: text(&body["from_session"]),
        from_time_ns: signed(&body["from_time_ns"]),
        to_session: text(&body["to_session"]),
        to_time_ns: signed(&body["to_time_ns"]),
        from_to: Some(pose(&body["from_to"])),
        covariance: rows(&body["covariance"], real),
        score: real(&body["score"]),
        residual_m: real(&body["residual_m"]),
        residual_rad: real(&body["residual_rad"]),
        chi2: real(&body["chi2"]),
        verdict: match text(&body["verdict"]).as_str() {
            "ACCEPTED" => v1::ClosureVerdict::Accepted.into(),
            "REFUSED" => v1::ClosureVerdict::Refused.into(),
            other => panic!("`{other}` is no verdict"),
        },
        refusal: present(body, "refusal").map_or(0, refusal),
        alternatives: rows(&body["alternatives"], alternative),
        from_position: present(body, "from_position").map(point),
        to_position: present(body, "to_position").map(point),
        job: text(&body["job"]),
        switched_off: truth(&body["switched_off"]),
        relax_needed: truth(&body["relax_needed"]),
    }
}

fn refusal(name: &Value) -> i32 {
    let refusal = match text(name).as_str() {
        "SWITCHED_OFF" => v1::ClosureRefusal::SwitchedOff,
        "AMBIGUOUS" => v1::ClosureRefusal::Ambiguous,
        "FEW_SCANS_AGREE" => v1::ClosureRefusal::FewScansAgree,
        "CONTRADICTED" => v1::ClosureRefusal::Contradicted,
        "UNSUPPORTED" => v1::ClosureRefusal::Unsupported,
        "INCONSISTENT" => v1::ClosureRefusal::Inconsistent,
        other => panic!("`{other}` is no reason"),
    };
    refusal.into()
}
