//! The OpenAPI 3.1 document: what every operation has in common.

use std::collections::BTreeMap;

use utoipa::openapi::content::ContentBuilder;
use utoipa::openapi::response::{Response, ResponseBuilder};
use utoipa::openapi::{Ref, RefOr};
use utoipa::{IntoResponses, OpenApi};

use super::costs::CostsChanged;
use super::events::{Lagged, PoseCorrection, SessionCorrection};
use super::problem::{PROBLEM_JSON, Problem};

/// What the document begins with.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "Meetpoint",
        description = "A mapping service for indoor robot fleets. Robots stream what they sense, over \
            gRPC on the same port or in batches here; Meetpoint keeps one consistent map per level of \
            a site.\n\n\
            Metres, radians, nanoseconds; x forward, y left, counter-clockwise (REP 103). 64-bit \
            integers are numbers below 2^53 and strings of digits above; both are taken. Unknown \
            fields are refused. What is absent is left out. Lists are paged by `page_size` and \
            `page_token`. Errors are RFC 9457 problem documents with a stable `code`; every answer \
            has an `x-request-id`.",
        license(name = "Apache-2.0", identifier = "Apache-2.0"),
    ),
    tags(
        (name = "maps", description = "Maps and their versions."),
        (name = "grids", description = "Occupancy of a map version: numbers, images, tiles."),
        (name = "graphs", description = "Regions of a map version, and how they hang together."),
        (name = "plans", description = "Ways through a map version: paths, lengths, next motions."),
        (name = "costs", description = "What is closed, dear or drawn on top of a map, and for which robots it is planned."),
        (name = "landmarks", description = "What robots told apart on a map version."),
        (name = "closures", description = "What relax jobs took for the same place, and what people decide about it."),
        (name = "merges", description = "Where sessions of unknown start lie, and what is decided about it."),
        (name = "hypotheses", description = "Maps of places that fit a travel, and what people decide about them."),
        (name = "qualitative", description = "Robots that explore as they are told, step by step, and the places that they find."),
        (name = "robots", description = "Machines that send."),
        (name = "sessions", description = "Unbroken runs of robots on maps, their batches and trajectories."),
        (name = "jobs", description = "Work in the background."),
        (name = "events", description = "What happens now."),
        (name = "operation", description = "For those who run the service."),
    ),
    components(schemas(Problem, CostsChanged, SessionCorrection, PoseCorrection, Lagged))
)]
pub(super) struct Document;

/// What a list may answer instead.
pub(super) struct ListProblems;
/// What reading a resource may answer instead.
pub(super) struct ReadProblems;
/// What a grid may answer instead.
pub(super) struct GridProblems;
/// What is drawn in a session's frame may answer instead.
pub(super) struct SessionGridProblems;
/// What an exploration by small steps may answer instead.
pub(super) struct QualitativeProblems;
/// What a question in a body may answer instead.
pub(super) struct PlanProblems;
/// What changing a resource may answer instead.
pub(super) struct ChangeProblems;
/// What making a resource may answer instead.
pub(super) struct CreationProblems;
/// What the check of readiness may answer instead.
pub(super) struct NotReadyProblem;

impl IntoResponses for ListProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 500, 503])
    }
}

impl IntoResponses for ReadProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 500, 503])
    }
}

impl IntoResponses for GridProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 413, 500, 503])
    }
}

impl IntoResponses for QualitativeProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 409, 500, 503])
    }
}

impl IntoResponses for SessionGridProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 409, 413, 500, 503])
    }
}

impl IntoResponses for PlanProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 413, 415, 500, 503])
    }
}

impl IntoResponses for ChangeProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 409, 413, 415, 500, 503, 507])
    }
}

impl IntoResponses for CreationProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[400, 404, 409, 413, 415, 422, 500, 503, 507])
    }
}

impl IntoResponses for NotReadyProblem {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        problems(&[503])
    }
}

fn problems(statuses: &[u16]) -> BTreeMap<String, RefOr<Response>> {
    let response = |status| {
        let problem = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
        let described = ResponseBuilder::new().description(meaning(status));
        described.content(PROBLEM_JSON, problem).build()
    };
    statuses.iter().map(|&status| (status.to_string(), response(status).into())).collect()
}

/// What a status tells a caller.
fn meaning(status: u16) -> &'static str {
    match status {
        400 => "The request is malformed, or a field holds what it must not.",
        404 => "It is not there.",
        409 => {
            "It is there already, is not in the state for this, or something is missing before it."
        }
        413 => "More was sent or asked for than is taken or given at once.",
        415 => {
            "The body is not declared as what is taken: `application/json`, or a form for files."
        }
        422 => "The Idempotency-Key was used for another request.",
        500 => "Not the caller's fault; the log knows more.",
        503 => "Busy or stopping: try again after `Retry-After` seconds.",
        507 => "The disk is full: an operator has to make room.",
        _ => "Refused.",
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::path::Path;

    use serde_json::Value;

    use super::super::openapi;

    fn document() -> Value {
        serde_json::to_value(openapi()).expect("a document")
    }

    fn operations(document: &Value) -> Vec<(String, Value)> {
        let paths = document["paths"].as_object().expect("paths");
        let of_path = |(path, item): (&String, &Value)| {
            let methods = item.as_object().expect("methods").clone();
            let path = path.clone();
            methods
                .into_iter()
                .map(move |(method, operation)| (format!("{method} {path}"), operation))
        };
        paths.iter().flat_map(of_path).collect()
    }

    #[test]
    fn the_snapshot_is_current() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../clients/openapi.json");
        let mut current = openapi().to_pretty_json().expect("a document");
        current.push('\n');
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            std::fs::write(&path, &current).expect("a writable snapshot");
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(kept == current, "clients/openapi.json is old: run this test with UPDATE_EXPECT=1");
    }

    #[test]
    fn every_operation_is_described() {
        let document = document();
        assert_eq!(document["openapi"], "3.1.0", "the version that clients are made for");
        let mut ids = HashSet::new();
        for (name, operation) in operations(&document) {
            let id = operation["operationId"].as_str().unwrap_or_default().to_owned();
            assert!(ids.insert(id), "{name}: operationId is unique");
            assert!(operation["summary"].is_string(), "{name}: has a summary");
            assert_eq!(operation["tags"].as_array().map(Vec::len), Some(1), "{name}: has a tag");
            for (status, response) in operation["responses"].as_object().expect("responses") {
                let described = response["description"].as_str().unwrap_or_default();
                assert!(!described.is_empty(), "{name}: {status} is described");
                let is_error = status.starts_with(['4', '5']);
                let problem = &response["content"]["application/problem+json"]["schema"]["$ref"];
                assert!(
                    !is_error || problem == "#/components/schemas/Problem",
                    "{name}: {status} is a problem document"
                );
            }
            for parameter in operation["parameters"].as_array().into_iter().flatten() {
                let described = parameter["description"].as_str().unwrap_or_default();
                assert!(!described.is_empty(), "{name}: {} is described", parameter["name"]);
            }
        }
    }
}
