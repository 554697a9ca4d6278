//! Merges: REST's JSON as messages, and the other way about.

use meetpoint_client::v1;
use serde_json::{Value, json};

use crate::from_json::{pose, present, real, rows, signed, small, text, truth, unsigned};

pub(crate) fn params(params: &v1::MergeParams) -> Value {
    let v1::MergeParams { sessions, draw_only, found_map } = params;
    json!({"sessions": sessions, "draw_only": draw_only, "found_map": found_map})
}

pub(crate) fn asked(body: &Value) -> v1::MergeParams {
    v1::MergeParams {
        sessions: rows(&body["sessions"], text),
        draw_only: truth(&body["draw_only"]),
        found_map: truth(&body["found_map"]),
    }
}

pub(crate) fn result(body: &Value) -> v1::job::Result {
    let session = |session: &Value| v1::MergedSession {
        session: text(&session["session"]),
        merge: text(&session["merge"]),
        verdict: verdict(&session["verdict"]),
        accepted: truth(&session["accepted"]),
    };
    let sessions = rows(&body["sessions"], session);
    v1::job::Result::MergeResult(v1::MergeResult { sessions })
}

fn verdict(name: &Value) -> i32 {
    let verdict = match text(name).as_str() {
        "MERGED" => v1::MergeVerdict::Merged,
        "PROPOSED" => v1::MergeVerdict::Proposed,
        "AMBIGUOUS" => v1::MergeVerdict::Ambiguous,
        "NO_OVERLAP" => v1::MergeVerdict::NoOverlap,
        "NOT_ENOUGH_SEEN" => v1::MergeVerdict::NotEnoughSeen,
        other => panic!("`{other}` is no verdict"),
    };
    verdict.into()
}

/// As REST names a state in a query; empty for all.
pub(crate) fn state_name(state: v1::MergeState) -> &'static str {
    match state {
        v1::MergeState::Unspecified => "",
        v1::MergeState::Open => "&state=OPEN",
        v1::MergeState::Accepted => "&state=ACCEPTED",
        v1::MergeState::Rejected => "&state=REJECTED",
        v1::MergeState::Undone => "&state=UNDONE",
    }
}

pub(crate) fn merge(body: &Value) -> v1::Merge {
    let state = match text(&body["state"]).as_str() {
        "OPEN" => v1::MergeState::Open,
        "ACCEPTED" => v1::MergeState::Accepted,
        "REJECTED" => v1::MergeState::Rejected,
        "UNDONE" => v1::MergeState::Undone,
        other => panic!("`{other}` is no state of a merge"),
    };
    v1::Merge {
        id: text(&body["id"]),
        map: text(&body["map"]),
        session: text(&body["session"]),
        verdict: verdict(&body["verdict"]),
        reasons: rows(&body["reasons"], text),
        alignments: rows(&body["alignments"], alignment),
        state: state.into(),
        decision: present(body, "decision").map(|decision| v1::MergeDecision {
            alignment: present(decision, "alignment").map(text).unwrap_or_default(),
            by_rule: truth(&decision["by_rule"]),
            author: text(&decision["author"]),
            reason: text(&decision["reason"]),
            time_ns: signed(&decision["time_ns"]),
        }),
        job: text(&body["job"]),
        map_version: unsigned(&body["map_version"]),
        update_time_ns: signed(&body["update_time_ns"]),
    }
}

fn alignment(body: &Value) -> v1::MergeAlignment {
    v1::MergeAlignment {
        id: text(&body["id"]),
        onto_session: present(body, "onto_session").map(text).unwrap_or_default(),
        onto_from_session: Some(pose(&body["onto_from_session"])),
        covariance: rows(&body["covariance"], real),
        score: real(&body["score"]),
        overlap_m2: real(&body["overlap_m2"]),
        overlap_share: real(&body["overlap_share"]),
        agreement: real(&body["agreement"]),
        contradiction: real(&body["contradiction"]),
        margin: present(body, "margin").map(real),
        landmarks_matched: small(&body["landmarks_matched"]),
        landmarks_contradicted: small(&body["landmarks_contradicted"]),
    }
}

/// A merge after a decision, and the job that follows.
pub(crate) fn decided(body: &Value) -> (v1::Merge, String) {
    (merge(&body["merge"]), present(body, "job").map(text).unwrap_or_default())
}

pub(crate) fn whereabouts(body: &Value) -> v1::Whereabouts {
    let peak = |peak: &Value| v1::Peak {
        map_from_robot: Some(pose(&peak["map_from_robot"])),
        probability: real(&peak["probability"]),
        around: real(&peak["around"]),
    };
    v1::Whereabouts {
        session: text(&body["session"]),
        map: text(&body["map"]),
        map_version: unsigned(&body["map_version"]),
        landmarks: small(&body["landmarks"]),
        step: small(&body["step"]),
        steps: small(&body["steps"]),
        sightings: small(&body["sightings"]),
        peaks: rows(&body["peaks"], peak),
        elsewhere: real(&body["elsewhere"]),
        entropy_nats: real(&body["entropy_nats"]),
    }
}
