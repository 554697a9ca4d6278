//! What operators look at: health, reflection, metrics, documents, and the shape of errors.

use meetpoint_client::v1;
use serde_json::{Value, json};
use tokio_stream::StreamExt;
use tonic_health::pb::health_client::HealthClient;
use tonic_health::pb::{HealthCheckRequest, health_check_response::ServingStatus};
use tonic_reflection::pb::v1::server_reflection_client::ServerReflectionClient;
use tonic_reflection::pb::v1::server_reflection_request::MessageRequest;
use tonic_reflection::pb::v1::server_reflection_response::MessageResponse;
use tonic_reflection::pb::v1::{ListServiceResponse, ServerReflectionRequest};

use crate::door::{Door, Refused, finished, refused};
use crate::drive::{SimulatedDrive, driven};
use crate::http::{Http, Reply};
use crate::running::{Launch, empty_folder};

/// The services of the protocol.
const SERVICES: [&str; 5] = [
    "meetpoint.v1.MapService",
    "meetpoint.v1.RobotService",
    "meetpoint.v1.SessionService",
    "meetpoint.v1.GridService",
    "meetpoint.v1.JobService",
];

#[tokio::test(flavor = "multi_thread")]
async fn health_and_reflection() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let mut health = HealthClient::new(service.channel());
    for name in SERVICES.into_iter().chain([""]) {
        let request = HealthCheckRequest { service: name.to_owned() };
        let reply = health.check(request).await.expect("it is known").into_inner();
        assert_eq!(reply.status, i32::from(ServingStatus::Serving), "{name}");
    }
    let unknown = HealthCheckRequest { service: "meetpoint.v1.TeaService".to_owned() };
    let unknown = health.check(unknown).await.expect_err("there is none");
    assert_eq!(unknown.code(), tonic::Code::NotFound, "{unknown}");
    let http = service.http();
    for path in ["/healthz", "/readyz"] {
        let reply = http.get(path);
        assert_eq!((reply.status, reply.json()), (200, json!({"status": "ok"})), "{path}");
    }

    let message_request = Some(MessageRequest::ListServices(String::new()));
    let list = ServerReflectionRequest { host: String::new(), message_request };
    let mut replies = ServerReflectionClient::new(service.channel())
        .server_reflection_info(tokio_stream::once(list))
        .await
        .expect("reflection is on")
        .into_inner();
    let reply = replies.next().await.expect("an answer").expect("an answer");
    let Some(MessageResponse::ListServicesResponse(ListServiceResponse { service: listed })) =
        reply.message_response
    else {
        panic!("{reply:?}")
    };
    let names: Vec<String> = listed.into_iter().map(|service| service.name).collect();
    for name in SERVICES.into_iter().chain(["grpc.health.v1.Health"]) {
        assert!(names.iter().any(|listed| listed == name), "{name} in {names:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_after_a_drive() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let drive = SimulatedDrive::through_the_hall(6);
    let batches = &drive.batches(20)[..12];
    let door = service.grpc();
    let session = driven(&door, "hall", &drive, batches).await;
    finished(&door, &session).await;
    let reply = service.http().get("/metrics");
    assert!(reply.header("content-type").starts_with("text/plain"), "{:?}", reply.headers);
    let text = reply.text();
    for name in [
        "meetpoint_batches_received",
        "meetpoint_scans_received",
        "meetpoint_scans_mapped",
        "meetpoint_ack_seconds_bucket",
        "meetpoint_journal_queue_depth",
        "meetpoint_mapping_queue_depth",
        "meetpoint_mapping_queue_age_seconds",
        "meetpoint_real_time_ratio",
        "meetpoint_database_seconds_bucket",
        "meetpoint_group_commit_batches_bucket",
    ] {
        assert!(text.lines().any(|line| line.starts_with(name)), "no {name} in {text}");
    }
    let received = text.lines().find_map(|line| line.strip_prefix("meetpoint_batches_received "));
    assert_eq!(received, Some("12"), "counted");
}

/// The page, the document and its viewer come from the binary and from nowhere else.
#[tokio::test(flavor = "multi_thread")]
async fn documents() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    service.grpc().create_map("hall", 0.05).await.expect("a new map");
    let http = service.http();
    let page = http.get("/");
    assert_eq!(page.status, 200, "{}", page.text());
    assert!(page.header("content-type").starts_with("text/html"), "{:?}", page.headers);
    assert!(page.text().contains("hall"), "the maps are listed: {}", page.text());
    let document = http.get("/openapi.json").json();
    assert!(document["openapi"].as_str().is_some_and(|text| text.starts_with("3.1")), "3.1");
    let stored: Value = serde_json::from_str(include_str!("../../clients/openapi.json"))
        .expect("the stored document is JSON");
    assert_eq!(document["paths"], stored["paths"], "clients/openapi.json is what is served");
    let docs = http.get("/docs/");
    assert_eq!(docs.status, 200, "{}", docs.text());
    assert!(docs.text().contains("swagger-ui"), "{}", docs.text());
    assert!(!docs.text().contains("https://"), "no CDN: {}", docs.text());
}

