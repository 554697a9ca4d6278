//! REST: JSON over HTTP, its OpenAPI document, health and metrics. Carries operations, decides
//! nothing.

mod arcs;
mod batches;
mod causal_schemas;
mod changes;
mod closures;
mod costs;
mod distinctive_places;
mod doors;
mod entity_tag;
mod events;
mod exploration;
mod geometry;
mod graphs;
mod grids;
mod health;
mod home;
mod hypotheses;
mod hypothesis_frame;
mod hypothesis_tree;
mod idempotency;
mod imports;
mod integer;
mod job_pictures;
mod jobs;
mod landmarks;
mod mapping_parameters;
mod maps;
mod merge_job;
mod merge_parts;
mod merges;
mod observations;
mod openapi;
mod page;
mod place_map;
mod places;
mod plan_tables;
mod planned_path;
mod plans;
mod problem;
mod profiles;
mod qualitative;
mod qualitative_reply;
mod reach;
mod regions;
mod relaxation;
mod reply;
mod request;
mod robots;
mod scan_relaxation;
mod sensors;
mod session_grids;
mod session_routes;
mod sessions;
mod sse;
mod tiles;
mod trajectories;
mod travels;
mod tum;
mod versions;
mod whereabouts;

use axum::Router;
use axum::extract::Request;
use axum::http::HeaderName;
use axum::middleware;
use axum::routing::get;
use tower::limit::GlobalConcurrencyLimitLayer;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::trace::TraceLayer;
use utoipa::OpenApi;
use utoipa_axum::router::{OpenApiRouter, UtoipaMethodRouterExt};
use utoipa_axum::routes;
use utoipa_swagger_ui::{Config, SwaggerUi};

use crate::service::Service;
pub(crate) use causal_schemas::CausalSchemas;
pub(crate) use changes::ChangeList;
pub(crate) use doors::DoorList;
pub(crate) use exploration::{Exploration, code_name as exploration_code_name};
pub(crate) use graphs::Graph;
pub(crate) use hypotheses::HypothesisList;
pub(crate) use imports::MapImport;
pub(crate) use mapping_parameters::{MappingParameters, MappingParametersState};
pub(crate) use place_map::PlaceMap;
pub(crate) use places::PlaceList;
pub(crate) use planned_path::PathReply;
pub(crate) use qualitative_reply::QualitativeDetail;

pub(crate) use trajectories::Trajectory;

/// Answers that draw a grid at the same time; more wait. A grid of the largest size takes some 200 MB
/// while it is drawn.
const N_DRAWN_AT_ONCE: usize = 4;
/// Names a request in answers and in the log. A caller's own is kept.
const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
/// The tile route as the router takes it (a parameter is a whole segment), and as it is.
const TILE_ROUTE: &str = "/v1/maps/{map}/versions/{version}/tiles/{z}/{x}/{y}";
const TILE_PATH: &str = "/v1/maps/{map}/versions/{version}/tiles/{z}/{x}/{y}.png";

/// What every handler works with.
#[derive(Clone)]
pub(crate) struct Rest {
    service: Service,
    keys_in_use: idempotency::KeysInUse,
}

/// REST, documentation, health and metrics. Every error is a problem document.
pub(crate) fn router(service: &Service) -> Router {
    let (routes, _) = api().split_for_parts();
    let rest = Rest { service: service.clone(), keys_in_use: idempotency::KeysInUse::default() };
    let docs = SwaggerUi::new("/docs")
        .url("/openapi.json", openapi())
        .config(Config::default().validator_url("none"));
    routes
        .route("/", get(home::home))
        .with_state(rest)
        .merge(docs)
        .layer(CatchPanicLayer::custom(problem::of_panic))
        .layer(middleware::from_fn(problem::written_out))
        .layer(CompressionLayer::new().gzip(true))
        .layer(middleware::from_fn(entity_tag::weakened))
        .layer(TraceLayer::new_for_http().make_span_with(span))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
}

/// The OpenAPI 3.1 document.
#[must_use]
pub fn openapi() -> utoipa::openapi::OpenApi {
    let (_, mut document) = api().split_for_parts();
    if let Some(tiles) = document.paths.paths.remove(TILE_ROUTE) {
        document.paths.paths.insert(TILE_PATH.to_owned(), tiles);
    }
    document
}