fn code(reply: &Reply) -> (u16, String) {
    let problem = reply.problem();
    (reply.status, problem["code"].as_str().unwrap_or_default().to_owned())
}

/// Whatever goes wrong over HTTP is a problem document with a stable code.
#[tokio::test(flavor = "multi_thread")]
async fn problems() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let http = service.http();
    let is = |reply: Reply, status: u16, name: &str| {
        assert_eq!(code(&reply), (status, name.to_owned()), "{}", reply.text());
    };
    is(http.get("/v1/teapots"), 404, "ROUTE_NOT_FOUND");
    is(http.delete("/v1/maps"), 405, "METHOD_NOT_ALLOWED");
    is(http.get("/v1/maps/none"), 404, "MAP_NOT_FOUND");
    is(http.get("/v1/maps?page_size=many"), 400, "INVALID_QUERY");
    is(http.get("/v1/maps?colour=red"), 400, "INVALID_QUERY");
    is(http.get("/v1/maps?page_token=%00"), 400, "INVALID_FIELD");
    let json = [("content-type", "application/json")];
    is(http.post_with("/v1/maps", &json, b"{"), 400, "MALFORMED_BODY");
    is(http.post_with("/v1/maps", &json, b"\xff\xfe"), 400, "MALFORMED_BODY");
    is(http.post_with("/v1/maps", &json, b""), 400, "MALFORMED_BODY");
    is(
        http.post_with("/v1/maps", &[("content-type", "text/xml")], b""),
        415,
        "UNSUPPORTED_MEDIA_TYPE",
    );
    is(http.post("/v1/maps", &json!({"id": 7})), 400, "INVALID_FIELD");
    is(http.post("/v1/maps", &json!({"id": "a", "colour": "red"})), 400, "INVALID_FIELD");
    let large = format!("{{\"id\": \"{}\"}}", "x".repeat(5 << 20));
    is(http.post_with("/v1/maps", &json, large.as_bytes()), 413, "MESSAGE_TOO_LARGE");
    let nested = http.post_with("/v1/maps", &json, "[".repeat(100_000).as_bytes());
    assert_eq!(nested.status, 400, "no stack is deep enough: {}", nested.problem());
    assert_eq!(http.get("/healthz").status, 200, "it goes on");
}

/// Makes a map under a key of the client's.
fn with_key(http: &Http, key: &str, id: &str) -> Reply {
    let headers = [("content-type", "application/json"), ("idempotency-key", key)];
    http.post_with("/v1/maps", &headers, json!({"id": id}).to_string().as_bytes())
}

/// A creation sent twice with the same key is done once, over a crash too.
#[tokio::test(flavor = "multi_thread")]
async fn created_once() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    let http = service.http();
    let first = with_key(&http, "k1", "once");
    assert_eq!(
        (first.status, first.header("location")),
        (201, "/v1/maps/once"),
        "{}",
        first.text()
    );
    service.kill();
    let service = Launch::at(data.path()).start();
    let http = service.http();
    let again = with_key(&http, "k1", "once");
    assert_eq!((again.status, &again.body), (201, &first.body), "the first reply again");
    assert_eq!(again.header("idempotency-replayed"), "true", "and it says so");
    assert_eq!(
        code(&with_key(&http, "k1", "other")),
        (422, "IDEMPOTENCY_KEY_REUSED".into()),
        "reused"
    );
    assert_eq!(code(&with_key(&http, "k2", "once")), (409, "MAP_EXISTS".into()), "another key");
}

/// Streams that stand are ended by an orderly stop, not waited for.
#[tokio::test(flavor = "multi_thread")]
async fn a_stop_ends_streams() {
    let data = empty_folder();
    let service = Launch::at(data.path()).start();
    service.grpc().create_map("hall", 0.05).await.expect("a new map");
    let mut events = service.http().events("/v1/events");
    let watch = v1::WatchMapRequest { map: "hall".to_owned() };
    let watched = service.grpc().maps.watch_map(watch).await;
    let mut watched = watched.expect("a stream").into_inner();
    service.stop();
    let last = events.next().map(|(name, problem)| (name, problem["code"].clone()));
    assert_eq!(last, Some(("error".to_owned(), "STOPPING".into())), "why it ends");
    let last = watched.message().await.map_err(Refused::from);
    assert_eq!(refused(last, "STOPPING").code, "STOPPING", "why it ends");
}