fn api() -> OpenApiRouter<Rest> {
    let drawing = GlobalConcurrencyLimitLayer::new(N_DRAWN_AT_ONCE);
    OpenApiRouter::with_openapi(openapi::Document::openapi())
        .routes(routes!(maps::list_maps, maps::create_map))
        .routes(routes!(maps::get_map))
        .routes(routes!(
            mapping_parameters::get_mapping_parameters,
            mapping_parameters::set_mapping_parameters
        ))
        .routes(routes!(imports::import_map))
        .routes(routes!(versions::list_map_versions))
        .routes(routes!(versions::get_map_version))
        .routes(routes!(versions::publish_map_version))
        .routes(routes!(grids::get_grid).layer(drawing.clone()))
        .routes(routes!(tiles::get_tile).layer(drawing.clone()))
        .routes(routes!(graphs::get_graph).layer(drawing.clone()))
        .routes(routes!(regions::get_region))
        .routes(routes!(changes::list_changes))
        .routes(routes!(doors::list_doors))
        .routes(routes!(landmarks::list_landmarks))
        .routes(routes!(whereabouts::get_whereabouts).layer(drawing.clone()))
        .routes(routes!(closures::list_closures))
        .routes(routes!(closures::switch_closure_off))
        .routes(routes!(closures::switch_closure_on))
        .routes(routes!(merges::list_merges))
        .routes(routes!(merges::get_merge))
        .routes(routes!(merges::get_merge_preview).layer(drawing.clone()))
        .routes(routes!(merges::accept_merge))
        .routes(routes!(merges::reject_merge))
        .routes(routes!(merges::undo_merge))
        .routes(routes!(hypotheses::list_hypotheses))
        .routes(routes!(hypotheses::get_hypothesis).layer(drawing.clone()))
        .routes(routes!(hypotheses::assert_hypothesis))
        .routes(routes!(hypotheses::undo_hypothesis))
        .routes(routes!(place_map::get_place_map).layer(drawing.clone()))
        .routes(routes!(causal_schemas::list_causal_schemas))
        .routes(routes!(travels::plan_travel))
        .routes(routes!(travels::get_next_travel))
        .routes(routes!(places::list_places).layer(drawing.clone()))
        .routes(routes!(plans::plan_path))
        .routes(routes!(plans::plan_matrix))
        .routes(routes!(plans::next_motion))
        .routes(routes!(reach::nearest_free))
        .routes(routes!(reach::reachable))
        .routes(routes!(exploration::get_exploration).layer(drawing.clone()))
        .routes(routes!(plan_tables::plan_tables))
        .routes(routes!(costs::list_costs, costs::create_cost))
        .routes(routes!(costs::delete_cost))
        .routes(routes!(arcs::close_arc))
        .routes(routes!(arcs::open_arc))
        .routes(routes!(arcs::set_arc_toll))
        .routes(routes!(profiles::list_profiles))
        .routes(routes!(profiles::set_profile, profiles::delete_profile))
        .routes(routes!(robots::list_robots, robots::create_robot))
        .routes(routes!(robots::get_robot))
        .routes(routes!(session_routes::list_sessions, session_routes::open_session))
        .routes(routes!(session_routes::get_session))
        .routes(routes!(session_routes::close_session))
        .routes(routes!(batches::ingest_batch))
        .routes(routes!(trajectories::get_trajectory))
        .routes(routes!(session_grids::get_session_grid).layer(drawing.clone()))
        .merge(told_step_by_step(drawing.clone()))
        .routes(routes!(jobs::list_jobs, jobs::create_job))
        .routes(routes!(jobs::get_job))
        .routes(routes!(jobs::cancel_job))
        .routes(routes!(jobs::watch_job))
        .routes(routes!(job_pictures::get_job_picture).layer(drawing))
        .routes(routes!(events::watch_events))
        .routes(routes!(health::healthz))
        .routes(routes!(health::readyz))
        .routes(routes!(health::metrics))
}

fn told_step_by_step(drawing: GlobalConcurrencyLimitLayer) -> OpenApiRouter<Rest> {
    OpenApiRouter::new()
        .routes(routes!(qualitative::get_next_step))
        .routes(routes!(qualitative::get_qualitative_exploration).layer(drawing))
        .routes(routes!(qualitative::begin_qualitative_exploration))
        .routes(routes!(qualitative::select_directions))
        .routes(routes!(qualitative::mark_home))
}

fn span(request: &Request) -> tracing::Span {
    let id = request_id(request);
    tracing::info_span!("request", method = %request.method(), path = request.uri().path(), id)
}

/// The request's id as the outermost layer set it.
fn request_id(request: &Request) -> String {
    let header = request.headers().get(REQUEST_ID).and_then(|value| value.to_str().ok());
    header.unwrap_or_default().to_owned()
}
